//! Reads terrain from files of several formats. The content of a file determines its format, not its name.
//!
//! | format | horizontal system | heights |
//! |---|---|---|
//! | GeoTIFF, BigTIFF | from its GeoKeys, or the `.tfw` and `.prj` beside it: degrees, UTM, national systems by EPSG code, any projection in metres or feet | 8 to 64 bit integers and floats, one band and its alpha or mask, scale, offset and unit of GDAL |
//! | ESRI ASCII grid | from the `.prj` beside it, else local metres, or degrees if the numbers look like it | text |
//! | SRTM `.hgt` | degrees, from the file's name (`N36W085.hgt`) | 16 bit, 1201², 3601², 7201² or 1801 x 3601 |
//! | virtual raster `.vrt`, lists of tiles | that of the tiles | those of the tiles, on one grid |
//! | PNG, 16 bit greyscale | metres from [`ReadOptions::image_scale`] | from the same |

mod ascii_grid;
mod geotiff;
mod hgt;
mod image;
mod mosaic;
pub(super) mod photo;
mod sentinels;
mod side_files;

pub(super) use side_files::of_wkt as system_of_wkt;

use std::borrow::Cow;
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read, Seek};
use std::path::Path;

use glam::DVec2;

pub use mosaic::read_terrain_tiles;

use super::holes::fill_holes;
use super::{CoordinateSystem, GeoReference, HeightField, MAX_SAMPLES, Surroundings, Terrain, TerrainError, Warning};

/// Plausible heights in metres. Values outside this range are not heights on earth: they mark missing data.
const PLAUSIBLE: std::ops::RangeInclusive<f32> = -12_000.0..=30_000.0;

/// What to read, and how to interpret it. The default reads a whole file as the file describes itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReadOptions {
    /// Read only the samples inside this window.
    pub crop: Option<Crop>,
    /// Scale of an image in metres. PNG requires it; other formats ignore it.
    pub image_scale: Option<ImageScale>,
    /// The coordinate system, which replaces that of the file. `None` takes the one that the file states.
    pub coordinate_system: Option<CoordinateSystem>,
    /// How the terrain continues outside the file.
    pub surroundings: Surroundings,
}

/// A window in the coordinates of the file (degrees, or easting and northing). Samples on its border belong to it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Crop {
    /// Smallest x.
    pub west: f64,
    /// Smallest y.
    pub south: f64,
    /// Largest x.
    pub east: f64,
    /// Largest y.
    pub north: f64,
}

/// The scale of a greyscale image in metres. File coordinates are metres from the lower left sample.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ImageScale {
    /// Distance between neighbouring samples in metres, above 0.
    pub spacing: f64,
    /// Height of black (0) in metres.
    pub lowest: f64,
    /// Height of white (65535) in metres.
    pub highest: f64,
}

/// Reads a terrain. Holes are filled from their rims. The warnings say what the reader had to decide by itself.
///
/// Memory stays within a few times the requested samples, and within a limit that follows from the size of the file. A
/// header alone allocates nothing.
///
/// # Errors
/// See [`TerrainError`]: a file that cannot be read, has an unknown format, is broken, has no data, has no known
/// coordinate system, or has fewer than two rows or columns. No input makes this function panic.
pub fn read_terrain(path: &Path, options: &ReadOptions) -> Result<(Terrain, Vec<Warning>), TerrainError> {
    let (length, start) = open(path)?;
    Source { path, length, bytes: None, options }.read(&start)
}

/// Length and first bytes of a file.
fn open(path: &Path) -> Result<(u64, Vec<u8>), TerrainError> {
    let io = |source| TerrainError::Io { path: path.to_owned(), source };
    let mut file = File::open(path).map_err(io)?;
    let length = file.metadata().map_err(io)?.len();
    let mut start = Vec::new();
    file.by_ref().take(512).read_to_end(&mut start).map_err(io)?;
    Ok((length, start))
}

/// Reads a terrain from the bytes of a file, as [`read_terrain`] reads the file itself. `name` is the name of the file:
/// it is used in messages, and it gives the location of an `.hgt` file.
///
/// # Errors
/// Those of [`read_terrain`].
pub fn read_terrain_bytes(
    bytes: &[u8],
    name: &Path,
    options: &ReadOptions,
) -> Result<(Terrain, Vec<Warning>), TerrainError> {
    let start = &bytes[..bytes.len().min(512)];
    Source { path: name, length: bytes.len() as u64, bytes: Some(bytes), options }.read(start)
}

/// The bytes of a file, with random access.
trait ReadAnywhere: BufRead + Seek {}

impl<R: BufRead + Seek> ReadAnywhere for R {}

/// Input of a reader.
type Input<'a> = Box<dyn ReadAnywhere + 'a>;

/// A file and how to read it, for every reader.
struct Source<'a> {
    path: &'a Path,
    /// Size of the file in bytes.
    length: u64,
    /// The bytes, if they do not come from the file at `path`.
    bytes: Option<&'a [u8]>,
    options: &'a ReadOptions,
}

impl<'a> Source<'a> {
    /// Reads the file, whose first bytes are `start`.
    fn read(&self, start: &[u8]) -> Result<(Terrain, Vec<Warning>), TerrainError> {
        let raster = if mosaic::recognises(start) { mosaic::read(self)? } else { self.raster(start)? };
        raster.into_terrain(self)
    }

    /// The samples of a file that is one raster.
    fn raster(&self, start: &[u8]) -> Result<Raster, TerrainError> {
        if geotiff::recognises(start) {
            geotiff::read(self)
        } else if image::recognises(start) {
            image::read(self)
        } else if ascii_grid::recognises(start) {
            ascii_grid::read(self)
        } else if hgt::recognises(self.length) {
            hgt::read(self)
        } else {
            Err(TerrainError::UnknownFormat { path: self.path.to_owned() })
        }
    }

