//! Positions in tables: two columns, or both coordinates in one cell.

use csv::StringRecord;

use super::super::ScatterError;
use super::cells::number;
use super::text::Row;
use super::{Coordinates, names};

/// Where a table has its positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum PlaceColumns {
    /// A column for each coordinate.
    Two { x: usize, y: usize, coordinates: Coordinates, metres_per_unit: f64 },
    /// Both in one cell.
    One { column: usize, coordinates: Coordinates },
}

impl PlaceColumns {
    /// Kind of the positions.
    pub fn coordinates(&self) -> Coordinates {
        match self {
            Self::Two { coordinates, .. } | Self::One { coordinates, .. } => *coordinates,
        }
    }

    /// The columns of the east and the north coordinate.
    pub fn columns(&self) -> [usize; 2] {
        match *self {
            Self::Two { x, y, .. } => [x, y],
            Self::One { column, .. } => [column, column],
        }
    }

    /// The east (axis 0) or north (axis 1) coordinate of a row, in metres or degrees.
    pub fn coordinate(&self, axis: usize, cells: &StringRecord, decimal_comma: bool) -> Option<f64> {
        let cell = cells.get(*self.columns().get(axis)?)?;
        match self {
            Self::Two { metres_per_unit, .. } => Some(coordinate(cell, decimal_comma)? * metres_per_unit),
            Self::One { .. } => both(cell, true).map(|(x, y)| if axis == 0 { x } else { y }),
        }
    }

    /// Largest absolute value of a coordinate, and what is wrong beyond.
    pub fn limit(&self, axis: usize) -> Option<(f64, &'static str)> {
        Some(match (self.coordinates(), axis) {
            (Coordinates::Planar, _) => (f64::MAX, "is not finite"),
            // Longitudes are counted from -180 to 180 or from 0 to 360.
            (Coordinates::Geographic, 0) => (360.0, "is not a longitude (expected degrees within ±360)"),
            (Coordinates::Geographic, _) => (90.0, "is not a latitude (expected degrees within ±90)"),
        })
    }

    /// What is read from column `index`.
    pub fn meaning(&self, index: usize) -> Option<&'static str> {
        let axis = self.columns().iter().position(|column| *column == index)?;
        Some(match (self, self.coordinates(), axis) {
            (Self::One { .. }, Coordinates::Planar, _) => "position in metres",
            (Self::One { .. }, Coordinates::Geographic, _) => "longitude and latitude in degrees",
            (Self::Two { metres_per_unit, .. }, Coordinates::Planar, 0) if *metres_per_unit < 1.0 => {
                "position east in feet"
            }
            (Self::Two { metres_per_unit, .. }, Coordinates::Planar, _) if *metres_per_unit < 1.0 => {
                "position north in feet"
            }
            (_, Coordinates::Planar, 0) => "position east in metres",
            (_, Coordinates::Planar, _) => "position north in metres",
            (_, Coordinates::Geographic, 0) => "longitude in degrees",
            (_, Coordinates::Geographic, _) => "latitude in degrees",
        })
    }
}

/// Length of a foot of the US survey and of the state plane systems, in metres.
const SURVEY_FOOT: f64 = 1200.0 / 3937.0;
/// Cells that are looked at to tell what a column holds.
const LOOKED_AT: usize = 50;

/// A pair of columns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub x: usize,
    pub y: usize,
    pub geographic: bool,
    pub feet: bool,
}

/// All pairs of columns whose words differ only in the axis, the best first.
fn pairs(words: &[Vec<String>]) -> Vec<Pair> {
    let mut found: Vec<((usize, bool, usize), Pair)> = Vec::new();
    for (rank, axis) in names::AXES.iter().enumerate() {
        for (x, name) in words.iter().enumerate() {
            let Some(at) = name.iter().position(|word| word == axis.x) else { continue };
            let mut other = name.clone();
            if let Some(word) = other.get_mut(at) {
                axis.y.clone_into(word);
            }
            let Some(y) = words.iter().position(|name| *name == other).filter(|y| *y != x) else { continue };
            let has = |list: &[&str]| name.iter().any(|word| list.contains(&word.as_str()));
            let feet = !axis.geographic && has(&["sp", "ft", "feet", "stateplane", "usft"]);
            let elsewhere = has(&["crown", "photo", "tile", "pixel", "offset"]);
            if elsewhere || found.iter().any(|(_, pair)| pair.x == x && pair.y == y) {
                continue;
            }
            let metres = name.last().is_some_and(|word| word == "m");
            // One letter beside other words is a weak hint, unless the name says that it is a coordinate.
            let weak = usize::from(axis.x.len() == 1 && name.len() > 2);
            let penalty = usize::from(feet) * 1000 + weak * 20;
            found.push(((rank * 2 + penalty, !metres, name.len()), Pair { x, y, geographic: axis.geographic, feet }));
        }
    }
    found.sort_by_key(|(key, _)| *key);
    found.into_iter().map(|(_, pair)| pair).collect()
}

