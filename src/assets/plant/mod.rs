//! Plants as Bevy assets: from a glTF file, from a species file, or built in code.
//!
//! ```text
//!  oak.glb, oak.gltf + what it names --+
//!  oak.species.ron + what it names ----+--> PlantLoader --> plants --> bakes (cached, in background)     --> PlantAsset
//!  in code: Plant, GrowParameters -------------------------------> PlantAsset::bake, grown ------------------^
//! ```

mod loader;
mod recipe;

use std::ops::Range;

use bevy::{asset::Asset, reflect::TypePath};
use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use loader::PlantLoader;

use super::StageError;
use crate::{
    bake::{
        BakeSettings, BakeSource, BakedPlant, bake_plant, cache::Cache, lighting::SunLight, textures::filter_together,
    },
    plant::{
        Gloss, LeafKind, LeafTissue, Plant,
        gltf::GltfOptions,
        grow::{GrowError, GrowParameters, grow},
    },
};

/// The baked individuals of one plant or species, for a [`Forest3d`](crate::components::Forest3d).
///
/// `assets.load::<PlantAsset>("oak.glb")` reads a glTF file as one individual, `"oak.species.ron"` a species, which is
/// an entry of a scene file's list `species` ([`Species`](crate::scene::Species)), its paths relative to the file. The
/// loader is chosen by the asset's type, so Bevy's own glTF loader keeps `oak.glb#Scene0`. [`PlantSettings`] say how a
/// glTF file is read and how a plant is baked. A bake takes seconds the first time, in the background; later it comes
/// from the user's cache. Files that a plant's file names are dependencies: when one changes and Bevy watches files,
/// the plant is reloaded.
#[derive(Asset, TypePath, Clone, Debug)]
pub struct PlantAsset {
    /// The plant's or the species' name, for messages and inventories.
    pub name: String,
    /// The individuals; cloning one is cheap. A forest needs at least one.
    pub individuals: Vec<BakedPlant>,
    /// How the sun lights full models.
    pub sun: SunLight,
    /// Where and how tall it grows.
    pub growth: Growth,
    /// Problems that do not prevent it from being drawn: a missing texture, a crown without a surface.
    pub warnings: Vec<String>,
}

/// Where a plant grows, and how tall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Range of heights in metres, lowest and highest, each 0.1 to 150. `None`: the individuals' own heights and 15 %
    /// more or less.
    pub heights: Option<(f64, f64)>,
    /// Range of ground heights in metres above the terrain's datum. `None`: everywhere.
    pub elevation: Option<(f64, f64)>,
    /// Steepest ground in degrees, 0 to 90.
    pub slope_limit: f64,
    /// Radius of the trunk's foot in metres for a tree of mean height, 0.001 to 10. `None`: 1.5 % of the mean height.
    pub trunk_radius: Option<f64>,
}

impl Default for Growth {
    /// Everywhere, at the individuals' own heights.
    fn default() -> Self {
        Self { heights: None, elevation: None, slope_limit: 90.0, trunk_radius: None }
    }
}

/// How a plant is read and baked; the settings of [`PlantLoader`].
///
/// ```no_run
/// # use bevy::prelude::*;
/// # use canopy::assets::{PlantAsset, PlantSettings};
/// # fn setup(assets: Res<AssetServer>) {
/// let oak: Handle<PlantAsset> =
///     assets.load_builder().with_settings(|plant: &mut PlantSettings| plant.height = Some(18.0)).load("oak.glb");
/// # }
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlantSettings {
    /// Height in metres to which a glTF plant is scaled, above 0. `None` keeps the file's.
    pub height: Option<f32>,
    /// Names of a glTF file's materials that are foliage whatever their alpha mode.
    pub foliage_materials: Vec<String>,
    /// Names of a glTF file's materials that are wood whatever their alpha mode.
    pub wood_materials: Vec<String>,
    /// The kind of a glTF file's leaves, which decides how much light passes through them where neither the file nor
    /// `transmission` says so.
    pub leaf: LeafKind,
    /// Light through the leaves of a glTF file, as [`GltfOptions::transmission`].
    pub transmission: Option<Vec3>,
    /// The gloss of leaves.
    pub gloss: Gloss,
    /// The tissue of leaves; `None` leaves it as the file has it.
    pub tissue: Option<LeafTissue>,
    /// How it is baked, above all its lighting.
    pub bake: BakeSettings,
    /// How the sun lights full models.
    pub sun: SunLight,
}

