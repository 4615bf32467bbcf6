//! A photograph over the ground of a scene.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::check::Check;
use crate::terrain::CoordinateSystem;

/// A photograph over the ground: an orthophoto, a satellite picture or a map. In a scene file: `drape: (path: "ortho.tif")`.
///
/// It is read as GeoTIFF, or as PNG, JPEG or WebP with a world file (`.pgw`, `.jgw`, `.wld`) and, if need be, a `.prj` beside it. One
/// without a place is stretched over the whole terrain. Near the camera, where its pixels become visible, it has the fine detail
/// of the ground's own colour.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drape {
    /// The file, relative to the scene file. Required.
    pub path: PathBuf,
    /// Further tiles of the same photograph. Where tiles overlap, the first one counts. Default: none.
    #[serde(default)]
    pub tiles: Vec<PathBuf>,
    /// The coordinate system of the files, which overrides that in them. Default: the files' own, else the terrain's.
    #[serde(default)]
    pub coordinates: Option<CoordinateSystem>,
    /// Factor from the photograph's values (linear, 1 is white) to the reflectance of the ground, 0.05 to 4. Default 0.5:
    /// photographs are developed for the eye, about twice as bright as the ground is (meadow 0.1, forest 0.04).
    #[serde(default = "half")]
    pub brightness: f64,
}

fn half() -> f64 {
    0.5
}

impl Drape {
    /// The photograph in the file `path`.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), tiles: Vec::new(), coordinates: None, brightness: half() }
    }

    /// All files, in the order of preference.
    pub fn files(&self) -> Vec<PathBuf> {
        std::iter::once(&self.path).chain(&self.tiles).cloned().collect()
    }

    pub(super) fn check(&self, check: &mut Check) {
        check.path("drape.path", &self.path);
        for (number, tile) in self.tiles.iter().enumerate() {
            check.path(&format!("drape.tiles[{number}]"), tile);
        }
        check.number("drape.brightness", self.brightness, 0.05..=4.0, "");
    }

    pub(super) fn resolve(&mut self, folder: &Path) {
        self.path = folder.join(&self.path);
        self.tiles.iter_mut().for_each(|tile| *tile = folder.join(&tile));
    }
}
