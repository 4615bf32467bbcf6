//! Tree inventories: tables of text, GeoJSON, shapefiles or GeoPackages with one tree a row.
//!
//! Columns are found by their names, in any order, in the words of the large public tables (`names.rs` has them), and by
//! what their cells hold:
//!
//! | quantity | names, for instance | unit |
//! |---|---|---|
//! | position | `x`,`y`; `easting`,`northing`; `rechtswert`,`hochwert` | metres; degrees if the numbers are |
//! | position | `lon`,`lat`; `longitude`,`latitude`; one cell: `POINT (x y)`, `48.2, 16.4` | degrees |
//! | dbh | `dbh`, `diameter`, `bhd`, `dhp`; circumference: `girth`, `umfang`, `circonference` | by name, by cell, by option, else guessed |
//! | height | `height`, `baumhoehe`, `hauteur`, `altura` | the same |
//! | species | `scientific name`, `spc_latin`, `gattung_art`; `genus` and `species` | |
//! | status | `status`, `condition`, `zustand`: dead trees, stumps and vacant sites are left out | |
//!
//! The header determines the separator (`,` `;` tab `|` or blanks); numbers may have a decimal comma where that is not the
//! separator, or in quotes. UTF-8, UTF-16 and Windows-1252, a line `sep=;`, CRLF, quotes, empty lines, and lines that begin
//! with `#` are accepted. Empty cells, `NA` and the like are missing values, and so are a dbh and a height of 0.
//!
//! Nothing is dropped in silence: [`Inventory::notes`] says in a line each what was assumed, which columns are not used and
//! which rows are left out.

mod cells;
mod geojson;
#[cfg(feature = "geopackage")]
mod geopackage;
mod names;
mod place;
mod places;
mod select;
mod shapefile;
mod sizes;
mod source;
mod species;
mod text;

use std::path::Path;

use csv::StringRecord;
use glam::DVec2;

use super::{BadValue, ScatterError};
use cells::{is_missing, length};
use names::NoTree;
use place::PlaceColumns;
use select::Selection;
pub use select::Surveys;
use sizes::{SizeColumns, Sizes};
use source::Source;
use species::SpeciesColumns;
use text::{Row, Table};

/// Maximum number of bad cells, lines or names that a message lists.
const LISTED: usize = 5;
/// Maximum number of unused columns that a message lists.
const COLUMNS_LISTED: usize = 40;

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
    /// Decimetres.
    Decimetres,
    /// Centimetres.
    Centimetres,
    /// Millimetres.
    Millimetres,
    /// Inches of 2.54 cm.
    Inches,
    /// Feet of 30.48 cm.
    Feet,
}

impl LengthUnit {
    /// Length of the unit in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::Metres => 1.0,
            Self::Decimetres => 0.1,
            Self::Centimetres => 0.01,
            Self::Millimetres => 0.001,
            Self::Inches => 0.0254,
            Self::Feet => 0.3048,
        }
    }

    /// Its name in the plural.
    pub fn name(self) -> &'static str {
        match self {
            Self::Metres => "metres",
            Self::Decimetres => "decimetres",
            Self::Centimetres => "centimetres",
            Self::Millimetres => "millimetres",
            Self::Inches => "inches",
            Self::Feet => "feet",
        }
    }
}

/// What the file of an inventory may leave open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InventoryOptions<'a> {
    /// Unit of a dbh column whose name and cells have no unit; `None`: it is guessed from the values (mostly centimetres).
    pub dbh_unit: Option<LengthUnit>,
    /// Unit of a height column whose name and cells have no unit; `None`: it is guessed from the values (mostly metres).
    pub height_unit: Option<LengthUnit>,
    /// The kind of positions to use where a table has both; `None`: the first kind in the order of the page above.
    pub positions: Option<Coordinates>,
    /// The year of a repeated survey; `None`: the last one. Of years without rows the one before.
    pub year: Option<i32>,
    /// The variant or scenario of a table that has several; `None`: the first one.
    pub variant: Option<&'a str>,
    /// The layer of a GeoPackage; `None`: the first one of points.
    pub layer: Option<&'a str>,
    /// Refuses a file with any row that cannot be used, instead of leaving it out with a note.
    pub strict: bool,
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
    /// Species as written in the file, genus and epithet joined; not empty.
    pub species: Option<String>,
    /// In a file of several surveys or variants the number of its place, which is the same in all of them, so that the tree
    /// there keeps its individual, its rotation and its tint; `None`: they follow from its number in the list.
    pub place: Option<u32>,
    /// Line in the file, from 1; of GeoJSON, shapefiles and GeoPackages the number of the feature.
    pub line: u64,
}

