//! What a leaf's tissue leaves of the light, as integrals over its layers: the real-time form of the layered model
//! [Franzke 2005, 3.2; 4.2.2], which the bakes and the renderer share.
//!
//! The path tracer looks at the light at test points (`reference/leaf/layers.rs`). Here the sum over these is an
//! integral over each layer, for which there is a closed form, and the optical depth is the mean of the leaf. Levels of
//! detail whose leaves are too small to have an angle of their own have the mean over all angles.

use std::sync::Arc;

use glam::Vec3;
use image::RgbaImage;

use super::LeafTissue;
use super::leaf_textures::{Derivation, mean_optical_depth, thickness_and_absorption, transmission_of};
use super::optics::{mean_over_leaf, mean_texel};
use super::surface::filled;
use super::{Plant, PlantMaterial};
use crate::math::{color::srgb8, srgb_to_linear};

/// The least cosine of a ray to the normal inside a layer.
pub const LEAST_LAYER_COSINE: f32 = 0.05;
/// Cosines per angle of the mean over all angles.
const ANGLES: u32 = 16;
/// Cosines to the viewer for which the sky's factors are stored.
pub const SKY_COSINES: [f32; 3] = [0.1, 0.55, 1.0];

/// The tissue of a leaf with one optical depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TissueLight {
    /// Absorption times thickness.
    pub optical_depth: f32,
    /// Shares of the three layers; their sum is 1.
    pub shares: Vec3,
    /// Squares of their inverse indices of refraction.
    pub inverse_squares: Vec3,
}

/// The mean of `exp(-x t)` over `t` in 0..1.
fn mean_exp(x: f32) -> f32 {
    if x.abs() < 1e-2 { 1.0 - 0.5 * x } else { (1.0 - (-x).exp()) / x }
}

impl TissueLight {
    /// The leaf of `material`, in the mean over its mask; `None` where it has no tissue.
    pub fn new(material: &PlantMaterial) -> Option<Self> {
        let tissue = material.tissue?.sanitized();
        let textures = &material.leaf_textures;
        let [mut thickness, mut absorption] = [filled(&textures.thickness), filled(&textures.absorption)];
        if (thickness.is_none() || absorption.is_none())
            && let Some(derived) = thickness_and_absorption(material, Derivation::default())
        {
            let [of_thickness, of_absorption] = derived.map(Arc::new);
            thickness.get_or_insert(of_thickness);
            absorption.get_or_insert(of_absorption);
        }
        let optical_depth = mean_optical_depth(&tissue, material, [thickness.as_deref(), absorption.as_deref()]);
        Some(Self::of(&tissue, optical_depth))
    }

    /// A tissue, sanitized, of this optical depth.
    pub fn of(tissue: &LeafTissue, optical_depth: f32) -> Self {
        Self {
            // Beyond this nothing is left; infinity would make sums of NaN.
            optical_depth: optical_depth.clamp(0.0, 1e4),
            shares: Vec3::from(tissue.layers),
            inverse_squares: Vec3::from(tissue.refraction.map(|index| 1.0 / (index * index))),
        }
    }

    /// One over the cosines in the layers of a ray that meets the leaf at the cosine `outside`.
    fn slants(&self, outside: f32) -> [f32; 3] {
        let sine = (1.0 - outside * outside).max(0.0);
        let cosines = (1.0 - self.inverse_squares * sine).max(Vec3::ZERO).map(f32::sqrt);
        cosines.max(Vec3::splat(LEAST_LAYER_COSINE)).recip().to_array()
    }

    /// What is left of the light from the cosine `light` at the cosine `view`, both 0..=1, from before and from behind: 0..=1. The
    /// twin of `tissue_light` in `shaders/common/tissue.wgsl`. As seen from the front; the light from behind is the same on
    /// the back, that from before nearly.
    pub fn attenuation(&self, view: f32, light: f32) -> [f32; 2] {
        let (view, light) = (self.slants(view), self.slants(light));
        let depth = (self.optical_depth * self.shares).to_array();
        let (mut before, mut behind) = (0.0f32, 0.0f32);
        let (mut above, mut seen) = (0.0f32, 0.0f32);
        let mut below: f32 = (0..3).map(|layer| depth[layer] * light[layer]).sum();
        for layer in 0..3 {
            let (to_viewer, to_light) = (depth[layer] * view[layer], depth[layer] * light[layer]);
            below -= to_light;
            before += self.shares[layer] * (-above).exp() * mean_exp(to_viewer + to_light);
            // Symmetric in both, so that no exponent is positive.
            let (most, least) = (to_viewer.max(to_light), to_viewer.min(to_light));
            behind += self.shares[layer] * (-(seen + below.max(0.0)) - least).exp() * mean_exp(most - least);
            above += to_viewer + to_light;
            seen += to_viewer;
        }
        [before, behind]
    }

    /// The same over that of perpendicular light seen perpendicularly, which the leaf's colours contain: 0..=1.
    pub fn factors(&self, view: f32, light: f32) -> [f32; 2] {
        let (left, whole) = (self.attenuation(view, light), self.attenuation(1.0, 1.0));
        [0, 1].map(|side| (left[side] / whole[side].max(f32::MIN_POSITIVE)).min(1.0))
    }

