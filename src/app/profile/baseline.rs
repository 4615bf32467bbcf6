//! A profile against an earlier one: what has become slower, or worse.
//!
//! Times are compared of the same scene, size and views only. Another machine, driver or version is what a comparison may be
//! about, so that these are warnings.

use std::path::Path;

use super::{
    ProfileOptions,
    error::{LEAST_ROUNDS_FOR_MEAN, ProfileError},
    profiled_scene,
    record::{Machine, Method, ProfileReport, ViewRecord},
    unmeasured::view_record,
};
use crate::{
    app::{AppError, fingerprint::source_fingerprint},
    measure::Interval,
};

/// How far two cameras may be apart, in metres and degrees, and be the same.
const SAME: f64 = 1e-6;

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

/// Whether a profile of `options` can be compared with `baseline`, which was read from `path`, as far as that is known before anything is
/// measured.
///
/// # Errors
/// [`ProfileError::FewRounds`], [`ProfileError::Incomparable`], [`ProfileError::Untimed`] for a baseline without times; [`AppError::Scene`]
/// and [`AppError::Plan`] as in a profile.
pub fn check_baseline(options: &ProfileOptions, baseline: &ProfileReport, path: &Path) -> Result<(), AppError> {
    let (rounds, least) = (options.rounds, LEAST_ROUNDS_FOR_MEAN);
    if rounds < least {
        return Err(ProfileError::FewRounds { rounds, purpose: "to compare with a --baseline", least }.into());
    }
    let scene = profiled_scene(&options.scene, &options.overrides)?;
    // A camera's record has its height above the ground, whatever that is.
    let views = options.views.of(&scene, &|_, _| 0.0)?;
    let planned = ProfileReport {
        scene_fingerprint: source_fingerprint(&scene, &options.overrides),
        scene: scene.name,
        method: Method { size: options.size, ..Method::default() },
        views: views.iter().map(view_record).collect(),
        ..ProfileReport::default()
    };
    comparable(&planned, baseline, path)?;
    if baseline.points.iter().all(|point| point.summary.mean.is_none()) {
        let settings = vec!["any settings".to_owned()];
        return Err(ProfileError::Untimed { baseline: path.to_owned(), settings }.into());
    }
    Ok(())
}

/// Whether both reports are of one scene, size and views.
fn comparable(own: &ProfileReport, baseline: &ProfileReport, path: &Path) -> Result<(), ProfileError> {
    let mut differences = Vec::new();
    if own.scene != baseline.scene {
        differences.push(format!("it is of the scene `{}`, not of `{}`", baseline.scene, own.scene));
    } else if own.scene_fingerprint != baseline.scene_fingerprint
        // Not known of earlier reports, and of the steps of a search.
        && ![own, baseline].iter().any(|report| report.scene_fingerprint.is_empty())
    {
        differences.push(format!(
            "the file of the scene `{}`, one that it names, or an option that replaces its values has changed",
            own.scene
        ));
    }
    let size = |report: &ProfileReport| format!("{}x{}", report.method.size.0, report.method.size.1);
    if own.method.size != baseline.method.size {
        differences.push(format!("its frames have {} pixels, not {}", size(baseline), size(own)));
    }
    let counts = (baseline.views.len(), own.views.len());
    if counts.0 != counts.1 {
        differences.push(format!("it has {} views, not {}", counts.0, counts.1));
    } else if let Some((_, other)) = own.views.iter().zip(&baseline.views).find(|(own, other)| !same_view(own, other)) {
        differences.push(format!("its view {} has another camera or instant", other.name));
    }
    if differences.is_empty() {
        Ok(())
    } else {
        Err(ProfileError::Incomparable { baseline: path.to_owned(), differences })
    }
}

fn same_view(one: &ViewRecord, other: &ViewRecord) -> bool {
    let near = one.camera.iter().zip(&other.camera).all(|(one, other)| (one - other).abs() <= SAME);
    // A view of a flight is reached in flight, a still at once: shadow maps are not kept there.
    near && one.instant == other.instant && one.seconds.is_some() == other.seconds.is_some()
}

