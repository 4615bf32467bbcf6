//! What clamping adds to a beam's light, and the factor that takes it off again.
//!
//! A few bands of harmonics give a vertex in the shade as much negative light as positive, which is clamped at zero. So the sum over the
//! vertices is larger than that of the coefficients, and the shade is too bright. With less of the first coefficient, what is clamped is made up
//! for where light arrives in the mean of the vertices, and the shade becomes darker.

use super::PackedTransfer;
use crate::light::sh::{MAX_BANDS, basis_into};
use crate::math::SphereQuadrature;

/// The most vertices that are looked at, evenly over the part.
const VERTICES: usize = 1024;
/// Rings of directions above the horizon, and directions in each.
const DIRECTIONS: (usize, usize) = (4, 6);
/// Halvings of the interval in which the factor lies.
const HALVINGS: usize = 20;

impl PackedTransfer {
    /// Factor on the first coefficient of a beam's light, 0..=1, with which the clamped light of the vertices of `part` has the mean that
    /// it has without the clamp, over all beams from above the horizon. 1 for a part without vertices.
    pub fn beam_mean_factor(&self, part: usize) -> f32 {
        let sums = self.beam_sums(part);
        let whole: f64 = sums.iter().map(|[first, rest]| first + rest).sum();
        let clamped = |factor: f64| -> f64 { sums.iter().map(|[first, rest]| (factor * first + rest).max(0.0)).sum() };
        if !(clamped(1.0) > whole) {
            return 1.0;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if clamped(middle) > whole { high = middle } else { low = middle }
        }
        high as f32
    }

    /// Light of each beam on each vertex and side: that of the first coefficient, and that of all others.
    fn beam_sums(&self, part: usize) -> Vec<[f64; 2]> {
        let Some(part) = self.parts.get(part) else { return Vec::new() };
        let (count, channels) = (self.settings.coefficients(), self.settings.channels.count());
        let rule = SphereQuadrature::new(DIRECTIONS.0, DIRECTIONS.1);
        let mut bases = Vec::new();
        for (direction, _) in rule.upper() {
            let mut basis = [0.0; MAX_BANDS * MAX_BANDS];
            basis_into(*direction, &mut basis);
            bases.push(basis);
        }
        // Of three channels, green has most of the luminance.
        let channel = channels / 2;
        let vertices = part.bytes.len().checked_div(part.vertex_bytes).unwrap_or(0);
        let mut side_coefficients = vec![0.0; count];
        let mut sums = Vec::new();
        for vertex in (0..vertices).step_by(vertices.div_ceil(VERTICES).max(1)) {
            let bytes = &part.bytes[vertex * part.vertex_bytes..(vertex + 1) * part.vertex_bytes];
            for side in 0..part.sides {
                self.decode(bytes, part, side, &mut side_coefficients);
                let of_channel = || side_coefficients.iter().skip(channel).step_by(channels);
                for basis in &bases {
                    let mut products =
                        of_channel().zip(basis).map(|(value, basis)| f64::from(*value) * f64::from(*basis));
                    let first = products.next().unwrap_or(0.0);
                    sums.push([first, products.sum()]);
                }
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bake::lighting::transfer::{Channels, TransferBake, TransferFormat, TransferPart, TransferSettings};
    use crate::light::sh::basis;

    /// One channel, four bands.
    fn packed(front: Vec<f32>) -> PackedTransfer {
        let settings = TransferSettings { bands: 4, channels: Channels::Luminance, ..TransferSettings::default() };
        let part = TransferPart { front, ..TransferPart::default() };
        TransferBake { settings, parts: vec![part] }.pack(TransferFormat::Snorm8)
    }

    /// Coefficients of a cone of visibility around `axis`.
    fn cone(axis: Vec3, cosine: f32) -> Vec<f32> {
        let mut sums = vec![0.0; 16];
        for (direction, solid_angle) in SphereQuadrature::new(40, 80).sphere() {
            if direction.dot(axis) > cosine {
                sums.iter_mut().zip(basis::<16>(*direction)).for_each(|(sum, basis)| *sum += solid_angle * basis);
            }
        }
        sums
    }

    #[test]
    fn a_vertex_that_all_light_reaches_needs_no_factor() {
        let even = packed([vec![1.0], vec![0.0; 15]].concat());
        assert_eq!(even.beam_mean_factor(0), 1.0);
        assert_eq!(even.beam_mean_factor(1), 1.0);
        assert_eq!(packed(Vec::new()).beam_mean_factor(0), 1.0);
    }

    #[test]
    fn narrow_openings_keep_the_mean_of_their_light() {
        let axes = [Vec3::Y, Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.5, 0.5, 0.7), Vec3::X, Vec3::NEG_Z];
        let narrow = packed(axes.iter().flat_map(|axis| cone(axis.normalize(), 0.8)).collect());
        let factor = narrow.beam_mean_factor(0);
        assert!((0.2..0.9).contains(&factor), "{factor}");
        // Half of all directions are open: little is clamped.
        let wide = packed(axes.iter().flat_map(|axis| cone(axis.normalize(), 0.0)).collect());
        assert!(wide.beam_mean_factor(0) > factor + 0.1, "{factor} and {}", wide.beam_mean_factor(0));
        let sums = narrow.beam_sums(0);
        let whole: f64 = sums.iter().map(|[first, rest]| first + rest).sum();
        let clamped = |factor: f64| -> f64 { sums.iter().map(|[first, rest]| (factor * first + rest).max(0.0)).sum() };
        assert!((clamped(factor.into()) / whole - 1.0).abs() < 1e-3, "{} of {whole}", clamped(factor.into()));
        assert!(clamped(1.0) > 1.02 * whole, "the clamp adds {}", clamped(1.0) / whole);
    }
}
