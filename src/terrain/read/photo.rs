//! Photographs of the ground, as files have them: GeoTIFF, or PNG, JPEG and WebP with a world file beside them.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use glam::DVec2;
use image::{DynamicImage, GenericImageView, ImageFormat, ImageReader, Limits, Rgba};

use super::{Grid, ReadOptions, Source, Window, geotiff, mosaic, open, side_files};
use crate::math::color::{LINEAR_OF_CODE, srgb8};
use crate::terrain::{CoordinateSystem, TerrainError};

/// The most pixels of a file that is decoded as a whole. Of a GeoTIFF only the window is.
const MOST_PIXELS: u64 = 1 << 28;
/// The most pixels on a terrain, before they are joined to texels.
const MOST_WINDOW: u64 = 1 << 32;
/// The most bytes that decoding such a file may take.
const MOST_BYTES: u64 = 3 << 30;

/// What a file says of a photograph, short of its pixels.
#[derive(Clone, Copy, Debug)]
pub(in crate::terrain) struct Description {
    /// Width in pixels.
    pub columns: usize,
    /// Height in pixels.
    pub rows: usize,
    /// Where the middles of the pixels lie in the coordinates of the file, if it is known.
    pub(super) grid: Option<Grid>,
    /// The system of these coordinates, if it is known.
    pub system: Option<CoordinateSystem>,
}

/// A photograph.
#[derive(Debug)]
pub(in crate::terrain) struct Photo {
    pub path: PathBuf,
    length: u64,
    /// The bytes, if they do not come from the file at `path`.
    bytes: Option<Vec<u8>>,
    format: Option<ImageFormat>,
    pub description: Description,
}

impl Photo {
    /// Looks at a file; `coordinates` replaces its own coordinate system.
    ///
    /// # Errors
    /// [`TerrainError`]: a file that cannot be read, is damaged, or is no photograph that is read here.
    pub fn open(path: &Path, coordinates: Option<CoordinateSystem>) -> Result<Self, TerrainError> {
        let (length, start) = open(path)?;
        Self::new(path, length, &start, None, coordinates)
    }

    /// As [`open`](Self::open), for the bytes of a file of the name `path`.
    ///
    /// # Errors
    /// Those of [`open`](Self::open).
    pub fn of_bytes(bytes: Vec<u8>, path: &Path, coordinates: Option<CoordinateSystem>) -> Result<Self, TerrainError> {
        let start = bytes[..bytes.len().min(512)].to_vec();
        Self::new(path, bytes.len() as u64, &start, Some(bytes), coordinates)
    }

    fn new(
        path: &Path,
        length: u64,
        start: &[u8],
        bytes: Option<Vec<u8>>,
        coordinates: Option<CoordinateSystem>,
    ) -> Result<Self, TerrainError> {
        let options = ReadOptions { coordinate_system: coordinates, ..ReadOptions::default() };
        let source = Source { path, length, bytes: bytes.as_deref(), options: &options };
        let (format, description) = if geotiff::recognises(start) {
            (None, geotiff::photo::describe(&source)?)
        } else {
            let format = image::guess_format(start)
                .ok()
                .filter(|format| matches!(format, ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP));
            let Some(format) = format else {
                let remedy = if mosaic::recognises(start) {
                    "name its tiles in `tiles: [...]`, or write it as one: `gdal_translate -co TILED=YES IN.vrt OUT.tif`"
                } else {
                    "convert it: `gdal_translate -co TILED=YES IN OUT.tif`"
                };
                return Err(source.unsupported("not a photograph in GeoTIFF, PNG, JPEG or WebP", remedy));
            };
            (Some(format), describe(&source, format)?)
        };
        if description.columns == 0 || description.rows == 0 {
            return Err(source.unsupported("the photograph has no pixels", "export it again"));
        }
        Ok(Self { path: path.to_owned(), length, bytes, format, description })
    }

    /// Where a point of its coordinates lies, in pixels from the north-western corner; `None` for a photograph without a place.
    pub fn pixel_of(&self, point: DVec2) -> Option<DVec2> {
        let Grid { first, step, .. } = self.description.grid?;
        Some(DVec2::new(point.x - first.x, first.y - point.y) / step + 0.5)
    }

