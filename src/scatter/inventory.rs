//! Tree inventories: CSV tables with one tree per line.
//!
//! Columns are found by name, in any order. Letter case and punctuation do not matter (`DBH (cm)` is `dbh_cm`):
//!
//! | quantity | names | unit |
//! |---|---|---|
//! | position | `x`,`y`; `x_m`,`y_m`; `gx`,`gy`; `easting`,`northing` (also `_m`) | metres |
//! | position | `lon`,`lat`; `longitude`,`latitude` | degrees |
//! | dbh | `dbh`, `diameter`, `bhd` + `_m`, `_cm`, `_mm` | by suffix, else by option (cm) |
//! | height | `height`, `h`, `ht`, `tree_height` + `_m`, `_cm`, `_mm` | by suffix, else by option (m) |
//! | species | `species`, `sp`, `species_name`, `taxon` | |
//!
//! Other columns are ignored. The header determines the separator (`,` `;` tab); if it is not the comma, numbers may
//! have a decimal comma. A byte-order mark, CRLF, quotes, empty lines, lines that begin with `#`, and Latin-1 text are
//! accepted. Empty cells, `NA` and the like are missing values, and so are a dbh and a height of 0.

use std::path::Path;

use super::{BadValue, ScatterError};

/// Maximum number of bad cells that an error lists.
const LISTED: usize = 5;

/// Thickest plausible trunk and tallest plausible tree, metres. Beyond them the unit is wrong: the Árbol del Tule has
/// 14 m, Hyperion 116 m.
const MAX_DBH_M: f64 = 15.0;
const MAX_HEIGHT_M: f64 = 130.0;

/// Unit of a length column.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Deserialize, bevy::reflect::Reflect)]
pub enum LengthUnit {
    /// Metres.
    #[default]
    Metres,
    /// Centimetres.
    Centimetres,
    /// Millimetres.
    Millimetres,
}

impl LengthUnit {
    /// Length of the unit in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::Metres => 1.0,
            Self::Centimetres => 0.01,
            Self::Millimetres => 0.001,
        }
    }
}

/// What the file of an inventory may leave open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InventoryOptions {
    /// Unit of a dbh column whose name has no unit; centimetres by default.
    pub dbh_unit: LengthUnit,
    /// Unit of a height column whose name has no unit; metres by default.
    pub height_unit: LengthUnit,
}

impl Default for InventoryOptions {
    fn default() -> Self {
        Self { dbh_unit: LengthUnit::Centimetres, height_unit: LengthUnit::Metres }
    }
}

/// Kind of the positions in an inventory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Coordinates {
    /// Metres: x to the east and y to the north, in the coordinate system of the plot or in a projected one.
    Planar,
    /// Degrees: x is the longitude, y the latitude.
    Geographic,
}

/// One row of an inventory.
#[derive(Clone, Debug, PartialEq)]
pub struct InventoryTree {
    /// Easting in metres or longitude in degrees, as in the file.
    pub x: f64,
    /// Northing in metres or latitude in degrees, as in the file.
    pub y: f64,
    /// Diameter at breast height, metres, > 0.
    pub dbh_m: Option<f64>,
    /// Height, metres, > 0.
    pub height_m: Option<f64>,
    /// Species as written in the file; not empty.
    pub species: Option<String>,
    /// Line in the file, from 1.
    pub line: u64,
}

/// A whole inventory.
#[derive(Clone, Debug, PartialEq)]
pub struct Inventory {
    /// The trees in the order of the file.
    pub rows: Vec<InventoryTree>,
    /// Kind of the `x` and `y` of the rows.
    pub coordinates: Coordinates,
}

/// Reads an inventory from a file.
///
/// # Errors
/// [`ScatterError::Io`] for a file that cannot be read; otherwise as [`parse_inventory`].
pub fn read_inventory(path: &Path, options: InventoryOptions) -> Result<Inventory, ScatterError> {
    let bytes = std::fs::read(path).map_err(|source| ScatterError::Io { path: path.to_owned(), source })?;
    parse_inventory(&bytes, &path.display().to_string(), options)
}

