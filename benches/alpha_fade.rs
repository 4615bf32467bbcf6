//! Question: which order of a fade pops less, leaf by leaf or from the centre of the image outwards?
//!
//! A tree changes its level of detail while its alpha threshold moves ([`canopy::lod::FadeBand`]). Here a crown is
//! drawn at every sixteenth of that way, as an image of its crosses, as its full model, and as both while one gives way
//! to the other, and each image is compared with the one before: the share of the crown's area that changes, root mean
//! square error of linear light, and mean FLIP [Andersson et al. 2020] at 67 pixels a degree. A fade that does not pop
//! changes little from step to step, and no step much more than the others. The crown stands before a bright sky, the
//! worst case: in a forest other trees are behind it.
//!
//! A second table asks what the order costs where nothing fades: the whole crown in each mip of its crosses, against
//! the mean of what the finest level shows there.
//!
//! Results: `docs/measurements/alpha-fade.md`.

#![allow(clippy::expect_used)]

use std::sync::Arc;

use canopy::bake::levels::cross::{CrossSettings, bake_cross};
use canopy::bake::lighting::BakedLighting;
use canopy::math::{linear_to_srgb, srgb_to_linear};
use canopy::plant::grow::{GrowParameters, grow};
use canopy::plant::texture::{AlphaFade, alpha_tested_mips, dilate_colors, fade_alpha};
use canopy::plant::{PartKind, Plant, PlantMaterial, PlantMesh, PlantPart};
use canopy::trace::{PlantTracer, Ray};
use glam::{Vec2, Vec3};
use image::RgbaImage;
use nv_flip::{FlipImageRgb8, FlipPool, flip};
use rayon::prelude::*;

/// Steps from nothing to the whole crown.
const STEPS: usize = 16;
/// The threshold moves from above 1 to one half, as in `canopy::lod`.
const RANGE: f32 = 0.51;
/// Samples a pixel along each axis.
const SAMPLES: usize = 4;
/// Linear light of the sky behind the crown.
const SKY: Vec3 = Vec3::new(0.5, 0.65, 0.9);
/// Light on the leaves, as a factor on their base colour.
const LIGHT: f32 = 2.0;
const PIXELS_PER_DEGREE: f32 = 67.0;

/// What a pixel shows.
#[derive(Clone, Copy)]
struct Pixel {
    coverage: f32,
    color: Vec3,
}

/// A square image of the crown alone.
type RenderedImage = Vec<Pixel>;

/// Largest and mean value of a series.
#[derive(Default)]
struct Series {
    largest: f64,
    sum: f64,
    count: usize,
}

impl Series {
    fn add(&mut self, value: f64) {
        self.largest = self.largest.max(value);
        self.sum += value;
        self.count += 1;
    }

    fn row(&self, digits: usize) -> String {
        format!("{:.digits$} | {:.digits$}", self.sum / self.count.max(1) as f64, self.largest)
    }
}

fn main() {
    fading();
    at_rest();
}

fn fading() {
    println!(
        "| crown | level | pixels | fade | area changed, mean | largest | RMSE, mean | largest | FLIP, mean | largest |"
    );
    println!("|---|---|--:|---|--:|--:|--:|--:|--:|--:|");
    for species in [GrowParameters::broadleaf(), GrowParameters::conifer()] {
        let tree = Arc::new(grow(&species, 1, 20_000).expect("a shipped species grows"));
        for level in 0..3 {
            for fade in [AlphaFade::PerLeaf, AlphaFade::CenterOut] {
                let settings = CrossSettings { fade, ..CrossSettings::default() };
                let chain = &bake_cross(&tree, &BakedLighting::Local, &settings).textures.color[0].texels;
                let (side, _) = chain.level_size(level);
                let picture = RgbaImage::from_raw(side, side, chain.levels[level].clone()).expect("a square image");
                report(&species.name, "crosses", side as usize, fade, |threshold| of_texture(&picture, threshold));
            }
        }
        for fade in [AlphaFade::PerLeaf, AlphaFade::CenterOut] {
            let crown = crown(&tree, fade, 256);
            report(&species.name, "model", 256, fade, |threshold| drawn(&with_thresholds(&crown, &[threshold]), 256));
        }
        for side in [256, 128] {
            for fade in [AlphaFade::PerLeaf, AlphaFade::CenterOut] {
                transition(&species.name, &tree, fade, side);
            }
        }
    }
}

