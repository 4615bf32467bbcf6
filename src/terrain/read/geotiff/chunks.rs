//! The strips or tiles of a TIFF that overlap a window, decoded one after the other.

use tiff::ColorType;
use tiff::decoder::{ChunkType, Decoder, DecodingResult};
use tiff::tags::Tag;

use super::super::{Source, Window};
use super::overlay::Overlay;
use super::{Bands, FETCH, MAX_EXPANSION};
use crate::terrain::{MAX_SAMPLES, TerrainError};

/// What is to be read of an image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    /// Columns of the image.
    pub columns: usize,
    /// Its rows.
    pub rows: usize,
    /// The part to read.
    pub window: Window,
    /// How its bands are stored, and which of them is meant.
    pub bands: Bands,
}

/// A decoded strip or tile.
pub(super) struct Chunk {
    /// Column and row of its first pixel in the image.
    pub left: usize,
    pub top: usize,
    /// Its size in pixels, without what lies beyond the image.
    pub width: usize,
    pub height: usize,
    /// The samples of its pixels, row by row; those of a pixel stand together.
    pub values: DecodingResult,
    /// Samples of a pixel.
    pub together: usize,
    /// Whether a sample is a bit; each row then begins with a new byte.
    pub bits: bool,
}

impl Chunk {
    /// Calls `pixel` with the column and row in `window` of each pixel that lies in it, and with the index of the pixel's first
    /// sample.
    pub fn pixels_in(&self, window: &Window, mut pixel: impl FnMut(usize, usize, usize)) {
        for y in self.top.max(window.row)..(self.top + self.height).min(window.row + window.rows) {
            for x in self.left.max(window.column)..(self.left + self.width).min(window.column + window.columns) {
                let at = ((y - self.top) * self.width + x - self.left) * self.together;
                pixel(x - window.column, y - window.row, at);
            }
        }
    }

    /// The sample at an index that [`pixels_in`](Self::pixels_in) gave, or a following one of the same pixel.
    pub fn sample(&self, at: usize) -> f64 {
        if self.bits {
            let (row, column) = (at / self.width, at % self.width);
            let byte = sample(&self.values, row * self.width.div_ceil(8) + column / 8) as u8;
            return f64::from(byte >> (7 - column % 8) & 1);
        }
        sample(&self.values, at)
    }
}

fn sample(values: &DecodingResult, at: usize) -> f64 {
    match values {
        DecodingResult::U8(v) => f64::from(v[at]),
        DecodingResult::U16(v) => f64::from(v[at]),
        DecodingResult::U32(v) => f64::from(v[at]),
        DecodingResult::U64(v) => v[at] as f64,
        DecodingResult::F16(v) => v[at].to_f64(),
        DecodingResult::F32(v) => f64::from(v[at]),
        DecodingResult::F64(v) => v[at],
        DecodingResult::I8(v) => f64::from(v[at]),
        DecodingResult::I16(v) => f64::from(v[at]),
        DecodingResult::I32(v) => f64::from(v[at]),
        DecodingResult::I64(v) => v[at] as f64,
    }
}

fn count(values: &DecodingResult) -> usize {
    match values {
        DecodingResult::U8(v) => v.len(),
        DecodingResult::U16(v) => v.len(),
        DecodingResult::U32(v) => v.len(),
        DecodingResult::U64(v) => v.len(),
        DecodingResult::F16(v) => v.len(),
        DecodingResult::F32(v) => v.len(),
        DecodingResult::F64(v) => v.len(),
        DecodingResult::I8(v) => v.len(),
        DecodingResult::I16(v) => v.len(),
        DecodingResult::I32(v) => v.len(),
        DecodingResult::I64(v) => v.len(),
    }
}

/// What [`visit_chunks`] has come to.
pub(super) enum Visited<'a> {
    /// A strip or tile.
    Chunk(&'a Chunk),
    /// All strips or tiles with rows above this one.
    RowsAbove(usize),
}