/// A whole inventory.
#[derive(Clone, Debug, PartialEq)]
pub struct Inventory {
    /// The trees in the order of the file.
    pub rows: Vec<InventoryTree>,
    /// Kind of the `x` and `y` of the rows.
    pub coordinates: Coordinates,
    /// The EPSG code of the coordinates, if the file states it.
    pub epsg: Option<u32>,
    /// The coordinate system in the words of the file, WKT, if it has such a text.
    pub wkt: Option<String>,
    /// The columns in the order of the file.
    pub columns: Vec<Column>,
    /// What was assumed, not used or left out: a sentence each.
    pub notes: Vec<String>,
    /// The years and variants that the file has.
    pub surveys: Surveys,
    /// Least and greatest coordinates of all surveys and variants together, if there are several: the stand does not move when
    /// another one is shown.
    pub extent: Option<(DVec2, DVec2)>,
}

/// A column of an inventory, for display.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its name as written in the file.
    pub name: String,
    /// The quantity that is read from it, with its unit; `None` if it is not used.
    pub meaning: Option<String>,
}

/// Reads an inventory from a file: a table of text, GeoJSON, a GeoPackage (cargo feature `geopackage`), or the `.shp` of a
/// shapefile with the files beside it.
///
/// # Errors
/// [`ScatterError::Io`] for a file that cannot be read; otherwise as [`parse_inventory`].
pub fn read_inventory(path: &Path, options: InventoryOptions) -> Result<Inventory, ScatterError> {
    let source = Source::of_file(path, options)?;
    Reading::new(source, &path.display().to_string(), options)?.finish()
}

/// Reads an inventory from the bytes of a table of text, of GeoJSON or of a GeoPackage; `name` is the file's name in messages.
///
/// Rows whose position cannot be used or that have another number of cells than the header are left out; a size that is no
/// length, negative or impossible is left out of its row. Both are counted in a note with the first five lines.
///
/// # Errors
/// [`ScatterError::NoPosition`], [`ScatterError::AmbiguousColumn`] for the header. [`ScatterError::Record`] and
/// [`ScatterError::BadValues`] where half of the rows or more cannot be read as written (with
/// [`strict`](InventoryOptions::strict), any), and for files that are no text. [`ScatterError::Record`] also for a
/// GeoPackage that is damaged, has no layer of points or none of the name that `options` states.
pub fn parse_inventory(bytes: &[u8], name: &str, options: InventoryOptions) -> Result<Inventory, ScatterError> {
    Reading::new(Source::of_bytes(bytes, name, options)?, name, options)?.finish()
}

/// Cells that cannot be used: their number and the first of them.
#[derive(Default)]
struct Bad {
    total: usize,
    first: Vec<BadValue>,
}

impl Bad {
    fn push(&mut self, value: BadValue) {
        self.total += 1;
        if self.first.len() < LISTED {
            self.first.push(value);
        }
    }

    fn listed(&self) -> String {
        self.first.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
    }
}

/// A table while its rows are read.
struct Reading<'a> {
    table: Table,
    wkt: Option<String>,
    name: &'a str,
    options: InventoryOptions<'a>,
    place: PlaceColumns,
    selection: Selection,
    sizes: Sizes,
    species: SpeciesColumns,
    status: Vec<usize>,
    /// Those whose cells are letters: A for a living tree, D for a dead one.
    coded: Vec<usize>,
    notes: Vec<String>,
    /// All cells that cannot be used.
    bad: Bad,
    /// Those for which rows, and those for which sizes are left out.
    places: Bad,
    lengths: Bad,
    /// Rows with a cell that is more than missing: text, impossible values.
    unreadable: usize,
    /// The last row that was left out for its position.
    last_without_place: Option<u64>,
    no_trees: Vec<(NoTree, u64)>,
    ranges: usize,
    stems: usize,
}