/// The best pair of columns by their names.
pub(super) fn pair_by_name(words: &[Vec<String>]) -> Option<Pair> {
    pairs(words).into_iter().next()
}

/// Finds the columns of the positions. `prefer` is the kind that is taken if the table has both.
pub(super) fn find(
    header: &StringRecord,
    rows: &[Row],
    decimal_comma: bool,
    prefer: Option<Coordinates>,
    name: &str,
) -> Result<PlaceColumns, ScatterError> {
    let words: Vec<Vec<String>> = header.iter().map(names::words).collect();
    let mut candidates: Vec<PlaceColumns> = pairs(&words)
        .into_iter()
        .map(|pair| {
            let degrees = pair.geographic || are_degrees(rows, pair.x, pair.y, decimal_comma);
            PlaceColumns::Two {
                x: pair.x,
                y: pair.y,
                coordinates: if degrees { Coordinates::Geographic } else { Coordinates::Planar },
                metres_per_unit: if pair.feet { SURVEY_FOOT } else { 1.0 },
            }
        })
        // Columns that have their names for another reason hold no numbers.
        .filter(|place| rows.is_empty() || has_values(rows, place, decimal_comma))
        .collect();
    candidates.extend((0..header.len()).filter_map(|column| one_cell(header, rows, column)));
    let preferred = candidates.iter().find(|place| prefer == Some(place.coordinates()));
    if let Some(place) = preferred.or(candidates.first()) {
        let degrees = candidates.iter().find(|place| place.coordinates() == Coordinates::Geographic);
        return Ok(degrees.map_or(*place, |degrees| compared(*place, *degrees, rows, decimal_comma)));
    }
    // Named columns without any number: their cells are reported one by one.
    if let Some(pair) = pair_by_name(&words) {
        let coordinates = if pair.geographic { Coordinates::Geographic } else { Coordinates::Planar };
        return Ok(PlaceColumns::Two { x: pair.x, y: pair.y, coordinates, metres_per_unit: 1.0 });
    }
    let found = header.iter().collect::<Vec<_>>().join(", ");
    Err(ScatterError::NoPosition { name: name.to_owned(), found })
}

/// The planar columns `place` in the unit that the degrees beside them tell; the degrees themselves where the two do not
/// match.
fn compared(place: PlaceColumns, degrees: PlaceColumns, rows: &[Row], decimal_comma: bool) -> PlaceColumns {
    let PlaceColumns::Two { x, y, coordinates: Coordinates::Planar, metres_per_unit } = place else { return place };
    let north: Vec<(f64, f64)> = rows
        .iter()
        .filter_map(|row| {
            let planar = place.coordinate(1, &row.cells, decimal_comma).filter(|value| *value != 0.0)?;
            Some((planar, degrees.coordinate(1, &row.cells, decimal_comma).filter(|value| *value != 0.0)?))
        })
        .collect();
    if north.len() < 5 || metres_per_unit != 1.0 {
        return place;
    }
    // Deviations of nine of ten, so that single wrong cells do not count.
    let spread = |value: fn(&(f64, f64)) -> f64| {
        let mut values: Vec<f64> = north.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        let at = |share: usize| values.get(values.len() * share / 20).copied().unwrap_or(0.0);
        at(19) - at(1)
    };
    // Metres of a degree of latitude.
    let metres = spread(|pair| pair.1) * 111_132.0;
    let ratio = spread(|pair| pair.0) / metres;
    if metres < 20.0 || (0.8..1.25).contains(&ratio) {
        place
    } else if (3.1..3.5).contains(&ratio) {
        PlaceColumns::Two { x, y, coordinates: Coordinates::Planar, metres_per_unit: SURVEY_FOOT }
    } else {
        degrees
    }
}

/// Whether some cells of a pair are numbers.
fn has_values(rows: &[Row], place: &PlaceColumns, decimal_comma: bool) -> bool {
    let PlaceColumns::Two { x, y, .. } = place else { return true };
    rows.iter().any(|row| {
        let value = |column: usize| row.cells.get(column).and_then(|cell| coordinate(cell, decimal_comma));
        value(*x).is_some() && value(*y).is_some()
    })
}

