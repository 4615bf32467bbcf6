//! The ground truth: a path tracer on the processor, over the same scene as the renderer.
//!
//! ```text
//! plants, instances, ground --> ReferenceScene --.
//!                                                 +-> PathTracer --> Film: OpenEXR, picture, checkpoint
//! LightState --> Light --------------------------'       |
//!                                                        '-> radiance of single points
//! ```
//!
//! What the renderer approximates is followed here ray by ray: the shadows of every leaf, of the relief and of the sun's
//! disc, the light of the sky between the leaves, the light that leaves pass on to each other, without an ambient term
//! and without levels of detail. What the renderer *states* is the same: meshes, alpha tests, base colours, transmission
//! and tints, the heights of the ground, the picture of the sky, the key light, exposure, and, on demand, the fog.
//!
//! # How true it is
//! - Unbiased for what it models, up to rounding, as long as `limit` and `bounces` are left alone; noise falls with the
//!   root of the samples or faster.
//! - Surfaces are diffuse, and leaves glossy on both sides: for all light, about each leaf's own normal. No gloss of bark, no
//!   normal maps. Light passes a leaf where it hits it.
//! - Interpolated normals of wood lose a little light (see [`Normals`]).
//! - The ground is met as the smooth surface, where the renderer draws triangles of it; detail in its normal is left
//!   out. Rays look for it to a set distance and see the sky's picture beyond.
//! - Light is not scattered by the air between surfaces. Stars are left out.

mod boxes;
mod bsdf;
mod camera;
mod checkpoint;
mod error;
mod film;
mod fog;
mod ground;
mod light;
mod lobe;
mod path;
mod picture;
mod points;
mod sampler;
mod scene;
mod sky;
mod soil;

pub use camera::{Camera, WorldRay};
pub use error::ReferenceError;
pub use film::{Film, Shot};
pub use fog::Fog;
pub use ground::GroundShape;
pub use light::{Disc, Light, VisibleDisc};
pub use path::{PathTracer, TraceSettings};
pub use picture::{Development, ToneTable};
pub use points::SurfaceSample;
pub use scene::{Ground, GroundColor, Instance, Normals, ReferenceScene};
pub use sky::Environment;
pub use soil::Soil;
