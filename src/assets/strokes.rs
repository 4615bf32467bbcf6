//! Strokes on the leaves of a species, from its files to its plants.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::plant::{LeafStrokes, PartKind, Plant};

/// Files of strokes with what they hold.
pub type StrokeFiles = Vec<(PathBuf, Arc<LeafStrokes>)>;

/// Gives the strokes of `files` to the foliage of `plant` that they name; the strings are warnings.
pub fn draw_on(plant: &mut Plant, files: &StrokeFiles) -> Vec<String> {
    let mut warnings = Vec::new();
    for (file, strokes) in files {
        if !plant.set_strokes(strokes) {
            warnings.push(no_leaf_for(file, strokes, plant));
        }
        warnings.extend(strokes.warning().map(|what| format!("{}: {what}", file.display())));
    }
    warnings
}

/// Says that no foliage of `plant` has the `strokes` of `file`.
fn no_leaf_for(file: &Path, strokes: &LeafStrokes, plant: &Plant) -> String {
    let foliage = plant.parts.iter().filter(|part| part.kind == PartKind::Foliage);
    let names: Vec<String> = foliage.map(|part| format!("`{}`", part.material.name)).collect();
    let (file, plant) = (file.display(), &plant.name);
    if names.is_empty() {
        return format!("{file}: {plant} has no foliage, so its strokes are not drawn");
    }
    let wanted = strokes.materials.join("`, `");
    format!(
        "{file}: no foliage of {plant} is called `{wanted}`, so its strokes are not drawn; its foliage: {}",
        names.join(", ")
    )
}
