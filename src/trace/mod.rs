//! Ray tracing against the triangles of one plant, for the bakes and for the ground truth.
//!
//! [`PlantTracer`] owns a bounding volume hierarchy over the plant (crate `obvhs`: the eight-wide tree of [Ylitie et
//! al. 2017], built by parallel locally-ordered clustering, [Benthin et al. 2022]) and finds the first hit of a
//! ray, or whether it hits anything. Both apply the alpha test of foliage at the resolution of its texture, and both
//! see triangles from either side.
//!
//! # Robustness
//! - Edges: the test of [Woop, Benthin & Wald 2013], watertight. A ray through the inside of a closed mesh never slips
//!   out between two triangles that share the edge's vertices. The tree's boxes are wider than their triangles by more
//!   than their own rounding errors.
//! - Sizes: plants are scaled by a power of two (which rounds nothing) to a size that suits the tree's constants, so a
//!   plant of a millimetre works as well as one of ten kilometres.
//! - Rays that start far away are first moved to the plant's box, so that their error is that of the box.
//! - Triangles with vertices that are not finite, indices out of range or no area are left out, and so are duplicates
//!   of a triangle. Rays that are not finite, or have no direction, hit nothing.
//!
//! For tens of thousands of points and one direction, [`ParallelTracer`] traces all rays at once.
//!
//! Ray origins on a surface come from [`SurfacePoint::leave`], or from [`offset_origin`] where only a position is
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
    /// Origin, metres.
    pub origin: Vec3,
    /// Direction, unit length.
    pub direction: Vec3,
    /// Maximum distance, metres; may be infinite. Hits lie strictly between 0 and this distance.
    pub t_max: f32,
}

/// The point at which a ray hits a plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the ray's origin, metres, above 0 and below its `t_max`.
    pub t: f32,
    /// Index of the plant's part.
    pub part: u32,
    /// Index in the part's `triangles`.
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
    /// Position, metres.
    pub position: Vec3,
    /// Bound of the rounding error of `position`, metres: the offset that a ray needs to leave the triangle.
    pub error: f32,
    /// Unit normal of the triangle, on its front side.
    pub geometric_normal: Vec3,
    /// Unit normal interpolated from the vertices, flipped to the front side; the triangle's own where they cancel out.
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
    /// Origin for a ray that leaves this surface in `direction`, such that it does not hit the surface again: outside
    /// the position's error bound on the side of `direction` (as [Pharr, Jakob & Humphreys 2023, 6.8.6]), which follows
    /// from the triangle's own corners and so suits plants of any size.
    pub fn leave(&self, direction: Vec3) -> Vec3 {
        leave(self.position, self.geometric_normal, self.error, direction)
    }
}
