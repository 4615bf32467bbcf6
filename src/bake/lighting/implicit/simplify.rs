//! A lighter surface: edges collapsed in the order of their quadric error [Garland & Heckbert 1997].
//!
//! An edge is collapsed only where the mesh stays what it was, closed and manifold (the ends have two neighbours in
//! common, the link condition of [Dey et al. 1999]), and where no triangle turns over. So a lobe of its own ends as a
//! tetrahedron at the least, and a target below that is not reached.
//!
//! [`COARSE_SHARE`] and [`FINE_SHARE`] are what the two trees of [Luft 2006, table 1] were drawn with.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::{DMat3, DVec3, Vec3};

/// Triangles of the surface as a share of the foliage's: the coarser tree of [Luft 2006, table 1], 6.2 %.
pub const COARSE_SHARE: f32 = 0.062;
/// Triangles of the surface as a share of the foliage's: the finer tree of [Luft 2006, table 1], 16.9 %.
pub const FINE_SHARE: f32 = 0.169;

/// Sum of squared distances to planes, as a function of the point.
#[derive(Clone, Copy)]
struct Quadric {
    matrix: DMat3,
    vector: DVec3,
    constant: f64,
}

impl Quadric {
    const ZERO: Self = Self { matrix: DMat3::ZERO, vector: DVec3::ZERO, constant: 0.0 };

    /// The plane of a triangle, weighted by its area.
    fn of_triangle([a, b, c]: [DVec3; 3]) -> Self {
        let cross = (b - a).cross(c - a);
        let Some(normal) = cross.try_normalize() else { return Self::ZERO };
        let (weight, offset) = (0.5 * cross.length(), -normal.dot(a));
        let scaled = weight * normal;
        Self {
            matrix: DMat3::from_cols(scaled * normal.x, scaled * normal.y, scaled * normal.z),
            vector: scaled * offset,
            constant: weight * offset * offset,
        }
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            matrix: self.matrix + other.matrix,
            vector: self.vector + other.vector,
            constant: self.constant + other.constant,
        }
    }

    fn at(&self, p: DVec3) -> f64 {
        (p.dot(self.matrix * p) + 2.0 * self.vector.dot(p) + self.constant).max(0.0)
    }
}

struct Mesh {
    positions: Vec<DVec3>,
    quadrics: Vec<Quadric>,
    faces: Vec<[u32; 3]>,
    alive: Vec<bool>,
    /// Faces around each vertex.
    around: Vec<Vec<u32>>,
    /// How often each vertex was moved: a collapse that was weighed before is out of date.
    stamps: Vec<u32>,
}

/// A possible collapse: cost (the bits of a number that is not negative order as the number), ends, their stamps.
type Candidate = Reverse<(u64, u32, u32, u32, u32)>;

/// The mesh with at most `target` triangles, or as near to it as it gets. The mesh must be closed and manifold, as
/// [`extract`](super::isosurface::extract) makes it; so is the result.
pub(super) fn simplify(positions: &[Vec3], triangles: &[[u32; 3]], target: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    if triangles.len() <= target || positions.is_empty() {
        return (positions.to_vec(), triangles.to_vec());
    }
    let origin = positions[0].as_dvec3();
    let mut mesh = Mesh::new(positions.iter().map(|p| p.as_dvec3() - origin).collect(), triangles.to_vec());
    mesh.collapse_to(target);

    let mut points = vec![u32::MAX; positions.len()];
    let mut kept = Vec::new();
    let mut faces = Vec::new();
    for (face, _) in mesh.faces.iter().zip(&mesh.alive).filter(|(_, alive)| **alive) {
        faces.push(face.map(|v| {
            let point = &mut points[v as usize];
            if *point == u32::MAX {
                *point = kept.len() as u32;
                kept.push((mesh.positions[v as usize] + origin).as_vec3());
            }
            *point
        }));
    }
    (kept, faces)
}

impl Mesh {
    fn new(positions: Vec<DVec3>, faces: Vec<[u32; 3]>) -> Self {
        let mut quadrics = vec![Quadric::ZERO; positions.len()];
        let mut around = vec![Vec::new(); positions.len()];
        for (index, face) in faces.iter().enumerate() {
            let quadric = Quadric::of_triangle(face.map(|v| positions[v as usize]));
            for &v in face {
                quadrics[v as usize] = quadrics[v as usize].plus(&quadric);
                around[v as usize].push(index as u32);
            }
        }
        let (alive, stamps) = (vec![true; faces.len()], vec![0; positions.len()]);
        Self { positions, quadrics, faces, alive, around, stamps }
    }

