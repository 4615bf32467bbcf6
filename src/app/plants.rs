//! The plants of a scene's species: which individuals there are, and how each is made.

use std::{ops::Range, path::PathBuf};

use super::error::AppError;
use crate::{
    bake::{BakeSettings, billboard::CrossSettings},
    plant::{
        Plant,
        gltf::{GltfOptions, load_plant},
        grow::{GrowParameters, grow},
    },
    scatter::packed::MAX_VARIANTS,
    scene::{GrownForm, PlantSource, Quality, Scene, Species},
};

/// How one individual is made.
#[derive(Clone, Debug)]
pub enum IndividualSource {
    /// By rule.
    Grown {
        /// The rules.
        parameters: Box<GrowParameters>,
        /// Where they come from, for messages.
        from: PathBuf,
        /// Seed of this individual.
        seed: u64,
        /// Triangles.
        triangles: usize,
    },
    /// From a file.
    Gltf {
        /// The file.
        path: PathBuf,
        /// How to read it.
        options: GltfOptions,
    },
}

impl IndividualSource {
    /// Makes the plant; the strings are warnings.
    ///
    /// # Errors
    /// [`AppError`] for rules or a file that cannot be used.
    pub fn build(&self) -> Result<(Plant, Vec<String>), AppError> {
        match self {
            Self::Grown { parameters, from, seed, triangles } => {
                let plant = grow(parameters, *seed, *triangles)
                    .map_err(|source| AppError::Grow { path: from.clone(), source })?;
                Ok((plant, Vec::new()))
            }
            Self::Gltf { path, options } => {
                let (plant, warnings) = load_plant(path, options)?;
                let warnings = warnings.iter().map(|warning| format!("{}: {warning}", path.display())).collect();
                Ok((plant, warnings))
            }
        }
    }
}

/// All individuals of a scene, and which belong to which species.
#[derive(Clone, Debug, Default)]
pub struct PlantPlan {
    /// One for each variant.
    pub sources: Vec<IndividualSource>,
    /// Variants of each of the scene's species.
    pub variants: Vec<Range<u16>>,
}

/// Lists the individuals of `scene`.
///
/// # Errors
/// [`AppError`] for species files that cannot be read, and for more individuals than a forest holds.
pub fn plan(scene: &Scene) -> Result<PlantPlan, AppError> {
    let mut plan = PlantPlan::default();
    for species in &scene.species {
        let first = plan.sources.len();
        add_individuals(species, &mut plan.sources)?;
        plan.variants.push(first as u16..plan.sources.len() as u16);
    }
    if plan.sources.len() > MAX_VARIANTS {
        return Err(AppError::TooManyPlants { count: plan.sources.len(), limit: MAX_VARIANTS });
    }
    Ok(plan)
}

fn add_individuals(species: &Species, sources: &mut Vec<IndividualSource>) -> Result<(), AppError> {
    match &species.plant {
        PlantSource::Grown(grown) => {
            let (parameters, from) = match &grown.form {
                GrownForm::Broadleaf => (GrowParameters::broadleaf(), "broadleaf".into()),
                GrownForm::Conifer => (GrowParameters::conifer(), "conifer".into()),
                GrownForm::File(path) => {
                    let text = std::fs::read_to_string(path)
                        .map_err(|source| AppError::Read { path: path.clone(), source })?;
                    let parameters = GrowParameters::from_ron(&text)
                        .map_err(|source| AppError::Grow { path: path.clone(), source })?;
                    (parameters, path.clone())
                }
            };
            sources.extend((0..grown.individuals).map(|individual| IndividualSource::Grown {
                parameters: Box::new(parameters.clone()),
                from: from.clone(),
                seed: grown.seed.wrapping_add(u64::from(individual)),
                triangles: grown.triangles as usize,
            }));
        }
        PlantSource::Gltf(files) => {
            let options = GltfOptions {
                height: Some(species.mean_height() as f32),
                foliage_materials: files.foliage.clone(),
                wood_materials: files.wood.clone(),
                ..GltfOptions::default()
            };
            sources.extend(
                files.files.iter().map(|path| IndividualSource::Gltf { path: path.clone(), options: options.clone() }),
            );
        }
    }
    Ok(())
}

/// Bake settings of a scene's quality.
pub fn bake_settings(quality: &Quality) -> BakeSettings {
    BakeSettings {
        cross: CrossSettings { resolution: quality.cross_resolution, ..CrossSettings::default() },
        ..BakeSettings::default()
    }
}
