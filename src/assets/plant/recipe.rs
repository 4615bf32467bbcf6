//! The recipe of a plant: read, but not built yet.

use std::path::{Path, PathBuf};

use super::{Growth, PlantAsset, PlantSettings, StageError};
use crate::{
    assets::{
        background::Wanted,
        strokes::{StrokeFiles, draw_on},
    },
    plant::{
        Plant,
        gltf::{ExternalFiles, GltfOptions, load_plant_bytes},
        grow::{LeafPainting, Rules},
    },
    scene::{Lighting, Species},
};

/// A plant before it is built.
#[derive(Debug)]
pub struct Recipe {
    pub name: String,
    pub individuals: Vec<Individual>,
    pub settings: PlantSettings,
    pub growth: Growth,
    /// Strokes on its leaves.
    pub strokes: StrokeFiles,
    pub warnings: Vec<String>,
}

/// One individual before it is built.
#[derive(Debug)]
pub enum Individual {
    /// By rule.
    Grown {
        rules: Rules,
        /// The source of the rules, for messages.
        from: PathBuf,
        seed: u64,
        triangles: usize,
        /// The textures of its leaves.
        leaves: LeafPainting,
    },
    /// The bytes of a glTF file.
    Gltf { path: PathBuf, bytes: Vec<u8>, files: ExternalFiles, options: GltfOptions },
}

impl Individual {
    fn make(&self) -> Result<(Plant, Vec<String>), StageError> {
        match self {
            Self::Grown { rules, from, seed, triangles, leaves } => {
                let plant = rules
                    .grow(*seed, *triangles, *leaves)
                    .map_err(|source| StageError::Grow { path: from.clone(), source })?;
                Ok((plant, Vec::new()))
            }
            Self::Gltf { path, bytes, files, options } => {
                let (plant, warnings) = load_plant_bytes(bytes, path, files, options)?;
                Ok((plant, warnings.iter().map(ToString::to_string).collect()))
            }
        }
    }
}

impl Recipe {
    /// The plant of one glTF file.
    pub fn gltf(path: &Path, bytes: Vec<u8>, files: ExternalFiles, settings: &PlantSettings) -> Self {
        let name = path.file_stem().map_or_else(|| "plant".into(), |stem| stem.to_string_lossy().into_owned());
        Self {
            name,
            individuals: vec![Individual::Gltf {
                path: path.to_owned(),
                bytes,
                files,
                options: settings.gltf_options(),
            }],
            settings: settings.clone(),
            growth: Growth::default(),
            strokes: StrokeFiles::new(),
            warnings: Vec::new(),
        }
    }

    /// The plants of a species, `individuals`, whose own lighting and gloss replace those of `settings`.
    pub fn species(
        species: &Species,
        individuals: Vec<Individual>,
        strokes: StrokeFiles,
        settings: &PlantSettings,
    ) -> Self {
        let mut settings = PlantSettings { gloss: species.gloss.sanitized(), ..settings.clone() };
        settings.tissue = species.tissue.or(settings.tissue);
        if let Some(lighting) = &species.lighting {
            settings.bake.lighting = lighting.settings();
            settings.sun = lighting.sun();
        }
        let mut warnings = Vec::new();
        if matches!(&species.lighting, Some(Lighting::Expressive(expressive)) if expressive.together) {
            let what =
                "`together` has no effect: the trees of a plant asset are lit one by one; use it in a scene file";
            warnings.push(what.to_owned());
        }
        let growth = Growth {
            heights: Some(species.height),
            elevation: species.elevation,
            slope_limit: species.slope_limit,
            trunk_radius: species.trunk_radius,
        };
        Self { name: species.name.clone(), individuals, settings, growth, strokes, warnings }
    }

    /// Builds and bakes the plant.
    pub fn bake(self, wanted: &Wanted) -> Result<PlantAsset, StageError> {
        let make = |individual: &Individual| {
            let (mut plant, mut warnings) = individual.make()?;
            warnings.extend(draw_on(&mut plant, &self.strokes));
            Ok::<_, StageError>((plant, warnings))
        };
        let plants = self.individuals.iter().map(make).collect::<Result<_, _>>()?;
        let mut asset = PlantAsset::baked(self.name, plants, &self.settings, &|| wanted.is_wanted());
        if asset.individuals.len() < self.individuals.len() {
            return Err(StageError::Cancelled);
        }
        asset.growth = self.growth;
        asset.warnings.splice(0..0, self.warnings);
        Ok(asset)
    }
}