    /// The factors in even light, at the cosine `view`.
    pub fn in_even_light(&self, view: f32) -> [f32; 2] {
        let mut sum = [0.0; 2];
        for step in 0..ANGLES {
            let light = (step as f32 + 0.5) / ANGLES as f32;
            let factors = self.factors(view, light);
            for side in 0..2 {
                sum[side] += factors[side] * 2.0 * light / ANGLES as f32;
            }
        }
        sum
    }

    /// The factors in the mean over leaves of all angles, in light from anywhere.
    pub fn mean(&self) -> [f32; 2] {
        let mut sum = [0.0; 2];
        for step in 0..ANGLES {
            let view = (step as f32 + 0.5) / ANGLES as f32;
            let factors = self.in_even_light(view);
            for side in 0..2 {
                sum[side] += factors[side] * 2.0 * view / ANGLES as f32;
            }
        }
        sum
    }
}

impl Plant {
    /// The plant with leaves whose colours are those in the mean over all angles, and that need no layers: for levels of
    /// detail that show no single leaf. `None` where no leaf has layers.
    pub fn without_layers(&self) -> Option<Self> {
        self.parts.iter().any(|part| part.material.tissue.is_some()).then(|| {
            let mut plant = self.clone();
            plant.parts.iter_mut().for_each(|part| part.material.average_layers());
            plant
        })
    }
}

impl PlantMaterial {
    /// Takes `image` for what comes through (sRGB), and its mean over the leaf for the levels of detail that have a factor
    /// on the front instead.
    pub fn set_transmission(&mut self, image: Arc<RgbaImage>) {
        let wanted = mean_texel(&image, self).truncate();
        let [inside] = mean_over_leaf(self, |color| [self.gloss.subsurface_albedo(color)]);
        let most = Vec3::splat(Self::MOST_TRANSMISSION);
        self.transmission = (wanted / inside.max(Vec3::splat(1e-6))).clamp(Vec3::ZERO, most);
        self.leaf_textures.transmission = Some(image);
    }

    fn average_layers(&mut self) {
        let Some(light) = TissueLight::new(self) else { return };
        let [before, behind] = light.mean();
        let through = self.leaf_textures.transmission.take();
        self.base_color *= before;
        self.transmission *= behind / before.max(1e-6);
        self.leaf_textures = super::LeafTextures {
            transmission: through.map(|image| Arc::new(scaled(&image, behind))),
            ..super::LeafTextures::default()
        };
        self.tissue = None;
    }

    /// What comes through, with what the tissue does to perpendicular light at every texel: sRGB. `None` without a
    /// tissue and without a texture.
    pub fn light_through(&self) -> Option<RgbaImage> {
        let given = filled(&self.leaf_textures.transmission);
        let given = given.as_deref();
        let Some(tissue) = self.tissue.map(LeafTissue::sanitized) else { return given.cloned() };
        super::leaf_textures::attenuated_transmission(self, &tissue)
            .or_else(|| given.cloned())
            .or_else(|| transmission_of(self))
    }
}

/// The image with its linear colours times `factor`.
fn scaled(image: &RgbaImage, factor: f32) -> RgbaImage {
    let table: [u8; 256] = std::array::from_fn(|code| srgb8(factor * srgb_to_linear(code as f32 / 255.0)));
    let mut image = image.clone();
    image.pixels_mut().for_each(|texel| texel.0[..3].iter_mut().for_each(|value| *value = table[usize::from(*value)]));
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaf(optical_depth: f32) -> TissueLight {
        TissueLight::of(&LeafTissue::default(), optical_depth)
    }

    #[test]
    fn perpendicular_light_is_that_of_lambert_and_beer() {
        let [before, behind] = leaf(0.5).attenuation(1.0, 1.0);
        assert!((behind - (-0.5f32).exp()).abs() < 1e-6);
        assert!((before - (1.0 - (-1.0f32).exp())).abs() < 1e-6);
        assert_eq!(leaf(0.5).factors(1.0, 1.0), [1.0; 2]);
    }

    #[test]
    fn factors_are_finite_symmetric_and_fall_with_the_angle() {
        for depth in [0.0, 1e-6, 0.3, 5.0, f32::INFINITY] {
            for view in [0.0, 0.3, 1.0] {
                let mut last = [0.0; 2];
                for step in 0..=20 {
                    let light = step as f32 / 20.0;
                    let (left, other) = (leaf(depth).attenuation(view, light), leaf(depth).attenuation(light, view));
                    assert!(left.iter().all(|value| (0.0..=1.0 + 1e-6).contains(value)), "{left:?}");
                    assert!((left[0] - other[0]).abs() < 1e-6, "{left:?} {other:?}");
                    assert!(left[0] >= last[0] - 1e-6 && left[1] >= last[1] - 1e-6);
                    last = left;
                }
            }
            assert!(leaf(depth).mean().iter().all(|value| (0.0..=1.0 + 1e-6).contains(value)));
        }
        // A leaf without absorption is Lambert.
        assert!(leaf(0.0).mean().iter().all(|value| (value - 1.0).abs() < 1e-6));
    }
}