/// A coordinate: a number, or degrees, minutes and seconds.
pub(super) fn coordinate(cell: &str, decimal_comma: bool) -> Option<f64> {
    number(cell, decimal_comma).or_else(|| sexagesimal(cell))
}

/// Degrees from `48°12'30.5"N` or `48° 12.5' N`.
fn sexagesimal(cell: &str) -> Option<f64> {
    if !cell.contains(['°', 'º']) {
        return None;
    }
    let cell = cell.trim();
    let negative = cell.starts_with('-') || cell.contains(['S', 's', 'W', 'w']);
    let letters = |c: char| c.is_alphabetic() || "°º'’′\"”″ -+".contains(c);
    let parts: Vec<f64> =
        cell.split(letters).filter(|part| !part.is_empty()).map(|part| part.parse().ok()).collect::<Option<_>>()?;
    let (degrees, minutes, seconds) = match *parts {
        [degrees] => (degrees, 0.0, 0.0),
        [degrees, minutes] => (degrees, minutes, 0.0),
        [degrees, minutes, seconds] => (degrees, minutes, seconds),
        _ => return None,
    };
    let value = degrees + minutes / 60.0 + seconds / 3600.0;
    let sound = minutes < 60.0 && seconds < 60.0 && value.is_finite();
    sound.then_some(if negative { -value } else { value })
}

/// Whether columns of planar names hold degrees: all numbers are within the range of degrees, and the trees would stand
/// on each other if they were metres.
pub(super) fn are_degrees(rows: &[Row], x: usize, y: usize, decimal_comma: bool) -> bool {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let (mut count, mut fine) = (0usize, 0usize);
    for row in rows {
        let value = |column: usize| row.cells.get(column).and_then(|cell| number(cell, decimal_comma));
        let (Some(east), Some(north)) = (value(x), value(y)) else { continue };
        if (east, north) == (0.0, 0.0) {
            continue;
        }
        if east.abs() > 180.0 || north.abs() > 90.0 {
            return false;
        }
        count += 1;
        let decimals = |column: usize| {
            row.cells.get(column).and_then(|cell| cell.rsplit_once(['.', ','])).map_or(0, |(_, part)| part.len())
        };
        fine += usize::from(decimals(x).max(decimals(y)) >= 4);
        for (axis, value) in [east, north].into_iter().enumerate() {
            low[axis] = low[axis].min(value);
            high[axis] = high[axis].max(value);
        }
    }
    if count == 0 {
        return false;
    }
    let size = (high[0] - low[0]).max(high[1] - low[1]);
    let crowded = count >= 5 && size < 2.0 && count as f64 > size * size;
    crowded && fine * 2 > count || fine == count && size < 1.0 && high[0].abs().max(high[1].abs()) > 2.0
}

/// A column whose cells hold both coordinates.
fn one_cell(header: &StringRecord, rows: &[Row], column: usize) -> Option<PlaceColumns> {
    let name = header.get(column)?;
    let cells = || rows.iter().filter_map(|row| row.cells.get(column)).filter(|cell| !cell.is_empty()).take(LOOKED_AT);
    let (mut read, mut all, mut degrees, mut fine) = (0usize, 0usize, true, 0usize);
    for cell in cells() {
        all += 1;
        if let Some((x, y)) = both(cell, names::may_be_place(name)) {
            read += 1;
            degrees &= x.abs() <= 360.0 && y.abs() <= 90.0;
            // Degrees have many decimals, metres of a plot few; a pair without a form of its own is latitude and longitude.
            let decimals = cell
                .split(|c: char| !(c.is_ascii_digit() || c == '.'))
                .any(|number| number.split_once('.').is_some_and(|(_, part)| part.len() >= 3));
            fine += usize::from(decimals || !cell.to_ascii_uppercase().contains("POINT"));
        }
    }
    let degrees = degrees && (2 * fine >= read || all < 3);
    let coordinates = if degrees { Coordinates::Geographic } else { Coordinates::Planar };
    (read > 0 && read * 10 >= all * 9).then_some(PlaceColumns::One { column, coordinates })
}

