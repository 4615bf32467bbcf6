//! Least squares over the skies that occur: coefficients that give *their* light rightly.
//!
//! A projection keeps the transfer function's own low bands and answers the light's low bands only; what the higher
//! bands of the light would have added is lost, and it is not noise: skies are bright at the horizon and around the
//! sun, always in the same way. So, with l_s the coefficients of the sky s and k the sampled transfer function,
//!
//! ```text
//!  minimise over T    sum_s ( T . l_s - sum_j L_s(w_j) k_j )^2 + lambda |T - Y k|^2
//!  T = M k            M = (sum_s l_s l_s' + lambda 1)^-1 (sum_s l_s L_s' + lambda Y)
//! ```
//!
//! where Y k is the projection, towards which what the skies leave open is drawn. M depends on the directions alone.
//! The skies are scaled to the same mean; red, green and blue count as skies of their own. An even surrounding is
//! among them, so that an overcast sky keeps its level.
//!
//! Of the sky, each direction takes the mean over the part of the sphere that is nearest to it, not a point sample:
//! the bright surroundings of the sun are smaller than the distance between rays.

use std::f32::consts::TAU;
use std::sync::LazyLock;

use glam::{Quat, Vec3};
use rayon::prelude::*;

use super::rays::{direction_set, projection_rows};
use crate::light::{Atmosphere, AtmosphereParams, LightSettings, LightState, SunPosition, sh};

/// Elevations of the sun in the set of skies, degrees: dense where skies change.
const ELEVATIONS_DEG: [f64; 10] = [-4.0, -1.0, 2.0, 6.0, 12.0, 20.0, 30.0, 42.0, 55.0, 70.0];

/// Azimuths of the sun, evenly around: the instance's yaw may be any.
const AZIMUTHS: usize = 12;

/// How strongly the fit is drawn to the projection: lambda for each sky, in units of squared coefficients of a sky
/// of mean radiance 1.
const PULL: f64 = 3e-3;

/// The even surrounding counts as much as this share of all skies.
const EVEN_SHARE: f64 = 0.1;

/// Directions over which a sky is averaged, and the largest set that has several of them to a direction.
const DENSE: u32 = 8192;
const LARGEST_AVERAGED: usize = 1024;

/// The skies, sun in the north; empty if the atmosphere could not be built.
static SKIES: LazyLock<Vec<LightState>> = LazyLock::new(|| {
    let Ok(atmosphere) = Atmosphere::new(AtmosphereParams::default()) else { return Vec::new() };
    let state = |elevation: &f64| {
        let sun = SunPosition::from_degrees(0.0, *elevation).ok()?;
        LightState::new(&atmosphere, sun, None, &LightSettings::default()).ok()
    };
    ELEVATIONS_DEG.iter().filter_map(state).collect()
});

/// M of the module's page, direction by direction: bands² values each. `None` where there are no skies to fit to or
/// the equations have no solution.
pub(super) fn fit_rows(set: &[Vec3], bands: usize) -> Option<Vec<f32>> {
    let count = bands * bands;
    let cells = Cells::new(set);
    let basis = projection_rows(set, bands);
    // Left and right sides, sky by sky; summed in their order, so that threads change nothing.
    let terms: Vec<(Vec<Vec3>, Vec<Vec3>)> = SKIES
        .par_iter()
        .flat_map_iter(|sky| {
            let coefficients = sky.surroundings().project(bands);
            let cells = &cells;
            (0..AZIMUTHS).map(move |k| {
                let yaw = TAU * k as f32 / AZIMUTHS as f32;
                let mut turned = coefficients.clone();
                sh::rotate_y(&mut turned, yaw);
                let back = Quat::from_rotation_y(-yaw);
                (turned, cells.average(|direction| sky.surroundings().radiance(back * direction)))
            })
        })
        .collect();
    let mut skies: Vec<(Vec<f64>, Vec<f64>, f64)> = Vec::with_capacity(terms.len() * 3 + 1);
    for (coefficients, radiance) in &terms {
        for channel in 0..3 {
            let mean = f64::from(coefficients[0][channel]) * MEAN_OF_FIRST;
            if mean > 0.0 {
                let scaled = |values: &[Vec3]| values.iter().map(|v| f64::from(v[channel]) / mean).collect();
                skies.push((scaled(coefficients), scaled(radiance), 1.0));
            }
        }
    }
    if skies.is_empty() {
        return None;
    }
    let lambda = PULL * skies.len() as f64;
    let mut even = vec![0.0; count];
    even[0] = 1.0 / MEAN_OF_FIRST;
    skies.push((even, vec![1.0; set.len()], EVEN_SHARE * skies.len() as f64));

    let mut left = vec![0.0; count * count];
    let mut right: Vec<f64> = basis.iter().map(|y| lambda * f64::from(*y)).collect();
    for (coefficients, radiance, weight) in &skies {
        for i in 0..count {
            for j in 0..count {
                left[i * count + j] += weight * coefficients[i] * coefficients[j];
            }
        }
        for (row, radiance) in right.chunks_exact_mut(count).zip(radiance) {
            for (value, coefficient) in row.iter_mut().zip(coefficients) {
                *value += weight * radiance * coefficient;
            }
        }
    }
    for i in 0..count {
        left[i * count + i] += lambda;
    }
    let factor = cholesky(left, count)?;
    right.chunks_exact_mut(count).for_each(|row| solve(&factor, count, row));
    let rows: Vec<f32> = right.iter().map(|value| *value as f32).collect();
    rows.iter().all(|value| value.is_finite()).then_some(rows)
}