/// Decodes the strips or tiles that overlap a window, and calls `visit` with each of them: from the top, and with the number of
/// the image's rows above which all have been visited. Empty tiles are left out.
pub(super) fn visit_chunks(
    source: &Source,
    decoder: &mut Decoder<Overlay>,
    plane: &Plane,
    mut visit: impl FnMut(Visited) -> Result<(), TerrainError>,
) -> Result<(), TerrainError> {
    let Plane { columns, rows, window, bands } = *plane;
    let broken = |error: tiff::TiffError| source.malformed("TIFF directory", error, FETCH);
    let tiled = decoder.get_chunk_type() == ChunkType::Tile;
    // The decoder's own functions for this panic if the directory contradicts itself.
    let (chunk_columns, chunk_rows) = if tiled {
        let width: u32 = decoder.get_tag_unsigned(Tag::TileWidth).map_err(broken)?;
        let length: u32 = decoder.get_tag_unsigned(Tag::TileLength).map_err(broken)?;
        (width as usize, length as usize)
    } else {
        let height: Option<u64> = decoder.find_tag_unsigned(Tag::RowsPerStrip).map_err(broken)?;
        (columns, height.unwrap_or(rows as u64).min(rows as u64) as usize)
    };
    if chunk_columns == 0 || chunk_rows == 0 || chunk_columns.saturating_mul(chunk_rows) > MAX_SAMPLES {
        return Err(source.malformed("TIFF directory", format!("tiles of {chunk_columns} x {chunk_rows}"), FETCH));
    }
    let across = columns.div_ceil(chunk_columns);
    // Bands apart have their strips or tiles one after the other; otherwise the samples of a pixel stand together.
    let before = if bands.apart { bands.index * across * rows.div_ceil(chunk_rows) } else { 0 };
    let together = if bands.apart { 1 } else { bands.count };
    let tag = if tiled { Tag::TileByteCounts } else { Tag::StripByteCounts };
    let sizes: Vec<u64> = decoder.find_tag_unsigned_vec(tag).map_err(broken)?.unwrap_or_default();
    let chunk_range = |from: usize, count: usize, size: usize| from / size..(from + count).div_ceil(size);
    let across_range = chunk_range(window.column, window.columns, chunk_columns);
    let down_range = chunk_range(window.row, window.rows, chunk_rows);

    // Before allocating: can the stored bytes hold the requested samples at all?
    let (mut stored, mut wanted) = (0_u64, 0_u64);
    for down in down_range.clone() {
        for column in across_range.clone() {
            let index = before + down * across + column;
            let Some(size) = sizes.get(index) else {
                let problem = format!("strip or tile {index} is missing");
                return Err(source.malformed("TIFF directory", problem, FETCH));
            };
            stored = stored.saturating_add(*size);
            // A tile without bytes is empty and takes none.
            if *size > 0 {
                let overlap = |from: usize, count: usize, start: usize, size: usize| {
                    (from + count).min(start + size).saturating_sub(from.max(start)) as u64
                };
                wanted += overlap(window.column, window.columns, column * chunk_columns, chunk_columns)
                    * overlap(window.row, window.rows, down * chunk_rows, chunk_rows);
            }
        }
    }
    if wanted > stored.min(source.length).saturating_mul(MAX_EXPANSION) {
        return Err(source.malformed(
            "TIFF directory",
            format!("{} x {} samples cannot be in the {stored} bytes stored for them", window.columns, window.rows),
            FETCH,
        ));
    }

    for down in down_range {
        for column in across_range.clone() {
            let index = before + down * across + column;
            // A tile without bytes: GDAL omits tiles in which all data are missing.
            if sizes[index] == 0 {
                continue;
            }
            let at = || format!("strip or tile {index}");
            let (left, top) = (column * chunk_columns, down * chunk_rows);
            let (width, height) = (chunk_columns.min(columns - left), chunk_rows.min(rows - top));
            // The decoder reserves memory for all of it, of which the window may be the least part.
            if (width * height) as u64 > sizes[index].min(source.length).saturating_mul(MAX_EXPANSION) {
                let problem = format!("{width} x {height} samples cannot be in {} bytes", sizes[index]);
                return Err(source.malformed(at(), problem, FETCH));
            }
            let number = u32::try_from(index).map_err(|error| source.malformed(at(), error, FETCH))?;
            let samples = decoder.read_chunk(number).map_err(|error| {
                let anew = "write it anew: `gdal_translate -co COMPRESS=DEFLATE -co PREDICTOR=1 IN OUT.tif`";
                match error {
                    // A sound file may use what is not read here.
                    tiff::TiffError::UnsupportedError(what) => {
                        source.unsupported(format!("{}: {what} (the file may be sound)", at()), anew)
                    }
                    error => source.malformed(at(), error, format!("{FETCH}, or {anew}")),
                }
            })?;
            // The decoder crops strips and tiles at the border of the image.
            // One bit a pixel, each row in whole bytes: a mask.
            let bits = bits_of(decoder) == Some(1) && together == 1;
            let expected = if bits { width.div_ceil(8) * height } else { width * height * together };
            let found = count(&samples);
            if found < expected {
                let problem = format!("{found} samples instead of {width} x {height}");
                return Err(source.malformed(at(), problem, FETCH));
            }
            visit(Visited::Chunk(&Chunk { left, top, width, height, values: samples, together, bits }))?;
        }
        visit(Visited::RowsAbove(((down + 1) * chunk_rows).min(rows)))?;
    }
    Ok(())
}

/// Bits of a sample.
fn bits_of(decoder: &mut Decoder<Overlay>) -> Option<u8> {
    match decoder.colortype().ok()? {
        ColorType::Gray(bits) => Some(bits),
        _ => None,
    }
}
