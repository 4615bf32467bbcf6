//! Canopy: a real-time forest renderer and landscape simulator on Bevy.
//!
//! As a library, Canopy is a plugin group and a handful of components. A forest in any Bevy program:
//!
//! ```no_run
//! use bevy::prelude::*;
//! use canopy::prelude::*;
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let stage = Stage::build("assets/scenes/demo.ron".as_ref(), &Overrides::default(), &mut Silent)?;
//!     App::new()
//!         .add_plugins((DefaultPlugins, CanopyPlugins))
//!         .insert_resource(stage.sky(stage.scene.place.time.utc()))
//!         .insert_resource(stage.shadow())
//!         .add_systems(Startup, move |mut commands: Commands| {
//!             commands.spawn(stage.ground());
//!             commands.spawn_batch(stage.forest());
//!             let height = stage.terrain.height(0.0, 0.0) as f32 + 40.0;
//!             commands.spawn((CanopyCamera, Transform::from_xyz(0.0, height, 0.0)));
//!         })
//!         .run();
//!     Ok(())
//! }
//! ```
//!
//! The rooms: [`scene`] (what a user writes), [`terrain`], [`scatter`], [`plant`], [`bake`], [`light`], [`lod`],
//! [`trace`] and [`mod@reference`] know no App and no GPU; [`render`] draws what they make; [`app`] is the interactive
//! program. ARCHITECTURE.md in the repository shows how a tree gets from a file to a pixel.

pub mod app;
pub mod bake;
mod files;
pub mod light;
pub mod lod;
pub mod plant;
pub mod reference;
pub mod render;
pub mod scatter;
pub mod scene;
pub mod terrain;
pub mod trace;

use bevy::app::{PluginGroup, PluginGroupBuilder};

/// All of Canopy for a Bevy program that has its `DefaultPlugins`.
pub struct CanopyPlugins;

impl PluginGroup for CanopyPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>().add(render::daylight::DaylightPlugin).add(render::CanopyRenderPlugin)
    }
}

/// What most programs need.
pub mod prelude {
    pub use crate::{
        CanopyPlugins,
        app::Stage,
        lod::FadeBand,
        render::{
            components::{
                CanopyCamera, CanopyOrigin, CastsCanopyShadow, Daylight, Forest, Ground, SunShadowSettings, ViewOptions,
            },
            daylight::{FollowsDaylight, SkySettings},
        },
        scene::{Overrides, Progress, Silent},
    };
}
