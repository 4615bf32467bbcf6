//! Terrain as a Bevy asset.

use std::sync::Arc;

use bevy::{
    asset::{Asset, AssetLoader, LoadContext, io::Reader},
    reflect::TypePath,
};
use glam::DVec2;
use tracing::warn;

use super::{StageError, background, read};
use crate::terrain::{HeightField, ReadOptions, Surroundings, Terrain, TerrainError, read_terrain_bytes};

/// How a terrain file is read; the settings of [`TerrainMapLoader`]: the part of it, the metres of an image, the
/// coordinate system, what lies around it.
pub type TerrainMapSettings = ReadOptions;

/// A terrain, for [`Terrain3d`](crate::components::Terrain3d).
///
/// `assets.load::<TerrainMap>("valley.tif")` reads GeoTIFF, ESRI ASCII grids, SRTM `.hgt` and, with a scale in the
/// settings, greyscale PNG. Bevy's image loader keeps the endings `tif` and `png`; the asset's type chooses the loader.
/// A file is read as a whole before a crop is cut from it: a program that needs a window of a very large one calls
/// [`read_terrain`](crate::terrain::read_terrain) itself and adds the map to `Assets<TerrainMap>`.
#[derive(Asset, TypePath, Clone, Debug)]
pub struct TerrainMap {
    /// Heights.
    pub terrain: Arc<Terrain>,
    /// Decisions of the reader that the user should know, such as filled holes.
    pub warnings: Vec<String>,
}

impl TerrainMap {
    /// A level square, `size` metres wide, at height 0.
    ///
    /// # Errors
    /// [`TerrainError::BadParameter`] for a size outside 0.001 m to 1000 km.
    pub fn flat(size: f64) -> Result<Self, TerrainError> {
        let field = HeightField::new(2, 2, DVec2::splat(size), vec![0.0; 4])?;
        Ok(Terrain::new(field, None, Surroundings::default()).into())
    }
}

impl From<Terrain> for TerrainMap {
    fn from(terrain: Terrain) -> Self {
        Self { terrain: Arc::new(terrain), warnings: Vec::new() }
    }
}

/// Loads [`TerrainMap`]s.
#[derive(Clone, Copy, Debug, Default, TypePath)]
pub struct TerrainMapLoader;

impl AssetLoader for TerrainMapLoader {
    type Asset = TerrainMap;
    type Settings = TerrainMapSettings;
    type Error = StageError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        settings: &TerrainMapSettings,
        context: &mut LoadContext<'_>,
    ) -> Result<TerrainMap, StageError> {
        let path = context.path().path().to_owned();
        let bytes = read::all(reader, &path).await?;
        let options = *settings;
        let (terrain, warnings) = background::start(move |_| read_terrain_bytes(&bytes, &path, &options)).await??;
        for warning in &warnings {
            warn!("{}: {warning}", context.path());
        }
        let warnings = warnings.iter().map(ToString::to_string).collect();
        Ok(TerrainMap { warnings, ..terrain.into() })
    }

    fn extensions(&self) -> &[&str] {
        &["asc", "hgt"]
    }
}
