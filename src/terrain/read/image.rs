//! 16-bit greyscale PNG, as terrain editors export it. [`ImageScale`](super::ImageScale) gives the metres.

use glam::DVec2;
use png::{BitDepth, ColorType, Decoder, Limits, Transformations};

use super::{Grid, Raster, Source};
use crate::terrain::{CoordinateSystem, MAX_SAMPLES, TerrainError};

/// Maximum ratio of decoded to stored bytes of Deflate [RFC 1951]. It limits what a file of a given size can hold.
const MAX_EXPANSION: u64 = 1032;

pub(super) fn recognises(start: &[u8]) -> bool {
    start.starts_with(b"\x89PNG\r\n\x1a\n")
}

pub(super) fn read(source: &Source) -> Result<Raster, TerrainError> {
    let Some(scale) = source.options.image_scale else {
        return Err(TerrainError::MissingImageScale { path: source.path.to_owned() });
    };
    for (name, value) in
        [("the image scale's lowest height", scale.lowest), ("the image scale's highest height", scale.highest)]
    {
        if !value.is_finite() {
            return Err(TerrainError::BadParameter { name, value, range: "a finite number of metres" });
        }
    }
    if !(1.0e-3..=1.0e6).contains(&scale.spacing) {
        let (name, value) = ("the image scale's spacing", scale.spacing);
        return Err(TerrainError::BadParameter { name, value, range: "0.001 m to 1000000 m" });
    }
    let broken = |error: png::DecodingError| source.malformed("image data", error, "fetch or export the image again");
    let mut decoder = Decoder::new_with_limits(source.open()?, Limits { bytes: 64 << 20 });
    decoder.set_transformations(Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(broken)?;
    let (columns, rows) = (reader.info().width as usize, reader.info().height as usize);
    let kind = (reader.info().color_type, reader.info().bit_depth);
    if kind != (ColorType::Grayscale, BitDepth::Sixteen) {
        return Err(source.unsupported(
            format!("the image is {:?} with {} bits, not greyscale with 16", kind.0, kind.1 as u8),
            "export it as 16-bit greyscale; 8 bits would turn slopes into steps",
        ));
    }
    let grid = Grid {
        columns,
        rows,
        first: DVec2::new(0.0, rows.saturating_sub(1) as f64 * scale.spacing),
        step: DVec2::splat(scale.spacing),
    };
    let window = source.window(&grid)?;
    let promised = (columns as u64).saturating_mul(rows as u64);
    if promised > MAX_SAMPLES as u64 {
        return Err(TerrainError::TooLarge { columns, rows, limit: MAX_SAMPLES });
    }
    if promised * 2 > source.length.saturating_mul(MAX_EXPANSION) {
        return Err(source.malformed(
            "header",
            format!("{columns} x {rows} samples cannot be in a file of {} bytes", source.length),
            "the file is cut off: fetch or export it again",
        ));
    }
    let mut bytes = vec![0; columns * rows * 2];
    reader.next_frame(&mut bytes).map_err(broken)?;
    let unit = (scale.highest - scale.lowest) / f64::from(u16::MAX);
    let mut heights = Vec::with_capacity(window.columns * window.rows);
    for row in window.row..window.row + window.rows {
        let line = &bytes[(row * columns + window.column) * 2..][..window.columns * 2];
        heights.extend(
            line.chunks_exact(2)
                .map(|pair| (scale.lowest + unit * f64::from(u16::from_be_bytes([pair[0], pair[1]]))) as f32),
        );
    }
    let system = source.options.coordinate_system.unwrap_or(CoordinateSystem::Local);
    Ok(Raster { grid, window, system, heights, warnings: Vec::new() })
}
