//! The part of the ground that its maps cover.

use std::sync::Arc;

use glam::DVec2;

use crate::{render::components::Ground, terrain::Terrain};

/// The area of a map of the ground: the terrain's data, and what is wooded beyond them. Terrains are compared by address.
#[derive(Clone)]
pub struct MapArea {
    pub terrain: Arc<Terrain>,
    /// Metres beyond the data that the map reaches.
    pub surroundings: f64,
}

impl PartialEq for MapArea {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.terrain, &other.terrain) && self.surroundings == other.surroundings
    }
}

impl MapArea {
    /// The area of `ground`. Surroundings that are not finite count as none.
    pub fn of(ground: &Ground) -> Self {
        let surroundings = if ground.surroundings.is_finite() { ground.surroundings.clamp(0.0, 1e6) } else { 0.0 };
        Self { terrain: ground.terrain.clone(), surroundings }
    }

    /// Size of the map in metres.
    pub fn extent(&self) -> DVec2 {
        self.terrain.extent() + 2.0 * self.surroundings
    }

    /// Columns and rows of a map with `of_data` texels along the longer side of the data, and at most `in_all` along its own.
    pub fn size(&self, of_data: f64, in_all: f64) -> (u32, u32) {
        let extent = self.extent();
        let texel = (self.terrain.extent().max_element() / of_data).max(extent.max_element() / in_all);
        ((extent.x / texel).ceil().max(1.0) as u32, (extent.y / texel).ceil().max(1.0) as u32)
    }
}
