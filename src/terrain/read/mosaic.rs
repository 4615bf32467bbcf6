//! Several tiles of one raster as one terrain: a list of files, or a virtual raster (`.vrt`) of GDAL, which is a list, too.
//!
//! The tiles lie on one grid: the same coordinate system, the same distance of samples. Where two overlap, the first one that
//! has a height counts; what none covers is a hole.

use std::path::{Path, PathBuf};

use glam::DVec2;

use super::{Grid, Raster, ReadOptions, Source, Window, open, side_files};
use crate::terrain::{CoordinateSystem, MAX_SAMPLES, Terrain, TerrainError, Warning};

/// Most tiles of a mosaic.
const MOST_TILES: usize = 10_000;
/// Largest deviation of a tile from the common grid, in cells.
const TOLERANCE: f64 = 0.25;

/// Reads several tiles of one raster, in the order of preference where they overlap. Tiles outside the crop are left out.
///
/// # Errors
/// Those of [`read_terrain`](super::read_terrain), of the first tile that cannot be read; [`TerrainError::Unsupported`] for
/// tiles in different coordinate systems or not on one grid.
pub fn read_terrain_tiles(paths: &[PathBuf], options: &ReadOptions) -> Result<(Terrain, Vec<Warning>), TerrainError> {
    let first = paths.first().map_or(Path::new(""), PathBuf::as_path);
    let source = Source { path: first, length: 0, bytes: None, options };
    join(&source, paths, options)?.into_terrain(&source)
}

/// Whether a file starts like a virtual raster.
pub(super) fn recognises(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let text = text.trim_start_matches('\u{feff}').trim_start();
    text.starts_with("<VRTDataset") || text.starts_with("<?xml") && text.contains("<VRTDataset")
}

/// Reads the tiles of a virtual raster.
pub(super) fn read(source: &Source) -> Result<Raster, TerrainError> {
    const ANEW: &str = "write it as a GeoTIFF: `gdal_translate IN.vrt OUT.tif`";
    if source.bytes.is_some() {
        return Err(source.unsupported("a virtual raster names other files, which are not at hand here", ANEW));
    }
    let text = String::from_utf8_lossy(&source.all()?).into_owned();
    if text.contains("VRTWarpedDataset") || text.contains("VRTDerivedRasterBand") || text.contains("<ComplexSource") {
        return Err(source.unsupported("a virtual raster that computes its samples", ANEW));
    }
    let (head, band) = text.split_once("<VRTRasterBand").unwrap_or((&text, ""));
    let band = band.split("</VRTRasterBand").next().unwrap_or("");
    let folder = source.path.parent().unwrap_or(Path::new(""));
    let mut paths: Vec<PathBuf> = Vec::new();
    for element in band.split("<SourceFilename").skip(1) {
        let Some((attributes, rest)) = element.split_once('>') else { continue };
        let name = rest.split("</SourceFilename").next().unwrap_or("").trim();
        let name = name.replace("&amp;", "&").replace("&apos;", "'").replace('\\', "/");
        let beside = attributes.contains("relativeToVRT=\"1\"");
        let path = if beside { folder.join(&name) } else { PathBuf::from(&name) };
        if !name.is_empty() && !paths.contains(&path) {
            paths.push(path);
        }
    }
    if paths.is_empty() {
        return Err(source.malformed(
            "virtual raster",
            "it names no files",
            "build it anew: `gdalbuildvrt OUT.vrt TILES`",
        ));
    }
    let wkt = head.split_once("<SRS").and_then(|(_, rest)| rest.split_once('>')).map(|(_, rest)| rest);
    let wkt = wkt.and_then(|rest| rest.split("</SRS").next()).unwrap_or("").replace("&quot;", "\"");
    let stated = source.options.coordinate_system.or_else(|| side_files::of_wkt(&wkt));
    let options = ReadOptions { coordinate_system: stated, ..*source.options };
    join(source, &paths, &options)
}