impl<'a> Reading<'a> {
    fn new(source: Source, name: &'a str, options: InventoryOptions<'a>) -> Result<Self, ScatterError> {
        let Source { table, place, wkt } = source;
        let place = match place {
            Some(place) => place,
            None => place::find(&table.header, &table.rows, table.decimal_comma, options.positions, name)?,
        };
        let species = SpeciesColumns::find(&table, name)?;
        let selection = Selection::find(&table, &place, options);
        let is_status = |index: &usize| {
            let meaning = table.header.get(*index).and_then(names::meaning);
            meaning.is_some_and(|meaning| meaning.quantity == names::Quantity::Status)
        };
        let status: Vec<usize> = (0..table.header.len()).filter(is_status).collect();
        let coded = status.iter().copied().filter(|column| has_letter_codes(&table, *column)).collect();
        let in_usa = is_in_usa(&table, &place);
        let sizes = sizes::find(&table, options, in_usa, name)?;
        Ok(Self {
            table,
            wkt,
            name,
            options,
            place,
            selection,
            sizes,
            species,
            status,
            coded,
            notes: Vec::new(),
            bad: Bad::default(),
            places: Bad::default(),
            lengths: Bad::default(),
            unreadable: 0,
            last_without_place: None,
            no_trees: Vec::new(),
            ranges: 0,
            stems: 0,
        })
    }

    fn finish(mut self) -> Result<Inventory, ScatterError> {
        let mut rows = std::mem::take(&mut self.table.rows);
        let places = self.selection.is_choice().then(|| self.places(&rows));
        rows.retain(|row| self.selection.keeps(&row.cells));
        let mut trees = Vec::with_capacity(rows.len());
        for row in &rows {
            if let Some(kind) = self.not_a_tree(&row.cells) {
                self.no_trees.push((kind, row.line));
            } else if let Some(tree) = self.tree(row) {
                let place = places.as_ref().and_then(|places| places.number(tree.x, tree.y));
                trees.push(InventoryTree { place, ..tree });
            }
        }
        self.refuse_damage(rows.len())?;
        self.leave_out_zeros(&mut trees);
        self.leave_out_strays(&mut trees);
        let columns = self.columns();
        self.say_what_was_left_out(&columns);
        let mut notes = std::mem::take(&mut self.table.notes);
        notes.append(&mut self.selection.notes);
        notes.append(&mut self.sizes.notes);
        notes.append(&mut self.species.notes);
        notes.append(&mut self.notes);
        Ok(Inventory {
            rows: trees,
            coordinates: self.place.coordinates(),
            epsg: self.table.epsg,
            wkt: self.wkt,
            columns,
            notes,
            surveys: self.selection.surveys,
            extent: places.and_then(|places| places.extent),
        })
    }

    /// Refuses a table of which half of the rows or more cannot be read as written: it is another table than it seems.
    fn refuse_damage(&self, rows: usize) -> Result<(), ScatterError> {
        let ragged = &self.table.ragged;
        let half_unreadable = self.unreadable > 0 && 2 * self.unreadable >= rows;
        let nowhere = rows > 0 && self.places.total == rows;
        if half_unreadable || nowhere || self.options.strict && self.bad.total > 0 {
            let (name, first) = (self.name.to_owned(), self.bad.first.clone());
            return Err(ScatterError::BadValues { name, total: self.bad.total, first });
        }
        match ragged.first() {
            Some((line, cells)) if ragged.len() >= rows || self.options.strict => Err(ScatterError::Record {
                name: self.name.to_owned(),
                line: *line,
                message: format!(
                    "{cells} cells where the header has {}: complete the line, and quote cells that contain the separator",
                    self.table.header.len()
                ),
            }),
            _ => Ok(()),
        }
    }

    /// What a row is about if it is no living tree.
    fn not_a_tree(&self, cells: &StringRecord) -> Option<NoTree> {
        for column in &self.status {
            let (Some(name), Some(cell)) = (self.table.header.get(*column), cells.get(*column)) else { continue };
            if let Some(kind) = names::no_tree(cell).or_else(|| names::flagged(name, cell)) {
                return Some(kind);
            }
            if self.coded.contains(column) && cell.eq_ignore_ascii_case("d") {
                return Some(NoTree::Dead);
            }
        }
        self.species.cells(cells).find_map(names::no_tree)
    }

