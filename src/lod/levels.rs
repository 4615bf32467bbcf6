//! The list of representations of a forest.

use serde::Serialize;

use super::{FadeBand, GONE, WHOLE, error_curve, level_distance::NOMINAL_HEIGHT};

/// The most levels that a forest has.
pub const MAX_LEVELS: usize = 8;

/// Width of the fade between levels that are chosen by error, as a fraction of their distance.
const BAND: f32 = 0.3;
/// Width of the band in which trees give way to a surface, as a fraction of its distance.
const SURFACE_BAND: f32 = 0.6;

/// A way to draw a plant, by its name. The renderer has an implementation for each name that it knows
/// (`render::forest::Representations`); a program can add its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, bevy::reflect::Reflect)]
pub struct Representation(&'static str);

impl Representation {
    /// The full model.
    pub const MODEL: Self = Self("model");
    /// The full model with fewer and larger leaves [Cook et al. 2007].
    pub const THINNED: Self = Self("thinned");
    /// The implicit surface of the foliage [Luft 2006, 4.1], with the full model's wood: for styles.
    pub const SURFACE: Self = Self("surface");
    /// A billboard cloud [Franzke 2005, 4.3.1].
    pub const CLOUD: Self = Self("cloud");
    /// Crossed billboards [Franzke 2005, 4.3].
    pub const CROSS: Self = Self("cross");

    /// The representation with this name.
    pub const fn named(name: &'static str) -> Self {
        Self(name)
    }

    /// Its name.
    pub const fn name(self) -> &'static str {
        self.0
    }
}

/// The representations of a forest from near to far, and the fade bands between them. Never empty.
///
/// Reflection reaches the lists themselves, so it can break their order and lengths. The renderer draws
/// [sanitized](Self::sanitize) levels.
#[derive(Clone, Debug, PartialEq, bevy::reflect::Reflect)]
pub struct Levels {
    representations: Vec<Representation>,
    /// One less than the representations: `fades[i]` lies between `i` and `i + 1`.
    fades: Vec<FadeBand>,
    /// Whether distances grow with the number of pixels too.
    by_pixels: bool,
    /// Where trees give way to the surface of the forest, for an image with 1080 rows.
    surface: Option<FadeBand>,
}

impl Levels {
    /// One representation at every distance.
    pub fn only(representation: Representation) -> Self {
        Self { representations: vec![representation], fades: Vec::new(), by_pixels: false, surface: None }
    }

    /// Full models that give way to crossed billboards over `fade`.
    pub fn model_and_cross(fade: FadeBand) -> Self {
        Self::only(Representation::MODEL).then(fade, Representation::CROSS)
    }

    /// Full models, and crosses where these have at most `tolerance` more error, in whatever size of image: see
    /// [`error_curve`](super::error_curve). 0: where they have none. The bands of these levels are those of an image with
    /// 1080 rows.
    pub fn by_error(tolerance: f32) -> Self {
        let distance = error_curve::cross_distance(tolerance);
        // The band's middle is where the error is what is tolerated.
        let band = FadeBand::new(distance * (1.0 - 0.5 * BAND), distance * BAND);
        Self { by_pixels: true, ..Self::model_and_cross(band) }
    }

    /// The same levels up to where a tree is `pixels` high in the image, whatever its size: beyond, no tree is drawn, and the ground
    /// shows the forest as a surface ([`Ground::forest_surface`](crate::render::components::Ground::forest_surface)). 0 and less: trees
    /// are drawn however small.
    #[must_use]
    pub fn to_size(mut self, pixels: f32) -> Self {
        self.surface = surface_band(pixels);
        self.sanitize();
        self
    }

    /// The levels in a view: `zoom` is its focal length over that of the nominal field of view, `focal_pixels` its focal
    /// length in pixels.
    #[must_use]
    pub fn in_view(&self, zoom: f32, focal_pixels: f32) -> Self {
        let mut levels = self.scaled(self.view_factor(zoom, focal_pixels));
        let pixels = focal_pixels / error_curve::nominal_focal_length();
        levels.surface = self.surface.map(|fade| fade.scaled(pixels));
        levels.sanitize();
        levels
    }

    /// The same levels in a picture in which as many as `blur` pixels become one: trees give way to the surface of the forest that many
    /// times sooner, but not before their last level begins. Values below 1, and what is not a number, change nothing.
    #[must_use]
    pub fn blurred(mut self, blur: f32) -> Self {
        self.surface = self.surface.map(|fade| fade.scaled(blur.max(1.0).recip()));
        self.sanitize();
        self
    }

    /// The factor on the distances in such a view.
    pub fn view_factor(&self, zoom: f32, focal_pixels: f32) -> f32 {
        if self.by_pixels { focal_pixels / error_curve::nominal_focal_length() } else { zoom }
    }

