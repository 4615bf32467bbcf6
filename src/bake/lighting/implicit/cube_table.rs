//! The 256 ways in which a surface crosses a cube, as triangles over the cube's edges.
//!
//! The table of marching cubes [Lorensen & Cline 1987] is made by rule, not typed in: on each face the inside corners
//! that hang together are cut off, and the cuts are joined to closed loops. Two cubes see the same corners on the face
//! that they share, so their cuts agree: no holes, where the published table has some. A loop is cut into triangles by
//! diagonals that never lie in a face of the cube, so no diagonal can meet one of the neighbour's, and every edge of
//! the surface has exactly two triangles.

use std::sync::LazyLock;

/// Edges of a cube as the corner that they start from and their axis. Corner `c` lies at x = bit 0, y = bit 1,
/// z = bit 2.
pub(super) const EDGES: [(u8, u8); 12] =
    [(0, 0), (2, 0), (4, 0), (6, 0), (0, 1), (1, 1), (4, 1), (5, 1), (0, 2), (1, 2), (2, 2), (3, 2)];

/// Corners of the six faces, counter-clockwise as seen from outside.
const FACES: [[u8; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// Triangles of each case (bit c: corner c is inside) as indices into [`EDGES`], counter-clockwise from outside.
pub(super) static TRIANGLES: LazyLock<Vec<Vec<[u8; 3]>>> = LazyLock::new(|| (0..=255).map(triangles).collect());

fn triangles(inside: u8) -> Vec<[u8; 3]> {
    let mut next = [None; 12];
    for face in FACES {
        let is_in = |k: usize| inside >> face[k % 4] & 1 == 1;
        for leave in (0..4).filter(|&k| is_in(k) && !is_in(k + 1)) {
            // Back along the face to where this run of inside corners began.
            let enter = (1..4).map(|back| (leave + 4 - back) % 4).find(|&k| !is_in(k)).unwrap_or(leave);
            next[edge(face[enter], face[(enter + 1) % 4])] = Some(edge(face[leave], face[(leave + 1) % 4]));
        }
    }
    let mut out = Vec::new();
    for start in 0..12 {
        let mut polygon = Vec::new();
        let mut at = start;
        while let Some(to) = next[at].take() {
            polygon.push(at as u8);
            at = to;
        }
        cut(&polygon, &mut out);
    }
    out
}

/// The edge between two corners.
fn edge(a: u8, b: u8) -> usize {
    let (from, axis) = (a.min(b), (a ^ b).trailing_zeros() as u8);
    EDGES.iter().position(|&edge| edge == (from, axis)).unwrap_or_default()
}

/// Whether two edges belong to one face.
fn share_face(a: u8, b: u8) -> bool {
    let ends = |e: u8| {
        let (corner, axis) = EDGES[usize::from(e)];
        [corner, corner | 1 << axis]
    };
    FACES.iter().any(|face| [a, b].iter().all(|&e| ends(e).iter().all(|corner| face.contains(corner))))
}

/// Cuts a polygon into triangles without a diagonal in a face; nothing is added where there is no such way.
fn cut(polygon: &[u8], out: &mut Vec<[u8; 3]>) -> bool {
    let n = polygon.len();
    if n < 3 {
        return true;
    }
    let (first, last) = (polygon[0], polygon[n - 1]);
    for apex in 1..n - 1 {
        let middle = polygon[apex];
        let crosses = |a: u8, b: u8, apart: usize| apart > 1 && share_face(a, b);
        if crosses(first, middle, apex) || crosses(middle, last, n - 1 - apex) {
            continue;
        }
        let before = out.len();
        out.push([first, middle, last]);
        if cut(&polygon[..=apex], out) && cut(&polygon[apex..], out) {
            return true;
        }
        out.truncate(before);
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_is_a_surface_whose_rim_lies_in_the_faces() {
        for (case, triangles) in TRIANGLES.iter().enumerate() {
            let crossed = EDGES
                .iter()
                .enumerate()
                .filter(|(_, (from, axis))| (case >> from & 1) != (case >> (from | 1 << axis) & 1));
            let mut crossed: Vec<u8> = crossed.map(|(e, _)| e as u8).collect();
            let mut used: Vec<u8> = triangles.iter().flatten().copied().collect();
            used.sort_unstable();
            used.dedup();
            crossed.sort_unstable();
            assert_eq!(used, crossed, "case {case}");
            // A directed edge occurs once; without its opposite it is a cut of a face.
            let directed: Vec<(u8, u8)> = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
            for (i, &(a, b)) in directed.iter().enumerate() {
                assert!(!directed[..i].contains(&(a, b)), "case {case}");
                let alone = !directed.contains(&(b, a));
                assert_eq!(alone, share_face(a, b), "case {case}");
            }
        }
    }

    #[test]
    fn triangles_face_away_from_the_inside() {
        let point = |e: u8| {
            let (corner, axis) = EDGES[usize::from(e)];
            let mut p = glam::Vec3::new((corner & 1) as f32, (corner >> 1 & 1) as f32, (corner >> 2) as f32);
            p[usize::from(axis)] = 0.5;
            p
        };
        for corner in 0..8u8 {
            let [a, b, c] = TRIANGLES[1 << corner][0].map(point);
            let inside = glam::Vec3::new((corner & 1) as f32, (corner >> 1 & 1) as f32, (corner >> 2) as f32);
            assert!((b - a).cross(c - a).dot(a - inside) > 0.0);
        }
    }
}
