//! Colours of a GeoTIFF: an orthophoto or a scanned map.

use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

use super::super::photo::{Description, Pixels, Reducer};
use super::super::{Source, Window};
use super::chunks::{Chunk, Plane, Visited, visit_chunks};
use super::directory::Directory;
use super::keys::GeoKeys;
use super::overlay::Overlay;
use super::{Bands, FETCH, decoder_of, mask_of, read_grid, read_missing};
use crate::terrain::TerrainError;

/// The photometric interpretation in which 0 is white.
const WHITE_IS_ZERO: u64 = 0;
/// Colours of a palette: red, green and blue, one after the other.
const COLOR_MAP: Tag = Tag::ColorMap;

/// Size, place and coordinate system of a photograph.
pub fn describe(source: &Source) -> Result<Description, TerrainError> {
    let directory = Directory::read(source)?;
    let (mut decoder, columns, rows, _) = decoder_of(source, Overlay::new(source, &directory, &[0])?)?;
    let (system, point) = match GeoKeys::read(source, &mut decoder) {
        Ok(keys) => (Some(keys.system), keys.point),
        Err(TerrainError::UnknownCoordinateSystem { .. }) => (None, false),
        Err(error) => return Err(error),
    };
    let grid = match read_grid(source, &mut decoder, columns, rows, point) {
        Ok((grid, false)) => Some(grid),
        Ok((_, true)) => {
            return Err(source.unsupported("the photograph is stored from the south", "turn it: `gdalwarp IN OUT.tif`"));
        }
        Err(TerrainError::UnknownCoordinateSystem { .. }) => None,
        Err(error) => return Err(error),
    };
    Ok(Description { columns, rows, grid, system })
}

/// The pixels of a window, of which `factor` by `factor` become one.
pub fn pixels(source: &Source, window: &Window, factor: usize) -> Result<Pixels, TerrainError> {
    let directory = Directory::read(source)?;
    let mut plain = source.open()?;
    let mut value = |tag: u16| directory.value(&mut plain, 0, tag);
    let (count, apart, interpretation) = (value(277).unwrap_or(1) as usize, value(284) == Some(2), value(262));
    let extra = directory.values(&mut plain, 0, 338);
    let mask = mask_of(&directory, &mut plain);
    if apart && count > 1 {
        return Err(source.unsupported(
            "the bands of the photograph are stored one after the other",
            "write it anew: `gdal_translate -co INTERLEAVE=PIXEL -co TILED=YES IN OUT.tif`",
        ));
    }
    let images: Vec<usize> = std::iter::once(0).chain(mask).collect();
    let overlay = Overlay::new(source, &directory, &images)?;
    let (mut decoder, columns, rows, kind) = decoder_of(source, overlay)?;
    let samples = usize::from(kind.num_samples());
    if samples != count {
        let problem = format!("{count} samples of a pixel by their tag, {samples} by their kind");
        return Err(source.malformed("TIFF directory", problem, FETCH));
    }
    let plane = Plane { columns, rows, window: *window, bands: Bands { count, ..Bands::default() } };
    let colors = Colors::new(source, &mut decoder, kind, &extra, interpretation == Some(WHITE_IS_ZERO))?;
    let mut shown = Vec::new();
    if let Some(image) = mask {
        let plane = Plane { bands: Bands::default(), ..plane };
        decoder.seek_to_image(image).map_err(|error| source.malformed("mask", error, FETCH))?;
        shown = vec![false; window.columns * window.rows];
        visit_chunks(source, &mut decoder, &plane, |visited| {
            if let Visited::Chunk(chunk) = visited {
                chunk.pixels_in(window, |x, y, at| shown[y * window.columns + x] = chunk.sample(at) > 0.0);
            }
            Ok(())
        })?;
        decoder.seek_to_image(0).map_err(|error| source.malformed("TIFF directory", error, FETCH))?;
    }
    let mut reducer = Reducer::new(window, factor);
    visit_chunks(source, &mut decoder, &plane, |visited| {
        match visited {
            Visited::Chunk(chunk) => {
                colors.check(source, chunk)?;
                chunk.pixels_in(window, |x, y, at| {
                    let mut color = colors.at(chunk, at);
                    if shown.get(y * window.columns + x) == Some(&false) {
                        color[3] = 0;
                    }
                    reducer.add(x, y, color);
                });
            }
            Visited::RowsAbove(row) => reducer.finish_rows(row.saturating_sub(window.row).min(window.rows)),
        }
        Ok(())
    })?;
    Ok(reducer.pixels())
}

/// How the samples of a pixel are a colour.
struct Colors {
    layout: Layout,
    /// Which sample is the opacity.
    alpha: Option<usize>,
    /// The value of pixels without data.
    missing: Option<f64>,
    inverted: bool,
}

