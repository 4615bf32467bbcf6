//! Plant to baked plant: what the passes need beside the mesh itself. Pure functions on slices: no App, no ECS, no GPU.
//!
//! | module | makes | after |
//! |---|---|---|
//! | [`lighting`] | which light a plant gets, and what is baked for it | |
//! | [`billboard`] | crossed billboards with colour, normal, k_a | [Franzke 2005, 4.3] |
//! | [`implicit`] | normals and k_a from the crown's implicit surface, and that surface | [Luft 2007] |
//! | [`shadow_proxy`] | a lighter model with the same projected area | [Cook et al. 2007] |
//! | [`transfer`] | radiance transfer of the sky a vertex and side | [Franzke 2005, 4.2.3] |
//! | [`rasterize`] | which triangle each sample of a picture sees | |
//! | [`cache`] | files on disk, found by the content they were made from | |
//!
//! [`bake_plant`] does all of it. Its result depends on the plant and the settings alone, bit for bit, not on the
//! number of threads.

pub mod billboard;
pub mod cache;
pub(crate) mod geometry;
pub mod implicit;
pub mod lighting;
pub mod rasterize;
pub mod shadow_proxy;
pub(crate) mod surface;
pub mod transfer;

use std::path::PathBuf;
use std::sync::Arc;

use crate::plant::{Plant, PlantMesh};
use billboard::{Cross, CrossSettings, bake_cross};
use cache::{Cache, CacheKey};
use lighting::{BakedLighting, LightingSettings};

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

/// How a plant is baked. Values out of range are moved into it.
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// Where a baked plant came from.
#[derive(Debug)]
pub enum BakeSource {
    /// Read from the cache.
    Cache,
    /// Computed now.
    Fresh {
        /// Why it could not be kept in the cache, if one was given. Worth a message, no reason to stop.
        warning: Option<BakeError>,
    },
}

/// What can go wrong around a bake. The bakes themselves cannot fail.
#[derive(Debug, thiserror::Error)]
pub enum BakeError {
    /// The cache folder is not there and cannot be made.
    #[error(
        "cannot create the cache folder {}: {source}; set CANOPY_CACHE to a folder that can be written, or bake \
         without a cache",
        path.display()
    )]
    CacheFolder {
        /// The folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A baked plant could not be written into the cache.
    #[error(
        "cannot write {} into the cache: {source}; the result is good but will be computed again next time: free \
         space there or set CANOPY_CACHE to another folder",
        path.display()
    )]
    CacheWrite {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}

/// Bakes `plant`, or takes the result from `cache` where the same plant was baked with the same settings before.
/// A fresh result is put into the cache; that this fails is told in [`BakeSource::Fresh`] and nothing worse.
pub fn bake_plant(plant: Arc<Plant>, settings: &BakeSettings, cache: Option<&Cache>) -> (BakedPlant, BakeSource) {
    let settings = settings.in_range();
    let place = cache.map(|cache| (cache, CacheKey::new(&plant, &settings)));
    if let Some(baked) = place.as_ref().and_then(|(cache, key)| cache.load(key, &plant)) {
        return (baked, BakeSource::Cache);
    }
    let baked = bake_fresh(plant, &settings);
    let warning = place.and_then(|(cache, key)| cache.store(&key, &baked).err());
    (baked, BakeSource::Fresh { warning })
}

fn bake_fresh(plant: Arc<Plant>, settings: &BakeSettings) -> BakedPlant {
    let triangles: usize = plant.parts.iter().map(|part| part.mesh.triangles.len()).sum();
    let target = (triangles as f64 * f64::from(settings.shadow_share)).round() as usize;
    let lighting = Arc::new(BakedLighting::bake(&plant, &settings.lighting));
    let cross = Arc::new(bake_cross(&plant, &lighting, &settings.cross));
    let shadow_proxy = Arc::new(shadow_proxy::shadow_proxy(&plant, target));
    BakedPlant { plant, lighting, shadow_proxy, cross }
}
