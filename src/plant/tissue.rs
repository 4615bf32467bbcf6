//! The tissue of a leaf, as the layered leaf model of [Franzke 2005, 3.2] describes it: further textures, and a few
//! numbers.
//!
//! | texture | thesis, figure 3.8 | here |
//! |---|---|---|
//! | front, with the mask in its alpha | a, d | [`PlantMaterial::base_color_texture`](super::PlantMaterial::base_color_texture) |
//! | back | b | [`LeafTextures::back`] |
//! | transmission | c | [`LeafTextures::transmission`] |
//! | thickness | e | [`LeafTextures::thickness`] |
//! | absorption | f | [`LeafTextures::absorption`] |
//! | bump | g | [`PlantMaterial::normal_texture`](super::PlantMaterial::normal_texture) |
//!
//! Every texture is optional and has the texture coordinates of the front. What is missing is derived
//! ([`super::leaf_textures`]).

use std::ops::RangeInclusive;
use std::sync::Arc;

use image::{GrayImage, RgbaImage};
use serde::{Deserialize, Serialize};

/// The textures of a leaf besides its front and its bump. Sizes may differ from each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LeafTextures {
    /// Fraction of the light that the back reflects: sRGB-encoded RGB; the mask is that of the front. `None`: as the
    /// front.
    pub back: Option<Arc<RgbaImage>>,
    /// Fraction of the light that comes through, from either side: sRGB-encoded RGB. `None`: derived from the front by
    /// [`PlantMaterial::transmission`](super::PlantMaterial::transmission).
    pub transmission: Option<Arc<RgbaImage>>,
    /// Thickness over [`LeafTissue::max_thickness`], 0..=1, linear. `None`: derived from the transmission.
    pub thickness: Option<Arc<GrayImage>>,
    /// Position in [`LeafTissue::absorption_range`], 0..=1, linear. `None`: derived from the transmission.
    pub absorption: Option<Arc<GrayImage>>,
}

impl LeafTextures {
    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// How much of the tissue's own attenuation the colours of front, back and transmission already contain, because they
/// were measured on the leaf itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Measured {
    /// All of it, at every texel: under perpendicular light a perpendicular viewer sees the colours as they are, and
    /// the tissue decides how they change with the angle. For textures that belong together (default).
    #[default]
    Texel,
    /// That of the mean over the leaf: where the tissue is thicker or absorbs more than the mean, the leaf is darker
    /// than its colours. For thickness or absorption that somebody painted.
    Leaf,
    /// None: the tissue always darkens. The thesis's own way; its absorption counts twice where colours are measured.
    Nothing,
}

/// The numbers of a leaf's tissue. In a scene file, for a species: `tissue: (max_thickness: 0.0004)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LeafTissue {
    /// Thickness where the thickness texture is 1 (eq. 3.6), metres: [`LeafTissue::THICKNESS`]. Default 0.0003.
    pub max_thickness: f32,
    /// Absorption where the absorption texture is 0 and where it is 1 (eq. 3.7), 1/m: [`LeafTissue::ABSORPTION`].
    /// Default (600, 3000), so that some 60 % of perpendicular light crosses a mean leaf unscattered.
    pub absorption_range: [f32; 2],
    /// Shares of the thickness: upper epidermis and palisade cells, spongy tissue, lower epidermis. Each 0..=1, scaled
    /// to a sum of 1. Default (0.45, 0.4, 0.15).
    pub layers: [f32; 3],
    /// Indices of refraction of the three: [`LeafTissue::REFRACTION`]. Default (1.33, 1, 1.33): the spongy tissue is 50
    /// to 80 % air.
    pub refraction: [f32; 3],
    /// Optical depth of scattering through the leaf, isotropic: [`LeafTissue::SCATTERING`]. It decides how the colours
    /// change with the angle. Default 2: in infrared light, which it does not absorb, a leaf then returns about as much as
    /// it lets through, as leaves do.
    pub scattering: f32,
    /// Test points in the three, at which the incoming light is looked at: each 0..=[`LeafTissue::MOST_POINTS`]. A layer
    /// that is there has at least one. More: the penumbra has finer steps. Default (4, 3, 1).
    pub test_points: [u8; 3],
    /// What the colours contain.
    pub measured: Measured,
    /// Whether the part is a closed volume, as a petal or a fruit: its thickness is that of the mesh.
    pub volume: bool,
}