    /// The tree of a row, if its position can be used.
    fn tree(&mut self, row: &Row) -> Option<InventoryTree> {
        let mut unreadable = false;
        let place = self.position(row, &mut unreadable);
        let height_m = self.size(row, |sizes| sizes.height.as_ref(), MAX_HEIGHT_M, &mut unreadable);
        let diameter = self.size(row, |sizes| sizes.diameter.as_ref(), MAX_DBH_M, &mut unreadable);
        let most = MAX_DBH_M * std::f64::consts::PI;
        let girth = self.size(row, |sizes| sizes.girth.as_ref(), most, &mut unreadable);
        let dbh_m = diameter.or(girth.map(|around| around / std::f64::consts::PI));
        self.unreadable += usize::from(unreadable);
        let (x, y) = place?;
        Some(InventoryTree { x, y, dbh_m, height_m, species: self.species.of(&row.cells), place: None, line: row.line })
    }

    /// The position of a row; what is wrong with it is kept.
    fn position(&mut self, row: &Row, unreadable: &mut bool) -> Option<(f64, f64)> {
        let mut found = [None; 2];
        let columns = self.place.columns();
        for (value, (axis, column)) in found.iter_mut().zip(columns.into_iter().enumerate()) {
            let cell = row.cells.get(column).unwrap_or("");
            match self.place.coordinate(axis, &row.cells, self.table.decimal_comma) {
                _ if is_missing(cell) && !cell.parse().is_ok_and(f64::is_finite) => {
                    self.no_place(row.line, column, cell, "is missing, but each tree needs its position");
                }
                None => {
                    *unreadable = true;
                    self.no_place(row.line, column, cell, not_a_number(cell));
                }
                Some(number) => match self.place.limit(axis) {
                    Some((largest, reason)) if !(0.0..=largest).contains(&number.abs()) => {
                        *unreadable = true;
                        self.no_place(row.line, column, cell, reason);
                    }
                    _ => *value = Some(number),
                },
            }
            if matches!(self.place, PlaceColumns::One { .. }) && value.is_none() {
                // One cell is reported once.
                return None;
            }
        }
        Some((found[0]?, found[1]?))
    }

    fn bad_value(&self, line: u64, column: usize, value: &str, reason: &'static str) -> BadValue {
        let column = self.table.header.get(column).unwrap_or("").to_owned();
        BadValue { line, column, value: value.chars().take(60).collect(), reason }
    }

    fn no_place(&mut self, line: u64, column: usize, value: &str, reason: &'static str) {
        let bad = self.bad_value(line, column, value, reason);
        self.bad.push(bad.clone());
        // A row counts once, whatever is wrong with it.
        if self.last_without_place.replace(line) != Some(line) {
            self.places.push(bad);
        }
    }

    /// A size of a row in metres, above 0 and at most `limit`; `None` if it is missing or bad.
    fn size(
        &mut self,
        row: &Row,
        columns: fn(&Sizes) -> Option<&SizeColumns>,
        limit: f64,
        unreadable: &mut bool,
    ) -> Option<f64> {
        let (indices, unit) = {
            let columns = columns(&self.sizes)?;
            (columns.indices.clone(), columns.unit)
        };
        let (mut largest, mut count) = (None, 0);
        for column in indices {
            let cell = row.cells.get(column).unwrap_or("");
            if is_missing(cell) {
                continue;
            }
            let found = length(cell, self.table.decimal_comma);
            let reason = match found.map(|found| (found, found.value * found.unit.unwrap_or(unit).metres())) {
                None => "is not a number",
                Some((_, 0.0)) => continue,
                Some((_, value)) if value.is_nan() || value < 0.0 => "is not above 0",
                Some((_, value)) if value > limit => "is too large for a tree: name the column's unit, as in dbh_mm",
                Some((found, value)) => {
                    self.ranges += usize::from(found.range);
                    count += found.stems;
                    largest = Some(largest.map_or(value, |other: f64| other.max(value)));
                    continue;
                }
            };
            *unreadable = true;
            let bad = self.bad_value(row.line, column, cell, reason);
            self.bad.push(bad.clone());
            self.lengths.push(bad);
        }
        self.stems += usize::from(count > 1);
        largest
    }

