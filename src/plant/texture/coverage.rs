//! Alpha whose drawn coverage is the same in every mip, at every threshold.
//!
//! What counts is not how many texels pass an alpha test but how much *area* does once the GPU has interpolated
//! between them: an isolated texel of alpha 0.5 passes a test at 0.5 in a single point. So the distribution that is
//! kept is that of bilinearly interpolated alpha, found by a fixed-point iteration over the alpha distribution of the
//! texels.

use rayon::prelude::*;

use crate::math::{MipChain, resample::Layer};

/// Iterations at most; each one needs one pass over the interpolated mip.
const ITERATIONS: usize = 12;
/// Largest error of coverage at any threshold from 0.5 up at which the iteration ends.
const GOOD: f64 = 0.001;
/// Samples along the longer side of a mip when its drawn coverage is measured, at least.
const SAMPLES: usize = 512;

/// For each alpha of 8 bits the fraction, 0..1, of an image's area whose alpha is at least that.
#[derive(Clone, PartialEq)]
pub(super) struct Distribution([f64; 256]);

impl Distribution {
    /// The distribution of bilinearly interpolated alpha (texels repeat at the border, as with clamped addressing).
    ///
    /// Sampled with at least 2 x 2 samples per texel, more where there are few texels.
    pub fn of_drawn(alphas: &[u8], width: usize, height: usize) -> Self {
        if alphas.is_empty() || alphas.len() != width * height {
            return Self([0.0; 256]);
        }
        let per_texel = SAMPLES.div_ceil(width.max(height)).clamp(2, 16);
        // Position of a sample as (texel, next texel, weight of the next).
        let position = |sample: usize, size: usize| {
            let at = ((sample as f32 + 0.5) / per_texel as f32 - 0.5).clamp(0.0, (size - 1) as f32);
            let first = at as usize;
            (first, (first + 1).min(size - 1), at - first as f32)
        };
        let columns: Vec<_> = (0..width * per_texel).map(|sample| position(sample, width)).collect();
        let histograms: Vec<[u64; 256]> = (0..height * per_texel)
            .into_par_iter()
            .with_min_len(16)
            .fold(
                || [0u64; 256],
                |mut histogram, sample| {
                    let (first, second, weight) = position(sample, height);
                    let rows = alphas[first * width..][..width].iter().zip(&alphas[second * width..][..width]);
                    let row: Vec<f32> =
                        rows.map(|(&a, &b)| f32::from(a) + weight * (f32::from(b) - f32::from(a))).collect();
                    for &(left, right, weight) in &columns {
                        let alpha = row[left] + weight * (row[right] - row[left]);
                        // The addend keeps whole values whole under rounding.
                        histogram[((alpha + 1e-3) as usize).min(255)] += 1;
                    }
                    histogram
                },
            )
            .collect();
        let mut at_least = [0.0; 256];
        let mut count = 0;
        for value in (0..256).rev() {
            count += histograms.iter().map(|histogram| histogram[value]).sum::<u64>();
            at_least[value] = count as f64;
        }
        Self(at_least.map(|passing| passing / count as f64))
    }

    /// The fraction of the area whose alpha reaches `threshold` (0..1).
    pub fn at(&self, threshold: f32) -> f32 {
        let value = (threshold.clamp(0.0, 1.0) * 255.0 - 1e-3).ceil().max(0.0) as usize;
        self.0[value.min(255)] as f32
    }

    /// Largest difference of coverage over the thresholds from 0.5 up.
    fn error(&self, other: &Self) -> f64 {
        (128..256).map(|value| (self.0[value] - other.0[value]).abs()).fold(0.0, f64::max)
    }

    /// Mean difference over the same thresholds.
    fn mean_error(&self, other: &Self) -> f64 {
        (128..256).map(|value| (self.0[value] - other.0[value]).abs()).sum::<f64>() / 128.0
    }
}

