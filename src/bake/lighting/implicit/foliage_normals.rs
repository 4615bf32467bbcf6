//! Normals of the foliage realigned to the shape of the crown [Luft 2007, 3.3].
//!
//! As published a vertex takes the normal of the nearest *vertex* of the implicit surface, found exactly. Between
//! lobes of the crown the nearest vertex jumps, and the normal with it. The smooth variant uses the field itself: the
//! direction of steepest descent,
//!
//! ```text
//!   N = normalize(g(ρ) + g(3 ρ))        g(r) = -r grad F_r / F_r
//! ```
//!
//! The logarithm's slope does not depend on how dense the crown is. Deep inside, where leaves are evenly distributed,
//! the narrow field's gradient vanishes and only noise remains; the field of three times the radius still senses the
//! outline from there. Where both vanish (in the very centre of a symmetric crown) there is no outward direction, and
//! the leaf keeps its own normal.

use glam::Vec3;
use rayon::prelude::*;

use super::density::{DensityField, FieldSample};
use super::isosurface::SurfaceMesh;
use super::partition::{self, Aabb, Node};

/// Radius of the wide field of the smooth variant, in radii.
const WIDE: f32 = 3.0;
/// A slope of the logarithm below this a radius is rounding.
const FLAT: f32 = 1.0e-4;
/// Points of a group of the search.
const GROUP: usize = 8;

/// Points that can be asked for the nearest one.
struct Nearest {
    order: Vec<(Vec3, u32)>,
    nodes: Vec<Node>,
}

impl Nearest {
    fn new(points: &[Vec3]) -> Self {
        let order = partition::compact_order(points, GROUP);
        let nodes = partition::tree(&order, GROUP);
        Self { order, nodes }
    }

    /// The square of the distance to the nearest point, and its index; of equally near ones the first. `best` is any
    /// point, as near as can be guessed.
    fn find(&self, from: Vec3, mut best: (f32, u32)) -> (f32, u32) {
        let here = Aabb { min: from.into(), max: from.into() };
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            if node.bounds.distances_squared(&here).0 > best.0 {
                at = node.next as usize;
                continue;
            }
            if node.group != Node::INNER {
                for (point, index) in self.order.iter().skip(node.group as usize * GROUP).take(GROUP) {
                    let square = point.distance_squared(from);
                    if square < best.0 || square == best.0 && *index < best.1 {
                        best = (square, *index);
                    }
                }
            }
            at += 1;
        }
        best
    }
}

/// For each of `points` (metres) the normal of the nearest vertex of `surface`; `None` where the point is not finite
/// or the surface is empty.
pub fn nearest_vertex_normals(points: &[Vec3], surface: &SurfaceMesh) -> Vec<Option<Vec3>> {
    let normal = |vertex: Option<u32>| surface.normals.get(vertex? as usize).copied();
    nearest_vertices(points, &surface.positions).into_iter().map(normal).collect()
}

/// For each of `points` (metres) the index of the nearest of `vertices`; `None` where the point is not finite or there are none.
pub fn nearest_vertices(points: &[Vec3], vertices: &[Vec3]) -> Vec<Option<u32>> {
    /// Neighbours that are searched for in turn, each starting from the last one's result.
    const RUN: usize = 256;
    let mut all = vec![None; points.len()];
    let nearest = Nearest::new(vertices);
    if nearest.order.is_empty() {
        return all;
    }
    let order = partition::compact_order(points, GROUP);
    let found: Vec<u32> = order
        .par_chunks(RUN)
        .flat_map_iter(|run| {
            let mut last = nearest.order[0].1;
            run.iter()
                .map(|(point, _)| {
                    let guess = vertices[last as usize].distance_squared(*point);
                    last = nearest.find(*point, (guess, last)).1;
                    last
                })
                .collect::<Vec<_>>()
        })
        .collect();
    for ((_, index), vertex) in order.iter().zip(found) {
        all[*index as usize] = Some(vertex);
    }
    all
}

/// For each of `points` (metres), at which `field` has the `samples`, the outward direction of the smooth variant;
/// `None` where the field is level.
pub fn gradient_normals(points: &[Vec3], samples: &[FieldSample], field: &DensityField) -> Vec<Option<Vec3>> {
    let wide = field.with_radius(WIDE * field.radius());
    let around = wide.samples(points);
    samples
        .par_iter()
        .zip(&around)
        .map(|(near, far)| {
            let slope = outward(near, field.radius()) + outward(far, wide.radius());
            if slope.length() > FLAT { slope.try_normalize() } else { None }
        })
        .collect()
}

/// How steeply the logarithm of the field falls, a radius; zero where there is no field.
fn outward(sample: &FieldSample, radius: f32) -> Vec3 {
    let slope = -(sample.gradient * radius) / sample.value;
    if slope.is_finite() { slope } else { Vec3::ZERO }
}

