//! A plant with all that is baked for it, and the settings of the bakes.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::levels::{
    self, BakedLevel,
    cross::{Cross, CrossSettings},
};
use super::lighting::{BakedLighting, LightingSettings};
use crate::lod::Representation;
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
    /// What is baked for its representations, at most once each.
    pub levels: Vec<BakedLevel>,
}

impl BakedPlant {
    /// A lighter model that casts the near shadow, if it was baked.
    pub fn shadow_proxy(&self) -> Option<&Arc<Vec<PlantMesh>>> {
        self.levels.iter().find_map(|level| match level {
            BakedLevel::ShadowProxy(proxy) => Some(proxy),
            _ => None,
        })
    }

    /// Crossed billboards, if they were baked.
    pub fn cross(&self) -> Option<&Arc<Cross>> {
        self.levels.iter().find_map(|level| match level {
            BakedLevel::Cross(cross) => Some(cross),
            _ => None,
        })
    }

    /// Puts `level` in the place of the one of the same representation, if there is one.
    pub fn set_level(&mut self, level: BakedLevel) {
        match self.levels.iter_mut().find(|known| known.representation() == level.representation()) {
            Some(known) => *known = level,
            None => self.levels.push(level),
        }
    }

    /// The same plant with `level` in the place of the one of the same representation.
    #[must_use]
    pub fn with_level(mut self, level: BakedLevel) -> Self {
        self.set_level(level);
        self
    }

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
    /// The representations that are baked for; all that need a bake unless a program draws fewer of them. Set in code.
    #[serde(skip_deserializing, default = "all_baked")]
    pub representations: &'static [Representation],
    /// Which light the foliage gets.
    pub lighting: LightingSettings,
    /// Crossed billboards.
    pub cross: CrossSettings,
    /// Triangles of the shadow proxy as a share of the plant's, 0..=1. Smaller: faster and coarser shadows.
    pub shadow_share: f32,
}

fn all_baked() -> &'static [Representation] {
    levels::BAKED
}

impl Default for BakeSettings {
    fn default() -> Self {
        Self {
            representations: levels::BAKED,
            lighting: LightingSettings::default(),
            cross: CrossSettings::default(),
            shadow_share: 0.2,
        }
    }
}

impl BakeSettings {
    /// The settings with every value moved into its range; what is not finite becomes the default.
    pub fn in_range(self) -> Self {
        let share = if self.shadow_share.is_finite() { self.shadow_share } else { Self::default().shadow_share };
        Self {
            representations: self.representations,
            lighting: self.lighting.in_range(),
            cross: self.cross.in_range(),
            shadow_share: share.clamp(0.0, 1.0),
        }
    }
}
