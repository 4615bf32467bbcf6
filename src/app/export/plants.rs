//! Plants as meshes and materials of a glTF document.

use std::{collections::HashMap, io::Cursor, sync::Arc};

use glam::Vec3;
use image::{ImageFormat, RgbaImage};
use serde_json::{Value, json};

use super::glb::Glb;
use crate::{
    app::AppError,
    math::color::{LINEAR_OF_CODE, srgb8},
    plant::{PartKind, Plant, PlantMaterial},
};

/// The extension for light that passes through leaves.
const TRANSMISSION: &str = "KHR_materials_diffuse_transmission";
/// The least transmitted light that is written.
const UNSEEN: f32 = 1e-3;

/// Images that are in the document already, by their address and the factor on their colours.
#[derive(Default)]
pub struct Images {
    known: HashMap<(usize, [u32; 3]), usize>,
}

impl Images {
    /// The texture of `image` with colours times `factor`.
    fn texture(&mut self, glb: &mut Glb, image: &Arc<RgbaImage>, factor: Vec3) -> Result<usize, AppError> {
        let key = (Arc::as_ptr(image) as usize, factor.to_array().map(f32::to_bits));
        if let Some(index) = self.known.get(&key) {
            return Ok(*index);
        }
        let mut bytes = Cursor::new(Vec::new());
        let scaled = if factor == Vec3::ONE { None } else { Some(scaled(image, factor)) };
        let written = scaled.as_ref().unwrap_or(image).write_to(&mut bytes, ImageFormat::Png);
        written.map_err(|error| AppError::Render(format!("a texture could not be written: {error}")))?;
        let view = glb.view(bytes.get_ref());
        glb.images.push(json!({ "bufferView": view, "mimeType": "image/png" }));
        self.known.insert(key, glb.images.len() - 1);
        Ok(glb.images.len() - 1)
    }
}

/// `image` with linear colours times `factor`.
fn scaled(image: &RgbaImage, factor: Vec3) -> RgbaImage {
    let mut scaled = image.clone();
    let table = factor
        .to_array()
        .map(|factor| -> Vec<u8> { LINEAR_OF_CODE.iter().map(|linear| srgb8(factor * linear)).collect() });
    for pixel in scaled.pixels_mut() {
        for (channel, table) in table.iter().enumerate() {
            pixel.0[channel] = table[usize::from(pixel.0[channel])];
        }
    }
    scaled
}

/// Mean and greatest linear colour of a leaf, without what its mask cuts off.
fn colors(material: &PlantMaterial) -> (Vec3, Vec3) {
    let Some(image) = &material.base_color_texture else { return (material.base_color, material.base_color) };
    let cutoff = material.alpha_cutoff * 255.0;
    let (mut sum, mut most, mut count) = (Vec3::ZERO, Vec3::ZERO, 0.0);
    for pixel in image.pixels().filter(|pixel| f32::from(pixel.0[3]) >= cutoff) {
        let [r, g, b, _] = pixel.0.map(|code| LINEAR_OF_CODE[usize::from(code)]);
        let color = Vec3::new(r, g, b) * material.base_color;
        (sum, most, count) = (sum + color, most.max(color), count + 1.0);
    }
    if count == 0.0 { (material.base_color, material.base_color) } else { (sum / count, most) }
}

/// Adds a plant; returns the index of its mesh, `None` for a plant without triangles.
///
/// # Errors
/// [`AppError::Render`] if a texture cannot be written.
pub fn add(glb: &mut Glb, plant: &Plant, images: &mut Images) -> Result<Option<usize>, AppError> {
    let mut primitives = Vec::new();
    for part in plant.parts.iter().filter(|part| !part.mesh.triangles.is_empty()) {
        let mesh = &part.mesh;
        let attributes = json!({
            "POSITION": glb.positions(&mesh.positions),
            "NORMAL": glb.vertices(&mesh.normals, "VEC3"),
            "TEXCOORD_0": glb.vertices(&mesh.uvs, "VEC2"),
        });
        let indices = glb.indices(mesh.triangles.as_flattened());
        let material = material(glb, part.kind, &part.material, images)?;
        glb.materials.push(material);
        primitives.push(json!({
            "attributes": attributes, "indices": indices, "material": glb.materials.len() - 1,
        }));
    }
    if primitives.is_empty() {
        return Ok(None);
    }
    glb.meshes.push(json!({ "name": plant.name, "primitives": primitives }));
    Ok(Some(glb.meshes.len() - 1))
}

fn material(glb: &mut Glb, kind: PartKind, material: &PlantMaterial, images: &mut Images) -> Result<Value, AppError> {
    let foliage = kind == PartKind::Foliage;
    let (mean, most) = colors(material);
    let transmitted = if foliage { material.transmitted(mean) } else { Vec3::ZERO };
    // The extension divides diffuse light: 1 - f is reflected with the base colour, which must stay below 1.
    let (through, back) = (transmitted.max_element(), mean.max_element());
    let share = (through / (through + back).max(1e-6)).min(1.0 - most.max_element()).clamp(0.0, 0.95);
    let share = if share < UNSEEN { 0.0 } else { share };
    let reflected = 1.0 / (1.0 - share);
    let mut pbr = json!({
        "metallicFactor": 0.0,
        // The lobe's width is the square of glTF's roughness.
        "roughnessFactor": if foliage { material.gloss.roughness.sqrt() } else { 1.0 },
    });
    match &material.base_color_texture {
        Some(image) => {
            let texture = images.texture(glb, image, material.base_color * reflected)?;
            pbr["baseColorTexture"] = json!({ "index": texture });
        }
        None => {
            let [r, g, b] = (material.base_color * reflected).min(Vec3::ONE).to_array();
            pbr["baseColorFactor"] = json!([r, g, b, 1.0]);
        }
    }
    let mut described = json!({ "pbrMetallicRoughness": pbr, "doubleSided": foliage });
    if !material.name.is_empty() {
        described["name"] = material.name.clone().into();
    }
    if foliage {
        described["alphaMode"] = "MASK".into();
        described["alphaCutoff"] = material.alpha_cutoff.into();
    }
    if let Some(image) = &material.normal_texture {
        described["normalTexture"] = json!({ "index": images.texture(glb, image, Vec3::ONE)? });
    }
    if share > 0.0 {
        glb.uses(TRANSMISSION);
        let color = (transmitted / share).clamp(Vec3::ZERO, Vec3::ONE).to_array();
        described["extensions"] = json!({ TRANSMISSION: {
            "diffuseTransmissionFactor": share, "diffuseTransmissionColorFactor": color,
        }});
    }
    Ok(described)
}
