//! How the light of a leaf with a tissue changes with the angle: what the path tracer, the bakes and the renderer share.
//!
//! The tissue is solved as three slabs that absorb and scatter (`tissue_slabs.rs`), once for a species. What is
//! left of it is four polynomials: the light that is sent back and that is let through, from the front and from the
//! back, over that of perpendicular light. A leaf is then the product of that of the light's angle and that of the
//! viewer's, which is reciprocal, and exact for the light that comes from one direction and leaves in all.
//!
//! Levels of detail whose leaves are too small to have an angle of their own have the mean over all angles.

use std::sync::Arc;

use glam::{Vec3, Vec4};
use image::RgbaImage;

use super::LeafTissue;
use super::leaf_textures::{Derivation, mean_optical_depth, thickness_and_absorption, transmission_of};
use super::optics::{mean_over_leaf, mean_texel};
use super::surface::filled;
use super::tissue_slabs::Slabs;
use super::{Plant, PlantMaterial};
use crate::math::{color::srgb8, srgb_to_linear};

/// The least cosine of a ray to the normal inside a layer.
pub const LEAST_LAYER_COSINE: f32 = 0.05;
/// Cosines at which a polynomial is exact.
const EXACT: [f64; 4] = [1.0, 0.7, 0.35, 0.08];
/// The most optical depth of absorption: beyond it nothing is left that has an angle.
const MOST_ABSORPTION: f64 = 5.0;
/// The least value of a polynomial.
const LEAST: f32 = 1e-3;

/// A factor on light over its cosine to the leaf, 1 where it is perpendicular: a polynomial of degree 3, constant first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleFactor(pub Vec4);

impl AngleFactor {
    /// That of a Lambertian leaf.
    pub const LAMBERT: Self = Self(Vec4::X);

    /// Through `values` at the cosines [`EXACT`], over the first of them.
    fn through(values: [f64; 4]) -> Self {
        if values[0] <= 0.0 {
            return Self::LAMBERT;
        }
        // Newton's divided differences, multiplied out.
        let mut differences = values.map(|value| value / values[0]);
        for order in 1..4 {
            for i in (order..4).rev() {
                differences[i] = (differences[i] - differences[i - 1]) / (EXACT[i] - EXACT[i - order]);
            }
        }
        let mut polynomial = [0.0; 4];
        for (difference, node) in differences.iter().zip(EXACT).rev() {
            // polynomial * (x - node) + difference
            for i in (0..4).rev() {
                let lower = if i > 0 { polynomial[i - 1] } else { *difference };
                polynomial[i] = lower - node * polynomial[i];
            }
        }
        let found = Self(Vec4::from(polynomial.map(|value| value as f32)));
        if found.0.is_finite() { found } else { Self::LAMBERT }
    }

    /// The factor at a cosine, 0..=1: positive.
    pub fn at(self, cosine: f32) -> f32 {
        let [a, b, c, d] = self.0.to_array();
        (((d * cosine + c) * cosine + b) * cosine + a).max(LEAST)
    }

    /// The mean over even light, by the cosine.
    pub fn mean(self) -> f32 {
        self.0.dot(Vec4::new(1.0, 2.0 / 3.0, 0.5, 0.4)).max(LEAST)
    }

    /// The greatest value.
    fn most(self) -> f32 {
        (0..=16).map(|step| self.at(step as f32 / 16.0)).fold(0.0, f32::max)
    }
}

/// One side of a leaf: factors on the light that comes from a direction, or is seen from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeafSide {
    /// On light that is sent back.
    pub reflected: AngleFactor,
    /// On light that enters here and comes out on the other side; the same as on light from there that comes out here.
    pub transmitted: AngleFactor,
}

/// The tissue of a leaf in the mean over its mask.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TissueLight {
    /// The front.
    pub front: LeafSide,
    /// The back.
    pub back: LeafSide,
}

impl TissueLight {
    /// A leaf that is the same from all angles.
    pub const LAMBERT: Self = {
        let side = LeafSide { reflected: AngleFactor::LAMBERT, transmitted: AngleFactor::LAMBERT };
        Self { front: side, back: side }
    };

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

    /// A tissue, sanitized, of this optical depth of absorption.
    pub fn of(tissue: &LeafTissue, optical_depth: f32) -> Self {
        let front = Slabs {
            shares: tissue.layers.map(f64::from),
            indices: tissue.refraction.map(f64::from),
            absorption: f64::from(optical_depth).clamp(0.0, MOST_ABSORPTION),
            scattering: f64::from(tissue.scattering),
        };
        let side = |slabs: Slabs| {
            let leaving = slabs.leaving(EXACT);
            LeafSide {
                reflected: AngleFactor::through(leaving.map(|leaving| leaving.before)),
                transmitted: AngleFactor::through(leaving.map(|leaving| leaving.behind)),
            }
        };
        Self { front: side(front), back: side(front.reversed()) }
    }

