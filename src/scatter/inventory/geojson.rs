//! GeoJSON [RFC 7946] as a table: a feature is a row, its properties are the cells, its point is the position. Also
//! features one a line, and the JSON of ArcGIS, whose features have `attributes` instead.

use std::collections::BTreeMap;

use csv::StringRecord;
use serde_json::{Deserializer, Map, Value};

use super::super::ScatterError;
use super::Coordinates;
use super::place::PlaceColumns;
use super::text::{Row, Table};

/// Whether bytes are JSON rather than a table: their first letter is a bracket.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    bytes.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b'{')
}

/// A table of the features in `bytes`, and where its positions are. The line of a row is the number of its feature.
pub(super) fn read(bytes: &[u8], name: &str) -> Result<(Table, PlaceColumns), ScatterError> {
    let refused = |line: u64, message: String| ScatterError::Record { name: name.to_owned(), line, message };
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let mut features = Vec::new();
    let mut system = None;
    for value in Deserializer::from_slice(bytes).into_iter::<Value>() {
        let value = value.map_err(|error| {
            refused(error.line() as u64, format!("{error}: the file is not sound JSON; export it again"))
        })?;
        system = system.or_else(|| system_of(&value));
        collect(value, &mut features);
    }
    if features.is_empty() {
        let message =
            "the JSON has no features: export the trees as GeoJSON, a list of features that are points".to_owned();
        return Err(refused(1, message));
    }

    let mut columns: BTreeMap<String, usize> = BTreeMap::new();
    let mut names: Vec<String> = vec!["geometry x".to_owned(), "geometry y".to_owned()];
    for key in features.iter().filter_map(properties).flat_map(Map::keys) {
        if !columns.contains_key(key) {
            columns.insert(key.clone(), names.len());
            names.push(key.clone());
        }
    }
    let kind = |feature: &Value| {
        let geometry = feature.get("geometry")?;
        geometry.get("type").and_then(Value::as_str).map(str::to_owned)
    };
    if features.iter().all(|feature| feature.get("geometry").and_then(position).is_none()) {
        let kind = features.iter().find_map(kind).unwrap_or_else(|| "without geometry".to_owned());
        let message = format!(
            "none of its {} features is a point (the first: {kind}): export the trees as points",
            features.len()
        );
        return Err(refused(1, message));
    }
    let (mut rows, mut degrees) = (Vec::with_capacity(features.len()), true);
    for (feature, line) in features.iter().zip(1u64..) {
        let mut cells = vec![String::new(); names.len()];
        if let Some((x, y)) = feature.get("geometry").and_then(position) {
            degrees &= x.abs() <= 360.0 && y.abs() <= 90.0;
            cells[0] = x.to_string();
            cells[1] = y.to_string();
        }
        for (key, value) in properties(feature).into_iter().flatten() {
            if let Some(cell) = columns.get(key).and_then(|column| cells.get_mut(*column)) {
                *cell = text(value);
            }
        }
        // A file with many properties, few of them on each tree, would keep the empty ones of every row.
        let filled = cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
        cells.truncate(filled.max(2));
        rows.push(Row { line, cells: StringRecord::from(cells) });
    }
    let geographic = degrees || matches!(system, Some(4326 | 4258 | 4269));
    let mut notes = Vec::new();
    if !geographic {
        let which = system.map_or("a system that is not stated".to_owned(), |code| format!("EPSG:{code}"));
        notes.push(format!("the positions are no degrees: they are read as metres of {which}"));
    }
    let coordinates = if geographic { Coordinates::Geographic } else { Coordinates::Planar };
    let place = PlaceColumns::Two { x: 0, y: 1, coordinates, metres_per_unit: 1.0 };
    let header = StringRecord::from(names);
    Ok((
        Table {
            header,
            rows,
            ragged: Vec::new(),
            decimal_comma: false,
            epsg: system.and_then(|code| u32::try_from(code).ok()),
            notes,
        },
        place,
    ))
}

fn properties(feature: &Value) -> Option<&Map<String, Value>> {
    feature.get("properties").or_else(|| feature.get("attributes"))?.as_object()
}

/// The EPSG code that a file names.
fn system_of(value: &Value) -> Option<u64> {
    let esri = value.get("spatialReference").and_then(|system| system.get("wkid")?.as_u64());
    let name = value.get("crs").and_then(|crs| crs.get("properties")?.get("name")?.as_str());
    let code =
        name.and_then(|name| if name.contains("CRS84") { Some(4326) } else { name.rsplit(':').next()?.parse().ok() });
    esri.or(code)
}

/// The features of a value: of a collection, or itself.
fn collect(mut value: Value, features: &mut Vec<Value>) {
    if let Some(list) = value.get_mut("features").and_then(Value::as_array_mut) {
        features.append(list);
    } else if value.get("geometry").is_some() {
        features.push(value);
    }
}

/// The position of a point, or of the first of several.
pub(super) fn position(geometry: &Value) -> Option<(f64, f64)> {
    let pair = |list: &Value| Some((list.get(0)?.as_f64()?, list.get(1)?.as_f64()?));
    let coordinates = geometry.get("coordinates");
    let found = match geometry.get("type").and_then(Value::as_str) {
        Some("Point") => pair(coordinates?)?,
        Some("MultiPoint") => pair(coordinates?.get(0)?)?,
        Some(_) => return None,
        None => (geometry.get("x")?.as_f64()?, geometry.get("y")?.as_f64()?),
    };
    (found.0.is_finite() && found.1.is_finite()).then_some(found)
}

/// A property as the text of a cell.
fn text(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.trim().to_owned(),
        other => other.to_string(),
    }
}
