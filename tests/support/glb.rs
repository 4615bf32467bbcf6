//! Small glTF trees, made in code.

use std::io::Cursor;

use glam::{Quat, Vec3};

/// What of a tree a file has, and what is wrong with it.
#[derive(Clone, Copy, Debug)]
pub struct TreeFile {
    /// A trunk.
    pub wood: bool,
    /// Leaves.
    pub leaves: bool,
    /// The leaves' texture is in a file that does not exist.
    pub absent_texture: bool,
    /// A position of the trunk that is not what it should be, to take the place of its first coordinate.
    pub first_coordinate: f32,
    /// Added to every index of the trunk.
    pub index_offset: u16,
    /// Members of the leaves' material in JSON, each with a comma before it.
    pub leaf_members: &'static str,
}

impl Default for TreeFile {
    fn default() -> Self {
        Self {
            wood: true,
            leaves: true,
            absent_texture: false,
            first_coordinate: 0.3,
            index_offset: 0,
            leaf_members: "",
        }
    }
}

#[derive(Default)]
struct Mesh {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<[f32; 2]>,
    indices: Vec<u16>,
}

impl Mesh {
    fn quad(&mut self, corners: [Vec3; 4], normal: Vec3) {
        let first = self.positions.len() as u16;
        self.positions.extend(corners);
        self.normals.extend([normal; 4]);
        self.uvs.extend([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
        self.indices.extend([0, 1, 2, 0, 2, 3].map(|index| first + index));
    }
}

/// A trunk of eight sides, 0.3 m thick, 5 m high, straight up from the origin.
fn trunk() -> Mesh {
    let mut mesh = Mesh::default();
    for side in 0..8 {
        let around = |step: f32| {
            let (sin, cos) = (std::f32::consts::FRAC_PI_4 * (side as f32 + step)).sin_cos();
            Vec3::new(0.3 * cos, 0.0, -0.3 * sin)
        };
        let (a, b, up) = (around(0.0), around(1.0), 5.0 * Vec3::Y);
        mesh.quad([a, b, b * 0.5 + up, a * 0.5 + up], around(0.5).normalize());
    }
    mesh
}

/// Cards of 1.4 m on a ball of 2.4 m radius, 5.5 m over the ground, with evenly spread rotations (a golden spiral).
fn crown() -> Mesh {
    let mut mesh = Mesh::default();
    for card in 0..160u32 {
        let y = 1.0 - 2.0 * (card as f32 + 0.5) / 160.0;
        let (sin, cos) = (2.399_963 * card as f32).sin_cos();
        let out = Vec3::new((1.0 - y * y).sqrt() * cos, y, (1.0 - y * y).sqrt() * sin);
        let turn =
            Quat::from_rotation_arc(Vec3::Z, out) * Quat::from_rotation_y(0.6) * Quat::from_rotation_z(card as f32);
        let (u, v) = (turn * Vec3::X * 0.7, turn * Vec3::Y * 0.7);
        let center = Vec3::new(0.0, 5.5, 0.0) + 2.4 * out;
        mesh.quad([center - u - v, center + u - v, center + u + v, center - u + v], out);
    }
    mesh
}

/// Leaves on a transparent ground: a PNG of 64 x 64.
fn leaf_texture() -> Vec<u8> {
    let image = image::RgbaImage::from_fn(64, 64, |x, y| {
        let cell = |v: u32| f64::from(v % 16) / 16.0 - 0.47;
        let (dx, dy) = (cell(x + 8 * (y / 16 % 2)), cell(y));
        let inside = (dx * dx * 2.2 + dy * dy) < 0.19;
        let shade = 90 + (40.0 * dx.abs()) as u8;
        image::Rgba([shade / 2, shade, shade / 4, if inside { 255 } else { 0 }])
    });
    let mut bytes = Cursor::new(Vec::new());
    // Writing into memory fails for no image of this kind; an empty one would be seen as a missing texture.
    let _ = image.write_to(&mut bytes, image::ImageFormat::Png);
    bytes.into_inner()
}

impl TreeFile {
    /// The GLB.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bin: Vec<u8> = Vec::new();
        let (mut views, mut accessors) = (Vec::new(), Vec::new());
        let mut view = |bytes: &[u8]| {
            views.push(format!(r#"{{"buffer":0,"byteOffset":{},"byteLength":{}}}"#, bin.len(), bytes.len()));
            bin.extend_from_slice(bytes);
            bin.resize(bin.len().next_multiple_of(4), 0);
            views.len() - 1
        };
        let mut primitives = Vec::new();
        let mut add = |mesh: Mesh, material: usize, wood: bool| {
            let mut accessor = |component: u32, shape: &str, count: usize, bytes: &[u8]| {
                let view = view(bytes);
                accessors.push(format!(
                    r#"{{"bufferView":{view},"componentType":{component},"type":"{shape}","count":{count}}}"#
                ));
                accessors.len() - 1
            };
            let mut positions: Vec<f32> = mesh.positions.iter().flat_map(|p| p.to_array()).collect();
            let mut indices = mesh.indices.clone();
            if wood {
                positions[0] = self.first_coordinate;
                indices.iter_mut().for_each(|index| *index += self.index_offset);
            }
            let normals: Vec<f32> = mesh.normals.iter().flat_map(|n| n.to_array()).collect();
            let uvs: Vec<f32> = mesh.uvs.iter().flatten().copied().collect();
            let count = mesh.positions.len();
            let position = accessor(5126, "VEC3", count, bytemuck::cast_slice(&positions));
            let normal = accessor(5126, "VEC3", count, bytemuck::cast_slice(&normals));
            let uv = accessor(5126, "VEC2", count, bytemuck::cast_slice(&uvs));
            let index = accessor(5123, "SCALAR", indices.len(), bytemuck::cast_slice(&indices));
            primitives.push(format!(
                r#"{{"attributes":{{"POSITION":{position},"NORMAL":{normal},"TEXCOORD_0":{uv}}},"indices":{index},"material":{material}}}"#
            ));
        };
        if self.wood {
            add(trunk(), 0, true);
        }
        if self.leaves {
            add(crown(), 1, false);
        }
        let image = match self.absent_texture {
            true => r#"{"uri":"absent.png"}"#.to_owned(),
            false => format!(r#"{{"bufferView":{},"mimeType":"image/png"}}"#, view(&leaf_texture())),
        };
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{}}}],"bufferViews":[{}],"accessors":[{}],
            "meshes":[{{"primitives":[{}]}}],"nodes":[{{"mesh":0}}],"scenes":[{{"nodes":[0]}}],"scene":0,
            "images":[{image}],"textures":[{{"source":0}}],"materials":[
            {{"name":"bark","pbrMetallicRoughness":{{"baseColorFactor":[0.24,0.17,0.11,1]}}}},
            {{"name":"leaves","alphaMode":"MASK","alphaCutoff":0.5,"doubleSided":true,
            "pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}{}}}]}}"#,
            bin.len(),
            views.join(","),
            accessors.join(","),
            primitives.join(","),
            self.leaf_members
        );
        let mut json = json.into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bytes = b"glTF".to_vec();
        for word in [2, 12 + 8 + json.len() + 8 + bin.len(), json.len()] {
            bytes.extend((word as u32).to_le_bytes());
        }
        bytes.extend(b"JSON");
        bytes.extend(json);
        bytes.extend((bin.len() as u32).to_le_bytes());
        bytes.extend(b"BIN\0");
        bytes.extend(bin);
        bytes
    }
}