enum Layout {
    Gray,
    Rgb,
    /// Luma and two differences [ITU-T T.871], as JPEG stores colours.
    YCbCr,
    Palette(Vec<[u8; 3]>),
}

impl Colors {
    fn new(
        source: &Source,
        decoder: &mut Decoder<Overlay>,
        kind: ColorType,
        extra: &[u64],
        inverted: bool,
    ) -> Result<Self, TerrainError> {
        // Extra samples follow those of the colour; 1 and 2 mark an opacity.
        let opacity = |colors: usize| extra.iter().position(|kind| [1, 2].contains(kind)).map(|at| colors + at);
        let (layout, colors) = match kind {
            ColorType::Gray(_) | ColorType::GrayA(_) => (Layout::Gray, 1),
            ColorType::RGB(_) | ColorType::RGBA(_) => (Layout::Rgb, 3),
            ColorType::YCbCr(_) => (Layout::YCbCr, 3),
            ColorType::Multiband { num_samples, .. } if num_samples >= 3 => (Layout::Rgb, 3),
            ColorType::Multiband { num_samples: 2, .. } => (Layout::Gray, 1),
            ColorType::Palette(8) => (Layout::Palette(palette(source, decoder)?), 1),
            other => {
                return Err(source.unsupported(
                    format!("the photograph has samples of the kind {other:?}"),
                    "write it as colours: `gdal_translate -expand rgb -ot Byte IN OUT.tif`",
                ));
            }
        };
        let samples = usize::from(kind.num_samples());
        // Without a word about it, a fourth sample of colours and a second of grey are taken as opacity.
        let unsaid = extra.is_empty() && matches!(kind, ColorType::RGBA(_) | ColorType::GrayA(_));
        let alpha = if unsaid { Some(colors) } else { opacity(colors) }.filter(|at| *at < samples);
        Ok(Self { layout, alpha, missing: read_missing(decoder), inverted })
    }

    /// Refuses samples that are no shades of 8 or 16 bits.
    fn check(&self, source: &Source, chunk: &Chunk) -> Result<(), TerrainError> {
        match (&chunk.values, &self.layout) {
            (DecodingResult::U8(_), _) | (DecodingResult::U16(_), Layout::Gray | Layout::Rgb) => Ok(()),
            _ => Err(source.unsupported(
                "the samples of the photograph are neither of 8 nor of 16 bits",
                "write it with 8: `gdal_translate -ot Byte -scale IN OUT.tif`",
            )),
        }
    }

    /// The colour of the pixel whose samples begin at `at`: sRGB and opacity.
    fn at(&self, chunk: &Chunk, at: usize) -> [u8; 4] {
        let code = |index: usize| match &chunk.values {
            DecodingResult::U8(values) => values[at + index],
            _ => (chunk.sample(at + index) / 257.0).round() as u8,
        };
        let [r, g, b] = match &self.layout {
            Layout::Gray => {
                let shade = if chunk.bits { 255 * chunk.sample(at) as u8 } else { code(0) };
                [if self.inverted { 255 - shade } else { shade }; 3]
            }
            Layout::Rgb => [code(0), code(1), code(2)],
            Layout::YCbCr => rgb_of_ycbcr([code(0), code(1), code(2)]),
            Layout::Palette(colors) => colors.get(usize::from(code(0))).copied().unwrap_or_default(),
        };
        let bands = if matches!(self.layout, Layout::Gray | Layout::Palette(_)) { 1 } else { 3 };
        let missing = self.missing.is_some_and(|missing| (0..bands).all(|band| chunk.sample(at + band) == missing));
        let opacity = if missing { 0 } else { self.alpha.map_or(255, code) };
        [r, g, b, opacity]
    }
}

/// From luma and differences to red, green and blue [ITU-T T.871, 7].
fn rgb_of_ycbcr([y, cb, cr]: [u8; 3]) -> [u8; 3] {
    let (y, cb, cr) = (f32::from(y), f32::from(cb) - 128.0, f32::from(cr) - 128.0);
    [y + 1.402 * cr, y - 0.344_136 * cb - 0.714_136 * cr, y + 1.772 * cb].map(|value| value.round() as u8)
}

fn palette(source: &Source, decoder: &mut Decoder<Overlay>) -> Result<Vec<[u8; 3]>, TerrainError> {
    let values: Vec<u16> = decoder
        .find_tag_unsigned_vec(COLOR_MAP)
        .map_err(|error| source.malformed("ColorMap", error, FETCH))?
        .unwrap_or_default();
    let count = values.len() / 3;
    let code = |at: usize| (values[at] >> 8) as u8;
    Ok((0..count).map(|color| [code(color), code(count + color), code(2 * count + color)]).collect())
}
