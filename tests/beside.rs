//! Years and variants of an inventory side by side, as a user renders them.

use std::{path::Path, process::Output, sync::Arc};

use canopy::{
    assets::Stage,
    light::{Atmosphere, AtmosphereParams},
    progress::Silent,
    render::exposure::{CameraExposure, StandTotals},
    scene::{Overrides, Scene},
};
use glam::DVec3;
use image::{Rgb, RgbImage};

use crate::support::{
    gpu::gpu,
    program::{canopy, said},
};

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// Width and height of a panel.
const SIZE: (u32, u32) = (96, 54);
/// Pixels from one panel to the next.
const STEP: u32 = SIZE.0 + 2;

/// A wood that stands until 2010 and is felled but for its border, and in the variant `kept` not at all.
fn table() -> String {
    let mut text = "x_m,y_m,survey_year,variant,height_m\n".to_owned();
    for place in 0..400 {
        let (x, y) = (5 * (place % 20) - 47, 5 * (place / 20) - 47);
        let felled = if place % 20 < 4 { "" } else { "kept" };
        text.push_str(&format!("{x},{y},2000,,9\n{x},{y},2020,{felled},12\n"));
    }
    text + "48,49,2020,felled,3\n"
}

fn write(folder: &Path) -> std::io::Result<String> {
    let scene = folder.join("wood.ron");
    let text = "(name: \"wood\", terrain: Flat(size: 120), place: (latitude: 48, longitude: 9, time: \"2026-06-21T12:30+01:00\"), \
                species: [(name: \"broadleaf\", plant: Grown(form: Broadleaf, individuals: 2, triangles: 5000), height: (9, 12), \
                lighting: Local)], trees: Inventory(path: \"wood.csv\"), camera: (start: (position: (0, 1.7, 0), yaw: 250, pitch: 5), \
                path: [(seconds: 0, position: (0, 6, 45), yaw: 0, pitch: -5), (seconds: 4, position: (0, 6, 20), yaw: 20, pitch: -5)]), \
                quality: (shadow_map_size: 256, cascades: 1, shadow_distance: 80, msaa: 1, cross_resolution: 64, view_distance: 500))";
    std::fs::write(&scene, text)?;
    std::fs::write(folder.join("wood.csv"), table())?;
    Ok(scene.display().to_string())
}

/// Renders the scene `name` to `out`, with more arguments.
fn render(name: &str, out: &Path, more: &[&str]) -> std::io::Result<Output> {
    let (out, size) = (out.display().to_string(), format!("{}x{}", SIZE.0, SIZE.1));
    canopy(&[&["render", name, "--out", &out, "--size", &size][..], more].concat())
}

#[track_caller]
fn good(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", said(output));
}

fn is_caption(x: u32, y: u32) -> bool {
    x < 60 && y < 26
}

/// The greatest difference of a channel between panel `number` of `whole` and `single`, outside and inside of the caption.
fn difference(whole: &RgbImage, number: u32, single: &RgbImage) -> (u8, u8) {
    let (mut outside, mut inside) = (0, 0);
    for (x, y, Rgb(expected)) in single.enumerate_pixels() {
        let Rgb(found) = whole.get_pixel(number * STEP + x, y);
        let most = (0..3).map(|channel| found[channel].abs_diff(expected[channel])).max().unwrap_or(0);
        let part = if is_caption(x, y) { &mut inside } else { &mut outside };
        *part = most.max(*part);
    }
    (outside, inside)
}

#[test]
fn each_panel_is_the_picture_of_its_year_with_one_exposure_for_all() -> Outcome {
    let _gpu = gpu();
    let folder = tempfile::tempdir()?;
    let name = write(folder.path())?;
    let read = |out: &str, more: &[&str]| -> Result<RgbImage, Box<dyn std::error::Error>> {
        let out = folder.path().join(out);
        good(&render(&name, &out, more)?);
        Ok(image::open(out)?.to_rgb8())
    };
    let felled = ["--variant", "felled"];
    let single =
        |out: &str, year: &str, exposure: &[&str]| read(out, &[&felled[..], &["--year", year], exposure].concat());

    // The exposure of all panels is the mean of those that they have alone.
    let air = Atmosphere::new(AtmosphereParams::with_visibility_km(40.0))?;
    let own = |year: i32| -> Result<f32, Box<dyn std::error::Error>> {
        let overrides = Overrides { year: Some(year), variant: Some("felled".to_owned()), ..Overrides::default() };
        let stage = Stage::build(&overrides.applied(Scene::read(Path::new(&name))?), &mut Silent)?;
        let light = Arc::new(stage.sun(stage.scene.place.time.utc()).light(&air)?);
        let exposure = CameraExposure::new(light, StandTotals::of(&stage.stand, &stage.plants));
        Ok(exposure.at(&stage.ground(), DVec3::new(0.0, stage.terrain.height(0.0, 0.0) + 1.7, 0.0)).ev100)
    };
    let (before, after) = (own(2000)?, own(2020)?);
    assert!(before + 0.5 < after, "{before} in the wood, {after} after the felling");
    let mean = (0.5 * (f64::from(before) + f64::from(after))) as f32;
    let exposure = ["--exposure", &mean.to_string()];

    let whole = read("whole.png", &[&felled[..], &["--year", "2000,2020"]].concat())?;
    assert_eq!(whole.dimensions(), (STEP + SIZE.0, SIZE.1));
    for y in 0..SIZE.1 {
        assert!((SIZE.0..STEP).all(|x| whole.get_pixel(x, y) == &Rgb([128; 3])), "a grey line");
    }
    let (early, late) = (single("early.png", "2000", &exposure)?, single("late.png", "2020", &exposure)?);
    for (number, alone) in [(0, &early), (1, &late)] {
        let (outside, inside) = difference(&whole, number, alone);
        assert!(outside == 0 && inside > 60, "panel {number}: {outside} outside of its caption, {inside} in it");
    }
    // Controls: another year is another picture, and so is the year with its own exposure.
    assert!(difference(&whole, 0, &late).0 > 60 && difference(&whole, 1, &early).0 > 60);
    let own_exposure = single("own.png", "2020", &[])?;
    assert!(difference(&whole, 1, &own_exposure).0 > 5);

    // The order changes nothing but itself.
    let exchanged = read("exchanged.png", &[&felled[..], &["--year", "2020", "--year", "2000"]].concat())?;
    assert!(difference(&exchanged, 0, &late).0 == 0 && difference(&exchanged, 1, &early).0 == 0);
    Ok(())
}

