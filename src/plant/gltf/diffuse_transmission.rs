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
//! Where one of them is a texture, their product becomes the texture of transmitted light
//! ([`LeafTextures::transmission`](crate::plant::LeafTextures::transmission)). The material of a plant also has one factor per
//! channel, relative to what the inside of the leaf reflects ([`PlantMaterial::transmission`]), which far levels of detail
//! use: it is chosen so that the leaf transmits `f c` on average. Without textures the base colour decides where on the
//! leaf more light passes, and where less. `1 - f` is the mean over the leaf. If the base colour leaves no room for so
//! much light, less is transmitted, and a warning says how much.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use gltf::json::Value;
use gltf::json::material::Material;
use gltf::json::texture::Info;
use image::{Rgba, RgbaImage};
use serde::Deserialize;

use super::error::{WarningKind, Warnings};
use crate::math::color::srgb8;
use crate::plant::PlantMaterial;
use crate::plant::optics::{mean_over_leaf, mean_texel};
use crate::plant::surface::{alpha_of, color_of};

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
    /// What comes through at every texel, as large as the larger of the two textures; `None` where neither has texels.
    fn product(&self, factor: Option<&RgbaImage>, color: Option<&RgbaImage>) -> Option<RgbaImage> {
        let [factor, color] =
            [factor, color].map(|image| image.filter(|image| image.width() > 0 && image.height() > 0));
        let sizes = [factor, color].into_iter().flatten().map(RgbaImage::dimensions);
        let (width, height) = sizes.max_by_key(|(width, height)| u64::from(*width) * u64::from(*height))?;
        let share = |value: f32| if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) };
        let (share_of_all, tint) = (share(self.factor), Vec3::from(self.color.map(share)));
        Some(RgbaImage::from_fn(width, height, |x, y| {
            let uv = Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
            let passed = share_of_all * factor.map_or(1.0, |image| alpha_of(image, uv));
            let color = tint * color.map_or(Vec3::ONE, |image| color_of(image, uv));
            let [r, g, b] = (passed * color).to_array().map(srgb8);
            Rgba([r, g, b, 255])
        }))
    }

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
        [factor_texture, color_texture]: [Option<&RgbaImage>; 2],
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
        let textured = self.product(factor_texture, color_texture);
        material.leaf_textures.transmission = textured.map(Arc::new);

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