    /// The inverse of [`pixel_of`](Self::pixel_of).
    pub fn point_of(&self, pixel: DVec2) -> Option<DVec2> {
        let Grid { first, step, .. } = self.description.grid?;
        let offset = (pixel - 0.5) * step;
        Some(DVec2::new(first.x + offset.x, first.y - offset.y))
    }

    /// Its size in pixels.
    pub fn size(&self) -> DVec2 {
        DVec2::new(self.description.columns as f64, self.description.rows as f64)
    }

    /// Whether the file says where the photograph lies.
    pub fn has_place(&self) -> bool {
        self.description.grid.is_some()
    }

    /// Reads a window of `origin` and `size` in pixels, which must lie in the photograph; `factor` by `factor` pixels become one.
    ///
    /// # Errors
    /// [`TerrainError`] for damaged or unreadable data.
    pub fn pixels(&self, origin: [usize; 2], size: [usize; 2], factor: usize) -> Result<Pixels, TerrainError> {
        let options = ReadOptions::default();
        let bytes = self.bytes.as_deref();
        let source = Source { path: &self.path, length: self.length, bytes, options: &options };
        if size[0].saturating_mul(size[1]) as u64 > MOST_WINDOW {
            return Err(source.unsupported(
                format!("{} x {} pixels lie on the terrain, more than are read", size[0], size[1]),
                "reduce it: `gdal_translate -outsize 25% 25% -r average IN OUT.tif`",
            ));
        }
        let window = Window { column: origin[0], row: origin[1], columns: size[0], rows: size[1] };
        match self.format {
            None => geotiff::photo::pixels(&source, &window, factor),
            Some(format) => pixels(&source, format, &window, factor),
        }
    }
}

/// Size, place and coordinate system of an image with a world file, or the file of GDAL that holds the same.
fn describe(source: &Source, format: ImageFormat) -> Result<Description, TerrainError> {
    let broken = |error| source.malformed("image header", error, "fetch or export the image again");
    let reader = ImageReader::with_format(source.open()?, format);
    let (columns, rows) = reader.into_dimensions().map_err(broken)?;
    if u64::from(columns) * u64::from(rows) > MOST_PIXELS {
        return Err(source.unsupported(
            format!("{columns} x {rows} pixels are more than are decoded at once"),
            "write it as tiles, of which only those on the terrain are read: `gdal_translate -co TILED=YES IN OUT.tif`",
        ));
    }
    let (columns, rows) = (columns as usize, rows as usize);
    let beside = side_files::auxiliary(source);
    let place = match side_files::world(source)? {
        // A world file names the middle of the first pixel.
        Some(place) => Some(place),
        None => beside.place.map(|(corner, step)| (corner + 0.5 * step, step)),
    };
    let grid = match place {
        Some((first, step)) if step.x > 0.0 && step.y < 0.0 && first.is_finite() && step.is_finite() => {
            Some(Grid { columns, rows, first, step: step.abs() })
        }
        Some((_, step)) => {
            return Err(source.unsupported(
                format!("the pixels of the photograph measure {} x {}, so it is turned over", step.x, step.y),
                "turn it to the north: `gdalwarp IN OUT.tif`",
            ));
        }
        None => None,
    };
    Ok(Description {
        columns,
        rows,
        grid,
        system: source.options.coordinate_system.or_else(|| side_files::system(source)),
    })
}

fn pixels(source: &Source, format: ImageFormat, window: &Window, factor: usize) -> Result<Pixels, TerrainError> {
    let mut reader = ImageReader::with_format(Cursor::new(source.all()?), format);
    let mut limits = Limits::default();
    limits.max_alloc = Some(MOST_BYTES);
    reader.limits(limits);
    let image =
        reader.decode().map_err(|error| source.malformed("image data", error, "fetch or export the image again"))?;
    // The kinds that are looked up as they are; others are rare, and brought to one of them.
    let image = match image {
        DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_) | DynamicImage::ImageLuma8(_) => image,
        other => DynamicImage::ImageRgba8(other.into_rgba8()),
    };
    if image.width() < (window.column + window.columns) as u32 || image.height() < (window.row + window.rows) as u32 {
        return Err(source.malformed("image data", "the image is smaller than its header says", "export it again"));
    }
    let mut reducer = Reducer::new(window, factor);
    for y in 0..window.rows {
        for x in 0..window.columns {
            let Rgba(color) = image.get_pixel((window.column + x) as u32, (window.row + y) as u32);
            reducer.add(x, y, color);
        }
        reducer.finish_rows(y + 1);
    }
    Ok(reducer.pixels())
}

