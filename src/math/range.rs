//! The range of a number that people set: its bounds, its steps, its unit. A field of a setting that can be reflected
//! states it as an attribute, `#[reflect(@Range::factor(0.1..=10.0).unit("m"))]`, and a panel goes by it.

use std::ops::RangeInclusive;

/// How a number is adjusted in steps, coarse and fine.
#[derive(Clone, Copy, Debug, PartialEq, bevy::reflect::Reflect)]
pub enum Step {
    /// By a factor; below the third value comes the lower end of the range.
    Factor(f64, f64, f64),
    /// By a summand, to its next multiple.
    Sum(f64, f64),
}

/// The range of a number.
#[derive(Clone, Copy, Debug, PartialEq, bevy::reflect::Reflect)]
pub struct Range {
    /// The least value.
    pub low: f64,
    /// The greatest value.
    pub high: f64,
    /// Its steps.
    pub step: Step,
    /// Its unit, for people; empty if it has none.
    pub unit: &'static str,
}

impl Range {
    /// Of a number of which nothing is known.
    pub const ANY: Self = Self { low: f64::MIN, high: f64::MAX, step: Step::Sum(1.0, 0.1), unit: "" };
    /// The least value above 0 of a range that begins at 0 and spans decades.
    const LEAST: f64 = 1e-3;

    /// Of a number that spans decades: steps of 20 % and 2 %.
    pub fn factor<T: Into<f64>>(range: RangeInclusive<T>) -> Self {
        Self::new(range, |low| Step::Factor(1.2, 1.02, if low > 0.0 { low } else { Self::LEAST }))
    }

    /// Of a number that is doubled and halved.
    pub fn doubled<T: Into<f64>>(range: RangeInclusive<T>) -> Self {
        Self::new(range, |low| Step::Factor(2.0, 2.0, low))
    }

    /// Of a number with equal steps, coarse and fine.
    pub fn steps<T: Into<f64>>(range: RangeInclusive<T>, coarse: f64, fine: f64) -> Self {
        Self::new(range, |_| Step::Sum(coarse, fine))
    }

    /// Of a fraction of 1: steps of 0.05 and 0.01.
    pub fn fraction<T: Into<f64>>(range: RangeInclusive<T>) -> Self {
        Self::steps(range, 0.05, 0.01)
    }

    fn new<T: Into<f64>>(range: RangeInclusive<T>, step: impl FnOnce(f64) -> Step) -> Self {
        let (low, high) = range.into_inner();
        let (low, high) = (low.into(), high.into());
        Self { low, high, step: step(low), unit: "" }
    }

    /// The same with a unit.
    #[must_use]
    pub fn unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    /// `value` after one step up or down, within the range; a whole number stays one.
    pub fn stepped(&self, value: f64, up: bool, fine: bool, whole: bool) -> f64 {
        let next = match self.step {
            Step::Factor(coarse, small, least) => {
                let factor = if fine { small } else { coarse };
                // Whole numbers keep all of their digits.
                let rounded = |value| if whole { value } else { rounded(value) };
                match up {
                    true if value < least => least,
                    true => rounded(value * factor),
                    false if rounded(value / factor) < least => self.low,
                    false => rounded(value / factor),
                }
            }
            Step::Sum(coarse, small) => {
                let step = if fine { small } else { coarse };
                // A value between two steps goes to the next one; a value that only rounding moved off a step counts as
                // on it.
                let steps = if up { (value / step + 1e-6).floor() + 1.0 } else { (value / step - 1e-6).ceil() - 1.0 };
                // A quotient has no more digits than its parts.
                if step < 1.0 { steps / step.recip().round() } else { steps * step }
            }
        };
        let next = match whole {
            true if up => next.round().max(value + 1.0),
            true => next.round().min(value - 1.0),
            false => next,
        };
        next.max(self.low).min(self.high)
    }
}

/// Number of decimals for three significant digits, for a `value` above 0.
fn decimals(value: f64) -> i32 {
    if value > 0.0 && value.is_finite() { 2 - value.log10().floor() as i32 } else { 0 }
}

/// Rounds a positive number to three significant digits.
fn rounded(value: f64) -> f64 {
    let decimals = decimals(value);
    let scale = 10f64.powi(decimals.abs());
    if decimals < 0 { (value / scale).round() * scale } else { (value * scale).round() / scale }
}

/// Writes a number with three significant digits, whole numbers with all of theirs.
pub fn three_digits(value: f64) -> String {
    let size = value.abs();
    if size >= 100.0 && size.fract() == 0.0 {
        return format!("{value}");
    }
    format!("{:.*}", decimals(size).clamp(0, 9) as usize, rounded(size) * value.signum())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn ranges_have_ends_that_can_be_reached_and_left() {
        let ranges = [
            (Range::factor(1e-6..=1e3), false),
            (Range::factor(0.0..=1e6), false),
            (Range::fraction(0.0..=1.0), false),
            (Range::doubled(256..=8192), true),
            (Range::steps(2..=6, 1.0, 1.0), true),
            (Range::factor(1..=1000), true),
            (Range::steps(-10.0..=10.0, 0.5, 0.1), false),
        ];
        for (range, whole) in ranges {
            let mut value = range.high;
            for (up, end) in [(false, range.low), (true, range.high), (false, range.low)] {
                let mut steps = 0;
                while value != end {
                    let next = range.stepped(value, up, false, whole);
                    assert!(next != value && (!whole || next.fract() == 0.0), "{range:?} at {value}");
                    (value, steps) = (next, steps + 1);
                    assert!(steps < 300, "{range:?}");
                }
                assert_eq!(range.stepped(value, up, false, whole), end);
            }
        }
    }

    #[test]
    fn doubled_whole_numbers_stay_powers_of_two() {
        let range = Range::doubled(256..=8192);
        let sizes = [256.0, 512.0, 1024.0, 2048.0, 4096.0, 8192.0];
        for pair in sizes.windows(2) {
            assert_eq!(range.stepped(pair[0], true, false, true), pair[1]);
            assert_eq!(range.stepped(pair[1], false, true, true), pair[0]);
        }
    }

    #[test]
    fn numbers_have_three_digits() {
        for (value, text) in [
            (0.0, "0"),
            (1e-6, "0.00000100"),
            (0.0123456, "0.0123"),
            (1.0, "1.00"),
            (-2.5, "-2.50"),
            (2048.0, "2048"),
            (98765.4, "98800"),
        ] {
            assert_eq!(three_digits(value), text);
        }
    }

    proptest! {
        #[test]
        fn a_step_back_undoes_a_step(value in 0.01f64..0.9, fine in any::<bool>(), decade in -1..3i32) {
            let fraction = Range::fraction(0.0..=1.0);
            let hundredths = (value * 100.0).round() / 100.0;
            for (range, value) in [(Range::factor(1e-6..=1e6), value * 10f64.powi(decade)), (fraction, hundredths)] {
                let up = range.stepped(value, true, fine, false);
                let back = range.stepped(up, false, fine, false);
                prop_assert!(up > value);
                let near = if range == fraction { 0.051 } else { 0.011 * value };
                prop_assert!((back - value).abs() <= near, "{:?} {} {} {}", range, value, up, back);
            }
        }
    }
}
