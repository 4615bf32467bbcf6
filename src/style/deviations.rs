//! How wide the Gaussians of a style are, and how coarse the maps may be into which they blur.

use super::Style;

/// Lines of the picture for which lengths in pixels are stated.
pub const LINES: f32 = 720.0;
/// The most that [`Deviations::blur`] is.
const MOST_BLUR: f32 = 64.0;

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

/// Least deviation of the Gaussian of what has contours, over their width: what is smaller than a line is wide has no room for its outline.
const LINE_ROOM: f32 = 0.6;

impl Deviations {
    /// Those of `style`.
    pub fn of(style: &Style) -> Self {
        match style {
            Style::Watercolour(w) => {
                let s = w.simplification;
                Self { shapes: s, lights: 0.6 * s, wide: 3.0 * s, normals: 0.6 * s, dabs: 0.3 * s }
            }
            Style::Lines(l) => {
                let s = l.simplification.max(LINE_ROOM * l.width);
                Self { shapes: 0.0, lights: s, wide: 0.0, normals: s, dabs: 0.0 }
            }
            Style::Toon(t) => {
                let s = (LINE_ROOM * t.width).max(2.0);
                Self { shapes: 0.0, lights: s, wide: 0.0, normals: 0.7 * s, dabs: 0.0 }
            }
            Style::Photograph => Self { shapes: 0.0, lights: 0.0, wide: 0.0, normals: 0.0, dabs: 0.0 },
        }
    }

    /// How many pixels of a picture of `lines` lines become one in what is drawn with its Gaussians, at least 1: a Gaussian's width at half
    /// of its height.
    pub fn blur(&self, lines: f32) -> f32 {
        const WIDTH: f32 = 2.355;
        let pixels = WIDTH * self.shapes.max(self.lights) * lines / LINES;
        // What is not a number blurs nothing.
        if pixels > 1.0 { pixels.min(MOST_BLUR) } else { 1.0 }
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

/// Pixels of a picture of 720 lines that the least cell of the broad noises has: half of 22 (`shaders/style/noise_map.wgsl`).
const NOISE_CELL: f32 = 11.0;
/// Texels of a map of noise that a cell needs, so that what lies between texels is found by a bilinear lookup.
const TEXELS_PER_CELL: f32 = 5.0;

/// How many pixels along a side become one texel of the map of noise in a picture of `lines` lines.
pub fn noise_divisor(lines: u32) -> u32 {
    match NOISE_CELL * lines as f32 / LINES / TEXELS_PER_CELL {
        texels if texels >= 4.0 => 4,
        texels if texels >= 2.0 => 2,
        _ => 1,
    }
}

/// How far apart the points are at which a Gaussian is taken: a texel, or more where their number does not reach to three standard
/// deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spacing {
    /// In texels; at least 1.
    pub texels: f32,
    /// In standard deviations.
    pub deviations: f32,
}

/// Points on either side of a Gaussian's middle, of maps, which are looked up between two points. `POINTS` of `shaders/style/blur.wgsl`.
pub const MAP_POINTS: u32 = 10;
/// The same of identifiers, which are looked up at each point.
pub const IDENTITY_POINTS: u32 = 8;

impl Spacing {
    /// That of a Gaussian of `deviation` texels with so many points on either side.
    pub fn of(deviation: f32, points: u32) -> Self {
        // Not so for what is not a number either.
        if deviation > LEAST {
            let deviation = deviation.min(GREATEST);
            let texels = (REACH * deviation / points as f32).max(1.0);
            Self { texels, deviations: texels / deviation }
        } else {
            Self { texels: 1.0, deviations: 1.0 / LEAST }
        }
    }
}

/// The deviations of Gaussians that, one after the other, make one of `deviation` texels. Each has so many points on either side, the first
/// `first_points`, and is as wide as those may be that reach far: over what is unblurred a texel apart, over what is blurred already
/// (`SMOOTH_SPACING`) farther. Between points that are too far apart grain would be left.
///
/// `blurred` is the deviation of what the first one blurs. At least one deviation; at most [`MOST_STAGES`], of which the last takes what
/// is left.
pub fn stages(deviation: f32, blurred: f32, first_points: u32) -> Vec<f32> {
    // Not what is not a number either.
    let wanted = if deviation > 0.0 { deviation.min(GREATEST) } else { 0.0 };
    let (mut stages, mut reached) = (Vec::new(), 0.0_f32);
    loop {
        let points = if stages.is_empty() { first_points } else { MAP_POINTS };
        let widest = (SMOOTH_SPACING * reached.hypot(blurred)).max(1.0) * points as f32 / REACH;
        let left = (wanted * wanted - reached * reached).max(0.0).sqrt();
        if left <= widest || stages.len() + 1 == MOST_STAGES {
            stages.push(left);
            return stages;
        }
        stages.push(widest);
        reached = reached.hypot(widest);
    }
}

/// Most Gaussians that [`stages`] gives.
pub const MOST_STAGES: usize = 4;
/// Deviations of what is blurred between the points at which it is looked up: exp(-2 π² / 1.5²), below a thousandth, is left of its grain.
const SMOOTH_SPACING: f32 = 1.5;
/// Standard deviations from the middle of a Gaussian to its last point.
const REACH: f32 = 3.0;
/// Deviations in texels: of less, the next texel has no weight; more than any map has.
const LEAST: f32 = 0.1;
const GREATEST: f32 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::style::Watercolour;