    /// Leaves out trees at 0, 0 where all others are far from there: it stands for "unknown".
    fn leave_out_zeros(&mut self, trees: &mut Vec<InventoryTree>) {
        let zero = |tree: &InventoryTree| tree.x == 0.0 && tree.y == 0.0;
        let zeros = trees.iter().filter(|tree| zero(tree)).count();
        let least = if self.place.coordinates() == Coordinates::Geographic { 2.0 } else { 5000.0 };
        let near = trees.iter().filter(|tree| tree.x.abs().max(tree.y.abs()) < least).count();
        if zeros == 0 || near > zeros || zeros == trees.len() {
            return;
        }
        let lines = listed(trees.iter().filter(|tree| zero(tree)).map(|tree| tree.line));
        self.notes.push(format!(
            "{zeros} row(s) have the position 0, 0, which stands for an unknown one, and are left out; the first in line(s) {lines}"
        ));
        trees.retain(|tree| !zero(tree));
    }

    /// Leaves out trees that lie far from all others, twenty times as far from the middle as nine of ten: they would
    /// shift the middle of the stand.
    fn leave_out_strays(&mut self, trees: &mut Vec<InventoryTree>) {
        if trees.len() < 20 {
            return;
        }
        let middle = |value: fn(&InventoryTree) -> f64| {
            let mut values: Vec<f64> = trees.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(0.0)
        };
        let (x, y) = (middle(|tree| tree.x), middle(|tree| tree.y));
        let distance = |tree: &InventoryTree| (tree.x - x).hypot(tree.y - y);
        let mut distances: Vec<f64> = trees.iter().map(distance).collect();
        distances.sort_by(f64::total_cmp);
        let usual = distances.get(trees.len() * 9 / 10).copied().unwrap_or(f64::MAX);
        let least = if self.place.coordinates() == Coordinates::Geographic { 0.2 } else { 20_000.0 };
        let limit = (20.0 * usual).max(least);
        let strays: Vec<u64> = trees.iter().filter(|tree| distance(tree) > limit).map(|tree| tree.line).collect();
        if strays.is_empty() {
            return;
        }
        self.notes.push(format!(
            "{} tree(s) lie more than twenty times as far from the middle of the stand as nine of ten others and are left \
             out; the first in line(s) {}",
            strays.len(),
            listed(strays.iter().copied())
        ));
        trees.retain(|tree| distance(tree) <= limit);
    }

    /// What is read from each column.
    fn columns(&self) -> Vec<Column> {
        let meaning = |index: usize| -> Option<String> {
            if let Some(place) = self.place.meaning(index) {
                return Some(place.to_owned());
            }
            if let Some(choice) = self.selection.meaning(index) {
                return Some(choice.to_owned());
            }
            if let Some(species) = self.species.meaning(index) {
                return Some(species.to_owned());
            }
            let sizes = [&self.sizes.diameter, &self.sizes.girth, &self.sizes.height];
            if let Some(columns) = sizes.into_iter().flatten().find(|columns| columns.indices.contains(&index)) {
                return Some(columns.meaning());
            }
            self.status.contains(&index).then(|| "whether there is a living tree".to_owned())
        };
        let header = self.table.header.iter().enumerate();
        header.map(|(index, name)| Column { name: name.to_owned(), meaning: meaning(index) }).collect()
    }

