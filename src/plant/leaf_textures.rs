//! Textures of a leaf, derived from others [Franzke 2005, 3.2.2].
//!
//! ```text
//!  Y = luminance of the transmission over the mask, its 1st to 99th percentile stretched to 0..1
//!  thickness  = 1 - Y      optionally high-passed: mean + (1 - Y) - blurred (1 - Y)
//!  absorption = 1 - Y      the veins, which are dark against the light, absorb more [p. 49]
//! ```
//!
//! The thesis says that the absorption is the luminance, which contradicts its own p. 49; [`Sign::Published`] does so.
//! It leaves open how the textures are scaled: the stretch is ours. It takes transmission and back from photographs;
//! where there are none they are guessed from the front ([`transmission_of`], [`back_of`]).

use std::sync::Arc;

use glam::{Vec2, Vec3};
use image::{GrayImage, Luma, Rgba, RgbaImage, imageops};

use super::surface::{color_of, filled, value_of};
use super::{LeafTextures, LeafTissue, Measured, PlantMaterial};
use crate::math::color::{srgb8, unorm8};
use crate::math::{linear_to_srgb, luminance};

/// Value of thickness and absorption where nothing tells more.
pub(crate) const EVEN: f32 = 0.5;
/// Share of its luminance that the back of a leaf reflects more than its front, without colour: the lower epidermis
/// scatters light before it meets the chlorophyll.
const PALER: f32 = 0.3;
/// Least difference of luminance that a texture is stretched over.
const LEAST_CONTRAST: f32 = 1e-3;

/// How the absorption follows from the luminance of the transmission.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sign {
    /// What is dark absorbs more.
    #[default]
    Dark,
    /// What is bright absorbs more, as the thesis prints it in 3.2.2.
    Published,
}

/// Settings of the derivation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Derivation {
    /// How the absorption follows from the luminance.
    pub sign: Sign,
    /// Standard deviation of the blur of the high-pass filter on the thickness, as a fraction of the texture's longer
    /// side; `None`: no filter.
    pub high_pass: Option<f32>,
}

/// Where texture coordinates of a texel's centre lie.
fn center((x, y): (u32, u32), (width, height): (u32, u32)) -> Vec2 {
    Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32)
}

/// The size that a derived texture has: that of the transmission, otherwise that of the front; `None` without either.
fn size_of(material: &PlantMaterial) -> Option<(u32, u32)> {
    let image = filled(&material.leaf_textures.transmission).or_else(|| filled(&material.base_color_texture));
    image.map(|image| image.dimensions())
}

/// Whether the leaf is there.
fn covered(material: &PlantMaterial, uv: Vec2) -> bool {
    let Some(front) = filled(&material.base_color_texture) else { return true };
    let at = uv * Vec2::new(front.width() as f32, front.height() as f32);
    front
        .get_pixel_checked(at.x as u32, at.y as u32)
        .is_some_and(|texel| f32::from(texel[3]) >= 255.0 * material.alpha_cutoff)
}

/// Linear base colour of the front, 0..=1.
fn front_at(material: &PlantMaterial, uv: Vec2) -> Vec3 {
    let texture = filled(&material.base_color_texture);
    texture.map_or(Vec3::ONE, |image| color_of(&image, uv)) * material.base_color
}

/// Linear transmission, 0..=1: that of the texture, otherwise derived from the front.
pub(crate) fn transmission_at(material: &PlantMaterial, uv: Vec2) -> Vec3 {
    match filled(&material.leaf_textures.transmission) {
        Some(image) => color_of(&image, uv),
        None => material.transmitted(front_at(material, uv)),
    }
}

/// Thickness and absorption of a leaf, of equal size, from its transmission. `None` where no texture tells one place from
/// another.
pub fn thickness_and_absorption(material: &PlantMaterial, how: Derivation) -> Option<[GrayImage; 2]> {
    let size = size_of(material)?;
    let (width, height) = size;
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let values: Vec<f32> = places.clone().map(|at| luminance(transmission_at(material, center(at, size)))).collect();
    let mut of_leaf: Vec<f32> = places
        .zip(&values)
        .filter(|(at, value)| value.is_finite() && covered(material, center(*at, size)))
        .map(|(_, value)| *value)
        .collect();
    let (low, high) = percentiles(&mut of_leaf)?;
    let stretched =
        |value: f32| if high - low < LEAST_CONTRAST { EVEN } else { ((value - low) / (high - low)).clamp(0.0, 1.0) };
    let image = |of: &dyn Fn(f32) -> f32| {
        GrayImage::from_fn(width, height, |x, y| {
            Luma([unorm8(of(stretched(values[y as usize * width as usize + x as usize])))])
        })
    };
    let mut thickness = image(&|bright| 1.0 - bright);
    if let Some(share) = how.high_pass {
        thickness = high_passed(&thickness, share * width.max(height) as f32);
    }
    let absorption = match how.sign {
        Sign::Dark => image(&|bright| 1.0 - bright),
        Sign::Published => image(&|bright| bright),
    };
    Some([thickness, absorption])
}

/// The 1st and 99th percentile; `None` without values.
fn percentiles(values: &mut [f32]) -> Option<(f32, f32)> {
    let last = values.len().checked_sub(1)?;
    let mut at = |share: f64| *values.select_nth_unstable_by((share * last as f64) as usize, f32::total_cmp).1;
    Some((at(0.01), at(0.99)))
}

