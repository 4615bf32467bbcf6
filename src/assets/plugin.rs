//! Registers the assets.

use std::path::{Path, PathBuf};

use bevy::{
    app::{App, Plugin},
    asset::{
        AssetApp, AssetPlugin, AssetServer, Assets,
        io::{embedded::EmbeddedAssetRegistry, file::FileAssetReader},
    },
};
use tracing::error;

use super::{
    PlantAsset, SceneAsset, TerrainMap, plant::PlantLoader, scene_asset::SceneLoader, terrain_map::TerrainMapLoader,
};

/// The species that come with the crate: path below `embedded://canopy/`, text.
const SPECIES: [(&str, &str); 2] = [
    ("species/broadleaf.species.ron", include_str!("../../assets/species/broadleaf.species.ron")),
    ("species/conifer.species.ron", include_str!("../../assets/species/conifer.species.ron")),
];

/// Registers the assets and their loaders: [`PlantAsset`], [`TerrainMap`], [`SceneAsset`], and the built-in species.
///
/// Part of [`CanopyPlugins`](crate::CanopyPlugins). May be added before or after Bevy's `AssetPlugin`, and more than
/// once; if that plugin is missing when the app starts, an error is logged and nothing is registered.
#[derive(Clone, Copy, Debug, Default)]
pub struct CanopyAssetPlugin;

impl Plugin for CanopyAssetPlugin {
    fn build(&self, app: &mut App) {
        // If this plugin was added first, `finish` does it.
        if app.world().contains_resource::<AssetServer>() {
            register(app);
        }
    }

    fn finish(&self, app: &mut App) {
        if app.world().contains_resource::<AssetServer>() {
            register(app);
        } else {
            error!("Canopy's assets cannot be loaded: add Bevy's `AssetPlugin`, which is one of its `DefaultPlugins`");
        }
    }

    fn is_unique(&self) -> bool {
        false
    }
}

fn register(app: &mut App) {
    if app.world().contains_resource::<Assets<PlantAsset>>() {
        return;
    }
    let folder = app
        .get_added_plugins::<AssetPlugin>()
        .first()
        .map_or_else(PathBuf::new, |plugin| FileAssetReader::get_base_path().join(&plugin.file_path));
    app.init_asset::<PlantAsset>()
        .init_asset::<TerrainMap>()
        .init_asset::<SceneAsset>()
        .register_asset_loader(PlantLoader)
        .register_asset_loader(TerrainMapLoader)
        .register_asset_loader(SceneLoader { folder });
    if let Some(registry) = app.world().get_resource::<EmbeddedAssetRegistry>() {
        for (path, text) in SPECIES {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").join(path);
            registry.insert_asset(file, &Path::new("canopy").join(path), text.as_bytes());
        }
    }
}
