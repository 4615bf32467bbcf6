//! Question: how near is a near tree's image to the truth, and by which light of its foliage?
//!
//! One tree and a small stand, at noon and against a low sun, are drawn with each light and traced by
//! [`canopy::app::reference`] from the same view in the same light, with the same tone curve. Every picture is compared
//! with the traced one: mean FLIP at 67 pixels per degree over the whole image, and where the trees are (where the
//! image without trees differs from the traced one) the relative RMSE and the light, both linear.
//!
//! `harmonics` is `transfer` with the sun through the transfer too, as published.
//!
//! The second table is of dense stands seen from above, with the light and against it, drawn as full models and as
//! crosses, by the default light: what neighbours do to a tree's light, which no bake of a single tree knows. Nothing
//! of it is fitted but the share of a crosses' leaves that is both lit and seen.
//!
//! With `--out` the images stay, and each row of the table is one more image: local, expressive, transfer, traced.

use std::path::{Path, PathBuf};

use anyhow::Context;
use canopy::{
    app::{
        LeafModel, LightGroup, Output, ReferenceOptions, RenderedImage, Renderer, Selection, Still, View,
        parse_lighting, parse_size, reference,
    },
    assets::Stage,
    math::srgb_to_linear,
    progress::Silent,
    render::components::Ground,
    scene::{LocalTime, Overrides, Scene},
};
use clap::Parser;
use nv_flip::{FlipImageRgb8, FlipPool, flip};

/// Images of near trees against the path tracer.
#[derive(Parser, Debug)]
#[command(name = "near")]
struct Arguments {
    /// Image size in pixels.
    #[arg(long, default_value = "480x480", value_parser = parse_size)]
    size: (u32, u32),
    /// Samples a pixel of the traced images.
    #[arg(long, default_value_t = 128)]
    spp: u32,
    /// Which tables.
    #[arg(long, value_delimiter = ',', default_value = "near,stands")]
    only: Vec<String>,
    /// Folder for the images.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Given by cargo.
    #[arg(long, hide = true)]
    bench: bool,
}

const SCENES: [&str; 2] = ["one_tree", "small_stand"];
const LIGHTS: [&str; 4] = ["local", "expressive", "transfer", "harmonics"];
/// How many of them have a place in the row of images.
const SHOWN: usize = 3;
/// Noon, with the sun high behind the camera, and evening, with the sun low on the left before it.
const HOURS: [(&str, &str); 2] = [("noon", "2026-06-21T12:30+01:00"), ("low sun", "2026-06-21T19:15+01:00")];
const PIXELS_PER_DEGREE: f32 = 67.0;

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let temporary = tempfile::tempdir()?;
    let folder = arguments.out.clone().unwrap_or_else(|| temporary.path().to_owned());
    std::fs::create_dir_all(&folder)?;
    if arguments.only.iter().any(|table| table == "near") {
        near(&arguments, &folder)?;
    }
    if arguments.only.iter().any(|table| table == "stands") {
        stands(&arguments, &folder)?;
    }
    Ok(())
}

fn near(arguments: &Arguments, folder: &Path) -> anyhow::Result<()> {
    println!(
        "| scene | hour | light | mean FLIP | relative RMSE of the trees | light of the trees |\n|---|---|---|--:|--:|--:|"
    );
    for scene in SCENES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes").join(scene).with_extension("ron");
        let read = Scene::read(&path)?;
        for (hour, at) in HOURS {
            let at: LocalTime = at.parse()?;
            let name = |what: &str| folder.join(format!("{scene}-{}-{what}.png", hour.replace(' ', "-")));
            let traced = trace(arguments, &read, at, &name("traced"))?;
            let bare = draw(arguments, &read, None, at)?;
            let mut row = Vec::new();
            for light in LIGHTS {
                let drawn = draw(arguments, &read, Some(light), at)?;
                let (flip, relative, share) = compare(&traced, &drawn, |index| of_tree(&traced, &bare, index));
                println!("| {scene} | {hour} | {light} | {flip:.4} | {relative:.3} | {share:.2} |");
                drawn.save(&name(light), &[])?;
                row.push(drawn);
            }
            row.truncate(SHOWN);
            row.push(traced);
            beside(&row).save(&name("all"), &[])?;
        }
    }
    Ok(())
}