/// Reads an inventory from the bytes of a CSV file; `name` is the file's name in messages.
///
/// # Errors
/// [`ScatterError::NoPosition`], [`ScatterError::AmbiguousColumn`] for the header, [`ScatterError::Record`] for lines
/// with the wrong number of cells, [`ScatterError::BadValues`] for text, infinities, negative sizes and impossible
/// values in number columns.
pub fn parse_inventory(bytes: &[u8], name: &str, options: InventoryOptions) -> Result<Inventory, ScatterError> {
    let text = decode(bytes, name)?;
    let separator = separator(&text);
    let mut reader = table(&text, separator);
    let header = reader.headers().map_err(|error| record_error(name, &text, &error))?.clone();
    let columns = Columns::find(&header, name, options)?;
    let mut cells = Cells { header: &header, decimal_comma: separator != b',', bad: Vec::new(), total_bad: 0 };
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| record_error(name, &text, &error))?;
        if record.iter().all(str::is_empty) {
            continue;
        }
        let line = line_of(record.position(), &text);
        let (x_limit, y_limit) = columns.position_limits();
        let x = cells.required(&record, line, columns.x, x_limit);
        let y = cells.required(&record, line, columns.y, y_limit);
        let dbh_m = columns.dbh.and_then(|column| cells.length(&record, line, column, MAX_DBH_M));
        let height_m = columns.height.and_then(|column| cells.length(&record, line, column, MAX_HEIGHT_M));
        let species = columns.species.and_then(|column| record.get(column)).filter(|cell| !is_missing(cell));
        if let (Some(x), Some(y)) = (x, y) {
            rows.push(InventoryTree { x, y, dbh_m, height_m, species: species.map(str::to_owned), line });
        }
    }
    if cells.total_bad > 0 {
        return Err(ScatterError::BadValues { name: name.to_owned(), total: cells.total_bad, first: cells.bad });
    }
    Ok(Inventory { rows, coordinates: columns.coordinates })
}

/// A column of an inventory, for display.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its name as written in the file.
    pub name: String,
    /// The quantity that is read from it, with its unit; `None` if it is ignored.
    pub meaning: Option<String>,
}

/// The columns of an inventory, in the order of the file. `bytes`, `name` and `options` are as for [`parse_inventory`].
///
/// # Errors
/// Those of [`parse_inventory`] that concern the header.
pub fn columns_of(bytes: &[u8], name: &str, options: InventoryOptions) -> Result<Vec<Column>, ScatterError> {
    let text = decode(bytes, name)?;
    let mut reader = table(&text, separator(&text));
    let header = reader.headers().map_err(|error| record_error(name, &text, &error))?.clone();
    let columns = Columns::find(&header, name, options)?;
    Ok(header
        .iter()
        .enumerate()
        .map(|(index, name)| Column { name: name.to_owned(), meaning: columns.meaning(index, &normalised(name)) })
        .collect())
}

/// The records of a file.
fn table(text: &str, separator: u8) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new().delimiter(separator).comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes())
}

/// The text: UTF-8 with or without a byte-order mark, otherwise Latin-1.
fn decode(bytes: &[u8], name: &str) -> Result<String, ScatterError> {
    if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
        let message = "the file is UTF-16: save it as UTF-8 (in a spreadsheet, \"CSV UTF-8\")".to_owned();
        return Err(ScatterError::Record { name: name.to_owned(), line: 1, message });
    }
    let bytes = bytes.strip_prefix(&[0xEF, 0xBB, 0xBF]).unwrap_or(bytes);
    let text =
        std::str::from_utf8(bytes).map_or_else(|_| bytes.iter().map(|&b| char::from(b)).collect(), str::to_owned);
    // Use one kind of line end: the reader would assign the two halves of CRLF to different records.
    Ok(if text.contains('\r') { text.replace("\r\n", "\n").replace('\r', "\n") } else { text })
}

/// The most frequent separator in the header, outside quotes; a comma if there is none.
fn separator(text: &str) -> u8 {
    let header = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#')).unwrap_or("");
    let mut counts = [(b',', 0), (b'\t', 0), (b';', 0)];
    let mut quoted = false;
    for byte in header.bytes() {
        quoted ^= byte == b'"';
        for (separator, count) in &mut counts {
            *count += u32::from(!quoted && byte == *separator);
        }
    }
    // `max_by_key` returns the last of equal elements, so the semicolon wins over the tab, and the tab over the comma.
    counts.into_iter().max_by_key(|&(_, count)| count).filter(|&(_, count)| count > 0).map_or(b',', |(s, _)| s)
}

