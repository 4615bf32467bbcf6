//! What can go wrong with a terrain, and what a reader wants the user to know.

use std::fmt;
use std::path::PathBuf;

use super::{CoordinateSystem, SystemMap};

/// Why a terrain could not be made. Every message says what is wrong, where, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum TerrainError {
    /// The file cannot be opened or read.
    #[error("{path}: {source}", path = .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The file's content has no known format.
    #[error(
        "{path}: not a known height format; readable are GeoTIFF, ESRI ASCII grid, SRTM .hgt (1201x1201, 3601x3601 or 7201x7201) \
         and 16-bit greyscale PNG; convert with `gdal_translate -of GTiff IN OUT.tif`", path = .path.display()
    )]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The file breaks the rules of its format, ends too early, or promises more than it holds.
    #[error("{path}: {location}: {problem}; {remedy}", path = .path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line and column, row, tag or chunk.
        location: String,
        /// What is wrong there.
        problem: String,
        /// What the user can do.
        remedy: String,
    },
    /// The file is well formed but says something that this reader does not handle.
    #[error("{path}: {problem}; {remedy}", path = .path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What is not handled.
        problem: String,
        /// What the user can do.
        remedy: String,
    },
    /// It is not known what the file's horizontal coordinates mean.
    #[error(
        "{path}: unknown coordinate system ({problem}); write one into the file (`gdal_edit.py -a_srs EPSG:<code> FILE`) \
         or state it in the scene's terrain, `coordinates: Utm(zone: 33)` (`ReadOptions::coordinate_system`)", path = .path.display()
    )]
    UnknownCoordinateSystem {
        /// The file.
        path: PathBuf,
        /// What was found.
        problem: String,
    },
    /// A PNG has no metres, and none were given.
    #[error(
        "{path}: an image says nothing about metres; give its sample spacing and the heights of black and white in \
         `terrain: Image(...)` in the scene (`ReadOptions::image_scale`)", path = .path.display()
    )]
    MissingImageScale {
        /// The file.
        path: PathBuf,
    },
    /// Every sample is marked as missing.
    #[error("{path}: all {samples} samples are without data; check the file's no-data value and the crop", path = .path.display())]
    OnlyNoData {
        /// The file.
        path: PathBuf,
        /// Samples looked at.
        samples: usize,
    },
    /// The crop keeps less than two rows or columns.
    #[error(
        "{path}: the crop keeps {columns} columns and {rows} rows, at least 2 of each are needed; the file covers \
         west {west}, south {south}, east {east}, north {north} in its own coordinates", path = .path.display()
    )]
    EmptyCrop {
        /// The file.
        path: PathBuf,
        /// Columns inside the crop.
        columns: usize,
        /// Rows inside the crop.
        rows: usize,
        /// Western limit of the file's samples, in its coordinates.
        west: f64,
        /// Southern limit.
        south: f64,
        /// Eastern limit.
        east: f64,
        /// Northern limit.
        north: f64,
    },
    /// A photograph that lies elsewhere than the terrain.
    #[error(
        "{path}: the photograph does not reach the terrain; it covers west {west}, south {south}, east {east}, north {north} in \
         its own coordinates, where the terrain's centre is at {centre_x}, {centre_y}; check the coordinate system of both, or \
         state that of the photograph by `drape: (coordinates: ...)`", path = .path.display()
    )]
    PhotoOutside {
        /// The file.
        path: PathBuf,
        /// Western limit of the photograph, in its coordinates.
        west: f64,
        /// Southern limit.
        south: f64,
        /// Eastern limit.
        east: f64,
        /// Northern limit.
        north: f64,
        /// Where the terrain's centre lies in these coordinates, to the east.
        centre_x: f64,
        /// The same to the north.
        centre_y: f64,
    },
    /// A height field needs two samples each way to have a surface.
    #[error("a height field of {columns} columns and {rows} rows has no surface; at least 2 of each are needed")]
    TooSmall {
        /// Columns given.
        columns: usize,
        /// Rows given.
        rows: usize,
    },
    /// More samples than fit the limit of memory.
    #[error("{columns} columns x {rows} rows are more than the limit of {limit} samples; crop or resample the data")]
    TooLarge {
        /// Columns asked for.
        columns: usize,
        /// Rows asked for.
        rows: usize,
        /// The most samples accepted.
        limit: usize,
    },
    /// The number of heights is not columns times rows.
    #[error("{heights} heights do not fill {columns} columns x {rows} rows; give columns * rows values, row by row")]
    WrongCount {
        /// Heights given.
        heights: usize,
        /// Columns given.
        columns: usize,
        /// Rows given.
        rows: usize,
    },
    /// A height is not a number, infinite or absurd.
    #[error("the height at column {column}, row {row} is {height}; heights must be finite and within +-{limit} m")]
    BadHeight {
        /// Column from the west.
        column: usize,
        /// Row from the north.
        row: usize,
        /// The value found.
        height: f32,
        /// The largest magnitude accepted, in metres.
        limit: f32,
    },
    /// A spacing, wavelength or other parameter is out of its range.
    #[error("{name} is {value}; it must be {range}")]
    BadParameter {
        /// Which parameter.
        name: &'static str,
        /// The value found.
        value: f64,
        /// The range accepted, in words.
        range: &'static str,
    },
}

