//! Clusters the pieces of a plant into planes.
//!
//! Both methods are iterations of [Lloyd 1982] that minimise a sum over all pieces, weighted with their area: each piece
//! goes to the plane that costs it least, then each plane is fitted to its pieces.
//!
//! [`Clustering::KMeans`] is the publication's [Franzke 2005, 4.3.1, after Behrendt 2004; compare Huang et al. 2004,
//! "Improved Billboard Clouds"]: a plane passes through the centre of its pieces, with their mean normal; the cost is
//! the squared distance from the centre, and the angle between the normals.
//!
//! [`Clustering::KPlanes`] measures what is done to the picture. A piece at the centre c with the second moment S costs
//!
//! ```text
//!   (n·(c - o))²  +  tilt nᵀ S n  +  reach² |c - o - n (n·(c - o))|²
//! ```
//!
//! for a plane of normal n through o: how far it moves, how much of it is lost as it is laid into the plane, and how far
//! it lies from the others. Without the last term planes become slices through the whole crown: these move leaves least,
//! but are large and mostly empty, so they take many texels and fragments. The best o is the mean of the centres, and
//! the best n the eigenvector of the smallest eigenvalue of a 3 × 3 matrix, so both steps are exact and the cost never
//! rises.

use glam::{Mat3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::items::{Item, outer};
use crate::math::hash::unit_f32;

/// How pieces are clustered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Clustering {
    /// As published: k-means over positions and normals.
    KMeans,
    /// By the displacement and tilt of each piece. Nearer to the model (`docs/measurements/levels-of-detail.md`).
    #[default]
    KPlanes,
}

/// A plane and its pieces.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cluster {
    /// Mean of the pieces' centres.
    pub center: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Indices of the pieces, ascending; at least one.
    pub items: Vec<u32>,
}

/// Weight of a piece's tilt against its displacement.
const TILT: f32 = 2.0;
/// Weight of the distance within a plane against the displacement.
const REACH: f32 = 0.35;
/// Metres, as a fraction of the plant's size, that a right angle between normals counts as, in the published method.
const RIGHT_ANGLE: f32 = 0.15;
/// Iterations at most.
const ROUNDS: usize = 24;

/// Clusters `items` into at most `count` planes. The result does not depend on the number of threads.
pub(super) fn cluster(items: &[Item], count: usize, method: Clustering) -> Vec<Cluster> {
    let count = count.clamp(1, items.len().max(1));
    if items.is_empty() {
        return Vec::new();
    }
    let metric = Metric::new(items, method);
    let mut planes = metric.seeds(items, count);
    let mut assigned: Vec<(u32, f32)> = Vec::new();
    for _ in 0..ROUNDS {
        let nearest: Vec<(u32, f32)> = items.par_iter().map(|item| metric.nearest(item, &planes)).collect();
        let moved = nearest.iter().zip(&assigned).filter(|(new, old)| new.0 != old.0).count();
        let settled = !assigned.is_empty() && moved * 1000 < items.len();
        assigned = nearest;
        if settled {
            break;
        }
        metric.fit(items, &mut assigned, &mut planes);
    }
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); planes.len()];
    for (index, (plane, _)) in assigned.iter().enumerate() {
        members[*plane as usize].push(index as u32);
    }
    let cluster = |(plane, items): (Plane, Vec<u32>)| Cluster { center: plane.center, normal: plane.normal, items };
    planes.into_iter().zip(members).filter(|(_, items)| !items.is_empty()).map(cluster).collect()
}

#[derive(Clone, Copy, Debug)]
struct Plane {
    center: Vec3,
    normal: Vec3,
}

/// The cost of a piece in a plane.
struct Metric {
    method: Clustering,
    /// Square metres that a right angle counts as.
    right_angle: f32,
}

