//! Question: does a distant forest look like the traced one: its light, its contrast, and where both are?
//!
//! Scenes that nothing was fitted to are drawn and traced by [`canopy::app::reference`] from the same view in the same light,
//! with the same tone curve. The part of the images below the horizon is cut into bands, far, middle and near, and these into
//! blocks of 8 × 8 pixels. For each band:
//!
//! - light: mean luminance as a share of the truth's;
//! - contrast: the mean standard deviation of luminance in a block, as a share of the truth's;
//! - correlation of the blocks' means.
//!
//! Luminance is linear. The truth's own noise would count as contrast: two images with half of the samples each tell its
//! variance, which is subtracted.
//!
//! With `--out` the images stay.

use std::path::{Path, PathBuf};

use anyhow::Context;
use canopy::{
    app::{
        LeafModel, LightGroup, Output, ReferenceOptions, RenderedImage, Renderer, Selection, Still, View, parse_size,
        reference,
    },
    assets::Stage,
    math::{luminance, srgb_to_linear},
    progress::Silent,
    scene::{LocalTime, Overrides, Scene},
};
use clap::Parser;
use glam::Vec3;

/// Images of distant forests against the path tracer.
#[derive(Parser, Debug)]
#[command(name = "distant")]
struct Arguments {
    /// Image size in pixels.
    #[arg(long, default_value = "480x270", value_parser = parse_size)]
    size: (u32, u32),
    /// Samples a pixel of the traced images, an even number.
    #[arg(long, default_value_t = 32)]
    spp: u32,
    /// Folder for the images; traced ones that are there already are used again.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Given by cargo.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Pixels along a block's side.
const BLOCK: usize = 8;

/// A view of a scene, and the rows of its bands as fractions of the height.
struct Case {
    name: &'static str,
    scene: Scene,
    /// Whether it is drawn with crosses from 5 m on too, and not with the default levels alone.
    as_crosses: bool,
    at: LocalTime,
    /// Far, middle, near.
    bands: [(f64, f64); 3],
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let temporary = tempfile::tempdir()?;
    let folder = arguments.out.clone().unwrap_or_else(|| temporary.path().to_owned());
    std::fs::create_dir_all(&folder)?;
    println!("| view | levels | far | middle | near |\n|---|---|---|---|---|");
    for case in cases()? {
        let halves = [arguments.spp / 2, arguments.spp];
        let mut traced = Vec::new();
        for samples in halves {
            let kept = folder.join(format!("{}-{samples}.png", case.name));
            if !kept.exists() {
                let out = folder.join(format!("{}-traced.png", case.name));
                std::fs::copy(trace(&arguments, &case, samples, &out)?, &kept)?;
            }
            traced.push(read(&kept)?);
        }
        let [half, whole] = [&traced[0], &traced[1]].map(Luminance::new);
        let levels = [("default", None), ("crosses", Some(5.0))];
        for (levels, near_distance) in levels.into_iter().filter(|(_, near)| near.is_none() || case.as_crosses) {
            let drawn = draw(&arguments, &case, near_distance)?;
            drawn.save(&folder.join(format!("{}-{levels}.png", case.name)), &[])?;
            let drawn = Luminance::new(&drawn);
            let bands = case.bands.map(|(from, to)| {
                compare(&drawn, &half, &whole, from, to).map(|value| format!("{value:.2}")).join(" ")
            });
            println!("| {} | {levels} | {} |", case.name, bands.join(" | "));
        }
    }
    Ok(())
}

fn cases() -> anyhow::Result<Vec<Case>> {
    let demo = Scene::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/demo.ron"))?;
    let hour = |text: &str| text.parse::<LocalTime>();
    let demos = [
        ("demo-noon", demo.place.time),
        ("demo-low-sun", hour("2026-06-21T19:20-04:00")?),
        ("demo-dusk", hour("2026-06-21T20:40-04:00")?),
    ];
    let bands = [(0.38, 0.6), (0.6, 0.8), (0.8, 1.0)];
    let mut cases: Vec<Case> =
        demos.into_iter().map(|(name, at)| Case { name, scene: demo.clone(), as_crosses: false, at, bands }).collect();
    let Some(data) = std::env::var_os("CANOPY_DATA").map(PathBuf::from) else {
        eprintln!("note: CANOPY_DATA is not set, so the stands of given trees are left out");
        return Ok(cases);
    };
    let species = |name: &str, low: u32, high: u32| {
        let file = data.join("trees").join(format!("{name}-medium.glb")).display().to_string();
        format!("(name: \"{name}\", plant: Gltf(files: [{file:?}]), height: ({low}, {high}))")
    };
    let stand = |species: &[String], stems: u32, position: &str, yaw: u32, pitch: i32| {
        let text = format!(
            "(terrain: Noise(size: 1600, seed: 3), species: [{}], trees: Scattered(stems_per_hectare: {stems}, min_distance: 3, \
             area: (west: -500, south: -400, east: 500, north: 500)), place: (latitude: 48, longitude: 9, time: \
             \"2026-06-21T13:00+01:00\"), camera: (start: (position: {position}, yaw: {yaw}, pitch: {pitch})))",
            species.join(", ")
        );
        Scene::parse(&text, Path::new("stand.ron"))
    };
    let bands = [(0.45, 0.6), (0.6, 0.8), (0.8, 1.0)];
    let (noon, evening, dusk) =
        (hour("2026-06-21T13:00+01:00")?, hour("2026-06-21T19:00+01:00")?, hour("2026-06-21T20:15+01:00")?);
    let mixed = [species("oak", 14, 22), species("aspen", 12, 20), species("pine", 14, 24)];
    let (pines, oaks) = ([species("pine", 12, 22)], [species("oak", 14, 22)]);
    // Along a slope, and towards the evening's sun.
    let (along, against) = (("(0, 30, -300)", 0, -8), ("(300, 30, 0)", 290, -6));
    for (name, species, stems, (position, yaw, pitch), at) in [
        ("stand-noon", &mixed[..], 200, along, noon),
        ("stand-low-sun", &mixed[..], 200, along, evening),
        ("stand-against-the-sun", &mixed[..], 200, against, evening),
        ("stand-dusk", &mixed[..], 200, along, dusk),
        ("pines-noon", &pines[..], 400, along, noon),
        ("pines-low-sun", &pines[..], 400, along, evening),
        ("pines-against-the-sun", &pines[..], 400, against, evening),
        ("pines-dusk", &pines[..], 400, along, dusk),
        ("oaks-noon", &oaks[..], 300, along, noon),
        ("oaks-low-sun", &oaks[..], 300, along, evening),
    ] {
        cases.push(Case { name, scene: stand(species, stems, position, yaw, pitch)?, as_crosses: true, at, bands });
    }
    Ok(cases)
}

fn draw(arguments: &Arguments, case: &Case, near_distance: Option<f64>) -> anyhow::Result<RenderedImage> {
    let mut scene = case.scene.clone();
    scene.quality.near_distance = near_distance.unwrap_or(scene.quality.near_distance);
    let stage = Stage::build(&scene, &mut Silent)?;
    let view = stage.scene.camera.start;
    let view = view.viewpoint(stage.terrain.height(view.position.0, view.position.2), stage.scene.camera.field_of_view);
    let mut renderer = Renderer::new(arguments.size, None, stage.scene.quality.msaa)?;
    renderer.show(&stage);
    Ok(renderer.draw(&stage, &view, case.at.utc())?)
}

/// Traces `samples` a pixel, on top of those of an earlier call for the same file.
fn trace(arguments: &Arguments, case: &Case, samples: u32, out: &Path) -> anyhow::Result<PathBuf> {
    let options = ReferenceOptions {
        scene: case.scene.clone().into(),
        output: Output::Stills(vec![Still { out: out.to_owned(), at: Some(case.at) }]),
        selection: Selection::All,
        part: None,
        view: View::Scene,
        size: arguments.size,
        samples,
        bounces: None,
        light: LightGroup::All,
        leaf: LeafModel::default(),
        fog: true,
        resume: true,
        overrides: Overrides::default(),
        quiet: true,
    };
    reference(&options, &mut Silent)?;
    Ok(out.to_owned())
}

fn read(file: &Path) -> anyhow::Result<RenderedImage> {
    let image = image::open(file).with_context(|| file.display().to_string())?.to_rgb8();
    Ok(RenderedImage { width: image.width(), height: image.height(), pixels: image.into_raw() })
}

/// The linear luminance of an image.
struct Luminance {
    width: usize,
    height: usize,
    values: Vec<f64>,
}

impl Luminance {
    fn new(image: &RenderedImage) -> Self {
        let linear = |code: u8| srgb_to_linear(f32::from(code) / 255.0);
        let values = image.pixels.chunks_exact(3);
        let values = values.map(|p| f64::from(luminance(Vec3::new(linear(p[0]), linear(p[1]), linear(p[2])))));
        Self { width: image.width as usize, height: image.height as usize, values: values.collect() }
    }

