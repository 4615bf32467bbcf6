//! Errors of the program: every cause in one type, each with its location and remedy.

use std::path::{Path, PathBuf};

use crate::assets::StageError;

/// Why the program cannot do what the user asked for.
#[derive(Debug, thiserror::Error)]
pub enum AppError {
    /// A scene that cannot be built.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The scene file.
    #[error(transparent)]
    Scene(#[from] crate::scene::SceneError),
    /// The terrain.
    #[error(transparent)]
    Terrain(#[from] crate::terrain::TerrainError),
    /// A plant's file.
    #[error(transparent)]
    Plant(#[from] crate::plant::gltf::PlantError),
    /// The stand.
    #[error(transparent)]
    Stand(#[from] crate::scatter::ScatterError),
    /// Sun and sky.
    #[error(transparent)]
    Light(#[from] crate::light::LightError),
    /// The request.
    #[error(transparent)]
    Plan(#[from] super::PlanError),
    /// Years or variants that cannot be shown side by side.
    #[error(transparent)]
    Beside(#[from] super::BesideError),
    /// The ground truth.
    #[error(transparent)]
    Reference(#[from] crate::reference::ReferenceError),
    /// A comparison of images.
    #[error(transparent)]
    Compare(#[from] super::CompareError),
    /// A scene that cannot be exported.
    #[error("{0}")]
    Export(String),
    /// Films that do not fit together.
    #[error(transparent)]
    Merge(#[from] super::MergeError),
    /// A profile.
    #[error(transparent)]
    Profile(#[from] super::ProfileError),
    /// An image that cannot be written.
    #[error("{}: {source}; choose a writable folder with --out", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// No graphics adapter.
    #[error(
        "no Vulkan driver was found{details}; install one for your graphics card, or the software driver (Debian, \
         Ubuntu: apt-get install libvulkan1 mesa-vulkan-drivers)"
    )]
    NoAdapter {
        /// The adapter that was searched for, with a leading blank.
        details: String,
    },
    /// The requested adapter does not exist.
    #[error("no graphics adapter has `{wanted}` in its name; available: {present} (see --list-adapters)")]
    UnknownAdapter {
        /// The requested name.
        wanted: String,
        /// Names of the available adapters.
        present: String,
    },
    /// The environment names another adapter than the request, and takes precedence.
    #[error(
        "WGPU_ADAPTER_NAME is set to `{environment}` and overrides --adapter `{wanted}`, which is {chosen}; unset \
         WGPU_ADAPTER_NAME"
    )]
    AdapterConflict {
        /// Value of the variable.
        environment: String,
        /// What the request asks for.
        wanted: String,
        /// Name of the adapter that the request means.
        chosen: String,
    },
    /// No display to open a window on.
    #[error(
        "no window can be opened: {details}; use `canopy render` to render images without a window, or use a virtual \
         display (xvfb-run canopy fly ...)"
    )]
    NoDisplay {
        /// What is missing.
        details: String,
    },
    /// An image that is too large for the device.
    #[error(
        "an image of {width}x{height} exceeds this device's limit of {limit} pixels per side; choose a smaller --size"
    )]
    TooLarge {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
        /// The device's limit.
        limit: u32,
    },
    /// The user interrupted the work: what was finished, and how to go on.
    #[error("{0}")]
    Interrupted(String),
    /// Some images of several failed; the others are finished.
    #[error("{failed} of {total} images failed, the first of them {}; {remedy}", of_file(file, source))]
    SomeFailed {
        /// How many failed.
        failed: usize,
        /// How many there are.
        total: usize,
        /// The first that failed.
        file: PathBuf,
        /// Why.
        source: Box<AppError>,
        /// What to do.
        remedy: &'static str,
    },
    /// Rendering failed.
    #[error("rendering failed: {0}")]
    Render(String),
    /// An image of a leaf that cannot be read.
    #[error("{}: {what}; give a PNG, JPEG or WebP image", path.display())]
    LeafImage {
        /// The file.
        path: PathBuf,
        /// The reason.
        what: String,
    },
    /// A plant without the leaf that was asked for.
    #[error("{}: has no such leaf; its materials of foliage: {names}", path.display())]
    NoLeaf {
        /// The file.
        path: PathBuf,
        /// Those that there are.
        names: String,
    },
    /// A file that is no plant.
    #[error("{}: this is not a plant; levels of detail are made of glTF files (.glb, .gltf)", path.display())]
    NoPlant {
        /// The file.
        path: PathBuf,
    },
    /// A file of unknown kind.
    #[error(
        "{}: this is not a plant (.glb, .gltf), terrain (.tif, .asc, .hgt, .vrt, .png), inventory (.csv, .tsv, .geojson, .json, \
         .shp, .gpkg) or scene (.ron) file",
        path.display()
    )]
    UnknownKind {
        /// The file.
        path: PathBuf,
    },
}

/// What [`AppError::SomeFailed`] says where `--resume` goes on.
pub(super) const RESUME: &str = "the same command with --resume renders these alone";

/// How a command on several files ends, of which `finished` are done: an error where any failed.
///
/// # Errors
/// [`AppError::SomeFailed`] with `remedy`; the first failure itself where nothing was finished.
pub(super) fn outcome(
    failures: Vec<(PathBuf, AppError)>,
    finished: usize,
    remedy: &'static str,
) -> Result<(), AppError> {
    let failed = failures.len();
    match failures.into_iter().next() {
        None => Ok(()),
        Some((_, error)) if finished == 0 => Err(error),
        Some((file, error)) => {
            let (total, source) = (finished + failed, Box::new(error));
            Err(AppError::SomeFailed { failed, total, file, source, remedy })
        }
    }
}

/// `error` with the name of `file` before it, unless it begins with it.
pub(super) fn of_file(file: &Path, error: &AppError) -> String {
    let (file, error) = (file.display().to_string(), error.to_string());
    if error.starts_with(&file) { error } else { format!("{file}: {error}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A full disk was told with the name of the image twice.
    #[test]
    fn a_file_is_named_once() {
        let file = PathBuf::from("out/0001.png");
        let write = AppError::Write { path: file.clone(), source: std::io::ErrorKind::StorageFull.into() };
        let render = AppError::Render("no device".to_owned());
        assert_eq!(of_file(&file, &render), "out/0001.png: rendering failed: no device");
        let some = AppError::SomeFailed { failed: 1, total: 3, file, source: Box::new(write), remedy: RESUME };
        let message = some.to_string();
        assert_eq!(message.matches("0001.png").count(), 1, "{message}");
        assert!(message.ends_with(RESUME), "{message}");
    }
}
