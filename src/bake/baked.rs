//! A plant with all that is baked for it, and the settings of the bakes.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::levels::cross::{Cross, CrossSettings};
use super::lighting::{BakedLighting, LightingSettings};
use crate::plant::{Plant, PlantMesh};
use crate::scatter::PlantSize;

/// A plant with everything that is derived from it once and kept in the cache. What is made apart is shared apart: a copy
/// is cheap, and who draws plants sees by the pointers what of one has changed.
#[derive(Clone, Debug)]
pub struct BakedPlant {
    /// The full model.
    pub plant: Arc<Plant>,
    /// What lights the foliage.
    pub lighting: Arc<BakedLighting>,
    /// A lighter model (parts in the plant's order) with the same projected area, which casts the near shadow.
    pub shadow_proxy: Arc<Vec<PlantMesh>>,
    /// Crossed billboards.
    pub cross: Arc<Cross>,
}

impl BakedPlant {
    /// Its [`plant_size`].
    pub fn size(&self) -> PlantSize {
        plant_size(&self.plant)
    }
}

/// The size of what holds `plant` whatever its yaw.
pub fn plant_size(plant: &Plant) -> PlantSize {
    PlantSize::new(plant.height(), plant.reach())
}

/// How a plant is baked. Values out of range are moved into it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakeSettings {
    /// Which light the foliage gets.
    pub lighting: LightingSettings,
    /// Crossed billboards.
    pub cross: CrossSettings,
    /// Triangles of the shadow proxy as a share of the plant's, 0..=1. Smaller: faster and coarser shadows.
    pub shadow_share: f32,
}

impl Default for BakeSettings {
    fn default() -> Self {
        Self { lighting: LightingSettings::default(), cross: CrossSettings::default(), shadow_share: 0.2 }
    }
}

impl BakeSettings {
    /// The settings with every value moved into its range; what is not finite becomes the default.
    pub fn in_range(self) -> Self {
        let share = if self.shadow_share.is_finite() { self.shadow_share } else { Self::default().shadow_share };
        Self { lighting: self.lighting.in_range(), cross: self.cross.in_range(), shadow_share: share.clamp(0.0, 1.0) }
    }
}
