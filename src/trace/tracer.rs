//! The tree over one plant's triangles, and the two questions.

use std::collections::HashSet;
use std::sync::Arc;
use std::time::Duration;

use glam::{DVec3, Vec2, Vec3};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray as TreeRay, RayHit};
use obvhs::{Boundable, BvhBuildParams};

use super::intersect::Shear;
use super::{Hit, Ray, SurfacePoint};
use crate::plant::{Bounds, PartKind, Plant, geometry, surface::Surface};

/// Size (longest extent) to which the plant is scaled for the tree, which takes everything nearer than 1e-4 as touched.
const TREE_SIZE: f64 = 1024.0;

/// Rounding error that the boxes allow for, as a share of the largest coordinate: eight units in the last place.
const PADDING: f32 = 1e-6;

/// Bound of an interpolated position's error as a share of the largest coordinate of the triangle: the interpolation
/// and the test of the next ray round some eight times together.
const ERROR: f32 = 8.0 * f32::EPSILON;

/// A plant that rays can be traced against. See the module's page.
pub struct PlantTracer {
    plant: Arc<Plant>,
    surfaces: Vec<Surface>,
    tree: CwBvh,
    /// In the tree's order and scale.
    pub(super) corners: Vec<[[f32; 3]; 3]>,
    /// In the tree's order.
    sources: Vec<Source>,
    /// Of the triangles in the tree, metres; `None` without triangles.
    pub(super) bounds: Option<Bounds>,
    /// From metres to the tree's scale; a power of two.
    pub(super) scale: f32,
}

/// Where a triangle of the tree comes from.
#[derive(Clone, Copy)]
struct Source {
    part: u32,
    triangle: u32,
    /// Texture coordinate of the first corner, and the two edges from it.
    uv: [Vec2; 3],
    /// Whether its part has an alpha test to pass.
    tested: bool,
}

/// A triangle's box, a little too large.
struct Padded(Aabb);

impl Boundable for Padded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl PlantTracer {
    /// Builds the tree: some 0.1 s for a plant of 60,000 triangles. Deterministic.
    pub fn new(plant: &Arc<Plant>) -> Self {
        let surfaces: Vec<Surface> = plant.parts.iter().map(Surface::new).collect();
        let mut bounds: Option<Bounds> = None;
        let mut found = Vec::new();
        let mut seen = HashSet::new();
        for (part_index, part) in plant.parts.iter().enumerate() {
            let mesh = &part.mesh;
            for (triangle, corners) in geometry::triangles(mesh) {
                let positions = corners.map(|c| mesh.positions[c]);
                let [a, b, c] = positions.map(Vec3::as_dvec3);
                // In f64 products of any two lengths are neither infinite nor zero.
                if (b - a).cross(c - a) == DVec3::ZERO {
                    continue;
                }
                let uvs = corners.map(|c| mesh.uvs[c]);
                // Copies in place can never be met first, and the clustering is quadratic in them.
                let bits = positions.map(|p| p.to_array().map(f32::to_bits));
                if !seen.insert((part_index, bits, uvs.map(|uv| uv.to_array().map(f32::to_bits)))) {
                    continue;
                }
                for position in positions {
                    let b = bounds.get_or_insert(Bounds { min: position, max: position });
                    *b = Bounds { min: b.min.min(position), max: b.max.max(position) };
                }
                let [uv, uv1, uv2] = uvs;
                let tested = surfaces[part_index].is_tested();
                let source = Source { part: part_index as u32, triangle, uv: [uv, uv1 - uv, uv2 - uv], tested };
                found.push((positions, source));
            }
        }
        let scale = bounds.map_or(1.0, power_of_two_scale);
        let scaled: Vec<[[f32; 3]; 3]> =
            found.iter().map(|(positions, _)| positions.map(|p| (p * scale).to_array())).collect();
        let largest = scaled.iter().flatten().flatten().fold(0.0f32, |m, c| m.max(c.abs()));
        let padded: Vec<Padded> = scaled.iter().map(|corners| padded(corners, PADDING * largest)).collect();
        let tree = if padded.is_empty() {
            CwBvh::default()
        } else {
            build_cwbvh(&padded, BvhBuildParams::medium_build(), &mut Duration::default())
        };
        let order = || tree.primitive_indices.iter().map(|&index| index as usize);
        let corners = order().map(|index| scaled[index]).collect();
        let sources = order().map(|index| found[index].1).collect();
        Self { plant: plant.clone(), surfaces, tree, corners, sources, bounds, scale }
    }

