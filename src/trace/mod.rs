//! Rays against one plant's own triangles: what the bakes and the ground truth have in common.
//!
//! [`PlantTracer`] owns a bounding volume hierarchy over the plant (crate `obvhs`: the eight-wide tree of [Ylitie et
//! al. 2017], built by parallel locally-ordered clustering, [Benthin et al. 2022]) and answers two questions, each
//! with the alpha test of foliage at the resolution of its texture: what does a ray meet first, and does it meet
//! anything. Triangles are met from both sides.
//!
//! # How well it holds
//! - Edges: the test of [Woop, Benthin & Wald 2013], watertight. A ray through the inside of a closed mesh never slips
//!   out between two triangles that share the edge's vertices. The tree's boxes are wider than their triangles by more
//!   than their own rounding errors.
//! - Sizes: everything is traced scaled by a power of two (which rounds nothing) to a size that suits the tree's own
//!   constants, so a plant of a millimetre and one of ten kilometres are met alike.
//! - Rays that start far away are first moved to the plant's box, so that their error is that of the box.
//! - Triangles with vertices that are not finite, indices out of range or no area are left out, and so are copies of a
//!   triangle in its place. Rays that are not
//!   finite, or without direction, meet nothing.
//!
//! Where tens of thousands of points ask in the same direction, [`ParallelTracer`] answers all of them at once.
//!
//! Starting points on a surface come from [`SurfacePoint::leave`], or from [`offset_origin`] where only a position is
//! known.

mod intersect;
mod offset;
mod parallel;
mod tracer;

use glam::{Vec2, Vec3};

pub(crate) use offset::leave;
pub use offset::offset_origin;
pub use parallel::{LineCrossing, ParallelTracer};
pub use tracer::PlantTracer;

use crate::plant::PartKind;

/// A ray in the plant's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts, metres.
    pub origin: Vec3,
    /// Where it goes, unit length.
    pub direction: Vec3,
    /// How far it goes, metres; may be infinite. Nothing is met at or beyond it, nor at or before 0.
    pub t_max: f32,
}

/// Where a ray meets a plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the ray's origin, metres, above 0 and below its `t_max`.
    pub t: f32,
    /// Which part of the plant.
    pub part: u32,
    /// Place in the part's `triangles`.
    pub triangle: u32,
    /// Barycentric weight of the triangle's second corner, 0..1.
    pub u: f32,
    /// Barycentric weight of the triangle's third corner, 0..1.
    pub v: f32,
    /// Whether the ray came from the front: the side from which the corners run counter-clockwise.
    pub front: bool,
}

/// A plant's surface at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Where, metres.
    pub position: Vec3,
    /// How far from the triangle `position` may be by rounding, metres: what a starting ray must be moved by.
    pub error: f32,
    /// Unit normal of the triangle, on its front side.
    pub geometric_normal: Vec3,
    /// Unit normal interpolated from the vertices, turned to the front side; the triangle's where they cancel out.
    pub shading_normal: Vec3,
    /// Texture coordinate.
    pub uv: Vec2,
    /// Linear base colour: texture times factor, the albedo of diffuse reflection, 0..1.
    pub base_color: Vec3,
    /// Linear colour of diffuse transmission, base colour included, 0..1; zero for wood.
    pub transmission: Vec3,
    /// Wood or foliage.
    pub kind: PartKind,
}

impl SurfacePoint {
    /// Where a ray in `direction` starts that leaves this surface, on the side it goes to, without meeting it again:
    /// outside the position's error bound (as [Pharr, Jakob & Humphreys 2023, 6.8.6]), which follows from the
    /// triangle's own corners and so suits plants of any size.
    pub fn leave(&self, direction: Vec3) -> Vec3 {
        leave(self.position, self.geometric_normal, self.error, direction)
    }
}
