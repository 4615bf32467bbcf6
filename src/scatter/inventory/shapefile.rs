//! A shapefile as a table: a point is a row, and its record in the `.dbf` beside it holds the cells.
//!
//! | file | what is read |
//! |---|---|
//! | `.shp` | points, also with height or measure; of several points the first |
//! | `.dbf` | the columns; without it there are only positions |
//! | `.cpg` | the encoding of its text; without it that of the table |
//! | `.prj` | the coordinate system |

use std::fs::File;
use std::io::{BufReader, Cursor};
use std::path::{Path, PathBuf};

use csv::StringRecord;
use shapefile::dbase::{self, FieldValue, encoding::DynEncoding};
use shapefile::{Shape, ShapeReader};

use super::super::ScatterError;
use super::Coordinates;
use super::place::PlaceColumns;
use super::text::{Row, Table};

/// The largest side file with the encoding or the coordinate system, bytes.
const LARGEST: u64 = 1 << 16;

/// Whether bytes are those of a `.shp`.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x00\x00\x27\x0A")
}

/// The file beside `path` with another ending, in letters of any case.
fn beside(path: &Path, ending: &str) -> Option<PathBuf> {
    let stem = path.file_stem()?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut found: Vec<PathBuf> = std::fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|file| file.file_stem() == Some(stem))
        .filter(|file| file.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending)))
        .collect();
    found.sort();
    found.into_iter().next()
}

fn text_beside(path: &Path, ending: &str) -> Option<String> {
    let file = beside(path, ending)?;
    let small = std::fs::metadata(&file).is_ok_and(|found| found.is_file() && found.len() <= LARGEST);
    let bytes = small.then(|| std::fs::read(&file).ok()).flatten()?;
    let text = String::from_utf8_lossy(&bytes);
    Some(text.trim_start_matches('\u{feff}').trim().to_owned())
}

/// A table of the points in the file at `path` with these `bytes`, where its positions are, and the text of its `.prj`. The
/// line of a row is the number of its point.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<(Table, PlaceColumns, Option<String>), ScatterError> {
    let name = path.display().to_string();
    let refused = |line: u64, message: String| ScatterError::Record { name: name.clone(), line, message };
    let damaged = |line: u64, error: &dyn std::fmt::Display| {
        refused(line, format!("the shapefile cannot be read ({error}): copy or export it again, with all of its files"))
    };
    let mut notes = Vec::new();
    let mut shapes = Vec::new();
    let mut reader = ShapeReader::new(Cursor::new(bytes)).map_err(|error| damaged(1, &error))?;
    for (shape, line) in reader.iter_shapes().zip(1u64..) {
        shapes.push(shape.map_err(|error| damaged(line, &error))?);
    }
    let records = records(path, shapes.len()).map_err(|(line, error)| damaged(line, &error))?;
    if records.is_none() {
        notes.push("there is no .dbf beside it: only positions are known".to_owned());
    }
    let (fields, records) = records.unwrap_or_default();
    let mut header = vec!["geometry x".to_owned(), "geometry y".to_owned()];
    header.extend(fields.iter().cloned());

    let (mut rows, mut degrees, mut points) = (Vec::with_capacity(shapes.len()), true, 0usize);
    for (number, shape) in shapes.iter().enumerate() {
        let mut cells = vec![String::new(); 2];
        if let Some((x, y)) = position(shape) {
            degrees &= x.abs() <= 360.0 && y.abs() <= 90.0;
            cells = vec![x.to_string(), y.to_string()];
            points += 1;
        }
        if let Some(record) = records.get(number) {
            cells.extend(fields.iter().map(|field| record.get(field).map(text).unwrap_or_default()));
        }
        rows.push(Row { line: number as u64 + 1, cells: StringRecord::from(cells) });
    }
    if points == 0 {
        let kind = shapes.first().map_or("it is empty".to_owned(), |shape| format!("the first: {}", shape.shapetype()));
        let message = format!("none of its {} shapes is a point ({kind}): export the trees as points", rows.len());
        return Err(refused(1, message));
    }

    let system = text_beside(path, "prj").filter(|text| !text.is_empty());
    let geographic = match &system {
        Some(text) => ["GEOGCS", "GEOGCRS", "GEODCRS"].iter().any(|word| text.to_ascii_uppercase().starts_with(word)),
        None => degrees,
    };
    if system.is_none() {
        let read_as = if geographic { "degrees" } else { "metres of a system that is not stated" };
        notes.push(format!("there is no .prj beside it: the positions are read as {read_as}"));
    }
    let coordinates = if geographic { Coordinates::Geographic } else { Coordinates::Planar };
    let place = PlaceColumns::Two { x: 0, y: 1, coordinates, metres_per_unit: 1.0 };
    let table =
        Table { header: StringRecord::from(header), rows, ragged: Vec::new(), decimal_comma: false, epsg: None, notes };
    Ok((table, place, system))
}

