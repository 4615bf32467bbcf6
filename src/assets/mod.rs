//! Builds what a Bevy world shows from a scene: terrain, plants and stand, baked and packed into a [`Stage`].
//!
//! ```text
//!  scene --> ground ----------------------------------+
//!       \--> plants --> bake (cached), a few at a time  +--> Stage --> Ground, Forest, SunShadowSettings
//!       \--> trees (stand) --> trees lit together -----+
//! ```
//!
//! [`Stage::build`] blocks, reports to a [`Progress`](crate::progress::Progress) and can be cancelled;
//! [`CanopyScene`](crate::components::CanopyScene) runs it in the background of a Bevy program, on the threads that it shares with other loads.
//!
//! Programs that build forests in code use Bevy assets: [`PlantAsset`], [`TerrainMap`] and [`SceneAsset`], registered
//! by [`CanopyAssetPlugin`].

pub(crate) mod background;
mod error;
pub(crate) mod ground;
mod inventory_place;
pub(crate) mod load_error;
mod plant;
pub(crate) mod plants;
mod plugin;
mod read;
mod scene_asset;
pub(crate) mod stage;
mod strokes;
mod terrain_map;
pub(crate) mod threads;
mod together;
pub(crate) mod trees;

pub use crate::render::forest::most_trees;
pub use error::StageError;
pub use plant::{Growth, PlantAsset, PlantLoader, PlantSettings};
pub use plugin::CanopyAssetPlugin;
pub use scene_asset::{SceneAsset, SceneLoader};
pub use stage::Stage;
pub use terrain_map::{TerrainMap, TerrainMapLoader, TerrainMapSettings};
