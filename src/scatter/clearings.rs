//! The density of a stand with clearings: 1 in the forest, 0 in a meadow, smooth between.
//!
//! Two octaves of gradient noise ([Perlin 1985], quintic fade of [Perlin 2002]) over hashed lattice points, cut at the
//! value that leaves the wanted share open. The cut is found from the noise's own values over the area, so the share is
//! met for areas of few wavelengths too.

use glam::{DVec2, I64Vec2};

use super::rules::ClearingNoise;
use super::stand::Area;
use super::stream::Stream;
use crate::math::{HaltonSequence, hash::hash64};

/// Samples that the cut is found from: their mean density is within about 0.003 of the area's.
const SAMPLES: usize = 8192;

/// A calibrated clearing noise.
pub(super) struct ClearingMask {
    seed: u64,
    frequency: f64,
    /// Noise value at the middle of the margins; the forest is above.
    threshold: f64,
    /// Half the width of the margins, in values of the noise.
    softness: f64,
}

impl ClearingMask {
    /// `noise` has been validated.
    pub fn new(noise: &ClearingNoise, area: Area, seed: u64) -> Self {
        let frequency = noise.wavelength_m.recip();
        let points: Vec<DVec2> =
            HaltonSequence::new(1).take(SAMPLES).map(|unit| (area.min + unit * area.size()) * frequency).collect();
        let values: Vec<f64> = points.iter().map(|&p| fractal(p, seed)).collect();

        // The margin is given as a length; the noise's mean gradient turns it into values.
        const STEP: f64 = 0.01;
        let steepness = points
            .iter()
            .zip(&values)
            .map(|(&p, v)| ((fractal(p + DVec2::new(STEP, 0.0), seed) - v) / STEP).powi(2))
            .sum::<f64>()
            / SAMPLES as f64;
        // Isotropic: the gradient's square is twice that of one direction.
        let softness = (0.5 * noise.edge * (2.0 * steepness).sqrt()).max(1e-9);

        let (mut low, mut high) = (-4.0, 4.0);
        for _ in 0..60 {
            let threshold = 0.5 * (low + high);
            let forest = values.iter().map(|&v| ramp(v, threshold, softness)).sum::<f64>() / SAMPLES as f64;
            if forest > 1.0 - noise.cover {
                low = threshold;
            } else {
                high = threshold;
            }
        }
        Self { seed, frequency, threshold: 0.5 * (low + high), softness }
    }

    /// Density at a point (X, Z), 0 to 1.
    pub fn density(&self, point: DVec2) -> f64 {
        ramp(fractal(point * self.frequency, self.seed), self.threshold, self.softness)
    }
}

/// Smooth step of half width `softness` at `threshold`.
fn ramp(value: f64, threshold: f64, softness: f64) -> f64 {
    let t = ((value - threshold) / (2.0 * softness) + 0.5).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Two octaves; within ±2.
fn fractal(p: DVec2, seed: u64) -> f64 {
    // The offset keeps the lattices of the octaves apart: both would be zero at the same points.
    gradient_noise(p, seed) + 0.5 * gradient_noise(2.0 * p + DVec2::new(0.37, 0.71), seed.wrapping_add(1))
}

fn gradient_noise(p: DVec2, seed: u64) -> f64 {
    let corner = p.floor();
    let f = p - corner;
    let cell = corner.as_i64vec2();
    let dot = |dx: i64, dz: i64| {
        let gradient = gradient(cell + I64Vec2::new(dx, dz), seed);
        gradient.dot(f - DVec2::new(dx as f64, dz as f64))
    };
    let fade = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let near = dot(0, 0) + (dot(1, 0) - dot(0, 0)) * fade.x;
    let far = dot(0, 1) + (dot(1, 1) - dot(0, 1)) * fade.x;
    near + (far - near) * fade.y
}

/// A vector in the square ±1 for a lattice point.
fn gradient(cell: I64Vec2, seed: u64) -> DVec2 {
    let key = u64::from(cell.x as u32) | u64::from(cell.y as u32) << 32;
    let bits = hash64(seed, key, Stream::Clearing);
    let unit = |bits: u64| f64::from(bits as u32) / f64::from(u32::MAX) * 2.0 - 1.0;
    DVec2::new(unit(bits), unit(bits >> 32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mask(cover: f64, edge: f64) -> ClearingMask {
        let area = Area { min: DVec2::splat(-1000.0), max: DVec2::new(1000.0, 3000.0) };
        ClearingMask::new(&ClearingNoise { wavelength_m: 150.0, cover, edge }, area, 11)
    }

    /// Mean density over the test area on a grid that is not the calibration's point set.
    fn mean(mask: &ClearingMask) -> f64 {
        let densities = (0..40_000).map(|i| {
            let (column, row) = (f64::from(i % 200), f64::from(i / 200));
            mask.density(DVec2::new(-1000.0 + 10.0 * column + 5.0, -1000.0 + 20.0 * row + 10.0))
        });
        densities.sum::<f64>() / 40_000.0
    }

    #[test]
    fn the_cover_is_met_whatever_the_edge() {
        for cover in [0.0, 0.1, 0.35, 0.8, 1.0] {
            for edge in [0.0, 0.1, 0.5] {
                let forest = mean(&mask(cover, edge));
                assert!((forest - (1.0 - cover)).abs() < 0.02, "cover {cover}, edge {edge}: forest {forest}");
            }
        }
    }

    #[test]
    fn the_margin_has_the_length_asked_for() {
        // Share of the ground within the margins, over the share that sharp edges of that width would give.
        let mask = mask(0.5, 0.1);
        let (mut partial, mut crossings, mut steps) = (0u32, 0u32, 0u32);
        for row in 0..400 {
            let z = -1000.0 + 10.0 * f64::from(row);
            let mut last = mask.density(DVec2::new(-1000.0, z));
            for column in 1..2000 {
                let density = mask.density(DVec2::new(-1000.0 + f64::from(column), z));
                partial += u32::from((0.01..0.99).contains(&density));
                crossings += u32::from((density < 0.5) != (last < 0.5));
                steps += 1;
                last = density;
            }
        }
        // A line crosses a margin at an angle: its chord is π/2 times the width in the mean.
        let width = f64::from(partial) / f64::from(crossings) / std::f64::consts::FRAC_PI_2;
        assert!(steps > 0 && (7.0..25.0).contains(&width), "margins of {width} m instead of about 15 m");
    }

    #[test]
    fn the_noise_is_smooth() {
        let mask = mask(0.4, 0.2);
        for i in 0..2000 {
            let p = DVec2::new(f64::from(i) * 0.91 - 900.0, f64::from(i) * 0.37 - 500.0);
            let step = (mask.density(p + DVec2::new(0.1, 0.0)) - mask.density(p)).abs();
            assert!(step < 0.05, "a step of {step} in 0.1 m at {p}");
        }
    }
}
