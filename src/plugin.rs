//! All of Canopy as one plugin group.

use bevy::app::{PluginGroup, PluginGroupBuilder};

use crate::{
    assets::CanopyAssetPlugin,
    components::{ForestPlugin, OriginPlugin, ScenePlugin, SunPlugin},
    render::CanopyRenderPlugin,
};

/// All of Canopy for a Bevy program that has its `DefaultPlugins`, added before or after these.
pub struct CanopyPlugins;

impl PluginGroup for CanopyPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            .add(CanopyAssetPlugin)
            .add(CanopyRenderPlugin)
            .add(SunPlugin)
            .add(OriginPlugin)
            .add(ScenePlugin)
            .add(ForestPlugin)
    }
}
