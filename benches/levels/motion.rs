//! What changes from frame to frame: a tree that comes nearer, one that turns, and far slopes under a camera that turns slowly.

use std::path::Path;

use canopy::app::{RenderedImage, Renderer, Side, Studio};
use canopy::assets::Stage;
use canopy::lod::{Levels, Representation};
use canopy::math::{luminance, srgb_to_linear};
use canopy::progress::Silent;
use canopy::scene::{Quality, Scene};
use glam::Vec3;

use super::errors::{baked, sun};
use super::trees;

/// Pixels along a side of the images of a tree.
const IMAGE: u32 = 512;
/// Size of the tree in the first image and in the last, pixels.
const SIZES: (f64, f64) = (480.0, 6.0);
/// Ratio of a size to the one before.
const STEP: f64 = 0.99;

/// Cover of a tree over the square of its size, and its mean luminance.
type Look = [f64; 2];

/// A tree shrinks by one percent a frame: cover and luminance that a frame changes. Between two images the full model
/// changes neither, but for the samples that hit other leaves; so it is drawn in the same way for comparison.
pub fn pop() {
    println!();
    println!("| tree | levels | size, px | cover, mean change | largest | light, mean change | largest |");
    println!("|---|---|---|--:|--:|--:|--:|");
    for (name, plant) in trees() {
        let mut studio = Studio::new(baked(plant), IMAGE, None, 4).expect("a renderer");
        let chosen = Quality::default().lod_levels();
        for (what, levels) in [("as chosen", chosen), ("model", Levels::only(Representation::MODEL))] {
            studio.show_levels(Some(levels)).expect("a tree");
            let mut size = SIZES.0;
            let mut looks = Vec::new();
            while size >= SIZES.1 {
                let zoom = f64::from(IMAGE) / size;
                let image = studio.cutout(Side::South, &sun("2026-06-21T06:45:00Z"), zoom).expect("an image");
                looks.push((size, [image.area() / (size * size), image.mean_luminance()]));
                size *= STEP;
            }
            for (high, low) in [(480.0, 240.0), (240.0, 120.0), (120.0, 60.0), (60.0, 30.0), (30.0, 15.0), (15.0, 6.0)]
            {
                let within: Vec<Look> =
                    looks.iter().filter(|(size, _)| (low..=high).contains(size)).map(|(_, look)| *look).collect();
                let [cover, light] = [0, 1].map(|which| changes(&within, which));
                println!("| {name} | {what} | {high} to {low} | {cover} | {light} |");
            }
        }
    }
}

/// Turns from one image to the next: the yaws of a packed tree, over half a turn.
const YAWS: u32 = 128;
/// Size of the tree that turns, pixels.
const TURNED: f64 = 128.0;

/// A tree turns under a fixed sun: cover and luminance that a step of a yaw (1.4°) changes, as crosses and as the full model.
pub fn turn() {
    println!();
    println!("| tree | level | cover, mean change | largest | light, mean change | largest |");
    println!("|---|---|--:|--:|--:|--:|");
    for (name, plant) in trees() {
        let mut studio = Studio::new(baked(plant), IMAGE, None, 4).expect("a renderer");
        for level in [Representation::CROSS, Representation::MODEL] {
            let mut look = |yaw: u32| -> Look {
                studio.turn(yaw as f32 / YAWS as f32 * std::f32::consts::PI);
                studio.show(Some(level)).expect("a tree");
                let zoom = f64::from(IMAGE) / TURNED;
                let image = studio.cutout(Side::South, &sun("2026-06-21T06:45:00Z"), zoom).expect("an image");
                [image.area(), image.mean_luminance()]
            };
            let looks: Vec<Look> = (0..=YAWS).map(&mut look).collect();
            let [cover, light] = [0, 1].map(|which| changes(&looks, which));
            println!("| {name} | {} | {cover} | {light} |", level.name());
        }
    }
}