    fn collapse_to(&mut self, target: usize) {
        let mut left = self.faces.len();
        let mut heap: BinaryHeap<Candidate> = BinaryHeap::new();
        for face in &self.faces {
            for (a, b) in [(face[0], face[1]), (face[1], face[2]), (face[2], face[0])] {
                // Each edge has two faces that run along it in opposite directions.
                if a < b {
                    heap.push(self.candidate(a, b));
                }
            }
        }
        while left > target {
            let Some(Reverse((_, a, b, stamp_a, stamp_b))) = heap.pop() else { break };
            if (self.stamps[a as usize], self.stamps[b as usize]) != (stamp_a, stamp_b) {
                continue;
            }
            let (point, _) = self.best_point(a, b);
            if !self.may_collapse(a, b, point) {
                continue;
            }
            self.collapse(a, b, point);
            left -= 2;
            for other in self.neighbours(a) {
                heap.push(self.candidate(a.min(other), a.max(other)));
            }
        }
    }

    fn candidate(&self, a: u32, b: u32) -> Candidate {
        let (_, cost) = self.best_point(a, b);
        Reverse((cost.to_bits(), a, b, self.stamps[a as usize], self.stamps[b as usize]))
    }

    /// Where the vertex of a collapsed edge goes, and the quadric error there.
    fn best_point(&self, a: u32, b: u32) -> (DVec3, f64) {
        let (pa, pb) = (self.positions[a as usize], self.positions[b as usize]);
        let quadric = self.quadrics[a as usize].plus(&self.quadrics[b as usize]);
        let (middle, length) = (0.5 * (pa + pb), pa.distance(pb));
        let matrix = quadric.matrix;
        let trace = matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z;
        // In a flat or folded neighbourhood the least error lies anywhere along a plane or a line.
        if matrix.determinant() > 1.0e-5 * trace.powi(3) {
            let best = matrix.inverse() * -quadric.vector;
            if best.distance(middle) <= length {
                return (best, quadric.at(best));
            }
        }
        let mut best = (middle, quadric.at(middle));
        for point in [pa, pb] {
            let cost = quadric.at(point);
            if cost < best.1 {
                best = (point, cost);
            }
        }
        best
    }

    /// The vertices that share an edge with `v`, ascending.
    fn neighbours(&self, v: u32) -> Vec<u32> {
        let faces = self.around[v as usize].iter().map(|&face| self.faces[face as usize]);
        let mut found: Vec<u32> = faces.flatten().filter(|&other| other != v).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    fn may_collapse(&self, a: u32, b: u32, point: DVec3) -> bool {
        let (of_a, of_b) = (self.neighbours(a), self.neighbours(b));
        let common = of_a.iter().filter(|v| of_b.binary_search(v).is_ok()).count();
        // Two ends of three neighbours each are two corners of a tetrahedron.
        if common != 2 || of_a.len() + of_b.len() <= 6 {
            return false;
        }
        [(a, b), (b, a)].iter().all(|&(end, other)| {
            let faces = self.around[end as usize].iter().map(|&face| self.faces[face as usize]);
            faces.filter(|face| !face.contains(&other)).all(|face| {
                let normal = |[p, q, r]: [DVec3; 3]| (q - p).cross(r - p);
                let before = normal(face.map(|v| self.positions[v as usize]));
                let after = normal(face.map(|v| if v == end { point } else { self.positions[v as usize] }));
                before.dot(after) > 0.2 * before.length() * after.length()
            })
        })
    }

    /// Moves `a` to `point` and merges `b` into it.
    fn collapse(&mut self, a: u32, b: u32, point: DVec3) {
        self.positions[a as usize] = point;
        self.quadrics[a as usize] = self.quadrics[a as usize].plus(&self.quadrics[b as usize]);
        for face in std::mem::take(&mut self.around[b as usize]) {
            let corners = &mut self.faces[face as usize];
            if corners.contains(&a) {
                self.alive[face as usize] = false;
                for v in *corners {
                    self.around[v as usize].retain(|&other| other != face);
                }
            } else {
                corners.iter_mut().filter(|v| **v == b).for_each(|v| *v = a);
                self.around[a as usize].push(face);
            }
        }
        self.stamps[a as usize] += 1;
        self.stamps[b as usize] += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::super::isosurface::tests::{ball, is_closed};
    use super::*;

    #[test]
    fn a_ball_stays_closed_and_round_with_a_tenth_of_its_triangles() {
        let (mesh, radius) = ball();
        let target = mesh.triangles.len() / 10;
        let (positions, triangles) = simplify(&mesh.positions, &mesh.triangles, target);
        assert!(triangles.len() <= target && triangles.len() + 2 > target);
        assert!(is_closed(&triangles, positions.len()));
        for p in &positions {
            assert!((p.length() / radius - 1.0).abs() < 0.05, "{}", p.length() / radius);
        }
        let (positions, triangles) = simplify(&mesh.positions, &mesh.triangles, 0);
        assert!(is_closed(&triangles, positions.len()) && triangles.len() >= 4 && triangles.len() < 40);
        assert_eq!(simplify(&[], &[], 0), (Vec::new(), Vec::new()));
    }
}
