//! Measures by area: they tell wrong light from another leaf at the same pixel.
//!
//! Two pictures of one wood differ at every pixel if their leaves do, and look the same. So light is compared as a whole,
//! its places by the means of blocks, and what is within a block by its standard deviation.

use serde::{Deserialize, Serialize};

use super::{Mask, Picture, statistics::mean};

/// Pixels along a side of a block.
pub const BLOCK: usize = 8;

/// How the light of one picture lies beside that of another. A ratio to nothing is `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AreaError {
    /// Mean luminance, as a fraction of the reference's.
    pub luminance_ratio: Option<f64>,
    /// Local contrast: the mean standard deviation of luminance in blocks of [`BLOCK`]² pixels, as a fraction of the
    /// reference's.
    pub contrast_ratio: Option<f64>,
    /// Correlation of the blocks' mean luminances: 1 where light and dark areas are at the same places.
    pub block_correlation: Option<f64>,
}

/// Luminances of the blocks all of whose pixels count, block by block.
fn blocks(picture: &Picture, mask: Option<&Mask>) -> Vec<Vec<f64>> {
    let luminance = picture.luminance();
    let (columns, rows) = (picture.width / BLOCK, picture.height / BLOCK);
    let pixels = |block: usize| {
        let (x, y) = (block % columns * BLOCK, block / columns * BLOCK);
        (y..y + BLOCK).flat_map(move |y| y * picture.width + x..y * picture.width + x + BLOCK)
    };
    let counts = |block: &usize| mask.is_none_or(|mask| pixels(*block).all(|pixel| mask.counts[pixel]));
    (0..columns * rows).filter(counts).map(|block| pixels(block).map(|pixel| luminance[pixel]).collect()).collect()
}

fn variance(values: &[f64]) -> f64 {
    let Some(middle) = mean(values) else { return 0.0 };
    values.iter().map(|value| (value - middle).powi(2)).sum::<f64>() / values.len() as f64
}

fn ratio(own: f64, other: f64) -> Option<f64> {
    (other > 0.0).then_some(own / other).filter(|ratio| ratio.is_finite())
}

/// How `test` differs from `reference`, of the same size as the mask and each other.
///
/// The noise of a traced reference would count as its contrast. `half`, the same reference from the first half of its
/// samples, tells its variance, which is then removed: with a the mean of the first half and b that of both, the second
/// half's is 2b − a, and b's variance is the mean of (a − b)².
pub fn by_area(reference: &Picture, test: &Picture, mask: Option<&Mask>, half: Option<&Picture>) -> AreaError {
    let counted = |picture: &Picture| -> Vec<f64> {
        let all = picture.luminance();
        all.into_iter()
            .enumerate()
            .filter(|(pixel, _)| mask.is_none_or(|mask| mask.counts[*pixel]))
            .map(|(_, l)| l)
            .collect()
    };
    let whole = |picture: &Picture| mean(&counted(picture)).unwrap_or(0.0);
    let [ours, theirs] = [test, reference].map(|picture| blocks(picture, mask));
    let noise: Vec<f64> = match half {
        None => vec![0.0; theirs.len()],
        Some(half) => {
            let squares = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).collect();
            let of = |pair| mean(&Vec::from_iter::<Vec<f64>>(squares(pair))).unwrap_or(0.0);
            blocks(half, mask).iter().zip(&theirs).map(of).collect()
        }
    };
    let contrast = |blocks: &[Vec<f64>], noise: &[f64]| {
        let deviations = blocks.iter().zip(noise).map(|(block, noise)| (variance(block) - noise).max(0.0).sqrt());
        mean(&deviations.collect::<Vec<_>>()).unwrap_or(0.0)
    };
    let means = |blocks: &[Vec<f64>]| -> Vec<f64> { blocks.iter().filter_map(|block| mean(block)).collect() };
    AreaError {
        luminance_ratio: ratio(whole(test), whole(reference)),
        contrast_ratio: ratio(contrast(&ours, &vec![0.0; ours.len()]), contrast(&theirs, &noise)),
        block_correlation: correlation(&means(&ours), &means(&theirs)),
    }
}

