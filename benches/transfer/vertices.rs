//! The vertices that are looked at.

use canopy::plant::{PartKind, Plant};
use glam::Vec3;

/// One vertex with the sides that a bake looks to.
pub struct Vertex {
    pub part: usize,
    pub vertex: usize,
    pub position: Vec3,
    pub normal: Vec3,
    pub two_sided: bool,
    /// Transmission of its part, a factor on the base colour.
    pub transmission: Vec3,
}

/// All vertices of a plant. Those of one card or ring lie beside each other in the mesh.
pub fn vertices_of(plant: &Plant) -> Vec<Vertex> {
    let of_part = |(part, source): (usize, &canopy::plant::PlantPart)| {
        let two_sided = source.kind == PartKind::Foliage;
        let transmission = if two_sided { source.material.transmission } else { Vec3::ZERO };
        let vertex = |(vertex, (position, normal)): (usize, (&Vec3, &Vec3))| Vertex {
            part,
            vertex,
            position: *position,
            normal: *normal,
            two_sided,
            transmission,
        };
        source.mesh.positions.iter().zip(&source.mesh.normals).enumerate().map(vertex).collect::<Vec<_>>()
    };
    plant.parts.iter().enumerate().flat_map(of_part).collect()
}

/// How far from its vertex a ray starts, metres.
pub fn start_of(plant: &Plant) -> f32 {
    plant.bounds().expect("a tree").size().max_element() / 65_536.0
}