/// The whole crown in the mips of its crosses.
fn at_rest() {
    println!();
    println!("| crown | mip | pixels | fade | area | RMSE | FLIP |");
    println!("|---|--:|--:|---|--:|--:|--:|");
    for species in [GrowParameters::broadleaf(), GrowParameters::conifer()] {
        let tree = Arc::new(grow(&species, 1, 20_000).expect("a shipped species grows"));
        for level in 1..6 {
            for fade in [AlphaFade::PerLeaf, AlphaFade::CenterOut] {
                let settings = CrossSettings { fade, ..CrossSettings::default() };
                let chain = &bake_cross(&tree, &BakedLighting::Local, &settings).textures.color[0].texels;
                let of = |level: usize| {
                    let (side, _) = chain.level_size(level);
                    let texture = RgbaImage::from_raw(side, side, chain.levels[level].clone());
                    of_texture(&texture.expect("a square image"), 0.5)
                };
                let side = chain.level_size(level).0 as usize;
                let (truth, mip) = (averaged(&of(0), chain.width as usize, 1 << level), of(level));
                let area = |picture: &RenderedImage| picture.iter().map(|pixel| f64::from(pixel.coverage)).sum::<f64>();
                println!(
                    "| {} | {level} | {side} | {fade:?} | {:.3} | {:.4} | {:.4} |",
                    species.name,
                    area(&mip) / area(&truth),
                    rmse(&truth, &mip),
                    mean_flip(&truth, &mip, side)
                );
            }
        }
    }
}

/// An image of `width` pixels a row with the mean of `times`² of them in each.
fn averaged(picture: &RenderedImage, width: usize, times: usize) -> RenderedImage {
    let side = width / times;
    let mean = |index: usize| {
        let (x, y) = (index % side * times, index / side * times);
        let of = (0..times * times).map(|at| &picture[(y + at / times) * width + x + at % times]);
        let (coverage, color) =
            of.fold((0.0, Vec3::ZERO), |(sum, color), p| (sum + p.coverage, color + p.coverage * p.color));
        Pixel { coverage: coverage / (times * times) as f32, color: color / coverage.max(1e-6) }
    };
    (0..side * side).map(mean).collect()
}

fn rmse(a: &RenderedImage, b: &RenderedImage) -> f64 {
    let square = a.iter().zip(b).map(|(a, b)| f64::from((shown(a) - shown(b)).length_squared() / 3.0)).sum::<f64>();
    (square / a.len() as f64).sqrt()
}

fn mean_flip(a: &RenderedImage, b: &RenderedImage, side: usize) -> f64 {
    let image = |picture: &RenderedImage| {
        let bytes: Vec<u8> = picture.iter().flat_map(|pixel| shown(pixel).to_array().map(byte)).collect();
        FlipImageRgb8::with_data(side as u32, side as u32, &bytes)
    };
    f64::from(FlipPool::from_image(&flip(image(a), image(b), PIXELS_PER_DEGREE)).mean())
}

fn report(crown: &str, level: &str, side: usize, fade: AlphaFade, draw: impl Fn(f32) -> RenderedImage) {
    let pictures: Vec<RenderedImage> = thresholds().map(draw).collect();
    compare(crown, level, side, fade, &pictures);
}

/// Thresholds from above 1, where nothing is left, to one half, where all is there.
fn thresholds() -> impl DoubleEndedIterator<Item = f32> {
    (0..=STEPS).map(|step| 0.5 + RANGE * (1.0 - step as f32 / STEPS as f32))
}

