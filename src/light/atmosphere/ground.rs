//! Illuminance of horizontal ground by the sky, as a table over the sun's elevation.

use glam::{Vec3, Vec3A};
use rayon::prelude::*;

use super::multiple::ln;
use super::transmittance::{SunAxis, bilinear};
use super::{Atmosphere, LOWEST_OBSERVER_M, VIEW_STEPS};
use crate::math::SphereQuadrature;

const RINGS: usize = 12;
const AZIMUTHS: usize = 24;

/// Illuminance of the sky per unit of above-air illuminance, as a logarithm.
#[derive(Debug, Clone)]
pub(super) struct GroundTable {
    logarithm: Vec<Vec3A>,
}

impl GroundTable {
    /// A table without light, used until the real one is computed.
    pub fn dark() -> Self {
        Self { logarithm: vec![ln(Vec3::ZERO); SunAxis::LEN] }
    }

    pub fn new(atmosphere: &Atmosphere) -> Self {
        let rule = SphereQuadrature::new(RINGS, AZIMUTHS);
        let r = atmosphere.params.ground_radius_m + LOWEST_OBSERVER_M;
        // All directions of a ring have the same segments.
        let rings: Vec<_> = rule
            .upper()
            .chunks(AZIMUTHS)
            .map(|ring| (ring, atmosphere.march_sky(r, ring.first().map_or(1.0, |n| f64::from(n.0.y)), VIEW_STEPS).0))
            .collect();
        let logarithm = (0..SunAxis::LEN)
            .into_par_iter()
            .map(|texel| {
                let mu = SunAxis::cosine(texel);
                let sun = Vec3::new(0.0, mu as f32, (1.0 - mu * mu).max(0.0).sqrt() as f32);
                let mut sum = Vec3::ZERO;
                for (ring, segments) in &rings {
                    for &(direction, solid_angle) in *ring {
                        // The sun lies in the plane x = 0, so the other half of the ring is a mirror image.
                        if direction.x > 0.0 {
                            let weight = 2.0 * solid_angle * direction.y;
                            sum += atmosphere.in_scatter(segments, r, direction, sun) * weight;
                        }
                    }
                }
                ln(sum)
            })
            .collect();
        Self { logarithm }
    }

    pub fn sample(&self, sun_mu: f64) -> Vec3 {
        bilinear(&self.logarithm, SunAxis::LEN, SunAxis::coordinate(sun_mu), 0.0).exp()
    }
}
