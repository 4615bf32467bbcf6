//! The fade band: the range of distances over which one representation replaces the next finer one.

/// The distances over which a representation is replaced by the next coarser one.
#[derive(Clone, Copy, Debug, PartialEq, bevy::reflect::Reflect)]
pub struct FadeBand {
    /// Distance in metres at which the coarser one begins to appear; below it only the finer one is drawn.
    pub start: f32,
    /// Distance in metres at which the finer one is gone; beyond it only the coarser one is drawn.
    pub end: f32,
}

/// The threshold of the alpha test at which a representation is whole.
pub const WHOLE: f32 = 0.5;
/// The threshold from which on nothing passes the alpha test.
pub const GONE: f32 = 1.0;
/// Rise of the threshold over half a band: a little more than from [`WHOLE`] to [`GONE`], so that rounding leaves no
/// fragment.
pub const FADE_SPAN: f32 = 0.51;

impl FadeBand {
    /// A band that begins at `distance` metres and is `width` metres wide. Negative and non-finite values become 0.
    pub fn new(distance: f32, width: f32) -> Self {
        let sane = |value: f32| if value.is_finite() { value.max(0.0) } else { 0.0 };
        let start = sane(distance);
        Self { start, end: start + sane(width) }
    }

    /// The band at `factor` times the distances.
    #[must_use]
    pub fn scaled(&self, factor: f32) -> Self {
        Self { start: self.start * factor, end: self.end * factor }
    }

    fn middle(&self) -> f32 {
        0.5 * (self.start + self.end)
    }

    /// Alpha threshold of the finer representation at `distance` metres: [`WHOLE`] to above [`GONE`].
    pub fn outgoing_threshold(&self, distance: f32) -> f32 {
        let half = (self.end - self.middle()).max(1e-3);
        WHOLE + FADE_SPAN * ((distance - self.middle()) / half).clamp(0.0, 1.0)
    }

    /// Alpha threshold of the coarser representation at `distance` metres: above [`GONE`] to [`WHOLE`].
    pub fn incoming_threshold(&self, distance: f32) -> f32 {
        let half = (self.middle() - self.start).max(1e-3);
        WHOLE + FADE_SPAN * ((self.middle() - distance) / half).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonsense_becomes_an_empty_band() {
        let band = FadeBand::new(f32::NAN, f32::INFINITY);
        assert_eq!(band, FadeBand { start: 0.0, end: 0.0 });
        assert!(band.incoming_threshold(1.0) < GONE && band.outgoing_threshold(1.0) >= GONE);
    }
}
