//! What a Bevy program spawns: terrain and forests, of assets or of values made in code.
//!
//! ```text
//!  Terrain3d(Handle<TerrainMap>) ----------------------------> Ground (renderer) <--- canopy cover of its forests, summed
//!  Forest3d { trees, species: Handle<PlantAsset>, ground } --> built beside the frames --> Forest (renderer), ForestReady
//! ```
//!
//! The components of this room say what a program wants; systems at the end of each frame (in
//! [`CanopyComponentSystems`]) bring the renderer's own components on the same entities to it: when an asset is loaded, when it
//! changes, when a component changes, when either goes. Any number of terrains and forests may stand in one world.

mod cover;
mod forest;
mod terrain;

use bevy::{
    app::{App, Plugin, PostUpdate},
    asset::{AssetEventSystems, Assets},
    ecs::schedule::{IntoScheduleConfigs, SystemSet, common_conditions::resource_exists},
    transform::TransformSystems,
};

use crate::assets::{PlantAsset, TerrainMap};
pub use forest::{Forest3d, ForestError, ForestFailed, ForestReady, ForestSettings, ForestSpecies, ForestTrees};
pub use terrain::{Terrain3d, TerrainFailed, TerrainReady, TerrainSettings};

/// The systems that follow this room's components, in [`PostUpdate`].
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CanopyComponentSystems;

/// [`Terrain3d`] and [`Forest3d`]. Part of [`CanopyPlugins`](crate::CanopyPlugins); needs
/// [`CanopyAssetPlugin`](crate::assets::CanopyAssetPlugin), without whose assets the systems rest.
#[derive(Clone, Copy, Debug, Default)]
pub struct CanopyComponentsPlugin;

impl Plugin for CanopyComponentsPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<Terrain3d>()
            .register_type::<TerrainSettings>()
            .register_type::<Forest3d>()
            .register_type::<ForestSettings>()
            .add_systems(
                PostUpdate,
                (terrain::show_terrains, forest::tend_forests, cover::cover_grounds)
                    .chain()
                    .in_set(CanopyComponentSystems)
                    .after(AssetEventSystems)
                    .after(TransformSystems::Propagate)
                    .run_if(resource_exists::<Assets<PlantAsset>>)
                    .run_if(resource_exists::<Assets<TerrainMap>>),
            );
    }
}
