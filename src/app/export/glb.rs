//! A binary glTF file under construction: its document and its buffer.

use std::{io, path::Path};

use serde_json::{Value, json};

use crate::{app::AppError, files};

/// Component types of accessors.
pub const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
/// What views are for.
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// How textures go on beyond their borders.
const REPEATED: u32 = 10497;
pub const MIRRORED: u32 = 33648;
pub const CLAMPED: u32 = 33071;

/// A GLB 2.0.
#[derive(Default)]
pub struct Glb {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    /// Meshes of the document.
    pub meshes: Vec<Value>,
    /// Materials of the document.
    pub materials: Vec<Value>,
    /// Images of the document; each has a texture of the same index.
    pub images: Vec<Value>,
    /// The image that is not repeated, and how it goes on instead.
    pub own_wrap: Option<(usize, u32)>,
    /// Nodes of the document; those of the scene are [`roots`](Self::roots).
    pub nodes: Vec<Value>,
    /// Nodes of the scene.
    pub roots: Vec<usize>,
    /// Extensions in use.
    pub extensions: Vec<&'static str>,
}

impl Glb {
    /// Adds `bytes` to the buffer; returns the index of their view.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() }));
        self.bytes.extend_from_slice(bytes);
        self.views.len() - 1
    }

    /// Adds numbers of a type such as `VEC3`; returns the index of their accessor.
    pub fn accessor<T: bytemuck::NoUninit>(&mut self, values: &[T], component: u32, kind: &str) -> usize {
        let view = self.view(bytemuck::cast_slice(values));
        self.accessors
            .push(json!({ "bufferView": view, "componentType": component, "count": values.len(), "type": kind }));
        self.accessors.len() - 1
    }

    /// The same for vertices.
    pub fn vertices<T: bytemuck::NoUninit>(&mut self, values: &[T], kind: &str) -> usize {
        self.targeted(values, FLOAT, kind, ARRAY_BUFFER)
    }

    /// The same for indices of vertices.
    pub fn indices(&mut self, values: &[u32]) -> usize {
        self.targeted(values, UNSIGNED_INT, "SCALAR", ELEMENT_ARRAY_BUFFER)
    }

    fn targeted<T: bytemuck::NoUninit>(&mut self, values: &[T], component: u32, kind: &str, target: u32) -> usize {
        let index = self.accessor(values, component, kind);
        if let Some(view) = self.views.last_mut() {
            view["target"] = target.into();
        }
        index
    }

    /// Adds positions, whose bounds a document states.
    pub fn positions(&mut self, values: &[glam::Vec3]) -> usize {
        let index = self.vertices(values, "VEC3");
        let bounds = |of: fn(glam::Vec3, glam::Vec3) -> glam::Vec3| {
            values.iter().copied().reduce(of).unwrap_or_default().to_array()
        };
        self.accessors[index]["min"] = json!(bounds(glam::Vec3::min));
        self.accessors[index]["max"] = json!(bounds(glam::Vec3::max));
        index
    }

    /// Notes that an extension is used.
    pub fn uses(&mut self, extension: &'static str) {
        if !self.extensions.contains(&extension) {
            self.extensions.push(extension);
        }
    }

    /// Writes the file, with `extras` of its asset.
    ///
    /// # Errors
    /// [`AppError::Write`], also for more than 4 GiB, which the format cannot hold.
    pub fn write(mut self, path: &Path, name: &str, extras: &Value) -> Result<(), AppError> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut document = json!({
            "asset": { "version": "2.0", "generator": format!("canopy {}", env!("CARGO_PKG_VERSION")), "extras": extras },
            "scene": 0,
            "scenes": [{ "name": name, "nodes": self.roots }],
            "nodes": self.nodes,
        });
        let own = |image: usize| self.own_wrap.is_some_and(|(other, _)| other == image);
        let textures: Vec<Value> = (0..self.images.len())
            .map(|image| json!({ "source": image, "sampler": usize::from(own(image)) }))
            .collect();
        let wraps = std::iter::once(REPEATED).chain(self.own_wrap.map(|(_, wrap)| wrap));
        let samplers: Vec<Value> = if textures.is_empty() {
            Vec::new()
        } else {
            wraps.map(|wrap| json!({ "wrapS": wrap, "wrapT": wrap })).collect()
        };
        let buffers = if self.bytes.is_empty() { Vec::new() } else { vec![json!({ "byteLength": self.bytes.len() })] };
        // Empty lists are not valid.
        let lists = [
            ("meshes", self.meshes),
            ("materials", self.materials),
            ("images", self.images),
            ("textures", textures),
            ("samplers", samplers),
            ("accessors", self.accessors),
            ("bufferViews", self.views),
            ("buffers", buffers),
            ("extensionsUsed", self.extensions.into_iter().map(Value::from).collect()),
        ];
        for (key, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
            document[key] = list.into();
        }
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let failed = |source| AppError::Write { path: path.to_owned(), source };
        let length = 12 + 8 + text.len() as u64 + if self.bytes.is_empty() { 0 } else { 8 + self.bytes.len() as u64 };
        let length = u32::try_from(length).map_err(|_| {
            failed(io::Error::other(format!(
                "{length} bytes are more than a GLB holds, which is 4 GiB; export fewer trees with --within"
            )))
        })?;
        files::write_whole(path, |writer| {
            writer.write_all(b"glTF")?;
            for number in [2, length, text.len() as u32] {
                writer.write_all(&number.to_le_bytes())?;
            }
            writer.write_all(b"JSON")?;
            writer.write_all(&text)?;
            if !self.bytes.is_empty() {
                writer.write_all(&(self.bytes.len() as u32).to_le_bytes())?;
                writer.write_all(b"BIN\0")?;
                writer.write_all(&self.bytes)?;
            }
            Ok(())
        })
        .map_err(failed)
    }
}
