//! Plant to baked plant: everything that rendering needs besides the mesh. Pure functions on slices: no App, no ECS, no
//! GPU.
//!
//! | module | makes | after |
//! |---|---|---|
//! | [`lighting`] | how a plant is lit, and the data that is baked for it: | |
//! | [`lighting::implicit`] | normals, ambient term and surface of the crown's density field | [Luft 2007] |
//! | [`lighting::transfer`] | radiance transfer of the sky, per vertex and side | [Franzke 2005, 4.2.3] |
//! | [`levels`] | the representations that are baked: | |
//! | [`levels::cross`] | crossed billboards with colour, normal, ambient term | [Franzke 2005, 4.3] |
//! | [`levels::cloud`] | billboard cloud: a hundred planes, and a trunk of few sides | [Franzke 2005, 4.3.1] |
//! | [`levels::thinned`] | a model with fewer and larger leaves | [Cook et al. 2007] |
//! | [`levels::crown_surface`] | wood, and the implicit surface of the foliage | [Luft 2006, 4.1] |
//! | [`levels::shadow_proxy`] | a lighter model with the same projected area | [Cook et al. 2007] |
//! | [`textures`] | mip levels of the full model's textures | [Castaño 2010] |
//! | [`cache`] | files on disk, keyed by the content that they were made from | |
//!
//! [`bake_plant`] does all of it. Its result depends only on the plant and the settings, bit for bit, not on the number
//! of threads.

mod baked;
pub mod cache;
mod error;
pub mod levels;
pub mod lighting;
pub mod textures;

use std::sync::Arc;

use crate::plant::Plant;
use cache::{Cache, CacheKey};
use levels::{bake_levels, needs_textures};
use lighting::BakedLighting;
use textures::PlantTextures;

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
        /// Why it could not be stored in the cache, if there is one. Worth a message, not a reason to stop.
        warning: Option<BakeError>,
    },
}

/// Bakes `plant`, or loads the result from `cache` if the same plant was baked with the same settings before. A fresh
/// result is stored in the cache. If storing fails, [`BakeSource::Fresh`] has the reason, and the result is still
/// returned.
pub fn bake_plant(plant: Arc<Plant>, settings: &BakeSettings, cache: Option<&Cache>) -> (BakedPlant, BakeSource) {
    let settings = settings.sanitized();
    let entry = cache.map(|cache| (cache, CacheKey::new(&plant, &settings)));
    if let Some(baked) = entry.as_ref().and_then(|(cache, key)| cache.load(key, &plant)) {
        return (baked, BakeSource::Cache);
    }
    let (baked, not_stored) = bake_fresh(plant, &settings, cache);
    let warning = entry.and_then(|(cache, key)| cache.store(&key, &baked).err());
    (baked, BakeSource::Fresh { warning: warning.or(not_stored) })
}

/// The bake, and why a texture of it could not be stored.
fn bake_fresh(plant: Arc<Plant>, settings: &BakeSettings, cache: Option<&Cache>) -> (BakedPlant, Option<BakeError>) {
    // Light between leaves, and levels that show no single leaf, know leaves in the mean over their angles.
    let averaged = plant.without_layers().map(Arc::new);
    let seen = averaged.as_ref().unwrap_or(&plant);
    let lighting = Arc::new(BakedLighting::bake(seen, &settings.lighting));
    let levels = bake_levels(seen, &lighting, settings);
    let (textures, not_stored) = if settings.representations.iter().any(needs_textures) {
        PlantTextures::new(&plant, cache)
    } else {
        Default::default()
    };
    (BakedPlant { plant, lighting, levels, textures: Arc::new(textures) }, not_stored)
}
