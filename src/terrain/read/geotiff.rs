//! GeoTIFF [OGC 19-008r4] and BigTIFF: one band of heights and its location on earth.

mod chunks;
mod directory;
mod keys;
mod metadata;
mod overlay;
pub(super) mod photo;

use glam::DVec2;
use tiff::ColorType;
use tiff::decoder::{Decoder, Limits};
use tiff::tags::Tag;

use super::{Grid, Input, Raster, Source, Window, sentinels, side_files};
use crate::terrain::{TerrainError, Warning};
use chunks::{Plane, Visited, visit_chunks};
use directory::Directory;
use keys::GeoKeys;
use metadata::BandMetadata;
use overlay::Overlay;

/// The text in which GDAL keeps scale, offset and unit.
const GDAL_METADATA: Tag = Tag::Unknown(42112);

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
    let directory = Directory::read(source)?;
    let mut plain = source.open()?;
    let bands = Bands::of(&directory, &mut plain);
    let mask = mask_of(&directory, &mut plain);
    let images: Vec<usize> = std::iter::once(0).chain(mask).collect();
    let overlay = Overlay::new(source, &directory, &images)?;
    let (mut decoder, columns, rows, colour) = decoder_of(source, overlay)?;
    let with_alpha = bands.alpha && matches!(colour, ColorType::Multiband { num_samples: 2, .. });
    if !(matches!(colour, ColorType::Gray(_)) || with_alpha) {
        return Err(source.unsupported(
            format!("the samples are {colour:?}, not one band of heights"),
            "pick the band with the heights: `gdal_translate -b 1 IN OUT.tif`",
        ));
    }
    let keys = GeoKeys::read(source, &mut decoder)?;
    let (grid, south_up) = read_grid(source, &mut decoder, columns, rows, keys.point)?;
    let window = source.window(&grid)?;
    let beside = side_files::auxiliary(source);
    let missing = read_missing(&mut decoder).or(beside.missing);
    let mut metadata =
        read_text(&mut decoder, GDAL_METADATA).map(|text| BandMetadata::parse(&text)).unwrap_or_default();
    if metadata == BandMetadata::default() {
        metadata = BandMetadata {
            scale: beside.scale.unwrap_or(1.0),
            offset: beside.offset.unwrap_or(0.0),
            unit: beside.unit,
        };
    }
    // Rows are stored from the north or, rarely, from the south.
    let stored = if south_up { Window { row: rows - window.row - window.rows, ..window } } else { window };
    let band = |band: usize| Plane { columns, rows, window: stored, bands: bands.stored(band) };
    let mut heights = read_samples(source, &mut decoder, &band(0), missing)?;
    let mut warnings = keys.warnings;
    let mut hidden = 0;
    if with_alpha {
        let alpha = read_samples(source, &mut decoder, &band(1), None)?;
        hidden += hide(&mut heights, &alpha);
    }
    if let Some(image) = mask {
        let plane = Plane { bands: Bands::default(), ..band(0) };
        let read = decoder
            .seek_to_image(image)
            .map_err(|error| error.to_string())
            .and_then(|()| read_samples(source, &mut decoder, &plane, None).map_err(|error| error.to_string()));
        match read {
            Ok(shown) => hidden += hide(&mut heights, &shown),
            Err(problem) => warnings.push(Warning::MaskUnread { problem }),
        }
    }
    if hidden > 0 {
        warnings.push(Warning::Masked { count: hidden });
    }
    if south_up {
        let top_down: Vec<f32> = heights.chunks_exact(window.columns).rev().flatten().copied().collect();
        heights = top_down;
    }
    warnings.extend(sentinels::remove(&mut heights));
    let stated = metadata.unit.as_deref().map(|unit| (unit, metadata::metres_of(unit)));
    if let Some((unit, None)) = stated {
        warnings.push(Warning::UnknownHeightUnit { unit: unit.to_owned() });
    }
    let metres = stated.and_then(|(_, metres)| metres).or(keys.metres_per_height_unit).unwrap_or(1.0);
    let (factor, offset) = (metadata.scale * metres, metadata.offset * metres);
    for height in &mut heights {
        *height = (f64::from(*height) * factor + offset) as f32;
    }
    if metadata.scale != 1.0
        || metadata.offset != 0.0
        || stated.is_some_and(|(_, metres)| metres.is_some_and(|m| m != 1.0))
    {
        warnings.push(Warning::HeightsConverted { factor, offset, unit: metadata.unit });
    }
    Ok(Raster { grid, window, system: keys.system, heights, warnings })
}

/// A decoder within limits of memory, with the columns, rows and kind of samples of the first image.
fn decoder_of<'a>(
    source: &Source,
    overlay: Overlay<'a>,
) -> Result<(Decoder<Overlay<'a>>, usize, usize, ColorType), TerrainError> {
    let broken = |error: tiff::TiffError| source.malformed("TIFF directory", error, FETCH);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MAX_CHUNK;
    limits.intermediate_buffer_size = MAX_CHUNK;
    limits.ifd_value_size = MAX_TAG;
    let mut decoder = Decoder::new(overlay).map_err(broken)?.with_limits(limits);
    let (columns, rows) = decoder.dimensions().map_err(broken)?;
    let colour = decoder.colortype().map_err(broken)?;
    Ok((decoder, columns as usize, rows as usize, colour))
}

/// How the bands of a raster are stored.
#[derive(Clone, Copy, Debug)]
struct Bands {
    /// Samples of a pixel.
    count: usize,
    /// Which of them is meant.
    index: usize,
    /// Whether each band has strips or tiles of its own.
    apart: bool,
    /// Whether the second of two is an alpha band.
    alpha: bool,
}

