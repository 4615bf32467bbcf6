//! The ground as meshes of a glTF document, with the photograph over it as their texture.

use std::io::Cursor;

use glam::{DVec2, Vec2};
use image::{RgbImage, codecs::jpeg::JpegEncoder};
use rayon::prelude::*;
use serde_json::json;

use super::glb::{CLAMPED, Glb, MIRRORED};
use crate::{
    app::{AppError, ground_grid},
    assets::Stage,
    math::color::srgb8,
    render::components::GroundDrape,
};

/// Quality of the JPEG, 1 to 100.
const QUALITY: u8 = 92;

/// Adds the ground; returns its number of triangles.
///
/// # Errors
/// [`AppError::Render`] if the photograph over it cannot be written.
pub fn add(glb: &mut Glb, stage: &Stage, within: Option<f64>) -> Result<usize, AppError> {
    // The wood goes on beyond the data.
    let half = 0.5 * stage.terrain.extent() + stage.surroundings;
    let half = within.map_or(half, |most| half.min(DVec2::splat(most)));
    let mut surface = json!({ "metallicFactor": 0.0, "roughnessFactor": 1.0 });
    match &stage.drape {
        Some(drape) => surface["baseColorTexture"] = json!({ "index": photograph(glb, drape)? }),
        None => surface["baseColorFactor"] = json!(ground_grid::SOIL.extend(1.0).to_array()),
    }
    glb.materials.push(json!({ "name": "ground", "pbrMetallicRoughness": surface }));
    let material = glb.materials.len() - 1;
    let mut primitives = Vec::new();
    let mut triangles = 0;
    for piece in ground_grid::pieces(&stage.terrain, half) {
        triangles += piece.indices.len() / 3;
        let mut attributes = json!({
            "POSITION": glb.positions(&piece.positions),
            "NORMAL": glb.vertices(&piece.normals, "VEC3"),
        });
        if let Some(GroundDrape { drape, .. }) = &stage.drape {
            let uv = |x: f32, z: f32| ((DVec2::new(x.into(), z.into()) - drape.min()) / drape.extent()).as_vec2();
            let uvs: Vec<Vec2> = piece.positions.iter().map(|position| uv(position.x, position.z)).collect();
            attributes["TEXCOORD_0"] = json!(glb.vertices(&uvs, "VEC2"));
        }
        primitives.push(json!({
            "attributes": attributes,
            "indices": glb.indices(&piece.indices),
            "material": material,
        }));
    }
    glb.meshes.push(json!({ "name": "ground", "primitives": primitives }));
    glb.nodes.push(json!({ "name": "ground", "mesh": glb.meshes.len() - 1 }));
    glb.roots.push(glb.nodes.len() - 1);
    Ok(triangles)
}

/// Adds the photograph as reflectances, over the colour of the ground where it is transparent; returns the index of its texture.
fn photograph(glb: &mut Glb, GroundDrape { drape, brightness }: &GroundDrape) -> Result<usize, AppError> {
    let (columns, rows) = drape.size();
    let texel = drape.extent() / DVec2::new(f64::from(columns), f64::from(rows));
    let mut image = RgbImage::new(columns, rows);
    image.par_chunks_exact_mut(3 * columns as usize).enumerate().for_each(|(row, texels)| {
        for (column, code) in texels.chunks_exact_mut(3).enumerate() {
            let found = drape.sample(drape.min() + (DVec2::new(column as f64, row as f64) + 0.5) * texel);
            let color = found.truncate() * *brightness + (1.0 - found.w) * ground_grid::SOIL;
            code.copy_from_slice(&color.to_array().map(srgb8));
        }
    });
    let mut bytes = Cursor::new(Vec::new());
    let written = image.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, QUALITY));
    written.map_err(|error| AppError::Render(format!("the photograph could not be written: {error}")))?;
    let view = glb.view(bytes.get_ref());
    glb.images.push(json!({ "bufferView": view, "mimeType": "image/jpeg" }));
    let texture = glb.images.len() - 1;
    glb.own_wrap = Some((texture, if drape.is_mirrored() { MIRRORED } else { CLAMPED }));
    Ok(texture)
}