    /// The whole blocks between two fractions of the height.
    fn blocks(&self, from: f64, to: f64) -> Vec<Vec<f64>> {
        let row = |fraction: f64| (fraction * self.height as f64) as usize / BLOCK;
        let columns = self.width / BLOCK;
        let block = |(row, column): (usize, usize)| -> Vec<f64> {
            let rows = (0..BLOCK).map(|y| (row * BLOCK + y) * self.width + column * BLOCK);
            rows.flat_map(|start| &self.values[start..start + BLOCK]).copied().collect()
        };
        (row(from)..row(to)).flat_map(|row| (0..columns).map(move |column| (row, column))).map(block).collect()
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len().max(1) as f64
}

/// Light, contrast and correlation of the blocks' means in a band. `half`: the truth with half of the samples of `whole`.
fn compare(drawn: &Luminance, half: &Luminance, whole: &Luminance, from: f64, to: f64) -> [f64; 3] {
    let [drawn, half, whole] = [drawn, half, whole].map(|image| image.blocks(from, to));
    let means = |blocks: &[Vec<f64>]| -> Vec<f64> { blocks.iter().map(|block| mean(block)).collect() };
    let (ours, truth) = (means(&drawn), means(&whole));
    let contrast = |blocks: &[Vec<f64>], noise: &[f64]| {
        let deviations = blocks.iter().zip(noise).map(|(block, noise)| (variance(block) - noise).max(0.0).sqrt());
        mean(&deviations.collect::<Vec<_>>())
    };
    // With a the mean of the first half and b that of both, the second half's is 2 b - a; b's variance is a quarter of
    // that of their difference, (2 a - 2 b) squared over 4.
    let noise = |(half, whole): (&Vec<f64>, &Vec<f64>)| {
        let squares = half.iter().zip(whole).map(|(a, b)| (a - b).powi(2));
        mean(&squares.collect::<Vec<_>>())
    };
    let noise: Vec<f64> = half.iter().zip(&whole).map(noise).collect();
    let (mean_ours, mean_truth) = (mean(&ours), mean(&truth));
    let covariance = ours.iter().zip(&truth).map(|(a, b)| (a - mean_ours) * (b - mean_truth)).sum::<f64>();
    let correlation = covariance / ours.len().max(1) as f64 / (variance(&ours) * variance(&truth)).sqrt();
    let none = vec![0.0; drawn.len()];
    [mean_ours / mean_truth, contrast(&drawn, &none) / contrast(&whole, &noise), correlation]
}