/// The names of the columns and the records of `count` points in the `.dbf` beside `path`; `None` without such a file. The
/// error is that of a line.
fn records(path: &Path, count: usize) -> Result<Option<(Vec<String>, Vec<dbase::Record>)>, (u64, String)> {
    let Some(file) = beside(path, "dbf") else { return Ok(None) };
    let source = BufReader::new(File::open(&file).map_err(|error| (1, error.to_string()))?);
    let mut builder = dbase::ReaderBuilder::new();
    if let Some(encoding) = text_beside(path, "cpg").and_then(|label| DynEncoding::from_name(&label)) {
        builder = builder.with_encoding(encoding);
    }
    let mut reader = builder.build(source).map_err(|error| (1, error.to_string()))?;
    let names = reader.fields().iter().map(|field| field.name().to_owned()).collect();
    let mut records = Vec::new();
    // A damaged header may promise any number of records.
    for (record, line) in reader.iter_records().take(count).zip(1u64..) {
        records.push(record.map_err(|error| (line, error.to_string()))?);
    }
    if records.len() < count {
        return Err((records.len() as u64 + 1, "its .dbf has fewer records than there are points".to_owned()));
    }
    Ok(Some((names, records)))
}

/// The position of a point, or of the first of several.
fn position(shape: &Shape) -> Option<(f64, f64)> {
    let (x, y) = match shape {
        Shape::Point(point) => (point.x, point.y),
        Shape::PointM(point) => (point.x, point.y),
        Shape::PointZ(point) => (point.x, point.y),
        Shape::Multipoint(points) => points.points().first().map(|point| (point.x, point.y))?,
        Shape::MultipointM(points) => points.points().first().map(|point| (point.x, point.y))?,
        Shape::MultipointZ(points) => points.points().first().map(|point| (point.x, point.y))?,
        _ => return None,
    };
    (x.is_finite() && y.is_finite()).then_some((x, y))
}

/// A value as the text of a cell.
fn text(value: &FieldValue) -> String {
    match value {
        FieldValue::Character(text) => text.as_deref().unwrap_or_default().trim().to_owned(),
        FieldValue::Memo(text) => text.trim().to_owned(),
        FieldValue::Numeric(number) => number.map(|number| number.to_string()).unwrap_or_default(),
        FieldValue::Float(number) => number.map(|number| number.to_string()).unwrap_or_default(),
        FieldValue::Integer(number) => number.to_string(),
        FieldValue::Double(number) | FieldValue::Currency(number) => number.to_string(),
        FieldValue::Logical(yes) => yes.map(|yes| yes.to_string()).unwrap_or_default(),
        FieldValue::Date(date) => {
            date.map(|date| format!("{:04}-{:02}-{:02}", date.year(), date.month(), date.day())).unwrap_or_default()
        }
        FieldValue::DateTime(time) => {
            let date = time.date();
            format!("{:04}-{:02}-{:02}", date.year(), date.month(), date.day())
        }
    }
}
