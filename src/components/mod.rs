//! What a Bevy program spawns, besides the [renderer's own components](crate::render::components): scenes, terrains and
//! forests from assets or from values in code; the sun; the origin.
//!
//! ```text
//!  CanopyScene { file or value } ----------------------------> Ground, Forest, Sun as children, SceneReady
//!  Terrain3d(Handle<TerrainMap>) ----------------------------> Ground (renderer) <--- canopy cover of its forests, summed
//!  Forest3d { trees, species: Handle<PlantAsset>, ground } --> built in the background --> Forest (renderer), ForestReady
//!  Sun ------------------------------------------------------> Daylight (renderer), exposure, DirectionalLight
//! ```
//!
//! These components say what a program wants. Systems ([`CanopySystems`]) update the renderer's own components from
//! them: when an asset is loaded or changes, when a component changes, when either is removed. A world can hold any
//! number of scenes, terrains and forests.

mod cover;
mod daylight;
mod exposure;
mod forest;
mod origin;
mod scene;
mod sets;
mod sun;
mod terrain;

use bevy::{
    app::{App, Plugin, PostUpdate},
    asset::{AssetEventSystems, Assets},
    ecs::schedule::{IntoScheduleConfigs, common_conditions::resource_exists},
    transform::TransformSystems,
};

use tracing::error;

use crate::{
    assets::{CanopyAssetPlugin, PlantAsset, TerrainMap},
    render::CanopyRenderPlugin,
};
pub use daylight::FollowsDaylight;
pub use forest::{Forest3d, ForestError, ForestFailed, ForestReady, ForestSettings, ForestSpecies, ForestTrees};
pub use origin::{FloatingOrigin, OriginPlugin};
pub use scene::{CanopyScene, LoadedScene, SceneFailed, ScenePlugin, SceneProgress, SceneReady, SceneState, Shown};
pub use sets::CanopySystems;
pub use sun::{DrawnSun, Sun, SunError, SunPlugin, SunRefresh};
pub use terrain::{Terrain3d, TerrainFailed, TerrainReady, TerrainSettings};

/// [`Terrain3d`] and [`Forest3d`]. Part of [`CanopyPlugins`](crate::CanopyPlugins); needs
/// [`CanopyAssetPlugin`], without whose assets the systems do nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct ForestPlugin;

impl Plugin for ForestPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<Terrain3d>()
            .register_type::<TerrainSettings>()
            .register_type::<Forest3d>()
            .register_type::<ForestSettings>()
            .add_systems(
                PostUpdate,
                (terrain::show_terrains, forest::tend_forests, cover::cover_grounds)
                    .chain()
                    .in_set(CanopySystems::Forests)
                    .after(AssetEventSystems)
                    .after(TransformSystems::Propagate)
                    .run_if(resource_exists::<Assets<PlantAsset>>)
                    .run_if(resource_exists::<Assets<TerrainMap>>),
            );
    }

    fn finish(&self, app: &mut App) {
        let assets = app.is_plugin_added::<CanopyAssetPlugin>();
        report_missing(app, "ForestPlugin", &[(assets, "CanopyAssetPlugin", "nothing of `Forest3d` is built")]);
    }
}

/// Says which of Canopy's plugins are missing beside `plugin`: `needed` has whether one is there, its name, and what
/// happens without it. The renderer is always needed.
fn report_missing(app: &App, plugin: &str, needed: &[(bool, &str, &str)]) {
    let renderer = (app.is_plugin_added::<CanopyRenderPlugin>(), "CanopyRenderPlugin", "nothing is drawn");
    for (_, name, without) in needed.iter().chain([&renderer]).filter(|(there, ..)| !there) {
        error!("Canopy's `{plugin}` is there without `{name}`, so {without}: add `{name}`, or all of `CanopyPlugins`");
    }
}
