//! The one integration binary: every room's tests, the shaders, the pictures and what the program must withstand.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable)]

mod app;
mod bake;
mod beside;
mod cli;
mod compare;
mod drape;
mod export;
mod front_door;
mod fuzz;
#[cfg(feature = "geopackage")]
mod geopackages;
mod grow;
mod implicit;
mod independent;
mod interrupts;
mod inventory;
mod layering;
mod leaf;
mod library;
mod light;
mod limits;
mod load;
mod math;
mod pieces;
mod plant;
mod profile;
mod reference;
mod render;
mod scatter;
mod scene;
mod shaders;
mod shapefiles;
mod support;
mod terrain;
mod terrain_kinds;
mod trace;
mod transfer;
mod withstand;
