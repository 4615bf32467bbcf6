//! What the tests of pictures and of the program share.

pub mod glb;
pub mod gpu;
pub mod image;
pub mod program;
pub mod stage;
