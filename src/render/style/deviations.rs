//! How wide the Gaussians of a style are, and how coarse the maps may be into which they blur.

use crate::style::Style;

/// Standard deviations of the Gaussians for one style, pixels of a picture of 720 lines.
pub struct Deviations {
    /// Of the layers' shapes.
    pub shapes: f32,
    /// Of light and of colours.
    pub lights: f32,
    /// Of the light around.
    pub wide: f32,
    /// Of normals.
    pub normals: f32,
    /// Of dabs.
    pub dabs: f32,
}

impl Deviations {
    /// Those of `style`.
    pub fn of(style: &Style) -> Self {
        match style {
            Style::Watercolour(w) => {
                let s = w.simplification;
                Self { shapes: s, lights: 0.6 * s, wide: 3.0 * s, normals: 0.6 * s, dabs: 0.3 * s }
            }
            Style::Lines(l) => {
                let s = l.simplification;
                Self { shapes: 0.0, lights: s, wide: 0.0, normals: s, dabs: 0.0 }
            }
            Style::Toon(_) => Self { shapes: 0.0, lights: 1.6, wide: 0.0, normals: 1.2, dabs: 0.0 },
            Style::Photograph => Self { shapes: 0.0, lights: 0.0, wide: 0.0, normals: 0.0, dabs: 0.0 },
        }
    }
}

/// How many texels of a map along a side become one where it is blurred by a Gaussian of `deviation` texels: what a coarser map lacks
/// is not in the blurred one either.
pub fn divisor(deviation: f32) -> u32 {
    match deviation {
        d if d >= 4.0 => 4,
        d if d >= 2.0 => 2,
        _ => 1,
    }
}

/// The points at which a Gaussian is taken: every texel up to three standard deviations, and at most [`MOST_POINTS`] on either side, which then
/// lie farther apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Points {
    /// From one to the next, in texels; at least 1.
    pub texels: f32,
    /// The same in standard deviations.
    pub deviations: f32,
    /// On either side; 0 where nothing is blurred.
    pub reach: i32,
}

/// The most points on either side of a Gaussian's middle. Maps are looked up between two points, identifiers at each.
pub const MOST_POINTS: i32 = 16;

impl Points {
    /// Those of a Gaussian of `deviation` texels, of which `most` are on either side.
    pub fn of(deviation: f32, most: i32) -> Self {
        // Not so for what is not a number either.
        if deviation > LEAST {
            let deviation = deviation.min(GREATEST);
            let texels = (REACH * deviation / most as f32).max(1.0);
            let reach = (REACH * deviation / texels).ceil().min(most as f32);
            Self { texels, deviations: texels / deviation, reach: reach as i32 }
        } else {
            Self { texels: 1.0, deviations: 0.0, reach: 0 }
        }
    }
}

/// Standard deviations from the middle of a Gaussian to its last point.
const REACH: f32 = 3.0;
/// Deviations in texels: of less, the next texel has no weight; more than any map has.
const LEAST: f32 = 0.1;
const GREATEST: f32 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_a_gaussian_are_texels_up_to_three_deviations() {
        assert_eq!(Points::of(1.5, 16), Points { texels: 1.0, deviations: 1.0 / 1.5, reach: 5 });
        assert_eq!(Points::of(16.0, 16), Points { texels: 3.0, deviations: 3.0 / 16.0, reach: 16 });
        for nothing in [0.0, 1e-20, -1.0, f32::NAN] {
            assert_eq!(Points::of(nothing, 16), Points { texels: 1.0, deviations: 0.0, reach: 0 });
        }
        for deviation in [0.11, 0.3, 5.34, 1e9, f32::INFINITY] {
            let points = Points::of(deviation, 8);
            assert!(
                points.texels.is_finite() && points.deviations.is_finite() && (1..=8).contains(&points.reach),
                "{points:?}"
            );
        }
    }

    #[test]
    fn maps_are_coarser_only_where_the_gaussian_hides_it() {
        assert_eq!([0.0, 1.9, 2.0, 3.9, 4.0, 100.0, f32::NAN].map(divisor), [1, 1, 2, 2, 4, 4, 1]);
    }
}
