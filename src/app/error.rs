//! What can stop the program: every cause in one type, each with its own place and remedy.

use std::path::PathBuf;

use crate::assets::StageError;

/// Why the program cannot do what it was asked for.
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
    /// The ground truth.
    #[error(transparent)]
    Reference(#[from] crate::reference::ReferenceError),
    /// A picture that cannot be written.
    #[error("{}: {source}; choose a folder that can be written, with --out", path.display())]
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
        /// What was looked for, with a leading comma or blank.
        details: String,
    },
    /// The adapter that was asked for is not there.
    #[error("no graphics adapter has a name with `{wanted}` in it; there are: {present} (see --list-adapters)")]
    UnknownAdapter {
        /// What was asked for.
        wanted: String,
        /// Names of those that are there.
        present: String,
    },
    /// The environment names another adapter than the request, and has the last word.
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
        "no window can be opened: {details}; use `canopy render` for pictures without one, or run this in a virtual \
         display (xvfb-run canopy fly ...)"
    )]
    NoDisplay {
        /// What is missing.
        details: String,
    },
    /// A picture that the device cannot hold.
    #[error(
        "a picture of {width}x{height} is beyond this device's limit of {limit} pixels a side; choose a smaller --size"
    )]
    TooLarge {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
        /// The device's limit.
        limit: u32,
    },
    /// Rendering failed.
    #[error("rendering failed: {0}")]
    Render(String),
    /// A file of unknown kind.
    #[error(
        "{}: this is not a plant (.glb, .gltf), terrain (.tif, .asc, .hgt, .png), inventory (.csv) or scene (.ron) file",
        path.display()
    )]
    UnknownKind {
        /// The file.
        path: PathBuf,
    },
}
