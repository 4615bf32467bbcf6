//! The mesh of one tile.

use glam::{DVec2, Vec3};

use super::super::Terrain;
use super::super::surface::gradient_normal;
use super::TILE_QUADS;

/// Vertices along a side of a tile.
const SIDE: usize = TILE_QUADS + 1;

/// One vertex of a tile's mesh; x and z follow from its index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileVertex {
    /// Height of the ground in metres above the datum.
    pub height: f32,
    /// Height of the next coarser level's mesh at the same position, in metres above the datum.
    pub parent_height: f32,
    /// Unit normal of the ground (not of the mesh), upwards.
    pub normal: Vec3,
    /// Unit normal that the next coarser mesh has at the same position, interpolated from its vertices.
    pub parent_normal: Vec3,
}

/// The triangles of every tile as vertex indices: counter-clockwise seen from above, two per quad, cut along the
/// diagonal from the north-western to the south-eastern corner. `6 N²` indices for the `(N + 1)²` vertices in rows.
pub fn tile_indices() -> Vec<u32> {
    let mut indices = Vec::with_capacity(6 * TILE_QUADS * TILE_QUADS);
    let side = SIDE as u32;
    for row in 0..side - 1 {
        for column in 0..side - 1 {
            let north_west = row * side + column;
            let (north_east, south_west, south_east) = (north_west + 1, north_west + side, north_west + side + 1);
            indices.extend([north_west, south_west, south_east, north_west, south_east, north_east]);
        }
    }
    indices
}

/// The triangles of every tile's skirt, a wall around it that faces outwards: `24 N` indices. An index of at least `(N + 1)²`
/// is that of the vertex `(N + 1)²` before it, lowered. Where a neighbour has more vertices at the common edge, or rounds
/// them otherwise, pixels between the two would show the sky.
pub fn skirt_indices() -> Vec<u32> {
    let (side, lowered) = (SIDE as u32, (SIDE * SIDE) as u32);
    let last = side - 1;
    // Around the tile, counter-clockwise seen from above, from the north-western corner.
    let around = (0..last)
        .map(|row| row * side)
        .chain((0..last).map(|column| last * side + column))
        .chain((1..side).rev().map(|row| row * side + last))
        .chain((1..side).rev());
    let ring: Vec<u32> = around.collect();
    let walls = ring.iter().zip(ring.iter().cycle().skip(1));
    walls.flat_map(|(&from, &to)| [from, from + lowered, to + lowered, from, to + lowered, to]).collect()
}

pub(super) fn vertices(terrain: &Terrain, origin: DVec2, spacing: f64) -> Vec<TileVertex> {
    let mut vertices = Vec::with_capacity(SIDE * SIDE);
    for row in 0..SIDE {
        let z = origin.y + row as f64 * spacing;
        for column in 0..SIDE {
            let x = origin.x + column as f64 * spacing;
            let (height, gradient) = terrain.height_and_gradient(x, z);
            let (height, normal) = (height as f32, gradient_normal(gradient));
            vertices.push(TileVertex { height, parent_height: height, normal, parent_normal: normal });
        }
    }
    // N is even, so a vertex with an odd index has its two even neighbours inside the tile.
    for row in 0..SIDE {
        for column in 0..SIDE {
            let (odd_column, odd_row) = (column % 2, row % 2);
            if odd_column + odd_row > 0 {
                let at = row * SIDE + column;
                let offset = odd_row * SIDE + odd_column;
                let (a, b) = (vertices[at - offset], vertices[at + offset]);
                vertices[at].parent_height = 0.5 * (a.height + b.height);
                vertices[at].parent_normal = (a.normal + b.normal).normalize_or(Vec3::Y);
            }
        }
    }
    vertices
}

/// Height inside a quad of the mesh at `u` (west to east) and `v` (north to south), 0 to 1 each, from its corners in
/// the order north-west, north-east, south-west, south-east.
pub(super) fn triangulated_height([nw, ne, sw, se]: [f64; 4], u: f64, v: f64) -> f64 {
    if u >= v { nw + u * (ne - nw) + v * (se - ne) } else { nw + v * (sw - nw) + u * (se - sw) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_skirt_goes_around_the_tile_and_faces_outwards() {
        let count = (SIDE * SIDE) as u32;
        let position = |i: u32| {
            let (at, height) = (i % count, if i < count { 0.0 } else { -1.0 });
            Vec3::new((at % SIDE as u32) as f32, height, (at / SIDE as u32) as f32)
        };
        let middle = Vec3::new(0.5, 0.0, 0.5) * TILE_QUADS as f32;
        let mut area = 0.0;
        for triangle in skirt_indices().chunks(3) {
            let [a, b, c] = [0, 1, 2].map(|i| position(triangle[i]));
            let normal = (b - a).cross(c - a);
            assert!(normal.y == 0.0 && normal.dot(a.with_y(0.0) - middle) > 0.0, "{a} {b} {c}");
            area += 0.5 * normal.length();
        }
        assert_eq!((skirt_indices().len(), area), (24 * TILE_QUADS, 4.0 * TILE_QUADS as f32));
    }

    #[test]
    fn triangles_face_up_and_cover_the_tile_once() {
        let indices = tile_indices();
        let position = |i: u32| DVec2::new(f64::from(i % SIDE as u32), f64::from(i / SIDE as u32));
        let mut area = 0.0;
        for triangle in indices.chunks_exact(3) {
            let [a, b, c] = [position(triangle[0]), position(triangle[1]), position(triangle[2])];
            // x east and z south: the up component of (b - a) x (c - a).
            let up = (b - a).y * (c - a).x - (b - a).x * (c - a).y;
            assert_eq!(up, 1.0);
            area += 0.5 * up;
        }
        assert_eq!(area, (TILE_QUADS * TILE_QUADS) as f64);
    }

    #[test]
    fn the_documented_diagonal_is_the_one_of_the_triangles() {
        let corners = [0.0, 1.0, 10.0, 100.0];
        assert_eq!(triangulated_height(corners, 0.5, 0.5), 50.0);
        assert_eq!(triangulated_height(corners, 1.0, 0.5), 50.5);
        assert_eq!(triangulated_height(corners, 0.5, 1.0), 55.0);
        assert_eq!(tile_indices()[..6], [0, 33, 34, 0, 34, 1]);
    }
}
