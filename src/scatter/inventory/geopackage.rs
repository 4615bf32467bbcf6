//! A GeoPackage [OGC 12-128r18] as a table: a feature of one layer is a row, its attributes are the cells, its point is the
//! position.
//!
//! | part of the file | what is read |
//! |---|---|
//! | layers (`gpkg_contents` 1.1.3, `gpkg_geometry_columns` 2.1.5) | one: that of the given name, else the first of points, else the first of any geometries |
//! | features (2.1.6) | all rows of its table or view; numbers, text and dates as text, NULL as an empty cell; blobs are not used |
//! | geometries (2.1.3) | points, also with height or measure; of several points the first; x is the easting or the longitude |
//! | coordinate system (`gpkg_spatial_ref_sys` 1.1.2) | the EPSG code, and the definition in WKT |
//!
//! The file is never written, and nothing beside it: SQLite gets a copy in memory. Views may compute anything, and a damaged
//! index may lead in circles, so the steps of SQLite and the text that it gives are limited.

mod geometry;
mod layers;

use std::collections::BTreeSet;
use std::io::Read;
use std::path::Path;

use csv::StringRecord;
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Error, ErrorCode, MAIN_DB};

use super::super::ScatterError;
use super::place::{self, PlaceColumns};
use super::text::{Row, Table};
use super::{Coordinates, LISTED};
use geometry::Geometry;
use layers::{Kind, Layer, System};

/// The first bytes of every SQLite database.
const MAGIC: &[u8] = b"SQLite format 3\0";
/// Steps of SQLite's virtual machine between two looks at their sum.
const STEPS: i32 = 1_000_000;
/// Such looks for a file of no size, and the bytes that allow one more: some seconds, and a hundred steps a byte.
const LOOKS: usize = 100;
const BYTES_PER_LOOK: usize = 10_000;
/// Bytes of text for a file of no size, and for each of its bytes. A number of 2 bytes becomes text of 4 in a cell of 8.
const TEXT: usize = 1 << 24;
const TEXT_PER_BYTE: usize = 32;
/// The longest value of a view, bytes; those of tables are as long as the file at most.
const LONGEST: i32 = 1 << 20;

