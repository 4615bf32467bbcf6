//! Scene files as Bevy assets.

use std::{io, path::PathBuf};

use bevy::{
    asset::{
        Asset, AssetLoader, LoadContext,
        io::{AssetSourceId, Reader},
    },
    reflect::TypePath,
};

use super::{StageError, read};
use crate::scene::Scene;

/// A scene file, read and checked but not built yet, which takes longer.
///
/// `assets.load::<SceneAsset>("forest.canopy.ron")`; any `.ron` can be loaded by the asset's type. The files that the
/// scene names are not read here: the build reads them from the file system. Its relative paths, which are relative to
/// the scene file, lead through the folder of assets where the scene is in the default asset source; in any other
/// source they are relative to the working directory.
#[derive(Asset, TypePath, Clone, Debug, PartialEq)]
pub struct SceneAsset {
    /// The scene, its paths ready to open.
    pub scene: Scene,
}

impl From<Scene> for SceneAsset {
    fn from(scene: Scene) -> Self {
        Self { scene }
    }
}

/// Loads [`SceneAsset`]s.
#[derive(Clone, Debug, Default, TypePath)]
pub struct SceneLoader {
    /// The folder that the default asset source reads.
    pub folder: PathBuf,
}

impl AssetLoader for SceneLoader {
    type Asset = SceneAsset;
    type Settings = ();
    type Error = StageError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        (): &(),
        context: &mut LoadContext<'_>,
    ) -> Result<SceneAsset, StageError> {
        let mut path = context.path().path().to_owned();
        let bytes = read::all(reader, &path).await?;
        if *context.path().source() == AssetSourceId::Default {
            path = self.folder.join(path);
        }
        let text = std::str::from_utf8(&bytes).map_err(|error| StageError::Read {
            path: path.clone(),
            source: io::Error::new(io::ErrorKind::InvalidData, error),
        })?;
        Ok(Scene::parse(text, &path)?.into())
    }

    fn extensions(&self) -> &[&str] {
        &["canopy.ron"]
    }
}
