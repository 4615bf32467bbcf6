//! Terrain: height fields in metres, the smooth ground through them, and what drawing and light need to know of it.
//!
//! ```text
//! read::read_terrain (GeoTIFF, ESRI ASCII, .hgt, PNG) --+
//!                                                       +--> HeightField --> Terrain: height, normal, slope
//! noise::NoiseTerrain::height_field --------------------+                      |-> tiles: levels of detail to draw
//!                                                                              |-> sun_horizon: shadow of the relief
//!                                                                              +-> relief_horizon: what of the sky it hides
//! ```
//!
//! The local frame of everything here: metres, origin at the centre of the field, x east, z south, heights above the
//! datum of the data. A [`Drape`] is a photograph over the ground in the same frame. [`GeoReference`] leads from the coordinates of a file to this frame and back.

pub mod drape;
mod error;
mod extended_grid;
mod geo_reference;
pub mod ground_noise;
mod height_bounds;
mod height_field;
mod holes;
pub mod noise;
mod projection;
pub mod read;
pub mod relief_horizon;
pub mod sun_horizon;
mod surface;
pub mod tiles;

pub use drape::{Drape, read_drape, read_drape_bytes};
pub use error::{TerrainError, Warning};
pub use extended_grid::Surroundings;
pub use geo_reference::{CoordinateSystem, GeoReference, SystemMap};
pub use height_field::{HeightField, MAX_HEIGHT, MAX_SAMPLES};
pub use noise::{NoiseKind, NoiseTerrain};
pub use read::{Crop, ImageScale, ReadOptions, read_terrain, read_terrain_bytes, read_terrain_tiles};
pub use surface::Terrain;
