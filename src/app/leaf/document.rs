//! A plant of one leaf as a glTF document, with the textures that lie beside it.

use serde_json::json;

use crate::plant::{LeafTissue, PlantMaterial};

/// The file of the document's buffer.
pub const BUFFER: &str = "leaf.bin";

/// The document of an upright leaf of `size` (width and height in metres), its stalk at the origin, and the bytes of its buffer.
/// `files` names the textures that there are, without their endings, as [`super::leaf`] writes them.
pub fn document(material: &PlantMaterial, files: &[&str], [width, height]: [f32; 2]) -> (String, Vec<u8>) {
    let half = 0.5 * width;
    let positions = [[-half, 0.0, 0.0], [half, 0.0, 0.0], [half, height, 0.0], [-half, height, 0.0]];
    let uvs = [[0.0f32, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    let indices: [u16; 6] = [0, 1, 2, 0, 2, 3];
    let mut bytes = Vec::new();
    bytes.extend(positions.as_flattened().iter().flat_map(|value: &f32| value.to_le_bytes()));
    bytes.extend([[0.0f32, 0.0, 1.0]; 4].as_flattened().iter().flat_map(|value| value.to_le_bytes()));
    bytes.extend(uvs.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
    bytes.extend(indices.iter().flat_map(|index| index.to_le_bytes()));

    let texture = |name: &str| files.iter().position(|file| *file == name).map(|index| json!({ "index": index }));
    let tissue = material.tissue.unwrap_or_default();
    let LeafTissue { max_thickness, absorption_range, layers, refraction, scattering, test_points, measured, volume } =
        tissue;
    let mut leaf = json!({
        "maxThickness": max_thickness,
        "absorptionRange": absorption_range,
        "layers": layers,
        "refraction": refraction,
        "scattering": scattering,
        "testPoints": test_points,
        "measured": measured,
        "volume": volume,
    });
    for name in ["back", "transmission", "thickness", "absorption"] {
        if let Some(index) = texture(name) {
            leaf[format!("{name}Texture")] = index;
        }
    }
    let mut described = json!({
        "name": "leaf",
        "alphaMode": "MASK",
        "alphaCutoff": material.alpha_cutoff,
        "doubleSided": true,
        "pbrMetallicRoughness": {
            "baseColorFactor": [material.base_color.x, material.base_color.y, material.base_color.z, 1.0],
            "metallicFactor": 0.0,
        },
        "extras": { "canopy_leaf": leaf },
    });
    if let Some(index) = texture("front") {
        described["pbrMetallicRoughness"]["baseColorTexture"] = index;
    }
    if let Some(index) = texture("bump") {
        described["normalTexture"] = index;
    }
    let view = |offset: usize, length: usize| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    let accessor =
        |view: usize, kind: &str| json!({ "bufferView": view, "componentType": 5126, "count": 4, "type": kind });
    let mut of_positions = accessor(0, "VEC3");
    of_positions["min"] = json!([-half, 0.0, 0.0]);
    of_positions["max"] = json!([half, height, 0.0]);
    let document = json!({
        "asset": { "version": "2.0", "generator": format!("canopy {}", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "name": "leaf" }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": 0,
        }] }],
        "materials": [described],
        "textures": files.iter().enumerate().map(|(index, _)| json!({ "source": index })).collect::<Vec<_>>(),
        "images": files.iter().map(|name| json!({ "uri": format!("{name}.png") })).collect::<Vec<_>>(),
        "accessors": [
            of_positions,
            accessor(1, "VEC3"),
            accessor(2, "VEC2"),
            { "bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
        "bufferViews": [view(0, 48), view(48, 48), view(96, 32), view(128, 12)],
        "buffers": [{ "byteLength": bytes.len(), "uri": BUFFER }],
    });
    (format!("{document:#}\n"), bytes)
}
