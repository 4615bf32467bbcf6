//! A profile against an earlier one: what has become slower, or worse.

use std::path::Path;

use super::{error::ProfileError, record::ProfileReport};
use crate::measure::Interval;

/// One combination of settings that both profiles have.
#[derive(Clone, Debug, PartialEq)]
pub struct BaselineRow {
    /// Its settings.
    pub label: String,
    /// Median frame time as a fraction of that in the baseline, with its 95 % interval from the spread of both.
    pub time: Option<Interval>,
    /// Mean FLIP, and that of the baseline.
    pub error: (Option<f64>, Option<f64>),
}

/// The rows that `report` and `baseline`, which was read from `path`, have in common, and whether any is slower.
///
/// The two were not measured in turn, so that another load of the machine shows as a ratio too.
///
/// # Errors
/// [`ProfileError::NothingInCommon`].
pub fn rows(report: &ProfileReport, baseline: &ProfileReport, path: &Path) -> Result<Vec<BaselineRow>, ProfileError> {
    let mut rows = Vec::new();
    for own in &report.points {
        let Some(other) = baseline.points.iter().find(|point| point.settings == own.settings) else { continue };
        let time = own.summary.mean.zip(other.summary.mean).and_then(|(own, other)| ratio(own, other));
        rows.push(BaselineRow { label: own.label.clone(), time, error: (own.summary.error, other.summary.error) });
    }
    if rows.is_empty() { Err(ProfileError::NothingInCommon(path.to_owned())) } else { Ok(rows) }
}

/// The ratio of two independent values.
fn ratio(own: Interval, other: Interval) -> Option<Interval> {
    if !(own.value > 0.0 && other.value > 0.0) {
        return None;
    }
    let relative = |interval: Interval| 0.5 * (interval.high - interval.low) / interval.value;
    let reach = relative(own).hypot(relative(other));
    let value = own.value / other.value;
    Some(Interval { value, low: value * (-reach).exp(), high: value * reach.exp() })
}

/// Compares each combination of a report with that of the baseline; fails if one takes more than `limit` times as long, and surely longer than before.
///
/// # Errors
/// [`ProfileError::NothingInCommon`], [`ProfileError::Slower`] with what was compared.
pub fn against(
    report: &ProfileReport,
    baseline: &ProfileReport,
    path: &Path,
    limit: f64,
) -> (Vec<BaselineRow>, Result<(), ProfileError>) {
    let rows = match rows(report, baseline, path) {
        Ok(rows) => rows,
        Err(error) => return (Vec::new(), Err(error)),
    };
    let slow = |row: &&BaselineRow| row.time.is_some_and(|time| time.value > limit && time.low > 1.0);
    let name = |row: &BaselineRow| format!("{} ({:.3})", row.label, row.time.map_or(f64::NAN, |time| time.value));
    let slower: Vec<String> = rows.iter().filter(slow).map(name).collect();
    let total = rows.len();
    let outcome = if slower.is_empty() {
        Ok(())
    } else {
        Err(ProfileError::Slower { baseline: path.to_owned(), slower, total, limit })
    };
    (rows, outcome)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::profile::record::PointRecord;

    fn report(mean: f64, reach: f64, setting: &str) -> ProfileReport {
        let mut point = PointRecord { label: setting.to_owned(), ..PointRecord::default() };
        point.settings.insert("a".to_owned(), setting.to_owned());
        point.summary.mean = Some(Interval { value: mean, low: mean - reach, high: mean + reach });
        ProfileReport { points: vec![point], ..ProfileReport::default() }
    }

    #[test]
    fn what_is_surely_slower_fails_and_noise_does_not() {
        let path = Path::new("old.json");
        let old = report(10.0, 0.1, "1");
        assert!(against(&report(10.4, 0.1, "1"), &old, path, 1.05).1.is_ok());
        let (rows, outcome) = against(&report(11.0, 0.1, "1"), &old, path, 1.05);
        assert!(rows[0].time.is_some_and(|time| (time.value - 1.1).abs() < 1e-12 && time.low > 1.08));
        assert!(outcome.is_err_and(|error| {
            error.to_string().contains("1 of 1 settings are slower than in old.json by more than 5 %: 1 (1.100)")
        }));
        // Slower in the mean, with a spread that says nothing.
        assert!(against(&report(11.0, 3.0, "1"), &old, path, 1.05).1.is_ok());
        assert!(matches!(against(&report(1.0, 0.1, "2"), &old, path, 1.05).1, Err(ProfileError::NothingInCommon(_))));
    }
}
