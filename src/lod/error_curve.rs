//! How wrong crosses are, over their size in the image: measured, and what levels are chosen by.
//!
//! The error is the root mean square of linear light before black over what the tree covers, relative to the full model's
//! mean luminance, against the full model with 64 samples a pixel in the same light: four sides and above, three suns,
//! three given trees (benchmark `levels`, part `errors`; docs/measurements/levels-of-detail.md). A full model with the four
//! samples of a pixel has an error too, which grows as its leaves get smaller than pixels. What counts is how much more
//! error crosses have:
//!
//! | size, pixels | crosses | full models | more |
//! |--:|--:|--:|--:|
//! | 512 | 0.532 | 0.268 | 0.264 |
//! | 256 | 0.468 | 0.296 | 0.172 |
//! | 128 | 0.387 | 0.324 | 0.063 |
//! | 64 | 0.339 | 0.366 | none |
//!
//! Below 64 pixels a cross is nearer to the truth than the model. Between the two, simplified models and billboard clouds have
//! more error than crosses at every size, and cost more: they are not chosen.

use super::level_distance::{NOMINAL_FIELD_OF_VIEW, NOMINAL_HEIGHT};

/// Height of a tree in the image up to which crosses are no worse than full models, pixels.
const NO_WORSE: f32 = 64.0;
/// What crosses have more of error at 2, 4 and 8 times that size.
const MORE: [f32; 3] = [0.063, 0.172, 0.264];
/// The largest size that is told apart, pixels.
const LARGEST: f32 = 65_536.0;
/// Height in pixels of the images for which distances of levels by error are stated.
const NOMINAL_PIXELS: f32 = 1080.0;

/// Focal length in pixels of a camera with the nominal field of view and 1080 rows.
pub fn nominal_focal_length() -> f32 {
    0.5 * NOMINAL_PIXELS / (0.5 * NOMINAL_FIELD_OF_VIEW).tan()
}

/// Height in the image in pixels, up to which trees are drawn as crosses if these may have `tolerance` more error than full
/// models: 64 and more. What is not a number counts as 0.
pub fn largest_cross(tolerance: f32) -> f32 {
    let mut before = 0.0;
    for (octave, more) in MORE.into_iter().enumerate() {
        if tolerance < more {
            let within = ((tolerance - before) / (more - before)).max(0.0);
            return NO_WORSE * (octave as f32 + within).exp2();
        }
        before = more;
    }
    if tolerance.is_nan() {
        return NO_WORSE;
    }
    // Beyond the measured sizes the last octave goes on.
    let octaves = MORE.len() as f32 + (tolerance - before) / (MORE[2] - MORE[1]);
    (NO_WORSE * octaves.exp2()).min(LARGEST)
}

/// Distance in metres from which on trees of the nominal height are drawn as crosses, in an image of 1080 rows.
pub fn cross_distance(tolerance: f32) -> f32 {
    NOMINAL_HEIGHT * nominal_focal_length() / largest_cross(tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_those_of_the_table() {
        for (tolerance, size) in [(0.0, 64.0), (0.063, 128.0), (0.172, 256.0), (0.264, 512.0), (0.356, 1024.0)] {
            assert!((largest_cross(tolerance) / size - 1.0).abs() < 1e-3, "{tolerance}: {}", largest_cross(tolerance));
        }
        assert!((cross_distance(0.172) - 90.5).abs() < 0.5, "{}", cross_distance(0.172));
    }

    #[test]
    fn any_tolerance_has_a_size_and_more_tolerance_larger_crosses() {
        let mut last = 0.0;
        for tolerance in [f32::NEG_INFINITY, -1.0, 0.0, 1e-9, 0.05, 0.1, 0.2, 0.5, 1.0, 1000.0, f32::INFINITY] {
            let size = largest_cross(tolerance);
            assert!((NO_WORSE..=LARGEST).contains(&size) && size >= last, "{tolerance}: {size}");
            last = size;
        }
        assert_eq!(largest_cross(f32::NAN), NO_WORSE);
    }
}
