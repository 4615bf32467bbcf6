//! The directions of the rays, and what each adds to the coefficients.

use std::f32::consts::PI;
use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use super::fit::fit_rows;
use super::{Projection, TransferSettings};
use crate::light::sh;
use crate::scatter::sequence::hammersley;

/// One ray in so many is followed to what it meets, for light that bounces: such light varies less from direction to
/// direction than what hides it. Odd, so that the base-2 radical inverses of those that remain are still spread evenly.
const LINK_EVERY: usize = 3;

/// From so many rays on.
const LINK_ALL_BELOW: usize = 96;

/// `n` unit vectors, evenly spread over the whole sphere: Hammersley's set, `y` from the regular coordinate, the
/// azimuth from the radical inverse (area-preserving, Archimedes).
pub fn direction_set(n: u32) -> Vec<Vec3> {
    (0..u64::from(n))
        .map(|i| {
            let point = hammersley(i, u64::from(n));
            let y = 1.0 - 2.0 * (point.x + 0.5 / f64::from(n));
            let (sin, cos) = (TAU * point.y).sin_cos();
            let s = (1.0 - y * y).max(0.0).sqrt();
            DVec3::new(s * sin, y, s * cos).as_vec3()
        })
        .collect()
}

/// One direction of the set.
pub(super) struct Direction {
    /// Unit vector.
    pub toward: Vec3,
    /// Whether a ray in this direction is followed to what it meets.
    pub linked: bool,
}

/// The directions in the order in which they are traced, neighbours beside each other.
pub(super) struct Directions {
    /// The directions.
    pub list: Vec<Direction>,
    /// For each direction, bands² values: what an unhidden ray at normal incidence adds to the coefficients.
    rows: Vec<f32>,
    coefficients: usize,
    /// What a followed ray at normal incidence adds for each unit of radiance: solid angle over pi.
    pub link_weight: f32,
}

impl Directions {
    /// For `settings` in range.
    pub fn new(settings: &TransferSettings) -> Self {
        let set = direction_set(settings.rays);
        let bands = usize::from(settings.bands);
        let coefficients = bands * bands;
        let values = match settings.projection {
            Projection::Quadrature => projection_rows(&set, bands),
            Projection::Fit => fit_rows(&set, bands).unwrap_or_else(|| projection_rows(&set, bands)),
        };
        let every = if set.len() < LINK_ALL_BELOW { 1 } else { LINK_EVERY };
        let mut order: Vec<usize> = (0..set.len()).collect();
        // Rays of one octant visit the tree's nodes in one order.
        let octant = |d: Vec3| u8::from(d.x < 0.0) | u8::from(d.y < 0.0) << 1 | u8::from(d.z < 0.0) << 2;
        order.sort_by_key(|&i| (octant(set[i]), i));
        let weight = 4.0 / set.len() as f32;
        let rows = order
            .iter()
            .flat_map(|&i| values[i * coefficients..(i + 1) * coefficients].iter().map(|value| value * weight))
            .collect();
        let linked = |i: usize| i % every == every / 2;
        let link_count = (0..set.len()).filter(|&i| linked(i)).count().max(1);
        let list = order.iter().map(|&i| Direction { toward: set[i], linked: linked(i) }).collect();
        Self { list, rows, coefficients, link_weight: 4.0 * PI / (PI * link_count as f32) }
    }

    /// What an unhidden ray in this direction at normal incidence adds.
    pub fn row(&self, direction: usize) -> &[f32] {
        &self.rows[direction * self.coefficients..(direction + 1) * self.coefficients]
    }
}

/// The basis at each direction.
pub(super) fn projection_rows(set: &[Vec3], bands: usize) -> Vec<f32> {
    let count = bands * bands;
    let mut rows = vec![0.0; set.len() * count];
    for (row, direction) in rows.chunks_exact_mut(count).zip(set) {
        sh::basis_into(*direction, row);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::super::Interior;
    use super::*;

    #[test]
    fn the_set_integrates_low_bands() {
        for n in [64, 256, 1024] {
            let rows = projection_rows(&direction_set(n), 3);
            for i in 0..9 {
                let mean: f32 = rows.iter().skip(i).step_by(9).sum::<f32>() / n as f32;
                let want = if i == 0 { 0.282_094_8 } else { 0.0 };
                assert!((mean - want).abs() < 1.5 / n as f32, "{n} rays, coefficient {i}: {mean}");
            }
        }
    }

    #[test]
    fn followed_rays_stand_for_all() {
        for rays in [16, 95, 96, 256, 1000] {
            let settings = TransferSettings { rays, projection: Projection::Quadrature, ..Default::default() };
            let directions = Directions::new(&TransferSettings { interior: Interior::Diffuse(1), ..settings });
            let total: f32 = directions.list.iter().filter(|d| d.linked).map(|_| directions.link_weight).sum();
            assert!((total - 4.0).abs() < 1e-4);
            let mean = directions.list.iter().filter(|d| d.linked).map(|d| d.toward).sum::<Vec3>();
            assert!(mean.length() * directions.link_weight < 0.2, "{rays}: {mean}");
        }
    }
}
