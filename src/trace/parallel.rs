//! All rays of one direction at once: from many points, which crossings does the line through each of them have?
//!
//! Looked at along the direction, a line is a point and the plant is flat. The points are sorted into a grid once a
//! direction, and each triangle is tested against those in its cells: the irregular z-buffer [Johnson et al. 2005,
//! "The Irregular Z-Buffer"; Aila & Laine 2004, "Alias-Free Shadow Maps"]. Unlike a shadow map it samples exactly where
//! it is asked, and one pass serves the direction and its opposite. For the tens of thousands of vertices of a plant it
//! is some ten times faster than a tree of boxes, ray by ray (`benches/transfer.rs`).
//!
//! Edges hold as those of the rays do: each edge has a sign that both triangles at it compute from the same two
//! products; a line that runs exactly through an edge or corner crosses every triangle there. Positions are taken
//! around the middle of the plant in double precision and scaled by a power of two, so neither a plant's size nor its
//! position matters; they are rounded to some 5e-8 of its extent, which is the error of `t` too.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};

use super::{Hit, PlantTracer};

/// Lines tested in one go.
const LANES: usize = 8;

/// Most cells along one side of the grid.
const MOST_CELLS: usize = 1024;

/// Points through which lines go, and the plant they go through.
pub struct ParallelTracer<'a> {
    tracer: &'a PlantTracer,
    /// In the tracer's order, scaled, around the middle of the plant.
    corners: Vec<[Vec3; 3]>,
    /// The points, likewise.
    points: Vec<Vec3>,
}

/// Where the line through a point crosses a triangle.
#[derive(Clone, Copy, Debug)]
pub struct LineCrossing {
    /// Which point, in the order in which they were given.
    pub point: u32,
    /// How far from the point along the direction, metres; negative on the other side of it.
    pub t: f32,
    /// Barycentric weight of the triangle's second corner, 0..1.
    pub u: f32,
    /// Barycentric weight of the triangle's third corner, 0..1.
    pub v: f32,
    /// In the tracer's order.
    triangle: u32,
    /// Whether the triangle's front looks against the direction.
    facing: bool,
}

/// The points as seen along one direction, sorted into the cells of a grid, row by row.
struct Grid {
    low: [f32; 2],
    cells_per_unit: f32,
    side: usize,
    /// Where each cell's points start; one entry more than there are cells.
    starts: Vec<u32>,
    /// Followed by `LANES` values that are not numbers.
    x: Vec<f32>,
    y: Vec<f32>,
    depth: Vec<f32>,
    /// Which point.
    of: Vec<u32>,
}

impl Grid {
    fn new(projected: &[Vec3]) -> Self {
        let finite = || projected.iter().filter(|p| p.is_finite());
        let low = finite().fold(Vec3::INFINITY, |low, p| low.min(*p));
        let high = finite().fold(Vec3::NEG_INFINITY, |high, p| high.max(*p));
        let side = projected.len().isqrt().clamp(1, MOST_CELLS);
        let extent = (high - low).truncate().max_element();
        // The factor keeps the highest point inside the last cell.
        let cells_per_unit = if extent > 0.0 && extent.is_finite() { 0.999 * side as f32 / extent } else { 0.0 };
        let low = [low.x, low.y];
        let mut grid = Self {
            low,
            cells_per_unit,
            side,
            starts: vec![0; side * side + 1],
            x: vec![f32::NAN; projected.len() + LANES],
            y: vec![f32::NAN; projected.len() + LANES],
            depth: vec![f32::NAN; projected.len() + LANES],
            of: vec![0; projected.len()],
        };
        let cells: Vec<u32> = projected
            .iter()
            .map(|p| if p.is_finite() { (grid.cell(1, p.y) * side + grid.cell(0, p.x)) as u32 } else { u32::MAX })
            .collect();
        for &cell in cells.iter().filter(|cell| **cell != u32::MAX) {
            grid.starts[cell as usize + 1] += 1;
        }
        for cell in 0..side * side {
            grid.starts[cell + 1] += grid.starts[cell];
        }
        let mut next = grid.starts.clone();
        for (of, (p, &cell)) in projected.iter().zip(&cells).enumerate().filter(|(_, (_, cell))| **cell != u32::MAX) {
            let slot = next[cell as usize] as usize;
            next[cell as usize] += 1;
            (grid.x[slot], grid.y[slot], grid.depth[slot], grid.of[slot]) = (p.x, p.y, p.z, of as u32);
        }
        grid
    }

    /// The cell, along one axis, in which a coordinate lies; the nearest one for what lies outside.
    fn cell(&self, axis: usize, value: f32) -> usize {
        // Casts of negative numbers give zero.
        (((value - self.low[axis]) * self.cells_per_unit) as usize).min(self.side - 1)
    }

