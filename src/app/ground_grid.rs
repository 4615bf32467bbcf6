//! The ground as a regular mesh in pieces, for programs that have no terrain of their own.

use glam::{DVec2, Vec3};

use crate::terrain::Terrain;

/// Linear colour of the ground where nothing else is known.
pub const SOIL: Vec3 = Vec3::new(0.06, 0.05, 0.025);
/// The most quads along a side of the whole ground: two million triangles.
const MOST_QUADS: u32 = 1024;
/// Quads along a side of a piece.
const PIECE_QUADS: u32 = 64;

/// One piece.
pub struct GridPiece {
    /// Positions in metres.
    pub positions: Vec<Vec3>,
    /// Normals of unit length.
    pub normals: Vec<Vec3>,
    /// Three a triangle, counter-clockwise from above.
    pub indices: Vec<u32>,
}

/// Pieces of a grid over `terrain`, up to `half` metres from the origin to the east and to the south, and as far to the west and
/// north: as fine as the data, or as [`MOST_QUADS`] allow.
pub fn pieces(terrain: &Terrain, half: DVec2) -> impl Iterator<Item = GridPiece> {
    let spacing = terrain.field().spacing();
    let along = |half: f64, spacing: f64| {
        let quads = (2.0 * half / spacing.max(1e-3)).ceil().clamp(1.0, f64::from(MOST_QUADS)) as u32;
        let pieces = quads.div_ceil(PIECE_QUADS);
        (pieces, 2.0 * half / f64::from(pieces * PIECE_QUADS))
    };
    let ((columns, across), (rows, down)) = (along(half.x, spacing.x), along(half.y, spacing.y));
    let step = DVec2::new(across, down);
    (0..rows).flat_map(move |row| (0..columns).map(move |column| piece(terrain, half, step, column, row)))
}

fn piece(terrain: &Terrain, half: DVec2, step: DVec2, column: u32, row: u32) -> GridPiece {
    let side = PIECE_QUADS + 1;
    let at = |piece: u32, quad: u32| f64::from(piece * PIECE_QUADS + quad);
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    for (j, i) in (0..side).flat_map(|j| (0..side).map(move |i| (j, i))) {
        let (x, z) = (at(column, i) * step.x - half.x, at(row, j) * step.y - half.y);
        positions.push(Vec3::new(x as f32, terrain.height(x, z) as f32, z as f32));
        normals.push(terrain.normal(x, z));
    }
    let quad = |(j, i): (u32, u32)| {
        let first = j * side + i;
        [first, first + side, first + 1, first + 1, first + side, first + side + 1]
    };
    let indices = (0..PIECE_QUADS).flat_map(|j| (0..PIECE_QUADS).map(move |i| (j, i))).flat_map(quad).collect();
    GridPiece { positions, normals, indices }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::{HeightField, Surroundings};

    #[test]
    fn the_ground_reaches_its_border_faces_up_and_stays_within_the_most_triangles() {
        let heights = (0..9).map(|height| height as f32).collect();
        let field = HeightField::new(3, 3, DVec2::splat(5.0), heights).unwrap();
        let terrain = Terrain::new(field, None, Surroundings::Mirror);
        for (half, count) in [((10.0, 10.0), 1), ((1000.0, 100.0), 7), ((1e6, 1e6), 256)] {
            let half = DVec2::from(half);
            let mut border = Vec3::ZERO;
            let mut found = 0;
            for piece in pieces(&terrain, half) {
                found += 1;
                for triangle in piece.indices.chunks(3) {
                    let [a, b, c] = [0, 1, 2].map(|corner| piece.positions[triangle[corner] as usize]);
                    assert!((b - a).cross(c - a).y > 0.0, "{a} {b} {c}");
                    border = border.max(a).max(b).max(c);
                }
            }
            assert_eq!(found, count, "{half}");
            assert!(
                (f64::from(border.x) - half.x).abs() < 1e-4 * half.x
                    && (f64::from(border.z) - half.y).abs() < 1e-4 * half.x
            );
        }
    }
}
