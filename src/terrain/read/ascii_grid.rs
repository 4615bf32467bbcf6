//! ESRI ASCII grids ("Arc/Info ASCII Grid"): a header of keys and numbers, then the heights row by row from the
//! north-west.

use glam::DVec2;

use super::{Grid, Raster, Source, Window, sentinels, side_files};
use crate::terrain::{CoordinateSystem, MAX_SAMPLES, TerrainError, Warning};

const KEYS: [&str; 10] =
    ["ncols", "nrows", "xllcorner", "xllcenter", "yllcorner", "yllcenter", "cellsize", "dx", "dy", "nodata_value"];

/// The mark of missing data of a header without NODATA_value.
const DEFAULT_MISSING: f64 = -9999.0;

/// Maximum size of a text in bytes. It is held in memory as a whole.
const MAX_TEXT: u64 = 4 << 30;

/// Whether a file starts like an ASCII grid, with one of the keys of a header.
pub(super) fn recognises(start: &[u8]) -> bool {
    let mut words = Words::new(start);
    words.next().is_some_and(|word| key_of(word.text).is_some())
}

pub(super) fn read(source: &Source) -> Result<Raster, TerrainError> {
    if source.length > MAX_TEXT {
        return Err(
            source.unsupported("a text of more than 4 GiB", "convert it with `gdal_translate -of GTiff IN OUT.tif`")
        );
    }
    let text = source.all()?;
    let mut words = Words::new(&text);
    let header = Header::read(source, &mut words)?;
    // The format's page says that the key is optional and its default is -9999.
    let (grid, missing) = (header.grid(source)?, header.missing.or(Some(DEFAULT_MISSING)));
    let window = source.window(&grid)?;
    let (system, warning) = match source.options.coordinate_system.or_else(|| side_files::system(source)) {
        Some(system) => (system, Warning::place_unknown(system)),
        None => {
            let far = grid.position(grid.columns - 1, grid.rows - 1);
            let degrees = grid.step.max_element() < 0.1
                && [grid.first, far].iter().all(|corner| corner.x.abs() <= 360.0 && corner.y.abs() <= 90.0);
            let system = if degrees { CoordinateSystem::Geographic } else { CoordinateSystem::Local };
            (system, Some(Warning::AssumedCoordinates { degrees }))
        }
    };
    let mut heights = read_heights(source, &mut words, &grid, &window, missing)?;
    let mut warnings: Vec<Warning> = warning.into_iter().collect();
    warnings.extend(sentinels::remove(&mut heights));
    if let Some(metres) = system.metres_per_height_unit().filter(|metres| *metres != 1.0) {
        heights.iter_mut().for_each(|height| *height = (f64::from(*height) * metres) as f32);
    }
    Ok(Raster { grid, window, system, heights, warnings })
}

fn read_heights(
    source: &Source,
    words: &mut Words,
    grid: &Grid,
    window: &Window,
    missing: Option<f64>,
) -> Result<Vec<f32>, TerrainError> {
    // A value takes at least a digit and a space, so the size of the text limits the number of values in a header.
    let promised = grid.columns.checked_mul(grid.rows);
    if promised.is_none_or(|count| count > words.rest() / 2 + 1) {
        return Err(source.malformed(
            "header",
            format!(
                "{} columns x {} rows do not fit into the {} bytes that follow",
                grid.columns,
                grid.rows,
                words.rest()
            ),
            "the file is cut off or its ncols and nrows are wrong: fetch or export it again",
        ));
    }
    let mut heights = Vec::with_capacity(window.columns * window.rows);
    for row in 0..grid.rows {
        let row_inside = (window.row..window.row + window.rows).contains(&row);
        for column in 0..grid.columns {
            let Some(word) = words.next() else {
                return Err(source.malformed(
                    format!("line {}", words.line),
                    format!(
                        "the file ends at row {} of {}, column {} of {}",
                        row + 1,
                        grid.rows,
                        column + 1,
                        grid.columns
                    ),
                    "fetch or export it again",
                ));
            };
            if !row_inside || !(window.column..window.column + window.columns).contains(&column) {
                continue;
            }
            let value = number(source, &word)?;
            heights.push(if missing == Some(value) || !value.is_finite() { f32::NAN } else { value as f32 });
        }
    }
    if let Some(word) = words.next() {
        return Err(source.malformed(
            format!("line {}, column {}", word.line, word.column),
            format!("there are more than the {} x {} values that the header announces", grid.columns, grid.rows),
            "correct ncols and nrows, or export the file again",
        ));
    }
    Ok(heights)
}

#[derive(Default)]
struct Header {
    columns: Option<usize>,
    rows: Option<usize>,
    x: Option<(f64, bool)>,
    y: Option<(f64, bool)>,
    step: [Option<f64>; 2],
    missing: Option<f64>,
}