/// Views of a stand of 120 m by 120 m: name, camera (x, height, z), yaw.
const VIEWS: [(&str, &str, u32); 2] = [("looking north", "(0, 32, 10)", 0), ("looking south", "(0, 32, -140)", 180)];
/// Hours of the stands: the sun 64 degrees high in the south, 9 degrees in the north-west, and 3 degrees under the
/// horizon.
const STAND_HOURS: [(&str, &str); 3] =
    [("noon", "2026-06-21T11:30+00:00"), ("low sun", "2026-06-21T18:15+00:00"), ("dusk", "2026-06-21T19:50+00:00")];

fn stands(arguments: &Arguments, folder: &Path) -> anyhow::Result<()> {
    println!(
        "\n| stand | view | hour | drawn as | light of the trees | relative RMSE | mean FLIP |\n|---|---|---|---|--:|--:|--:|"
    );
    let grown = "(name: \"broadleaf\", weight: 3, height: (15, 20), plant: Grown(form: Broadleaf, individuals: 2, \
                 triangles: 12000, seed: 1)), (name: \"conifer\", height: (15, 22), plant: Grown(form: Conifer, \
                 individuals: 1, triangles: 12000, seed: 11))";
    let mut kinds = vec![("grown", grown.to_owned(), 500)];
    let oak = std::env::var_os("CANOPY_DATA").map(|data| PathBuf::from(data).join("trees/oak-medium.glb"));
    if let Some(oak) = oak.filter(|oak| oak.exists()) {
        let species =
            format!("(name: \"oak\", height: (17, 19), plant: Gltf(files: [{:?}]))", oak.display().to_string());
        kinds.push(("oak", species, 282));
    }
    for (kind, species, stems) in kinds {
        for (view, position, yaw) in VIEWS {
            let stand = |drawn: &str, distance: u32| {
                let text = format!(
                    "(terrain: Flat(size: 400), species: [{species}], trees: Scattered(stems_per_hectare: {stems}, \
                     min_distance: 2, area: (west: -60, south: 10, east: 60, north: 130)), place: (latitude: 48, longitude: \
                     11, time: \"2026-06-21T11:30+00:00\"), camera: (start: (position: {position}, yaw: {yaw}, pitch: -14)), \
                     quality: (near_distance: {distance}, shadow_distance: 400))"
                );
                Scene::parse(&text, Path::new(&format!("{kind}-{drawn}.ron")))
            };
            let forms = [("models", stand("models", 2000)?), ("crosses", stand("crosses", 1)?)];
            for (hour, at) in STAND_HOURS {
                let at: LocalTime = at.parse()?;
                let name = |what: &str| folder.join(format!("{kind}-{view}-{hour}-{what}.png").replace(' ', "-"));
                let traced = trace(arguments, &forms[0].1, at, &name("traced"))?;
                // The lower part of the images is all trees.
                let canopy = |index: usize| index / traced.width as usize >= traced.height as usize * 5 / 12;
                for (form, scene) in &forms {
                    let drawn = draw(arguments, scene, Some("transfer"), at)?;
                    let (flip, relative, share) = compare(&traced, &drawn, canopy);
                    println!("| {kind} | {view} | {hour} | {form} | {share:.2} | {relative:.3} | {flip:.4} |");
                    drawn.save(&name(form), &[])?;
                }
            }
        }
    }
    Ok(())
}

