//! The program: scenes built into stages, headless pictures, the ground truth of a scene, the interactive flight, and what a file holds.

mod adapter;
mod camera;
mod error;
mod fly;
mod ground;
mod headless;
mod info;
mod notes;
mod picture;
mod plants;
mod reference;
mod stage;
mod together;
mod tone;
mod trees;

pub use adapter::list_adapters;
pub use error::AppError;
pub use fly::fly;
pub use headless::{Renderer, render};
pub use info::info;
pub use picture::Picture;
pub use reference::reference;
pub use stage::Stage;