    #[test]
    fn points_of_a_gaussian_are_texels_until_they_do_not_reach_far_enough() {
        assert_eq!(Spacing::of(1.5, 10), Spacing { texels: 1.0, deviations: 1.0 / 1.5 });
        assert_eq!(Spacing::of(20.0, 10), Spacing { texels: 6.0, deviations: 0.3 });
        for nothing in [0.0, 1e-20, -1.0, f32::NAN] {
            // The next point has a weight of exp(-50).
            assert_eq!(Spacing::of(nothing, 10), Spacing { texels: 1.0, deviations: 10.0 });
        }
        for deviation in [0.11, 0.3, 5.34, 1e9, f32::INFINITY] {
            let spacing = Spacing::of(deviation, 8);
            assert!(spacing.texels.is_finite() && (0.0..10.0).contains(&spacing.deviations), "{spacing:?}");
        }
    }

    #[test]
    fn wide_gaussians_are_made_of_several_without_gaps_between_their_points() {
        assert_eq!(stages(2.5, 0.0, IDENTITY_POINTS), [2.5]);
        for nothing in [0.0, -1.0, f32::NAN] {
            assert_eq!(stages(nothing, 0.0, MAP_POINTS), [0.0]);
        }
        for (deviation, blurred, first_points) in
            [(3.4, 0.0, 10), (20.0, 0.0, 8), (30.0, 6.0, 10), (114.0, 0.0, 8), (130.0, 0.0, 10)]
        {
            let (mut total, mut points) = (0.0_f32, first_points);
            let stages = stages(deviation, blurred, first_points);
            for stage in &stages {
                let spacing = Spacing::of(*stage, points).texels;
                assert!(spacing <= 1.001_f32.max(1.501 * total.hypot(blurred)), "{deviation}: {stages:?}");
                (total, points) = (total.hypot(*stage), MAP_POINTS);
            }
            assert!((total - deviation).abs() < 1e-3 * deviation, "{deviation}: {stages:?}");
        }
        assert_eq!(stages(f32::INFINITY, 0.0, 10).len(), MOST_STAGES);
    }

    #[test]
    fn a_style_blurs_as_many_pixels_as_its_gaussian_is_wide() {
        let watercolour = |simplification| Style::Watercolour(Watercolour { simplification, ..Watercolour::default() });
        let blur = |style: &Style, lines| Deviations::of(style).blur(lines);
        assert!((blur(&watercolour(2.5), 720.0) - 5.8875).abs() < 1e-4);
        assert!((blur(&watercolour(2.5), 360.0) - 2.94375).abs() < 1e-4);
        for nothing in [0.0, -1.0, f32::NAN, 1e-30] {
            assert_eq!(blur(&watercolour(nothing), 720.0), 1.0);
        }
        assert_eq!(blur(&watercolour(1e9), 720.0), MOST_BLUR);
        assert_eq!(blur(&Style::Photograph, 4096.0), 1.0);
    }

    #[test]
    fn maps_are_coarser_only_where_the_gaussian_hides_it() {
        assert_eq!([1, 360, 720, 1080, 4096].map(noise_divisor), [1, 1, 2, 2, 4]);
        assert_eq!([0.0, 1.9, 2.0, 3.9, 4.0, 100.0, f32::NAN].map(divisor), [1, 1, 2, 2, 4, 4, 1]);
    }
}
