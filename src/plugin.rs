//! All of Canopy as one plugin group.

use bevy::app::{PluginGroup, PluginGroupBuilder};

use crate::{
    assets::CanopyAssetPlugin,
    components::CanopyComponentsPlugin,
    render::{CanopyRenderPlugin, daylight::DaylightPlugin},
};

/// All of Canopy for a Bevy program that has its `DefaultPlugins`.
pub struct CanopyPlugins;

impl PluginGroup for CanopyPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            .add(CanopyAssetPlugin)
            .add(CanopyComponentsPlugin)
            .add(DaylightPlugin)
            .add(CanopyRenderPlugin)
    }
}