/// The mean over the sphere of a function whose first coefficient is 1: 1 / sqrt(4 pi).
const MEAN_OF_FIRST: f64 = 0.282_094_791_773_878_14;

/// The parts of the sphere that are nearest to each direction of a set.
struct Cells {
    dense: Vec<Vec3>,
    /// The direction of the set nearest to each dense one.
    owner: Vec<u32>,
    counts: Vec<f32>,
    set: Vec<Vec3>,
}

impl Cells {
    fn new(set: &[Vec3]) -> Self {
        if set.len() > LARGEST_AVERAGED {
            return Self { dense: Vec::new(), owner: Vec::new(), counts: Vec::new(), set: set.to_vec() };
        }
        let dense = direction_set(DENSE);
        let nearest = |direction: &Vec3| {
            let closer = |a: &usize, b: &usize| set[*a].dot(*direction).total_cmp(&set[*b].dot(*direction));
            (0..set.len()).max_by(closer).unwrap_or(0) as u32
        };
        let owner: Vec<u32> = dense.par_iter().map(nearest).collect();
        let mut counts = vec![0.0; set.len()];
        owner.iter().for_each(|&cell| counts[cell as usize] += 1.0);
        Self { dense, owner, counts, set: set.to_vec() }
    }

    /// The mean of `f` over each cell; its value at the direction where the set is dense itself.
    fn average(&self, f: impl Fn(Vec3) -> Vec3) -> Vec<Vec3> {
        if self.dense.is_empty() {
            return self.set.iter().map(|direction| f(*direction)).collect();
        }
        let mut sums = vec![Vec3::ZERO; self.set.len()];
        for (direction, &cell) in self.dense.iter().zip(&self.owner) {
            sums[cell as usize] += f(*direction);
        }
        let mean = |((sum, &count), direction): ((Vec3, &f32), &Vec3)| {
            if count > 0.0 { sum / count } else { f(*direction) }
        };
        sums.into_iter().zip(&self.counts).zip(&self.set).map(mean).collect()
    }
}

/// The lower factor of a symmetric positive matrix, row by row; `None` where it is not positive.
fn cholesky(mut matrix: Vec<f64>, n: usize) -> Option<Vec<f64>> {
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| matrix[i * n + k] * matrix[j * n + k]).sum();
            let value = matrix[i * n + j] - sum;
            if i == j {
                if value.is_nan() || value <= 0.0 {
                    return None;
                }
                matrix[i * n + i] = value.sqrt();
            } else {
                matrix[i * n + j] = value / matrix[j * n + j];
            }
        }
    }
    Some(matrix)
}

/// Solves with the factor of [`cholesky`], in place.
fn solve(factor: &[f64], n: usize, x: &mut [f64]) {
    for i in 0..n {
        let sum: f64 = (0..i).map(|k| factor[i * n + k] * x[k]).sum();
        x[i] = (x[i] - sum) / factor[i * n + i];
    }
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|k| factor[k * n + i] * x[k]).sum();
        x[i] = (x[i] - sum) / factor[i * n + i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_solves() {
        let matrix = vec![4.0, 2.0, 0.4, 2.0, 5.0, 1.0, 0.4, 1.0, 3.0];
        let want = [1.0, -2.0, 0.5];
        let mut x: Vec<f64> = (0..3).map(|i| (0..3).map(|j| matrix[i * 3 + j] * want[j]).sum()).collect();
        solve(&cholesky(matrix, 3).unwrap(), 3, &mut x);
        assert!(x.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-12));
        assert!(cholesky(vec![0.0; 4], 2).is_none() && cholesky(vec![f64::NAN; 4], 2).is_none());
    }

    #[test]
    fn an_even_sky_keeps_its_level() {
        // T . l of an even sky is the sum over all directions of the first column.
        for bands in [2, 3, 6] {
            let set = direction_set(256);
            let rows = fit_rows(&set, bands).unwrap();
            let sum: f64 = rows.iter().step_by(bands * bands).map(|v| f64::from(*v)).sum();
            assert!((sum / 256.0 / MEAN_OF_FIRST - 1.0).abs() < 0.01, "{bands}: {sum}");
        }
    }
}
