//! Canopy: a real-time forest renderer and landscape simulator on Bevy.
//!
//! As a library, Canopy is a plugin group and a handful of components. A forest in any Bevy program, which bakes it beside
//! the frames, with progress, and takes from the cache what it has:
//!
//! ```no_run
//! use bevy::prelude::*;
//! use canopy::prelude::*;
//!
//! fn main() {
//!     App::new().add_plugins((DefaultPlugins, CanopyPlugins)).add_systems(Startup, set_up).run();
//! }
//!
//! fn set_up(mut commands: Commands) {
//!     commands
//!         .spawn(CanopyScene::new("assets/scenes/demo.ron"))
//!         .observe(look)
//!         .observe(|failed: On<SceneFailed>| println!("{}", *failed));
//! }
//!
//! fn look(ready: On<SceneReady>, mut commands: Commands) {
//!     let height = ready.stage.terrain.height(0.0, 0.0) as f32 + 40.0;
//!     commands.spawn((CanopyCamera, Transform::from_xyz(0.0, height, 0.0)));
//! }
//! ```
//!
//! A scene that is built in code ([`Scene`](scene::Scene)) goes where a file's name can go, and needs no file.
//! Another [`CanopyScene`](components::CanopyScene) on the same entity takes its place. A program that would rather wait calls
//! [`Stage::build`](assets::Stage::build) itself, and [`Stage::show`](assets::Stage::show).
//!
//! The rooms: [`math`], [`scene`] (what a user writes), [`terrain`], [`scatter`], [`plant`], [`bake`], [`light`], [`lod`],
//! [`trace`] and [`mod@reference`] know no App and no GPU; [`assets`] builds scenes from them, [`render`] draws what
//! they make, and [`components`] are what a program spawns. ARCHITECTURE.md in the repository shows how a tree gets from a file to a pixel.
//!
//! # Cargo features
//! - `program` (default): the command `canopy` and the module `app`; brings `clap`, `egui` and progress bars.
//! - `window` (part of `program`): Bevy's window, keyboard and mouse.
//!
//! A program that has a window of its own takes Canopy with `default-features = false`.

#[cfg(feature = "program")]
pub mod app;
pub mod assets;
pub mod bake;
pub mod components;
pub mod cull;
mod files;
pub mod light;
pub mod lod;
pub mod math;
pub mod plant;
mod plugin;
pub mod progress;
pub mod reference;
pub mod render;
pub mod scatter;
pub mod scene;
pub mod terrain;
pub mod trace;

pub use plugin::CanopyPlugins;

/// What most programs need.
pub mod prelude {
    pub use crate::{
        CanopyPlugins,
        assets::{CanopyAssetPlugin, PlantAsset, PlantSettings, SceneAsset, Stage, TerrainMap, TerrainMapSettings},
        components::{
            CanopyScene, CanopySystems, FloatingOrigin, FollowsDaylight, Forest3d, ForestFailed, ForestReady,
            ForestSettings, ForestSpecies, ForestTrees, LoadedScene, SceneFailed, SceneProgress, SceneReady,
            SceneState, Sun, SunRefresh, Terrain3d, TerrainFailed, TerrainReady, TerrainSettings,
        },
        lod::{FadeBand, Levels, Representation},
        progress::{Progress, Silent},
        render::components::{
            CanopyCamera, CanopyOrigin, CastsCanopyShadow, Daylight, Forest, Ground, SunShadowSettings, ViewOptions,
        },
        render::diagnostics::CanopyDiagnosticsPlugin,
        scene::{Overrides, Scene, SceneSource},
    };
}