    /// The side that is seen, and the other.
    pub fn sides(&self, front: bool) -> [LeafSide; 2] {
        if front { [self.front, self.back] } else { [self.back, self.front] }
    }

    /// Factors on light from the cosine `light`, seen at the cosine `view` of the front or the back, from before and from
    /// behind. Above 0; 1 for perpendicular light seen perpendicularly. The twin of `tissue_light` in
    /// `shaders/common/tissue.wgsl`.
    pub fn factors(&self, front: bool, view: f32, light: f32) -> [f32; 2] {
        let [seen, other] = self.sides(front);
        [seen.reflected.at(view) * seen.reflected.at(light), seen.transmitted.at(view) * other.transmitted.at(light)]
    }

    /// The factors in even light.
    pub fn in_even_light(&self, front: bool, view: f32) -> [f32; 2] {
        let [seen, other] = self.sides(front);
        [seen.reflected.at(view) * seen.reflected.mean(), seen.transmitted.at(view) * other.transmitted.mean()]
    }

    /// The factors in the mean over leaves of all angles, seen from both sides in light from anywhere.
    pub fn mean(&self) -> [f32; 2] {
        let [front, back] = [self.front, self.back].map(|side| side.reflected.mean());
        [0.5 * (front * front + back * back), self.front.transmitted.mean() * self.back.transmitted.mean()]
    }

    /// The most that a leaf returns of even light over that of perpendicular light seen perpendicularly, from before and
    /// from behind.
    pub fn most(&self, front: bool) -> [f32; 2] {
        let [seen, other] = self.sides(front);
        [seen.reflected.most() * seen.reflected.mean(), seen.transmitted.most() * other.transmitted.mean()]
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
    fn perpendicular_light_has_the_colours_as_they_are() {
        for front in [true, false] {
            let factors = leaf(0.3).factors(front, 1.0, 1.0);
            assert!(factors.iter().all(|factor| (factor - 1.0).abs() < 1e-5), "{factors:?}");
        }
    }

    #[test]
    fn polynomials_follow_the_slabs() {
        for (absorption, scattering, bar) in [(0.27, 2.0, 0.02), (0.5, 4.0, 0.01), (0.0, 2.0, 0.01), (0.5, 1.0, 0.05)] {
            let tissue = LeafTissue { scattering, ..LeafTissue::default() };
            let light = TissueLight::of(&tissue, absorption);
            let slabs = Slabs {
                shares: tissue.layers.map(f64::from),
                indices: tissue.refraction.map(f64::from),
                absorption: f64::from(absorption),
                scattering: f64::from(scattering),
            };
            let cosines: [f64; 16] = std::array::from_fn(|i| 1.0 - i as f64 / 16.0);
            let leaving = slabs.leaving(cosines);
            for (found, cosine) in leaving.iter().zip(cosines) {
                let ratio =
                    |value: f64, whole: f64, factor: AngleFactor| factor.at(cosine as f32) as f64 * whole / value;
                let back = ratio(found.before, leaving[0].before, light.front.reflected);
                let through = ratio(found.behind, leaving[0].behind, light.front.transmitted);
                assert!((back - 1.0).abs() < bar && (through - 1.0).abs() < bar, "{cosine}: {back} {through}");
            }
        }
    }

    #[test]
    fn factors_are_positive_and_reciprocal_for_any_tissue() {
        let strange = LeafTissue { layers: [0.0, 1.0, 0.0], refraction: [3.0, 1.0, 3.0], ..LeafTissue::default() };
        for tissue in [LeafTissue::default(), strange.sanitized()] {
            for depth in [0.0, 1e-6, 0.3, 5.0, f32::INFINITY] {
                let light = TissueLight::of(&tissue, depth);
                for (view, from) in [(0.0, 0.5), (0.3, 0.9), (1.0, 0.01)] {
                    let (there, back) = (light.factors(true, view, from), light.factors(true, from, view));
                    assert!(there.iter().all(|factor| *factor > 0.0 && *factor < 20.0), "{there:?}");
                    assert_eq!(there[0], back[0]);
                    // Through the leaf the other way.
                    assert_eq!(there[1], light.factors(false, from, view)[1]);
                }
                assert!(light.mean().iter().all(|factor| (1e-6..4.0).contains(factor)));
            }
        }
    }

    #[test]
    fn the_mean_of_a_factor_is_its_integral() {
        let factor = leaf(0.4).front.transmitted;
        let cosines = (0..1000).map(|i| (i as f32 + 0.5) / 1000.0);
        let mean = cosines.map(|cosine| 2e-3 * cosine * factor.at(cosine)).sum::<f32>();
        assert!((factor.mean() - mean).abs() < 1e-4, "{} {mean}", factor.mean());
    }
}
