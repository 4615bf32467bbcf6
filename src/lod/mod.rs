//! Levels of detail: which representation stands where, and how one gives way to the next.
//!
//! A tree is its full model near the camera and crossed billboards far away [Franzke 2005, 4.3.3]. Over a band of
//! distances both are drawn, and each one's alpha test moves: the crosses come in over the first half of the band,
//! the model goes out over the second, so that the crown is never thinner than one whole representation. The
//! distance is measured on the ground plane, from the camera to the trunk: a tree changes as a whole.
//!
//! The functions here are the CPU twin of `shaders/forest/instance.wgsl`.

/// Where the full model gives way to crossed billboards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FadeBand {
    /// Distance in metres at which the crosses begin to appear; below it only the model is drawn.
    pub start: f32,
    /// Distance in metres at which the model is gone; beyond it only crosses are drawn.
    pub end: f32,
}

/// The threshold of the alpha test at which a representation is whole.
pub const WHOLE: f32 = 0.5;
/// The threshold above which nothing passes the alpha test.
pub const GONE: f32 = 1.0;
/// What fading adds to [`WHOLE`] until nothing is left: a little more than the way to [`GONE`].
pub const FADE_SPAN: f32 = 0.51;

impl FadeBand {
    /// A band that begins at `distance` metres and is `width` metres wide. Negative and non-finite values become 0.
    pub fn new(distance: f32, width: f32) -> Self {
        let sane = |value: f32| if value.is_finite() { value.max(0.0) } else { 0.0 };
        let start = sane(distance);
        Self { start, end: start + sane(width) }
    }

    fn middle(&self) -> f32 {
        0.5 * (self.start + self.end)
    }

    /// Alpha threshold of the full model at `distance` metres: 0.5 (whole) to above [`GONE`].
    pub fn model_threshold(&self, distance: f32) -> f32 {
        let half = (self.end - self.middle()).max(1e-3);
        WHOLE + FADE_SPAN * ((distance - self.middle()) / half).clamp(0.0, 1.0)
    }

    /// Alpha threshold of the crosses at `distance` metres: above [`GONE`] to 0.5 (whole).
    pub fn cross_threshold(&self, distance: f32) -> f32 {
        let half = (self.middle() - self.start).max(1e-3);
        WHOLE + FADE_SPAN * ((self.middle() - distance) / half).clamp(0.0, 1.0)
    }

    /// Whether the full model is drawn at `distance` metres.
    pub fn draws_model(&self, distance: f32) -> bool {
        self.model_threshold(distance) < GONE
    }

    /// Whether crosses are drawn at `distance` metres.
    pub fn draws_cross(&self, distance: f32) -> bool {
        self.cross_threshold(distance) < GONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn one_representation_is_always_whole(start in 0.0f32..1e4, width in 0.0f32..1e3, distance in 0.0f32..2e4) {
            let band = FadeBand::new(start, width);
            let thresholds = [band.model_threshold(distance), band.cross_threshold(distance)];
            prop_assert!(thresholds.iter().all(|t| t.is_finite() && (0.5..=1.02).contains(t)));
            prop_assert!(thresholds.contains(&0.5));
            prop_assert!(band.draws_model(distance) || band.draws_cross(distance));
        }

        #[test]
        fn far_from_the_band_only_one_is_drawn(start in 1.0f32..1e4, width in 1.0f32..1e3) {
            let band = FadeBand::new(start, width);
            prop_assert!(band.draws_model(0.99 * band.start) && !band.draws_cross(0.99 * band.start));
            prop_assert!(!band.draws_model(1.01 * band.end) && band.draws_cross(1.01 * band.end));
        }
    }

    #[test]
    fn nonsense_becomes_an_empty_band() {
        let band = FadeBand::new(f32::NAN, f32::INFINITY);
        assert_eq!(band, FadeBand { start: 0.0, end: 0.0 });
        assert!(band.draws_cross(1.0) && !band.draws_model(1.0));
    }
}
