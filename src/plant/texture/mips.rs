//! Mip chains of colours, of alpha-tested colours and of normals.

use image::RgbaImage;
use rayon::prelude::*;

use super::coverage::{Distribution, match_coverage};
use super::dilate::dilate_colors;
use super::fade::{AlphaFade, fade_alpha};
use crate::math::{MipChain, color::unorm8, resample::Layer};

/// A mean normal this short is the rounding of 8 bits.
const NO_LENGTH: f32 = 0.01;

/// Mips of an sRGB image with straight linear alpha, averaged in linear light.
///
/// Colours are weighted by alpha (premultiplied filtering, [Porter & Duff 1984]), so invisible texels do not bleed;
/// alpha is averaged as it is, never through sRGB. Odd sizes are halved downwards with an exact area average.
/// Filtering runs in `f32` from level to level, each level is rounded once.
pub fn color_mips(image: &RgbaImage) -> MipChain {
    build(image, Layer::from_srgb(image), |layer| layer.to_srgb_bytes())
}

/// Mips of an alpha-tested sRGB image: as [`color_mips`], with level 0's coverage at every threshold in every level.
///
/// The fraction of the *area* whose bilinearly interpolated alpha reaches `t`, which is what an alpha test draws
/// ([`MipChain::drawn_coverage`]), is level 0's for every `t` from 0.5 to 1. [Castaño 2010, "Computing alpha
/// mipmaps"] scales alpha so that this holds at one threshold; here the alphas of a mip are remapped by rank, so it
/// also holds while a threshold is raised to fade a leaf out. Thresholds below 0.5 are kept roughly.
///
/// How well depends on how gradual alpha is. From [`super::fade_alpha`], mips of 8x8 texels and more keep coverage to
/// 2 % of the area. A hard cut-out keeps it at 0.5 likewise, but its edge cannot be drawn narrower than a texel: with
/// `t` above 0.5 every outline loses about `t - 0.5` texels of that mip. Smaller mips have too few texels to choose
/// from; 1x1 is drawn as a whole or not at all.
///
/// Texels are ranked by their exact averaged alpha; where that is equal the texel with the more visible
/// surroundings ranks higher, then a fixed scatter decides.
pub fn alpha_tested_mips(image: &RgbaImage) -> MipChain {
    let alphas: Vec<u8> = image.as_raw().chunks_exact(4).map(|texel| texel[3]).collect();
    let target = Distribution::of_drawn(&alphas, image.width() as usize, image.height() as usize);
    build(image, Layer::from_srgb(image), |layer| {
        let mut bytes = layer.to_srgb_bytes();
        for (texel, alpha) in bytes.chunks_exact_mut(4).zip(match_coverage(layer, &target)) {
            texel[3] = alpha;
        }
        bytes
    })
}

/// Mips of a leaf texture that was made to be drawn with an alpha test at `cutoff` (0..1), to be drawn with one at 0.5
/// or above: colours without halos, alpha that fades leaf by leaf ([`AlphaFade::PerLeaf`]: a texture of leaves is not a
/// crown), coverage that is kept.
pub fn leaf_mips(image: &RgbaImage, cutoff: f32) -> MipChain {
    let mut dilated = image.clone();
    dilate_colors(&mut dilated);
    alpha_tested_mips(&fade_alpha(&dilated, cutoff, AlphaFade::PerLeaf))
}

/// Mips of a tangent-space normal map (RGB8, 127.5 is zero): averaged as vectors, renormalised, alpha averaged.
///
/// The average is carried unnormalised from level to level, so each level is the normalised mean of level 0. A mean
/// without length becomes the flat normal (0, 0, 1).
pub fn normal_mips(image: &RgbaImage) -> MipChain {
    // Weights must not depend on alpha: it goes apart, as a colour channel would.
    let signed = |byte: u8| (f32::from(byte) - 127.5) / 127.5;
    let vectors = image.as_raw().par_chunks_exact(4).map(|t| [signed(t[0]), signed(t[1]), signed(t[2]), 1.0]).collect();
    let (width, height) = (image.width() as usize, image.height() as usize);
    let mut chain = build(image, Layer { width, height, texels: vectors }, |layer| {
        let encoded: Vec<[u8; 4]> = layer
            .texels
            .par_iter()
            .map(|&[x, y, z, _]| {
                let length = (x * x + y * y + z * z).sqrt();
                let unit = if length > NO_LENGTH { [x / length, y / length, z / length] } else { [0.0, 0.0, 1.0] };
                let byte = |value: f32| unorm8(0.5 * value + 0.5);
                [byte(unit[0]), byte(unit[1]), byte(unit[2]), 255]
            })
            .collect();
        encoded.into_flattened()
    });
    if image.as_raw().chunks_exact(4).any(|texel| texel[3] != 255) {
        let alphas = color_mips(image);
        for (normals, alphas) in chain.levels.iter_mut().zip(&alphas.levels) {
            for (normal, texel) in normals.chunks_exact_mut(4).zip(alphas.chunks_exact(4)) {
                normal[3] = texel[3];
            }
        }
    }
    chain
}

/// Mips of an image whose channels are linear values without a meaning to each other, such as coverages: each averaged alone.
pub fn linear_mips(image: &RgbaImage) -> MipChain {
    let values =
        image.as_raw().par_chunks_exact(4).map(|t| [t[0], t[1], t[2], t[3]].map(|byte| f32::from(byte) / 255.0));
    let (width, height) = (image.width() as usize, image.height() as usize);
    build(image, Layer { width, height, texels: values.collect() }, |layer| {
        let encoded: Vec<[u8; 4]> = layer.texels.par_iter().map(|texel| texel.map(unorm8)).collect();
        encoded.into_flattened()
    })
}

/// Halves `layer` down to 1x1; level 0 keeps the bytes of `image`, the others come from `encode`.
fn build(image: &RgbaImage, mut layer: Layer, encode: impl Fn(&Layer) -> Vec<u8>) -> MipChain {
    let mut chain = MipChain { width: image.width(), height: image.height(), levels: vec![image.as_raw().clone()] };
    while !layer.texels.is_empty() && (layer.width > 1 || layer.height > 1) {
        layer = layer.resampled((layer.width / 2).max(1), (layer.height / 2).max(1));
        chain.levels.push(encode(&layer));
    }
    chain
}
