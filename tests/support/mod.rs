//! What several tests share.

pub mod data;
pub mod glb;
pub mod gpu;
pub mod image;
pub mod inventory;
pub mod program;
pub mod stage;
