//! What can go wrong between a rule or an inventory and a stand.

use std::fmt;
use std::path::PathBuf;

use thiserror::Error;

/// A cell of an inventory that cannot be read as the number its column promises.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BadValue {
    /// Line of the file, from 1 (the header counts).
    pub line: u64,
    /// The column's name as the file writes it.
    pub column: String,
    /// The text of the cell.
    pub value: String,
    /// What is wrong with it.
    pub reason: &'static str,
}

impl fmt::Display for BadValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}, column `{}`: \"{}\" {}", self.line, self.column, self.value, self.reason)
    }
}

/// Errors of the room `scatter`. Each message says what, where, and how to mend it.
#[derive(Debug, Error)]
pub enum ScatterError {
    /// A placement rule has a value that no stand can meet.
    #[error("placement rule `{field}` is {value}: {remedy}")]
    Rule {
        /// Path of the field, such as `species[2].weight`.
        field: String,
        /// The value found.
        value: String,
        /// What the value must be, and how to get there.
        remedy: String,
    },
    /// The rules ask for more trees than a stand holds.
    #[error("the rules ask for {count:.0} trees, a stand holds {limit}: lower `stems_per_hectare` or the area")]
    TooManyTrees {
        /// Trees asked for.
        count: f64,
        /// The most a stand holds.
        limit: u32,
    },
    /// A file cannot be read.
    #[error("cannot read the inventory {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A line of an inventory is not a record of the table.
    #[error("inventory {name}, line {line}: {message}")]
    Record {
        /// Name of the file or source.
        name: String,
        /// Line, from 1.
        line: u64,
        /// What is wrong, and the remedy.
        message: String,
    },
    /// An inventory lacks the columns of the positions.
    #[error(
        "inventory {name} has no pair of position columns among [{found}]: name them x,y or x_m,y_m (metres), \
         easting,northing (metres), or lon,lat (degrees)"
    )]
    NoPosition {
        /// Name of the file or source.
        name: String,
        /// The columns found.
        found: String,
    },
    /// Two columns of an inventory mean the same quantity.
    #[error("inventory {name}: the columns `{first}` and `{second}` both hold the {quantity}: rename or remove one")]
    AmbiguousColumn {
        /// Name of the file or source.
        name: String,
        /// The quantity, such as `height`.
        quantity: &'static str,
        /// One column.
        first: String,
        /// The other.
        second: String,
    },
    /// Cells of number columns that are not (possible) numbers.
    #[error("inventory {name}: {total} cell(s) cannot be used; the first: {}", listed(first))]
    BadValues {
        /// Name of the file or source.
        name: String,
        /// Number of such cells in the file.
        total: usize,
        /// The first five of them.
        first: Vec<BadValue>,
    },
    /// The species table of an inventory has an entry that no tree can be drawn from.
    #[error("inventory species `{species}`: {message}")]
    Species {
        /// Name of the entry.
        species: String,
        /// What is wrong, and the remedy.
        message: String,
    },
    /// The species table of an inventory is empty.
    #[error("the species table of the inventory is empty: give at least one species, the first serves unnamed trees")]
    NoSpecies,
    /// More plant variants than a packed tree can name.
    #[error("{count} plant variants, a packed stand holds {limit}: use fewer individuals per species")]
    TooManyVariants {
        /// Variants given.
        count: usize,
        /// The most there can be.
        limit: usize,
    },
    /// A tree names a variant that does not exist.
    #[error("tree {tree} is of variant {variant}, but only {count} variants are known: give the size of each variant")]
    UnknownVariant {
        /// Index of the tree in its stand.
        tree: usize,
        /// The variant it names.
        variant: u16,
        /// Number of variants known.
        count: usize,
    },
    /// The size of a variant is not usable.
    #[error("variant {variant} has {what} {value} m: give 0 to 1000 m")]
    PlantSize {
        /// The variant.
        variant: usize,
        /// `radius` or `height`.
        what: &'static str,
        /// The value found.
        value: f32,
    },
    /// A tree has a value that its 16 bytes cannot hold.
    #[error("tree {tree} has {what} {value}, which cannot be packed: {remedy}")]
    Unpackable {
        /// Index of the tree in its stand.
        tree: usize,
        /// Which of its values.
        what: &'static str,
        /// The value.
        value: f64,
        /// The possible range and the remedy.
        remedy: String,
    },
    /// The trees of a stand lie farther apart than its cells can be counted.
    #[error(
        "the trees lie {width:.0} m apart along {axis}, which is too much for cells of {cell_size} m: take cells of {least} m \
         or more (at most 4096 m), or split the stand"
    )]
    TooWide {
        /// `X` or `Z`.
        axis: &'static str,
        /// Extent of the cells that hold trees, metres.
        width: f64,
        /// Side of a cell, metres.
        cell_size: f64,
        /// A side that is large enough, metres.
        least: f64,
    },
    /// The cell size of a packed stand or the texel of a cover map is out of range.
    #[error("{what} is {value} m: {remedy}")]
    Size {
        /// Which size.
        what: &'static str,
        /// The value found.
        value: f64,
        /// The possible range and the remedy.
        remedy: String,
    },
}

fn listed(values: &[BadValue]) -> String {
    values.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}
