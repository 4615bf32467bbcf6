//! Loads plants through Bevy's asset sources: folders, archives, the executable itself.

use std::{
    io,
    path::{Path, PathBuf},
    sync::Arc,
};

use bevy::{
    asset::{AssetLoader, LoadContext, io::Reader},
    reflect::TypePath,
};
use tracing::warn;

use super::{
    PlantAsset, PlantSettings, StageError,
    recipe::{Individual, Recipe},
};
use crate::{
    assets::{background, read, strokes::StrokeFiles},
    plant::{
        LeafStrokes,
        gltf::{ExternalFiles, GltfOptions, external_files},
        grow::{GrowParameters, LeafPainting, Rules},
    },
    scene::{GrownForm, PlantSource, Species},
};

/// Loads [`PlantAsset`]s: glTF files (.glb, .gltf) and species files (.species.ron).
///
/// A species file has its own lighting, gloss and kind of leaf; the other bake values of [`PlantSettings`] apply to it
/// too. The loader is registered only for the ending `species.ron`, because `glb` belongs to Bevy's own loader; any
/// file can be loaded as a [`PlantAsset`] by its type.
#[derive(Clone, Copy, Debug, Default, TypePath)]
pub struct PlantLoader;

impl AssetLoader for PlantLoader {
    type Asset = PlantAsset;
    type Settings = PlantSettings;
    type Error = StageError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        settings: &PlantSettings,
        context: &mut LoadContext<'_>,
    ) -> Result<PlantAsset, StageError> {
        let path = context.path().path().to_owned();
        let bytes = read::all(reader, &path).await?;
        let recipe = if crate::files::ends_in(&path, &["ron"]) {
            species(&bytes, &path, settings, context).await?
        } else {
            let files = files_of(&bytes, &path, context).await?;
            Recipe::gltf(&path, bytes, files, settings)
        };
        let plant = background::start(move |wanted| recipe.bake(wanted)).await??;
        for warning in &plant.warnings {
            warn!("{}: {warning}", context.path());
        }
        Ok(plant)
    }

    fn extensions(&self) -> &[&str] {
        &["species.ron"]
    }
}

/// The species of a file, with all files that it names.
async fn species(
    bytes: &[u8],
    path: &Path,
    settings: &PlantSettings,
    context: &mut LoadContext<'_>,
) -> Result<Recipe, StageError> {
    let species = Species::parse(&text(bytes, path)?, path)?;
    let individuals = match &species.plant {
        PlantSource::Grown(grown) => {
            let (mut rules, from) = match &grown.form {
                GrownForm::Broadleaf => (Rules::Tree(GrowParameters::broadleaf().into()), path.to_owned()),
                GrownForm::Conifer => (Rules::Tree(GrowParameters::conifer().into()), path.to_owned()),
                GrownForm::File(file) => {
                    let bytes = read::beside(context, file).await.map_err(|source| unreadable(file, source))?;
                    let parameters = GrowParameters::from_ron(&text(&bytes, file)?)
                        .map_err(|source| StageError::Grow { path: file.clone(), source })?;
                    (Rules::Tree(parameters.into()), file.clone())
                }
                GrownForm::House(plant) => (Rules::House(plant.clone()), path.to_owned()),
            };
            if let (Rules::Tree(parameters), Some(leaf)) = (&mut rules, species.leaf) {
                parameters.leaves.transmission = leaf.transmission().to_array();
            }
            let individual = |number: u32| Individual::Grown {
                rules: rules.clone(),
                from: from.clone(),
                seed: grown.seed.wrapping_add(u64::from(number)),
                triangles: grown.triangles as usize,
                leaves: LeafPainting::of(species.tissue),
            };
            (0..grown.individuals).map(individual).collect()
        }
        PlantSource::Gltf(plants) => {
            let mut individuals = Vec::with_capacity(plants.files.len());
            for file in &plants.files {
                let bytes = read::beside(context, file).await.map_err(|source| unreadable(file, source))?;
                let files = files_of(&bytes, file, context).await?;
                let options = GltfOptions {
                    height: Some(species.mean_height() as f32),
                    foliage_materials: plants.foliage.clone(),
                    wood_materials: plants.wood.clone(),
                    up: plants.up,
                    node: plants.node.clone(),
                    ignore: plants.ignore.clone(),
                    leaf: species.leaf.unwrap_or(settings.leaf),
                    gloss: Some(species.gloss.sanitized()),
                    ..settings.gltf_options()
                };
                individuals.push(Individual::Gltf { path: file.clone(), bytes, files, options });
            }
            individuals
        }
    };
    let mut strokes = StrokeFiles::new();
    for file in &species.strokes {
        let bytes = read::beside(context, file).await.map_err(|source| unreadable(file, source))?;
        let read = LeafStrokes::parse(&text(&bytes, file)?, &file.display().to_string())?;
        strokes.push((file.clone(), Arc::new(read)));
    }
    Ok(Recipe::species(&species, individuals, strokes, settings))
}

/// The files that the glTF file `path` names. An unreadable file is not an error yet: it may be a texture.
async fn files_of(bytes: &[u8], path: &Path, context: &mut LoadContext<'_>) -> Result<ExternalFiles, StageError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut files = ExternalFiles::new();
    for name in external_files(bytes, path)? {
        let bytes = read::beside(context, &folder.join(&name)).await;
        files.insert(name, bytes.map_err(|error| error.to_string()));
    }
    Ok(files)
}

fn unreadable(path: &Path, source: io::Error) -> StageError {
    StageError::Read { path: path.to_owned(), source }
}

fn text(bytes: &[u8], path: &Path) -> Result<String, StageError> {
    let text = std::str::from_utf8(bytes);
    let text =
        text.map_err(|error| unreadable(&PathBuf::from(path), io::Error::new(io::ErrorKind::InvalidData, error)));
    Ok(text?.to_owned())
}
