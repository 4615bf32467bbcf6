//! Measures of images, and what is made of many of them. Knows images and numbers only.
//!
//! | file | holds |
//! |---|---|
//! | [`picture`](Picture) | a picture in linear light, masks |
//! | [`flip`](flip()) | how different two pictures look |
//! | [`area`](by_area) | light, contrast and their places, so that another leaf is told from wrong light |
//! | [`comparison`](compare) | all measures of two pictures; changes between frames |
//! | [`cutout`](Cutout) | one object alone: how far a level of detail is from the full model |
//! | [`statistics`](Summary) | means, percentiles, intervals |
//! | [`front`](pareto_front) | the Pareto front of time against error, and its knee |
//! | [`magma`](magma()) | the colours of maps of errors |

mod area;
mod comparison;
mod cutout;
mod error;
mod flip;
mod front;
mod magma;
mod picture;
mod statistics;

pub use area::{AreaError, BLOCK, by_area};
pub use comparison::{Change, Compared, Comparison, ComparisonSettings, FILTERED, change, compare};
pub use cutout::{Cutout, LevelError};
pub use error::MeasureError;
pub use flip::{PIXELS_PER_DEGREE, flip};
pub use front::{knee, pareto_front};
pub use magma::magma;
pub use picture::{Light, Mask, Picture};
pub use statistics::{Interval, Summary, mean, percentile, sorted};
