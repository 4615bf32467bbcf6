//! All light on a plant except the disc of the sun or moon: the sky above, the ground's reflection below.

use std::f32::consts::PI;

use glam::Vec3;

use super::atmosphere::SkyView;
use super::sh;
use crate::math::SphereQuadrature;

/// Rings per hemisphere and azimuths with which the surroundings are projected onto spherical harmonics.
const SH_RINGS: usize = 24;
const SH_AZIMUTHS: usize = 64;

/// The radiance that arrives from every direction at a plant that stands alone on level, diffuse ground.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// The sky, without discs.
    pub sky: &'a SkyView,
    /// Radiance of the ground, nits per channel.
    pub ground: Vec3,
}

impl Surroundings<'_> {
    /// Radiance in nits, per channel, that arrives FROM the unit vector `direction`: the sky's at and above the
    /// horizontal, the ground's below it.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        if direction.y >= 0.0 { self.sky.sample(direction) } else { self.ground }
    }

    /// Coefficients of [`Surroundings::radiance`] in the basis of [`sh`], `bands` bands (1 to [`sh::MAX_BANDS`],
    /// others are moved into that range), nits. Not windowed: what is read from them by a dot product with a transfer
    /// ([`crate::bake::lighting::transfer`]) is clamped there.
    ///
    /// They are computed once and rotated into any yaw of a plant by [`sh::rotate_y`], exactly, for any band.
    pub fn project(&self, bands: usize) -> Vec<Vec3> {
        let bands = bands.clamp(1, sh::MAX_BANDS);
        let mut out = vec![Vec3::ZERO; bands * bands];
        sh::project(&SphereQuadrature::new(SH_RINGS, SH_AZIMUTHS), &mut out, |direction| self.radiance(direction));
        out
    }
}

/// Illuminance of the sky (without disc) on the horizontal ground, lux per channel.
pub(super) fn sky_illuminance(sky: &SkyView) -> Vec3 {
    let rule = SphereQuadrature::new(SH_RINGS, SH_AZIMUTHS);
    rule.upper().iter().map(|&(direction, solid_angle)| sky.sample(direction) * solid_angle * direction.y).sum()
}

/// Radiance of diffuse ground of this albedo under this illuminance (lux).
pub(super) fn ground_radiance(albedo: Vec3, illuminance: Vec3) -> Vec3 {
    albedo / PI * illuminance
}