/// Line of a record. The reader reports the position before the empty lines and comments that it skips to get there.
fn line_of(position: Option<&csv::Position>, text: &str) -> u64 {
    let Some(position) = position else { return 0 };
    let rest = usize::try_from(position.byte()).ok().and_then(|byte| text.get(byte..)).unwrap_or("");
    let skipped = rest.lines().take_while(|line| line.is_empty() || line.starts_with('#')).count();
    position.line() + skipped as u64
}

fn record_error(name: &str, text: &str, error: &csv::Error) -> ScatterError {
    let line = line_of(error.position(), text);
    let message = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => format!(
            "{len} cells where the header has {expected_len}: complete the line, and quote cells that contain the separator"
        ),
        _ => format!("{error}: the file must be a table of text with one header line"),
    };
    ScatterError::Record { name: name.to_owned(), line, message }
}

fn is_missing(cell: &str) -> bool {
    ["", "na", "n/a", "nan", "null", "none", "-"].iter().any(|missing| cell.eq_ignore_ascii_case(missing))
}

/// A column of lengths.
#[derive(Clone, Copy)]
struct LengthColumn {
    index: usize,
    unit: LengthUnit,
}

/// Largest absolute value of a coordinate.
#[derive(Clone, Copy)]
struct Limit {
    largest: f64,
    /// What is wrong with a cell beyond the limit.
    reason: &'static str,
}

/// The columns of the quantities.
struct Columns {
    x: usize,
    y: usize,
    coordinates: Coordinates,
    dbh: Option<LengthColumn>,
    height: Option<LengthColumn>,
    species: Option<usize>,
}

/// Names of the two columns of a position. The first pair that a file has is used.
const POSITIONS: [(&str, &str, Coordinates); 9] = [
    ("x_m", "y_m", Coordinates::Planar),
    ("x", "y", Coordinates::Planar),
    ("gx", "gy", Coordinates::Planar),
    ("easting_m", "northing_m", Coordinates::Planar),
    ("easting", "northing", Coordinates::Planar),
    ("lon", "lat", Coordinates::Geographic),
    ("lng", "lat", Coordinates::Geographic),
    ("long", "lat", Coordinates::Geographic),
    ("longitude", "latitude", Coordinates::Geographic),
];

/// The name in lower case, with each run of characters other than letters and digits replaced by one `_`.
fn normalised(name: &str) -> String {
    let lower = name.to_lowercase();
    lower.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect::<Vec<_>>().join("_")
}

impl Columns {
    fn find(header: &csv::StringRecord, name: &str, options: InventoryOptions) -> Result<Self, ScatterError> {
        let names: Vec<String> = header.iter().map(normalised).collect();
        let at = |wanted: &str| names.iter().position(|name| name == wanted);
        let position = POSITIONS.iter().find_map(|&(x, y, kind)| Some((at(x)?, at(y)?, kind)));
        let Some((x, y, coordinates)) = position else {
            let found = header.iter().collect::<Vec<_>>().join(", ");
            return Err(ScatterError::NoPosition { name: name.to_owned(), found });
        };
        // The only column that `select` accepts. Two are an error, because either could be meant.
        let only = |quantity, select: &dyn Fn(&str) -> bool| {
            let mut matches = names.iter().enumerate().filter(|(_, name)| select(name)).map(|(index, _)| index);
            match (matches.next(), matches.next()) {
                (Some(first), Some(second)) => Err(ScatterError::AmbiguousColumn {
                    name: name.to_owned(),
                    quantity,
                    first: header[first].to_owned(),
                    second: header[second].to_owned(),
                }),
                (found, _) => Ok(found),
            }
        };
        let length = |quantity, stems: &[&str], unit| -> Result<Option<LengthColumn>, ScatterError> {
            let parsed = |name: &str| stems.iter().find_map(|stem| length_unit(name.strip_prefix(stem)?, unit));
            let index = only(quantity, &|name| parsed(name).is_some())?;
            Ok(index.and_then(|index| Some(LengthColumn { index, unit: parsed(&names[index])? })))
        };
        Ok(Self {
            x,
            y,
            coordinates,
            dbh: length("dbh", &["dbh", "diameter", "bhd"], options.dbh_unit)?,
            height: length("height", &["height", "tree_height", "ht", "h"], options.height_unit)?,
            species: only("species", &|name| ["species", "sp", "species_name", "taxon"].contains(&name))?,
        })
    }

