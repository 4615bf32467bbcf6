//! The source of a scene: a file or a value.

use std::{
    fmt,
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{Scene, SceneError};

/// The source of a scene: a file to read, or an existing scene.
#[derive(Clone, Debug, PartialEq, bevy::reflect::Reflect)]
pub enum SceneSource {
    /// A scene file.
    File(PathBuf),
    /// A scene that was built in code or read before. Reflection takes it as one value.
    Value(Arc<Scene>),
}

impl SceneSource {
    /// The scene, read from its file if it is a file.
    ///
    /// # Errors
    /// Those of [`Scene::read`].
    pub fn read(&self) -> Result<Scene, SceneError> {
        match self {
            Self::File(path) => Scene::read(path),
            Self::Value(scene) => Ok(scene.as_ref().clone()),
        }
    }

    /// The scene file; `None` for a scene that was built in code.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::File(path) => Some(path),
            Self::Value(scene) => scene.file.as_deref(),
        }
    }
}

impl Default for SceneSource {
    /// A file without a name, which cannot be read.
    fn default() -> Self {
        Self::File(PathBuf::new())
    }
}

impl fmt::Display for SceneSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => path.display().fmt(f),
            Self::Value(scene) => f.write_str(&scene.label()),
        }
    }
}

impl From<PathBuf> for SceneSource {
    fn from(path: PathBuf) -> Self {
        Self::File(path)
    }
}

impl From<&Path> for SceneSource {
    fn from(path: &Path) -> Self {
        Self::File(path.to_owned())
    }
}

impl From<&str> for SceneSource {
    fn from(path: &str) -> Self {
        Self::File(path.into())
    }
}

impl From<String> for SceneSource {
    fn from(path: String) -> Self {
        Self::File(path.into())
    }
}

impl From<Scene> for SceneSource {
    fn from(scene: Scene) -> Self {
        Self::Value(Arc::new(scene))
    }
}

impl From<Arc<Scene>> for SceneSource {
    fn from(scene: Arc<Scene>) -> Self {
        Self::Value(scene)
    }
}
