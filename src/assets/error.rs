//! Errors of building a scene: every cause in one type, each with its location and remedy.

use std::path::PathBuf;

use super::background::BackgroundError;
use crate::scene::Anchor;

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
    /// Strokes on leaves.
    #[error(transparent)]
    Strokes(#[from] crate::plant::strokes::StrokesError),
    /// The stand.
    #[error(transparent)]
    Stand(#[from] crate::scatter::ScatterError),
    /// The palette of the style.
    #[error(transparent)]
    Palette(#[from] crate::style::PaletteError),
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
    /// The scene's location on earth is unknown.
    #[error("{scene}: the terrain has no location on earth; add `place: (latitude: ..., longitude: ...)`")]
    NoPlace {
        /// The scene file, or the label of a scene that was built in code.
        scene: String,
    },
    /// An inventory whose coordinates cannot be related to the terrain.
    #[error(
        "{}: {problem}; use a terrain file with the same system, state the system of the terrain or the `place` of a \
         terrain without one, or put the stand on the terrain's centre with `anchor: StandCentre`",
        path.display()
    )]
    NoReference {
        /// The inventory.
        path: PathBuf,
        /// Why its positions cannot be related to the terrain.
        problem: &'static str,
    },
    /// An inventory without any tree on the terrain.
    #[error(
        "{}: none of its {count} trees stands on the terrain: they are at {:.0} to {:.0} m east and {:.0} to {:.0} m \
         north of the terrain's centre, and the terrain is {:.0} m x {:.0} m{}; {}, or correct the inventory's coordinates (see \
         `canopy info`), or take the terrain of this place",
        path.display(), east.0, east.1, north.0, north.1, terrain[0], terrain[1], covers.as_deref().unwrap_or(""), anchors(fits)
    )]
    InventoryOutside {
        /// The inventory.
        path: PathBuf,
        /// Its trees.
        count: usize,
        /// Least and greatest distance of a tree from the terrain's centre, metres east.
        east: (f64, f64),
        /// The same in metres north.
        north: (f64, f64),
        /// Size of the terrain from west to east and from north to south, metres.
        terrain: [f64; 2],
        /// Both extents in the coordinates of their files, where these are of one kind.
        covers: Option<Box<str>>,
        /// Anchors with which the trees would stand on the terrain.
        fits: Box<[Anchor]>,
    },
    /// Too many plants for one forest.
    #[error(
        "the scene's species have {count} individuals in total, but a forest holds at most {limit}; lower `individuals`"
    )]
    TooManyPlants {
        /// Individuals.
        count: usize,
        /// Maximum number.
        limit: usize,
    },
    /// More trees that are lit together than a forest has variants for.
    #[error(
        "{count} trees are to be lit together, but besides the scene's other plants a forest holds at most {limit} such \
         trees; place fewer, or take `together` out of their species' lighting"
    )]
    TooManyTogether {
        /// Trees.
        count: usize,
        /// Maximum number.
        limit: usize,
    },
    /// More trees than the device's largest buffer holds.
    #[error(
        "the scene asks for {count} trees, but this device holds at most {limit}; lower the stems per hectare, take a \
         smaller area or inventory, or choose another device (canopy: --adapter, see --list-adapters)"
    )]
    TooManyTrees {
        /// Trees of the stand; before it is built, an estimate.
        count: usize,
        /// Maximum number that the device holds.
        limit: usize,
    },
    /// A cancelled build.
    #[error("the build of the scene was cancelled")]
    Cancelled,
    /// A scene that could not be built in the background.
    #[error("the scene could not be built: {0}")]
    Background(String),
}

/// Which anchors would fit, for messages.
pub(super) fn anchors(fits: &[Anchor]) -> String {
    match fits {
        [] => "no other `anchor` would put them there".to_owned(),
        fits => {
            let names: Vec<String> = fits.iter().map(|anchor| format!("`anchor: {anchor:?}`")).collect();
            format!("they would stand on it with {}", names.join(" or "))
        }
    }
}

impl From<BackgroundError> for StageError {
    fn from(error: BackgroundError) -> Self {
        Self::Background(error.to_string())
    }
}