impl MipChain {
    /// The fraction, 0..1, of the area of `level` whose alpha, interpolated bilinearly between texels, reaches
    /// `threshold` (0..1): what an alpha test draws when the level is sampled. Sampled on a fixed grid.
    ///
    /// 0 for a level that does not exist or has no texels.
    pub fn drawn_coverage(&self, level: usize, threshold: f32) -> f32 {
        let (width, height) = self.level_size(level);
        let alphas: Vec<u8> =
            self.levels.get(level).map_or_else(Vec::new, |bytes| bytes.chunks_exact(4).map(|texel| texel[3]).collect());
        Distribution::of_drawn(&alphas, width as usize, height as usize).at(threshold)
    }
}

/// Alphas for the texels of `layer`, in the order of their filtered alpha, so that drawn coverage follows `target`.
///
/// `rho(t)`, the fraction of texels with alpha of at least `t`, starts as the target's and is corrected by what is
/// missing when the result is drawn: `rho += target - drawn`. Where no monotone `rho` does (a hard edge cannot be
/// drawn within less than a texel) the thresholds next to 0.5 have precedence. The best iterate is kept.
pub(super) fn match_coverage(layer: &Layer, target: &Distribution) -> Vec<u8> {
    let mut order: Vec<(u64, u32)> =
        (0..layer.texels.len()).into_par_iter().map(|index| (rank_key(layer, index), index as u32)).collect();
    order.par_sort_unstable_by(|a, b| b.cmp(a));

    let mut rho = target.0;
    let mut best: Option<(f64, Vec<u8>)> = None;
    for _ in 0..ITERATIONS {
        let alphas = assign(&order, &rho);
        let drawn = Distribution::of_drawn(&alphas, layer.width, layer.height);
        let (largest, mean) = (drawn.error(target), drawn.mean_error(target));
        if best.as_ref().is_none_or(|(least, _)| largest + mean < *least) {
            best = Some((largest + mean, alphas));
        }
        if largest < GOOD {
            break;
        }
        for ((rho, target), drawn) in rho.iter_mut().zip(&target.0).zip(&drawn.0) {
            *rho = (*rho + target - drawn).clamp(0.0, 1.0);
        }
        for value in 129..256 {
            rho[value] = rho[value].min(rho[value - 1]);
        }
        for value in (1..128).rev() {
            rho[value] = rho[value].max(rho[value + 1]);
        }
        rho[0] = 1.0;
    }
    best.map_or_else(Vec::new, |(_, alphas)| alphas)
}

/// Gives the texels, highest first, the alphas of the distribution `rho`.
fn assign(order: &[(u64, u32)], rho: &[f64; 256]) -> Vec<u8> {
    let mut alphas = vec![0u8; order.len()];
    let mut value = 255;
    for (rank, &(_, index)) in order.iter().enumerate() {
        while value > 0 && rho[value] * (order.len() as f64) < rank as f64 + 0.5 {
            value -= 1;
        }
        alphas[index as usize] = value as u8;
    }
    alphas
}

/// A sort key that grows with the texel's alpha, then with the alpha around it, then with a fixed scatter.
///
/// 26 + 22 + 16 bits: alpha to 2^-26 (the rounding of an `f32` sum), the surroundings to 2^-22.
fn rank_key(layer: &Layer, index: usize) -> u64 {
    let (x, y) = (index % layer.width, index / layer.width);
    let columns = x.saturating_sub(2)..(x + 3).min(layer.width);
    let rows = y.saturating_sub(2)..(y + 3).min(layer.height);
    // Outside the image nothing is visible, so the window always counts 25 texels.
    let around: f32 = rows
        .map(|row| layer.texels[row * layer.width..][columns.clone()].iter().map(|texel| texel[3]).sum::<f32>())
        .sum::<f32>()
        / 25.0;
    let fixed = |value: f32, bits: u32| (f64::from(value.clamp(0.0, 1.0)) * f64::from((1u32 << bits) - 1)) as u64;
    let scatter = u64::from((index as u32).wrapping_mul(0x9E37_79B1) >> 16);
    fixed(layer.texels[index][3], 26) << 38 | fixed(around, 22) << 16 | scatter
}