/// What a reader did on its own account; the terrain is usable.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// Samples without data were filled from the rim of their holes.
    HolesFilled {
        /// Samples filled.
        filled: usize,
        /// Samples of the terrain.
        total: usize,
    },
    /// Samples with impossible heights were taken as holes although the file does not mark them.
    ImplausibleHeights {
        /// Samples concerned.
        count: usize,
    },
    /// Samples of a number that marks missing data elsewhere were taken as holes, although the file does not mark them.
    AssumedMissing {
        /// The number, in the file's own unit.
        value: f64,
        /// Samples concerned.
        count: usize,
        /// Lowest of the other samples.
        low: f64,
        /// Highest of the other samples.
        high: f64,
    },
    /// Samples of a number that may mark missing data were read as heights.
    DoubtfulHeights {
        /// The number, in the file's own unit.
        value: f64,
        /// Samples concerned.
        count: usize,
        /// Lowest of the other samples.
        low: f64,
        /// Highest of the other samples.
        high: f64,
    },
    /// The file says what its numbers mean, and they were converted: height in metres = `factor` * sample + `offset`.
    HeightsConverted {
        /// Metres per unit of a sample.
        factor: f64,
        /// Metres of a sample of 0.
        offset: f64,
        /// The unit that the file states, if any.
        unit: Option<String>,
    },
    /// The file states a unit of heights that is not known; metres were assumed.
    UnknownHeightUnit {
        /// The unit as the file writes it.
        unit: String,
    },
    /// Samples that a mask or an alpha band of the file hides were taken as holes.
    Masked {
        /// Samples concerned.
        count: usize,
    },
    /// A mask of the file could not be read; all samples count.
    MaskUnread {
        /// Why.
        problem: String,
    },
    /// The file names no coordinate system; its coordinates were taken as degrees or as local metres.
    AssumedCoordinates {
        /// True: degrees of longitude and latitude. False: local metres.
        degrees: bool,
    },
    /// A projected system was read whose location on earth is not known here: distances are right, but latitude and
    /// longitude are not available.
    PlaceUnknown {
        /// The EPSG code found, if any.
        epsg: Option<u32>,
    },
    /// A projected file states no linear unit; metres were assumed.
    AssumedMetres,
    /// A photograph says not where it lies, or the terrain does not: it covers the whole terrain.
    PhotoStretched {
        /// The photograph.
        path: PathBuf,
        /// Whether the photograph says where it lies.
        has_place: bool,
    },
    /// A photograph names no coordinate system; that of the terrain was assumed.
    PhotoSystemAssumed {
        /// The photograph.
        path: PathBuf,
    },
    /// The photograph has more pixels on the terrain than a texture holds.
    PhotoReduced {
        /// Metres of a pixel as it is drawn.
        drawn: f64,
        /// Metres of a pixel of the file.
        own: f64,
    },
    /// A tile of a photograph lies outside the terrain.
    PhotoTileUnused {
        /// The tile.
        path: PathBuf,
    },
}