    /// The first triangle along the ray that passes the alpha test. `None` where there is none, and for rays that are
    /// not finite or have no direction.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        let (tree_ray, shear, start) = self.enter(ray)?;
        let mut found = None;
        let mut record = RayHit::none();
        self.tree.ray_traverse(tree_ray, &mut record, |ray, index| match shear.cross(&self.corners[index], ray.tmax) {
            Some(crossing) if self.passes(index, crossing.u, crossing.v) => {
                found = Some((index, crossing));
                crossing.t
            }
            _ => f32::INFINITY,
        });
        let (index, crossing) = found?;
        let Source { part, triangle, .. } = self.sources[index];
        let [a, b, c] = self.corners[index].map(|p| Vec3::from(p).as_dvec3());
        let front = (b - a).cross(c - a).dot(ray.direction.as_dvec3()) < 0.0;
        Some(Hit { t: (start + crossing.t) / self.scale, part, triangle, u: crossing.u, v: crossing.v, front })
    }

    /// Whether the ray meets any triangle that passes the alpha test.
    pub fn occluded(&self, ray: &Ray) -> bool {
        let Some((tree_ray, shear, _)) = self.enter(ray) else { return false };
        !self.tree.ray_traverse_miss(tree_ray, |ray, index| match shear.cross(&self.corners[index], ray.tmax) {
            Some(crossing) if self.passes(index, crossing.u, crossing.v) => crossing.t,
            _ => f32::INFINITY,
        })
    }

    /// The surface where a ray has met this plant. A hit that is not of this plant gives the origin with a white
    /// base colour.
    pub fn point(&self, hit: &Hit) -> SurfacePoint {
        let nowhere = SurfacePoint {
            position: Vec3::ZERO,
            error: 0.0,
            geometric_normal: Vec3::Y,
            shading_normal: Vec3::Y,
            uv: Vec2::ZERO,
            base_color: Vec3::ONE,
            transmission: Vec3::ZERO,
            kind: PartKind::Wood,
        };
        let Some(part) = self.plant.parts.get(hit.part as usize) else { return nowhere };
        let mesh = &part.mesh;
        let Some(triangle) = mesh.triangles.get(hit.triangle as usize) else { return nowhere };
        let corners = triangle.map(|c| c as usize);
        let vertices = mesh.positions.len().min(mesh.normals.len()).min(mesh.uvs.len());
        if corners.iter().any(|&c| c >= vertices) {
            return nowhere;
        }
        let [a, b, c] = corners.map(|c| mesh.positions[c]);
        let [uv, uv1, uv2] = corners.map(|c| mesh.uvs[c]);
        let [n0, n1, n2] = corners.map(|c| mesh.normals[c]);
        let (da, db, dc) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
        let geometric_normal = (db - da).cross(dc - da).normalize_or(DVec3::Y).as_vec3();
        let blended = (n0 * (1.0 - hit.u - hit.v) + n1 * hit.u + n2 * hit.v).normalize_or(geometric_normal);
        let shading_normal = if blended.dot(geometric_normal) < 0.0 { -blended } else { blended };
        let uv = uv + (uv1 - uv) * hit.u + (uv2 - uv) * hit.v;
        let surface = &self.surfaces[hit.part as usize];
        let base_color = surface.color(uv);
        let transmission = match part.kind {
            PartKind::Wood => Vec3::ZERO,
            PartKind::Foliage => match surface.transmission(uv) {
                Some(given) => given.min(Vec3::ONE - base_color.clamp(Vec3::ZERO, Vec3::ONE)),
                None => part.material.transmitted(base_color),
            },
        };
        SurfacePoint {
            position: a + (b - a) * hit.u + (c - a) * hit.v,
            error: ERROR * a.abs().max(b.abs()).max(c.abs()).max_element(),
            geometric_normal,
            shading_normal,
            uv,
            base_color,
            transmission,
            kind: part.kind,
        }
    }

    /// The box around all triangles that can be met, or `None` where there are none.
    pub fn bounds(&self) -> Option<Bounds> {
        self.bounds
    }

    /// Whether a part's surface is there at a texture coordinate: its alpha test. False for a part that does not exist.
    pub fn covers(&self, part: u32, uv: Vec2) -> bool {
        self.surfaces.get(part as usize).is_some_and(|surface| surface.passes(uv))
    }

    /// The plant that was given.
    pub fn plant(&self) -> &Arc<Plant> {
        &self.plant
    }

    /// The part and the triangle in it that the triangle of the tree is.
    pub(super) fn source(&self, index: usize) -> (u32, u32) {
        (self.sources[index].part, self.sources[index].triangle)
    }

    /// Whether the triangle of the tree passes its alpha test at these barycentric weights.
    #[inline(always)]
    pub(super) fn passes(&self, index: usize, u: f32, v: f32) -> bool {
        let source = &self.sources[index];
        !source.tested || {
            let [uv, along_u, along_v] = source.uv;
            self.surfaces[source.part as usize].passes(uv + along_u * u + along_v * v)
        }
    }

    /// The ray in the tree's scale from where it enters the box, with how far that is in the tree's scale. `None`
    /// where it passes the box by.
    fn enter(&self, ray: &Ray) -> Option<(TreeRay, Shear, f32)> {
        let bounds = self.bounds?;
        let directed = ray.direction.is_finite() && ray.direction != Vec3::ZERO;
        if !directed || !ray.origin.is_finite() || ray.t_max.is_nan() || ray.t_max <= 0.0 {
            return None;
        }
        let (mut origin, mut start) = (ray.origin, 0.0);
        if origin.cmplt(bounds.min).any() || origin.cmpgt(bounds.max).any() {
            start = entry(&bounds, ray)?;
            if start >= ray.t_max {
                return None;
            }
            origin += ray.direction * start;
            if !origin.is_finite() {
                return None;
            }
        }
        let t_max = (ray.t_max - start) * self.scale;
        // Adding zero turns -0.0 into 0.0: the tree takes its inverse for negative and its sign for positive.
        let (origin, direction) = ((origin * self.scale).to_array(), (ray.direction + Vec3::ZERO).to_array());
        if !origin.iter().all(|c| c.is_finite()) {
            return None;
        }
        let tree_ray = TreeRay::new(origin.into(), direction.into(), 0.0, t_max);
        Some((tree_ray, Shear::new(origin, direction), start * self.scale))
    }
}