/// As the program draws it: crosses with this fade appear while the model is whole, then the model goes leaf by leaf.
fn transition(name: &str, tree: &Plant, fade: AlphaFade, side: usize) {
    let mut both = crown(tree, AlphaFade::PerLeaf, side);
    let foliage = both.parts.len();
    let own = Arc::new(Plant { name: "crown".into(), parts: foliage_of(tree) });
    let cross = bake_cross(&own, &BakedLighting::Local, &CrossSettings { fade, ..CrossSettings::default() });
    let (plane, chain) = (&cross.planes[0], &cross.textures.color[0].texels);
    let level = (0..chain.levels.len()).find(|&level| chain.level_size(level).0 as usize <= side).unwrap_or(0);
    let (width, height) = chain.level_size(level);
    let (center, u, v) = (plane.center, plane.u, plane.v);
    both.parts.push(PlantPart {
        kind: PartKind::Foliage,
        mesh: PlantMesh {
            positions: vec![center - u - v, center + u - v, center + u + v, center - u + v],
            normals: vec![plane.normal; 4],
            uvs: [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)].map(Vec2::from).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        },
        material: PlantMaterial {
            base_color_texture: RgbaImage::from_raw(width, height, chain.levels[level].clone()).map(Arc::new),
            ..PlantMaterial::default()
        },
    });
    let at = |model: f32, cross: f32| {
        let mut thresholds = vec![model; foliage];
        thresholds.push(cross);
        drawn(&with_thresholds(&both, &thresholds), side)
    };
    let appears = thresholds().map(|threshold| at(0.5, threshold));
    let goes = thresholds().rev().skip(1).map(|threshold| at(threshold, 0.5));
    compare(name, "model to crosses", side, fade, &appears.chain(goes).collect::<Vec<RenderedImage>>());
}

fn compare(crown: &str, level: &str, side: usize, fade: AlphaFade, pictures: &[RenderedImage]) {
    let area = |picture: &RenderedImage| picture.iter().map(|pixel| f64::from(pixel.coverage)).sum::<f64>();
    let whole = pictures.last().map_or(1.0, area).max(1.0);
    let (mut changed, mut error, mut difference) = (Series::default(), Series::default(), Series::default());
    for pair in pictures.windows(2) {
        let both = || pair[0].iter().zip(&pair[1]);
        changed.add(both().map(|(a, b)| f64::from((a.coverage - b.coverage).abs())).sum::<f64>() / whole);
        error.add(rmse(&pair[0], &pair[1]));
        difference.add(mean_flip(&pair[0], &pair[1], side));
    }
    let (changed, error, difference) = (changed.row(3), error.row(4), difference.row(4));
    println!("| {crown} | {level} | {side} | {fade:?} | {changed} | {error} | {difference} |");
}

fn shown(pixel: &Pixel) -> Vec3 {
    SKY.lerp(LIGHT * pixel.color, pixel.coverage).clamp(Vec3::ZERO, Vec3::ONE)
}

fn byte(linear: f32) -> u8 {
    (255.0 * linear_to_srgb(linear)).round() as u8
}

/// A texture with a texel a pixel, its alpha interpolated between texels and tested at [`SAMPLES`]² points of each.
fn of_texture(texture: &RgbaImage, threshold: f32) -> RenderedImage {
    let (width, height) = texture.dimensions();
    let alpha = |x: i64, y: i64| {
        let (x, y) = (x.clamp(0, i64::from(width) - 1), y.clamp(0, i64::from(height) - 1));
        f32::from(texture.get_pixel(x as u32, y as u32)[3]) / 255.0
    };
    let interpolated = |at: Vec2| {
        let (low, part) = ((at - 0.5).floor(), (at - 0.5).fract_gl());
        let (x, y) = (low.x as i64, low.y as i64);
        let row = |y: i64| alpha(x, y) * (1.0 - part.x) + alpha(x + 1, y) * part.x;
        row(y) * (1.0 - part.y) + row(y + 1) * part.y
    };
    let pixel = |(x, y, texel): (u32, u32, &image::Rgba<u8>)| {
        let corner = Vec2::new(x as f32, y as f32);
        let passing = points().filter(|&point| interpolated(corner + point) >= threshold).count();
        Pixel { coverage: passing as f32 / (SAMPLES * SAMPLES) as f32, color: linear(texel) }
    };
    texture.enumerate_pixels().map(pixel).collect()
}

