//! A report in lines for a terminal.

use super::{baseline::BaselineRow, error::LEAST_ROUNDS_FOR_RATIO, record::ProfileReport};
use crate::app::compare::{aligned, figure};

impl ProfileReport {
    /// The combinations of settings from fast to slow, those on the front marked.
    pub fn lines(&self) -> Vec<String> {
        let header =
            ["settings", "mean ms", "±", "p50", "p95", "1 % low", "ratio", "95 %", "FLIP", "worst", "change", ""];
        let mut order: Vec<usize> = (0..self.points.len()).collect();
        let time = |index: &usize| self.points[*index].summary.mean_frame.unwrap_or(f64::INFINITY);
        order.sort_by(|a, b| time(a).total_cmp(&time(b)));
        let row = |index: usize| {
            let (point, found) = (&self.points[index], &self.points[index].summary);
            let interval = found.ratio.map_or("n/a".to_owned(), |ratio| format!("{:.3}-{:.3}", ratio.low, ratio.high));
            let mark = match (self.knee == Some(index), self.front.contains(&index)) {
                (true, _) => "knee",
                (_, true) => "front",
                _ => "",
            };
            vec![
                point.label.clone(),
                figure(found.mean_frame, 2),
                figure(found.mean.map(|mean| 0.5 * (mean.high - mean.low)), 2),
                figure(found.frame.map(|frame| frame.p50), 2),
                figure(found.frame.map(|frame| frame.p95), 2),
                figure(found.low_1_percent, 2),
                figure(found.ratio.map(|ratio| ratio.value), 3),
                interval,
                figure(found.error, 4),
                figure(found.worst_error, 4),
                figure(found.excess_change, 4),
                mark.to_owned(),
            ]
        };
        let rows: Vec<Vec<String>> =
            std::iter::once(header.map(str::to_owned).to_vec()).chain(order.into_iter().map(row)).collect();
        let mut lines = aligned(&rows);
        let fewest = self.points.iter().map(|point| point.rounds.len()).min().unwrap_or(0);
        if self.points.len() > 1 && (1..LEAST_ROUNDS_FOR_RATIO as usize).contains(&fewest) {
            lines.push(format!(
                "Ratios need {LEAST_ROUNDS_FOR_RATIO} rounds, two in each order: the same command with --resume and --rounds \
                 {LEAST_ROUNDS_FOR_RATIO} or more adds to these."
            ));
        }
        lines
    }
}

impl BaselineRow {
    /// Rows in lines for a terminal.
    pub fn lines(rows: &[Self]) -> Vec<String> {
        let header = ["settings", "time / baseline", "95 %", "FLIP", "baseline's"].map(str::to_owned).to_vec();
        let row = |row: &Self| {
            vec![
                row.label.clone(),
                figure(row.time.map(|time| time.value), 3),
                row.time.map_or("n/a".to_owned(), |time| format!("{:.3}-{:.3}", time.low, time.high)),
                figure(row.error.0, 4),
                figure(row.error.1, 4),
            ]
        };
        aligned(&std::iter::once(header).chain(rows.iter().map(row)).collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::{PointRecord, Round};

    /// Ratios were "n/a" below four rounds, and nothing said why.
    #[test]
    fn how_many_rounds_a_ratio_needs_is_said() {
        let report = |rounds: usize, points: usize| {
            let point = PointRecord { rounds: vec![Round::default(); rounds], ..PointRecord::default() };
            ProfileReport { points: vec![point; points], ..ProfileReport::default() }
        };
        let says = |report: ProfileReport| report.lines().iter().any(|line| line.starts_with("Ratios need 4 rounds"));
        assert!(says(report(1, 2)) && says(report(3, 2)));
        assert!(!says(report(4, 2)) && !says(report(0, 2)) && !says(report(3, 1)));
    }
}