    /// Which of the `LANES` points from `start` on lie inside a triangle, edges included; one bit each.
    #[inline(always)]
    fn inside(&self, start: usize, a: Vec3, b: Vec3, c: Vec3) -> u32 {
        let (x, y) = (&self.x[start..start + LANES], &self.y[start..start + LANES]);
        let mut inside = [0u32; LANES];
        for lane in 0..LANES {
            let [wa, wb, wc] = weights(a, b, c, x[lane], y[lane]);
            let front = (wa >= 0.0) & (wb >= 0.0) & (wc >= 0.0);
            let back = (wa <= 0.0) & (wb <= 0.0) & (wc <= 0.0);
            inside[lane] = u32::from(front | back) << lane;
        }
        inside.iter().fold(0, |all, lane| all | lane)
    }
}

impl PlantTracer {
    /// Prepares lines through `points` (metres, in the plant's frame). Points that are not finite have no crossings.
    pub fn parallel(&self, points: impl Iterator<Item = Vec3>) -> ParallelTracer<'_> {
        let middle = self.bounds.map_or(DVec3::ZERO, |b| 0.5 * (b.min.as_dvec3() + b.max.as_dvec3()));
        let scale = f64::from(self.scale);
        let around = |p: DVec3| ((p - middle) * scale).as_vec3();
        let corners =
            self.corners.iter().map(|corners| corners.map(|p| around(Vec3::from(p).as_dvec3() / scale))).collect();
        ParallelTracer { tracer: self, corners, points: points.map(|p| around(p.as_dvec3())).collect() }
    }
}

impl ParallelTracer<'_> {
    /// Tells `visit` the crossings of the lines through the points in the unit vector `direction`, in both senses,
    /// before the alpha test ([`ParallelTracer::covers`]): of each point all, or as many until `visit` answers that it
    /// needs no more of that point. In the same order whatever the thread; no order of depth. A triangle of a point's
    /// own is crossed at `t` near 0.
    pub fn crossings(&self, direction: Vec3, mut visit: impl FnMut(LineCrossing) -> ControlFlow<()>) {
        let Some(along) = direction.try_normalize() else { return };
        let right = along.any_orthonormal_vector();
        let up = along.cross(right);
        let project = |p: Vec3| Vec3::new(p.dot(right), p.dot(up), p.dot(along));
        let projected: Vec<Vec3> = self.points.iter().map(|p| project(*p)).collect();
        let mut grid = Grid::new(&projected);
        if grid.starts[grid.side * grid.side] == 0 {
            return;
        }
        let metres = 1.0 / self.tracer.scale;
        for (triangle, corners) in self.corners.iter().enumerate() {
            let [a, b, c] = corners.map(project);
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            let (left, right) = (grid.cell(0, low.x), grid.cell(0, high.x));
            for row in grid.cell(1, low.y)..=grid.cell(1, high.y) {
                let first = grid.starts[row * grid.side + left] as usize;
                let end = grid.starts[row * grid.side + right + 1] as usize;
                for start in (first..end).step_by(LANES) {
                    let mut inside = grid.inside(start, a, b, c) & lanes_below(end - start);
                    while inside != 0 {
                        let slot = start + inside.trailing_zeros() as usize;
                        inside &= inside - 1;
                        let [wa, wb, wc] = weights(a, b, c, grid.x[slot], grid.y[slot]);
                        let sum = wa + wb + wc;
                        if sum == 0.0 {
                            continue;
                        }
                        let inverse = 1.0 / sum;
                        let depth = (wa * a.z + wb * b.z + wc * c.z) * inverse;
                        let crossing = LineCrossing {
                            point: grid.of[slot],
                            t: (depth - grid.depth[slot]) * metres,
                            u: wb * inverse,
                            v: wc * inverse,
                            triangle: triangle as u32,
                            facing: sum < 0.0,
                        };
                        if visit(crossing).is_break() {
                            // Inside no triangle any more.
                            grid.x[slot] = f32::NAN;
                        }
                    }
                }
            }
        }
    }

    /// Whether the triangle is there at the crossing: its alpha test.
    pub fn covers(&self, crossing: &LineCrossing) -> bool {
        self.tracer.passes(crossing.triangle as usize, crossing.u, crossing.v)
    }

    /// What a ray from the point would have met there; `against`: a ray against the direction.
    pub fn hit(&self, crossing: &LineCrossing, against: bool) -> Hit {
        let (part, triangle) = self.tracer.source(crossing.triangle as usize);
        let &LineCrossing { t, u, v, facing, .. } = crossing;
        Hit { t: t.abs(), part, triangle, u, v, front: facing != against }
    }
}

/// Bits of the lanes below `count`.
fn lanes_below(count: usize) -> u32 {
    if count >= LANES { u32::MAX } else { (1 << count) - 1 }
}

/// The corners' barycentric weights at a point of the plane, times twice the area, signed.
#[inline(always)]
fn weights(a: Vec3, b: Vec3, c: Vec3, x: f32, y: f32) -> [f32; 3] {
    let (ax, ay) = (a.x - x, a.y - y);
    let (bx, by) = (b.x - x, b.y - y);
    let (cx, cy) = (c.x - x, c.y - y);
    [bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx]
}
