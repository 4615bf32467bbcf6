//! Block-compressed textures of levels: bytes, time to encode, and error of a texel and of an image.
//!
//! The blocks are decoded here, to the last bit as a device has to, and drawn as texels: software drivers decode BC5 by a rounding
//! of their own.

use std::sync::Arc;
use std::time::Instant;

use canopy::bake::cache::Cache;
use canopy::bake::levels::LevelSet;
use canopy::bake::levels::cross::{Cross, CrossTextures, SUN_SCALE};
use canopy::bake::levels::texture::BlockEncoding::{Pairs, Whole};
use canopy::bake::levels::texture::{BlockEncoding, LevelTexture};
use canopy::bake::{BakeSettings, BakedLevel, BakedPlant, bake_plant};
use canopy::math::MipChain;
use canopy::measure::LevelError;
use canopy::plant::Plant;

use super::planes::{errors, truths};
use super::trees;

/// Mips that are counted, from the finest.
const MIPS: usize = 5;
/// Suns under which a texel's light is compared: azimuth in radians, sine of the elevation.
const SUNS: [(f32, f32); 5] = [(0.3, 0.9), (1.2, 0.5), (2.9, 0.2), (4.0, 0.7), (5.3, 0.35)];

fn baked(plant: Plant) -> BakedPlant {
    let settings = BakeSettings { representations: LevelSet::all(), ..BakeSettings::default() };
    bake_plant(Arc::new(plant), &settings, Cache::of_user().as_ref()).0
}

/// What a device reads from the blocks of a texture.
fn decoded(texture: &LevelTexture, encoding: BlockEncoding) -> MipChain {
    texture.decoded(encoding).expect("blocks of this encoding")
}

/// Sums over texels.
#[derive(Default)]
struct Sums {
    square: f64,
    values: usize,
    lit: [f64; 6],
}

impl Sums {
    fn add_texels(&mut self, wanted: &[u8], got: &[u8]) {
        self.square += wanted.iter().zip(got).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum::<f64>();
        self.values += got.len();
    }

    fn add_light(&mut self, wanted: f64, got: f64) {
        let terms = [1.0, wanted, wanted * wanted, got, got * got, (got - wanted).powi(2)];
        self.lit.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }

    /// Root mean square of a value, of 255.
    fn rms(&self) -> f64 {
        (self.square / self.values as f64).sqrt()
    }

    /// Of the light of suns: relative error, ratio of the means, ratio of the deviations.
    fn light(&self) -> String {
        let [count, a, aa, b, bb, square] = self.lit;
        if count == 0.0 {
            return "| |".to_owned();
        }
        let (a, b) = (a / count, b / count);
        let deviation = |square: f64, mean: f64| (square / count - mean * mean).sqrt();
        let contrast = deviation(bb, b) / deviation(aa, a);
        format!("{:.3} | {:.3} | {contrast:.3}", (square / count).sqrt() / a, b / a)
    }
}

/// The light of a sun in a texel.
fn sunlight(first: &[u8], second: &[u8], (azimuth, y): (f32, f32)) -> f64 {
    let level = (1.0 - y * y).sqrt();
    let basis =
        canopy::bake::levels::cross::sun_basis(glam::Vec3::new(level * azimuth.cos(), y, level * azimuth.sin()));
    let value = |code: &u8| (f32::from(*code) - 128.0) / 127.0;
    let sum: f32 = first.iter().chain(second).zip(basis).map(|(code, basis)| value(code) * basis).sum();
    f64::from((SUN_SCALE * sum).max(0.0))
}

