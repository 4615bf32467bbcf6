//! Whole images: against references, against each other, and that each depends on its arguments alone.

use canopy::{
    app::RenderedImage,
    assets::Stage,
    lod::{FadeBand, Levels},
    render::components::{CanopyOrigin, Forest, SunShadowSettings},
    scene::Viewpoint,
};
use glam::{DVec2, DVec3};

use super::{DUSK, NIGHT, NOON, SIZE, draw, renderer, showing};
use crate::support::{
    glb::TreeFile,
    gpu::gpu,
    image::{SAME, compare, difference, keep, luminance, mean_color},
    program::{command, said},
    stage::{BROADLEAF, PLACE, build, grove, instant, project, quality, trees_at, view},
};

pub fn over_the_grove(stage: &Stage) -> Viewpoint {
    view(stage, (-20.0, 7.0, 62.0), 14.0, -3.0)
}

#[track_caller]
fn whole(picture: &RenderedImage) -> f64 {
    luminance(mean_color(picture, |_, _| true))
}

#[test]
fn noon_dusk_and_night_look_like_their_references() {
    let gpu = gpu();
    let built = grove(4);
    let view = over_the_grove(&built.stage);
    let mut renderer = showing(&built.stage);
    let [noon, dusk, night] = [NOON, DUSK, NIGHT].map(|at| draw(&mut renderer, &built.stage, &view, at));
    for (picture, name) in [(&noon, "noon"), (&dusk, "dusk"), (&night, "night")] {
        keep(picture, name);
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());

    // A night is dark, blue, and still readable.
    assert!(whole(&night) < 0.5 * whole(&noon), "night {} noon {}", whole(&night), whole(&noon));
    assert!(whole(&night) > 0.002, "{}", whole(&night));
    let [r, _, b] = mean_color(&night, |_, _| true);
    assert!(b > 1.2 * r, "red {r} blue {b}");
    // The rim of the sky is warm at dusk, not at noon.
    let warmth = |picture: &RenderedImage| {
        let [r, _, b] = mean_color(picture, |_, row| row < SIZE.1 / 5);
        r / b
    };
    assert!(warmth(&dusk) > 1.15 * warmth(&noon), "dusk {} noon {}", warmth(&dusk), warmth(&noon));
    // A control: another hour is another image.
    assert!(difference(&dusk, &noon) > 4.0 * SAME, "{}", difference(&dusk, &noon));

    for (picture, name) in [(&noon, "noon"), (&dusk, "dusk"), (&night, "night")] {
        compare(picture, name, SAME);
    }
}

#[test]
fn an_inventory_looks_like_its_reference() {
    let gpu = gpu();
    let places: Vec<DVec2> =
        (0..36).map(|i| DVec2::new(f64::from(i % 6) * 9.0 - 22.0, f64::from(i / 6) * -11.0 + 10.0)).collect();
    let built = trees_at(&places, 1);
    assert_eq!(built.stage.stand.trees.len(), 36);
    let view = view(&built.stage, (-6.0, 9.0, 44.0), 8.0, -9.0);
    let picture = draw(&mut showing(&built.stage), &built.stage, &view, NOON);
    keep(&picture, "inventory");
    assert_eq!(gpu.messages(), Vec::<String>::new());
    compare(&picture, "inventory", SAME);
}

#[test]
fn a_gltf_tree_looks_like_its_reference() {
    let gpu = gpu();
    let quality = quality(1);
    let built = build(
        &format!(
            "(seed: 3, terrain: Flat(size: 200), species: [(name: \"ball\", plant: Gltf(files: [\"ball.glb\"]), \
             height: (7.9, 8.1))], trees: Inventory(path: \"trees.csv\"), {PLACE}, {quality})"
        ),
        &[("ball.glb", &TreeFile::default().bytes()), ("trees.csv", b"x,y\n-5,12\n5,5\n-9,-20\n9,-48\n0,-90\n")],
    );
    assert_eq!(built.warnings, Vec::<String>::new());
    let view = view(&built.stage, (0.0, 3.0, 22.0), 0.0, 4.0);
    let picture = draw(&mut showing(&built.stage), &built.stage, &view, NOON);
    keep(&picture, "gltf_tree");
    assert_eq!(gpu.messages(), Vec::<String>::new());
    compare(&picture, "gltf_tree", SAME);
}