impl Warning {
    /// The warning that a projected system does not tell where it lies, if it does not.
    pub(super) fn place_unknown(system: CoordinateSystem) -> Option<Self> {
        match system {
            CoordinateSystem::Projected { epsg, .. } if SystemMap::new(system).is_none() => {
                Some(Self::PlaceUnknown { epsg })
            }
            _ => None,
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::HolesFilled { filled, total } => write!(
                f,
                "{filled} of {total} samples ({:.2} %) have no data and were filled from the rim of their holes",
                100.0 * *filled as f64 / (*total).max(1) as f64
            ),
            Warning::ImplausibleHeights { count } => write!(
                f,
                "{count} samples lie outside -12000 m to 30000 m and were taken as missing; set the file's no-data value"
            ),
            Warning::AssumedMissing { value, count, low, high } => write!(
                f,
                "{count} samples of exactly {value} can be no heights beside the others ({low} to {high}) and were taken as \
                 missing; set the file's no-data value (`gdal_edit.py -a_nodata {value} FILE`)"
            ),
            Warning::DoubtfulHeights { value, count, low, high } => write!(
                f,
                "{count} samples of exactly {value} stand apart from the others ({low} to {high}); they were read as heights: \
                 if they are missing data, set the file's no-data value (`gdal_edit.py -a_nodata {value} FILE`)"
            ),
            Warning::HeightsConverted { factor, offset, unit } => {
                let unit = unit.as_ref().map_or(String::new(), |unit| format!(" (unit {unit})"));
                write!(f, "as the file states{unit}, heights in metres are {factor} x sample")?;
                if *offset != 0.0 { write!(f, " + {offset}") } else { Ok(()) }
            }
            Warning::UnknownHeightUnit { unit } => write!(
                f,
                "the file states heights in `{unit}`, which is not known here; metres were assumed: convert them, or correct it \
                 by the scene's `exaggeration`"
            ),
            Warning::Masked { count } => {
                write!(f, "{count} samples are hidden by the file's mask or alpha band and were taken as missing")
            }
            Warning::MaskUnread { problem } => {
                write!(f, "the file's mask cannot be read ({problem}); all of its samples are taken as heights")
            }
            Warning::AssumedCoordinates { degrees: true } => {
                write!(f, "the file names no coordinate system; its coordinates look like degrees and were taken so")
            }
            Warning::AssumedCoordinates { degrees: false } => {
                write!(f, "the file names no coordinate system; its coordinates were taken as local metres")
            }
            Warning::PlaceUnknown { epsg: Some(code) } => write!(
                f,
                "EPSG:{code} is not known here and read as plain metres: latitude and longitude of the terrain are unknown, state them for the sun"
            ),
            Warning::PlaceUnknown { epsg: None } => write!(
                f,
                "a projection of the file's own is read as plain metres: latitude and longitude of the terrain are unknown, \
                 state them for the sun"
            ),
            Warning::AssumedMetres => write!(f, "the file states no linear unit; metres were assumed"),
            Warning::PhotoStretched { path, has_place: false } => write!(
                f,
                "{}: the photograph has neither a place in the file nor a world file beside it (.pgw, .jgw, .wld): it is \
                 stretched over the whole terrain",
                path.display()
            ),
            Warning::PhotoStretched { path, has_place: true } => write!(
                f,
                "{}: the terrain has no coordinates to which the photograph's could be related: it is stretched over the whole \
                 terrain",
                path.display()
            ),
            Warning::PhotoSystemAssumed { path } => write!(
                f,
                "{}: the photograph names no coordinate system, and that of the terrain was assumed; state another by \
                 `drape: (coordinates: ...)`",
                path.display()
            ),
            Warning::PhotoReduced { drawn, own } => write!(
                f,
                "the photograph is drawn with pixels of {drawn:.2} m instead of {own:.2} m, because a texture holds no more; \
                 crop the terrain to keep them"
            ),
            Warning::PhotoTileUnused { path } => {
                write!(f, "{}: this tile of the photograph lies outside the terrain", path.display())
            }
        }
    }
}