    /// Beyond `fade`, `representation`. A band that begins before the one in front of it ends is moved behind it, so
    /// that at most two representations overlap. Beyond [`MAX_LEVELS`] the list stays as it is.
    #[must_use]
    pub fn then(mut self, fade: FadeBand, representation: Representation) -> Self {
        if self.representations.len() < MAX_LEVELS {
            let earliest = self.fades.last().map_or(0.0, |before| before.end);
            let start = fade.start.max(earliest);
            self.fades.push(FadeBand { start, end: fade.end.max(start) });
            self.representations.push(representation);
        }
        self
    }

    /// Restores what [`then`](Self::then) guarantees: 1 to [`MAX_LEVELS`] representations, a band between each two
    /// neighbours, and no band that begins before the one in front of it ends. Levels that were built by the functions
    /// of this type stay as they are.
    pub fn sanitize(&mut self) {
        if self.representations.is_empty() {
            self.representations.push(Representation::MODEL);
        }
        self.representations.truncate(MAX_LEVELS.min(self.fades.len() + 1));
        self.fades.truncate(self.representations.len() - 1);
        let mut earliest = 0.0f32;
        for fade in &mut self.fades {
            // `max` also replaces values that are not numbers.
            fade.start = fade.start.max(earliest);
            fade.end = fade.end.max(fade.start);
            earliest = fade.end;
        }
        if let Some(surface) = &mut self.surface {
            surface.start = surface.start.max(earliest);
            surface.end = surface.end.max(surface.start);
        }
    }

    /// The same levels at `factor` times the distances. A factor that is not a positive number changes nothing.
    fn scaled(&self, factor: f32) -> Self {
        let mut levels = self.clone();
        if factor.is_finite() && factor > 0.0 {
            levels.fades.iter_mut().for_each(|fade| *fade = fade.scaled(factor));
        }
        levels
    }

    /// The representations, from near to far.
    pub fn representations(&self) -> &[Representation] {
        &self.representations
    }

    /// Number of levels, at least 1.
    #[expect(clippy::len_without_is_empty, reason = "a list of levels is never empty")]
    pub fn len(&self) -> usize {
        self.representations.len()
    }

    /// The band over which `level` fades in; `None` for the nearest one.
    pub fn fade_in(&self, level: usize) -> Option<FadeBand> {
        level.checked_sub(1).and_then(|before| self.fades.get(before)).copied()
    }

    /// The band over which `level` fades out; `None` for the farthest one, unless it gives way to a surface.
    pub fn fade_out(&self, level: usize) -> Option<FadeBand> {
        let last = if level + 1 == self.len() { self.surface } else { None };
        self.fades.get(level).copied().or(last)
    }

    /// The band over which trees give way to the surface of the forest, if they do: for trees of
    /// [`NOMINAL_HEIGHT`](super::level_distance::NOMINAL_HEIGHT) in an image with 1080 rows, or [in a view](Self::in_view).
    pub fn surface(&self) -> Option<FadeBand> {
        self.surface
    }

    /// Alpha threshold of `level` at `distance` metres, that of [`level_distance`](super::level_distance): [`WHOLE`] to
    /// above [`GONE`].
    pub fn threshold(&self, level: usize, distance: f32) -> f32 {
        let coming = self.fade_in(level).map_or(WHOLE, |fade| fade.incoming_threshold(distance));
        let going = self.fade_out(level).map_or(WHOLE, |fade| fade.outgoing_threshold(distance));
        coming.max(going)
    }

    /// Whether `level` is drawn at `distance` metres.
    pub fn draws(&self, level: usize, distance: f32) -> bool {
        self.threshold(level, distance) < GONE
    }
}

