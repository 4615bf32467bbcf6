//! Which forests are on the device, told to the main world: what depends on the trees that are seen follows them.

use std::sync::{Arc, Mutex, PoisonError};

use bevy::ecs::{entity::Entity, resource::Resource};

use crate::{bake::BakedPlant, scatter::PackedStand};

/// The trees that are drawn for a forest's entity. They are not those of its component while these arrive over several
/// frames.
#[derive(Clone, Debug)]
pub struct DrawnForest {
    /// The entity in the main world.
    pub entity: Entity,
    /// The trees.
    pub stand: Arc<PackedStand>,
    /// Their plants, by variant.
    pub plants: Arc<Vec<BakedPlant>>,
}

/// The forests that the last frame drew, shared between the main and the render world.
#[derive(Resource, Clone, Debug, Default)]
pub struct DrawnForests(Arc<Mutex<Vec<DrawnForest>>>);

impl DrawnForests {
    /// Those of the last frame, in the order of their entities.
    pub fn get(&self) -> Vec<DrawnForest> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Replaces them.
    pub(super) fn set(&self, mut drawn: Vec<DrawnForest>) {
        drawn.sort_by_key(|forest| forest.entity);
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = drawn;
    }
}
