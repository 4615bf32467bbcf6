//! The filters of FLIP: what the eye resolves, and what it takes for an edge or a point. Each is the product of a filter
//! along the rows and one down the columns.

use glam::{Vec3, Vec4};

/// Scale parameters of the contrast sensitivity of the achromatic, the red-green and the two parts of the blue-yellow
/// channel, with the weights of the latter [Andersson et al. 2020, table 1].
const SCALES: [f32; 4] = [0.0047, 0.0053, 0.04, 0.025];
const BLUE_YELLOW: [f32; 2] = [34.1, 13.5];
/// Width of a feature in degrees.
const FEATURE: f32 = 0.082;

/// Contrast sensitivity: a Gaussian for the achromatic and the red-green channel, the sum of two for the blue-yellow one.
pub struct SpatialFilter {
    /// Weights of one tap: achromatic, red-green, and the two parts of blue-yellow.
    pub weights: Vec<Vec4>,
}

impl SpatialFilter {
    /// The filter at so many pixels per degree.
    pub fn new(pixels_per_degree: f32) -> Self {
        use std::f32::consts::PI;
        let widest = SCALES.into_iter().fold(0.0, f32::max);
        let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
        let tap = |offset: i32| {
            let squared = (offset as f32 / pixels_per_degree).powi(2);
            let gaussian = |scale: f32| (-PI * PI * squared / scale).exp();
            // The square root of the weight: it is met once along the row and once down the column.
            let blue_yellow = |part: usize| {
                let scale = SCALES[2 + part];
                (BLUE_YELLOW[part] * (PI / scale).sqrt()).sqrt() * gaussian(scale)
            };
            Vec4::new(gaussian(SCALES[0]), gaussian(SCALES[1]), blue_yellow(0), blue_yellow(1))
        };
        let mut weights: Vec<Vec4> = (-radius..=radius).map(tap).collect();
        let sum: Vec4 = weights.iter().sum();
        let both = sum.z.hypot(sum.w);
        let normalized = Vec4::new(sum.x, sum.y, both, both);
        weights.iter_mut().for_each(|weight| *weight /= normalized);
        Self { weights }
    }

    /// Pixels from the middle tap to the last.
    pub fn radius(&self) -> usize {
        self.weights.len() / 2
    }
}

/// A Gaussian with its first and second derivative, whose positive and negative weights each add up to 1 and −1.
pub struct FeatureFilter {
    /// Weights of one tap: Gaussian, first and second derivative.
    pub weights: Vec<Vec3>,
}

impl FeatureFilter {
    /// The filter at so many pixels per degree.
    pub fn new(pixels_per_degree: f32) -> Self {
        let deviation = 0.5 * FEATURE * pixels_per_degree;
        let radius = (3.0 * deviation).ceil() as i32;
        let tap = |offset: i32| {
            let x = offset as f32;
            let gaussian = (-x * x / (2.0 * deviation * deviation)).exp();
            Vec3::new(gaussian, -x * gaussian, (x * x / (deviation * deviation) - 1.0) * gaussian)
        };
        let mut weights: Vec<Vec3> = (-radius..=radius).map(tap).collect();
        let positive: Vec3 = weights.iter().map(|weight| weight.max(Vec3::ZERO)).sum();
        let negative: Vec3 = weights.iter().map(|weight| (-*weight).max(Vec3::ZERO)).sum();
        for weight in &mut weights {
            for channel in 0..3 {
                let sum = if weight[channel] > 0.0 { positive[channel] } else { negative[channel] };
                if sum > 0.0 {
                    weight[channel] /= sum;
                }
            }
        }
        Self { weights }
    }

    /// Pixels from the middle tap to the last.
    pub fn radius(&self) -> usize {
        self.weights.len() / 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_keep_what_is_even() {
        for pixels_per_degree in [20.0, 67.0, 300.0] {
            let spatial: Vec4 = SpatialFilter::new(pixels_per_degree).weights.iter().sum();
            assert!((spatial.x - 1.0).abs() < 1e-5 && (spatial.y - 1.0).abs() < 1e-5, "{spatial}");
            assert!((spatial.z * spatial.z + spatial.w * spatial.w - 1.0).abs() < 1e-5, "{spatial}");
            let feature: Vec3 = FeatureFilter::new(pixels_per_degree).weights.iter().sum();
            assert!((feature - Vec3::X).abs().max_element() < 1e-5, "{feature}");
        }
    }
}