/// Where a tree of the nominal height is `pixels` high in an image with 1080 rows, and a band around it; `None` for no size.
fn surface_band(pixels: f32) -> Option<FadeBand> {
    let distance = NOMINAL_HEIGHT * error_curve::nominal_focal_length() / pixels;
    (pixels > 0.0 && distance.is_finite())
        .then(|| FadeBand::new(distance * (1.0 - 0.5 * SURFACE_BAND), distance * SURFACE_BAND))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CLOUD: Representation = Representation::CLOUD;

    fn three_levels() -> impl Strategy<Value = Levels> {
        (0.0f32..1e4, 0.0f32..1e3, 0.0f32..1e4, 0.0f32..1e3).prop_map(|(first, width, second, other)| {
            Levels::only(Representation::MODEL)
                .then(FadeBand::new(first, width), CLOUD)
                .then(FadeBand::new(second, other), Representation::CROSS)
        })
    }

    proptest! {
        #[test]
        fn sane_levels_stay_as_they_are(levels in three_levels()) {
            let mut sanitized = levels.clone();
            sanitized.sanitize();
            prop_assert_eq!(sanitized, levels);
        }

        #[test]
        fn one_representation_is_always_whole(levels in three_levels(), distance in 0.0f32..3e4) {
            let thresholds: Vec<f32> = (0..levels.len()).map(|level| levels.threshold(level, distance)).collect();
            prop_assert!(thresholds.iter().all(|t| t.is_finite() && (WHOLE..=1.02).contains(t)));
            prop_assert!(thresholds.contains(&WHOLE), "{thresholds:?}");
            prop_assert!(thresholds.iter().filter(|t| **t < GONE).count() <= 2, "{thresholds:?}");
        }

        #[test]
        fn far_from_the_band_only_one_is_drawn(start in 1.0f32..1e4, width in 1.0f32..1e3) {
            let band = FadeBand::new(start, width);
            let levels = Levels::model_and_cross(band);
            prop_assert!(levels.draws(0, 0.99 * band.start) && !levels.draws(1, 0.99 * band.start));
            prop_assert!(!levels.draws(0, 1.01 * band.end) && levels.draws(1, 1.01 * band.end));
        }
    }

    #[test]
    fn bands_that_overlap_are_moved_apart() {
        let levels = Levels::only(Representation::MODEL)
            .then(FadeBand::new(50.0, 20.0), CLOUD)
            .then(FadeBand::new(10.0, 5.0), Representation::CROSS);
        assert_eq!(levels.fade_out(1), Some(FadeBand { start: 70.0, end: 70.0 }));
        assert_eq!(levels.representations(), [Representation::MODEL, CLOUD, Representation::CROSS]);
    }

    #[test]
    fn lists_that_were_edited_are_repaired() {
        let at = |start, end| FadeBand { start, end };
        let edited = |representations, fades| Levels { representations, fades, by_pixels: false, surface: None };
        let mut levels = edited(vec![CLOUD; 20], vec![at(1.0, 2.0); 19]);
        levels.sanitize();
        assert_eq!((levels.len(), levels.fades.len()), (MAX_LEVELS, MAX_LEVELS - 1));
        let mut levels = edited(Vec::new(), vec![at(1.0, 2.0)]);
        levels.sanitize();
        assert_eq!(levels, Levels::only(Representation::MODEL));
        let four = vec![Representation::MODEL, CLOUD, Representation::CROSS, CLOUD];
        let mut levels = edited(four, vec![at(f32::NAN, -5.0), at(-1.0, f32::NAN)]);
        levels.sanitize();
        let expected = Levels::only(Representation::MODEL).then(at(0.0, 0.0), CLOUD);
        assert_eq!(levels, expected.then(at(0.0, 0.0), Representation::CROSS));
    }

    #[test]
    fn levels_by_error_follow_the_pixels_and_others_do_not() {
        let nominal = error_curve::nominal_focal_length();
        let start = |levels: &Levels, zoom: f32, pixels: f32| {
            levels.in_view(zoom, pixels).fade_out(0).expect("two levels").start
        };
        let (by_error, by_distance) = (Levels::by_error(0.1), Levels::model_and_cross(FadeBand::new(60.0, 20.0)));
        assert_eq!(start(&by_error, 2.0, 0.5 * nominal), 0.5 * start(&by_error, 1.0, nominal));
        assert_eq!(start(&by_distance, 2.0, 0.5 * nominal), 120.0);
        assert!(start(&Levels::by_error(1000.0), 1.0, nominal) < 1.0);
        assert!((300.0..400.0).contains(&start(&Levels::by_error(0.0), 1.0, nominal)));
    }

    #[test]
    fn trees_below_a_size_are_a_surface_in_any_image() {
        let levels = Levels::model_and_cross(FadeBand::new(60.0, 20.0)).to_size(4.0);
        for (zoom, pixels) in [(1.0, error_curve::nominal_focal_length()), (1.0, 300.0), (3.0, 2000.0)] {
            let seen = levels.in_view(zoom, pixels);
            let band = seen.fade_out(1).expect("a surface");
            let size = NOMINAL_HEIGHT * pixels / (0.5 * (band.start + band.end));
            assert!((size - 4.0).abs() < 1e-3, "{size}");
            assert_eq!(seen.surface(), seen.fade_out(1));
            assert!(!seen.draws(1, 1.01 * band.end) && seen.draws(1, 0.5 * (band.start + band.end)));
        }
        // Blurred, it begins sooner, and never farther away.
        let band = |levels: Levels| levels.surface().expect("a surface").start;
        let sharp = band(levels.clone());
        assert!((3.0 * band(levels.clone().blurred(3.0)) / sharp - 1.0).abs() < 1e-5);
        for nothing in [1.0, 0.2, 0.0, -2.0, f32::NAN] {
            assert_eq!(band(levels.clone().blurred(nothing)), sharp);
        }
        assert_eq!(band(levels.clone().blurred(f32::INFINITY)), 80.0);
        // In a tiny image it begins behind the levels.
        let tiny = levels.in_view(1.0, 1.0);
        assert!(tiny.surface().is_some_and(|band| band.start >= 80.0 && band.end >= band.start));
        for none in [0.0, -1.0, f32::NAN] {
            assert_eq!(levels.clone().to_size(none).surface(), None);
        }
    }

    #[test]
    fn there_are_at_most_eight_levels() {
        let levels = (0..20).fold(Levels::only(CLOUD), |levels, i| levels.then(FadeBand::new(i as f32, 1.0), CLOUD));
        assert_eq!(levels.len(), MAX_LEVELS);
        assert_eq!(levels.fade_out(MAX_LEVELS - 1), None);
    }
}