#[test]
fn sequences_have_panels_and_are_kept_only_with_the_same_ones() -> Outcome {
    let _gpu = gpu();
    let folder = tempfile::tempdir()?;
    let name = write(folder.path())?;
    let out = folder.path().join("flight");
    let frames = ["--frames", "2", "--fps", "1", "--along", "1s"];
    let flight = |more: &[&str]| render(&name, &out, &[&frames[..], more].concat());
    let grid = ["--year", "2000,2020", "--variant", "kept, felled"];
    good(&flight(&grid)?);
    let picture = |number: u32| image::open(out.join(format!("{number:04}.png"))).map(|image| image.to_rgb8());
    let (first, second) = (picture(0)?, picture(1)?);
    assert_eq!(first.dimensions(), (STEP + SIZE.0, SIZE.1 + 2 + SIZE.1));
    assert!(first != second, "the camera moves");

    let kept = flight(&[&grid[..], &["--skip-existing"]].concat())?;
    assert!(said(&kept).contains("2 of 2 images are finished already"), "{}", said(&kept));
    // As many panels of the same size, in another order.
    let others = flight(&["--year", "2000,2020", "--variant", "felled,kept", "--skip-existing", "--frames-only", "0"])?;
    good(&others);
    assert!(!said(&others).contains("finished already"), "{}", said(&others));
    assert!(picture(0)? != first && picture(1)? == second);
    Ok(())
}

#[test]
fn what_cannot_be_shown_side_by_side_is_refused_before_the_bake() -> Outcome {
    let folder = tempfile::tempdir()?;
    let name = write(folder.path())?;
    let out = folder.path().join("a.png");
    for (more, code, words) in [
        (&["--year", "2000,2015"][..], 1, "wood.csv: there is no survey of 2015; its years are 2000, 2020"),
        (&["--year", "2000,2000"], 1, "the year 2000 is named twice"),
        (&["--variant", "kept,cut"], 1, "there is no variant `cut`; its variants are kept, felled"),
        (&["--year", "2000,soon"], 2, "soon"),
    ] {
        let output = render(&name, &out, more)?;
        assert_eq!(output.status.code(), Some(code), "{more:?}: {}", said(&output));
        assert!(said(&output).contains(words), "{more:?}: {}", said(&output));
    }
    let grid = ["--year", "2000,2020", "--variant", "kept,felled", "--size", "9000x9000"];
    let large = canopy(&[&["render", &name, "--out", &out.display().to_string()][..], &grid].concat())?;
    assert_eq!(large.status.code(), Some(1));
    assert!(said(&large).contains("2 x 2 panels are a picture of 18050 x 18050 pixels"), "{}", said(&large));
    let fly = canopy(&["fly", &name, "--year", "2000,2020"])?;
    assert_eq!(fly.status.code(), Some(2));
    assert!(said(&fly).contains("only `canopy render` shows several side by side"), "{}", said(&fly));
    std::fs::write(folder.path().join("wood.csv"), "x,y\n1,2\n3,4\n")?;
    let single = render(&name, &out, &["--year", "2000,2020"])?;
    assert_eq!(single.status.code(), Some(1));
    assert!(said(&single).contains("wood.csv: no column has years of surveys"), "{}", said(&single));
    std::fs::write(&name, "(terrain: Flat(size: 100), place: (latitude: 48, longitude: 9))")?;
    let bare = render(&name, &out, &["--variant", "a,b"])?;
    assert!(said(&bare).contains("wood.ron: its trees are of no inventory"), "{}", said(&bare));
    assert!(!out.exists());
    Ok(())
}