/// Pearson's correlation; `None` where one of them does not vary.
fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let (middle_a, middle_b) = (mean(a)?, mean(b)?);
    let covariance = a.iter().zip(b).map(|(a, b)| (a - middle_a) * (b - middle_b)).sum::<f64>() / a.len() as f64;
    let spread = (variance(a) * variance(b)).sqrt();
    // Rounding alone gives even areas a variance of some 1e-16 of the square of their mean.
    let even = spread <= 1e-12 * (middle_a * middle_b).abs() || spread <= 0.0;
    (!even).then(|| (covariance / spread).clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{math::hash::unit_f32, measure::Light};

    /// 64 by 48 pixels with the luminance of a function.
    fn picture(luminance: impl Fn(usize, usize) -> f32) -> Picture {
        let pixels = (0..64 * 48).map(|i| Vec3::splat(luminance(i % 64, i / 64))).collect();
        Picture::new(64, 48, Light::Scene, pixels).unwrap()
    }

    fn near(value: Option<f64>, expected: f64, tolerance: f64) -> bool {
        value.is_some_and(|value| (value - expected).abs() < tolerance)
    }

    #[test]
    fn another_leaf_is_told_from_wrong_light() {
        let area = |x: usize| if x < 32 { 0.2 } else { 0.6 };
        let leaves =
            |seed: u64| move |x: usize, y: usize| area(x) + 0.1 * (unit_f32(seed, (y * 64 + x) as u64, 0u64) - 0.5);
        let (truth, other) = (picture(leaves(1)), picture(leaves(2)));
        let same = by_area(&truth, &other, None, None);
        assert!(near(same.luminance_ratio, 1.0, 0.01) && near(same.contrast_ratio, 1.0, 0.03), "{same:?}");
        assert!(near(same.block_correlation, 1.0, 0.01), "{same:?}");
        let wrong = by_area(&truth, &picture(|x, y| 1.5 * leaves(1)(x, y)), None, None);
        assert!(near(wrong.luminance_ratio, 1.5, 1e-4) && near(wrong.contrast_ratio, 1.5, 1e-4), "{wrong:?}");
        let swapped = by_area(&truth, &picture(|x, y| leaves(1)(63 - x, y)), None, None);
        assert!(near(swapped.block_correlation, -1.0, 0.01), "{swapped:?}");
        let blurred = by_area(&truth, &picture(|x, _| area(x)), None, None);
        assert!(near(blurred.contrast_ratio, 0.0, 1e-3) && near(blurred.block_correlation, 1.0, 0.01), "{blurred:?}");
    }

    #[test]
    fn the_references_noise_is_no_contrast() {
        let leaf = |x: usize, y: usize| if (x + y).is_multiple_of(2) { 0.4 } else { 0.6 };
        let noise = |seed: u64, x: usize, y: usize| 0.6 * (unit_f32(seed, (y * 64 + x) as u64, 1u64) - 0.5);
        let half = picture(|x, y| leaf(x, y) + noise(1, x, y));
        let whole = picture(|x, y| leaf(x, y) + 0.5 * (noise(1, x, y) + noise(2, x, y)));
        let clean = picture(leaf);
        let with = by_area(&whole, &clean, None, None);
        let without = by_area(&whole, &clean, None, Some(&half));
        assert!(with.contrast_ratio.is_some_and(|ratio| ratio < 0.7), "{with:?}");
        assert!(near(without.contrast_ratio, 1.0, 0.04), "{without:?}");
    }

    #[test]
    fn masks_leave_out_and_nothing_has_no_ratio() {
        let truth = picture(|x, _| if x < 32 { 0.2 } else { 0.6 });
        let test = picture(|x, _| if x < 32 { 0.2 } else { 0.9 });
        let left = Mask { width: 64, height: 48, counts: (0..64 * 48).map(|i| i % 64 < 32).collect() };
        assert!(near(by_area(&truth, &test, Some(&left), None).luminance_ratio, 1.0, 1e-6));
        assert!(near(by_area(&truth, &test, None, None).luminance_ratio, 1.375, 1e-6));
        let black = picture(|_, _| 0.0);
        assert_eq!(by_area(&black, &truth, None, None), AreaError::default());
        let small = Picture::new(3, 3, Light::Scene, vec![Vec3::ONE; 9]).unwrap();
        assert_eq!(by_area(&small, &small, None, None).block_correlation, None);
    }
}
