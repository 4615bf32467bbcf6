//! The ground as a component.

use std::{collections::HashSet, sync::Arc};

use bevy::{
    asset::{AssetEvent, AssetId, AssetLoadFailedEvent, Assets, Handle},
    camera::visibility::Visibility,
    ecs::{
        change_detection::DetectChanges,
        component::Component,
        entity::Entity,
        event::EntityEvent,
        lifecycle::RemovedComponents,
        message::MessageReader,
        reflect::ReflectComponent,
        system::{Commands, Query, Res},
        world::Ref,
    },
    reflect::{Reflect, std_traits::ReflectDefault},
    transform::components::Transform,
};
use tracing::error;

use crate::{
    assets::{TerrainMap, load_error::load_error},
    render::components::{Ground, GroundDrape},
};

/// The ground of a [`TerrainMap`]; a [`GroundDrape`] on the same entity is a photograph over it. Once the map is loaded, the entity gets the renderer's [`Ground`], and
/// [`TerrainReady`] is triggered on it. Another map, or a changed one, replaces the previous map when it is loaded.
#[derive(Component, Clone, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Default)]
#[require(Transform, Visibility, TerrainSettings)]
pub struct Terrain3d(pub Handle<TerrainMap>);

/// How the ground is drawn.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Default)]
pub struct TerrainSettings {
    /// Maximum distance in pixels between the drawn and the true surface, 0.25 to 32. Lower: more triangles.
    pub error_pixels: f64,
    /// Distance in metres to which the ground is drawn, its mirrored surroundings included.
    pub view_distance: f64,
}

impl Default for TerrainSettings {
    fn default() -> Self {
        Self { error_pixels: 1.0, view_distance: 20_000.0 }
    }
}

/// A [`Terrain3d`] is shown, or shown again with another map. Triggered on its entity.
#[derive(EntityEvent, Clone, Copy, Debug, PartialEq, Eq)]
pub struct TerrainReady {
    /// The terrain.
    pub entity: Entity,
}

/// The map of a [`Terrain3d`] cannot be loaded; the previous one stays. Triggered on its entity, and logged.
#[derive(EntityEvent, Clone, Debug, PartialEq, Eq)]
pub struct TerrainFailed {
    /// The terrain.
    pub entity: Entity,
    /// What is wrong, in which file, and the remedy.
    pub error: String,
}

/// Updates the [`Ground`] of each terrain.
pub fn show_terrains(
    mut commands: Commands,
    terrains: Query<(Entity, Ref<Terrain3d>, Ref<TerrainSettings>, Option<&GroundDrape>, Option<&Ground>)>,
    maps: Res<Assets<TerrainMap>>,
    mut events: MessageReader<AssetEvent<TerrainMap>>,
    mut failures: MessageReader<AssetLoadFailedEvent<TerrainMap>>,
    mut removed: RemovedComponents<Terrain3d>,
) {
    for entity in removed.read().filter(|entity| !terrains.contains(*entity)) {
        if let Ok(mut entity) = commands.get_entity(entity) {
            entity.try_remove::<Ground>();
        }
    }
    let (mut changed, mut gone) = (HashSet::<AssetId<TerrainMap>>::new(), HashSet::new());
    for event in events.read() {
        match event {
            AssetEvent::Added { id } | AssetEvent::Modified { id } => drop(changed.insert(*id)),
            AssetEvent::Removed { id } => drop(gone.insert(*id)),
            AssetEvent::Unused { .. } | AssetEvent::LoadedWithDependencies { .. } => {}
        }
    }
    for failure in failures.read() {
        for (entity, ..) in terrains.iter().filter(|(_, terrain, ..)| terrain.0.id() == failure.id) {
            let error = load_error(&failure.error);
            error!("the terrain {entity} cannot be shown: {error}");
            commands.trigger(TerrainFailed { entity, error });
        }
    }
    for (entity, terrain, settings, drape, ground) in &terrains {
        let id = terrain.0.id();
        let Some(map) = maps.get(id) else {
            if gone.contains(&id) {
                commands.entity(entity).try_remove::<Ground>();
            }
            continue;
        };
        let same_drape = ground.is_some_and(|ground| ground.drape.as_ref() == drape);
        if !(!same_drape || changed.contains(&id) || terrain.is_changed() || settings.is_changed()) {
            continue;
        }
        commands.entity(entity).try_insert(Ground {
            terrain: map.terrain.clone(),
            drape: drape.cloned(),
            cover: ground.and_then(|ground| ground.cover.clone()),
            surroundings: ground.map_or(0.0, |ground| ground.surroundings),
            forest_surface: ground.and_then(|ground| ground.forest_surface),
            error_pixels: settings.error_pixels,
            view_distance: settings.view_distance,
        });
        if ground.is_none_or(|ground| !Arc::ptr_eq(&ground.terrain, &map.terrain)) {
            commands.trigger(TerrainReady { entity });
        }
    }
}
