//! Measures of images: how far a level of detail is from the full model. Knows images and numbers only.

mod cutout;

pub use cutout::{Cutout, LevelError};
