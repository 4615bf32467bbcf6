//! Why a scene cannot be built: every cause in one type, each with its own place and remedy.

use std::path::PathBuf;

/// Why a scene cannot be built or shown.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// The scene file.
    #[error(transparent)]
    Scene(#[from] crate::scene::SceneError),
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
    /// A file that cannot be read.
    #[error("{}: {source}; check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
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
         same system, or metres and `anchor: StandCentre`",
        path.display()
    )]
    NoReference {
        /// The inventory.
        path: PathBuf,
    },
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
         smaller area or inventory, or choose another device (canopy: --adapter, see --list-adapters)"
    )]
    TooManyTrees {
        /// Trees of the stand.
        count: usize,
        /// The most that the device holds.
        limit: usize,
    },
    /// A scene that nobody waits for any more.
    #[error("the scene was given up before it was ready")]
    Cancelled,
    /// A scene that could not be built beside the program.
    #[error("the scene could not be built: {0}")]
    Background(String),
}
