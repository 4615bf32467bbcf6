//! Why a forest cannot be built.

use bevy::ecs::entity::Entity;

use crate::assets::StageError;

/// Why a [`Forest3d`](super::Forest3d) cannot be built.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ForestError {
    /// It has no species.
    #[error("the forest has no species; add one, as in `Forest3d::scatter(300.0).of(plant, 1.0)`")]
    NoSpecies,
    /// A plant's asset cannot be loaded. The text names the file, the position in it and the remedy.
    #[error("{0}")]
    Plant(String),
    /// A plant's asset has no individuals.
    #[error("the plant `{0}` has no individuals; give it at least one")]
    EmptyPlant(String),
    /// The entity that it should stand on is not a terrain.
    #[error(
        "the forest stands on the entity {0}, which has no `Terrain3d`; give it one, or leave `on` out for level ground"
    )]
    NoTerrain(Entity),
    /// The map of its terrain cannot be loaded. The text names the file, the position in it and the remedy.
    #[error("{0}")]
    Terrain(String),
    /// The trees cannot be placed.
    #[error(transparent)]
    Trees(#[from] StageError),
}