#[test]
fn a_scene_without_trees_looks_like_its_reference() {
    let gpu = gpu();
    let quality = quality(4);
    let built = build(
        &format!(
            "(terrain: Noise(size: 200, amplitude: 9, wavelength: 90, base: 300, seed: 3), species: [{BROADLEAF}], \
             trees: Scattered(elevation: (5000, 6000)), {PLACE}, {quality})"
        ),
        &[],
    );
    assert!(built.stage.forest().is_none());
    assert!(built.warnings.iter().any(|warning| warning.contains("no place for any tree")), "{:?}", built.warnings);
    let picture = draw(&mut showing(&built.stage), &built.stage, &over_the_grove(&built.stage), NOON);
    keep(&picture, "zero_trees");
    assert_eq!(gpu.messages(), Vec::<String>::new());
    compare(&picture, "zero_trees", SAME);
}

#[test]
fn crowns_are_lit_and_the_ground_below_them_is_dark() {
    let _gpu = gpu();
    let places: Vec<DVec2> =
        (0..25).map(|i| DVec2::new(f64::from(i % 5) * 5.0 - 10.0, f64::from(i / 5) * 5.0 - 10.0)).collect();
    let built = trees_at(&places, 4);
    let stage = &built.stage;
    // From the south, where the noon sun stands, at the southern rim of the stand.
    let from = view(stage, (0.0, 5.0, 34.0), 0.0, 0.0);
    let picture = draw(&mut showing(stage), stage, &from, NOON);
    keep(&picture, "crowns");
    let around = |point: DVec3, reach: f64| {
        let at = project(&from, SIZE, point).expect("before the camera");
        luminance(mean_color(&picture, |column, row| {
            (DVec2::new(f64::from(column), f64::from(row)) - at).abs().max_element() <= reach
        }))
    };
    let crown = around(DVec3::new(0.0, 7.5, 10.0), 6.0);
    // The sun stands 65 degrees high: crowns shade the ground three metres north of their trunks.
    let floor = around(DVec3::new(0.0, 0.0, 6.7), 1.5);
    let meadow = around(DVec3::new(0.0, 0.0, 20.0), 3.0);
    // The path tracer: 0.91 and 4.7 times the floor.
    assert!((0.75..1.35).contains(&(crown / floor)), "crown {crown}, floor {floor}");
    assert!(meadow > 2.5 * floor, "meadow {meadow}, floor {floor}");
}

/// The grove from afar, with its change from models to crosses at `distance` metres.
fn changing_at(stage: &Stage, distance: f32, at: &str) -> RenderedImage {
    let mut renderer = renderer(1);
    renderer.set_instant(stage, instant(at));
    renderer.set_view(&view(stage, (0.0, 12.0, 170.0), 0.0, -3.0));
    let world = renderer.app().world_mut();
    world.spawn(stage.ground());
    world.spawn(Forest {
        levels: Levels::model_and_cross(FadeBand::new(distance, 0.1)),
        ..stage.forest().expect("a forest")
    });
    renderer.set_shadow(stage.shadow());
    super::again(&mut renderer)
}

/// Crosses once had two thirds of their models' light: the mean of many leaves' cosines is not the cosine of their
/// mean.
#[test]
fn crosses_have_the_light_of_their_models() {
    let _gpu = gpu();
    let built = grove(1);
    // A control: at night there is less light.
    let night = changing_at(&built.stage, 0.0, NIGHT);
    for (hour, at) in [NOON, "2026-06-21T18:00+01:00"].into_iter().enumerate() {
        let models = changing_at(&built.stage, 1e6, at);
        let crosses = changing_at(&built.stage, 0.0, at);
        keep(&models, &format!("models-{hour}"));
        keep(&crosses, &format!("crosses-{hour}"));
        // What is green in both: leaves, without the ground and the sky between them.
        let pixel = |picture: &RenderedImage, column: u32, row: u32| {
            let first = 3 * (row * picture.width + column) as usize;
            [0, 1, 2].map(|channel| u32::from(picture.pixels[first + channel]))
        };
        let is_leaf = |column, row| {
            let [a, b] = [&models, &crosses].map(|picture| pixel(picture, column, row));
            [a, b].iter().all(|[red, green, blue]| 2 * green > 3 * red && 4 * green > 5 * blue)
        };
        let light = |picture: &RenderedImage| luminance(mean_color(picture, is_leaf));
        let [same, other] = [&crosses, &night].map(|picture| light(picture) / light(&models));
        assert!((0.85..1.15).contains(&same), "{at}: {same} of the models' light");
        assert!(!(0.85..1.15).contains(&other), "{at}: {other} of the models' light at night");
    }
}

#[test]
fn an_image_has_the_same_bytes_with_any_number_of_threads() {
    let _gpu = gpu();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = folder.path().join("scene.ron");
    let text = format!(
        "(terrain: Noise(size: 200, amplitude: 6, seed: 3), {PLACE}, {}, trees: Scattered(stems_per_hectare: 110), \
         species: [{BROADLEAF}])",
        quality(1)
    );
    std::fs::write(&scene, text).expect("a temporary file");
    let drawn = |threads: &str| {
        let out = folder.path().join(format!("{threads}.png"));
        let mut render = command(&["render", "--size", "96x54", "--quiet"]);
        render.env("RAYON_NUM_THREADS", threads).env("LP_NUM_THREADS", threads).arg(&scene).arg("--out").arg(&out);
        let output = render.output().expect("the program");
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        std::fs::read(out).expect("an image")
    };
    let one = drawn("1");
    for threads in ["2", "5"] {
        assert!(drawn(threads) == one, "{threads} threads draw another image");
    }
}