/// The tiles as one raster. `source` is what they are part of, for messages.
fn join(source: &Source, paths: &[PathBuf], options: &ReadOptions) -> Result<Raster, TerrainError> {
    if paths.len() > MOST_TILES {
        let problem = format!("{} tiles, more than the {MOST_TILES} that are read", paths.len());
        return Err(source.unsupported(problem, "join them: `gdal_translate IN.vrt OUT.tif`"));
    }
    let mut tiles: Vec<Raster> = Vec::new();
    let mut outside = None;
    let mut warnings: Vec<Warning> = Vec::new();
    let mut samples = 0usize;
    for path in paths {
        let read = open(path).and_then(|(length, start)| {
            let tile = Source { path, length, bytes: None, options };
            if recognises(&start) {
                return Err(tile.unsupported("a virtual raster as a tile of another", "name its tiles instead"));
            }
            tile.raster(&start)
        });
        let mut tile = match read {
            Err(error @ TerrainError::EmptyCrop { .. }) => {
                outside = Some(error);
                continue;
            }
            read => read?,
        };
        if let Some(first) = tiles.first() {
            check_same(source, path, first, &tile)?;
        }
        for warning in tile.warnings.drain(..) {
            if !warnings.contains(&warning) {
                warnings.push(warning);
            }
        }
        samples = samples.saturating_add(tile.heights.len());
        if samples > 2 * MAX_SAMPLES {
            let (columns, rows) = (tile.grid.columns, tile.grid.rows);
            return Err(TerrainError::TooLarge { columns, rows, limit: MAX_SAMPLES });
        }
        tiles.push(tile);
    }
    let Some(first) = tiles.first() else {
        return Err(outside.unwrap_or_else(|| source.malformed("mosaic", "it has no tiles", "name the tiles")));
    };
    let (step, system): (DVec2, CoordinateSystem) = (first.grid.step, first.system);
    let corner = |tile: &Raster| tile.grid.position(tile.window.column, tile.window.row);
    let far = |tile: &Raster| {
        tile.grid.position(tile.window.column + tile.window.columns - 1, tile.window.row + tile.window.rows - 1)
    };
    let north_west = tiles.iter().map(corner).reduce(|a, b| DVec2::new(a.x.min(b.x), a.y.max(b.y)));
    let south_east = tiles.iter().map(far).reduce(|a, b| DVec2::new(a.x.max(b.x), a.y.min(b.y)));
    let (Some(north_west), Some(south_east)) = (north_west, south_east) else {
        return Err(source.malformed("mosaic", "it has no tiles", "name the tiles"));
    };
    let size = ((south_east - north_west) * DVec2::new(1.0, -1.0) / step).round() + 1.0;
    let (columns, rows) = (size.x.max(0.0) as usize, size.y.max(0.0) as usize);
    if columns.checked_mul(rows).is_none_or(|count| count > MAX_SAMPLES) {
        return Err(TerrainError::TooLarge { columns, rows, limit: MAX_SAMPLES });
    }
    let mut heights = vec![f32::NAN; columns * rows];
    for tile in &tiles {
        let offset = (corner(tile) - north_west) * DVec2::new(1.0, -1.0) / step;
        let whole = offset.round();
        if (offset - whole).abs().max_element() > TOLERANCE {
            return Err(source.unsupported(
                format!(
                    "its tiles do not lie on one grid: one is off by {:.2} cells",
                    (offset - whole).abs().max_element()
                ),
                "bring them to one: `gdalwarp -tap -tr <x> <y> TILES OUT.tif`",
            ));
        }
        let (left, top) = (whole.x as usize, whole.y as usize);
        for (row, line) in tile.heights.chunks_exact(tile.window.columns).enumerate() {
            let at = (top + row) * columns + left;
            let Some(target) = heights.get_mut(at..at + line.len()) else { continue };
            for (height, tile) in target.iter_mut().zip(line) {
                if height.is_nan() {
                    *height = *tile;
                }
            }
        }
    }
    let grid = Grid { columns, rows, first: north_west, step };
    Ok(Raster { grid, window: Window { column: 0, row: 0, columns, rows }, system, heights, warnings })
}

/// Refuses a tile in another coordinate system or of other distances than the first one.
fn check_same(source: &Source, path: &Path, first: &Raster, tile: &Raster) -> Result<(), TerrainError> {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    if tile.system != first.system {
        return Err(source.unsupported(
            format!("its tile {name} has the coordinate system {:?}, the first one {:?}", tile.system, first.system),
            "bring them to one system: `gdalwarp -t_srs EPSG:<code> TILES OUT.tif`",
        ));
    }
    if (tile.grid.step / first.grid.step - 1.0).abs().max_element() > 1e-6 {
        return Err(source.unsupported(
            format!("its tile {name} has cells of {}, the first one of {}", tile.grid.step, first.grid.step),
            "bring them to one size: `gdalwarp -tr <x> <y> TILES OUT.tif`",
        ));
    }
    Ok(())
}
