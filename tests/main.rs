//! The one integration binary: every room's tests, the shaders, the pictures and what the program must withstand.

mod bake;
mod cli;
mod grow;
mod light;
mod plant;
mod scatter;
mod scene;
mod terrain;