/// What else may explain a difference to `baseline`, which was read from `path`: a line for a warning each.
pub fn cautions(report: &ProfileReport, baseline: &ProfileReport, path: &Path) -> Vec<String> {
    let path = path.display();
    let text = |value: &Option<String>| value.clone().unwrap_or_else(|| "an unknown one".to_owned());
    let of = |machine: &Machine| {
        [
            ("adapter", machine.adapter.clone()),
            ("driver", machine.driver.clone()),
            ("graphics interface", machine.backend.clone()),
            ("processor", text(&machine.processor)),
            ("number of threads", machine.threads.to_string()),
            ("operating system", machine.system.clone()),
            ("version of Canopy", machine.canopy.clone()),
        ]
    };
    let mut cautions: Vec<String> = of(&baseline.machine)
        .into_iter()
        .zip(of(&report.machine))
        .filter(|((_, old), (_, new))| old != new)
        .map(|((what, old), (_, new))| format!("{path} was measured with another {what}: {old}, here {new}"))
        .collect();
    let (old, new) = (&baseline.method, &report.method);
    if old.warm_up != new.warm_up {
        cautions.push(format!("{path} was measured with --warm-up {}, here {}", old.warm_up, new.warm_up));
    }
    if (&old.reference, &old.reference_details) != (&new.reference, &new.reference_details) {
        cautions
            .push(format!("{path} counts errors from another reference: {}, here {}", old.reference, new.reference));
    }
    if !baseline.complete {
        cautions.push(format!("{path} is the report of a profile that did not end"));
    }
    cautions
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

/// Compares each combination of a report with that of the baseline. Fails if one takes more than `limit` times as long and that is no
/// chance: the low end of its 95 % interval is above 1, or above a `limit` below 1.
///
/// # Errors
/// [`ProfileError::Incomparable`], [`ProfileError::NothingInCommon`]; [`ProfileError::Slower`] and [`ProfileError::Untimed`] with what was
/// compared.
pub fn against(
    report: &ProfileReport,
    baseline: &ProfileReport,
    path: &Path,
    limit: f64,
) -> (Vec<BaselineRow>, Result<(), ProfileError>) {
    let rows = match comparable(report, baseline, path).and_then(|()| rows(report, baseline, path)) {
        Ok(rows) => rows,
        Err(error) => return (Vec::new(), Err(error)),
    };
    let slow = |row: &&BaselineRow| row.time.is_some_and(|time| time.value > limit && time.low > limit.min(1.0));
    let name = |row: &BaselineRow| format!("{} ({:.3})", row.label, row.time.map_or(f64::NAN, |time| time.value));
    let slower: Vec<String> = rows.iter().filter(slow).map(name).collect();
    let untimed = rows.iter().filter(|row| row.time.is_none()).map(|row| row.label.clone());
    let (total, settings) = (rows.len(), untimed.collect::<Vec<_>>());
    let outcome = if !slower.is_empty() {
        Err(ProfileError::Slower { baseline: path.to_owned(), slower, total, limit })
    } else if !settings.is_empty() {
        Err(ProfileError::Untimed { baseline: path.to_owned(), settings })
    } else {
        Ok(())
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

    /// Half the time was asked for, and 1.05 of it passed, since its interval held 1.
    #[test]
    fn a_limit_below_1_asks_to_be_faster() {
        let (path, old) = (Path::new("old.json"), report(10.0, 1.0, "1"));
        let of = |mean: f64, reach: f64| against(&report(mean, reach, "1"), &old, path, 0.5).1;
        let message = of(10.5, 1.0).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(message.contains("1 of 1 settings take more than 0.5 of the time in old.json: 1 (1.050)"), "{message}");
        assert!(of(5.1, 1.0).is_ok() && of(4.0, 0.1).is_ok(), "surely above the limit is neither");
    }

    #[test]
    fn what_has_no_time_does_not_pass() {
        let (path, old) = (Path::new("old.json"), report(10.0, 0.1, "1"));
        let mut untimed = old.clone();
        untimed.points[0].summary.mean = None;
        for (own, baseline) in [(&untimed, &old), (&old, &untimed), (&untimed, &untimed)] {
            let (rows, outcome) = against(own, baseline, path, 1.1);
            let message = outcome.err().map(|error| error.to_string()).unwrap_or_default();
            assert!(rows.len() == 1 && message.contains("no times can be compared of 1; measure both"), "{message}");
        }
    }

    #[test]
    fn another_scene_size_or_view_is_refused_and_another_machine_is_said() {
        let path = Path::new("old.json");
        let view = ViewRecord { name: "0000".to_owned(), instant: "noon".to_owned(), ..ViewRecord::default() };
        let mut old = ProfileReport { scene: "grove".to_owned(), views: vec![view], ..report(10.0, 0.1, "1") };
        (old.method.size, old.complete) = ((64, 36), true);
        let refused = |change: &dyn Fn(&mut ProfileReport)| {
            let mut own = old.clone();
            change(&mut own);
            against(&own, &old, path, 1.1).1.err().map(|error| error.to_string()).unwrap_or_default()
        };
        for (message, words) in [
            (refused(&|own| own.scene = "oaks".to_owned()), "it is of the scene `grove`, not of `oaks`"),
            (refused(&|own| own.method.size = (128, 72)), "its frames have 64x36 pixels, not 128x72"),
            (refused(&|own| own.views.clear()), "it has 1 views, not 0"),
            (refused(&|own| own.views[0].camera[3] = 5.0), "its view 0000 has another camera or instant"),
            (refused(&|own| own.views[0].instant = "dusk".to_owned()), "its view 0000 has another camera or instant"),
        ] {
            assert!(message.starts_with("old.json cannot be compared") && message.contains(words), "{message}");
        }
        // Reports of earlier versions do not know what their scene was.
        assert_eq!(refused(&|own| own.scene_fingerprint = "a".to_owned()), "");
        old.scene_fingerprint = "b".to_owned();
        let own = ProfileReport { scene_fingerprint: "a".to_owned(), ..old.clone() };
        assert!(against(&own, &old, path, 1.1).1.is_err_and(|error| error.to_string().contains("has changed")));

        let mut own = old.clone();
        assert!(cautions(&own, &old, path).is_empty());
        own.machine.driver = "new".to_owned();
        assert_eq!(cautions(&own, &old, path), ["old.json was measured with another driver: , here new"]);
        assert!(against(&own, &old, path, 1.1).1.is_ok());
    }
}
