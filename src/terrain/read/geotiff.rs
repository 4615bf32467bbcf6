//! GeoTIFF [OGC 19-008r4] and BigTIFF: one band of heights and its location on earth.

mod directory;
mod keys;

use glam::DVec2;
use tiff::ColorType;
use tiff::decoder::{ChunkType, Decoder, DecodingResult, Limits};
use tiff::tags::Tag;

use super::{Grid, Input, Raster, Source, Window};
use crate::terrain::{MAX_SAMPLES, TerrainError};
use keys::GeoKeys;

/// Maximum decoded size of a strip or tile in bytes.
const MAX_CHUNK: usize = 1 << 30;
/// Maximum size of a tag in bytes: the offsets of four million tiles.
const MAX_TAG: usize = 32 << 20;
/// Maximum ratio of decoded to stored bytes. LZW and Deflate reach 1032 to 2700 on constant data. It limits what a file
/// of a given size can hold.
const MAX_EXPANSION: u64 = 4096;

const FETCH: &str = "the file is damaged or cut off: fetch or export it again";

pub(super) fn recognises(start: &[u8]) -> bool {
    [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"].iter().any(|magic| start.starts_with(*magic))
}

pub(super) fn read(source: &Source) -> Result<Raster, TerrainError> {
    directory::check(source)?;
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MAX_CHUNK;
    limits.intermediate_buffer_size = MAX_CHUNK;
    limits.ifd_value_size = MAX_TAG;
    let mut decoder = Decoder::new(source.open()?)
        .map_err(|error| source.malformed("TIFF directory", error, FETCH))?
        .with_limits(limits);
    let (columns, rows) = decoder.dimensions().map_err(|error| source.malformed("TIFF directory", error, FETCH))?;
    let colour = decoder.colortype().map_err(|error| source.malformed("TIFF directory", error, FETCH))?;
    if !matches!(colour, ColorType::Gray(_)) {
        return Err(source.unsupported(
            format!("the samples are {colour:?}, not one band of heights"),
            "pick the band with the heights: `gdal_translate -b 1 IN OUT.tif`",
        ));
    }
    let (columns, rows) = (columns as usize, rows as usize);
    let keys = GeoKeys::read(source, &mut decoder)?;
    let (grid, south_up) = read_grid(source, &mut decoder, columns, rows, keys.point)?;
    let window = source.window(&grid)?;
    let missing = read_missing(&mut decoder);
    // Rows are stored from the north or, rarely, from the south.
    let stored = if south_up { Window { row: rows - window.row - window.rows, ..window } } else { window };
    let mut heights = read_samples(source, &mut decoder, columns, rows, &stored, missing)?;
    if south_up {
        let top_down: Vec<f32> = heights.chunks_exact(window.columns).rev().flatten().copied().collect();
        heights = top_down;
    }
    for height in &mut heights {
        *height = (f64::from(*height) * keys.metres_per_height_unit) as f32;
    }
    Ok(Raster { grid, window, system: keys.system, heights, warnings: keys.warnings })
}

/// The positions of the samples [OGC 19-008r4, 7.4, "Raster to model coordinate transformation"], and whether the rows
/// run from south to north.
fn read_grid(
    source: &Source,
    decoder: &mut Decoder<Input>,
    columns: usize,
    rows: usize,
    point: bool,
) -> Result<(Grid, bool), TerrainError> {
    // A sample lies in the middle of its cell, unless the file says that the raster consists of points.
    let middle = if point { 0.0 } else { 0.5 };
    let numbers = |decoder: &mut Decoder<Input>, tag| {
        decoder.find_tag(tag).ok().flatten().and_then(|value| value.into_f64_vec().ok())
    };
    let (origin, step) = if let Some(m) = numbers(decoder, Tag::ModelTransformationTag).filter(|m| m.len() >= 8) {
        if m[1] != 0.0 || m[4] != 0.0 {
            return Err(source.unsupported(
                "the raster is rotated against its coordinates",
                "turn it to the north: `gdalwarp IN OUT.tif`",
            ));
        }
        (DVec2::new(m[3], m[7]), DVec2::new(m[0], -m[5]))
    } else {
        let scale = numbers(decoder, Tag::ModelPixelScaleTag).filter(|scale| scale.len() >= 2);
        let tie = numbers(decoder, Tag::ModelTiepointTag).filter(|tie| tie.len() >= 6);
        let (Some(scale), Some(tie)) = (scale, tie) else {
            return Err(TerrainError::UnknownCoordinateSystem {
                path: source.path.to_owned(),
                problem:
                    "the TIFF has no ModelPixelScale and ModelTiepoint and no ModelTransformation, so it has no place \
                          and no spacing; `gdal_edit.py -a_ullr <west> <north> <east> <south> FILE` adds them"
                        .into(),
            });
        };
        let step = DVec2::new(scale[0], scale[1]);
        (DVec2::new(tie[3], tie[4]) + DVec2::new(-tie[0], tie[1]) * step, step)
    };
    let usable =
        origin.is_finite() && step.is_finite() && step.x > 0.0 && step.y != 0.0 && origin.abs().max_element() < 1e12;
    if !usable {
        return Err(source.malformed(
            "ModelPixelScale, ModelTiepoint or ModelTransformation",
            format!("the raster begins at {origin} with cells of {step}"),
            "correct the georeference: `gdal_edit.py -a_ullr <west> <north> <east> <south> FILE`",
        ));
    }
    let south_up = step.y < 0.0;
    let mut first = origin + DVec2::new(middle, -middle) * step;
    if south_up {
        first.y -= rows.saturating_sub(1) as f64 * step.y;
    }
    Ok((Grid { columns, rows, first, step: step.abs() }, south_up))
}

/// The value that marks missing data. GDAL writes it as text.
fn read_missing(decoder: &mut Decoder<Input>) -> Option<f64> {
    let text = decoder.find_tag(Tag::GdalNodata).ok().flatten()?.into_string().ok()?;
    text.trim_matches(|c: char| c.is_whitespace() || c == '\0').parse().ok()
}

/// Decodes the strips or tiles that overlap a window.
fn read_samples(
    source: &Source,
    decoder: &mut Decoder<Input>,
    columns: usize,
    rows: usize,
    window: &Window,
    missing: Option<f64>,
) -> Result<Vec<f32>, TerrainError> {
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
    let tag = if tiled { Tag::TileByteCounts } else { Tag::StripByteCounts };
    let sizes: Vec<u64> = decoder.find_tag_unsigned_vec(tag).map_err(broken)?.unwrap_or_default();
    let chunk_range = |from: usize, count: usize, size: usize| from / size..(from + count).div_ceil(size);
    let across_range = chunk_range(window.column, window.columns, chunk_columns);
    let down_range = chunk_range(window.row, window.rows, chunk_rows);

    // Before allocating: can the stored bytes hold the requested samples at all?
    let mut stored = 0_u64;
    for down in down_range.clone() {
        for column in across_range.clone() {
            let index = down * across + column;
            let Some(size) = sizes.get(index) else {
                let problem = format!("strip or tile {index} is missing");
                return Err(source.malformed("TIFF directory", problem, FETCH));
            };
            stored = stored.saturating_add(*size);
        }
    }
    let wanted = (window.columns * window.rows) as u64;
    if wanted > stored.min(source.length).saturating_mul(MAX_EXPANSION) {
        return Err(source.malformed(
            "TIFF directory",
            format!("{} x {} samples cannot be in the {stored} bytes stored for them", window.columns, window.rows),
            FETCH,
        ));
    }

    let mut heights = vec![f32::NAN; window.columns * window.rows];
    for down in down_range {
        for column in across_range.clone() {
            let index = down * across + column;
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
                let remedy = format!(
                    "{FETCH}; if its compression is the trouble: `gdal_translate -co COMPRESS=DEFLATE IN OUT.tif`"
                );
                source.malformed(at(), error, remedy)
            })?;
            // The decoder crops strips and tiles at the border of the image.
            let samples = Samples { values: samples, missing };
            if samples.len() < width * height {
                return Err(source.malformed(
                    at(),
                    format!("{} samples instead of {width} x {height}", samples.len()),
                    FETCH,
                ));
            }
            for y in top.max(window.row)..(top + height).min(window.row + window.rows) {
                for x in left.max(window.column)..(left + width).min(window.column + window.columns) {
                    let target = (y - window.row) * window.columns + x - window.column;
                    heights[target] = samples.get((y - top) * width + x - left);
                }
            }
        }
    }
    Ok(heights)
}

/// Decoded samples of any type, read as heights.
struct Samples {
    values: DecodingResult,
    missing: Option<f64>,
}

impl Samples {
    fn len(&self) -> usize {
        match &self.values {
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

    /// The height at an index below `len`; NaN if it is missing.
    fn get(&self, at: usize) -> f32 {
        let value = match &self.values {
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
        };
        // The marker is written in decimals, while a float sample holds the nearest f32.
        let is_missing = self.missing.is_some_and(|m| value == m || value as f32 == m as f32);
        if is_missing || !value.is_finite() { f32::NAN } else { value as f32 }
    }
}