impl Header {
    fn read(source: &Source, words: &mut Words) -> Result<Self, TerrainError> {
        let mut header = Header::default();
        loop {
            let before = words.clone();
            let Some(word) = words.next() else { return Ok(header) };
            let Some(key) = key_of(word.text) else {
                if word.text[0].is_ascii_alphabetic() && number(source, &word).is_err() {
                    return Err(source.malformed(
                        format!("line {}, column {}", word.line, word.column),
                        format!("\"{}\" is not a key of an ASCII grid", String::from_utf8_lossy(word.text)),
                        format!("known keys are {}", KEYS.join(", ")),
                    ));
                }
                *words = before;
                return Ok(header);
            };
            let Some(value_word) = words.next() else {
                return Err(source.malformed(
                    format!("line {}", word.line),
                    format!("{key} has no value"),
                    "complete the header",
                ));
            };
            let value = number(source, &value_word)?;
            if !value.is_finite() && key != "nodata_value" {
                return Err(source.malformed(
                    format!("line {}, column {}", value_word.line, value_word.column),
                    format!("{key} is {value}"),
                    "give a finite number",
                ));
            }
            match key {
                "ncols" | "nrows" => {
                    if value < 0.0 || value.fract() != 0.0 || value > MAX_SAMPLES as f64 {
                        return Err(source.malformed(
                            format!("line {}, column {}", value_word.line, value_word.column),
                            format!("{key} is {value}"),
                            format!("give a whole number from 2 to {MAX_SAMPLES}"),
                        ));
                    }
                    *(if key == "ncols" { &mut header.columns } else { &mut header.rows }) = Some(value as usize);
                }
                "xllcorner" => header.x = Some((value, false)),
                "xllcenter" => header.x = Some((value, true)),
                "yllcorner" => header.y = Some((value, false)),
                "yllcenter" => header.y = Some((value, true)),
                "cellsize" => header.step = [Some(value); 2],
                "dx" => header.step[0] = Some(value),
                "dy" => header.step[1] = Some(value),
                _ => header.missing = Some(value),
            }
        }
    }

    fn grid(&self, source: &Source) -> Result<Grid, TerrainError> {
        let lacking = |key: &str| source.malformed("header", format!("{key} is missing"), "complete the header");
        let columns = self.columns.ok_or_else(|| lacking("ncols"))?;
        let rows = self.rows.ok_or_else(|| lacking("nrows"))?;
        let (x, x_centre) = self.x.ok_or_else(|| lacking("xllcorner or xllcenter"))?;
        let (y, y_centre) = self.y.ok_or_else(|| lacking("yllcorner or yllcenter"))?;
        let dx = self.step[0].ok_or_else(|| lacking("cellsize (or dx)"))?;
        let dy = self.step[1].ok_or_else(|| lacking("cellsize (or dy)"))?;
        if dx <= 0.0 || dy <= 0.0 {
            return Err(source.malformed("header", format!("the cell size is {dx} x {dy}"), "give one above 0"));
        }
        let half = |centre: bool| if centre { 0.0 } else { 0.5 };
        let south = y + half(y_centre) * dy;
        Ok(Grid {
            columns,
            rows,
            first: DVec2::new(x + half(x_centre) * dx, south + rows.saturating_sub(1) as f64 * dy),
            step: DVec2::new(dx, dy),
        })
    }
}

fn key_of(word: &[u8]) -> Option<&'static str> {
    KEYS.into_iter().find(|key| word.eq_ignore_ascii_case(key.as_bytes()))
}

fn number(source: &Source, word: &Word) -> Result<f64, TerrainError> {
    let text = std::str::from_utf8(word.text).ok();
    text.and_then(|text| text.parse::<f64>().ok()).ok_or_else(|| {
        let remedy = if word.text.contains(&b',') {
            "write numbers with a decimal point, not a comma"
        } else {
            "write a number here; missing values are written as the header's NODATA_value"
        };
        let shown: String = String::from_utf8_lossy(word.text).chars().take(40).collect();
        source.malformed(
            format!("line {}, column {}", word.line, word.column),
            format!("\"{shown}\" is not a number"),
            remedy,
        )
    })
}

/// Words of a text with the line and column where each begins, both counted from 1.
#[derive(Clone)]
struct Words<'a> {
    text: &'a [u8],
    at: usize,
    line: usize,
    line_start: usize,
}

struct Word<'a> {
    text: &'a [u8],
    line: usize,
    column: usize,
}

impl<'a> Words<'a> {
    fn new(text: &'a [u8]) -> Self {
        let at = if text.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { text, at, line: 1, line_start: at }
    }

    /// Number of bytes that were not read yet.
    fn rest(&self) -> usize {
        self.text.len() - self.at
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = Word<'a>;

    fn next(&mut self) -> Option<Word<'a>> {
        while let Some(byte) = self.text.get(self.at).filter(|byte| byte.is_ascii_whitespace()) {
            self.at += 1;
            if *byte == b'\n' {
                self.line += 1;
                self.line_start = self.at;
            }
        }
        let start = self.at;
        while self.text.get(self.at).is_some_and(|byte| !byte.is_ascii_whitespace()) {
            self.at += 1;
        }
        (self.at > start).then(|| Word {
            text: &self.text[start..self.at],
            line: self.line,
            column: start - self.line_start + 1,
        })
    }
}
