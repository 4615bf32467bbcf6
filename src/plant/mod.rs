//! The data of a plant: wood and foliage as triangle meshes with materials.
//!
//! A [`Plant`] comes from a glTF file ([`gltf`]) or is grown by rule ([`grow`]). It stands with its trunk's
//! foot at the origin, Y up, in metres. Everything downstream (bakes, levels of detail, passes) reads this type.

mod content;
pub(crate) mod geometry;
mod gloss;
pub mod gltf;
pub mod grow;
mod leaf_kind;
pub mod leaf_textures;
mod optics;
pub mod prospect;
pub mod strokes;
pub(crate) mod surface;
pub mod texture;
mod tissue;
pub mod tissue_light;
pub(crate) mod tissue_slabs;

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use image::RgbaImage;
use serde::{Deserialize, Serialize};

pub use gloss::{Gloss, lobe_gain, lobe_peak, lobe_room};
pub use leaf_kind::LeafKind;
pub use optics::LeafColors;
pub use strokes::LeafStrokes;
pub use tissue::{LeafTextures, LeafTissue, Measured};

/// One individual plant in its own frame: metres, Y up, the trunk's foot at the origin.
#[derive(Clone, Debug, Default)]
pub struct Plant {
    /// Name for messages and reports.
    pub name: String,
    /// The parts, each with one material. May be empty (nothing is drawn then).
    pub parts: Vec<PlantPart>,
}

/// A part of a plant that is drawn with one material.
#[derive(Clone, Debug)]
pub struct PlantPart {
    /// Wood is opaque, foliage is alpha tested and lit on both sides.
    pub kind: PartKind,
    /// The triangles.
    pub mesh: PlantMesh,
    /// Colour, textures, transmission.
    pub material: PlantMaterial,
}

/// Whether a part is wood or foliage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PartKind {
    /// Trunk and branches: opaque, single sided, no transmission.
    Wood,
    /// Leaves, needles, blossoms: alpha tested, double sided, transmits light.
    Foliage,
}

/// An indexed triangle mesh. `positions`, `normals` and `uvs` have the same length;
/// every index in `triangles` is below it; all values are finite and normals have unit length.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlantMesh {
    /// Vertex positions in metres.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, origin at the image's upper left; may leave 0..1 (textures repeat).
    pub uvs: Vec<Vec2>,
    /// Counter-clockwise triangles (front side), as vertex indices.
    pub triangles: Vec<[u32; 3]>,
}

impl PlantMesh {
    /// Whether the mesh is valid, apart from the length of its normals: lists of equal length, indices below it, finite
    /// values.
    pub fn is_whole(&self) -> bool {
        let vertices = self.positions.len();
        self.normals.len() == vertices
            && self.uvs.len() == vertices
            && self.triangles.iter().flatten().all(|&corner| (corner as usize) < vertices)
            && self.positions.iter().chain(&self.normals).all(|vector| vector.is_finite())
            && self.uvs.iter().all(|uv| uv.is_finite())
    }

    /// Whether the triangles enclose a volume: each edge belongs to as many triangles in one direction as in the other, vertices of
    /// equal position being one. An empty mesh encloses none.
    pub fn is_closed(&self) -> bool {
        let place = |corner: u32| {
            // Both zeros are the same place.
            self.positions.get(corner as usize).map(|p| p.to_array().map(|c| (c + 0.0).to_bits()))
        };
        let mut balance: HashMap<_, i32> = HashMap::new();
        for &[a, b, c] in &self.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)].map(|(from, to)| (place(from), place(to))) {
                if from != to {
                    let (edge, turn) = if from < to { ((from, to), 1) } else { ((to, from), -1) };
                    *balance.entry(edge).or_default() += turn;
                }
            }
        }
        !balance.is_empty() && balance.values().all(|&turns| turns == 0)
    }

    /// Area of one side of a triangle, square metres; 0 where it overflows or a corner is missing.
    pub fn area(&self, triangle: [u32; 3]) -> f32 {
        let [a, b, c] = triangle.map(|corner| self.positions.get(corner as usize).copied().unwrap_or(Vec3::NAN));
        let area = 0.5 * (b - a).cross(c - a).length();
        if area.is_finite() { area } else { 0.0 }
    }
}