/// Whether bytes are those of a SQLite database, of which a GeoPackage is one (1.1.1.1.1).
pub(super) fn recognises(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Says which file beside that at `path` has changes that are not read. SQLite keeps changes in such files while a program
/// works, or after it was ended.
pub(super) fn unread_changes(path: &Path) -> Option<String> {
    let beside = |ending: &str| {
        let mut file = path.as_os_str().to_owned();
        file.push(ending);
        let file = Path::new(&file);
        let filled = std::fs::metadata(file).is_ok_and(|found| found.is_file() && found.len() > 0);
        filled.then(|| file.display().to_string())
    };
    let file = ["-wal", "-journal"].into_iter().find_map(beside)?;
    Some(format!(
        "the changes in {file} are not read: close the program that has the GeoPackage open, or open and close it once"
    ))
}

/// A table of the points in one layer of the GeoPackage in `bytes`, where its positions are, and its coordinate system in
/// WKT. `layer` is the name of the layer that is wanted. The line of a row is the number of its feature.
pub(super) fn read(
    bytes: &[u8],
    name: &str,
    layer: Option<&str>,
) -> Result<(Table, PlaceColumns, Option<String>), ScatterError> {
    let refused = |line: u64, message: String| ScatterError::Record { name: name.to_owned(), line, message };
    let failed = |error: Error| refused(1, reason(&error));
    let database = open(bytes).map_err(failed)?;
    if !layers::has_table(&database, "gpkg_contents").map_err(failed)? {
        let message = "the file is a SQLite database, but no GeoPackage: export the trees as GeoPackage, CSV or GeoJSON \
                       (`ogr2ogr -f GPKG trees.gpkg FILE`)";
        return Err(refused(1, message.to_owned()));
    }
    let layers = layers::all(&database).map_err(failed)?;
    let (layer, others) = layers::choose(&layers, layer).map_err(|message| refused(1, message))?;
    let System { epsg, wkt, kind } = System::of(&database, layer.system).map_err(failed)?;
    let most_text = TEXT.saturating_add(bytes.len().saturating_mul(TEXT_PER_BYTE));
    let features = Features::read(&database, layer, most_text).map_err(|(line, message)| refused(line, message))?;
    let mut notes: Vec<String> = others.into_iter().collect();
    features.refuse_no_points(layer).map_err(|message| refused(1, message))?;
    notes.extend(features.notes());

    let Features { header, rows, in_degrees, .. } = features;
    let geographic = match kind {
        Kind::Geographic => true,
        Kind::Planar => false,
        // Plots of some metres have such numbers too, so there must be more that speaks for degrees.
        Kind::Cartesian => place::are_degrees(&rows, 0, 1, false),
        Kind::Undefined => in_degrees,
    };
    if epsg.is_none() && wkt.is_none() {
        let read_as = if geographic { "degrees" } else { "metres of a system that is not stated" };
        notes.push(format!("its coordinate system is not defined: the positions are read as {read_as}"));
    }
    let coordinates = if geographic { Coordinates::Geographic } else { Coordinates::Planar };
    let place = PlaceColumns::Two { x: 0, y: 1, coordinates, metres_per_unit: 1.0 };
    let header = StringRecord::from(header);
    Ok((Table { header, rows, ragged: Vec::new(), decimal_comma: false, epsg, notes }, place, wkt))
}

/// The database in a copy of `bytes` that cannot be written.
fn open(bytes: &[u8]) -> Result<Connection, Error> {
    // Bytes 18 and 19 say 2 for a database with a log beside it, which one in memory cannot have [SQLite file format, 1.3.3].
    let (head, rest) = bytes.split_at(bytes.len().min(20));
    let mut head = head.to_vec();
    head.iter_mut().skip(18).filter(|version| **version == 2).for_each(|version| *version = 1);
    let mut database = Connection::open_in_memory()?;
    // What SQLite advises for files from anywhere [sqlite.org/security.html].
    database.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
    database.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
    database.pragma_update(None, "cell_size_check", true)?;
    database.pragma_update(None, "temp_store", "MEMORY")?;
    let longest = i32::try_from(bytes.len()).unwrap_or(i32::MAX).max(LONGEST);
    database.set_limit(Limit::SQLITE_LIMIT_LENGTH, longest)?;
    let mut looks = LOOKS.saturating_add(bytes.len() / BYTES_PER_LOOK);
    database.progress_handler(
        STEPS,
        Some(move || {
            looks = looks.saturating_sub(1);
            looks == 0
        }),
    )?;
    database.deserialize_read_exact(MAIN_DB, head.chain(rest), bytes.len(), true)?;
    Ok(database)
}

/// What SQLite has against a file, and the remedy.
fn reason(error: &Error) -> String {
    if error.sqlite_error_code() == Some(ErrorCode::OperationInterrupted) {
        return "reading the GeoPackage takes too many steps: export the layer as a table, or as CSV".to_owned();
    }
    format!("the GeoPackage cannot be read ({error}): copy or export it again")
}

/// The features of a layer.
struct Features {
    header: Vec<String>,
    rows: Vec<Row>,
    /// Features with a point.
    points: usize,
    /// Whether all points are within the range of degrees.
    in_degrees: bool,
    /// Features with another geometry, and the first kind of these.
    others: (usize, Option<&'static str>),
    /// Columns of the header that have blobs.
    blobs: BTreeSet<usize>,
}

impl Features {
    /// Reads all features of a layer, of at most `most_text` bytes. The error has the number of the feature.
    fn read(database: &Connection, layer: &Layer, most_text: usize) -> Result<Self, (u64, String)> {
        let failed = |line: u64| move |error: Error| (line, reason(&error));
        let columns = layers::columns(database, &layer.name).map_err(failed(1))?;
        let Some(geometry) = columns.iter().position(|column| column.eq_ignore_ascii_case(&layer.column)) else {
            let message = format!("the layer `{}` has no column `{}`: export it again", layer.name, layer.column);
            return Err((1, message));
        };
        let mut header = vec!["geometry x".to_owned(), "geometry y".to_owned()];
        header.extend(columns.iter().enumerate().filter(|(index, _)| *index != geometry).map(|(_, name)| name.clone()));
        let mut found =
            Self { header, rows: Vec::new(), points: 0, in_degrees: true, others: (0, None), blobs: BTreeSet::new() };
        let mut statement =
            database.prepare(&format!("SELECT * FROM {}", layers::quoted(&layer.name))).map_err(failed(1))?;
        let count = statement.column_count().min(columns.len());
        let mut rows = statement.query([]).map_err(failed(1))?;
        let mut text = 0usize;
        for line in 1u64.. {
            let Some(row) = rows.next().map_err(failed(line))? else { break };
            let mut cells = found.position(row.get_ref(geometry).map_err(failed(line))?).to_vec();
            for index in (0..count).filter(|index| *index != geometry) {
                cells.push(match row.get_ref(index).map_err(failed(line))? {
                    ValueRef::Null => String::new(),
                    ValueRef::Integer(number) => number.to_string(),
                    ValueRef::Real(number) => number.to_string(),
                    ValueRef::Text(text) => String::from_utf8_lossy(text).trim().to_owned(),
                    ValueRef::Blob(_) => {
                        found.blobs.insert(cells.len());
                        String::new()
                    }
                });
            }
            // Columns that were added later are empty in the rows before, which take no room in the file.
            let filled = cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
            cells.truncate(filled.max(2));
            text += cells.iter().map(|cell| cell.len() + size_of::<usize>()).sum::<usize>();
            if text > most_text {
                let message = format!(
                    "the layer `{}` has more text than the file could hold: export it as a table, or as CSV",
                    layer.name
                );
                return Err((line, message));
            }
            found.rows.push(Row { line, cells: StringRecord::from(cells) });
        }
        Ok(found)
    }

    /// The two cells of a position; both are empty without one, and text that is no number where the value is damaged.
    fn position(&mut self, value: ValueRef) -> [String; 2] {
        let geometry = match value {
            ValueRef::Null => Geometry::Empty,
            ValueRef::Blob(blob) => Geometry::of(blob),
            _ => Geometry::Damaged,
        };
        match geometry {
            Geometry::Point(x, y) => {
                self.points += 1;
                self.in_degrees &= x.abs() <= 360.0 && y.abs() <= 90.0;
                [x.to_string(), y.to_string()]
            }
            Geometry::Empty => Default::default(),
            Geometry::Other(kind) => {
                self.others.0 += 1;
                self.others.1.get_or_insert(kind);
                Default::default()
            }
            Geometry::Damaged => ["damaged geometry".to_owned(), String::new()],
        }
    }

    fn refuse_no_points(&self, layer: &Layer) -> Result<(), String> {
        if self.points > 0 {
            return Ok(());
        }
        let kind = match self.others.1 {
            _ if self.rows.is_empty() => "it is empty".to_owned(),
            Some(kind) => format!("the first: {kind}"),
            None => "they are empty or damaged".to_owned(),
        };
        Err(format!(
            "none of the {} features in the layer `{}` has a point ({kind}): export the trees as points",
            self.rows.len(),
            layer.name
        ))
    }

    /// What is not used.
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if let (count, Some(kind)) = self.others {
            notes.push(format!("{count} geometries are no points (the first: {kind}) and give no position"));
        }
        if !self.blobs.is_empty() {
            let names = self.blobs.iter().filter_map(|index| self.header.get(*index));
            let list: Vec<String> = names.take(LISTED).map(|name| format!("`{name}`")).collect();
            notes.push(format!("blobs are not used, as in the column(s) {}", list.join(", ")));
        }
        notes
    }
}