    fn say_what_was_left_out(&mut self, columns: &[Column]) {
        let mut notes = Vec::new();
        if !self.table.ragged.is_empty() {
            let lines = listed(self.table.ragged.iter().map(|(line, _)| *line));
            notes.push(format!(
                "{} row(s) have another number of cells than the header's {} and are left out; the first in line(s) {lines}",
                self.table.ragged.len(),
                self.table.header.len()
            ));
        }
        if self.places.total > 0 {
            notes.push(format!(
                "{} row(s) without a usable position are left out; the first: {}",
                self.places.total,
                self.places.listed()
            ));
        }
        if self.lengths.total > 0 {
            notes.push(format!(
                "{} size(s) cannot be used, their trees have the usual size of their species; the first: {}",
                self.lengths.total,
                self.lengths.listed()
            ));
        }
        if !self.no_trees.is_empty() {
            let count = |kind: NoTree| self.no_trees.iter().filter(|(other, _)| *other == kind).count();
            notes.push(format!(
                "{} row(s) are no living trees and are left out: {} vacant sites, {} stumps, {} dead trees; the first in \
                 line(s) {}",
                self.no_trees.len(),
                count(NoTree::Vacant),
                count(NoTree::Stump),
                count(NoTree::Dead),
                listed(self.no_trees.iter().map(|(_, line)| *line))
            ));
        }
        if self.ranges > 0 {
            notes.push(format!("{} size(s) are ranges, of which the middle is taken", self.ranges));
        }
        if self.stems > 0 {
            notes.push(format!("{} tree(s) have several stems, of which the thickest counts", self.stems));
        }
        notes.extend(self.unused(columns));
        self.notes.append(&mut notes);
    }

    /// Names the columns that are not used, and what is missing therefore.
    fn unused(&self, columns: &[Column]) -> Option<String> {
        let named = |column: &&Column| column.meaning.is_none() && !column.name.is_empty();
        let unused: Vec<&str> = columns.iter().filter(named).map(|column| column.name.as_str()).collect();
        if unused.is_empty() {
            return None;
        }
        let mut text = format!(
            "columns that are not used: {}",
            unused.iter().take(COLUMNS_LISTED).copied().collect::<Vec<_>>().join(", ")
        );
        if unused.len() > COLUMNS_LISTED {
            text.push_str(&format!(" and {} more", unused.len() - COLUMNS_LISTED));
        }
        let sizes = &self.sizes;
        if sizes.diameter.is_none() && sizes.girth.is_none() && sizes.height.is_none() {
            text.push_str("; none holds a diameter or height, so trees have the usual size of their species (name such columns dbh_cm, height_m)");
        }
        if self.species.is_empty() {
            text.push_str("; none holds the species, so all trees are of one (name such a column species)");
        }
        Some(text)
    }
}

/// Whether the cells of a column are letters with A (alive) or L (living) and D (dead) among them, as in forest plots.
fn has_letter_codes(table: &Table, column: usize) -> bool {
    let (mut alive, mut dead) = (false, false);
    for cell in table.rows.iter().filter_map(|row| row.cells.get(column)).filter(|cell| !is_missing(cell)) {
        if cell.len() > 2 {
            return false;
        }
        alive |= cell.eq_ignore_ascii_case("a") || cell.eq_ignore_ascii_case("l");
        dead |= cell.eq_ignore_ascii_case("d");
    }
    alive && dead
}

/// What is wrong with a cell that is no number.
fn not_a_number(cell: &str) -> &'static str {
    let digits = |text: &str| text.bytes().filter(u8::is_ascii_digit).count() * 2 > text.len();
    let several = cell.matches(['.', ',', '\'', ' ', '\u{a0}', '\u{202f}']).count() > 1;
    if digits(cell) && several && !cell.contains(char::is_alphabetic) {
        "is not a number: write it without separators of thousands"
    } else {
        "is not a number"
    }
}

/// The first few lines, for a message.
fn listed(lines: impl Iterator<Item = u64>) -> String {
    lines.take(LISTED).map(|line| line.to_string()).collect::<Vec<_>>().join(", ")
}

/// Whether the middle of the positions is in the United States south of Canada, where trees are measured in inches.
fn is_in_usa(table: &Table, place: &PlaceColumns) -> bool {
    if place.coordinates() != Coordinates::Geographic {
        return false;
    }
    let at = |row: &Row| {
        let value = |axis: usize| place.coordinate(axis, &row.cells, table.decimal_comma);
        Some((value(0)?, value(1)?))
    };
    let mut places: Vec<(f64, f64)> = table.rows.iter().filter_map(at).collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    places.get(places.len() / 2).is_some_and(|&(longitude, latitude)| {
        let ontario = (-83.2..-76.0).contains(&longitude) && latitude > 43.3;
        let quebec = (-76.0..-70.8).contains(&longitude) && latitude > 45.05;
        (-125.0..-66.9).contains(&longitude) && (24.4..49.0).contains(&latitude) && !ontario && !quebec
    })
}
