//! Baked representations of a plant besides its full model: one module per representation, and the list of them.
//!
//! | module | makes | after |
//! |---|---|---|
//! | [`cross`] | crossed billboards with colour, normal, ambient term | [Franzke 2005, 4.3] |
//! | [`cloud`] | a hundred textured planes and a trunk of few sides | [Franzke 2005, 4.3.1] |
//! | [`thinned`] | a model with fewer and larger leaves | [Cook et al. 2007] |
//! | [`crown_surface`] | wood, and the implicit surface of the foliage | [Luft 2006, 4.1] |
//! | [`shadow_proxy`] | a lighter model with the same projected area, for shadows | [Cook et al. 2007] |
//! | [`reduced`] | meshes in the light of the plant that they stand for | |
//! | [`texture`] | the textures of crosses and clouds: texels, and blocks for devices that read them | |
//! | [`rasterize`] | which triangle each sample of an image shows | |
//!
//! A bake for another representation is a module here, a variant of [`BakedLevel`] (at the end: the cache counts them),
//! and a line in the list of bakers.

pub mod cloud;
pub mod cross;
pub mod crown_surface;
mod level_set;
pub mod rasterize;
pub mod reduced;
pub mod shadow_proxy;
pub mod texture;
pub mod thinned;
mod tubes;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

pub use self::level_set::LevelSet;
use self::{cloud::Cloud, cross::Cross, crown_surface::CrownSurface, reduced::ReducedPlant};
use super::{BakeSettings, lighting::BakedLighting};
use crate::lod::Representation;
use crate::plant::{Plant, PlantMesh};

