//! What a comparison found, as text and as JSON.

use serde::{Deserialize, Serialize};

use super::{CompareOptions, error::CompareError};
use crate::measure::{BLOCK, Change, Comparison, FILTERED, Light, Picture, mean};

/// Version of the JSON; it rises when a member changes its meaning or goes.
pub const COMPARE_VERSION: u32 = 1;

/// The result of a comparison. Its JSON is documented in docs/reports.md.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CompareReport {
    /// `"canopy-compare"`.
    pub schema: String,
    /// [`COMPARE_VERSION`].
    pub version: u32,
    /// What was judged.
    pub test: String,
    /// What it should look like.
    pub reference: String,
    /// Pixels per degree.
    pub pixels_per_degree: f32,
    /// `"display"` or `"scene"`; empty without frames.
    pub light: String,
    /// Width and height in pixels.
    pub size: (usize, usize),
    /// The images in order.
    pub frames: Vec<FrameComparison>,
    /// Maps of errors that were written.
    #[serde(skip)]
    pub maps: Vec<std::path::PathBuf>,
}

/// One image against its reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameComparison {
    /// Its name: the file, or what tells it from the other frames.
    pub name: String,
    /// How far it is from the reference.
    #[serde(flatten)]
    pub comparison: Comparison,
    /// The change since the frame before; `None` for the first one.
    pub change: Option<Change>,
}

impl CompareReport {
    pub(super) fn new(options: &CompareOptions) -> Self {
        Self {
            schema: "canopy-compare".to_owned(),
            version: COMPARE_VERSION,
            test: options.test.display().to_string(),
            reference: options.reference.display().to_string(),
            pixels_per_degree: options.pixels_per_degree,
            light: String::new(),
            size: (0, 0),
            frames: Vec::new(),
            maps: Vec::new(),
        }
    }

    pub(super) fn add(&mut self, name: &str, reference: &Picture, comparison: Comparison, change: Option<Change>) {
        self.light = match reference.light {
            Light::Display => "display",
            Light::Scene => "scene",
        }
        .to_owned();
        self.size = reference.size();
        self.frames.push(FrameComparison { name: name.to_owned(), comparison, change });
    }

    /// The greatest mean FLIP of any image, with its name.
    pub fn worst(&self) -> Option<(&str, f64)> {
        let flip = |frame: &&FrameComparison| frame.comparison.flip.mean;
        let worst = self.frames.iter().max_by(|a, b| flip(a).total_cmp(&flip(b)))?;
        Some((&worst.name, flip(&worst)))
    }

    /// Fails if the mean FLIP of an image is above `limit`, or no number.
    ///
    /// # Errors
    /// [`CompareError::Limit`] with the worst image.
    pub fn check_limit(&self, limit: f64) -> Result<(), CompareError> {
        match self.worst() {
            Some((name, found)) if found > limit || found.is_nan() => {
                Err(CompareError::Limit { name: name.to_owned(), found, limit })
            }
            _ => Ok(()),
        }
    }

    /// The report in lines for a terminal.
    pub fn lines(&self) -> Vec<String> {
        let (width, height) = self.size;
        let shown = if self.light == "scene" { "radiance of a scene" } else { "as a display shows it" };
        let mut lines = vec![
            format!("test       {}", self.test),
            format!("reference  {}", self.reference),
            format!("{width}x{height} pixels, {shown}, {:.1} pixels per degree", self.pixels_per_degree),
            String::new(),
        ];
        match self.frames.as_slice() {
            [one] if one.change.is_none() => lines.extend(self.single(&one.comparison)),
            frames => lines.extend(table(frames)),
        }
        lines
    }

    fn single(&self, found: &Comparison) -> Vec<String> {
        let (flip, area) = (&found.flip, &found.area);
        let filtered: Vec<String> = FILTERED
            .iter()
            .zip(found.filtered_flip)
            .map(|(side, flip)| format!("{side}x{side} {}", figure(flip, 4)))
            .collect();
        let unit = if self.light == "scene" { "in the images' unit" } else { "of white" };
        vec![
            format!(
                "FLIP            mean {:.4}   median {:.4}   95 % {:.4}   99 % {:.4}   maximum {:.4}   ({} pixels)",
                flip.mean, flip.p50, flip.p95, flip.p99, flip.maximum, found.pixels
            ),
            format!("FLIP of blocks  {}", filtered.join("   ")),
            format!(
                "RMSE            {:.6} {unit}, {} of the reference's own; greatest error {:.6}",
                found.rmse,
                figure(found.relative_rmse, 4),
                found.greatest_error
            ),
            format!("luminance       {} of the reference's", figure(area.luminance_ratio, 4)),
            format!(
                "local contrast  {} of the reference's, in blocks of {BLOCK}x{BLOCK} pixels",
                figure(area.contrast_ratio, 4)
            ),
            format!("correlation     {} of the blocks' means", figure(area.block_correlation, 4)),
        ]
    }
}

/// A number with so many decimals, or "n/a".
pub(in crate::app) fn figure(value: Option<f64>, decimals: usize) -> String {
    match value {
        Some(value) if value.is_finite() => format!("{value:.decimals$}"),
        _ => "n/a".to_owned(),
    }
}

fn table(frames: &[FrameComparison]) -> Vec<String> {
    const HEADERS: [&str; 11] = [
        "frame",
        "FLIP",
        "95 %",
        "maximum",
        "luminance",
        "contrast",
        "correlation",
        "change",
        "reference's",
        "excess",
        "popping %",
    ];
    let row = |frame: &FrameComparison| -> Vec<Option<f64>> {
        let (found, area) = (&frame.comparison, &frame.comparison.area);
        let change = frame.change;
        vec![
            Some(found.flip.mean),
            Some(found.flip.p95),
            Some(found.flip.maximum),
            area.luminance_ratio,
            area.contrast_ratio,
            area.block_correlation,
            change.map(|change| change.test),
            change.map(|change| change.reference),
            change.map(|change| change.excess()),
            change.map(|change| 100.0 * change.popping),
        ]
    };
    let rows: Vec<Vec<Option<f64>>> = frames.iter().map(row).collect();
    let means = (0..HEADERS.len() - 1).map(|column| {
        let known: Vec<f64> = rows.iter().filter_map(|row| row[column]).collect();
        mean(&known)
    });
    let names = frames.iter().map(|frame| frame.name.as_str()).chain(["mean"]);
    let cells = names.zip(rows.iter().cloned().chain([means.collect()])).map(|(name, row)| {
        std::iter::once(name.to_owned()).chain(row.into_iter().map(|value| figure(value, 4))).collect::<Vec<_>>()
    });
    let all: Vec<Vec<String>> = std::iter::once(HEADERS.map(str::to_owned).to_vec()).chain(cells).collect();
    aligned(&all)
}

/// Rows of cells as lines: the first column to the left, the others to the right.
pub(in crate::app) fn aligned(rows: &[Vec<String>]) -> Vec<String> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).enumerate().map(|(column, (cell, width))| match column {
            0 => format!("{cell:<width$}"),
            _ => format!("{cell:>width$}"),
        });
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}