    /// Opens the bytes for reading on demand: a window of a large file does not need the whole file.
    fn open(&self) -> Result<Input<'a>, TerrainError> {
        match self.bytes {
            Some(bytes) => Ok(Box::new(Cursor::new(bytes))),
            None => {
                let file =
                    File::open(self.path).map_err(|source| TerrainError::Io { path: self.path.to_owned(), source })?;
                Ok(Box::new(BufReader::new(file)))
            }
        }
    }

    /// All bytes at once.
    fn all(&self) -> Result<Cow<'a, [u8]>, TerrainError> {
        match self.bytes {
            Some(bytes) => Ok(Cow::Borrowed(bytes)),
            None => {
                let bytes = std::fs::read(self.path);
                bytes.map(Cow::Owned).map_err(|source| TerrainError::Io { path: self.path.to_owned(), source })
            }
        }
    }

    fn malformed(
        &self,
        location: impl Into<String>,
        problem: impl ToString,
        remedy: impl Into<String>,
    ) -> TerrainError {
        TerrainError::Malformed {
            path: self.path.to_owned(),
            location: location.into(),
            problem: problem.to_string(),
            remedy: remedy.into(),
        }
    }

    fn unsupported(&self, problem: impl Into<String>, remedy: impl Into<String>) -> TerrainError {
        TerrainError::Unsupported { path: self.path.to_owned(), problem: problem.into(), remedy: remedy.into() }
    }

    /// The part of a grid that the options request.
    fn window(&self, grid: &Grid) -> Result<Window, TerrainError> {
        if grid.columns < 2 || grid.rows < 2 {
            return Err(TerrainError::TooSmall { columns: grid.columns, rows: grid.rows });
        }
        let whole = Window { column: 0, row: 0, columns: grid.columns, rows: grid.rows };
        let window = match self.options.crop {
            None => whole,
            Some(crop) => {
                // Tolerance of a millionth of a cell: a limit that is written with few digits includes its sample.
                let range = |low: f64, high: f64, count: usize| {
                    let first = (low - 1e-6).ceil().max(0.0);
                    let end = ((high + 1e-6).floor() + 1.0).min(count as f64);
                    // A limit that is NaN selects nothing, because comparisons with it are false.
                    if low <= high && first < end { (first as usize, (end - first) as usize) } else { (0, 0) }
                };
                let west = (crop.west - grid.first.x) / grid.step.x;
                let east = (crop.east - grid.first.x) / grid.step.x;
                let north = (grid.first.y - crop.north) / grid.step.y;
                let south = (grid.first.y - crop.south) / grid.step.y;
                let (column, columns) = range(west, east, grid.columns);
                let (row, rows) = range(north, south, grid.rows);
                if columns < 2 || rows < 2 {
                    let last = grid.position(grid.columns - 1, grid.rows - 1);
                    return Err(TerrainError::EmptyCrop {
                        path: self.path.to_owned(),
                        columns,
                        rows,
                        west: grid.first.x,
                        south: last.y,
                        east: last.x,
                        north: grid.first.y,
                    });
                }
                Window { column, row, columns, rows }
            }
        };
        if window.columns.checked_mul(window.rows).is_none_or(|count| count > MAX_SAMPLES) {
            return Err(TerrainError::TooLarge { columns: window.columns, rows: window.rows, limit: MAX_SAMPLES });
        }
        Ok(window)
    }
}

/// The positions of a file's samples in its coordinates.
#[derive(Clone, Copy, Debug)]
struct Grid {
    columns: usize,
    rows: usize,
    /// File coordinates of the north-west sample.
    first: DVec2,
    /// Distance between samples in file coordinates, to the east and to the south; both positive.
    step: DVec2,
}

impl Grid {
    fn position(&self, column: usize, row: usize) -> DVec2 {
        self.first + DVec2::new(column as f64, -(row as f64)) * self.step
    }
}

/// A part of a grid, in samples.
#[derive(Clone, Copy, Debug)]
struct Window {
    column: usize,
    row: usize,
    columns: usize,
    rows: usize,
}

/// The result of a reader: the samples of a window. Holes are NaN.
struct Raster {
    grid: Grid,
    window: Window,
    system: CoordinateSystem,
    heights: Vec<f32>,
    warnings: Vec<Warning>,
}

impl Raster {
    fn into_terrain(mut self, source: &Source) -> Result<(Terrain, Vec<Warning>), TerrainError> {
        let mut implausible = 0;
        for height in &mut self.heights {
            if !height.is_nan() && !PLAUSIBLE.contains(height) {
                *height = f32::NAN;
                implausible += 1;
            }
        }
        if implausible > 0 {
            self.warnings.push(Warning::ImplausibleHeights { count: implausible });
        }
        let samples = self.heights.len();
        let filled = fill_holes(self.window.columns, self.window.rows, &mut self.heights);
        if filled == samples {
            return Err(TerrainError::OnlyNoData { path: source.path.to_owned(), samples });
        }
        if filled > 0 {
            self.warnings.push(Warning::HolesFilled { filled, total: samples });
        }
        let Window { column, row, columns, rows } = self.window;
        let corners = [self.grid.position(column, row), self.grid.position(column + columns - 1, row + rows - 1)];
        let reference = GeoReference::new(self.system, 0.5 * (corners[0] + corners[1]))?;
        let spacing = self.grid.step * reference.metres_per_unit();
        let field = HeightField::new(columns, rows, spacing, self.heights)?;
        Ok((Terrain::new(field, Some(reference), source.options.surroundings), self.warnings))
    }
}