impl Default for PlantSettings {
    fn default() -> Self {
        Self {
            height: None,
            foliage_materials: Vec::new(),
            wood_materials: Vec::new(),
            leaf: LeafKind::default(),
            transmission: None,
            gloss: Gloss::LEAF,
            tissue: None,
            bake: BakeSettings::default(),
            sun: SunLight::default(),
        }
    }
}

impl PlantSettings {
    /// How a glTF file is read.
    pub fn gltf_options(&self) -> GltfOptions {
        GltfOptions {
            height: self.height,
            foliage_materials: self.foliage_materials.clone(),
            wood_materials: self.wood_materials.clone(),
            leaf: self.leaf,
            transmission: self.transmission,
            gloss: Some(self.gloss),
            ..GltfOptions::default()
        }
    }
}

impl PlantAsset {
    /// Asset path of the built-in broadleaf: `assets.load(PlantAsset::BROADLEAF)`.
    pub const BROADLEAF: &'static str = "embedded://canopy/species/broadleaf.species.ron";
    /// Asset path of the built-in conifer.
    pub const CONIFER: &'static str = "embedded://canopy/species/conifer.species.ron";

    /// Bakes plants that were built in code; of `settings` only gloss, bake and sun are used. Blocks until the bakes
    /// are done: seconds each if they are not in the user's cache.
    pub fn bake(name: impl Into<String>, plants: Vec<Plant>, settings: &PlantSettings) -> Self {
        let plants = plants.into_iter().map(|plant| (plant, Vec::new())).collect();
        Self::baked(name.into(), plants, settings, &|| true)
    }

    /// Grows one individual for each of `seeds`, of at most `triangles` triangles, and bakes them as
    /// [`bake`](Self::bake) does.
    ///
    /// # Errors
    /// Those of [`grow`].
    pub fn grown(
        parameters: &GrowParameters,
        seeds: Range<u64>,
        triangles: usize,
        settings: &PlantSettings,
    ) -> Result<Self, GrowError> {
        let plants = seeds.map(|seed| grow(parameters, seed, triangles)).collect::<Result<_, _>>()?;
        Ok(Self::bake(parameters.name.clone(), plants, settings))
    }

    /// Bakes `plants`, each with the warnings of its build. If the work is cancelled, some are missing.
    fn baked(
        name: String,
        plants: Vec<(Plant, Vec<String>)>,
        settings: &PlantSettings,
        wanted: &(dyn Fn() -> bool + Sync),
    ) -> Self {
        let cache = Cache::of_user();
        let textures = wanted().then(|| filter_together(plants.iter().map(|(plant, _)| plant), cache.as_ref()));
        let baked: Vec<(BakedPlant, Vec<String>)> = plants
            .into_par_iter()
            .filter_map(|(mut plant, mut warnings)| {
                if !wanted() {
                    return None;
                }
                plant.set_leaf_gloss(settings.gloss);
                if let Some(tissue) = settings.tissue {
                    plant.set_leaf_tissue(tissue);
                }
                let (baked, source) = bake_plant(plant.into(), &settings.bake, cache.as_ref());
                warnings.extend(baked.lighting.warning().map(|what| format!("{}: {what}", baked.plant.name)));
                if let BakeSource::Fresh { warning: Some(warning) } = source {
                    warnings.push(warning.to_string());
                }
                Some((baked, warnings))
            })
            .collect();
        drop(textures);
        let (individuals, warnings): (Vec<_>, Vec<_>) = baked.into_iter().unzip();
        Self { name, individuals, sun: settings.sun, growth: Growth::default(), warnings: warnings.concat() }
    }
}