/// The baked data of a plant for one representation. The renderer finds changes by pointer equality.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum BakedLevel {
    /// For [`Representation::MODEL`]: the shadow proxy, a lighter model (parts in the plant's order) with the same
    /// projected area, which casts the near shadow.
    ShadowProxy(#[serde(with = "shared")] Arc<Vec<PlantMesh>>),
    /// For [`Representation::CROSS`]: crossed billboards.
    Cross(#[serde(with = "shared")] Arc<Cross>),
    /// For [`Representation::CLOUD`]: a billboard cloud.
    Cloud(#[serde(with = "shared")] Arc<Cloud>),
    /// For [`Representation::THINNED`]: a model with fewer and larger leaves.
    Thinned(#[serde(with = "shared")] Arc<ReducedPlant>),
    /// For [`Representation::SURFACE`]: the implicit surface of the foliage.
    Surface(#[serde(with = "shared")] Arc<CrownSurface>),
}

impl BakedLevel {
    /// The representation that it is for.
    pub fn representation(&self) -> Representation {
        match self {
            Self::ShadowProxy(_) => Representation::MODEL,
            Self::Cross(_) => Representation::CROSS,
            Self::Cloud(_) => Representation::CLOUD,
            Self::Thinned(_) => Representation::THINNED,
            Self::Surface(_) => Representation::SURFACE,
        }
    }

    /// Whether it fits `plant` under `lighting`, and all of its values are in their ranges.
    pub fn fits(&self, plant: &Plant, lighting: &BakedLighting) -> bool {
        match self {
            Self::ShadowProxy(meshes) => meshes.len() == plant.parts.len() && meshes.iter().all(PlantMesh::is_whole),
            Self::Cross(cross) => cross.is_whole(matches!(lighting, BakedLighting::Transfer(_))),
            Self::Cloud(cloud) => cloud.fits(plant, matches!(lighting, BakedLighting::Transfer(_))),
            Self::Thinned(reduced) => reduced.fits(plant),
            Self::Surface(surface) => surface.is_whole(),
        }
    }
}

/// Serialises the content of an [`Arc`].
mod shared {
    use std::sync::Arc;

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<T: Serialize, S: Serializer>(value: &Arc<T>, serializer: S) -> Result<S::Ok, S::Error> {
        value.as_ref().serialize(serializer)
    }

    pub fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<Arc<T>, D::Error> {
        T::deserialize(deserializer).map(Arc::new)
    }
}

type Bake = fn(&Arc<Plant>, &BakedLighting, &BakeSettings) -> BakedLevel;

/// The representations that need a bake, and the functions that bake them.
const BAKERS: [(Representation, Bake); 5] = [
    (Representation::MODEL, bake_proxy),
    (Representation::CROSS, bake_crosses),
    (Representation::CLOUD, bake_cloud),
    (Representation::THINNED, bake_thinned),
    (Representation::SURFACE, bake_surface),
];

/// Whether a representation is drawn with the filtered textures of the full model.
pub fn needs_textures(representation: Representation) -> bool {
    [Representation::MODEL, Representation::CLOUD, Representation::THINNED, Representation::SURFACE]
        .contains(&representation)
}

/// The representations that [`bake_levels`] knows.
pub const BAKED: &[Representation] = &{
    let mut all = [BAKERS[0].0; BAKERS.len()];
    let mut index = 1;
    while index < all.len() {
        all[index] = BAKERS[index].0;
        index += 1;
    }
    all
};

/// Bakes `plant` under `lighting` for the representations that `settings` list; one that needs no bake is passed over.
pub fn bake_levels(plant: &Arc<Plant>, lighting: &BakedLighting, settings: &BakeSettings) -> Vec<BakedLevel> {
    let listed = |(representation, _): &&(Representation, Bake)| settings.representations.contains(*representation);
    BAKERS.iter().filter(listed).map(|(_, bake)| bake(plant, lighting, settings)).collect()
}

fn bake_proxy(plant: &Arc<Plant>, _: &BakedLighting, settings: &BakeSettings) -> BakedLevel {
    let triangles: usize = plant.parts.iter().map(|part| part.mesh.triangles.len()).sum();
    let target = (triangles as f64 * f64::from(settings.shadow_share)).round() as usize;
    BakedLevel::ShadowProxy(Arc::new(shadow_proxy::shadow_proxy(plant, target)))
}

fn bake_crosses(plant: &Arc<Plant>, lighting: &BakedLighting, settings: &BakeSettings) -> BakedLevel {
    BakedLevel::Cross(Arc::new(cross::bake_cross(plant, lighting, &settings.cross)))
}

fn bake_cloud(plant: &Arc<Plant>, lighting: &BakedLighting, settings: &BakeSettings) -> BakedLevel {
    BakedLevel::Cloud(Arc::new(cloud::bake_cloud(plant, lighting, &settings.cloud)))
}

fn bake_thinned(plant: &Arc<Plant>, _: &BakedLighting, settings: &BakeSettings) -> BakedLevel {
    BakedLevel::Thinned(Arc::new(thinned::bake_thinned(plant, &settings.thinned)))
}

fn bake_surface(plant: &Arc<Plant>, _: &BakedLighting, settings: &BakeSettings) -> BakedLevel {
    BakedLevel::Surface(Arc::new(crown_surface::bake_crown_surface(plant, &settings.surface)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_baker_makes_the_level_of_its_representation() {
        let (plant, settings) =
            (Arc::new(Plant::default()), BakeSettings { representations: LevelSet::all(), ..BakeSettings::default() });
        let made = bake_levels(&plant, &BakedLighting::Local, &settings);
        let names: Vec<_> = made.iter().map(BakedLevel::representation).collect();
        assert_eq!(names, BAKERS.map(|(representation, _)| representation));
        assert_eq!(names, BAKED);
        assert!(made.iter().all(|level| level.fits(&plant, &BakedLighting::Local)));
        let one = BakeSettings { representations: [Representation::CROSS].into(), ..settings };
        let made = bake_levels(&plant, &BakedLighting::Local, &one);
        assert_eq!(made.iter().map(BakedLevel::representation).collect::<Vec<_>>(), [Representation::CROSS]);
    }
}
