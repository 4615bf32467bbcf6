//! Triangles of a plant for bakes and tracers: checked corners, areas and connected elements.
//!
//! All of them walk a mesh through [`triangles`], so a mesh that breaks its own rules (an index out of range, a
//! position that is not finite) loses those triangles and nothing else.

use std::collections::HashMap;

use glam::Vec3;

use super::PlantMesh;

/// The valid triangles of `mesh` with their index in `mesh.triangles`: all three indices in range of positions,
/// normals and texture coordinates, all three positions finite.
pub(crate) fn triangles(mesh: &PlantMesh) -> impl Iterator<Item = (u32, [usize; 3])> + '_ {
    let vertices = mesh.positions.len().min(mesh.normals.len()).min(mesh.uvs.len());
    mesh.triangles.iter().enumerate().filter_map(move |(index, corners)| {
        let corners = corners.map(|c| c as usize);
        let valid = corners.iter().all(|&c| c < vertices && mesh.positions[c].is_finite());
        (valid && index < u32::MAX as usize).then_some((index as u32, corners))
    })
}

/// Area of one side of a triangle, square metres; 0 where it overflows.
pub(crate) fn area(mesh: &PlantMesh, corners: [usize; 3]) -> f32 {
    mesh.area(corners.map(|corner| corner as u32))
}

/// Connected triangles of a mesh: a leaf card, a twig, a trunk.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    /// Indices in `PlantMesh::triangles`, ascending.
    pub triangles: Vec<u32>,
    /// Area of one side, square metres.
    pub area: f32,
    /// Centre of the area; the mean of the corners where there is no area.
    pub center: Vec3,
}

/// Splits a mesh into elements: triangles belong together when they share an edge *in place*, by the positions of
/// its ends and not by index, so that both indexed and unwelded meshes fall into the same cards. Two cards that
/// touch in one point only (at the twig they grow from) stay apart. In the order of each element's first triangle.
pub(crate) fn elements(mesh: &PlantMesh) -> Vec<Element> {
    let mut indices: HashMap<[u32; 3], u32> = HashMap::with_capacity(mesh.positions.len());
    let mut place_of = |vertex: usize| {
        // Adding zero turns -0.0 into 0.0, which is the same position.
        let key = (mesh.positions[vertex] + Vec3::ZERO).to_array().map(f32::to_bits);
        let next = indices.len() as u32;
        *indices.entry(key).or_insert(next)
    };
    let valid: Vec<(u32, [usize; 3])> = triangles(mesh).collect();
    let mut edges: Vec<(u32, u32, u32)> = Vec::with_capacity(valid.len() * 3);
    for (slot, (_, corners)) in valid.iter().enumerate() {
        let ends = corners.map(&mut place_of);
        for (a, b) in [(ends[0], ends[1]), (ends[1], ends[2]), (ends[2], ends[0])] {
            if a != b {
                edges.push((a.min(b), a.max(b), slot as u32));
            }
        }
    }
    edges.sort_unstable();
    let mut sets = DisjointSets::new(valid.len());
    for pair in edges.windows(2) {
        if (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1) {
            sets.join(pair[0].2, pair[1].2);
        }
    }

    let mut element_of_root = vec![u32::MAX; valid.len()];
    let mut found: Vec<Element> = Vec::new();
    // Moment of the area and sum of the corners, for the centre.
    let mut sums: Vec<(Vec3, Vec3)> = Vec::new();
    for (slot, &(index, corners)) in valid.iter().enumerate() {
        let entry = &mut element_of_root[sets.root(slot as u32) as usize];
        if *entry == u32::MAX {
            *entry = found.len() as u32;
            found.push(Element { triangles: Vec::new(), area: 0.0, center: Vec3::ZERO });
            sums.push((Vec3::ZERO, Vec3::ZERO));
        }
        let element = &mut found[*entry as usize];
        let (moment, corner_sum) = &mut sums[*entry as usize];
        let triangle_area = area(mesh, corners);
        let middle = corners.iter().map(|&c| mesh.positions[c]).sum::<Vec3>() / 3.0;
        element.triangles.push(index);
        element.area += triangle_area;
        *moment += triangle_area * middle;
        *corner_sum += middle;
    }
    for (element, (moment, middles)) in found.iter_mut().zip(sums) {
        let by_area = moment / element.area;
        element.center = if by_area.is_finite() { by_area } else { middles / element.triangles.len() as f32 };
    }
    found
}

/// Union-find with path halving; the smaller index is always the root, so the result does not depend on the order.
struct DisjointSets(Vec<u32>);

impl DisjointSets {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, mut item: u32) -> u32 {
        while self.0[item as usize] != item {
            let above = self.0[self.0[item as usize] as usize];
            self.0[item as usize] = above;
            item = above;
        }
        item
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;

    fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> PlantMesh {
        let count = positions.len();
        PlantMesh { positions, normals: vec![Vec3::Z; count], uvs: vec![Vec2::ZERO; count], triangles }
    }

    #[test]
    fn cards_are_found_indexed_or_not_and_apart_where_they_touch_in_a_point() {
        let card = |o: Vec3| [o, o + Vec3::X, o + Vec3::X + Vec3::Y, o + Vec3::Y];
        let mut positions: Vec<Vec3> = card(Vec3::ZERO).to_vec();
        let mut tris = vec![[0, 1, 2], [0, 2, 3]];
        // The second card is unwelded and touches the first in the point (1, 1, 0).
        let [a, b, c, d] = card(Vec3::new(1.0, 1.0, 0.0));
        positions.extend([a, b, c, a, c, d]);
        tris.extend([[4, 5, 6], [7, 8, 9]]);
        let found = elements(&mesh(positions, tris));
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].triangles, [0, 1]);
        assert_eq!(found[1].triangles, [2, 3]);
        assert!((found[1].area - 1.0).abs() < 1e-6);
        assert!((found[1].center - Vec3::new(1.5, 1.5, 0.0)).length() < 1e-6);
    }

    #[test]
    fn broken_triangles_are_left_out() {
        let broken = mesh(
            vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(f32::NAN, 0.0, 0.0)],
            vec![[0, 1, 2], [0, 1, 3], [0, 1, 9]],
        );
        assert_eq!(triangles(&broken).count(), 1);
        assert_eq!(elements(&broken).len(), 1);
    }

    #[test]
    fn an_element_without_area_has_a_finite_center() {
        let found = elements(&mesh(vec![Vec3::ONE; 3], vec![[0, 1, 2]]));
        assert_eq!(found.len(), 1);
        assert!((found[0].center - Vec3::ONE).length() < 1e-6);
    }
}
