//! The plants of a scene's species: their individuals, and how each is built.

use std::{
    ops::Range,
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{
    StageError,
    strokes::{StrokeFiles, draw_on},
};
use crate::{
    bake::{
        BakeSettings,
        levels::{LevelSet, cross::CrossSettings},
        lighting::LightingSettings,
    },
    plant::{
        Gloss, LeafStrokes, LeafTissue, Plant,
        gltf::{GltfOptions, load_plant, trees_of},
        grow::{GrowParameters, LeafPainting, Rules},
    },
    scatter::packed::MAX_VARIANTS,
    scene::{GrownForm, Lighting, PlantSource, Quality, Scene, Species},
};

/// The source of one individual.
#[derive(Clone, Debug)]
pub enum IndividualSource {
    /// By rule.
    Grown {
        /// The rules.
        rules: Rules,
        /// The source of the rules, for messages.
        from: PathBuf,
        /// Seed of this individual.
        seed: u64,
        /// Number of triangles.
        triangles: usize,
        /// The textures of its leaves.
        leaves: LeafPainting,
    },
    /// From a file.
    Gltf {
        /// The file.
        path: PathBuf,
        /// How to read it.
        options: GltfOptions,
        /// What the user is told of the choice.
        note: Option<String>,
    },
}

impl IndividualSource {
    /// Builds the plant; the strings are warnings.
    ///
    /// # Errors
    /// [`StageError`] for rules or a file that cannot be used.
    pub fn build(&self) -> Result<(Plant, Vec<String>), StageError> {
        match self {
            Self::Grown { rules, from, seed, triangles, leaves } => {
                let plant = rules
                    .grow(*seed, *triangles, *leaves)
                    .map_err(|source| StageError::Grow { path: from.clone(), source })?;
                Ok((plant, Vec::new()))
            }
            Self::Gltf { path, options, note } => {
                let (plant, warnings) = load_plant(path, options)?;
                let told = note.iter().cloned().chain(warnings.iter().map(ToString::to_string));
                Ok((plant, told.map(|what| format!("{}: {what}", path.display())).collect()))
            }
        }
    }
}

/// One individual of a species.
#[derive(Clone, Debug)]
pub struct Individual {
    /// Where it comes from.
    pub source: IndividualSource,
    /// The gloss of its leaves.
    pub gloss: Gloss,
    /// The tissue of its leaves; `None` leaves it as the source has it.
    pub tissue: Option<LeafTissue>,
    /// Strokes on its leaves, with the names of their files.
    pub strokes: StrokeFiles,
    /// How its foliage is lit.
    pub lighting: LightingSettings,
}

impl Individual {
    /// Builds the plant with its gloss; the strings are warnings.
    ///
    /// # Errors
    /// Those of [`IndividualSource::build`].
    pub fn build(&self) -> Result<(Plant, Vec<String>), StageError> {
        let (mut plant, mut warnings) = self.source.build()?;
        plant.set_leaf_gloss(self.gloss);
        if let Some(tissue) = self.tissue {
            plant.set_leaf_tissue(tissue);
        }
        warnings.extend(draw_on(&mut plant, &self.strokes));
        Ok((plant, warnings))
    }
}

/// The strokes of a species.
fn strokes(species: &Species) -> Result<StrokeFiles, StageError> {
    let read = |file: &PathBuf| Ok((file.clone(), Arc::new(LeafStrokes::read(file)?)));
    species.strokes.iter().map(read).collect()
}

/// All individuals of a scene, and the species that they belong to.
#[derive(Clone, Debug, Default)]
pub struct PlantPlan {
    /// One for each variant.
    pub individuals: Vec<Individual>,
    /// Variants of each of the scene's species.
    pub variants: Vec<Range<u16>>,
}

/// Lists the individuals of `scene`.
///
/// # Errors
/// [`StageError`] for species files that cannot be read, and for more individuals than a forest holds.
pub fn plan(scene: &Scene) -> Result<PlantPlan, StageError> {
    let mut plan = PlantPlan::default();
    for species in &scene.species {
        let first = plan.individuals.len();
        let lighting = species.lighting.as_ref().map_or_else(LightingSettings::default, Lighting::settings);
        let gloss = species.gloss.sanitized();
        let tissue = species.tissue;
        let strokes = strokes(species)?;
        let individual = |source| Individual { source, gloss, tissue, strokes: strokes.clone(), lighting };
        let individuals = sources(species, gloss)?.into_iter().map(individual);
        plan.individuals.extend(individuals);
        plan.variants.push(first as u16..plan.individuals.len() as u16);
    }
    if plan.individuals.len() > MAX_VARIANTS {
        return Err(StageError::TooManyPlants { count: plan.individuals.len(), limit: MAX_VARIANTS });
    }
    Ok(plan)
}

fn sources(species: &Species, gloss: Gloss) -> Result<Vec<IndividualSource>, StageError> {
    Ok(match &species.plant {
        PlantSource::Grown(grown) => {
            let (mut rules, from) = match &grown.form {
                GrownForm::Broadleaf => (Rules::Tree(GrowParameters::broadleaf().into()), "broadleaf".into()),
                GrownForm::Conifer => (Rules::Tree(GrowParameters::conifer().into()), "conifer".into()),
                GrownForm::File(path) => {
                    let text = std::fs::read_to_string(path)
                        .map_err(|source| StageError::Read { path: path.clone(), source })?;
                    let parameters = GrowParameters::from_ron(&text)
                        .map_err(|source| StageError::Grow { path: path.clone(), source })?;
                    (Rules::Tree(parameters.into()), path.clone())
                }
                GrownForm::House(plant) => (Rules::House(plant.clone()), plant.name().into()),
            };
            if let (Rules::Tree(parameters), Some(leaf)) = (&mut rules, species.leaf) {
                parameters.leaves.transmission = leaf.transmission().to_array();
            }
            (0..grown.individuals)
                .map(|individual| IndividualSource::Grown {
                    rules: rules.clone(),
                    from: from.clone(),
                    seed: grown.seed.wrapping_add(u64::from(individual)),
                    triangles: grown.triangles as usize,
                    leaves: LeafPainting::of(species.tissue),
                })
                .collect()
        }
        PlantSource::Gltf(files) => {
            let options = GltfOptions {
                height: Some(species.mean_height() as f32),
                foliage_materials: files.foliage.clone(),
                wood_materials: files.wood.clone(),
                up: files.up,
                node: files.node.clone(),
                ignore: files.ignore.clone(),
                leaf: species.leaf.unwrap_or_default(),
                gloss: Some(gloss),
                ..GltfOptions::default()
            };
            files.files.iter().flat_map(|path| individuals(path, &options)).collect()
        }
    })
}

/// The individuals of a file: one, or each of several trees that stand side by side in it.
fn individuals(path: &Path, options: &GltfOptions) -> Vec<IndividualSource> {
    let trees = if options.node.is_empty() { trees_of(path, options) } else { Vec::new() };
    if trees.is_empty() {
        return vec![IndividualSource::Gltf { path: path.to_owned(), options: options.clone(), note: None }];
    }
    let note = format!("its {} trees side by side are individuals of their own: {}", trees.len(), trees.join(", "));
    let mut note = Some(note);
    let individual = |name: String| IndividualSource::Gltf {
        path: path.to_owned(),
        options: GltfOptions { node: vec![name.clone()], name: Some(name), ..options.clone() },
        // Told once.
        note: note.take(),
    };
    trees.into_iter().map(individual).collect()
}

/// Layers of a texture array on most devices, of which a plane of a cross takes two.
const LAYERS: usize = 2048;

/// Upright planes of each cross, so that the crosses of `plants` plants have at most as many planes as devices have layers for, less
/// those that `others` have already.
pub fn affordable_planes(wanted: u32, plants: usize, others: usize) -> u32 {
    let each = (LAYERS / 2).saturating_sub(others) / plants.max(1);
    wanted.min(u32::try_from(each).unwrap_or(u32::MAX).saturating_sub(1)).max(1)
}

/// Bake settings for a scene's quality and a species' lighting. What is drawn by default is always baked; other
/// representations only for a scene that draws them. `uprights`: planes of its crosses.
pub fn bake_settings(quality: &Quality, lighting: LightingSettings, uprights: u32) -> BakeSettings {
    let drawn = quality.lod_levels().representations().to_vec();
    let representations = LevelSet::default().iter().chain(drawn).collect();
    BakeSettings {
        representations,
        lighting,
        cross: CrossSettings { uprights, resolution: quality.cross_resolution, ..CrossSettings::default() },
        ..BakeSettings::default()
    }
}

#[cfg(test)]
mod tests {
    use super::affordable_planes;

    #[test]
    fn many_plants_have_crosses_of_fewer_planes() {
        let planes = |plants, others| affordable_planes(4, plants, others);
        assert_eq!([1, 204, 205, 256, 257, 341, 342, 5000].map(|plants| planes(plants, 0)), [4, 4, 3, 3, 2, 2, 1, 1]);
        assert_eq!((planes(0, 0), planes(100, 524), planes(100, 525), planes(1, 9999)), (4, 4, 3, 1));
    }
}
