//! KHR_materials_diffuse_transmission (Khronos, glTF 2.0 extension): how much light passes through a leaf, as stated in
//! the file.
//!
//! The extension divides the diffuse light of a surface: the fraction `f` is transmitted with the colour `c`, the rest
//! is reflected with the base colour. `f` is a factor times a texture's alpha, `c` is a factor times a texture's
//! colour.
//!
//! ```text
//!  reflected = (1 - f) base colour        transmitted = f c
//! ```
//!
//! The material of a plant has one factor per channel for transmitted light, relative to what the inside of the leaf
//! reflects ([`PlantMaterial::transmission`]). So `f` and `c` are averaged over the leaf, and the factor is chosen so
//! that the leaf transmits `f c` on average. The base colour then decides where on the leaf more light passes, and
//! where less. If the base colour leaves no room for so much light, less is transmitted, and a warning says how much.

use glam::Vec3;
use gltf::json::Value;
use gltf::json::material::Material;
use gltf::json::texture::Info;
use serde::Deserialize;

use super::error::{WarningKind, Warnings};
use crate::plant::PlantMaterial;
use crate::plant::optics::{mean_over_leaf, mean_texel};

/// The name of the extension.
pub(super) const NAME: &str = "KHR_materials_diffuse_transmission";

/// Fraction of the light that may be missing without a warning.
const UNSEEN: f32 = 0.01;

/// The extension as written in the file.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct DiffuseTransmission {
    #[serde(rename = "diffuseTransmissionFactor")]
    factor: f32,
    #[serde(rename = "diffuseTransmissionTexture")]
    pub factor_texture: Option<Info>,
    #[serde(rename = "diffuseTransmissionColorFactor")]
    color: [f32; 3],
    #[serde(rename = "diffuseTransmissionColorTexture")]
    pub color_texture: Option<Info>,
}

impl Default for DiffuseTransmission {
    fn default() -> Self {
        Self { factor: 0.0, factor_texture: None, color: [1.0; 3], color_texture: None }
    }
}

impl DiffuseTransmission {
    /// The extension of `material`; `None` if there is none, or, with a warning, if it cannot be read.
    pub fn of(material: &Material, location: &str, warnings: &mut Warnings) -> Option<Self> {
        let value: &Value = material.extensions.as_ref()?.others.get(NAME)?;
        // Serde would read a list as the fields in their order.
        let read = if value.is_object() {
            Self::deserialize(value).map_err(|error| error.to_string())
        } else {
            Err("it is not an object".to_owned())
        };
        match read {
            Ok(found) => Some(found),
            Err(error) => {
                let message = format!("its {NAME} cannot be read ({error}); the usual transmission of leaves is used");
                warnings.push(WarningKind::Missing, location, message);
                None
            }
        }
    }

    /// Sets the transmission of `material`, whose base colour, mask and gloss are known. The two textures are those of
    /// the extension, decoded.
    pub fn apply(
        &self,
        material: &mut PlantMaterial,
        [factor_texture, color_texture]: [Option<&image::RgbaImage>; 2],
        location: &str,
        warnings: &mut Warnings,
    ) {
        let share = |value: f32| if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) };
        let mut factor = share(self.factor);
        let mut color = Vec3::from(self.color.map(share));
        if let Some(image) = factor_texture {
            factor *= mean_texel(image, material).w;
        }
        if let Some(image) = color_texture {
            color *= mean_texel(image, material).truncate();
        }
        if factor_texture.is_some() || color_texture.is_some() {
            let [r, g, b] = color.to_array();
            let message = format!(
                "its textures of transmitted light are used as their means over the leaf: \
                 {factor:.3} of the light passes, with the colour {r:.3} {g:.3} {b:.3}"
            );
            warnings.push(WarningKind::Ignored, location, message);
        }

        material.base_color *= 1.0 - factor;
        let wanted = factor * color;
        let [inside] = mean_over_leaf(material, |color| [material.gloss.subsurface_albedo(color)]);
        let most = Vec3::splat(PlantMaterial::MOST_TRANSMISSION);
        material.transmission = (wanted / inside.max(Vec3::splat(1e-6))).clamp(Vec3::ZERO, most);
        let [transmitted] = mean_over_leaf(material, |color| [material.transmitted(color)]);
        if (wanted - transmitted).max_element() > UNSEEN {
            let [r, g, b] = (100.0 * wanted).to_array();
            let [red, green, blue] = (100.0 * transmitted).to_array();
            let message = format!(
                "it transmits {r:.1} {g:.1} {b:.1} % of the light, of which {red:.1} {green:.1} {blue:.1} % are drawn: its base \
                 colour leaves no room for more"
            );
            warnings.push(WarningKind::Repaired, location, message);
        }
    }
}
