//! The program: scenes built into stages, headless pictures, the interactive flight, and what a file holds.

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
mod stage;
mod trees;

pub use adapter::list_adapters;
pub use error::AppError;
pub use fly::fly;
pub use headless::{Renderer, render};
pub use info::info;
pub use picture::Picture;
pub use stage::Stage;
