//! Errors of point sets and sequences.

use thiserror::Error;

/// Why a point set or a sequence cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum MathError {
    /// A radical inverse needs a base of at least 2.
    #[error("radical inverse in base {base}: a base is at least 2")]
    Base {
        /// The given base.
        base: u32,
    },
    /// A point lies outside the unit square, so its set has no star discrepancy.
    #[error("point {index} ({x}, {y}) is outside the unit square: scale the set to 0..1 first")]
    OutsideUnitSquare {
        /// Index of the point.
        index: usize,
        /// First coordinate.
        x: f64,
        /// Second coordinate.
        y: f64,
    },
}
