//! The directions of the rays, and the contribution of each to the coefficients.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use super::fit::Fit;
use super::{Projection, TransferSettings};
use crate::light::sh;
use crate::math::hammersley;

/// Lines that are followed to what they meet, at least, for light that bounces, where there are as many: such light
/// varies less from direction to direction than what hides it.
const FOLLOWED: usize = 48;

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

/// The rays in opposite pairs: of each pair, a line, the ray along it is number 0 and the one against it number 1.
pub(super) struct Directions {
    /// Unit vectors along the lines, in the upper hemisphere.
    pub lines: Vec<Vec3>,
    /// For each line and ray, bands² values: what an unhidden ray adds to the coefficients, times its cosine over the
    /// sum of all cosines to its side.
    rows: Vec<f32>,
    coefficients: usize,
    /// The lines that are followed to what they meet.
    pub followed: Vec<Vec3>,
}

impl Directions {
    /// The rays for sanitized `settings`.
    pub fn new(settings: &TransferSettings) -> Self {
        let bands = usize::from(settings.bands);
        // The first half of the set is the upper hemisphere.
        let lines = direction_set(settings.rays)[..settings.rays as usize / 2].to_vec();
        let rays: Vec<Vec3> = lines.iter().flat_map(|line| [*line, -*line]).collect();
        let mut rows = vec![0.0; rays.len() * bands * bands];
        for (row, ray) in rows.chunks_exact_mut(bands * bands).zip(&rays) {
            settings.projection.row_over(*ray, 1.0 / settings.rays as f32, row);
        }
        // Odd, so that the base-2 radical inverses of those that remain are still spread evenly.
        let every = ((lines.len() / FOLLOWED).saturating_sub(1) | 1).max(1);
        let followed: Vec<Vec3> = lines.iter().skip(every / 2).step_by(every).copied().collect();
        Self { lines, rows, coefficients: bands * bands, followed }
    }

    /// What an unhidden ray adds, times its share.
    pub fn row(&self, line: usize, ray: usize) -> &[f32] {
        &self.rows[(2 * line + ray) * self.coefficients..(2 * line + ray + 1) * self.coefficients]
    }
}

impl Projection {
    /// What light from the unit vector `direction` adds to the coefficients, for each unit of radiance, solid angle and
    /// cosine: the basis, or the functions of the fit. `out` takes whole bands.
    pub fn row(self, direction: Vec3, out: &mut [f32]) {
        self.row_over(direction, 0.0, out);
    }

    /// The mean of [`Projection::row`] over heights up to `half` below and above `direction`, where it may jump.
    fn row_over(self, direction: Vec3, half: f32, out: &mut [f32]) {
        match (self, Fit::of(sh::bands_in(out.len()))) {
            (Self::Fit, Some(fit)) => fit.row(direction, half, out),
            _ => sh::basis_into(direction, out),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_set_integrates_low_bands() {
        for n in [64, 256, 1024] {
            let rows: Vec<[f32; 9]> = direction_set(n).into_iter().map(sh::basis).collect();
            for i in 0..9 {
                let mean = rows.iter().map(|row| row[i]).sum::<f32>() / n as f32;
                let want = if i == 0 { 0.282_094_8 } else { 0.0 };
                assert!((mean - want).abs() < 1.5 / n as f32, "{n} rays, coefficient {i}: {mean}");
            }
        }
    }

    #[test]
    fn followed_rays_stand_for_all() {
        for rays in [16, 96, 256, 1000, 4096] {
            let settings = TransferSettings { rays, projection: Projection::Quadrature, ..Default::default() };
            let directions = Directions::new(&settings);
            assert!(directions.followed.len() >= FOLLOWED.min(rays as usize / 2));
            // Of the upper hemisphere, the mean height is 1/2 and the mean of the rest nothing.
            let mean = directions.followed.iter().sum::<Vec3>() / directions.followed.len() as f32;
            assert!((mean - 0.5 * Vec3::Y).length() < 0.06, "{rays}: {mean}");
        }
    }
}