impl Default for Bands {
    /// One band.
    fn default() -> Self {
        Self { count: 1, index: 0, apart: false, alpha: false }
    }
}

impl Bands {
    fn of(directory: &Directory, input: &mut Input) -> Self {
        let count = directory.value(input, 0, 277).unwrap_or(1);
        let extra = directory.values(input, 0, 338);
        Self {
            // No more are accepted; where a tag stands twice, the decoder may have taken the other one.
            count: if count == 2 { 2 } else { 1 },
            index: 0,
            apart: directory.value(input, 0, 284) == Some(2),
            alpha: count == 2 && matches!(extra.last(), Some(1 | 2)),
        }
    }

    /// The band `index`.
    fn stored(self, index: usize) -> Self {
        Self { index, ..self }
    }
}

/// The image that is the mask of the first one, if there is one: marked as such, and of its size.
fn mask_of(directory: &Directory, input: &mut Input) -> Option<usize> {
    let mut value = |image: usize, tag: u16| directory.value(input, image, tag);
    let size = (value(0, 256)?, value(0, 257)?);
    (1..directory.images.len()).find(|image| {
        let kind = value(*image, 254).unwrap_or(0);
        // Bit 2: a mask; bit 0: of a smaller copy.
        kind & 4 != 0 && kind & 1 == 0 && (value(*image, 256), value(*image, 257)) == (Some(size.0), Some(size.1))
    })
}

/// Makes holes of the heights where `shown` is 0 or missing; the number of those that were none before.
fn hide(heights: &mut [f32], shown: &[f32]) -> usize {
    let mut hidden = 0;
    for (height, shown) in heights.iter_mut().zip(shown) {
        if (shown.is_nan() || *shown <= 0.0) && !height.is_nan() {
            *height = f32::NAN;
            hidden += 1;
        }
    }
    hidden
}

/// The positions of the samples [OGC 19-008r4, 7.4, "Raster to model coordinate transformation"], and whether the rows
/// run from south to north.
fn read_grid(
    source: &Source,
    decoder: &mut Decoder<Overlay>,
    columns: usize,
    rows: usize,
    point: bool,
) -> Result<(Grid, bool), TerrainError> {
    // A sample lies in the middle of its cell, unless the file says that the raster consists of points.
    let middle = if point { 0.0 } else { 0.5 };
    let numbers = |decoder: &mut Decoder<Overlay>, tag| {
        decoder.find_tag(tag).ok().flatten().and_then(|value| value.into_f64_vec().ok())
    };
    let (origin, step) = if let Some(m) = numbers(decoder, Tag::ModelTransformationTag).filter(|m| m.len() >= 8) {
        if !side_files::is_straight([m[0], m[1], m[4], m[5]]) {
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
            if let Some((first, step)) = side_files::world(source)? {
                // A world file names the middle of the first cell.
                let step = DVec2::new(step.x, -step.y);
                let origin = first - DVec2::new(middle, -middle) * step;
                return placed(source, origin, step, middle, columns, rows);
            }
            return Err(TerrainError::UnknownCoordinateSystem {
                path: source.path.to_owned(),
                problem:
                    "the TIFF has no ModelPixelScale and ModelTiepoint, no ModelTransformation and no world file \
                          (.tfw) beside it, so it has no place and no spacing; `gdal_edit.py -a_ullr <west> <north> <east> <south> FILE` adds them"
                        .into(),
            });
        };
        let step = DVec2::new(scale[0], scale[1]);
        (DVec2::new(tie[3], tie[4]) + DVec2::new(-tie[0], tie[1]) * step, step)
    };
    placed(source, origin, step, middle, columns, rows)
}

/// The grid of a raster whose first cell begins at `origin`, with `step` to the east and to the south.
fn placed(
    source: &Source,
    origin: DVec2,
    step: DVec2,
    middle: f64,
    columns: usize,
    rows: usize,
) -> Result<(Grid, bool), TerrainError> {
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

/// The text of a tag.
fn read_text(decoder: &mut Decoder<Overlay>, tag: Tag) -> Option<String> {
    decoder.find_tag(tag).ok().flatten()?.into_string().ok()
}

/// The value that marks missing data. GDAL writes it as text.
fn read_missing(decoder: &mut Decoder<Overlay>) -> Option<f64> {
    let text = read_text(decoder, Tag::GdalNodata)?;
    text.trim_matches(|c: char| c.is_whitespace() || c == '\0').parse().ok()
}

/// The samples of one band in a window as heights; NaN where they are missing.
fn read_samples(
    source: &Source,
    decoder: &mut Decoder<Overlay>,
    plane: &Plane,
    missing: Option<f64>,
) -> Result<Vec<f32>, TerrainError> {
    let window = plane.window;
    let band = if plane.bands.apart { 0 } else { plane.bands.index };
    // The marker is written in decimals, while a float sample holds the nearest f32.
    let is_missing = |value: f64| missing.is_some_and(|m| value == m || value as f32 == m as f32);
    let mut heights = vec![f32::NAN; window.columns * window.rows];
    visit_chunks(source, decoder, plane, |visited| {
        if let Visited::Chunk(chunk) = visited {
            chunk.pixels_in(&window, |x, y, at| {
                let value = chunk.sample(at + band);
                if value.is_finite() && !is_missing(value) {
                    heights[y * window.columns + x] = value as f32;
                }
            });
        }
        Ok(())
    })?;
    Ok(heights)
}