impl Default for LeafTissue {
    fn default() -> Self {
        Self {
            max_thickness: 0.0003,
            absorption_range: [600.0, 3000.0],
            layers: [0.45, 0.4, 0.15],
            refraction: [1.33, 1.0, 1.33],
            scattering: 2.0,
            test_points: [4, 3, 1],
            measured: Measured::Texel,
            volume: false,
        }
    }
}

impl LeafTissue {
    /// Range of the thickness, metres.
    pub const THICKNESS: RangeInclusive<f32> = 1e-6..=0.1;
    /// Range of the absorption, 1/m.
    pub const ABSORPTION: RangeInclusive<f32> = 0.0..=1e6;
    /// Range of the indices of refraction.
    pub const REFRACTION: RangeInclusive<f32> = 1.0..=3.0;
    /// Range of the optical depth of scattering.
    pub const SCATTERING: RangeInclusive<f32> = 1.0..=10.0;
    /// The most test points in a layer.
    pub const MOST_POINTS: u8 = 8;

    /// The tissue with all values in their ranges; what is NaN becomes the default.
    #[must_use]
    pub fn sanitized(self) -> Self {
        let default = Self::default();
        let within = |value: f32, range: RangeInclusive<f32>, other: f32| {
            if value.is_nan() { other } else { value.clamp(*range.start(), *range.end()) }
        };
        let pairs = |values: [f32; 3], range: RangeInclusive<f32>, others: [f32; 3]| {
            std::array::from_fn(|i| within(values[i], range.clone(), others[i]))
        };
        let shares: [f32; 3] = pairs(self.layers, 0.0..=1.0, default.layers);
        let sum: f32 = shares.iter().sum();
        let layers = if sum > 1e-6 { shares.map(|share| share / sum) } else { default.layers };
        let test_points =
            std::array::from_fn(|i| self.test_points[i].clamp(u8::from(layers[i] > 0.0), Self::MOST_POINTS));
        Self {
            max_thickness: within(self.max_thickness, Self::THICKNESS, default.max_thickness),
            absorption_range: std::array::from_fn(|i| {
                within(self.absorption_range[i], Self::ABSORPTION, default.absorption_range[i])
            }),
            layers,
            refraction: pairs(self.refraction, Self::REFRACTION, default.refraction),
            scattering: within(self.scattering, Self::SCATTERING, default.scattering),
            test_points,
            ..self
        }
    }

    /// Optical depth of the tissue: absorption times thickness (eqs. 3.6, 3.7) where the two textures have these values,
    /// 0..=1.
    pub fn optical_depth(&self, thickness: f32, absorption: f32) -> f32 {
        let [low, high] = self.absorption_range;
        self.max_thickness * thickness * (low + (high - low) * absorption)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_out_of_range_are_brought_back() {
        let wild = LeafTissue {
            max_thickness: f32::NAN,
            absorption_range: [-1.0, f32::INFINITY],
            layers: [0.0, f32::NAN, 9.0],
            refraction: [0.0, 9.0, f32::NAN],
            scattering: f32::NEG_INFINITY,
            test_points: [0, 0, 200],
            ..LeafTissue::default()
        };
        let tame = wild.sanitized();
        assert_eq!((tame.max_thickness, tame.absorption_range), (0.0003, [0.0, 1e6]));
        assert_eq!((tame.refraction, tame.test_points), ([1.0, 3.0, 1.33], [0, 1, 8]));
        assert_eq!(tame.scattering, 1.0);
        assert!((tame.layers.iter().sum::<f32>() - 1.0).abs() < 1e-6 && tame.layers[0] == 0.0);
        assert_eq!(LeafTissue { layers: [0.0; 3], ..wild }.sanitized().layers, LeafTissue::default().layers);
        assert_eq!(tame.sanitized(), tame);
        assert_eq!(LeafTissue::default().sanitized(), LeafTissue::default());
    }

    #[test]
    fn the_optical_depth_is_thickness_times_absorption() {
        let leaf = LeafTissue::default();
        assert_eq!(leaf.optical_depth(1.0, 0.0), 0.0003 * 600.0);
        assert!((leaf.optical_depth(0.5, 1.0) - 0.45).abs() < 1e-6);
        assert_eq!(leaf.optical_depth(0.0, 1.0), 0.0);
    }
}
