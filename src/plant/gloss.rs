//! The surface of a leaf: the light that it reflects without letting it in, and the light that transmission therefore
//! lacks.
//!
//! The leaf shader of [Franzke 2005, 4.2.2] has a colour for the lit side, one for light from behind, and a specular
//! term. There the colour for light from behind is a texture of its own, made with a scanner (3.2.2). Where a plant has
//! none it is derived here, because the thesis does not say how:
//!
//! ```text
//!  base colour c = subsurface + surface     subsurface(c) = sqrt(c² + s²) - s, channel by channel
//!  from behind   = min(transmission * subsurface(c), 1 - c)
//! ```
//!
//! The texture of a leaf contains the light that comes out of its tissue, which is green, and the light that its
//! surface reflects, which is white: a fraction `s` of 0.045, the mean of 23 species, which range from 0.037 to 0.059
//! [McClendon & Fukshansky 1990]. [Bousquet et al. 2005] confirm that it is white. Light from behind contains the
//! former alone, so it is yellower and more saturated. The subsurface albedo is `c - s` where a leaf is bright and
//! falls with the square of `c` where it is dark, so that no channel is cut off. The rest, `c - subsurface(c)`, is the
//! gloss. For sunlight the shader distributes it over a specular lobe; for skylight it stays in the base colour. The
//! path tracer uses the lobe for all light. The mean over all directions loses nothing of it: [`lobe_gain`] restores
//! what the facets of a rough leaf mask, and a bright leaf, which has no room for the whole lobe, reflects the rest
//! diffusely ([`Gloss::specular_albedo`]).

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{LeafTissue, PartKind, Plant, PlantMaterial};

/// The gloss of a leaf: the light that its surface reflects without letting it in. In a scene file: `(share: 0.045,
/// roughness: 0.4)`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Gloss {
    /// Specular albedo: fraction of diffuse light that the surface reflects, 0..=0.09. Of light at normal incidence it
    /// reflects half of this fraction, of grazing light eleven times it. 0: matt, and light from behind has the base
    /// colour times the transmission. The gloss is part of the leaves' colour, so more of it does not make a brighter
    /// tree: highlights grow, the rest darkens, light from behind gets yellower. In a scene file: `share`. Default
    /// 0.045, the mean of 23 species.
    #[serde(rename = "share")]
    pub reflectance: f32,
    /// Width of the lobe: the microfacets' root mean square slope, 0.1..=1. Smaller: smaller and brighter highlights,
    /// as on waxy leaves (0.2); larger: as on downy leaves (0.6 and more). Default 0.4.
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
    /// A measured leaf: the reflectance of [McClendon & Fukshansky 1990], and a roughness within the slopes of 0.2 to
    /// 0.6 that fit the leaves of [Bousquet et al. 2005] and [Comar et al. 2014].
    pub const LEAF: Self = Self { reflectance: 0.045, roughness: 0.4 };

    /// The gloss with both values clamped to their ranges; NaN becomes the value of a matt surface.
    pub fn sanitized(self) -> Self {
        let within = |value: f32, low: f32, high: f32, other: f32| {
            if value.is_nan() { other } else { value.clamp(low, high) }
        };
        Self { reflectance: within(self.reflectance, 0.0, 0.09, 0.0), roughness: within(self.roughness, 0.1, 1.0, 1.0) }
    }

    /// Subsurface albedo: the part of the linear `base_color` that comes out of the leaf's tissue, per channel, 0..1.
    /// The rest of the colour is the gloss.
    pub fn subsurface_albedo(&self, base_color: Vec3) -> Vec3 {
        let c = base_color.clamp(Vec3::ZERO, Vec3::ONE);
        let s = Vec3::splat(self.sanitized().reflectance);
        // sqrt(c² + s²) - s without cancellation.
        c * c / ((c * c + s * s).map(f32::sqrt) + s).max(Vec3::splat(1e-6))
    }
}

impl Gloss {
    /// Specular albedo: the part of the linear `base_color` that the lobe reflects, in the mean over all directions, per
    /// channel, 0..1. `transmitted` is the fraction of light that the leaf transmits. The rest of the base colour is
    /// reflected diffusely.
    ///
    /// It is `base_color - subsurface_albedo`, or what there is room for: a viewer in the plane of the leaf, who gets
    /// most of the lobe, must not get more than there is. A leaf that absorbs nothing has no gloss.
    pub fn specular_albedo(&self, base_color: Vec3, transmitted: Vec3) -> Vec3 {
        let c = base_color.clamp(Vec3::ZERO, Vec3::ONE);
        let room = (Vec3::ONE - c - transmitted).max(Vec3::ZERO) * lobe_room(self.sanitized().roughness);
        (c - self.subsurface_albedo(c)).min(room)
    }
}

/// Strength at which the lobe of a leaf has a specular albedo of 1 (mean over all directions), for a roughness of
/// 0.05..=1. A single reflection loses the light that facets mask: 0.24 at a roughness of 0.1, 0.77 at 1
/// (`reference/lobe.rs`). Fitted; within 0.4 % from 0.1 on, 1.3 % below.
pub fn lobe_gain(roughness: f32) -> f32 {
    ((0.747_35 * roughness - 0.464_45) * roughness + 2.971_15) * roughness + 1.031_46
}