fn foliage_of(tree: &Plant) -> Vec<PlantPart> {
    tree.parts.iter().filter(|part| part.kind == PartKind::Foliage).cloned().collect()
}

/// The foliage of a tree with the mip of the leaves' image that has about a texel a pixel, where the tree is `side`
/// pixels high.
fn crown(tree: &Plant, fade: AlphaFade, side: usize) -> Plant {
    let texel = tree.height() / side as f32;
    let mut parts = foliage_of(tree);
    for part in &mut parts {
        let Some(image) = &part.material.base_color_texture else { continue };
        let mut dilated = RgbaImage::clone(image);
        dilate_colors(&mut dilated);
        let chain = alpha_tested_mips(&fade_alpha(&dilated, part.material.alpha_cutoff, fade));
        // A card is as wide as half of its triangles' area is wide on each side.
        let area: f32 = part.mesh.triangles.iter().map(|&triangle| part.mesh.area(triangle)).sum();
        let card = (2.0 * area / part.mesh.triangles.len().max(1) as f32).sqrt();
        let width = |level: usize| chain.level_size(level).0;
        let fits = |&level: &usize| width(level) as f32 * texel <= card || width(level) <= 8;
        let level = (0..chain.levels.len()).find(fits).unwrap_or(0);
        let (width, height) = chain.level_size(level);
        let picture = RgbaImage::from_raw(width, height, chain.levels[level].clone());
        part.material.base_color_texture = picture.map(Arc::new);
    }
    Plant { name: "crown".into(), parts }
}

/// The plant with a threshold of the alpha test for each part.
fn with_thresholds(plant: &Plant, thresholds: &[f32]) -> Plant {
    let mut plant = plant.clone();
    for (part, &threshold) in plant.parts.iter_mut().zip(thresholds) {
        part.material.alpha_cutoff = threshold;
    }
    plant
}

/// A plant seen from +Z in a square of `side` pixels that is as high as the plant's top.
fn drawn(plant: &Plant, side: usize) -> RenderedImage {
    let height = plant.height();
    let tracer = PlantTracer::new(&Arc::new(plant.clone()));
    let sample = |at: Vec2| {
        let place = Vec2::new(at.x / side as f32 - 0.5, 1.0 - at.y / side as f32) * height;
        let ray = Ray { origin: place.extend(2.0 * height), direction: Vec3::NEG_Z, t_max: f32::INFINITY };
        tracer.closest(&ray).map(|hit| tracer.point(&hit).base_color)
    };
    let pixel = |index: usize| {
        let corner = Vec2::new((index % side) as f32, (index / side) as f32);
        let seen: Vec<Vec3> = points().filter_map(|point| sample(corner + point)).collect();
        let count = seen.len().max(1) as f32;
        Pixel {
            coverage: seen.len() as f32 / (SAMPLES * SAMPLES) as f32,
            color: seen.into_iter().sum::<Vec3>() / count,
        }
    };
    (0..side * side).into_par_iter().map(pixel).collect()
}

/// The sample points of a pixel.
fn points() -> impl Iterator<Item = Vec2> {
    let part = |index: usize| (index as f32 + 0.5) / SAMPLES as f32;
    (0..SAMPLES * SAMPLES).map(move |index| Vec2::new(part(index % SAMPLES), part(index / SAMPLES)))
}

fn linear(texel: &image::Rgba<u8>) -> Vec3 {
    let channel = |index: usize| srgb_to_linear(f32::from(texel[index]) / 255.0);
    Vec3::new(channel(0), channel(1), channel(2))
}
