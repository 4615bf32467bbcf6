//! What follows from measurements.

use std::collections::{BTreeMap, BTreeSet};

use super::record::{FrameTime, LevelCount, PointRecord, PointSummary, ProfileReport, Round};
use crate::measure::{Comparison, Interval, Summary, knee, mean, pareto_front, percentile, sorted};

/// Computes all that follows from the measurements of `report`.
pub fn summarize(report: &mut ProfileReport) {
    let baseline = report.points.first().map(|point| point.rounds.clone()).unwrap_or_default();
    for (index, point) in report.points.iter_mut().enumerate() {
        point.summary = summary(point);
        point.summary.ratio = if index == 0 { None } else { ratio(&point.rounds, &baseline) };
    }
    // The scene twice has one place on the front, and another renderer, which may draw fewer trees, none.
    let known =
        |point: &PointRecord| Some((point.summary.mean_frame?, point.summary.error?)).filter(|_| !point.unranked);
    let coordinates: Vec<(f64, f64)> =
        report.points.iter().map(|point| known(point).unwrap_or((f64::NAN, f64::NAN))).collect();
    let on_front = pareto_front(&coordinates);
    report.front = (0..on_front.len()).filter(|index| on_front[*index]).collect();
    report.knee = knee(&coordinates);
}

fn median(values: &[f64]) -> Option<f64> {
    percentile(&sorted(values), 0.5)
}

/// How far a frame may be from the median of its view over the rounds, as a factor, and count as it is: what is farther was disturbed
/// from outside, and counts as far as that.
const DISTURBED: f64 = 1.5;

/// The mean frame time over the views, round by round.
fn mean_times(rounds: &[Round]) -> Vec<f64> {
    let views = rounds.iter().map(|round| round.frames.len()).min().unwrap_or(0);
    let usual: Vec<f64> = (0..views)
        .filter_map(|view| median(&rounds.iter().map(|round| round.frames[view].frame).collect::<Vec<_>>()))
        .collect();
    let time = |round: &Round| {
        let times = round.frames.iter().zip(&usual);
        mean(&times.map(|(own, usual)| own.frame.clamp(usual / DISTURBED, usual * DISTURBED)).collect::<Vec<_>>())
    };
    rounds.iter().filter_map(time).collect()
}

/// The ratio of mean frame times over the views of two points in the same rounds, in both orders.
pub fn ratio(own: &[Round], baseline: &[Round]) -> Option<Interval> {
    let (mut there, mut back) = (Vec::new(), Vec::new());
    for ((round, own), baseline) in own.iter().zip(mean_times(own)).zip(mean_times(baseline)) {
        let logarithm = (own / baseline).ln();
        if round.forward { there.push(logarithm) } else { back.push(logarithm) }
    }
    Interval::of_alternating(&there, &back).map(Interval::exp)
}

fn summary(point: &PointRecord) -> PointSummary {
    let frames: Vec<&FrameTime> = point.rounds.iter().flat_map(|round| &round.frames).collect();
    let of =
        |value: fn(&FrameTime) -> Option<f64>| -> Vec<f64> { frames.iter().filter_map(|frame| value(frame)).collect() };
    let times = sorted(&of(|frame| Some(frame.frame)));
    let slowest = times.len().div_ceil(100).min(times.len());
    let means = mean_times(&point.rounds);
    let names: BTreeSet<&String> = frames.iter().flat_map(|frame| frame.passes.keys()).collect();
    let pass = |name: &String| {
        let times: Vec<f64> = frames.iter().filter_map(|frame| frame.passes.get(name)).copied().collect();
        Some((name.clone(), median(&times)?))
    };
    let pictures = &point.pictures;
    let errors: Vec<&Comparison> = pictures.iter().filter_map(|picture| picture.error.as_ref()).collect();
    let error = |value: fn(&Comparison) -> Option<f64>| {
        mean(&errors.iter().filter_map(|error| value(error)).collect::<Vec<_>>())
    };
    let changes: Vec<_> = pictures.iter().filter_map(|picture| picture.change).collect();
    let over = |values: Vec<f64>| mean(&values);
    let count =
        |levels: &[LevelCount], ground: usize| levels.iter().map(|level| level.triangles).sum::<f64>() + ground as f64;
    PointSummary {
        frame: Summary::of(&times),
        low_1_percent: mean(&times[times.len() - slowest..]),
        mean_frame: mean(&means),
        mean: Interval::of_mean(&means),
        ratio: None,
        cpu_main: Summary::of(&of(|frame| frame.cpu_main)),
        cpu_render: Summary::of(&of(|frame| frame.cpu_render)),
        gpu: Summary::of(&of(|frame| frame.gpu)),
        passes: names.into_iter().filter_map(pass).collect(),
        levels: mean_levels(point),
        triangles: over(pictures.iter().map(|picture| count(&picture.levels, picture.ground_triangles)).collect()),
        fragments_per_pixel: over(pictures.iter().filter_map(|picture| picture.fragments_per_pixel).collect()),
        forest_calls: over(pictures.iter().filter_map(|picture| Some(picture.forest_calls? as f64)).collect()),
        uploaded_bytes: over(pictures.iter().filter_map(|picture| Some(picture.uploaded_bytes? as f64)).collect()),
        error: error(|error| Some(error.flip.mean)),
        worst_error: errors.iter().map(|error| error.flip.mean).max_by(f64::total_cmp),
        filtered_error: [
            error(|error| error.filtered_flip[0]),
            error(|error| error.filtered_flip[1]),
            error(|error| error.filtered_flip[2]),
        ],
        luminance_ratio: error(|error| error.area.luminance_ratio),
        contrast_ratio: error(|error| error.area.contrast_ratio),
        block_correlation: error(|error| error.area.block_correlation),
        excess_change: over(changes.iter().map(|change| change.excess()).collect()),
        popping: over(changes.iter().map(|change| change.popping).collect()),
    }
}

