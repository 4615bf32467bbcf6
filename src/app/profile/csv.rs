//! The tables of a report. Times of frames have the columns of PresentMon 2, so that its viewers read them.

use std::collections::BTreeSet;

use super::record::{PROFILE_VERSION, ProfileReport};

/// What a figure that was not measured is called, as in PresentMon.
const MISSING: &str = "NA";

fn number(value: Option<f64>, decimals: usize) -> String {
    match value {
        Some(value) if value.is_finite() => format!("{value:.decimals$}"),
        _ => MISSING.to_owned(),
    }
}

fn table(rows: impl Iterator<Item = Vec<String>>) -> Vec<u8> {
    let mut writer = ::csv::WriterBuilder::new().from_writer(Vec::new());
    for row in rows {
        // A vector takes everything.
        let _ = writer.write_record(&row);
    }
    writer.into_inner().unwrap_or_default()
}

/// One row for each frame of each round.
pub fn frames(report: &ProfileReport) -> Vec<u8> {
    let passes: BTreeSet<&String> = report
        .points
        .iter()
        .flat_map(|point| &point.rounds)
        .flat_map(|round| &round.frames)
        .flat_map(|frame| frame.passes.keys())
        .collect();
    let fixed = [
        "Application",
        "ProcessID",
        "CPUStartTime",
        "FrameTime",
        "CPUBusy",
        "CPUWait",
        "GPUTime",
        "GPUBusy",
        "CanopyVersion",
        "Point",
        "Settings",
        "Round",
        "View",
        "MsMainWorld",
        "MsRenderWorld",
    ];
    let header: Vec<String> =
        fixed.iter().map(|name| (*name).to_owned()).chain(passes.iter().map(|pass| format!("MsGpu_{pass}"))).collect();
    let rows = report.points.iter().enumerate().flat_map(|(index, point)| {
        let rounds = point.rounds.iter().enumerate();
        rounds.flat_map(move |(round, frames)| {
            frames.frames.iter().zip(&report.views).map(move |(frame, view)| (index, point, round, frame, view))
        })
    });
    let rows = rows.map(|(index, point, round, frame, view)| {
        let busy = frame.cpu_main.zip(frame.cpu_render).map(|(main, render)| main + render);
        let mut row = vec![
            "canopy".to_owned(),
            MISSING.to_owned(),
            number(Some(frame.start), 4),
            number(Some(frame.frame), 4),
            number(busy, 4),
            number(busy.map(|busy| (frame.frame - busy).max(0.0)), 4),
            // The time from the first to the last pass is not known, only the sum of the passes.
            MISSING.to_owned(),
            number(frame.gpu, 4),
            PROFILE_VERSION.to_string(),
            index.to_string(),
            point.label.clone(),
            round.to_string(),
            view.name.clone(),
            number(frame.cpu_main, 4),
            number(frame.cpu_render, 4),
        ];
        row.extend(passes.iter().map(|pass| number(frame.passes.get(*pass).copied(), 4)));
        row
    });
    table(std::iter::once(header).chain(rows.collect::<Vec<_>>()))
}

