//! Means, percentiles, and how sure a ratio is.

use serde::{Deserialize, Serialize};

/// The mean; `None` of nothing.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The value that a share (0 to 1) of `sorted` does not exceed (nearest rank); `None` of nothing.
pub fn percentile(sorted: &[f64], share: f64) -> Option<f64> {
    let rank = (share.clamp(0.0, 1.0) * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.max(1) - 1).copied()
}

/// `values` in order, without those that are no numbers.
pub fn sorted(values: &[f64]) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// What is said of many values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Mean.
    pub mean: f64,
    /// Median.
    pub p50: f64,
    /// What 95 % do not exceed.
    pub p95: f64,
    /// What 99 % do not exceed.
    pub p99: f64,
    /// Greatest value.
    pub maximum: f64,
}

impl Summary {
    /// The summary; `None` of nothing.
    pub fn of(values: &[f64]) -> Option<Self> {
        let sorted = sorted(values);
        Some(Self {
            mean: mean(&sorted)?,
            p50: percentile(&sorted, 0.5)?,
            p95: percentile(&sorted, 0.95)?,
            p99: percentile(&sorted, 0.99)?,
            maximum: *sorted.last()?,
        })
    }
}

/// A value with the interval that holds the true one in 95 of 100 cases.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The value.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

/// Two-sided 95 % points of Student's t by degrees of freedom from 1; beyond, the normal distribution's.
const STUDENT: [f64; 30] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131, 2.120,
    2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056, 2.052, 2.048, 2.045, 2.042,
];

impl Interval {
    /// The mean of repeated measurements, by Student's t. `None` of fewer than two.
    pub fn of_mean(values: &[f64]) -> Option<Self> {
        let (count, value) = (values.len(), mean(values)?);
        let freedom = count.checked_sub(1).filter(|freedom| *freedom > 0)?;
        let variance = values.iter().map(|each| (each - value).powi(2)).sum::<f64>() / freedom as f64;
        let reach = STUDENT.get(freedom - 1).copied().unwrap_or(1.96) * (variance / count as f64).sqrt();
        Some(Self { value, low: value - reach, high: value + reach })
    }

    /// The mean of measurements that were taken in two alternating orders, there and back, each of which has its own bias:
    /// on a machine that grows slower meanwhile, what comes last is slower. The bias cancels in the mean of the two groups'
    /// means; the interval follows from the spread within the groups. `None` of fewer than two in a group.
    pub fn of_alternating(there: &[f64], back: &[f64]) -> Option<Self> {
        if there.len() < 2 || back.len() < 2 {
            return None;
        }
        let (first, second) = (mean(there)?, mean(back)?);
        let squares = |values: &[f64], middle: f64| values.iter().map(|value| (value - middle).powi(2)).sum::<f64>();
        let freedom = there.len() + back.len() - 2;
        let variance = (squares(there, first) + squares(back, second)) / freedom as f64;
        let spread = 0.5 * (variance / there.len() as f64 + variance / back.len() as f64).sqrt();
        let reach = STUDENT.get(freedom - 1).copied().unwrap_or(1.96) * spread;
        let value = 0.5 * (first + second);
        Some(Self { value, low: value - reach, high: value + reach })
    }

    /// The interval of the exponential, where this one is of a logarithm.
    pub fn exp(self) -> Self {
        Self { value: self.value.exp(), low: self.low.exp(), high: self.high.exp() }
    }

    /// Whether `value` is in the interval.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::bell_f32;

    #[test]
    fn summaries_are_of_ranks() {
        let values: Vec<f64> = (1..=200).rev().map(f64::from).collect();
        let summary = Summary::of(&values).unwrap();
        assert_eq!(
            (summary.mean, summary.p50, summary.p95, summary.p99, summary.maximum),
            (100.5, 100.0, 190.0, 198.0, 200.0)
        );
        assert_eq!(Summary::of(&[]), None);
        assert_eq!(Summary::of(&[f64::NAN]), None);
        assert_eq!(Summary::of(&[3.0, f64::NAN]).map(|summary| summary.maximum), Some(3.0));
    }

    #[test]
    fn intervals_are_those_of_student() {
        // By hand: mean 3, deviation 1.5811, 5 values: 2.776 * 1.5811 / sqrt 5 = 1.963.
        let interval = Interval::of_mean(&[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        assert!((interval.value - 3.0).abs() < 1e-12 && (interval.high - 4.963).abs() < 1e-3, "{interval:?}");
        assert!(interval.contains(2.0) && !interval.contains(5.0));
        assert_eq!(Interval::of_mean(&[1.0]), None);
    }

    /// Of frames whose machine becomes slower meanwhile, with as much noise in each as a busy machine has.
    #[test]
    fn the_same_setting_twice_has_a_ratio_of_one_in_its_interval() {
        let mut held = 0;
        for run in 0..400 {
            let noise = |index: u64| 1.0 + 0.02 * f64::from(bell_f32(9, run * 100 + index, 0u64));
            // Once the first of the two comes earlier, once the second.
            let ratio = |index: u64| {
                let (earlier, later) = (1.0 + 0.01 * index as f64, 1.0 + 0.01 * (index + 3) as f64);
                let (a, b) = if index.is_multiple_of(2) { (earlier, later) } else { (later, earlier) };
                (b * noise(2 * index) / (a * noise(2 * index + 1))).ln()
            };
            let of = |first: u64| (0..4).map(|turn| ratio(2 * turn + first)).collect::<Vec<_>>();
            let interval = Interval::of_alternating(&of(0), &of(1)).unwrap().exp();
            held += u32::from(interval.contains(1.0));
        }
        assert!((364..=400).contains(&held), "{held} of 400");
        assert_eq!(Interval::of_alternating(&[1.0], &[1.0, 2.0]), None);
    }
}
