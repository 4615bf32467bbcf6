//! Positions of trees: from rules or an inventory to a [`Stand`], and from there to 16 bytes per tree.
//!
//! ```text
//! sequence (Halton, Hammersley, random) ─┐
//! rules (density, slope, height, ...)  ──┼─ place_trees() ────┐
//! ground (anything that is a Ground)   ──┤                    ├─ Stand ─┬─ PackedStand (GPU: trees by cell)
//! inventory (table, GIS layer) ──────────┴─ stand_from_inventory()       └─ cover_map() (shade of the far floor)
//! ```
//!
//! Franzke 2005 (section 4.4, figure 4.17) scatters its plants by the Halton and Hammersley points of
//! [Halton 1964] and [Hammersley & Handscomb 1964], because they fill the ground evenly without the rows of a grid.
//! Here the points carry density, slope, height and clearing rules, a least distance, and several species.
//! A point's *index* determines only its position: species, size, yaw and tint come from a hash of it
//! ([`crate::math::hash`]), because the bits of the index are the digits of the coordinates.
//!
//! Positions are scene-local: metres, f64, X east, Z south, Y up from the datum of the heights.
//! Every result is the same for any number of threads.

pub mod allometry;
mod clearings;
pub mod cover;
mod error;
pub mod inventory;
pub mod inventory_stand;
pub mod packed;
pub mod placement;
pub mod rules;
mod spacing;
mod stand;
pub mod stream;

pub use allometry::Allometry;
pub use cover::{CoverMap, bounded_cover_map, cover_map};
pub use error::{BadValue, ScatterError};
pub use inventory::{
    Column, Coordinates, Inventory, InventoryOptions, InventoryTree, LengthUnit, Surveys, parse_inventory,
    read_inventory,
};
pub use inventory_stand::{InventorySpecies, InventoryStand, InventoryWarnings, stand_from_inventory};
pub use packed::{Cell, CellGrid, PackedStand, PackedTree, PlantSize};
pub use placement::{
    FIRST_SURROUNDING_INDEX, Placement, PlacementReport, distance_beyond, place_surroundings, place_trees,
    surroundings_density,
};
pub use rules::{ClearingNoise, PlacementRules, Sequence, SizeRule, SpeciesRule};
pub use stand::{Area, Ground, MAX_COORDINATE_M, MAX_SCALE, MIN_SCALE, Stand, Tree};
pub use stream::{Stream, random};