impl Metric {
    fn new(items: &[Item], method: Clustering) -> Self {
        let low = items.iter().fold(Vec3::INFINITY, |low, item| low.min(item.center));
        let high = items.iter().fold(Vec3::NEG_INFINITY, |high, item| high.max(item.center));
        Self { method, right_angle: (RIGHT_ANGLE * (high - low).length()).powi(2) }
    }

    fn cost(&self, item: &Item, plane: &Plane) -> f32 {
        let offset = item.center - plane.center;
        match self.method {
            Clustering::KMeans => {
                offset.length_squared() + self.right_angle * (1.0 - item.normal.dot(plane.normal).abs())
            }
            Clustering::KPlanes => {
                let away = offset.dot(plane.normal).powi(2);
                let within = (offset.length_squared() - away).max(0.0);
                away + TILT * plane.normal.dot(item.spread * plane.normal) + REACH * REACH * within
            }
        }
    }

    /// The plane of the least cost, the first of several.
    fn nearest(&self, item: &Item, planes: &[Plane]) -> (u32, f32) {
        let mut best = (0, f32::INFINITY);
        for (index, plane) in planes.iter().enumerate() {
            let cost = self.cost(item, plane);
            if cost < best.1 {
                best = (index as u32, cost);
            }
        }
        best
    }

    /// The first planes: each in a piece that is chosen at random with the weight of its cost in those chosen before it
    /// [Arthur & Vassilvitskii 2007, "k-means++"].
    fn seeds(&self, items: &[Item], count: usize) -> Vec<Plane> {
        let mut costs = vec![f32::INFINITY; items.len()];
        let mut planes: Vec<Plane> = Vec::with_capacity(count);
        for index in 0..count {
            let weight = |(item, cost): (&Item, &f32)| f64::from(item.area) * f64::from(cost.min(1e6));
            let total: f64 = items.iter().zip(&costs).map(weight).sum();
            let mut left = f64::from(unit_f32(0, index as u64, 0xc10d_u64)) * total;
            let chosen = items.iter().zip(&costs).position(|pair| {
                left -= weight(pair);
                left < 0.0
            });
            let item = &items[chosen.unwrap_or(0)];
            let plane = Plane { center: item.center, normal: item.normal };
            planes.push(plane);
            costs.par_iter_mut().zip(items).for_each(|(cost, item)| *cost = cost.min(self.cost(item, &plane)));
        }
        planes
    }

    /// Fits each plane to its pieces. A plane without any takes the piece that costs most.
    fn fit(&self, items: &[Item], assigned: &mut [(u32, f32)], planes: &mut [Plane]) {
        let mut area = vec![0.0f32; planes.len()];
        let mut moment = vec![Vec3::ZERO; planes.len()];
        for (item, (plane, _)) in items.iter().zip(assigned.iter()) {
            area[*plane as usize] += item.area;
            moment[*plane as usize] += item.area * item.center;
        }
        for empty in (0..planes.len()).filter(|plane| area[*plane] <= 0.0) {
            let cost = |index: &usize| items[*index].area * assigned[*index].1;
            let Some(worst) = (0..items.len()).max_by(|a, b| cost(a).total_cmp(&cost(b))) else { return };
            let item = &items[worst];
            planes[empty] = Plane { center: item.center, normal: item.normal };
            assigned[worst].1 = 0.0;
        }
        let mut spread = vec![Mat3::ZERO; planes.len()];
        for (item, (index, _)) in items.iter().zip(assigned.iter()) {
            let index = *index as usize;
            let offset = item.center - moment[index] / area[index];
            spread[index] += item.area
                * match self.method {
                    Clustering::KMeans => outer(item.normal),
                    Clustering::KPlanes => (1.0 - REACH * REACH) * outer(offset) + TILT * item.spread,
                };
        }
        for (index, plane) in planes.iter_mut().enumerate().filter(|(index, _)| area[*index] > 0.0) {
            plane.center = moment[index] / area[index];
            let axes = principal_axes(spread[index]);
            plane.normal = match self.method {
                // The mean of directions without a sign.
                Clustering::KMeans => axes[2],
                Clustering::KPlanes => axes[0],
            };
        }
    }
}