    /// The quantity that is read from column `index`, whose name in lower case is `name`.
    fn meaning(&self, index: usize, name: &str) -> Option<String> {
        let length = |quantity: &str, column: LengthColumn| {
            let unit = match column.unit {
                LengthUnit::Metres => "metres",
                LengthUnit::Centimetres => "centimetres",
                LengthUnit::Millimetres => "millimetres",
            };
            let stated = ["_m", "_cm", "_mm"].iter().any(|suffix| name.ends_with(suffix));
            let assumed = if stated { "" } else { " (assumed: the name states no unit)" };
            format!("{quantity} in {unit}{assumed}")
        };
        let (x, y) = match self.coordinates {
            Coordinates::Planar => ("position east in metres", "position north in metres"),
            Coordinates::Geographic => ("longitude in degrees", "latitude in degrees"),
        };
        if index == self.x {
            return Some(x.to_owned());
        }
        if index == self.y {
            return Some(y.to_owned());
        }
        if self.species == Some(index) {
            return Some("species".to_owned());
        }
        let dbh = self.dbh.filter(|column| column.index == index);
        let height = self.height.filter(|column| column.index == index);
        dbh.map(|column| length("diameter at breast height", column)).or(height.map(|column| length("height", column)))
    }

    /// Limits of x and y.
    fn position_limits(&self) -> (Limit, Limit) {
        match self.coordinates {
            Coordinates::Planar => {
                let limit = Limit { largest: f64::MAX, reason: "is not finite" };
                (limit, limit)
            }
            // Longitudes are counted from -180 to 180 or from 0 to 360.
            Coordinates::Geographic => (
                Limit { largest: 360.0, reason: "is not a longitude (expected degrees within ±360)" },
                Limit { largest: 90.0, reason: "is not a latitude (expected degrees within ±90)" },
            ),
        }
    }
}

/// The unit that a column's suffix names; `fallback` without a suffix, `None` for another word.
fn length_unit(suffix: &str, fallback: LengthUnit) -> Option<LengthUnit> {
    match suffix {
        "" => Some(fallback),
        "_m" => Some(LengthUnit::Metres),
        "_cm" => Some(LengthUnit::Centimetres),
        "_mm" => Some(LengthUnit::Millimetres),
        _ => None,
    }
}

/// Reads number cells and remembers the bad ones.
struct Cells<'a> {
    header: &'a csv::StringRecord,
    decimal_comma: bool,
    bad: Vec<BadValue>,
    total_bad: usize,
}

impl Cells<'_> {
    fn refuse(&mut self, line: u64, column: usize, value: &str, reason: &'static str) -> Option<f64> {
        self.total_bad += 1;
        if self.bad.len() < LISTED {
            let column = self.header.get(column).unwrap_or("").to_owned();
            self.bad.push(BadValue { line, column, value: value.to_owned(), reason });
        }
        None
    }

    fn parse(&self, cell: &str) -> Option<f64> {
        let plain = cell.parse::<f64>();
        if plain.is_err() && self.decimal_comma && cell.matches(',').count() == 1 && !cell.contains('.') {
            return cell.replace(',', ".").parse().ok();
        }
        plain.ok()
    }

    /// A required number, within plus or minus the limit.
    fn required(&mut self, record: &csv::StringRecord, line: u64, column: usize, limit: Limit) -> Option<f64> {
        let cell = record.get(column).unwrap_or("");
        if is_missing(cell) {
            return self.refuse(line, column, cell, "is missing, but each tree needs its position");
        }
        match self.parse(cell) {
            None => self.refuse(line, column, cell, "is not a number"),
            Some(value) if !(0.0..=limit.largest).contains(&value.abs()) => {
                self.refuse(line, column, cell, limit.reason)
            }
            found => found,
        }
    }

    /// A length in metres, above 0 and at most `limit`; `None` if it is missing or bad.
    fn length(&mut self, record: &csv::StringRecord, line: u64, column: LengthColumn, limit: f64) -> Option<f64> {
        let cell = record.get(column.index).unwrap_or("");
        if is_missing(cell) {
            return None;
        }
        match self.parse(cell).map(|value| value * column.unit.metres()) {
            None => self.refuse(line, column.index, cell, "is not a number"),
            Some(0.0) => None,
            Some(value) if value.is_nan() || value < 0.0 => self.refuse(line, column.index, cell, "is not above 0"),
            Some(value) if value > limit => {
                self.refuse(line, column.index, cell, "is too large for a tree: name the column's unit, as in dbh_mm")
            }
            found => found,
        }
    }
}
