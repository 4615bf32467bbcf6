//! FLIP: how different two pictures look when one takes the place of the other, pixel by pixel, 0 to 1.
//!
//! For pictures of a display [Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images"], and for the
//! radiance of scenes [Andersson et al. 2021, "Visualizing Errors in Rendered High Dynamic Range Images"]. The filters are
//! separated into rows and columns as in the authors' program, whose means the tests reproduce to four digits.
//!
//! The picture is taken to be seen at some number of pixels per degree of the visual field. What the eye cannot resolve at
//! that distance is filtered out, colours are compared, and edges and points are added where one picture alone has them.
//!
//! Limits: the eye is adapted to the whole picture; motion is not considered.

mod color;
mod exposures;
mod filters;
#[cfg(test)]
mod golden;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use self::{
    color::{displayed, distance, opponent, perceived},
    exposures::{exposures, tone_mapped},
    filters::{FeatureFilter, SpatialFilter},
};
use super::{Light, MeasureError, Picture};

/// Pixels per degree of a 4K monitor of 0.7 m at a distance of 0.7 m, the authors' default.
pub const PIXELS_PER_DEGREE: f32 = 67.020_64;

/// Exponent of the colour difference.
const COLOR_EXPONENT: f32 = 0.7;
/// Where the colour difference bends, as a fraction of the largest one.
const BEND: f32 = 0.4;
/// The error at the bend.
const BEND_ERROR: f32 = 0.95;
/// Exponent of the feature difference.
const FEATURE_EXPONENT: f32 = 0.5;

/// The FLIP of each pixel of `test` against `reference`, 0 to 1, row by row from the top: that of displays, or that of
/// radiance with the exposures that follow from the reference.
///
/// # Errors
/// [`MeasureError::Sizes`], [`MeasureError::Lights`], [`MeasureError::PixelsPerDegree`].
pub fn flip(reference: &Picture, test: &Picture, pixels_per_degree: f32) -> Result<Vec<f32>, MeasureError> {
    if reference.size() != test.size() {
        return Err(MeasureError::Sizes { first: test.size(), second: reference.size() });
    }
    if !(1.0..=1000.0).contains(&pixels_per_degree) {
        return Err(MeasureError::PixelsPerDegree(pixels_per_degree.to_string()));
    }
    let map = |[reference, test]: [&[Vec3]; 2], width| {
        let [reference, test] = [reference, test].map(|pixels| Seen::new(pixels, width, pixels_per_degree));
        difference(&reference, &test)
    };
    match (reference.light, test.light) {
        (Light::Display, Light::Display) => Ok(map([&reference.pixels, &test.pixels], reference.width)),
        (Light::Scene, Light::Scene) => {
            // The largest error at any exposure.
            let mut largest = vec![0.0f32; reference.pixels.len()];
            for exposure in exposures(reference) {
                let factor = exposure.exp2();
                let [reference_now, test_now] = [reference, test]
                    .map(|picture| picture.pixels.par_iter().map(|p| tone_mapped(*p * factor)).collect::<Vec<_>>());
                let errors = map([&reference_now, &test_now], reference.width);
                largest.iter_mut().zip(errors).for_each(|(slot, error)| *slot = slot.max(error));
            }
            Ok(largest)
        }
        _ => Err(MeasureError::Lights),
    }
}

/// A picture as the eye sees it.
struct Seen {
    /// Perceived colour of each pixel, after what cannot be resolved was filtered out.
    colors: Vec<Vec3>,
    /// Strength of the edge and of the point at each pixel.
    features: Vec<[f32; 2]>,
}

impl Seen {
    /// Linear light of a display, 0 to 1.
    fn new(linear: &[Vec3], width: usize, pixels_per_degree: f32) -> Self {
        let opponents: Vec<Vec3> = linear.par_iter().map(|pixel| opponent(*pixel)).collect();
        let spatial = SpatialFilter::new(pixels_per_degree);
        let rows = along_rows(&opponents, width, spatial.radius(), |tap, color| {
            let [y, cx, cz, cz2] = spatial.weights[tap].to_array();
            Vec4::new(y * color.x, cx * color.y, cz * color.z, cz2 * color.z)
        });
        let filtered = along_columns(&rows, width, spatial.radius(), |tap, value| spatial.weights[tap] * value);
        let see = |sum: &Vec4| perceived(displayed(Vec3::new(sum.x, sum.y, sum.z + sum.w)));
        let colors = filtered.par_iter().map(see).collect();

        let feature = FeatureFilter::new(pixels_per_degree);
        let rows = along_rows(&opponents, width, feature.radius(), |tap, color| {
            (feature.weights[tap] * (color.x / 116.0 + 16.0 / 116.0)).extend(0.0)
        });
        // Derivatives along the row are smoothed down the column, and what was smoothed along the row is derived.
        let gradients = along_columns(&rows, width, feature.radius(), |tap, value| {
            let weights = feature.weights[tap];
            Vec4::new(weights.x * value.y, weights.y * value.x, weights.x * value.z, weights.z * value.x)
        });
        let features = gradients.par_iter().map(|sum| [sum.x.hypot(sum.y), sum.z.hypot(sum.w)]).collect();
        Self { colors, features }
    }
}

/// Sums of `weighted(tap, pixel)` over `2 * radius + 1` pixels of a row; beyond its ends the last pixel goes on.
fn along_rows(
    pixels: &[Vec3],
    width: usize,
    radius: usize,
    weighted: impl Fn(usize, Vec3) -> Vec4 + Sync,
) -> Vec<Vec4> {
    let row = |row: &[Vec3]| -> Vec<Vec4> {
        let at = |x: usize, tap: usize| row[(x + tap).saturating_sub(radius).min(width - 1)];
        (0..width).map(|x| (0..=2 * radius).map(|tap| weighted(tap, at(x, tap))).sum()).collect()
    };
    pixels.par_chunks(width.max(1)).flat_map_iter(row).collect()
}

/// The same down the columns.
fn along_columns(
    pixels: &[Vec4],
    width: usize,
    radius: usize,
    weighted: impl Fn(usize, Vec4) -> Vec4 + Sync,
) -> Vec<Vec4> {
    let height = pixels.len() / width.max(1);
    let mut sums = vec![Vec4::ZERO; pixels.len()];
    sums.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, sums)| {
        for tap in 0..=2 * radius {
            let from = (y + tap).saturating_sub(radius).min(height - 1);
            for (sum, pixel) in sums.iter_mut().zip(&pixels[from * width..][..width]) {
                *sum += weighted(tap, *pixel);
            }
        }
    });
    sums
}

/// The error of each pixel: the colour difference, raised where the features differ.
fn difference(reference: &Seen, test: &Seen) -> Vec<f32> {
    let largest = distance(perceived(Vec3::Y), perceived(Vec3::Z)).powf(COLOR_EXPONENT);
    let bend = BEND * largest;
    let pixel = |index: usize| {
        let color = distance(reference.colors[index], test.colors[index]).powf(COLOR_EXPONENT);
        let color = if color < bend {
            color * BEND_ERROR / bend
        } else {
            BEND_ERROR + (color - bend) / (largest - bend) * (1.0 - BEND_ERROR)
        };
        let [edge, point] = [0, 1].map(|kind| (reference.features[index][kind] - test.features[index][kind]).abs());
        let feature = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).powf(FEATURE_EXPONENT);
        color.powf(1.0 - feature).clamp(0.0, 1.0)
    };
    (0..reference.colors.len()).into_par_iter().map(pixel).collect()
}
