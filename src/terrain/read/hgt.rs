//! SRTM `.hgt` files: 16-bit big-endian heights of one square degree, whose name gives their location
//! [USGS, "SRTM Topo"].

use glam::DVec2;

use super::{Grid, Raster, Source, sentinels};
use crate::terrain::{CoordinateSystem, TerrainError};

/// Columns and rows, for three arc-seconds, for one, for half a one, and for one beyond 50 degrees of latitude, where the
/// columns are two apart. Neighbouring files share the samples on their border.
const SIZES: [(usize, usize); 4] = [(1201, 1201), (3601, 3601), (7201, 7201), (1801, 3601)];
/// The value that marks missing data.
const VOID: i16 = i16::MIN;

/// Whether a file has the size of an `.hgt` file. There is no header.
pub(super) fn recognises(length: u64) -> bool {
    size(length).is_some()
}

fn size(length: u64) -> Option<(usize, usize)> {
    SIZES.into_iter().find(|(columns, rows)| (columns * rows * 2) as u64 == length)
}

pub(super) fn read(source: &Source) -> Result<Raster, TerrainError> {
    let name = source.path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
    let Some((south, west)) = corner(&name) else {
        return Err(TerrainError::UnknownCoordinateSystem {
            path: source.path.to_owned(),
            problem: "an .hgt file is placed by its name, which must begin like N36W085".into(),
        });
    };
    let bytes = source.all()?;
    let Some((columns, rows)) = size(bytes.len() as u64) else {
        return Err(source.malformed("end of file", "the size has changed while reading", "read it again"));
    };
    let step = DVec2::new(1.0 / (columns - 1) as f64, 1.0 / (rows - 1) as f64);
    let grid = Grid { columns, rows, first: DVec2::new(west, south + 1.0), step };
    let window = source.window(&grid)?;
    let mut heights = Vec::with_capacity(window.columns * window.rows);
    for row in window.row..window.row + window.rows {
        let line = &bytes[(row * columns + window.column) * 2..][..window.columns * 2];
        heights.extend(line.chunks_exact(2).map(|pair| match i16::from_be_bytes([pair[0], pair[1]]) {
            VOID => f32::NAN,
            height => f32::from(height),
        }));
    }
    let system = source.options.coordinate_system.unwrap_or(CoordinateSystem::Geographic);
    let warnings = sentinels::remove(&mut heights);
    Ok(Raster { grid, window, system, heights, warnings })
}

/// Latitude and longitude of the south-west sample, from a name such as `N36W085.hgt`.
fn corner(name: &str) -> Option<(f64, f64)> {
    let name = name.as_bytes();
    let degrees = |digits: &[u8], limit: f64| {
        let value: f64 = std::str::from_utf8(digits).ok()?.parse().ok()?;
        (digits.iter().all(u8::is_ascii_digit) && value <= limit).then_some(value)
    };
    let latitude = degrees(name.get(1..3)?, 90.0)?;
    let longitude = degrees(name.get(4..7)?, 180.0)?;
    let latitude = match name.first()? {
        b'N' | b'n' => latitude,
        b'S' | b's' => -latitude,
        _ => return None,
    };
    match name.get(3)? {
        b'E' | b'e' => Some((latitude, longitude)),
        b'W' | b'w' => Some((latitude, -longitude)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_places() {
        assert_eq!(corner("N36W085.hgt"), Some((36.0, -85.0)));
        assert_eq!(corner("s01e010.SRTMGL1.hgt"), Some((-1.0, 10.0)));
        for bad in ["", "N36W8", "X36W085", "N3aW085", "N36-085", "N99W085", "N36W999", "N+6W085", "ÄÖ36W085"] {
            assert_eq!(corner(bad), None, "{bad}");
        }
    }
}
