//! Resampling of images in linear light, with colours weighted by alpha.
//!
//! Texels have straight alpha (not premultiplied). Each pass computes the premultiplied average and divides by its
//! alpha: `a = sum(w a_i)`, `c = sum(w a_i c_i) / a`. So passes can be chained (columns after rows, mip after mip).
//! Where nothing is visible, the colour is still defined: it is the plain average.

use image::{Rgba, RgbaImage};
use rayon::prelude::*;

use super::color::{LINEAR_OF_CODE, srgb8, unorm8};

/// An image of straight-alpha texels in linear light, row by row.
#[derive(Clone, Debug)]
pub(crate) struct Layer {
    /// Texels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Linear red, green, blue and alpha, 0..1.
    pub texels: Vec<[f32; 4]>,
}

/// A group of texels with less weight than this counts as invisible: half of the smallest 8-bit alpha, spread over four
/// million texels.
const INVISIBLE: f32 = 0.5 / 255.0 / 4_194_304.0;

impl Layer {
    /// Decodes an sRGB image with straight linear alpha.
    pub fn from_srgb(image: &RgbaImage) -> Self {
        let channel = |byte: u8| LINEAR_OF_CODE[usize::from(byte)];
        let texels = image
            .as_raw()
            .par_chunks_exact(4)
            .map(|t| [channel(t[0]), channel(t[1]), channel(t[2]), f32::from(t[3]) / 255.0])
            .collect();
        Self { width: image.width() as usize, height: image.height() as usize, texels }
    }

    /// Encodes to sRGB bytes with linear alpha.
    pub fn to_srgb_bytes(&self) -> Vec<u8> {
        let encoded: Vec<[u8; 4]> = self
            .texels
            .par_iter()
            .map(|&[red, green, blue, alpha]| [srgb8(red), srgb8(green), srgb8(blue), unorm8(alpha)])
            .collect();
        encoded.into_flattened()
    }

    /// The image at another size (both sides at least 1): by area average where it shrinks, by linear interpolation
    /// where it grows.
    pub fn resampled(&self, width: usize, height: usize) -> Self {
        let columns = taps(self.width, width);
        let rows = taps(self.height, height);
        let mut across = vec![[0.0; 4]; width * self.height];
        across.par_chunks_mut(width.max(1)).zip(self.texels.par_chunks(self.width.max(1))).for_each(|(out, source)| {
            for (texel, tap) in out.iter_mut().zip(&columns) {
                *texel = average(tap.weights.iter().zip(&source[tap.first..]));
            }
        });
        let mut texels = vec![[0.0; 4]; width * height];
        texels.par_chunks_mut(width.max(1)).zip(&rows).for_each(|(out, tap)| {
            for (x, texel) in out.iter_mut().enumerate() {
                let column = across[tap.first * width + x..].iter().step_by(width);
                *texel = average(tap.weights.iter().zip(column));
            }
        });
        Self { width, height, texels }
    }
}

/// The weighted average of straight-alpha texels. The weights sum to 1.
fn average<'a>(weighted: impl Iterator<Item = (&'a f32, &'a [f32; 4])>) -> [f32; 4] {
    let (mut seen, mut plain, mut alpha) = ([0.0f32; 3], [0.0f32; 3], 0.0f32);
    for (&weight, texel) in weighted {
        let visible = weight * texel[3];
        alpha += visible;
        for channel in 0..3 {
            seen[channel] += visible * texel[channel];
            plain[channel] += weight * texel[channel];
        }
    }
    let color = if alpha > INVISIBLE { seen.map(|sum| sum / alpha) } else { plain };
    [color[0], color[1], color[2], alpha]
}

/// The source texels that one output texel reads along one axis.
struct Tap {
    first: usize,
    weights: Vec<f32>,
}

/// The taps of `to` output texels over `from` source texels (both at least 1).
fn taps(from: usize, to: usize) -> Vec<Tap> {
    let ratio = from as f64 / to as f64;
    (0..to)
        .map(|index| {
            if ratio >= 1.0 {
                let (begin, end) = (index as f64 * ratio, (index + 1) as f64 * ratio);
                let first = (begin.floor() as usize).min(from - 1);
                let last = (end.ceil() as usize).clamp(first + 1, from);
                let overlap = |i: usize| ((end.min((i + 1) as f64) - begin.max(i as f64)).max(0.0) / ratio) as f32;
                Tap { first, weights: (first..last).map(overlap).collect() }
            } else {
                let at = ((index as f64 + 0.5) * ratio - 0.5).clamp(0.0, (from - 1) as f64);
                let first = at.floor() as usize;
                let second = (at - first as f64) as f32;
                let weights = if first + 1 < from { vec![1.0 - second, second] } else { vec![1.0] };
                Tap { first, weights }
            }
        })
        .collect()
}

/// The image (sRGB colours, straight linear alpha) at `width` x `height` texels, filtered in linear light with
/// colours weighted by alpha: area average where it shrinks, linear interpolation where it grows.
///
/// It brings textures of different sizes into one texture array. The same size gives the same bytes. An image without
/// texels gives transparent black.
pub fn resize_to(image: &RgbaImage, width: u32, height: u32) -> RgbaImage {
    if (width, height) == image.dimensions() {
        return image.clone();
    }
    if width == 0 || height == 0 || image.width() == 0 || image.height() == 0 {
        return RgbaImage::new(width, height);
    }
    let layer = Layer::from_srgb(image).resampled(width as usize, height as usize);
    let bytes = layer.to_srgb_bytes();
    RgbaImage::from_fn(width, height, |x, y| {
        let at = 4 * (y as usize * width as usize + x as usize);
        Rgba([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
    })
}