#[test]
fn an_image_depends_on_its_arguments_alone() {
    let _gpu = gpu();
    let built = grove(4);
    let stage = &built.stage;
    let here = over_the_grove(stage);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let bytes = |picture: &RenderedImage, name: &str| {
        let path = folder.path().join(name);
        picture.save(&path, &[("Software", "test".to_owned())]).expect("an image on disk");
        std::fs::read(path).expect("the image")
    };
    let fresh = draw(&mut showing(stage), stage, &here, DUSK);
    let twice = draw(&mut showing(stage), stage, &here, DUSK);
    assert_eq!(bytes(&fresh, "a.png"), bytes(&twice, "b.png"), "two renderers differ");

    let mut travelled = showing(stage);
    draw(&mut travelled, stage, &view(stage, (30.0, 2.0, -40.0), 200.0, 5.0), NOON);
    draw(&mut travelled, stage, &view(stage, (4000.0, 90.0, 900.0), 100.0, -20.0), NIGHT);
    let after = draw(&mut travelled, stage, &here, DUSK);
    assert!(after == fresh, "the frames before show: mean FLIP {}", difference(&after, &fresh));
    let still = super::again(&mut travelled);
    assert!(still == fresh, "a resting image changes: mean FLIP {}", difference(&still, &fresh));
}

/// An image of the grove's trees alone, with the whole scene moved by `offset` metres.
#[track_caller]
fn moved(stage: &Stage, offset: DVec3, cascades: usize) -> RenderedImage {
    let mut renderer = renderer(4);
    let mut view = over_the_grove(stage);
    view.position += offset;
    renderer.set_instant(stage, instant(NOON));
    renderer.set_view(&view);
    let forest = Forest { origin: offset, ..stage.forest().expect("a forest") };
    let world = renderer.app().world_mut();
    world.spawn(forest);
    renderer.set_shadow(SunShadowSettings { cascades, ..stage.shadow() });
    assert!(
        (renderer.app().world().resource::<CanopyOrigin>().0 - view.position).length() < 2048.0,
        "the origin follows the camera"
    );
    super::again(&mut renderer)
}

#[test]
fn a_million_metres_out_nothing_jitters() {
    let _gpu = gpu();
    let built = grove(4);
    let far_off = DVec3::new(1.0e6, 0.0, -1.0e6);
    // The light alone: positions are the same to a hundredth of a millimetre.
    let (near, far) = (moved(&built.stage, DVec3::ZERO, 0), moved(&built.stage, far_off, 0));
    keep(&far, "million");
    assert!(difference(&far, &near) < 0.001, "mean FLIP {}", difference(&far, &near));
    assert!(near.pixels.chunks(3).any(|pixel| pixel[1] < 100), "no tree is in the image");
    // With shadows: the maps' texels lie on a grid of their own, so that leaves' edges fall otherwise.
    let (near, far) = (moved(&built.stage, DVec3::ZERO, 2), moved(&built.stage, far_off, 2));
    keep(&far, "million-shadows");
    keep(&near, "million-shadows-near");
    assert!(difference(&far, &near) < 0.03, "mean FLIP {}", difference(&far, &near));
}

#[test]
fn nothing_flickers_as_the_sun_sets() {
    let gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let view = over_the_grove(stage);
    let mut renderer = showing(stage);
    let mut before: Option<(f64, f64)> = None;
    // From 3 degrees above the horizon to 8 below it: the key light changes from the sun to the moon.
    for minute in (0..96).step_by(4) {
        let at = format!("2026-06-21T{:02}:{:02}+01:00", 20 + minute / 60, minute % 60);
        let picture = draw(&mut renderer, stage, &view, &at);
        let light = whole(&picture);
        keep(&picture, &format!("sunset-{minute:02}"));
        let black = picture.pixels.chunks(3).filter(|pixel| *pixel == [0, 0, 0]).count() as f64
            / f64::from(picture.width * picture.height);
        assert!(light > 0.002, "{at}: mean luminance {light}");
        assert!(black < 0.02, "{at}: {black} of the image is black");
        if let Some((light_before, _)) = before {
            let step = light / light_before;
            assert!((0.75..1.33).contains(&step), "{at}: {step} times as light as four minutes before");
        }
        before = Some((light, black));
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}
