//! Transmittance from a point of the atmosphere to its top, as a table of 256 by 64 optical depths.
//!
//! It is parametrised by distances, after Bruneton & Neyret 2008 in the form of Bruneton 2017 (4.1), as in Hillaire
//! 2020 (5.2). The table holds optical depths instead of transmittances, because they interpolate well at the horizon,
//! where transmittance falls by orders of magnitude. That is where the light of twilight passes.

use glam::{FloatExt, Vec3, Vec3A};
use rayon::prelude::*;

use super::params::AtmosphereParams;

const WIDTH: usize = 256;
const HEIGHT: usize = 64;
const STEPS: usize = 120;

#[derive(Debug, Clone)]
pub(super) struct TransmittanceLut {
    ground: f64,
    top: f64,
    horizon: f64,
    optical_depth: Vec<Vec3A>,
}

impl TransmittanceLut {
    pub fn new(params: &AtmosphereParams) -> Self {
        let (ground, top) = (params.ground_radius_m, params.top_radius());
        let horizon = (top * top - ground * ground).sqrt();
        let optical_depth = (0..WIDTH * HEIGHT)
            .into_par_iter()
            .map(|i| {
                let (x_mu, x_r) = ((i % WIDTH) as f64 / (WIDTH - 1) as f64, (i / WIDTH) as f64 / (HEIGHT - 1) as f64);
                let rho = horizon * x_r;
                let r = (rho * rho + ground * ground).sqrt();
                let (d_min, d_max) = (top - r, rho + horizon);
                let d = d_min + x_mu * (d_max - d_min);
                let mu = if d < 1e-6 { 1.0 } else { (horizon * horizon - rho * rho - d * d) / (2.0 * r * d) };
                integrate_optical_depth(params, r, mu.clamp(-1.0, 1.0), d).into()
            })
            .collect();
        Self { ground, top, horizon, optical_depth }
    }

    /// The level of a distance `r` from the planet's centre, metres.
    pub fn level(&self, r: f64) -> Level {
        let r = r.clamp(self.ground, self.top);
        let rho = (r * r - self.ground * self.ground).max(0.0).sqrt();
        Level {
            r,
            rho,
            row: (rho / self.horizon).clamp(0.0, 1.0) * (HEIGHT - 1) as f64,
            sin_horizon: self.ground / r,
            height: (r - self.ground) / (self.top - self.ground),
        }
    }

    /// Transmittance from a level to the top along a ray with the zenith cosine `mu`. A ray that would hit the ground
    /// has the transmittance of the horizon: the caller is responsible for visibility.
    pub fn sample(&self, level: &Level, mu: f64) -> Vec3 {
        let Level { r, rho, row, .. } = *level;
        let distance = -r * mu + (r * r * (mu * mu - 1.0) + self.top * self.top).max(0.0).sqrt();
        let (d_min, d_max) = (self.top - r, rho + self.horizon);
        let x = ((distance - d_min) / (d_max - d_min)).clamp(0.0, 1.0) * (WIDTH - 1) as f64;
        (-bilinear(&self.optical_depth, WIDTH, x, row)).exp()
    }
}

/// A distance from the planet's centre, with what the tables derive from it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    /// Distance from the centre, metres, within the atmosphere.
    pub r: f64,
    /// Distance to the horizon, metres.
    rho: f64,
    /// Row in the transmittance table.
    row: f64,
    /// Sine of the zenith angle of the horizon.
    pub sin_horizon: f64,
    /// Height above the ground as a fraction of the atmosphere's height, 0 to 1.
    pub height: f64,
}

fn integrate_optical_depth(params: &AtmosphereParams, r: f64, mu: f64, distance: f64) -> Vec3 {
    let step = distance / STEPS as f64;
    let sum: Vec3 = (0..STEPS)
        .map(|i| {
            let t = (i as f64 + 0.5) * step;
            params.medium((r * r + t * t + 2.0 * r * t * mu).sqrt() - params.ground_radius_m).extinction
        })
        .sum();
    sum * step as f32
}

/// Bilinear interpolation in a row-major table of `width` columns at texel coordinates `x`, `y`, which must lie inside
/// the table.
pub(super) fn bilinear(table: &[Vec3A], width: usize, x: f64, y: f64) -> Vec3 {
    let height = table.len() / width;
    let (x0, y0) = ((x as usize).min(width - 1), (y as usize).min(height - 1));
    let (x1, y1) = ((x0 + 1).min(width - 1), (y0 + 1).min(height - 1));
    let (fx, fy) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
    let row = |y: usize| table[y * width + x0].lerp(table[y * width + x1], fx);
    row(y0).lerp(row(y1), fy).into()
}

/// The table axis that resolves twilight: the cosine of the sun's zenith angle in 64 texels. 40 of them are linear from
/// -0.42 (the sun 25 degrees below the horizon, where its light does not reach the air) to 0. Above, the rest follow
/// the square root of the cosine.
#[derive(Debug, Clone, Copy)]
pub(super) struct SunAxis;

impl SunAxis {
    pub const LEN: usize = 64;
    const HORIZON: f64 = 40.0;
    const LOWEST: f64 = -0.42;

    /// Texel coordinate, 0 to 63, of a cosine; cosines below -0.42 share texel 0.
    pub fn coordinate(mu: f64) -> f64 {
        let last = (Self::LEN - 1) as f64;
        if mu < 0.0 {
            Self::HORIZON * (1.0 - (mu / Self::LOWEST).min(1.0))
        } else {
            (Self::HORIZON + (last - Self::HORIZON) * mu.min(1.0).sqrt()).min(last)
        }
    }

    /// The cosine at a texel.
    pub fn cosine(texel: usize) -> f64 {
        let x = texel as f64;
        if x < Self::HORIZON {
            f64::lerp(Self::LOWEST, 0.0, x / Self::HORIZON)
        } else {
            ((x - Self::HORIZON) / ((Self::LEN - 1) as f64 - Self::HORIZON)).powi(2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_agrees_with_direct_integration() {
        let params = AtmosphereParams::default();
        let lut = TransmittanceLut::new(&params);
        let top = params.top_radius();
        for height in [0.0, 50.0, 1_000.0, 8_000.0, 40_000.0] {
            let r = params.ground_radius_m + height;
            for mu in [1.0, 0.7, 0.3, 0.1, 0.03, 0.01, 0.001] {
                let d = -r * mu + (r * r * (mu * mu - 1.0f64) + top * top).sqrt();
                let want = (-integrate_optical_depth(&params, r, mu, d)).exp();
                let got = lut.sample(&lut.level(r), mu);
                let error = (got - want).abs().max_element();
                assert!(error < 6e-3, "height {height}, mu {mu}: {got} instead of {want}");
            }
        }
    }

    #[test]
    fn sun_axis_inverts() {
        for texel in 0..SunAxis::LEN {
            assert!((SunAxis::coordinate(SunAxis::cosine(texel)) - texel as f64).abs() < 1e-9);
        }
    }
}
