//! Canopy: a real-time forest renderer and landscape simulator on Bevy.
//!
//! As a library, Canopy is a plugin group and a handful of components. This is a forest in a Bevy program. It is baked
//! in the background, with progress, or loaded from the cache:
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
//! A [`Scene`](scene::Scene) that is built in code can be passed instead of a file name. Another
//! [`CanopyScene`](components::CanopyScene) on the same entity replaces it. A program that prefers to wait calls
//! [`Stage::build`](assets::Stage::build) and [`Stage::show`](assets::Stage::show) itself.
//!
//! Without a window or a display a program draws into an image and drives the frames itself: `examples/headless.rs` in the
//! repository does so. An image that must be complete waits for its forests
//! ([`ForestUpdates::Blocking`](render::components::ForestUpdates)) and for its light
//! ([`SunRefresh::Immediate`](components::SunRefresh)).
//!
//! The modules [`math`], [`scene`] (what a user writes), [`terrain`], [`scatter`], [`plant`], [`bake`], [`light`],
//! [`style`], [`lod`], [`trace`] and [`mod@reference`] use neither `App` nor GPU. [`assets`] builds scenes from them, [`render`]
//! draws them, and [`components`] has what a program spawns. ARCHITECTURE.md in the repository shows the path of a tree
//! from a file to a pixel.
//!
//! # Cargo features
//! - `program` (default): the command `canopy` and the module `app`; brings `clap`, `egui` and progress bars.
//! - `window` (part of `program`): Bevy's window, keyboard and mouse.
//! - `geopackage` (part of `program`): inventories in GeoPackages; brings `rusqlite` with SQLite, which needs a C compiler.
//!
//! A program with its own window uses Canopy with `default-features = false`.

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
pub mod measure;
pub mod plant;
mod plugin;
pub mod progress;
pub mod reference;
pub mod render;
pub mod scatter;
pub mod scene;
pub mod style;
pub mod terrain;
pub mod trace;

pub use plugin::CanopyPlugins;

/// The programs in README compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

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
            CanopyCamera, CanopyOrigin, CanopyStyle, CastsCanopyShadow, Compression, Daylight, Forest, ForestUpdates,
            Ground, GroundDrape, LightUpdates, SunShadowSettings, TextureCompression, ViewOptions,
        },
        render::diagnostics::CanopyDiagnosticsPlugin,
        scene::{Overrides, Scene, SceneSource},
    };
}
