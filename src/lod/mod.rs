//! Levels of detail: which representation of a tree is drawn at which distance, and how one replaces another.
//!
//! A level of detail is a [`Representation`] in a list, [`Levels`], ordered by distance. Today's list is the full model
//! near the camera and crossed billboards far away [Franzke 2005, 4.3.3]. Between two neighbours of the list lies a
//! [`FadeBand`]: there both are drawn, with moving thresholds of their alpha tests. The farther one fades in over the
//! first half of the band, the nearer one fades out over the second half, so that the crown is never thinner than one
//! whole representation. A tree changes as a whole, by the distance of its foot and by its size: see
//! [`level_distance`].
//!
//! The functions here are the CPU twin of `shaders/forest/instance.wgsl`.

pub mod error_curve;
mod fade_band;
pub mod level_distance;
mod levels;

pub use fade_band::{FADE_SPAN, FadeBand, GONE, WHOLE};
pub use levels::{Levels, MAX_LEVELS, Representation};
