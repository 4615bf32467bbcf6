//! Least squares over the skies that occur: coefficients that give *their* light rightly.
//!
//! A projection keeps the transfer function's own low bands and answers the light's low bands only; what the higher
//! bands of the light would have added is lost, and it is not noise: skies are bright at the horizon and around the
//! sun, always in the same way. So, with l_s the coefficients of the sky s, L_s its radiance and k the transfer
//! function,
//!
//! ```text
//!  minimise over T    mean_s ( T . l_s - integral L_s k )^2 + lambda |T - integral y k|^2
//!  T = integral f k   f(w) = (mean_s l_s l_s' + lambda 1)^-1 (mean_s l_s L_s(w) + lambda y(w))
//! ```
//!
//! where the integral of y k is the projection, towards which what the skies leave open is drawn. The functions f are
//! as many as those of the basis and take their place. The skies are scaled to the same mean; red, green and blue count
//! as skies of their own. An even surrounding is among them, so that an overcast sky keeps its level.
//!
//! A plant may have any yaw, so the mean goes over all azimuths of the sun, which is done analytically: with phi the
//! azimuth, functions of different order m do not mix, and f_lm is a profile over the height y times cos m phi or
//! sin m phi, as y_lm is.

use std::f32::consts::PI;
use std::sync::OnceLock;

use glam::Vec3;
use rayon::prelude::*;

use crate::light::sh::{self, MAX_BANDS};
use crate::light::{Atmosphere, AtmosphereParams, LightSettings, LightState, SunPosition};
use crate::math::cholesky::{cholesky, solve};
use crate::math::compute_once;

/// Elevations of the sun in the set of skies, degrees: dense where skies change.
const ELEVATIONS_DEG: [f64; 10] = [-4.0, -1.0, 2.0, 6.0, 12.0, 20.0, 30.0, 42.0, 55.0, 70.0];

/// How strongly the fit is drawn to the projection: lambda, in units of squared coefficients of a sky of mean
/// radiance 1.
const PULL: f64 = 3e-3;

/// The even surrounding counts as much as this share of all skies.
const EVEN_SHARE: f64 = 0.1;

/// Heights at which profiles are known: means over as many equal parts of -1..1.
const HEIGHTS: usize = 4096;

/// Heights sampled in each part, and azimuths from the sun's to the opposite one.
const SAMPLES: usize = 2;
const AZIMUTHS: usize = 64;

/// The mean over the sphere of a function whose first coefficient is 1: 1 / sqrt(4 pi).
const MEAN_OF_FIRST: f64 = 0.282_094_791_773_878_14;

/// One channel of a sky of mean radiance 1, sun at azimuth 0.
struct Sky {
    /// Coefficients l_s at the index l (l + 1) + m of the cosines; those of the sines are zero.
    coefficients: [f64; MAX_BANDS * MAX_BANDS],
    /// The mean over the azimuth of radiance times cos m phi, by part of the upper half of -1..1, from the horizon up.
    profile: Vec<[f64; MAX_BANDS]>,
    /// Radiance of the ground.
    ground: f64,
}

/// The skies; empty if the atmosphere could not be built.
fn skies() -> &'static [Sky] {
    static SKIES: OnceLock<Vec<Sky>> = OnceLock::new();
    compute_once::<Vec<Sky>>(&SKIES, || {
        let Ok(atmosphere) = Atmosphere::new(AtmosphereParams::default()) else { return Vec::new() };
        let state = |elevation: &f64| {
            let sun = SunPosition::from_degrees(SOUTH_DEG, *elevation).ok()?;
            LightState::new(&atmosphere, sun, None, &LightSettings::default()).ok()
        };
        ELEVATIONS_DEG.iter().filter_map(state).flat_map(|state| skies_of(&state)).collect()
    })
}

/// Where azimuths are 0 in the basis.
const SOUTH_DEG: f64 = 180.0;

/// The channels of one sky with the sun in the south.
fn skies_of(state: &LightState) -> Vec<Sky> {
    let surroundings = state.surroundings();
    let projected = surroundings.project(MAX_BANDS);
    let profile: Vec<[Vec3; MAX_BANDS]> = (0..HEIGHTS / 2)
        .into_par_iter()
        .map(|part| {
            let mut means = [Vec3::ZERO; MAX_BANDS];
            for sample in 0..SAMPLES {
                let y = (part as f32 + (sample as f32 + 0.5) / SAMPLES as f32) * 2.0 / HEIGHTS as f32;
                let s = (1.0 - y * y).max(0.0).sqrt();
                for k in 0..AZIMUTHS {
                    // Dense around the sun, as the sky texture is.
                    let u = (k as f32 + 0.5) / AZIMUTHS as f32;
                    let phi = PI * u * u;
                    let radiance = surroundings.radiance(Vec3::new(s * phi.sin(), y, s * phi.cos()));
                    let share = 2.0 * u / (AZIMUTHS * SAMPLES) as f32;
                    for (m, mean) in means.iter_mut().enumerate() {
                        *mean += radiance * (share * (m as f32 * phi).cos());
                    }
                }
            }
            means
        })
        .collect();
    let of_channel = |channel: usize| {
        let mean = f64::from(projected[0][channel]) * MEAN_OF_FIRST;
        (mean > 0.0).then(|| Sky {
            coefficients: std::array::from_fn(|i| f64::from(projected[i][channel]) / mean),
            profile: profile.iter().map(|m| m.map(|value| f64::from(value[channel]) / mean)).collect(),
            ground: f64::from(surroundings.ground[channel]) / mean,
        })
    };
    (0..3).filter_map(of_channel).collect()
}