/// One row for each combination of settings.
pub fn points(report: &ProfileReport) -> Vec<u8> {
    let settings: BTreeSet<&String> = report.points.iter().flat_map(|point| point.settings.keys()).collect();
    let levels: BTreeSet<&String> =
        report.points.iter().flat_map(|point| &point.summary.levels).map(|level| &level.name).collect();
    let fixed = [
        "Point",
        "Label",
        "MsFrameMean",
        "MsFrameMeanLow",
        "MsFrameMeanHigh",
        "MsFrameP50",
        "MsFrameP95",
        "MsFrameP99",
        "MsFrame1PercentLow",
        "Ratio",
        "RatioLow",
        "RatioHigh",
        "MsMainWorldP50",
        "MsRenderWorldP50",
        "MsGpuP50",
        "Flip",
        "FlipWorst",
        "Flip4",
        "Flip8",
        "Flip16",
        "LuminanceRatio",
        "ContrastRatio",
        "BlockCorrelation",
        "ExcessChange",
        "Popping",
        "Triangles",
        "ForestCalls",
        "UploadedBytes",
        "FragmentsPerPixel",
        "DeviceBytes",
        "ProgramBytes",
        "OnFront",
        "Knee",
    ];
    let header = fixed.iter().map(|name| (*name).to_owned());
    let header = header.chain(settings.iter().map(|name| (*name).clone()));
    let header: Vec<String> = header.chain(levels.iter().map(|name| format!("Trees_{name}"))).collect();
    let row = |(index, point): (usize, &super::PointRecord)| {
        let found = &point.summary;
        let (frame, mean, ratio) = (found.frame, found.mean, found.ratio);
        let bytes = |bytes: Option<u64>| bytes.map_or(MISSING.to_owned(), |bytes| bytes.to_string());
        let mut row = vec![
            index.to_string(),
            point.label.clone(),
            number(found.mean_frame, 4),
            number(mean.map(|mean| mean.low), 4),
            number(mean.map(|mean| mean.high), 4),
            number(frame.map(|frame| frame.p50), 4),
            number(frame.map(|frame| frame.p95), 4),
            number(frame.map(|frame| frame.p99), 4),
            number(found.low_1_percent, 4),
            number(ratio.map(|ratio| ratio.value), 4),
            number(ratio.map(|ratio| ratio.low), 4),
            number(ratio.map(|ratio| ratio.high), 4),
            number(found.cpu_main.map(|time| time.p50), 4),
            number(found.cpu_render.map(|time| time.p50), 4),
            number(found.gpu.map(|time| time.p50), 4),
            number(found.error, 6),
            number(found.worst_error, 6),
            number(found.filtered_error[0], 6),
            number(found.filtered_error[1], 6),
            number(found.filtered_error[2], 6),
            number(found.luminance_ratio, 4),
            number(found.contrast_ratio, 4),
            number(found.block_correlation, 4),
            number(found.excess_change, 6),
            number(found.popping, 6),
            number(found.triangles, 0),
            number(found.forest_calls, 1),
            number(found.uploaded_bytes, 0),
            number(found.fragments_per_pixel, 3),
            bytes(point.memory.device),
            bytes(point.memory.program),
            report.front.contains(&index).to_string(),
            (report.knee == Some(index)).to_string(),
        ];
        // Reports of earlier versions have the values that were set alone.
        let value = |name: &String| point.values.get(name).or_else(|| point.settings.get(name)).cloned();
        row.extend(settings.iter().map(|name| value(name).unwrap_or_default()));
        let trees = |name: &&&String| found.levels.iter().find(|level| level.name == ***name).map(|level| level.trees);
        row.extend(levels.iter().map(|name| number(trees(&name), 1)));
        row
    };
    table(std::iter::once(header).chain(report.points.iter().enumerate().map(row)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::profile::record::{FrameTime, PointRecord, Round, ViewRecord};

    #[test]
    fn what_was_not_measured_is_na_and_never_0() {
        let frame = FrameTime { start: 1.0, frame: 2.5, ..FrameTime::default() };
        let point = PointRecord {
            label: "a=1, b=\"2\"".to_owned(),
            rounds: vec![Round { forward: true, frames: vec![frame] }],
            ..PointRecord::default()
        };
        let report = ProfileReport {
            points: vec![point],
            views: vec![ViewRecord { name: "0000".to_owned(), ..ViewRecord::default() }],
            ..ProfileReport::default()
        };
        let text = String::from_utf8(frames(&report)).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[0].starts_with("Application,ProcessID,CPUStartTime,FrameTime,CPUBusy,CPUWait,GPUTime,GPUBusy"));
        assert_eq!(lines[1], "canopy,NA,1.0000,2.5000,NA,NA,NA,NA,2,0,\"a=1, b=\"\"2\"\"\",0,0000,NA,NA");
        let text = String::from_utf8(points(&report)).unwrap();
        let values = text.lines().nth(1).unwrap();
        assert!(!values.contains(",0.0") && values.matches(",NA").count() > 20, "{values}");
    }
}
