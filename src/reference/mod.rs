//! The ground truth: a path tracer on the CPU, for the same scenes as the renderer.
//!
//! ```text
//! plants, instances, ground --> ReferenceScene --.
//!                                                 +-> PathTracer --> Film: OpenEXR, image, checkpoint
//! LightState --> Light --------------------------'       |
//!                                                        '-> radiance of single points
//! ```
//!
//! It traces ray by ray what the renderer approximates: the shadows of every leaf and of the relief, the penumbra of
//! the sun's disc, skylight between the leaves, and light that leaves scatter to each other, without an ambient term
//! and without levels of detail. The inputs are the same: meshes, alpha tests, base colours, transmission and tints,
//! the heights of the ground, the sky texture, the key light, exposure, and, on request, the fog.
//!
//! # Accuracy
//! - Unbiased for what it models, up to rounding, unless `limit` or `bounces` are set. Noise falls with the square root
//!   of the number of samples or faster.
//! - Surfaces are diffuse; leaves are also glossy on both sides, for all light, about each leaf's own normal. Bark has
//!   no gloss, and there are no normal maps. Light leaves a leaf at the point where it enters it.
//! - Interpolated normals of wood keep even light, and sunlight in the mean over all sides of a trunk: with six sides it
//!   is 2 % too dark in front and 2 % too bright aside (see [`Normals`]).
//! - Against Mitsuba 3 no mean of an image differs by more than its noise, mostly 0.3 to 1 %
//!   (`docs/measurements/independent-check.md`).
//! - The ground is the smooth surface of which the renderer draws triangles, without the detail of its normal. Rays
//!   find it up to a set distance and see the sky texture beyond.
//! - The air between surfaces does not scatter light. There are no stars.

mod boxes;
mod bsdf;
mod camera;
mod checkpoint;
mod display;
mod error;
mod film;
mod fog;
mod ground;
mod leaf;
mod light;
mod lobe;
mod path;
mod points;
mod sampler;
mod scene;
mod sky;
mod soil;

pub use camera::{Camera, WorldRay};
pub use checkpoint::KeptFilm;
pub use display::{DisplayTransform, ToneTable};
pub use error::ReferenceError;
pub use film::{Film, Shot};
pub use fog::Fog;
pub use ground::GroundShape;
pub use leaf::LeafModel;
pub use light::{Disc, Light, VisibleDisc};
pub use path::{PathTracer, TraceSettings};
pub use points::SurfaceSample;
pub use scene::{Ground, GroundColor, Instance, Normals, ReferenceScene};
pub use sky::Environment;
pub use soil::Soil;
