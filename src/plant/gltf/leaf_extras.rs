//! What a file says about the tissue of its leaves: the object `canopy_leaf` in the extras of a material.
//!
//! ```json
//! "extras": { "canopy_leaf": {
//!     "backTexture": { "index": 3 },         what the back reflects, sRGB
//!     "backMaterial": 2,                     or a material, whose base colour texture that is
//!     "transmissionTexture": { "index": 6 }, what comes through, sRGB
//!     "thicknessTexture": { "index": 4 },    red channel, 0..1
//!     "absorptionTexture": { "index": 5 },   red channel, 0..1
//!     "maxThickness": 0.0003,                metres; further members as in `LeafTissue`:
//!     "absorptionRange": [600, 3000], "layers": [0.45, 0.4, 0.15], "refraction": [1.33, 1, 1.33],
//!     "scattering": 2, "testPoints": [4, 3, 1], "measured": "Leaf", "volume": false
//! } }
//! ```
//!
//! All members are optional. Without a transmission of its own, that of `KHR_materials_diffuse_transmission` counts. The bump is the
//! normal texture.

use std::sync::Arc;

use gltf::json::Value;
use image::{GrayImage, Luma, RgbaImage};
use serde::Deserialize;

use super::error::{WarningKind, Warnings};
use crate::plant::{LeafTissue, Measured, PlantMaterial};

/// The name of the object.
pub(super) const NAME: &str = "canopy_leaf";

/// A reference to a texture. The set of texture coordinates is that of the base colour.
#[derive(Clone, Copy, Deserialize)]
pub(super) struct Texture {
    pub index: usize,
}

/// The object as written in the file.
#[derive(Clone, Default, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields, default)]
pub(super) struct LeafExtras {
    pub back_texture: Option<Texture>,
    pub back_material: Option<usize>,
    pub transmission_texture: Option<Texture>,
    pub thickness_texture: Option<Texture>,
    pub absorption_texture: Option<Texture>,
    max_thickness: Option<f32>,
    absorption_range: Option<[f32; 2]>,
    layers: Option<[f32; 3]>,
    refraction: Option<[f32; 3]>,
    scattering: Option<f32>,
    test_points: Option<[u8; 3]>,
    measured: Option<Measured>,
    volume: bool,
}

impl LeafExtras {
    /// The object in the extras of a material; `None` if there is none, or, with a warning, if it cannot be read.
    pub fn of(extras: Option<&Value>, location: &str, warnings: &mut Warnings) -> Option<Self> {
        let value = extras?.get(NAME)?;
        // Serde would read a list as the fields in their order.
        let read = if value.is_object() {
            Self::deserialize(value).map_err(|error| error.to_string())
        } else {
            Err("it is not an object".to_owned())
        };
        read.map_err(|error| {
            let message = format!("its extras' {NAME} cannot be read ({error}); the leaf has the usual tissue");
            warnings.push(WarningKind::Missing, location, message);
        })
        .ok()
    }

    /// Sets the tissue of `material`. `[back, transmission, thickness, absorption]` are the decoded textures.
    pub fn apply(
        &self,
        material: &mut PlantMaterial,
        [back, transmission, thickness, absorption]: [Option<Arc<RgbaImage>>; 4],
        location: &str,
        warnings: &mut Warnings,
    ) {
        material.leaf_textures.back = back;
        if let Some(image) = transmission {
            material.set_transmission(image);
        }
        material.leaf_textures.thickness = thickness.map(|image| Arc::new(red(&image)));
        material.leaf_textures.absorption = absorption.map(|image| Arc::new(red(&image)));
        let usual = LeafTissue::default();
        let stated = LeafTissue {
            max_thickness: self.max_thickness.unwrap_or(usual.max_thickness),
            absorption_range: self.absorption_range.unwrap_or(usual.absorption_range),
            layers: self.layers.unwrap_or(usual.layers),
            refraction: self.refraction.unwrap_or(usual.refraction),
            scattering: self.scattering.unwrap_or(usual.scattering),
            test_points: self.test_points.unwrap_or(usual.test_points),
            measured: self.measured.unwrap_or_else(|| material.leaf_textures.measured()),
            volume: self.volume,
        };
        let possible = stated.sanitized();
        material.tissue = Some(possible);
        // The layers may be scaled to a sum of 1.
        if (LeafTissue { layers: stated.layers, ..possible }) != stated {
            let message = format!("its extras' {NAME} has values that no leaf has; the nearest possible ones are used");
            warnings.push(WarningKind::Repaired, location, message);
        }
    }
}

/// The red channel, as it is.
fn red(image: &RgbaImage) -> GrayImage {
    GrayImage::from_fn(image.width(), image.height(), |x, y| Luma([image.get_pixel(x, y)[0]]))
}
