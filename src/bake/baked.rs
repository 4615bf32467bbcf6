//! A plant with all that is baked for it, and the settings of the bakes.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::levels::{
    BakedLevel, LevelSet,
    cloud::{Cloud, CloudSettings},
    cross::{Cross, CrossSettings},
    crown_surface::{CrownSurface, CrownSurfaceSettings},
    reduced::ReducedPlant,
    thinned::ThinnedSettings,
};
use super::lighting::{BakedLighting, LightingSettings};
use super::textures::PlantTextures;
use crate::lod::Representation;
use crate::plant::{Plant, PlantMesh};
use crate::scatter::PlantSize;

/// A plant with everything that is derived from it once and kept in the cache. Each product has its own [`Arc`]:
/// cloning is cheap, and the renderer finds what changed by pointer equality.
#[derive(Clone, Debug)]
pub struct BakedPlant {
    /// The full model.
    pub plant: Arc<Plant>,
    /// Lighting data of its vertices.
    pub lighting: Arc<BakedLighting>,
    /// The baked representations, at most one of each kind.
    pub levels: Vec<BakedLevel>,
    /// The textures of the full model, filtered; empty if no representation was listed that needs
    /// them ([`needs_textures`](super::levels::needs_textures)).
    pub textures: Arc<PlantTextures>,
}

impl BakedPlant {
    /// The level of `representation`, if it was baked.
    pub fn level(&self, representation: Representation) -> Option<&BakedLevel> {
        self.levels.iter().find(|level| level.representation() == representation)
    }

    /// The shadow proxy, if it was baked: a lighter model that casts the near shadow.
    pub fn shadow_proxy(&self) -> Option<&Arc<Vec<PlantMesh>>> {
        self.levels.iter().find_map(|level| match level {
            BakedLevel::ShadowProxy(proxy) => Some(proxy),
            _ => None,
        })
    }

    /// The crossed billboards, if they were baked.
    pub fn cross(&self) -> Option<&Arc<Cross>> {
        self.levels.iter().find_map(|level| match level {
            BakedLevel::Cross(cross) => Some(cross),
            _ => None,
        })
    }

    /// The billboard cloud, if it was baked.
    pub fn cloud(&self) -> Option<&Arc<Cloud>> {
        self.levels.iter().find_map(|level| match level {
            BakedLevel::Cloud(cloud) => Some(cloud),
            _ => None,
        })
    }

    /// The simplified model, if it was baked.
    pub fn thinned(&self) -> Option<&Arc<ReducedPlant>> {
        self.levels.iter().find_map(|level| match level {
            BakedLevel::Thinned(reduced) => Some(reduced),
            _ => None,
        })
    }

    /// The implicit surface of its foliage, if it was baked.
    pub fn crown_surface(&self) -> Option<&Arc<CrownSurface>> {
        self.levels.iter().find_map(|level| match level {
            BakedLevel::Surface(surface) => Some(surface),
            _ => None,
        })
    }

    /// Replaces the level of the same representation by `level`, or adds it if there is none.
    pub fn set_level(&mut self, level: BakedLevel) {
        match self.levels.iter_mut().find(|known| known.representation() == level.representation()) {
            Some(known) => *known = level,
            None => self.levels.push(level),
        }
    }

    /// The same plant with `level` set as by [`Self::set_level`].
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

/// Height and bounding radius of `plant`, at any yaw.
pub fn plant_size(plant: &Plant) -> PlantSize {
    PlantSize::new(plant.height(), plant.bounding_radius())
}

/// Settings of a plant's bake. Values out of range are clamped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakeSettings {
    /// The representations to bake. Default: full models and crossed billboards; a program that draws others lists them. Set in
    /// code.
    #[serde(skip_deserializing)]
    pub representations: LevelSet,
    /// Lighting model of the foliage.
    pub lighting: LightingSettings,
    /// Settings of the crossed billboards.
    pub cross: CrossSettings,
    /// Settings of the billboard cloud.
    pub cloud: CloudSettings,
    /// Settings of the simplified model.
    pub thinned: ThinnedSettings,
    /// Settings of the crown's surface.
    pub surface: CrownSurfaceSettings,
    /// Triangles of the shadow proxy as a fraction of the plant's, 0..=1. Smaller: faster and coarser shadows.
    pub shadow_share: f32,
}

impl Default for BakeSettings {
    fn default() -> Self {
        Self {
            representations: LevelSet::default(),
            lighting: LightingSettings::default(),
            cross: CrossSettings::default(),
            cloud: CloudSettings::default(),
            thinned: ThinnedSettings::default(),
            surface: CrownSurfaceSettings::default(),
            shadow_share: 0.2,
        }
    }
}

impl BakeSettings {
    /// The settings with every value clamped to its range; a value that is not finite becomes the default.
    pub fn sanitized(self) -> Self {
        let share = if self.shadow_share.is_finite() { self.shadow_share } else { Self::default().shadow_share };
        Self {
            representations: self.representations,
            lighting: self.lighting.sanitized(),
            cross: self.cross.sanitized(),
            cloud: self.cloud.sanitized(),
            thinned: self.thinned.sanitized(),
            surface: self.surface.sanitized(),
            shadow_share: share.clamp(0.0, 1.0),
        }
    }
}
