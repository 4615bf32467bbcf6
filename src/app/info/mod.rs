//! What a file holds, in words: for `canopy info`.
//!
//! Everything here is read by the same functions that drawing uses, so what this says is what would be drawn; no
//! graphics device is needed.

mod inventory;
mod page;
mod plant;
mod scene;
mod terrain;

use std::path::Path;

use super::error::AppError;
use page::Page;

/// Describes the plant (.glb, .gltf), terrain (.tif, .tiff, .asc, .hgt, .vrt, .png), inventory (.csv, .tsv, .geojson, .json,
/// .shp, .gpkg), scene or species (.ron) in `path`: some lines of text, each ended by a newline. A pipe holds a scene.
///
/// # Errors
/// [`AppError::UnknownKind`] for another ending; otherwise what the reader of that kind says of a file that it cannot
/// use, or that the file refers to.
pub fn info(path: &Path) -> Result<String, AppError> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let mut page = Page::new();
    match ending.as_str() {
        "glb" | "gltf" => plant::describe_file(&mut page, path)?,
        "png" => terrain::describe_image(&mut page, path)?,
        "tif" | "tiff" | "asc" | "hgt" | "vrt" => terrain::describe_file(&mut page, path)?,
        "csv" | "tsv" | "geojson" | "json" | "shp" | "gpkg" => inventory::describe_file(&mut page, path)?,
        "ron" => scene::describe_file(&mut page, path)?,
        // A pipe, such as `/dev/stdin`, has no name that could say more; a scene can be read from it.
        _ if is_pipe(path) => scene::describe_file(&mut page, path)?,
        _ => return Err(AppError::UnknownKind { path: path.to_owned() }),
    }
    Ok(page.finish())
}

/// Whether `path` is neither a file nor a folder.
fn is_pipe(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}
