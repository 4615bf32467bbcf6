//! The order of Canopy's work in the main world, as public system sets.

use bevy::ecs::schedule::SystemSet;

/// The steps of a frame in the main world.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CanopySystems {
    /// Scenes, terrains and forests that are ready are added to the world, in `First`.
    Load,
    /// Clocks run, in `PreUpdate`.
    Clock,
    /// Terrains and forests follow their components and assets, in `PostUpdate`, after transforms are propagated.
    Forests,
    /// Light, exposure and the directional lights that follow the sun, in `PostUpdate`, before transforms are
    /// propagated.
    Light,
    /// The origin of the Bevy world follows the camera, in `PostUpdate`, before transforms are propagated.
    Origin,
}