/// The image without its slow changes, about its mean. `sigma`: standard deviation of the blur in texels.
fn high_passed(image: &GrayImage, sigma: f32) -> GrayImage {
    if !(sigma.is_finite() && sigma > 0.0) {
        return image.clone();
    }
    let blurred = imageops::fast_blur(image, sigma);
    let count = image.as_raw().len().max(1) as f32;
    let mean = image.as_raw().iter().map(|&value| f32::from(value)).sum::<f32>() / count;
    GrayImage::from_fn(image.width(), image.height(), |x, y| {
        let value = mean + f32::from(image.get_pixel(x, y)[0]) - f32::from(blurred.get_pixel(x, y)[0]);
        Luma([unorm8(value / 255.0)])
    })
}

/// A texture with the size and the mask of the front and the colours of `of` (linear, 0..=1).
fn painted(material: &PlantMaterial, of: impl Fn(Vec2) -> Vec3) -> Option<RgbaImage> {
    let front = filled(&material.base_color_texture)?;
    let size = front.dimensions();
    Some(RgbaImage::from_fn(size.0, size.1, |x, y| {
        let [r, g, b] = of(center((x, y), size)).to_array().map(srgb8);
        Rgba([r, g, b, front.get_pixel(x, y)[3]])
    }))
}

/// A transmission for a leaf of which only the front is known: its subsurface albedo times
/// [`PlantMaterial::transmission`]. `None` without a front texture.
pub fn transmission_of(material: &PlantMaterial) -> Option<RgbaImage> {
    painted(material, |uv| material.transmitted(front_at(material, uv)))
}

/// A back for a leaf of which only the front is known: paler by 0.3 of its luminance. The factor on the base colour is not in
/// it, as it counts for the back too. `None` without a front texture.
pub fn back_of(material: &PlantMaterial) -> Option<RgbaImage> {
    let front = filled(&material.base_color_texture)?;
    painted(material, |uv| {
        let front = color_of(&front, uv);
        front + PALER * luminance(front)
    })
}

/// Tangent-space normals (OpenGL convention) of a relief whose height is the luminance of the front: veins are paler and
/// stand out. `depth`: height of the full range over the width of the texture. `None` without a front texture.
pub fn bump_of(material: &PlantMaterial, depth: f32) -> Option<RgbaImage> {
    let front = filled(&material.base_color_texture)?;
    let (width, height) = front.dimensions();
    let at = |x: u32, y: u32| {
        let place = center((x % width, y % height), (width, height));
        if covered(material, place) { linear_to_srgb(luminance(front_at(material, place))) } else { f32::NAN }
    };
    // The slope ends at the outline.
    let difference = |low: f32, high: f32| if (high - low).is_finite() { 0.5 * (high - low) } else { 0.0 };
    Some(RgbaImage::from_fn(width, height, |x, y| {
        let slope =
            Vec2::new(difference(at(x + width - 1, y), at(x + 1, y)), difference(at(x, y + 1), at(x, y + height - 1)))
                * (depth * width as f32);
        let normal = Vec3::new(-slope.x, -slope.y, 1.0).normalize_or(Vec3::Z);
        let [r, g, b] = (0.5 * normal + 0.5).to_array().map(unorm8);
        Rgba([r, g, b, 255])
    }))
}

/// Mean optical depth of a leaf over its mask, from the given or derived textures.
pub(crate) fn mean_optical_depth(
    tissue: &LeafTissue,
    material: &PlantMaterial,
    [thickness, absorption]: [Option<&GrayImage>; 2],
) -> f32 {
    const SAMPLES: u32 = 128;
    let value = |image: Option<&GrayImage>, uv: Vec2| image.map_or(EVEN, |image| value_of(image, uv));
    let (mut sum, mut count) = (0.0, 0.0);
    for y in 0..SAMPLES {
        for x in 0..SAMPLES {
            let uv = center((x, y), (SAMPLES, SAMPLES));
            if covered(material, uv) {
                sum += tissue.optical_depth(value(thickness, uv), value(absorption, uv));
                count += 1.0;
            }
        }
    }
    if count > 0.0 { sum / count } else { tissue.optical_depth(EVEN, EVEN) }
}

impl LeafTextures {
    /// What the colours contain where nobody says: a thickness or an absorption that is given was painted.
    pub fn measured(&self) -> Measured {
        if self.thickness.is_some() || self.absorption.is_some() { Measured::Leaf } else { Measured::Texel }
    }
}

/// The transmission with the factor of the tissue on perpendicular light, where textures of thickness or absorption tell
/// one place from another and the colours do not contain it; `None` elsewhere.
pub(crate) fn attenuated_transmission(material: &PlantMaterial, tissue: &LeafTissue) -> Option<RgbaImage> {
    if tissue.measured == Measured::Texel {
        return None;
    }
    let textures = &material.leaf_textures;
    let [thickness, absorption] = [filled(&textures.thickness), filled(&textures.absorption)];
    let sizes = [thickness.as_ref(), absorption.as_ref()].into_iter().flatten().map(|image| image.dimensions());
    let (width, height) =
        sizes.chain(size_of(material)).max_by_key(|(width, height)| u64::from(*width) * u64::from(*height))?;
    let mean = match tissue.measured {
        Measured::Nothing => 0.0,
        _ => mean_optical_depth(tissue, material, [thickness.as_deref(), absorption.as_deref()]),
    };
    let value = |image: &Option<Arc<GrayImage>>, uv: Vec2| image.as_deref().map_or(EVEN, |image| value_of(image, uv));
    Some(RgbaImage::from_fn(width, height, |x, y| {
        let uv = center((x, y), (width, height));
        let depth = tissue.optical_depth(value(&thickness, uv), value(&absorption, uv));
        let through = transmission_at(material, uv) * (mean - depth).exp();
        let [r, g, b] = through.to_array().map(srgb8);
        Rgba([r, g, b, 255])
    }))
}
