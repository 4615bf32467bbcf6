//! The surface of a leaf: what it sends back without letting it in, and so what light through the leaf lacks.
//!
//! The leaf shader of [Franzke 2005, 4.2.2] has a colour for the side that is lit, one for light from behind, and a specular
//! term. The colour for light from behind is a picture of its own there, taken with a scanner (3.2.2); where there is none it
//! is derived here, as the thesis says nothing of how:
//!
//! ```text
//!  base colour c = inside + surface      inside(c) = sqrt(c² + s²) - s, channel by channel
//!  from behind   = min(transmission * inside(c), 1 - c)
//! ```
//!
//! A picture of a leaf holds both what comes out of its tissue, which is green, and what its surface reflects, which has no
//! colour: a share `s` of 0.045 of the light in the mean of 23 species, 0.037 to 0.059 [McClendon & Fukshansky 1990]; that it
//! has no colour is confirmed by [Bousquet et al. 2005]. Light from behind holds the former alone, so it is yellower and
//! more saturated. `inside` is `c - s` where a leaf is bright and falls with the square of `c` where it is dark, so that no
//! channel is cut off. What is left, `c - inside(c)`, is the gloss: the shader spreads it over a lobe for the light of the
//! sun, and leaves it with the base colour for that of the sky; the path tracer has the lobe for all light. In the mean over
//! all directions nothing of it is lost: what facets of a rough leaf shade is made up for ([`lobe_gain`]).

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{PartKind, Plant, PlantMaterial};

/// The gloss of a leaf: what its surface reflects without letting it in. In a scene file: `(share: 0.045, roughness: 0.4)`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Gloss {
    /// Share of diffuse light that the surface reflects, 0..=0.09; a share `s` counts as `s / 2` for light that comes straight
    /// and eleven times as much for light that grazes. 0: matt, and light from behind has the base colour times the
    /// transmission. It is taken from the leaves' colour, so that more of it does not make a brighter tree: highlights grow,
    /// the rest darkens, light from behind is yellower. In a scene file: `share`. Default 0.045, the mean of 23 species.
    #[serde(rename = "share")]
    pub reflectance: f32,
    /// Width of the lobe, the microfacets' root mean square slope, 0.1..=1. Smaller: smaller and brighter highlights, as of
    /// wax (0.2); larger: as of down (0.6 and more). Default 0.4.
    pub roughness: f32,
}

impl Default for Gloss {
    /// [`Gloss::LEAF`].
    fn default() -> Self {
        Self::LEAF
    }
}

impl Gloss {
    /// No gloss.
    pub const MATT: Self = Self { reflectance: 0.0, roughness: 1.0 };
    /// A leaf's as measured: the reflectance of [McClendon & Fukshansky 1990], and from the slopes of 0.2 to 0.6 that fit the
    /// leaves of [Bousquet et al. 2005] and [Comar et al. 2014].
    pub const LEAF: Self = Self { reflectance: 0.045, roughness: 0.4 };

    /// The gloss with both values moved into their ranges; what is no number becomes a matt surface's.
    pub fn in_range(self) -> Self {
        let within = |value: f32, low: f32, high: f32, other: f32| {
            if value.is_nan() { other } else { value.clamp(low, high) }
        };
        Self { reflectance: within(self.reflectance, 0.0, 0.09, 0.0), roughness: within(self.roughness, 0.1, 1.0, 1.0) }
    }

    /// The part of the linear colour `base_color` that has been inside the leaf, channel by channel; the rest of it is the
    /// gloss. 0..1.
    pub fn inside(&self, base_color: Vec3) -> Vec3 {
        let c = base_color.clamp(Vec3::ZERO, Vec3::ONE);
        let s = Vec3::splat(self.in_range().reflectance);
        // sqrt(c² + s²) - s without cancellation.
        c * c / ((c * c + s * s).map(f32::sqrt) + s).max(Vec3::splat(1e-6))
    }
}

