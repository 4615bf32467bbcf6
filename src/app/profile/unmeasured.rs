//! The records of views and settings as they are before anything is measured.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    record::{PointRecord, ViewRecord},
    settings,
    sweep::Point,
    views::ProfileView,
};

/// The record of a view.
pub fn view_record(view: &ProfileView) -> ViewRecord {
    let (x, y, z) = view.pose.position;
    ViewRecord {
        name: view.name.clone(),
        seconds: view.seconds,
        camera: [x, y, z, view.pose.yaw, view.pose.pitch],
        instant: view.instant.to_rfc3339(),
        reference: None,
    }
}

/// The records of `points`.
pub fn point_records(points: &[Point]) -> Vec<PointRecord> {
    let swept: BTreeSet<&str> =
        points.iter().flat_map(|point| &point.settings).map(|(name, _)| name.as_str()).collect();
    let record = |point: &Point| {
        let settings: BTreeMap<String, String> = point.settings.iter().cloned().collect();
        // What is set is told as it was written.
        let left = swept.iter().copied().filter(|name| !settings.contains_key(*name));
        let mut values = settings::values(&point.scene, left);
        values.extend(settings.clone());
        PointRecord { label: point.label(), unranked: point.is_unranked(), settings, values, ..PointRecord::default() }
    };
    points.iter().map(record).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        app::profile::{Combination, ProfileReport, Sweep, csv, set_setting, sweep::points},
        scene::Scene,
    };

    /// A sweep over 15, 40 and 60 had no 40 in its table where the scene itself has 40.
    #[test]
    fn the_scene_as_written_has_its_value_of_what_is_swept() -> Result<(), Box<dyn std::error::Error>> {
        let mut scene = Scene::default();
        set_setting(&mut scene, "quality.near_distance", "40")?;
        let sweep: Sweep = "quality.near_distance=15,40,60".parse()?;
        let records = point_records(&points(&scene, &[sweep], Combination::All)?);
        let values: Vec<&str> = records.iter().map(|record| record.values["quality.near_distance"].as_str()).collect();
        assert_eq!(values, ["40", "15", "60"]);
        // Reports find each other's settings by what was set.
        assert!(records[0].settings.is_empty() && records[1].settings.len() == 1);
        let report = ProfileReport { points: records, ..ProfileReport::default() };
        let table = String::from_utf8(csv::points(&report))?;
        let cells: Vec<&str> = table.lines().filter_map(|line| line.rsplit(',').next()).collect();
        assert_eq!(cells, ["quality.near_distance", "40", "15", "60"]);
        Ok(())
    }
}