/// The functions f of the module's page for one number of bands.
pub(super) struct Fit {
    bands: usize,
    /// Integrals of the profiles from -1 up to each of the `HEIGHTS` + 1 bounds of the parts; `bands`² values each,
    /// those of f_lm at l (l + 1) + |m|.
    integrals: Vec<f64>,
}

/// The fits, by bands - 1; `None` where there are no skies to fit to or the equations have no solution.
static FITS: [OnceLock<Option<Fit>>; MAX_BANDS] = [const { OnceLock::new() }; MAX_BANDS];

impl Fit {
    /// The fit with so many bands, found once a process.
    pub fn of(bands: usize) -> Option<&'static Self> {
        compute_once(FITS.get(bands.checked_sub(1)?)?, || Self::new(bands)).as_ref()
    }

    fn new(bands: usize) -> Option<Self> {
        let count = bands * bands;
        let skies = skies();
        if skies.is_empty() {
            return None;
        }
        let mut values = vec![0.0; HEIGHTS * count];
        for m in 0..bands {
            let index = |l: usize| l * (l + 1) + m;
            let n = bands - m;
            let share = 1.0 / skies.len() as f64;
            // The mean of cos² over all azimuths.
            let half = if m == 0 { 1.0 } else { 0.5 };
            let mut left = vec![0.0; n * n];
            for i in 0..n {
                for j in 0..n {
                    let product = |sky: &Sky| sky.coefficients[index(m + i)] * sky.coefficients[index(m + j)];
                    left[i * n + j] = half * share * skies.iter().map(product).sum::<f64>();
                }
                left[i * n + i] += PULL;
            }
            if m == 0 {
                left[0] += EVEN_SHARE / MEAN_OF_FIRST.powi(2);
            }
            let factor = cholesky(left, n)?;
            for (part, values) in values.chunks_exact_mut(count).enumerate() {
                let y = ((2 * part + 1) as f64 / HEIGHTS as f64 - 1.0) as f32;
                let mut basis = [0.0; MAX_BANDS * MAX_BANDS];
                sh::basis_into(Vec3::new(0.0, y, (1.0 - y * y).max(0.0).sqrt()), &mut basis);
                let mut right: Vec<f64> = (m..bands).map(|l| PULL * f64::from(basis[index(l)])).collect();
                for sky in skies.iter() {
                    let radiance = match part.checked_sub(HEIGHTS / 2) {
                        Some(part) => sky.profile[part][m],
                        None if m == 0 => sky.ground,
                        None => continue,
                    };
                    for (value, l) in right.iter_mut().zip(m..) {
                        *value += share * sky.coefficients[index(l)] * radiance;
                    }
                }
                if m == 0 {
                    right[0] += EVEN_SHARE / MEAN_OF_FIRST;
                }
                solve(&factor, n, &mut right);
                right.iter().zip(m..).for_each(|(value, l)| values[index(l)] = *value);
            }
        }
        let mut integrals = vec![0.0; count];
        for values in values.chunks_exact(count) {
            let from = integrals.len() - count;
            integrals.extend_from_within(from..);
            let to = &mut integrals[from + count..];
            to.iter_mut().zip(values).for_each(|(sum, value)| *sum += value * 2.0 / HEIGHTS as f64);
        }
        integrals.iter().all(|value| value.is_finite()).then_some(Self { bands, integrals })
    }

    /// The functions at the azimuth of the unit vector `direction`, as means over the heights up to `half` below and
    /// above it (or a part's, if that is more). `out` takes bands² values.
    pub fn row(&self, direction: Vec3, half: f32, out: &mut [f32]) {
        let count = self.bands * self.bands;
        let half = f64::from(half).max(0.5 / HEIGHTS as f64);
        let at = |y: f64| (0.5 * (y + 1.0) * HEIGHTS as f64).clamp(0.0, HEIGHTS as f64);
        let (low, high) = (at(f64::from(direction.y) - half), at(f64::from(direction.y) + half));
        let integral = |at: f64, i: usize| {
            let part = (at as usize).min(HEIGHTS - 1);
            let (from, to) = (self.integrals[part * count + i], self.integrals[(part + 1) * count + i]);
            from + (to - from) * (at - part as f64)
        };
        let per_height = 0.5 * HEIGHTS as f64 / (high - low);
        let phi = f64::from(direction.x).atan2(f64::from(direction.z));
        for m in 0..self.bands {
            let (sin, cos) = (m as f64 * phi).sin_cos();
            for l in m..self.bands {
                let i = l * (l + 1) + m;
                let profile = (integral(high, i) - integral(low, i)) * per_height;
                out[i - m * 2] = (profile * sin) as f32;
                out[i] = (profile * cos) as f32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_even_sky_keeps_its_level() {
        for bands in [2, 3, 6] {
            let fit = Fit::of(bands).unwrap();
            let level = fit.integrals[HEIGHTS * bands * bands] * 0.5 / MEAN_OF_FIRST;
            assert!((level - 1.0).abs() < 0.01, "{bands}: {level}");
        }
    }

    #[test]
    fn a_row_is_a_mean_over_heights() {
        let fit = Fit::of(3).unwrap();
        let (mut wide, mut narrow, mut sum) = ([0.0; 9], [0.0; 9], [0.0f32; 9]);
        let at = |y: f32| Vec3::new(0.6 * (1.0 - y * y).sqrt(), y, -0.8 * (1.0 - y * y).sqrt());
        fit.row(at(0.25), 0.125, &mut wide);
        for part in 0..64 {
            fit.row(at(0.125 + (part as f32 + 0.5) / 256.0), 1.0 / 512.0, &mut narrow);
            sum.iter_mut().zip(narrow).for_each(|(sum, value)| *sum += value / 64.0);
        }
        assert!(wide.iter().zip(sum).all(|(a, b)| (a - b).abs() < 1e-4), "{wide:?} {sum:?}");
    }
}
