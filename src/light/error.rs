//! What can be wrong with a request to the light room.

use thiserror::Error;

/// Errors of the light room. Each message says which value is wrong, and what would be right.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LightError {
    /// A value lies outside the range in which it means something.
    #[error("{quantity} is {value} {unit}, but must lie in [{min}, {max}] {unit}: {remedy}")]
    OutOfRange {
        /// What the value is, for example `latitude`.
        quantity: &'static str,
        /// The value as given.
        value: f64,
        /// Unit of the value and of the limits.
        unit: &'static str,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
        /// What to do about it.
        remedy: &'static str,
    },
    /// The solar position algorithm does not cover the instant asked for.
    #[error("no solar position for {instant}: {reason}; use an instant between the years -500 and 3000")]
    Instant {
        /// The instant in UTC, ISO 8601.
        instant: String,
        /// The reason the algorithm gave.
        reason: String,
    },
}

/// Accepts `value` when it is finite and within `[min, max]`.
///
/// # Errors
/// [`LightError::OutOfRange`] otherwise, also for NaN.
pub(crate) fn check_range(
    quantity: &'static str,
    value: f64,
    unit: &'static str,
    min: f64,
    max: f64,
    remedy: &'static str,
) -> Result<f64, LightError> {
    if value >= min && value <= max {
        Ok(value)
    } else {
        Err(LightError::OutOfRange { quantity, value, unit, min, max, remedy })
    }
}
