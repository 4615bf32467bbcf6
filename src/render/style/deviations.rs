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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_coarser_only_where_the_gaussian_hides_it() {
        assert_eq!([0.0, 1.9, 2.0, 3.9, 4.0, 100.0, f32::NAN].map(divisor), [1, 1, 2, 2, 4, 4, 1]);
    }
}
