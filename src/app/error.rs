//! What can stop the program: every cause in one type, each with its own place and remedy.

use std::path::PathBuf;

/// Why a scene cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum AppError {
    /// The scene file.
    #[error(transparent)]
    Scene(#[from] crate::scene::SceneError),
    /// The request.
    #[error(transparent)]
    Plan(#[from] crate::scene::PlanError),
    /// The terrain.
    #[error(transparent)]
    Terrain(#[from] crate::terrain::TerrainError),
    /// A plant's file.
    #[error(transparent)]
    Plant(#[from] crate::plant::gltf::PlantError),
    /// A grown species.
    #[error("{}: {source}", path.display())]
    Grow {
        /// The species file, or the preset's name.
        path: PathBuf,
        /// What is wrong.
        source: crate::plant::grow::GrowError,
    },
    /// The stand.
    #[error(transparent)]
    Stand(#[from] crate::scatter::ScatterError),
    /// Sun and sky.
    #[error(transparent)]
    Light(#[from] crate::light::LightError),
    /// The ground truth.
    #[error(transparent)]
    Reference(#[from] crate::reference::ReferenceError),
    /// A file that cannot be read.
    #[error("{}: {source}; check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
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
    /// A scene that nobody waits for any more.
    #[error("the scene was given up before it was ready")]
    Cancelled,
    /// A scene that could not be built beside the program.
    #[error("the scene could not be built: {0}")]
    Background(String),
    /// Rendering failed.
    #[error("rendering failed: {0}")]
    Render(String),
    /// Too many plants for one forest.
    #[error(
        "the scene's species have {count} individuals together, but a forest holds at most {limit}; lower `individuals`"
    )]
    TooManyPlants {
        /// Individuals.
        count: usize,
        /// Most there can be.
        limit: usize,
    },
    /// More trees that are lit together than a forest can tell apart.
    #[error(
        "{count} trees are to be lit together, but beside the scene's other plants a forest holds at most {limit} such \
         trees; place fewer, or take `together` out of their species' lighting"
    )]
    TooManyTogether {
        /// Trees.
        count: usize,
        /// Most there can be.
        limit: usize,
    },
    /// More trees than the device's largest buffer holds.
    #[error(
        "the scene has {count} trees, but this device holds at most {limit}; lower the stems per hectare, take a \
         smaller area or inventory, or choose another device with --adapter (see --list-adapters)"
    )]
    TooManyTrees {
        /// Trees of the stand.
        count: usize,
        /// The most that the device holds.
        limit: usize,
    },
    /// Nobody knows where on earth the scene lies.
    #[error("{scene}: the terrain does not say where on earth it lies; add `place: (latitude: ..., longitude: ...)`")]
    NoPlace {
        /// The scene file, or what names a scene that was built in code.
        scene: String,
    },
    /// An inventory whose coordinates say nothing about where it lies on the terrain.
    #[error(
        "{}: the terrain has no coordinate system of the kind that these positions are in; use a terrain file of the \
         same system, or metres and `anchor: Middle`",
        path.display()
    )]
    NoReference {
        /// The inventory.
        path: PathBuf,
    },
    /// A file of unknown kind.
    #[error(
        "{}: this is no plant (.glb, .gltf), terrain (.tif, .asc, .hgt, .png), inventory (.csv) or scene (.ron) file",
        path.display()
    )]
    UnknownKind {
        /// The file.
        path: PathBuf,
    },
}