/// Fraction of uniform light that a lobe of strength 1 reflects to a viewer in the plane of the surface, who gets most,
/// for a roughness of 0.1..=1. Fitted; up to 1 % too high.
pub fn lobe_peak(roughness: f32) -> f32 {
    1.004
        / ((((0.614_61 * roughness - 1.468_04) * roughness + 0.639_87) * roughness + 1.116_31) * roughness + 0.097_622)
}

/// Largest specular albedo of a surface that absorbs all light which it does not reflect or transmit in the mean over
/// its directions, over the fraction that it absorbs, for a roughness of 0.1..=1. A view in the plane of the surface,
/// the brightest, then absorbs nothing: `absorbed + albedo = albedo * lobe_gain * lobe_peak`.
pub fn lobe_room(roughness: f32) -> f32 {
    (lobe_gain(roughness) * lobe_peak(roughness) - 1.0).recip()
}

impl Plant {
    /// The gloss of the leaves, in the mean over their triangles; matt where there are none.
    pub fn leaf_gloss(&self) -> Gloss {
        let (mut reflectance, mut roughness, mut count) = (0.0, 0.0, 0.0);
        for part in self.parts.iter().filter(|part| part.kind == PartKind::Foliage) {
            let (gloss, triangles) = (part.material.gloss.sanitized(), part.mesh.triangles.len() as f32);
            reflectance += triangles * gloss.reflectance;
            roughness += triangles * gloss.roughness;
            count += triangles;
        }
        if count > 0.0 { Gloss { reflectance: reflectance / count, roughness: roughness / count } } else { Gloss::MATT }
    }

    /// Gives all foliage this tissue. What is a closed volume stays one.
    pub fn set_leaf_tissue(&mut self, tissue: LeafTissue) {
        for part in self.parts.iter_mut().filter(|part| part.kind == PartKind::Foliage) {
            let volume = part.material.tissue.is_some_and(|tissue| tissue.volume);
            part.material.tissue = Some(LeafTissue { volume, ..tissue.sanitized() });
        }
    }

    /// Gives all foliage this gloss.
    pub fn set_leaf_gloss(&mut self, gloss: Gloss) {
        for part in self.parts.iter_mut().filter(|part| part.kind == PartKind::Foliage) {
            part.material.gloss = gloss;
        }
    }
}

impl PlantMaterial {
    /// Linear colour of the light that comes through diffusely, 0..1, where the base colour is `base_color`: the twin
    /// of `leaf_transmission` in `shaders/common/lighting.wgsl`, which gives it as a factor on the base colour.
    pub fn transmitted(&self, base_color: Vec3) -> Vec3 {
        let c = base_color.clamp(Vec3::ZERO, Vec3::ONE);
        (self.transmission * self.gloss.subsurface_albedo(c)).clamp(Vec3::ZERO, Vec3::ONE - c)
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
    fn a_bright_leaf_gives_up_gloss_before_colour() {
        for roughness in [0.1, 0.4, 1.0] {
            let gloss = Gloss { roughness, ..Gloss::LEAF };
            let specular = |color: f32, through: f32| gloss.specular_albedo(Vec3::splat(color), Vec3::splat(through)).y;
            let green = 0.15 - gloss.subsurface_albedo(Vec3::splat(0.15)).y;
            assert!(specular(0.15, 0.15) == green && green > 0.03);
            assert!(specular(0.5, 0.45) < 0.02 && specular(0.5, 0.45) > 0.008);
            assert_eq!((specular(0.5, 0.5), specular(1.0, 0.0), specular(0.7, 0.9)), (0.0, 0.0, 0.0));
            // All views keep to the energy there is: what the brightest gets is one.
            let brightest = specular(0.5, 0.45) * lobe_gain(roughness) * lobe_peak(roughness);
            assert!((0.95 - specular(0.5, 0.45) + brightest - 1.0).abs() < 1e-6);
        }
        assert_eq!(Gloss::MATT.specular_albedo(Vec3::splat(0.3), Vec3::ZERO), Vec3::ZERO);
        let strange = Gloss { reflectance: f32::NAN, roughness: f32::NAN }.specular_albedo(Vec3::splat(2.0), Vec3::NAN);
        assert!(strange.is_finite() && strange.min_element() >= 0.0);
    }

    #[test]
    fn a_matt_leaf_passes_its_base_colour() {
        let color = Vec3::new(0.3, 0.0, 1e-3);
        let through = material(Vec3::new(0.5, 0.25, 1.0), 0.0).transmitted(color);
        assert!((through - color * Vec3::new(0.5, 0.25, 1.0)).abs().max_element() < 1e-6, "{through}");
        assert_eq!(Gloss { reflectance: f32::NAN, roughness: f32::NAN }.sanitized(), Gloss::MATT);
    }
}