/// Means of trees and triangles of each level over the views; a level that a view does not have counts 0 there.
fn mean_levels(point: &PointRecord) -> Vec<LevelCount> {
    let mut names: Vec<&str> = Vec::new();
    let mut sums: BTreeMap<&str, (f64, f64)> = BTreeMap::new();
    for level in point.pictures.iter().flat_map(|picture| &picture.levels) {
        if !names.contains(&level.name.as_str()) {
            names.push(&level.name);
        }
        let sum = sums.entry(&level.name).or_default();
        *sum = (sum.0 + level.trees, sum.1 + level.triangles);
    }
    let views = point.pictures.len().max(1) as f64;
    names
        .into_iter()
        .map(|name| {
            let (trees, triangles) = sums.get(name).copied().unwrap_or_default();
            LevelCount { name: name.to_owned(), trees: trees / views, triangles: triangles / views }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::profile::record::PictureRecord;

    fn round(forward: bool, times: &[f64]) -> Round {
        let frame = |time: &f64| FrameTime { frame: *time, ..FrameTime::default() };
        Round { forward, frames: times.iter().map(frame).collect() }
    }

    fn point(rounds: Vec<Round>, error: f64) -> PointRecord {
        let mut comparison = crate::measure::compare(
            &crate::measure::Picture::from_srgb8(1, 1, &[0; 3]).unwrap(),
            &crate::measure::Picture::from_srgb8(1, 1, &[0; 3]).unwrap(),
            &crate::measure::ComparisonSettings::default(),
        )
        .unwrap()
        .comparison;
        comparison.flip.mean = error;
        let level = LevelCount { name: "model".to_owned(), trees: 3.0, triangles: 300.0 };
        let picture = PictureRecord { error: Some(comparison), levels: vec![level], ..PictureRecord::default() };
        PointRecord { rounds, pictures: vec![picture, PictureRecord::default()], ..PointRecord::default() }
    }

    #[test]
    fn ratios_are_of_the_same_view_in_the_same_round() {
        // Views differ by a factor of ten, rounds by drift; the second point takes twice as long in each.
        let rounds = |factor: f64| -> Vec<Round> {
            (0..4)
                .map(|index| {
                    round(index % 2 == 0, &[1.0, 10.0].map(|time| factor * time * (1.0 + 0.1 * f64::from(index))))
                })
                .collect()
        };
        let mut report =
            ProfileReport { points: vec![point(rounds(1.0), 0.2), point(rounds(2.0), 0.1)], ..Default::default() };
        summarize(&mut report);
        let ratio = report.points[1].summary.ratio.unwrap();
        assert!((ratio.value - 2.0).abs() < 1e-9 && ratio.high - ratio.low < 1e-9, "{ratio:?}");
        assert_eq!((report.points[0].summary.ratio, report.front.clone(), report.knee), (None, vec![0, 1], Some(1)));
        let own = &report.points[0].summary;
        assert_eq!((own.levels[0].trees, own.triangles, own.error), (1.5, Some(150.0), Some(0.2)));
    }

    #[test]
    fn what_was_not_measured_has_no_figure() {
        let mut report = ProfileReport { points: vec![PointRecord::default(); 2], ..Default::default() };
        summarize(&mut report);
        assert_eq!(report.points[1].summary, PointSummary::default());
        assert!(report.front.is_empty() && report.knee.is_none());
        let times: Vec<f64> = (1..=200).map(f64::from).collect();
        report.points[0].rounds = vec![round(true, &times)];
        summarize(&mut report);
        let own = &report.points[0].summary;
        assert_eq!((own.low_1_percent, own.mean, own.frame.map(|frame| frame.p99)), (Some(199.5), None, Some(198.0)));
        assert_eq!(own.mean_frame, Some(100.5));
    }

    /// A median over two views is the time of one of them: of the demo, three times as long in the other was reported as 1.04.
    #[test]
    fn a_view_that_costs_more_counts_and_a_disturbed_frame_does_not() {
        let rounds = |near: f64| -> Vec<Round> {
            let stall = |index: usize| if index == 2 { 40.0 } else { 1.0 };
            (0..5).map(|index| round(index % 2 == 0, &[near, 2.0 * stall(index)])).collect()
        };
        let mut report =
            ProfileReport { points: vec![point(rounds(6.0), 0.2), point(rounds(18.0), 0.1)], ..Default::default() };
        summarize(&mut report);
        let [short, long] = [0, 1].map(|index| report.points[index].summary.mean_frame.unwrap());
        assert!((short - 4.1).abs() < 0.01 && (long - 10.1).abs() < 0.01, "{short} {long}");
        let ratio = report.points[1].summary.ratio.unwrap();
        assert!((2.4..2.5).contains(&ratio.value), "{ratio:?}");
    }
}
