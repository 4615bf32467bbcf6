//! The independent streams of random numbers of a stand.

use glam::DVec2;

use crate::math::hash::unit_f64;

/// The purpose of a random number. Streams of one seed are independent of each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Stream {
    /// Choice of the species.
    Species = 1,
    /// Choice among a species' individuals.
    Variant = 2,
    /// Yaw about the trunk.
    Yaw = 3,
    /// Size.
    Scale = 4,
    /// Colour.
    Tint = 5,
    /// First coordinate of a random point.
    PointX = 6,
    /// Second coordinate of a random point.
    PointZ = 7,
    /// Shift of a low-discrepancy sequence, first coordinate at index 0 and second at index 1.
    Shift = 8,
    /// Gradients of the clearing noise.
    Clearing = 9,
    /// Thinning at the edge of clearings.
    Edge = 10,
    /// Which trees go when there are too many.
    Thinning = 11,
    /// Seed of the trees around an area.
    Surroundings = 12,
}

impl From<Stream> for u64 {
    fn from(stream: Stream) -> Self {
        stream as Self
    }
}

/// The i-th random point of `seed`; both coordinates uniform in [0, 1): the yardstick for Halton's and Hammersley's.
#[inline]
pub fn random(i: u64, seed: u64) -> DVec2 {
    DVec2::new(unit_f64(seed, i, Stream::PointX), unit_f64(seed, i, Stream::PointZ))
}
