//! The program: scenes built into stages, beside a Bevy program where it wants, headless pictures, the ground truth of a scene, the interactive flight, and what a file holds.

mod adapter;
mod camera;
mod error;
mod fly;
mod ground;
mod headless;
mod info;
mod load;
mod notes;
mod picture;
mod plants;
mod reference;
mod stage;
mod threads;
mod together;
mod tone;
mod trees;

pub use adapter::list_adapters;
pub use error::AppError;
pub use fly::fly;
pub use headless::{Renderer, render};
pub use info::info;
pub use load::{CanopyScenePlugin, LoadScene, LoadedScene, SceneFailed, SceneProgress, SceneReady, SceneState};
pub use picture::Picture;
pub use reference::reference;
pub use stage::{Shown, Stage};
