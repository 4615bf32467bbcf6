//! The implicit surface F = τ as a closed triangle mesh [Luft 2007, 2.3], by marching cubes [Lorensen & Cline 1987].
//!
//! Only cells near the surface are visited. A cube around everything is cut into eight again and again; a piece whose
//! bounds of F (`DensityField::bounds`) do not hold τ is dropped. The bounds are rigorous, so no piece of the surface
//! can be missed, neither a lone twig nor a hollow, and every edge that the surface crosses has all its four cells: the
//! mesh is closed and manifold, each edge has two triangles. The field is evaluated at the corners of what remains.
//!
//! Limits: features that are thinner than a cell and lie between its corners are missed. There are at most
//! [`MOST_CELLS`] cells: their size is doubled until they fit, and the bake's report has the size.

use glam::{UVec3, Vec3, Vec3A};
use rayon::prelude::*;

use super::cube_table::{EDGES, TRIANGLES};
use super::density::DensityField;
use super::partition::Aabb;

/// Most cells that may be visited.
pub const MOST_CELLS: usize = 1 << 21;
/// Most cells along an edge of the cube around everything: a coordinate has 20 bits.
const MOST_ALONG: f32 = (1 << 20) as f32;

/// A closed triangle mesh around the crown.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Vertex positions, metres.
    pub positions: Vec<Vec3>,
    /// Unit normals, outward: the field's negative gradient.
    pub normals: Vec<Vec3>,
    /// Counter-clockwise triangles as seen from outside, as vertex indices.
    pub triangles: Vec<[u32; 3]>,
}

/// Positions and triangles before there are normals.
pub(super) struct Extracted {
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    /// Edge of a cell in metres.
    pub cell: f32,
}

/// A lattice of cells.
#[derive(Clone, Copy)]
struct Lattice {
    origin: Vec3,
    cell: f32,
}

impl Lattice {
    fn point(&self, node: UVec3) -> Vec3 {
        (self.origin.as_dvec3() + f64::from(self.cell) * node.as_dvec3()).as_vec3()
    }
}

/// A cell or node as one number, in the order of which neighbours along x follow each other.
fn key(at: UVec3) -> u64 {
    u64::from(at.z) << 42 | u64::from(at.y) << 21 | u64::from(at.x)
}

fn unkey(key: u64) -> UVec3 {
    let part = |shift: u32| (key >> shift & 0x1f_ffff) as u32;
    UVec3::new(part(0), part(21), part(42))
}

fn corner(c: u8) -> UVec3 {
    UVec3::new(u32::from(c & 1), u32::from(c >> 1 & 1), u32::from(c >> 2))
}

/// The surface F = `threshold` within `region` (all generators and their reach are added), with cells of about
/// `cell` metres. Empty where F nowhere exceeds the threshold.
pub(super) fn extract(field: &DensityField, region: &Aabb, threshold: f32, cell: f32) -> Extracted {
    let mut cell = cell;
    let longest = region.size().max_element() + 2.0 * field.radius();
    let usable = longest.is_finite() && cell > 0.0 && field.radius() > 0.0;
    if !usable {
        return Extracted { positions: Vec::new(), triangles: Vec::new(), cell };
    }
    cell = cell.max(longest / MOST_ALONG * 4.0);
    loop {
        if let Some(found) = extract_with(field, region, threshold, cell) {
            return found;
        }
        cell *= 2.0;
    }
}

fn extract_with(field: &DensityField, region: &Aabb, threshold: f32, cell: f32) -> Option<Extracted> {
    let size = region.size().max_element() + 2.0 * field.radius();
    let along = ((size / cell).ceil() as u32 + 2).next_power_of_two();
    // Off the middle, so that a symmetric crown's surface does not run through the nodes.
    let middle = region.center() - Vec3A::new(0.31, 0.43, 0.37) * cell;
    let lattice = Lattice { origin: Vec3::from(middle - 0.5 * cell * along as f32), cell };
    let cells = cells_at_surface(field, lattice, along, threshold)?;

    let nodes = nodes_of(&cells);
    let points: Vec<Vec3> = nodes.par_iter().map(|&node| lattice.point(unkey(node))).collect();
    let values = field.values(&points);
    let value = |node: UVec3| nodes.binary_search(&key(node)).map_or(0.0, |at| values[at]);
    let corners: Vec<[f32; 8]> = cells
        .par_iter()
        .map(|&cell| std::array::from_fn(|c| value(unkey(cell) + corner(c as u8)) - threshold))
        .collect();

    // Each cell owns the three edges that start at its first corner.
    let mut owned = vec![[u32::MAX; 3]; cells.len()];
    let mut positions = Vec::new();
    for ((&cell, corners), owned) in cells.iter().zip(&corners).zip(&mut owned) {
        let at = unkey(cell);
        for axis in 0..3 {
            let (a, b) = (corners[0], corners[1 << axis]);
            if (a > 0.0) != (b > 0.0) {
                // Kept off the nodes, where triangles would lose their area.
                let share = (a / (a - b)).clamp(0.02, 0.98);
                let mut point = at.as_dvec3();
                point[axis] += f64::from(share);
                owned[axis] = positions.len() as u32;
                positions.push((lattice.origin.as_dvec3() + f64::from(lattice.cell) * point).as_vec3());
            }
        }
    }
    let triangles = cells
        .par_iter()
        .zip(&corners)
        .flat_map_iter(|(&cell, corners)| {
            let case = (0..8).filter(|&c| corners[c] > 0.0).fold(0usize, |case, c| case | 1 << c);
            let vertex = |edge: u8| {
                let (from, axis) = EDGES[usize::from(edge)];
                let owner = cells.binary_search(&key(unkey(cell) + corner(from)));
                owner.map_or(u32::MAX, |owner| owned[owner][usize::from(axis)])
            };
            let table: &[[u8; 3]] = &TRIANGLES[case];
            table.iter().map(move |triangle| triangle.map(vertex)).collect::<Vec<_>>()
        })
        .collect();
    Some(Extracted { positions, triangles, cell })
}