/// The eigenvectors of a symmetric matrix, that of the smallest eigenvalue first: unit vectors at right angles
/// [Jacobi 1846].
fn principal_axes(matrix: Mat3) -> [Vec3; 3] {
    let mut a = matrix.to_cols_array_2d();
    let mut axes = Mat3::IDENTITY.to_cols_array_2d();
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q].abs() <= f32::EPSILON * (a[p][p].abs() + a[q][q].abs()) {
                continue;
            }
            let theta = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
            let tangent = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let cos = (tangent * tangent + 1.0).sqrt().recip();
            let sin = tangent * cos;
            for row in &mut a {
                (row[p], row[q]) = (cos * row[p] - sin * row[q], sin * row[p] + cos * row[q]);
            }
            let (rows_p, rows_q) = (a[p], a[q]);
            for column in 0..3 {
                a[p][column] = cos * rows_p[column] - sin * rows_q[column];
                a[q][column] = sin * rows_p[column] + cos * rows_q[column];
            }
            let (axis_p, axis_q) = (axes[p], axes[q]);
            for row in 0..3 {
                axes[p][row] = cos * axis_p[row] - sin * axis_q[row];
                axes[q][row] = sin * axis_p[row] + cos * axis_q[row];
            }
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|i: &usize, j: &usize| a[*i][*i].total_cmp(&a[*j][*j]));
    order.map(|i| Vec3::from_array(axes[i]).normalize_or(Vec3::Y))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn card(center: Vec3, normal: Vec3) -> Item {
        let spread = 0.01 * (Mat3::IDENTITY + -1.0 * outer(normal));
        Item { part: 0, triangles: vec![0], center, normal, area: 0.1, spread }
    }

    #[test]
    fn axes_are_those_of_the_matrix() {
        let directions = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(-2.0, 1.0, 0.0), Vec3::new(-3.0, -6.0, 5.0)];
        let directions = directions.map(Vec3::normalize);
        let matrix = 3.0 * outer(directions[0]) + 0.5 * outer(directions[1]) + 7.0 * outer(directions[2]);
        let axes = principal_axes(matrix);
        for (axis, expected) in axes.iter().zip([directions[1], directions[0], directions[2]]) {
            assert!(axis.dot(expected).abs() > 0.9999, "{axis} {expected}");
        }
        assert!(principal_axes(Mat3::ZERO).iter().all(|axis| axis.is_finite() && axis.length() > 0.99));
    }

    #[test]
    fn two_sheets_of_leaves_become_two_planes_on_any_number_of_threads() {
        let sheet = |height: f32, normal: Vec3| {
            (0..200).map(move |i| {
                let (x, z) = ((i % 20) as f32 * 0.1, (i / 20) as f32 * 0.1);
                card(Vec3::new(x, height + 0.02 * (i % 3) as f32, z), normal)
            })
        };
        let items: Vec<Item> = sheet(0.0, Vec3::Y).chain(sheet(3.0, Vec3::NEG_Y)).collect();
        for method in [Clustering::KMeans, Clustering::KPlanes] {
            let on = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
                pool.install(|| cluster(&items, 2, method))
            };
            let clusters = on(1);
            assert_eq!(clusters, on(3));
            assert_eq!(clusters.len(), 2);
            for cluster in &clusters {
                assert_eq!(cluster.items.len(), 200);
                assert!(cluster.normal.y.abs() > 0.99, "{method:?}: {}", cluster.normal);
            }
        }
    }

    #[test]
    fn more_planes_than_pieces_are_no_more_planes() {
        let items = [card(Vec3::ZERO, Vec3::X), card(Vec3::ONE, Vec3::Y)];
        assert!(cluster(&items, 100, Clustering::KPlanes).len() <= 2);
        assert!(cluster(&[], 10, Clustering::KMeans).is_empty());
    }
}