/// The strength with which the lobe of a leaf carries a share of 1 in the mean over all directions, by its roughness,
/// 0.05..=1: a single reflection loses what facets shade, 0.24 at a roughness of 0.1, 0.77 at 1 (`reference/lobe.rs`).
/// Fitted; within 0.4 % from 0.1 on, 1.3 % below.
pub fn lobe_gain(roughness: f32) -> f32 {
    ((0.747_35 * roughness - 0.464_45) * roughness + 2.971_15) * roughness + 1.031_46
}

/// What a lobe of strength 1 returns of even light to a viewer in the plane of the surface, who gets most, by the roughness,
/// 0.1..=1. Fitted; up to 1 % more than it is.
pub fn lobe_peak(roughness: f32) -> f32 {
    1.004
        / ((((0.614_61 * roughness - 1.468_04) * roughness + 0.639_87) * roughness + 1.116_31) * roughness + 0.097_622)
}

impl Plant {
    /// The gloss of the leaves, in the mean over their triangles; matt where there are none.
    pub fn leaf_gloss(&self) -> Gloss {
        let (mut reflectance, mut roughness, mut count) = (0.0, 0.0, 0.0);
        for part in self.parts.iter().filter(|part| part.kind == PartKind::Foliage) {
            let (gloss, triangles) = (part.material.gloss.in_range(), part.mesh.triangles.len() as f32);
            reflectance += triangles * gloss.reflectance;
            roughness += triangles * gloss.roughness;
            count += triangles;
        }
        if count > 0.0 { Gloss { reflectance: reflectance / count, roughness: roughness / count } } else { Gloss::MATT }
    }

    /// Gives all foliage this gloss.
    pub fn set_leaf_gloss(&mut self, gloss: Gloss) {
        for part in self.parts.iter_mut().filter(|part| part.kind == PartKind::Foliage) {
            part.material.gloss = gloss;
        }
    }
}

impl PlantMaterial {
    /// Linear colour of the light that comes through diffusely, 0..1, where the base colour is `base_color`: the twin of
    /// `leaf_transmission` in `shaders/common/lighting.wgsl`, which gives it as a factor on the base colour.
    pub fn transmitted(&self, base_color: Vec3) -> Vec3 {
        let c = base_color.clamp(Vec3::ZERO, Vec3::ONE);
        (self.transmission * self.gloss.inside(c)).clamp(Vec3::ZERO, Vec3::ONE - c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn material(transmission: Vec3, reflectance: f32) -> PlantMaterial {
        PlantMaterial { transmission, gloss: Gloss { reflectance, ..Gloss::LEAF }, ..PlantMaterial::default() }
    }

    #[test]
    fn light_from_behind_is_more_saturated_and_makes_no_energy() {
        let leaf = Vec3::new(0.085, 0.152, 0.027);
        let through = material(Vec3::splat(1.3), 0.045).transmitted(leaf);
        assert!(through.y / through.z > 1.5 * leaf.y / leaf.z, "{through}");
        assert!(through.y / through.x > 1.2 * leaf.y / leaf.x, "{through}");
        // Near the measured ratios of a green leaf's transmittance and reflectance.
        let ratio = through / leaf;
        assert!((ratio - Vec3::new(0.78, 0.97, 0.36)).abs().max_element() < 0.02, "{ratio}");
        for code in 0..=20 {
            let color = Vec3::splat(code as f32 / 20.0);
            for (factor, reflectance) in [(2.0, 0.045), (1.0, 0.0), (1.3, 0.09), (f32::MAX, f32::NAN)] {
                let through = material(Vec3::splat(factor), reflectance).transmitted(color);
                assert!(through.min_element() >= 0.0 && (through + color).max_element() <= 1.0 + 1e-6, "{through}");
            }
        }
    }

    #[test]
    fn a_matt_leaf_passes_its_base_colour() {
        let color = Vec3::new(0.3, 0.0, 1e-3);
        let through = material(Vec3::new(0.5, 0.25, 1.0), 0.0).transmitted(color);
        assert!((through - color * Vec3::new(0.5, 0.25, 1.0)).abs().max_element() < 1e-6, "{through}");
        assert_eq!(Gloss { reflectance: f32::NAN, roughness: f32::NAN }.in_range(), Gloss::MATT);
    }
}