/// Where, in metres, a ray from outside reaches the box, a little too early; `None` where it passes it by.
fn entry(bounds: &Bounds, ray: &Ray) -> Option<f32> {
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let margin = 1e-5 * (bounds.max.as_dvec3() - bounds.min.as_dvec3()).max_element();
    let (mut near, mut far) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let low = f64::from(bounds.min[axis]) - margin - origin[axis];
        let high = f64::from(bounds.max[axis]) + margin - origin[axis];
        if direction[axis] == 0.0 {
            if low > 0.0 || high < 0.0 {
                return None;
            }
        } else {
            let (one, other) = (low / direction[axis], high / direction[axis]);
            near = near.max(one.min(other));
            far = far.min(one.max(other));
        }
    }
    (near <= far).then_some((near * (1.0 - 1e-6)) as f32)
}

/// The power of two that brings the longest extent to between half of [`TREE_SIZE`] and [`TREE_SIZE`].
fn power_of_two_scale(bounds: Bounds) -> f32 {
    let extent = (bounds.max.as_dvec3() - bounds.min.as_dvec3()).max_element();
    let exponent = (TREE_SIZE / extent).log2().floor().clamp(-126.0, 127.0);
    exponent.exp2() as f32
}

fn padded(corners: &[[f32; 3]; 3], padding: f32) -> Padded {
    let [a, b, c] = corners.map(Vec3::from);
    let pad = Vec3::splat(padding);
    let (low, high) = (a.min(b).min(c) - pad, a.max(b).max(c) + pad);
    Padded(Aabb::new(low.to_array().into(), high.to_array().into()))
}