/// Pixels of a photograph, row by row from the north: sRGB and opacity, colours not multiplied by it.
pub(in crate::terrain) struct Pixels {
    pub columns: usize,
    pub rows: usize,
    pub texels: Vec<[u8; 4]>,
}

/// Joins squares of pixels to one: their mean in linear light, weighted by their opacity.
pub(super) struct Reducer {
    factor: usize,
    /// Rows of the window.
    source_rows: usize,
    /// Size of the result.
    columns: usize,
    rows: usize,
    texels: Vec<[u8; 4]>,
    /// Sums of the rows from `first` on that are not finished: light times opacity, opacity, and the number of pixels.
    sums: Vec<[f32; 5]>,
    first: usize,
}

impl Reducer {
    /// For a window of which `factor` by `factor` pixels become one.
    pub fn new(window: &Window, factor: usize) -> Self {
        let factor = factor.max(1);
        let (columns, rows) = (window.columns.div_ceil(factor), window.rows.div_ceil(factor));
        let texels = vec![[0; 4]; columns * rows];
        Self { factor, source_rows: window.rows, columns, rows, texels, sums: Vec::new(), first: 0 }
    }

    /// Adds the pixel at a column and row of the window. Its row must not be finished.
    pub fn add(&mut self, x: usize, y: usize, color: [u8; 4]) {
        if self.factor == 1 {
            self.texels[y * self.columns + x] = color;
            return;
        }
        let at = (y / self.factor - self.first) * self.columns + x / self.factor;
        if at >= self.sums.len() {
            self.sums.resize((at / self.columns + 1) * self.columns, [0.0; 5]);
        }
        let opacity = f32::from(color[3]) / 255.0;
        let sum = &mut self.sums[at];
        for (sum, code) in sum.iter_mut().zip(&color[..3]) {
            *sum += opacity * LINEAR_OF_CODE[usize::from(*code)];
        }
        sum[3] += opacity;
        sum[4] += 1.0;
    }

    /// All rows of the window above `end` have been added.
    pub fn finish_rows(&mut self, end: usize) {
        let end = if end >= self.source_rows { self.rows } else { end / self.factor };
        while self.factor > 1 && self.first < end {
            let row = self.sums.len().min(self.columns);
            let target = &mut self.texels[self.first * self.columns..][..row];
            for (texel, [r, g, b, opacity, count]) in target.iter_mut().zip(self.sums.drain(..row)) {
                if opacity > 0.0 {
                    let [r, g, b] = [r, g, b].map(|sum| srgb8(sum / opacity));
                    *texel = [r, g, b, (255.0 * opacity / count).round() as u8];
                }
            }
            self.first += 1;
        }
    }

    /// The result.
    pub fn pixels(mut self) -> Pixels {
        self.finish_rows(self.source_rows);
        Pixels { columns: self.columns, rows: self.rows, texels: self.texels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_of_pixels_become_their_mean_in_linear_light() {
        let window = Window { column: 5, row: 7, columns: 5, rows: 3 };
        let mut reducer = Reducer::new(&window, 2);
        for y in 0..3 {
            for x in 0..5 {
                let color = if (x + y) % 2 == 0 { [255, 255, 255, 255] } else { [0, 0, 0, 255] };
                // The right column is transparent.
                reducer.add(x, y, if x == 4 { [9, 9, 9, 0] } else { color });
            }
            reducer.finish_rows(y + 1);
        }
        let pixels = reducer.pixels();
        assert_eq!((pixels.columns, pixels.rows), (3, 2));
        // Half of the light is code 188.
        let half = [188, 188, 188, 255];
        assert_eq!(pixels.texels, [half, half, [0; 4], half, half, [0; 4]]);
    }

    #[test]
    fn without_reduction_pixels_stay_as_they_are() {
        let window = Window { column: 0, row: 0, columns: 2, rows: 1 };
        let mut reducer = Reducer::new(&window, 1);
        reducer.add(0, 0, [1, 2, 3, 4]);
        reducer.add(1, 0, [5, 6, 7, 8]);
        reducer.finish_rows(1);
        assert_eq!(reducer.pixels().texels, [[1, 2, 3, 4], [5, 6, 7, 8]]);
    }
}