/// The material of one part.
#[derive(Clone, Debug)]
pub struct PlantMaterial {
    /// Name for messages; may be empty.
    pub name: String,
    /// Linear factor on the base colour, 0..1.
    pub base_color: Vec3,
    /// Base colour: sRGB-encoded RGB, linear straight alpha. `None`: white and opaque.
    pub base_color_texture: Option<Arc<RgbaImage>>,
    /// Tangent-space normals as RGB8, OpenGL convention (+Y up). `None`: flat.
    pub normal_texture: Option<Arc<RgbaImage>>,
    /// Threshold of the alpha test, 0..1; foliage only.
    pub alpha_cutoff: f32,
    /// Linear colour of diffuse transmission, as a factor on the subsurface albedo (the base colour without its
    /// [`Gloss`]), 0..=[`PlantMaterial::MOST_TRANSMISSION`] each; zero for wood. [`LeafKind`] has typical values,
    /// [`PlantMaterial::transmitted`] the resulting light.
    pub transmission: Vec3,
    /// Specular reflection of the leaf's surface; wood is matt.
    pub gloss: Gloss,
    /// Further textures of the leaf; none for wood.
    pub leaf_textures: LeafTextures,
    /// The leaf's tissue. With one, leaves are drawn and traced by the layers of [Franzke 2005, 3.2]; without, light leaves them
    /// the same at every angle.
    pub tissue: Option<LeafTissue>,
    /// Strokes that styles draw on each leaf. They change no light and no bake.
    pub strokes: Option<Arc<LeafStrokes>>,
}

impl PlantMaterial {
    /// The greatest factor of [`PlantMaterial::transmission`]; dark channels of a file's colours need it to be this
    /// large.
    pub const MOST_TRANSMISSION: f32 = 8.0;
}

impl Default for PlantMaterial {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec3::ONE,
            base_color_texture: None,
            normal_texture: None,
            alpha_cutoff: 0.5,
            transmission: Vec3::ZERO,
            gloss: Gloss::MATT,
            leaf_textures: LeafTextures::default(),
            tissue: None,
            strokes: None,
        }
    }
}

/// An axis-aligned box in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest corner.
    pub min: Vec3,
    /// Largest corner.
    pub max: Vec3,
}

impl Bounds {
    /// Extent along each axis, metres.
    pub fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// Middle of the box.
    pub fn center(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }
}

impl Plant {
    /// The box around all vertices, or `None` for a plant without any.
    pub fn bounds(&self) -> Option<Bounds> {
        self.bounds_of(|_| true)
    }

    /// The box around the vertices of the parts that `select` accepts, or `None` where there are none.
    pub fn bounds_of(&self, select: impl Fn(PartKind) -> bool) -> Option<Bounds> {
        let mut points =
            self.parts.iter().filter(|part| select(part.kind)).flat_map(|part| part.mesh.positions.iter().copied());
        let first = points.next()?;
        Some(points.fold(Bounds { min: first, max: first }, |b, p| Bounds { min: b.min.min(p), max: b.max.max(p) }))
    }

    /// Height above the foot in metres (0 for an empty plant).
    pub fn height(&self) -> f32 {
        self.bounds().map_or(0.0, |b| b.max.y.max(0.0))
    }

    /// Radius in metres of the upright cylinder about the trunk's axis that holds the plant at any yaw (0 for an empty
    /// plant). The axis is seldom the centre of the bounding box, and the box's corners are farther away than its
    /// sides.
    pub fn bounding_radius(&self) -> f32 {
        self.bounds().map_or(0.0, |b| {
            let far = b.min.abs().max(b.max.abs());
            far.x.hypot(far.z)
        })
    }

    /// Number of triangles of the parts of `kind`.
    pub fn triangle_count(&self, kind: PartKind) -> usize {
        self.parts.iter().filter(|part| part.kind == kind).map(|part| part.mesh.triangles.len()).sum()
    }

    /// Gives `strokes` to the foliage that they name, and says whether there is any.
    pub fn set_strokes(&mut self, strokes: &Arc<LeafStrokes>) -> bool {
        let mut found = false;
        for part in self.parts.iter_mut().filter(|part| strokes.are_on(part)) {
            part.material.strokes = Some(strokes.clone());
            found = true;
        }
        found
    }

    /// Scales the plant about its foot by `factor` (> 0), in place.
    pub fn scale(&mut self, factor: f32) {
        for position in self.parts.iter_mut().flat_map(|part| part.mesh.positions.iter_mut()) {
            *position *= factor;
        }
    }
}