/// The cells whose bounds hold the threshold, ascending by key. `None` where they are too many.
fn cells_at_surface(field: &DensityField, lattice: Lattice, along: u32, threshold: f32) -> Option<Vec<u64>> {
    let mut pieces = vec![UVec3::ZERO];
    let mut edge = along;
    loop {
        pieces = pieces
            .into_par_iter()
            .filter(|&piece| {
                // A little larger than the piece: the places of the corners are rounded.
                let (low, high) = (lattice.point(piece), lattice.point(piece + edge));
                let room = 1.0e-3 * lattice.cell + 2.0 * f32::EPSILON * low.abs().max(high.abs()).max_element();
                let region = Aabb { min: (low - room).into(), max: (high + room).into() };
                let (least, most) = field.bounds(&region);
                least <= threshold && most > threshold
            })
            .collect();
        if pieces.len() > MOST_CELLS / 4 && edge > 1 || pieces.len() > MOST_CELLS {
            return None;
        }
        if edge == 1 {
            break;
        }
        edge /= 2;
        pieces = pieces.into_par_iter().flat_map_iter(|piece| (0..8).map(move |c| piece + edge * corner(c))).collect();
    }
    let mut cells: Vec<u64> = pieces.into_iter().map(key).collect();
    cells.par_sort_unstable();
    Some(cells)
}

/// The corners of all cells, ascending by key.
fn nodes_of(cells: &[u64]) -> Vec<u64> {
    let mut nodes: Vec<u64> =
        cells.par_iter().flat_map_iter(|&cell| (0..8).map(move |c| key(unkey(cell) + corner(c)))).collect();
    nodes.par_sort_unstable();
    nodes.dedup();
    nodes
}

#[cfg(test)]
pub(super) mod tests {
    use std::collections::HashMap;

    use super::super::generators::{Generator, Weighting};
    use super::*;

    /// Whether each edge has two triangles that run along it in opposite directions, and every vertex is used.
    pub(in crate::bake::lighting::implicit) fn is_closed(triangles: &[[u32; 3]], vertices: usize) -> bool {
        let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
        let mut used = vec![false; vertices];
        for &[a, b, c] in triangles {
            for edge in [(a, b), (b, c), (c, a)] {
                *edges.entry(edge).or_default() += 1;
                used[edge.0 as usize] = true;
            }
        }
        used.iter().all(|used| *used)
            && edges.iter().all(|(&(a, b), &count)| a != b && count == 1 && edges.contains_key(&(b, a)))
    }

    fn generators_at(points: &[Vec3]) -> Vec<Generator> {
        points.iter().map(|&position| Generator { position, area: 1.0, primitives: 1.0 }).collect()
    }

    fn surface(points: &[Vec3], radius: f32, threshold: f32, cell: f32) -> Extracted {
        let field = DensityField::new(&generators_at(points), radius, Weighting::Primitives);
        extract(&field, &Aabb::around(points.iter().copied()), threshold, cell)
    }

    /// A ball about the origin, and its radius.
    pub(in crate::bake::lighting::implicit) fn ball() -> (Extracted, f32) {
        let threshold = 0.3f32;
        (surface(&[Vec3::ZERO], 1.0, threshold, 0.1), (1.0 - threshold.sqrt()).sqrt())
    }

    #[test]
    fn one_generator_gives_a_closed_ball_of_the_right_size() {
        let (mesh, radius) = ball();
        assert!(is_closed(&mesh.triangles, mesh.positions.len()));
        assert_eq!(mesh.positions.len() + mesh.triangles.len() - mesh.triangles.len() * 3 / 2, 2);
        for p in &mesh.positions {
            assert!((p.length() / radius - 1.0).abs() < 0.02, "{}", p.length());
        }
        let volume: f32 = mesh
            .triangles
            .iter()
            .map(|t| t.map(|v| mesh.positions[v as usize]))
            .map(|[a, b, c]| a.cross(b).dot(c) / 6.0)
            .sum();
        assert!((volume / (4.1888 * radius.powi(3)) - 1.0).abs() < 0.05, "{volume}");
    }

    #[test]
    fn thickets_of_any_kind_are_closed() {
        let scattered: Vec<Vec3> =
            (0..400).map(|i| Vec3::new((i * 37 % 101) as f32, (i * 53 % 97) as f32, (i * 71 % 89) as f32)).collect();
        for radius in [3.0, 9.0, 20.0, 200.0] {
            for threshold in [0.0, 0.3, 1.1, 2.0] {
                let mesh = surface(&scattered, radius, threshold, radius / 3.0);
                assert!(is_closed(&mesh.triangles, mesh.positions.len()), "{radius} {threshold}");
                assert_eq!(mesh.cell, radius / 3.0);
            }
        }
        let empty = surface(&scattered, 9.0, 1.0e3, 3.0);
        assert!(empty.positions.is_empty() && empty.triangles.is_empty());
    }

    #[test]
    fn too_fine_cells_are_made_coarser() {
        let mesh = surface(&[Vec3::ZERO, Vec3::splat(100.0)], 50.0, 0.2, 0.01);
        assert!(mesh.cell > 0.01 && !mesh.triangles.is_empty());
        assert!(is_closed(&mesh.triangles, mesh.positions.len()));
        assert!(surface(&[Vec3::ZERO], 0.0, 0.2, 0.1).triangles.is_empty());
        assert!(surface(&[Vec3::ZERO], 1.0, 0.2, f32::NAN).triangles.is_empty());
    }
}