/// A linear blend between the realigned normal and a share (0..=1) of the leaf's own [Luft 2007, 3.3]; both are unit
/// vectors, and so is the result. A leaf has two sides and its normal may be stored for either, so it is first flipped
/// to the side of the realigned one. A share of 1 gives the leaf's own normal as it is stored. Where there is no
/// realigned normal, or the blend has no length, one of the two is left.
pub fn blend(own: Vec3, realigned: Option<Vec3>, own_share: f32) -> Vec3 {
    let Some(realigned) = realigned.filter(|_| own_share < 1.0) else { return own };
    let facing = if own.dot(realigned) < 0.0 { -own } else { own };
    let sum = own_share * facing + (1.0 - own_share) * realigned;
    if sum.length_squared() > 1.0e-8 { sum.try_normalize().unwrap_or(realigned) } else { realigned }
}

#[cfg(test)]
mod tests {
    use super::super::generators::{Generator, Weighting};
    use super::*;

    /// Points that fill the unit cube evenly: multiples of powers of the plastic number's kin [Roberts 2018, R3].
    fn scattered(count: u32, seed: u32) -> Vec<Vec3> {
        let steps = glam::DVec3::new(0.819_172_513_396, 0.671_043_606_704, 0.549_700_477_902);
        (0..count).map(|i| (f64::from(i + 1000 * seed) * steps).fract().as_vec3()).collect()
    }

    #[test]
    fn the_nearest_vertex_is_that_of_a_search_through_all() {
        let mut positions = scattered(500, 1);
        positions.extend_from_within(..50);
        // Each vertex is known again by its normal.
        let normals = (0..positions.len()).map(|i| Vec3::new(i as f32, 0.0, 0.0)).collect();
        let surface = SurfaceMesh { positions, normals, triangles: Vec::new() };
        let mut points = scattered(700, 7);
        points[9] = Vec3::NAN;
        let found = nearest_vertex_normals(&points, &surface);
        for (point, found) in points.iter().zip(&found) {
            let all = surface.positions.iter().map(|p| p.distance_squared(*point)).enumerate();
            let expected = all.filter(|(_, d)| d.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i as f32);
            assert_eq!(found.map(|n| n.x), expected);
        }
        assert_eq!(nearest_vertex_normals(&points[..2], &SurfaceMesh::default()), [None, None]);
    }

    #[test]
    fn the_gradient_points_outward_even_in_an_even_crown() {
        let generators: Vec<Generator> = scattered(20_000, 3)
            .into_iter()
            .map(|p| Generator { position: 2.0 * p - 1.0, area: 1.0, primitives: 1.0 })
            .filter(|g| g.position.length() < 1.0)
            .collect();
        let field = DensityField::new(&generators, 0.2, Weighting::Primitives);
        let points: Vec<Vec3> = scattered(300, 5).into_iter().map(|p| 1.6 * p - 0.8).collect();
        let normals = gradient_normals(&points, &field.samples(&points), &field);
        let cosines: Vec<f32> = points
            .iter()
            .zip(normals)
            .filter(|(point, _)| point.length() > 0.6)
            .map(|(point, normal)| normal.map_or(-1.0, |n| n.dot(point.normalize())))
            .collect();
        assert!(cosines.iter().sum::<f32>() / cosines.len() as f32 > 0.93);
        let one = DensityField::new(&generators[..1], 0.2, Weighting::Primitives);
        let middle = [generators[0].position, Vec3::splat(9.0), Vec3::NAN];
        assert_eq!(gradient_normals(&middle, &one.samples(&middle), &one), [None; 3]);
    }

    #[test]
    fn blends_are_units() {
        let (x, y) = (Vec3::X, Vec3::Y);
        assert_eq!(blend(x, Some(y), 0.0), y);
        assert_eq!(blend(x, Some(y), 1.0), x);
        assert!((blend(x, Some(y), 0.5) - Vec3::new(0.5, 0.5, 0.0).normalize()).length() < 1e-6);
        assert_eq!(blend(x, Some(-x), 0.5), -x);
        assert_eq!(blend(x, None, 0.5), x);
    }

    #[test]
    fn a_leaf_is_blended_by_the_side_that_faces_outward() {
        let outward = Vec3::new(0.36, 0.48, 0.8);
        for own in scattered(200, 2).into_iter().filter_map(|p| (2.0 * p - 1.0).try_normalize()) {
            for share in [0.0, 0.25, 0.5, 0.9, 0.999] {
                let blended = blend(own, Some(outward), share);
                assert!(
                    (blended - blend(-own, Some(outward), share)).length() < 1e-6,
                    "the stored side does not count"
                );
                // Between the two, so never farther from the crown's normal than the leaf's own is.
                assert!(blended.dot(outward) >= own.dot(outward).abs() - 1e-6);
            }
            assert_eq!(blend(own, Some(outward), 1.0), own);
            assert_eq!(blend(-own, Some(outward), 1.0), -own);
        }
    }
}
