//! Plant to baked plant: what the passes need beside the mesh itself. Pure functions on slices: no App, no ECS, no GPU.
//!
//! | module | makes | after |
//! |---|---|---|
//! | [`lighting`] | which light a plant gets, and what is baked for it: | |
//! | [`lighting::implicit`] | normals and k_a from the crown's implicit surface, and that surface | [Luft 2007] |
//! | [`lighting::transfer`] | radiance transfer of the sky a vertex and side | [Franzke 2005, 4.2.3] |
//! | [`levels`] | what a plant is drawn as: | |
//! | [`levels::cross`] | crossed billboards with colour, normal, k_a | [Franzke 2005, 4.3] |
//! | [`levels::shadow_proxy`] | a lighter model with the same projected area | [Cook et al. 2007] |
//! | [`cache`] | files on disk, found by the content they were made from | |
//!
//! [`bake_plant`] does all of it. Its result depends on the plant and the settings alone, bit for bit, not on the
//! number of threads.

mod baked;
pub mod cache;
mod error;
pub mod levels;
pub mod lighting;

use std::sync::Arc;

use crate::plant::Plant;
use cache::{Cache, CacheKey};
use levels::bake_levels;
use lighting::BakedLighting;

pub use baked::{BakeSettings, BakedPlant, plant_size};
pub use error::BakeError;
pub use levels::BakedLevel;

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
    let lighting = Arc::new(BakedLighting::bake(&plant, &settings.lighting));
    let levels = bake_levels(&plant, &lighting, settings);
    BakedPlant { plant, lighting, levels }
}
