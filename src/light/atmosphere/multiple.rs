//! Multiple scattering: Hillaire 2020, section 5.5, eq. 5 to 10.
//!
//! The table holds `L_2nd / (1 - f_ms)` by the height of a point and the zenith angle of the sun: the light that
//! reaches the point after its surroundings scattered or reflected it once, times the sum of the geometric series of
//! all further scatterings. It assumes isotropic scattering.

use std::f32::consts::PI;

use glam::{Vec3, Vec3A};
use rayon::prelude::*;

use super::Atmosphere;
use super::transmittance::{Level, SunAxis, bilinear};
use crate::math::SphereQuadrature;

const HEIGHTS: usize = 32;
/// 8 rings in each hemisphere, 16 azimuths. There are many directions, because at dusk only few of them have light.
const RINGS: usize = 8;
const AZIMUTHS: usize = 16;
const STEPS: usize = 20;

/// Radiance per unit of above-air illuminance, averaged over the sphere, as a logarithm.
#[derive(Debug, Clone)]
pub(super) struct MultipleScatteringLut {
    logarithm: Vec<Vec3A>,
}

impl MultipleScatteringLut {
    /// A table without light, used until the real one is computed.
    pub fn dark() -> Self {
        Self { logarithm: vec![ln(Vec3::ZERO); SunAxis::LEN * HEIGHTS] }
    }

    pub fn new(atmosphere: &Atmosphere) -> Self {
        let rule = SphereQuadrature::new(RINGS, AZIMUTHS);
        let logarithm = (0..HEIGHTS)
            .into_par_iter()
            .flat_map_iter(|row| {
                let height = atmosphere.params.top_height_m * (row as f64 / (HEIGHTS - 1) as f64).powi(2);
                let rays = Rays::new(atmosphere, &rule, atmosphere.observer_radius(height));
                (0..SunAxis::LEN).map(move |column| ln(rays.scattered(atmosphere, SunAxis::cosine(column))))
            })
            .collect();
        Self { logarithm }
    }

    pub fn sample(&self, level: &Level, mu: f64) -> Vec3 {
        let row = level.height.clamp(0.0, 1.0).sqrt() * (HEIGHTS - 1) as f64;
        bilinear(&self.logarithm, SunAxis::LEN, SunAxis::coordinate(mu), row).exp()
    }
}

/// A logarithm that is also defined for black.
pub(super) fn ln(v: Vec3) -> Vec3A {
    v.max(Vec3::splat(1e-30)).map(f32::ln).into()
}

/// The rays of a point in all directions of half the sphere. The other half is its mirror image, because the sun lies
/// in the plane between them.
struct Rays {
    r: f64,
    rays: Vec<Ray>,
    /// `1 / (1 - f_ms)`, eq. 9.
    series: Vec3,
}

struct Ray {
    direction: Vec3,
    /// Fraction of the whole sphere.
    weight: f32,
    segments: Vec<super::Segment>,
    /// Distance to the ground and transmittance of the ray up to it, if the ray hits it.
    ground: Option<(f64, Vec3)>,
}

impl Rays {
    fn new(atmosphere: &Atmosphere, rule: &SphereQuadrature, r: f64) -> Self {
        let ground_radius = atmosphere.params.ground_radius_m;
        let top = atmosphere.params.top_radius();
        let mut transfer = Vec3::ZERO;
        let rays = rule
            .sphere()
            .iter()
            .filter(|(direction, _)| direction.x > 0.0)
            .map(|&(direction, solid_angle)| {
                let mu = f64::from(direction.y);
                let to_ground = r * r * (mu * mu - 1.0) + ground_radius * ground_radius;
                let hits = mu < 0.0 && to_ground >= 0.0;
                let length = if hits {
                    -r * mu - to_ground.sqrt()
                } else {
                    -r * mu + (r * r * (mu * mu - 1.0) + top * top).max(0.0).sqrt()
                };
                let (segments, through) = atmosphere.march(r, mu, length, STEPS);
                let weight = 2.0 * solid_angle / (4.0 * PI);
                transfer += weight * segments.iter().map(|s| s.rayleigh + s.mie).sum::<Vec3>();
                Ray { direction, weight, segments, ground: hits.then_some((length, through)) }
            })
            .collect();
        Self { r, rays, series: (Vec3::ONE - transfer.min(Vec3::splat(0.99))).recip() }
    }

    /// Eq. 5, 6 and 10 for the sun's zenith cosine `sun_mu`.
    fn scattered(&self, atmosphere: &Atmosphere, sun_mu: f64) -> Vec3 {
        let ground = atmosphere.transmittance.level(atmosphere.params.ground_radius_m);
        let sun_z = (1.0 - sun_mu * sun_mu).max(0.0).sqrt();
        let mut second = Vec3::ZERO;
        for ray in &self.rays {
            let cosine = f64::from(ray.direction.y) * sun_mu + f64::from(ray.direction.z) * sun_z;
            let at = |t: f64, r: f64| ((self.r * sun_mu + t * cosine) / r).clamp(-1.0, 1.0);
            let mut radiance = Vec3::ZERO;
            for s in &ray.segments {
                radiance += atmosphere.sunlight(&s.level, at(s.t, s.level.r)) * (s.rayleigh + s.mie) / (4.0 * PI);
            }
            if let Some((distance, through)) = ray.ground {
                let mu = at(distance, ground.r);
                let lit = atmosphere.sunlight(&ground, mu) * mu.max(0.0) as f32;
                radiance += through * lit * atmosphere.params.ground_albedo / PI;
            }
            second += radiance * ray.weight;
        }
        second * self.series
    }
}