/// The scene in one light; without one, the scene without its trees.
fn draw(arguments: &Arguments, scene: &Scene, light: Option<&str>, at: LocalTime) -> anyhow::Result<RenderedImage> {
    let overrides = Overrides { lighting: light.map(parse_lighting).transpose()?, ..Overrides::default() };
    let stage = Stage::build(&overrides.applied(scene.clone()), &mut Silent)?;
    let view = stage.scene.camera.start;
    let view = view.viewpoint(stage.terrain.height(view.position.0, view.position.2), stage.scene.camera.field_of_view);
    let mut renderer = Renderer::new(arguments.size, None, stage.scene.quality.msaa)?;
    match light {
        Some(_) => renderer.show(&stage),
        None => {
            renderer.app().world_mut().spawn(Ground { cover: None, ..stage.ground() });
        }
    }
    Ok(renderer.draw(&stage, &view, at.utc())?)
}

fn trace(arguments: &Arguments, scene: &Scene, at: LocalTime, out: &Path) -> anyhow::Result<RenderedImage> {
    let options = ReferenceOptions {
        scene: scene.clone().into(),
        output: Output::Stills(vec![Still { out: out.to_owned(), at: Some(at) }]),
        selection: Selection::All,
        part: None,
        view: View::Scene,
        size: arguments.size,
        samples: arguments.spp,
        bounces: None,
        light: LightGroup::All,
        leaf: LeafModel::default(),
        fog: true,
        resume: false,
        overrides: Overrides { lighting: Some(canopy::scene::Lighting::Local), ..Overrides::default() },
        quiet: true,
    };
    reference(&options, &mut Silent)?;
    let image = image::open(out).with_context(|| out.display().to_string())?.to_rgb8();
    Ok(RenderedImage { width: image.width(), height: image.height(), pixels: image.into_raw() })
}

/// Whether a tree stands in pixel `index`: where the image without trees differs from the traced one.
fn of_tree(truth: &RenderedImage, bare: &RenderedImage, index: usize) -> bool {
    let pixel = |picture: &RenderedImage| [0, 1, 2].map(|c| picture.pixels[3 * index + c]);
    pixel(truth).iter().zip(pixel(bare)).any(|(a, b)| a.abs_diff(b) >= 40)
}

/// Mean FLIP; in the pixels that are `counted`, by their index: relative RMSE, and light as a share of the truth's.
fn compare(truth: &RenderedImage, drawn: &RenderedImage, counted: impl Fn(usize) -> bool) -> (f32, f64, f64) {
    let flip_image = |picture: &RenderedImage| FlipImageRgb8::with_data(picture.width, picture.height, &picture.pixels);
    let mean = FlipPool::from_image(&flip(flip_image(truth), flip_image(drawn), PIXELS_PER_DEGREE)).mean();
    let linear = |code: u8| f64::from(srgb_to_linear(f32::from(code) / 255.0));
    let (mut squared, mut square, mut sum, mut of) = (0.0, 0.0, 0.0, 0.0);
    let pixels = truth.pixels.chunks_exact(3).zip(drawn.pixels.chunks_exact(3));
    for (_, (truth, drawn)) in pixels.enumerate().filter(|(index, _)| counted(*index)) {
        for (a, b) in truth.iter().zip(drawn) {
            let (a, b) = (linear(*a), linear(*b));
            squared += (a - b).powi(2);
            square += a * a;
            sum += b;
            of += a;
        }
    }
    (mean, (squared / square).sqrt(), sum / of)
}

/// The images of one size beside each other.
fn beside(pictures: &[RenderedImage]) -> RenderedImage {
    let (width, height) = pictures.first().map_or((0, 0), |picture| (picture.width, picture.height));
    let row = 3 * width as usize;
    let pixels = (0..height as usize)
        .flat_map(|y| pictures.iter().flat_map(move |picture| &picture.pixels[y * row..(y + 1) * row]))
        .copied()
        .collect();
    RenderedImage { width: width * pictures.len() as u32, height, pixels }
}
