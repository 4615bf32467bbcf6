//! The points at which transfer is computed: each position and normal once, neighbours next to each other.

use std::collections::HashMap;

use glam::Vec3;

use crate::plant::{PartKind, Plant, PlantMesh, geometry};

/// Distance between a vertex and the origin of its rays, as a fraction of the plant's longest extent, so that they hit
/// neither the triangles of the vertex nor those that touch them: 0.3 mm for a tree of 20 m.
const START: f32 = 1.0 / 65_536.0;

/// Marks a vertex that has no point.
pub(super) const NO_SLOT: u32 = u32::MAX;

/// A point whose light is computed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    /// Metres.
    pub position: Vec3,
    /// Unit length.
    pub normal: Vec3,
    /// Whether the back side is computed as well.
    pub two_sided: bool,
}

/// All points of a plant, along a curve through space, so that the rays of consecutive ones meet the same triangles.
pub(super) struct Points {
    /// The points; an index into this list is a slot.
    pub list: Vec<Point>,
    /// Distance between a point and the origin of its rays, metres.
    pub start: f32,
    /// The slot of each vertex of each part, or [`NO_SLOT`].
    slots: Vec<Vec<u32>>,
}

impl Points {
    /// The points of all vertices that have a finite position and a normal.
    pub fn new(plant: &Plant) -> Self {
        let mut indices: HashMap<([u32; 6], bool), u32> = HashMap::new();
        let mut list: Vec<Point> = Vec::new();
        let mut slots: Vec<Vec<u32>> = Vec::with_capacity(plant.parts.len());
        for part in &plant.parts {
            let two_sided = part.kind == PartKind::Foliage;
            slots.push(
                (0..part.mesh.positions.len())
                    .map(|vertex| {
                        let Some((position, normal)) = frame(&part.mesh, vertex) else { return NO_SLOT };
                        // Adding zero turns -0.0 into 0.0, which is the same position.
                        let [a, b, c] = (position + Vec3::ZERO).to_array().map(f32::to_bits);
                        let [d, e, f] = (normal + Vec3::ZERO).to_array().map(f32::to_bits);
                        *indices.entry(([a, b, c, d, e, f], two_sided)).or_insert_with(|| {
                            list.push(Point { position, normal, two_sided });
                            list.len() as u32 - 1
                        })
                    })
                    .collect(),
            );
        }
        let start = start_distance(&list);
        let new_slot = sort_along_curve(&mut list);
        for slot in slots.iter_mut().flatten().filter(|slot| **slot != NO_SLOT) {
            *slot = new_slot[*slot as usize];
        }
        Self { list, start, slots }
    }

    /// The slot of each vertex of a part, or [`NO_SLOT`].
    pub fn of_part(&self, part: usize) -> &[u32] {
        &self.slots[part]
    }

    /// The corners of every triangle of the plant's parts, part by part: the slot of each, and whether its normal
    /// points to the triangle's back. Broken triangles have no slots.
    pub fn corners(&self, plant: &Plant) -> Vec<Vec<[(u32, bool); 3]>> {
        let of_part = |(slots, mesh): (&Vec<u32>, &PlantMesh)| {
            let mut out = vec![[(NO_SLOT, false); 3]; mesh.triangles.len()];
            for (index, corners) in geometry::triangles(mesh) {
                let [a, b, c] = corners.map(|corner| mesh.positions[corner].as_dvec3());
                let front = (b - a).cross(c - a);
                out[index as usize] = corners.map(|corner| {
                    let slot = slots[corner];
                    (slot, slot != NO_SLOT && mesh.normals[corner].as_dvec3().dot(front) < 0.0)
                });
            }
            out
        };
        self.slots.iter().zip(plant.parts.iter().map(|part| &part.mesh)).map(of_part).collect()
    }
}

/// A vertex's position and unit normal, where it has both.
fn frame(mesh: &PlantMesh, vertex: usize) -> Option<(Vec3, Vec3)> {
    let position = mesh.positions[vertex];
    let normal = mesh.normals.get(vertex)?.try_normalize()?;
    position.is_finite().then_some((position, normal))
}

/// At least four units in the last place of the largest coordinate: a plant far from its origin is coarse.
fn start_distance(list: &[Point]) -> f32 {
    let Some(first) = list.first() else { return 0.0 };
    let (low, high) = list
        .iter()
        .fold((first.position, first.position), |(low, high), p| (low.min(p.position), high.max(p.position)));
    let extent = (high.as_dvec3() - low.as_dvec3()).max_element() as f32;
    let coarse = 4.0 * f32::EPSILON * low.abs().max(high.abs()).max_element();
    let start = (START * extent).max(coarse);
    if start.is_finite() { start } else { 0.0 }
}

/// Sorts the points along Morton's curve; gives the new slot of each old one.
fn sort_along_curve(list: &mut Vec<Point>) -> Vec<u32> {
    let Some(first) = list.first() else { return Vec::new() };
    let (low, high) = list
        .iter()
        .fold((first.position, first.position), |(low, high), p| (low.min(p.position), high.max(p.position)));
    let (low, size) = (low.as_dvec3(), (high.as_dvec3() - low.as_dvec3()).max_element().max(f64::MIN_POSITIVE));
    let code = |point: &Point| {
        let cell = ((point.position.as_dvec3() - low) / size * 1023.0).as_uvec3();
        (0..10).fold(0u32, |code, bit| {
            let digit = |c: u32| (c >> bit) & 1;
            code | (digit(cell.x) | digit(cell.y) << 1 | digit(cell.z) << 2) << (3 * bit)
        })
    };
    let mut order: Vec<u32> = (0..list.len() as u32).collect();
    order.sort_by_cached_key(|&old| (code(&list[old as usize]), old));
    let mut new_slot = vec![0; list.len()];
    for (slot, &old) in order.iter().enumerate() {
        new_slot[old as usize] = slot as u32;
    }
    *list = order.iter().map(|&old| list[old as usize]).collect();
    new_slot
}