/// Encodes textures of one kind and prints what that costs. With `colors`, they are those of the sun.
fn row(name: &str, kind: &str, textures: &[LevelTexture], encoding: BlockEncoding, colors: Option<&[LevelTexture]>) {
    let start = Instant::now();
    let texels = textures.iter().map(|texture| texture.texels.clone());
    let encoded: Vec<_> = texels.map(|texels| LevelTexture::compressed(texels, encoding)).collect();
    let time = start.elapsed();
    let mut sums = Sums::default();
    let images: Vec<MipChain> = encoded.iter().map(|texture| decoded(texture, encoding)).collect();
    for (texture, image) in textures.iter().zip(&images) {
        for level in 0..MIPS.min(image.levels.len()) {
            sums.add_texels(&texture.texels.levels[level], &image.levels[level]);
        }
    }
    for (plane, color) in colors.into_iter().flatten().enumerate() {
        for level in 0..MIPS {
            let pair = |chains: [&MipChain; 2]| chains.map(|chain| chain.levels[level].as_chunks::<4>().0.to_vec());
            let [a, b] = pair([&textures[2 * plane].texels, &textures[2 * plane + 1].texels]);
            let [c, d] = pair([&images[2 * plane], &images[2 * plane + 1]]);
            for (at, texel) in color.texels.levels[level].as_chunks::<4>().0.iter().enumerate() {
                if texel[3] >= 128 {
                    for sun in SUNS {
                        sums.add_light(sunlight(&a[at], &b[at], sun), sunlight(&c[at], &d[at], sun));
                    }
                }
            }
        }
    }
    let bytes = |in_blocks| encoded.iter().map(|texture| texture.bytes(in_blocks)).sum::<usize>() as f64 / 1e6;
    println!(
        "| {name} | {kind} | {} | {:.2} | {:.2} | {:.0} | {:.1} | {} |",
        if encoding == Whole { "BC7" } else { "2 BC5" },
        bytes(false),
        bytes(true),
        1e3 * time.as_secs_f64(),
        sums.rms(),
        sums.light()
    );
}

/// Bytes, times and errors of texels.
fn textures(name: &str, plant: &BakedPlant) {
    if let Some(cross) = plant.cross() {
        let CrossTextures { color, properties, sun, light } = &cross.textures;
        row(name, "cross, colour", color, Whole, None);
        row(name, "cross, properties", properties, Whole, None);
        row(name, "cross, sky", light, Whole, None);
        row(name, "cross, sun", sun, Pairs, Some(color));
        row(name, "cross, sun", sun, Whole, Some(color));
    }
    if let Some(cloud) = plant.cloud() {
        let of = std::slice::from_ref;
        row(name, "cloud, colour", of(&cloud.textures.color), Whole, None);
        row(name, "cloud, properties", of(&cloud.textures.properties), Whole, None);
        row(name, "cloud, sky", cloud.textures.light.as_slice(), Whole, None);
    }
}

/// The crosses with what a device reads from their blocks in place of their texels.
fn as_read(cross: &Cross) -> Cross {
    let read = |textures: &[LevelTexture], encoding| {
        textures.iter().map(|texture| LevelTexture::plain(decoded(texture, encoding))).collect()
    };
    let CrossTextures { color, properties, sun, light } = &cross.textures;
    let textures = CrossTextures {
        color: read(color, Whole),
        properties: read(properties, Whole),
        sun: read(sun, Pairs),
        light: read(light, Whole),
    };
    Cross { textures, ..cross.clone() }
}

/// Crosses of texels and of blocks against the full model.
fn pictures(name: &str, plant: &BakedPlant) {
    let Some(cross) = plant.cross() else { return };
    let truths = truths(plant);
    let in_blocks = plant.clone().with_level(BakedLevel::Cross(Arc::new(as_read(cross))));
    for (kind, plant) in [("texels", plant), ("blocks", &in_blocks)] {
        for (size, error) in errors(plant, &truths) {
            let LevelError { rmse, coverage, luminance, contrast } = error;
            println!("| {name} | {kind} | {size} | {rmse:.3} | {coverage:.3} | {luminance:.3} | {contrast:.3} |");
        }
    }
}

pub fn compression() {
    let plants: Vec<_> = trees().into_iter().map(|(name, plant)| (name, baked(plant))).collect();
    println!();
    println!(
        "| tree | textures | blocks | texels, MB | blocks, MB | ms | RMS of 255 | sun: error | light | contrast |"
    );
    println!("|---|---|---|--:|--:|--:|--:|--:|--:|--:|");
    plants.iter().for_each(|(name, plant)| textures(name, plant));
    println!();
    println!("| tree | crosses of | size, px | RMSE | cover | light | contrast |");
    println!("|---|---|--:|--:|--:|--:|--:|");
    plants.iter().for_each(|(name, plant)| pictures(name, plant));
}