/// East and north coordinate of a cell: a WKT or GeoJSON point, or, where `pair` allows it, two numbers `latitude,
/// longitude`.
pub(super) fn both(cell: &str, pair: bool) -> Option<(f64, f64)> {
    let cell = cell.trim();
    if cell.starts_with('{') {
        return geojson_point(cell);
    }
    let upper = cell.to_ascii_uppercase();
    if let Some(at) = upper.find("POINT") {
        let inside = cell.get(at..)?.split_once('(')?.1;
        let inside = inside.trim_start_matches([' ', '(']);
        let mut values =
            inside.split(|c: char| c.is_whitespace() || c == ',' || c == ')').filter(|word| !word.is_empty());
        let x: f64 = values.next()?.parse().ok()?;
        let y: f64 = values.next()?.parse().ok()?;
        return finite(x, y);
    }
    if !pair {
        return None;
    }
    let bracketed = cell.starts_with('[');
    let inside = cell.trim_matches(|c: char| "()[]\"".contains(c) || c.is_whitespace());
    let (first, second) =
        inside.split_once(',').or_else(|| inside.split_once(';')).or_else(|| inside.split_once(char::is_whitespace))?;
    let value = |text: &str| coordinate(text.trim(), false);
    let (first, second) = (value(first)?, value(second)?);
    // A list in JSON begins with the longitude; people write the latitude first. A latitude is at most 90.
    let east_first = bracketed || first.abs() > 90.0;
    if east_first { finite(first, second) } else { finite(second, first) }
}

fn finite(x: f64, y: f64) -> Option<(f64, f64)> {
    (x.is_finite() && y.is_finite()).then_some((x, y))
}

/// The position of a GeoJSON point.
fn geojson_point(cell: &str) -> Option<(f64, f64)> {
    let value: serde_json::Value = serde_json::from_str(cell).ok()?;
    let geometry = value.get("geometry").unwrap_or(&value);
    super::geojson::position(geometry)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_cell_holds_both_in_many_ways() {
        for (cell, expected) in [
            ("POINT (16.37 48.21)", Some((16.37, 48.21))),
            ("POINT(16.37 48.21)", Some((16.37, 48.21))),
            ("SRID=4326;POINT(16.37 48.21)", Some((16.37, 48.21))),
            ("point z (16.37 48.21 180)", Some((16.37, 48.21))),
            ("MULTIPOINT ((16.37 48.21))", Some((16.37, 48.21))),
            ("48.21, 16.37", Some((16.37, 48.21))),
            ("(48.21, 16.37)", Some((16.37, 48.21))),
            ("48.21 16.37", Some((16.37, 48.21))),
            ("[16.37, 48.21]", Some((16.37, 48.21))),
            ("-122.4, 37.7", Some((-122.4, 37.7))),
            (r#"{"type":"Point","coordinates":[16.37,48.21]}"#, Some((16.37, 48.21))),
            ("POINT EMPTY", None),
            ("Main street 5", None),
            ("", None),
        ] {
            assert_eq!(both(cell, true), expected, "{cell}");
        }
        assert_eq!(both("48.21, 16.37", false), None, "only where the name says that it is a place");
    }

    #[test]
    fn degrees_may_be_written_with_minutes() {
        let near = |cell: &str, degrees: f64| {
            let found = coordinate(cell, false);
            assert!(found.is_some_and(|value| (value - degrees).abs() < 1e-9), "{cell}: {found:?}");
        };
        near("48°12'30\"N", 48.0 + 12.5 / 60.0);
        near("16° 22.5' W", -16.375);
        near("16.5°", 16.5);
        assert_eq!(coordinate("16°99'", false), None);
    }

    #[test]
    fn pairs_are_found_under_many_names() {
        let found = |names: &[&str]| {
            let words: Vec<Vec<String>> = names.iter().map(|name| names::words(name)).collect();
            pair_by_name(&words).map(|pair| (pair.x, pair.y, pair.geographic, pair.feet))
        };
        assert_eq!(found(&["x", "y"]), Some((0, 1, false, false)));
        assert_eq!(found(&["y", "x"]), Some((1, 0, false, false)));
        assert_eq!(found(&["x", "y", "x_m", "y_m"]), Some((2, 3, false, false)));
        assert_eq!(
            found(&["Latitude", "Longitude", "Easting", "Northing"]),
            Some((3, 2, false, false)).map(|_| (2, 3, false, false))
        );
        assert_eq!(found(&["latitude", "longitude", "x_sp", "y_sp"]), Some((1, 0, true, false)));
        assert_eq!(found(&["x_sp", "y_sp"]), Some((0, 1, false, true)));
        assert_eq!(found(&["Rechtswert", "Hochwert"]), Some((0, 1, false, false)));
        assert_eq!(found(&["X_ETRS89", "Y_ETRS89"]), Some((0, 1, false, false)));
        assert_eq!(found(&["CoordX", "CoordY"]), Some((0, 1, false, false)));
        assert_eq!(found(&["decimalLatitude", "decimalLongitude"]), Some((1, 0, true, false)));
        assert_eq!(found(&["Längengrad", "Breitengrad"]), Some((0, 1, true, false)));
        assert_eq!(found(&["name", "age"]), None);
    }
}
