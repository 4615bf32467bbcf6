//! From a scene to what a Bevy world shows: terrain, plants and stand are built, baked and packed into a [`Stage`].
//!
//! ```text
//!  scene --> ground ----------------------------------+
//!       \--> plants --> bake (cached), a few at a time  +--> Stage --> Ground, Forest, SunShadowSettings, SkySettings
//!       \--> trees (stand) --> trees lit together -----+
//! ```
//!
//! [`Stage::build`] blocks, reports to a [`Progress`](crate::progress::Progress) and can be cancelled;
//! [`CanopyScenePlugin`] runs it beside a Bevy program's frames, on threads of its own.

mod error;
pub(crate) mod ground;
mod load;
pub(crate) mod plants;
pub(crate) mod stage;
pub(crate) mod threads;
mod together;
pub(crate) mod trees;

pub use error::StageError;
pub use load::{CanopyScenePlugin, LoadScene, LoadedScene, SceneFailed, SceneProgress, SceneReady, SceneState};
pub use stage::{Shown, Stage};
