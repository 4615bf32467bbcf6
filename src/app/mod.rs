//! The program: scenes built into stages, headless pictures, the interactive flight, and what a file holds.

mod adapter;
mod error;
mod headless;
mod picture;
mod plants;
mod stage;
mod trees;

pub use adapter::list_adapters;
pub use error::AppError;
pub use headless::{Renderer, render};
pub use stage::Stage;
