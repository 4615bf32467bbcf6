//! What a point set or a sequence can be asked in vain.

use thiserror::Error;

/// Errors of the room `math`.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum MathError {
    /// A radical inverse needs a base of at least 2.
    #[error("radical inverse in base {base}: a base is at least 2")]
    Base {
        /// The base given.
        base: u32,
    },
    /// A point of a set whose discrepancy is asked for is outside the unit square.
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