/// Mean and largest relative change from one look to the next, in percent.
fn changes(looks: &[Look], which: usize) -> String {
    let steps = looks.windows(2).map(|pair| (pair[1][which] / pair[0][which].max(1e-9) - 1.0).abs());
    let (sum, most, count) =
        steps.fold((0.0, 0.0f64, 0), |(sum, most, count), step| (sum + step, most.max(step), count + 1));
    format!("{:.2} % | {:.1} %", 100.0 * sum / f64::from(count.max(1)), 100.0 * most)
}

/// Frames of the camera that turns.
const FRAMES: u32 = 8;
/// Pixels that it turns by each frame.
const TURN: f64 = 0.1;
/// Size of the image.
const SIZE: (u32, u32) = (640, 360);
/// Pixels of the supersampled picture for each of the image, along a side: with four samples in each, 16 samples.
const TRUTH: u32 = 2;
/// Rows of the demo's picture, as parts of its height.
const BANDS: [(&str, f64, f64); 3] = [("far slopes", 0.38, 0.6), ("middle", 0.6, 0.8), ("near", 0.8, 1.0)];

/// The camera of the demo turns by a tenth of a pixel a frame: mean change of luminance, and that of a picture with
/// 16 samples a pixel.
pub fn shimmer() {
    let scene = Scene::read(Path::new("assets/scenes/demo.ron")).expect("the demo");
    let stage = Stage::build(&scene, &mut Silent).expect("the demo");
    let once = drift(&stage, 1);
    let truth = drift(&stage, TRUTH);
    println!();
    println!("| rows | change of a frame | with 16 samples | more |");
    println!("|---|--:|--:|--:|");
    for (index, (name, ..)) in BANDS.iter().enumerate() {
        let (ours, theirs) = (once[index], truth[index]);
        println!("| {name} | {:.2} % | {:.2} % | {:.2} % |", 100.0 * ours, 100.0 * theirs, 100.0 * (ours - theirs));
    }
}

/// Mean change of luminance from frame to frame over the mean luminance, in each band, of pictures with `times`² pixels for
/// each of the image.
fn drift(stage: &Stage, times: u32) -> [f64; 3] {
    let mut renderer =
        Renderer::new((SIZE.0 * times, SIZE.1 * times), None, stage.scene.quality.msaa).expect("a renderer");
    renderer.show(stage);
    let camera = &stage.scene.camera;
    let start = camera.start;
    let pixel = (0.5 * camera.field_of_view).to_radians().tan() * 2.0 / f64::from(SIZE.1);
    let pictures: Vec<Vec<f64>> = (0..FRAMES)
        .map(|frame| {
            let mut pose = start;
            pose.yaw += (f64::from(frame) * TURN * pixel).atan().to_degrees();
            let (x, _, z) = pose.position;
            let view = pose.viewpoint(stage.terrain.height(x, z), camera.field_of_view);
            luminances(&renderer.draw(stage, &view, stage.scene.place.time.utc()).expect("a picture"), times)
        })
        .collect();
    BANDS.map(|(_, top, bottom)| {
        let row = |part: f64| (part * f64::from(SIZE.1)) as usize * SIZE.0 as usize;
        let band = row(top)..row(bottom);
        let (mut change, mut sum) = (0.0, 0.0);
        for pair in pictures.windows(2) {
            for (a, b) in pair[0][band.clone()].iter().zip(&pair[1][band.clone()]) {
                change += (a - b).abs();
                sum += a;
            }
        }
        change / sum
    })
}

/// Linear luminance of each pixel of the image, the mean of `times`² of the picture.
fn luminances(picture: &RenderedImage, times: u32) -> Vec<f64> {
    let (width, times) = (picture.width as usize, times as usize);
    let at = |x: usize, y: usize| {
        let code = |channel: usize| srgb_to_linear(f32::from(picture.pixels[3 * (y * width + x) + channel]) / 255.0);
        f64::from(luminance(Vec3::new(code(0), code(1), code(2))))
    };
    let columns = width / times;
    let mean = |index: usize| {
        let (x, y) = (index % columns * times, index / columns * times);
        (0..times * times).map(|i| at(x + i % times, y + i / times)).sum::<f64>() / (times * times) as f64
    };
    (0..columns * (picture.height as usize / times)).map(mean).collect()
}
