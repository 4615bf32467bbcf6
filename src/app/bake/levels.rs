//! The levels of detail of one plant, and what each of them is made of.

use std::fmt::{self, Display, Formatter};
use std::ops::Add;

use glam::Vec3;

use crate::{
    bake::{BakedPlant, levels::cross::Cross},
    lod::Representation,
    math::digits::grouped,
    plant::{PartKind, Plant, PlantMesh},
    render::forest::CROSS_VERTICES,
};

/// Facts of a level that need no image.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelFacts {
    /// What it is.
    pub representation: Representation,
    /// Its name for people.
    pub title: &'static str,
    /// Triangles of a tree.
    pub triangles: usize,
    /// Bytes on the device of the plant in this level, the plant's own textures apart.
    pub bytes: LevelBytes,
    /// Distance between a point of the plant and its image, metres, root mean square over the surface; `None` where
    /// pieces have vanished.
    pub deviation: Option<f32>,
    /// More lines about it.
    pub notes: Vec<String>,
}

/// Bytes of a level on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LevelBytes {
    /// With textures as texels.
    pub plain: usize,
    /// With textures in blocks.
    pub in_blocks: usize,
}

impl LevelBytes {
    /// Of meshes alone.
    pub fn of_meshes(bytes: usize) -> Self {
        Self { plain: bytes, in_blocks: bytes }
    }

    /// With textures that have as many bytes as `bytes` says, as texels or in blocks.
    pub fn with_textures(self, bytes: impl Fn(bool) -> usize) -> Self {
        Self { plain: self.plain + bytes(false), in_blocks: self.in_blocks + bytes(true) }
    }
}

impl Add for LevelBytes {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { plain: self.plain + other.plain, in_blocks: self.in_blocks + other.in_blocks }
    }
}

/// For people: both numbers where they differ.
impl Display for LevelBytes {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { plain, in_blocks } = *self;
        write!(f, "{}", bytes(plain))?;
        if in_blocks == plain { Ok(()) } else { write!(f, " ({} in blocks)", bytes(in_blocks)) }
    }
}

/// Bytes for people.
fn bytes(count: usize) -> String {
    if count < 1_000_000 { format!("{} kB", count.div_ceil(1000)) } else { format!("{:.1} MB", count as f64 / 1e6) }
}

/// The facts of the levels that `plant` has, from near to far.
pub fn facts(plant: &BakedPlant) -> Vec<LevelFacts> {
    let mut all = Vec::new();
    let meshes = || plant.plant.parts.iter().map(|part| &part.mesh);
    let transfer = |vertices: usize, total: usize| {
        let bytes: usize = (0..plant.plant.parts.len())
            .filter_map(|part| plant.lighting.transfer(part))
            .map(|(_, part)| part.bytes.len() + part.indirect_sun.len())
            .sum();
        bytes as f64 * vertices as f64 / total.max(1) as f64
    };
    let vertices: usize = meshes().map(|mesh| mesh.positions.len()).sum();
    all.push(LevelFacts {
        representation: Representation::MODEL,
        title: "Full model",
        triangles: meshes().map(|mesh| mesh.triangles.len()).sum(),
        bytes: LevelBytes::of_meshes(meshes().map(mesh_bytes).sum::<usize>() + transfer(vertices, vertices) as usize),
        deviation: Some(0.0),
        notes: Vec::new(),
    });
    let reduced_bytes = |reduced: &crate::bake::levels::reduced::ReducedPlant| {
        let own: usize = reduced.parts.iter().map(|part| part.mesh.positions.len()).sum();
        reduced.parts.iter().map(|part| mesh_bytes(&part.mesh)).sum::<usize>() + transfer(own, vertices) as usize
    };
    if let Some(thinned) = plant.thinned() {
        all.push(LevelFacts {
            representation: Representation::THINNED,
            title: "Simplified model",
            triangles: thinned.triangles(),
            bytes: LevelBytes::of_meshes(reduced_bytes(thinned)),
            deviation: None,
            notes: vec!["fewer and larger leaves".to_owned()],
        });
    }
    if let Some(surface) = plant.crown_surface() {
        let wood: usize = plant.plant.triangle_count(PartKind::Wood);
        all.push(LevelFacts {
            representation: Representation::SURFACE,
            title: "Crown surface",
            triangles: wood + surface.mesh.triangles.len(),
            bytes: LevelBytes::of_meshes(mesh_bytes(&surface.mesh)),
            deviation: None,
            notes: vec![format!("{} triangles of foliage, for styles", grouped(surface.mesh.triangles.len()))],
        });
    }
    if let Some(cloud) = plant.cloud() {
        all.push(LevelFacts {
            representation: Representation::CLOUD,
            title: "Billboard cloud",
            triangles: cloud.triangles(),
            bytes: LevelBytes::of_meshes(64 * cloud.planes.len() + reduced_bytes(&cloud.wood))
                .with_textures(|in_blocks| cloud.texture_bytes(in_blocks)),
            deviation: Some(cloud.deviation),
            notes: vec![
                format!("{} planes, {} triangles of wood", cloud.planes.len(), grouped(cloud.wood.triangles())),
                format!("leaves enlarged {:.2} times", cloud.leaf_scale),
            ],
        });
    }
    if let Some(cross) = plant.cross() {
        all.push(LevelFacts {
            representation: Representation::CROSS,
            title: "Crossed billboards",
            triangles: CROSS_VERTICES as usize / 3,
            bytes: LevelBytes::default().with_textures(|in_blocks| cross.texture_bytes(in_blocks)),
            deviation: Some(deviation_of_cross(&plant.plant, cross)),
            notes: vec![format!("{} planes", cross.planes.len())],
        });
    }
    all
}

/// Vertices of 20 bytes and indices of 4.
pub fn mesh_bytes(mesh: &PlantMesh) -> usize {
    20 * mesh.positions.len() + 12 * mesh.triangles.len()
}

/// Root mean square distance between the surface and the upright planes, each of which shows all of it.
fn deviation_of_cross(plant: &Plant, cross: &Cross) -> f32 {
    let (mut sum, mut area) = (0.0f64, 0.0f64);
    for mesh in plant.parts.iter().map(|part| &part.mesh) {
        for &triangle in &mesh.triangles {
            let weight = f64::from(mesh.area(triangle));
            let corners = triangle.map(|corner| mesh.positions.get(corner as usize).copied().unwrap_or_default());
            let middle = corners.iter().sum::<Vec3>() / 3.0;
            for plane in cross.uprights() {
                sum += weight * f64::from((middle - plane.center).dot(plane.normal).powi(2));
                area += weight;
            }
        }
    }
    let deviation = (sum / area).sqrt() as f32;
    if deviation.is_finite() { deviation } else { 0.0 }
}
