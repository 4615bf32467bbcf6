//! Builds new and changed forests of a world in the background.

use std::collections::HashSet;

use bevy::{
    asset::{Asset, AssetEvent, AssetId, AssetLoadFailedEvent, AssetServer, Assets, LoadState, UntypedAssetId},
    ecs::{
        change_detection::DetectChanges,
        component::Component,
        entity::Entity,
        lifecycle::RemovedComponents,
        message::MessageReader,
        system::{Commands, Query, Res, SystemParam},
        world::Ref,
    },
    render::renderer::RenderDevice,
    transform::components::GlobalTransform,
};
use glam::DVec3;
use tracing::{error, warn};

use super::{
    Forest3d, ForestError, ForestFailed, ForestReady, ForestSettings,
    build::{Built, Ingredients},
};
use crate::{
    assets::{
        PlantAsset, StageError, TerrainMap,
        background::{self, Background},
        load_error::load_error,
        most_trees,
        stage::check_trees,
    },
    components::{Terrain3d, cover::ForestCover},
    lod::Levels,
    render::components::Forest,
};

/// The state of a forest's build.
#[derive(Component, Default)]
pub struct ForestWork {
    /// The build has not started yet: something is still missing.
    waits: bool,
    job: Option<Job>,
    /// Why the last build failed: the same error is not logged again.
    failure: Option<String>,
}

impl ForestWork {
    fn fail(&mut self, commands: &mut Commands, entity: Entity, error: ForestError) {
        let text = error.to_string();
        if self.failure.as_ref() != Some(&text) {
            error!("the forest {entity} cannot be built: {text}");
            commands.trigger(ForestFailed { entity, error });
        }
        self.failure = Some(text);
    }
}

struct Job {
    work: Background<Result<Built, ForestError>>,
    /// The terrain that it is built for.
    ground: Option<Entity>,
}

/// What happened to assets and terrains since the last frame.
#[derive(SystemParam)]
pub struct Changes<'w, 's> {
    plants: MessageReader<'w, 's, AssetEvent<PlantAsset>>,
    maps: MessageReader<'w, 's, AssetEvent<TerrainMap>>,
    broken_plants: MessageReader<'w, 's, AssetLoadFailedEvent<PlantAsset>>,
    broken_maps: MessageReader<'w, 's, AssetLoadFailedEvent<TerrainMap>>,
    removed_terrains: RemovedComponents<'w, 's, Terrain3d>,
    removed_forests: RemovedComponents<'w, 's, Forest3d>,
}

impl Changes<'_, '_> {
    fn changed_plants(&mut self) -> HashSet<AssetId<PlantAsset>> {
        let events = self.plants.read().filter_map(|event| match event {
            AssetEvent::Added { id } | AssetEvent::Modified { id } => Some(*id),
            _ => None,
        });
        events.chain(self.broken_plants.read().map(|failure| failure.id)).collect()
    }

    fn changed_maps(&mut self) -> HashSet<AssetId<TerrainMap>> {
        let events = self.maps.read().filter_map(|event| match event {
            AssetEvent::Added { id } | AssetEvent::Modified { id } => Some(*id),
            _ => None,
        });
        events.chain(self.broken_maps.read().map(|failure| failure.id)).collect()
    }
}

/// What forests are built of.
#[derive(SystemParam)]
pub struct Sources<'w, 's> {
    plants: Res<'w, Assets<PlantAsset>>,
    maps: Res<'w, Assets<TerrainMap>>,
    server: Option<Res<'w, AssetServer>>,
    terrains: Query<'w, 's, (Entity, Ref<'static, Terrain3d>, &'static GlobalTransform)>,
    device: Option<Res<'w, RenderDevice>>,
}

impl Sources<'_, '_> {
    /// Why an asset cannot be loaded, if it failed.
    fn failure(&self, id: impl Into<UntypedAssetId>) -> Option<String> {
        match self.server.as_ref()?.get_load_state(id)? {
            LoadState::Failed(error) => Some(load_error(&error)),
            LoadState::NotLoaded | LoadState::Loading | LoadState::Loaded => None,
        }
    }

    /// An asset; `None` while it is being loaded, even if its earlier version is there.
    fn loaded<'a, A: Asset>(&self, assets: &'a Assets<A>, id: AssetId<A>) -> Option<&'a A> {
        let state = self.server.as_ref().and_then(|server| server.get_load_state(id));
        if matches!(state, Some(LoadState::Loading)) { None } else { assets.get(id) }
    }

    /// What `forest` is built of; `None` while something is still being loaded.
    fn gather(&self, forest: &Forest3d) -> Result<Option<Ingredients>, ForestError> {
        if forest.species.is_empty() {
            return Err(ForestError::NoSpecies);
        }
        let ground = forest.ground.map(|ground| self.terrains.get(ground).map_err(|_| ForestError::NoTerrain(ground)));
        let ground = ground.transpose()?.map(|(_, terrain, _)| terrain.0.id());
        // Report a failure at once, whatever else is still being loaded.
        if let Some(error) = forest.species.iter().find_map(|species| self.failure(species.plant.id())) {
            return Err(ForestError::Plant(error));
        }
        if let Some(error) = ground.and_then(|map| self.failure(map)) {
            return Err(ForestError::Terrain(error));
        }
        let plants: Option<Vec<PlantAsset>> =
            forest.species.iter().map(|species| self.loaded(&self.plants, species.plant.id()).cloned()).collect();
        let terrain = match ground {
            None => Some(None),
            Some(map) => self.loaded(&self.maps, map).map(|map| Some(map.terrain.clone())),
        };
        let (Some(plants), Some(terrain)) = (plants, terrain) else { return Ok(None) };
        let most_trees = self.device.as_ref().map(|device| most_trees(&device.limits()));
        Ok(Some(Ingredients { forest: forest.clone(), plants, terrain, most_trees }))
    }
}

/// Builds forests and inserts the renderer's components on their entities.
pub fn tend_forests(
    mut commands: Commands,
    mut forests: Query<(Entity, Ref<Forest3d>, Ref<ForestSettings>, &mut ForestWork, Option<&mut Forest>)>,
    mut changes: Changes,
    sources: Sources,
) {
    for entity in changes.removed_forests.read().filter(|entity| !forests.contains(*entity)) {
        if let Ok(mut entity) = commands.get_entity(entity) {
            entity.try_remove::<(Forest, ForestCover, ForestWork)>();
        }
    }
    let (plants, maps) = (changes.changed_plants(), changes.changed_maps());
    let mut grounds: HashSet<Entity> = changes.removed_terrains.read().collect();
    let moved = |terrain: &Ref<Terrain3d>| terrain.is_changed() || maps.contains(&terrain.0.id());
    grounds.extend(sources.terrains.iter().filter(|(_, terrain, _)| moved(terrain)).map(|(entity, ..)| entity));

    for (entity, wanted, settings, mut work, shown) in &mut forests {
        // Trees stand on their terrain wherever that is; the forest's own transform is the renderer's affair.
        let terrain = wanted.ground.and_then(|ground| sources.terrains.get(ground).ok());
        let place = terrain.map_or(DVec3::ZERO, |(.., transform)| transform.translation().as_dvec3());
        let stale = wanted.is_changed()
            || wanted.ground.is_some_and(|ground| grounds.contains(&ground))
            || plants.iter().any(|plant| wanted.has(*plant));
        if stale {
            work.waits = true;
            work.job = None;
        }
        if wanted.is_changed() {
            work.failure = None;
        }
        if work.waits {
            match sources.gather(&wanted) {
                Ok(None) => {}
                Ok(Some(ingredients)) => {
                    let job = background::start(move |wanted| ingredients.build(wanted));
                    work.waits = false;
                    work.job = Some(Job { work: job, ground: wanted.ground });
                }
                Err(error) => {
                    work.waits = false;
                    work.fail(&mut commands, entity, error);
                }
            }
        }
        if let Some(mut shown) = shown {
            // Each assignment marks the forest as changed, so only assign real changes.
            if shown.origin != place {
                shown.origin = place;
            }
            let levels = levels(&settings, wanted.ground);
            if shown.levels != levels || shown.view_distance != settings.view_distance {
                shown.levels = levels;
                shown.view_distance = settings.view_distance;
            }
        }
        let Some((result, ground)) = work.job.as_ref().and_then(|job| Some((job.work.finished()?, job.ground))) else {
            continue;
        };
        work.job = None;
        let built = result.map_err(|error| StageError::from(error).into()).flatten();
        let built = built.and_then(|built| {
            sources.device.as_ref().map_or(Ok(()), |device| check_trees(built.stand.trees.len(), device))?;
            Ok(built)
        });
        match built {
            Ok(built) => {
                work.failure = None;
                show(&mut commands, entity, built, &settings, place, ground);
            }
            Err(error) => work.fail(&mut commands, entity, error),
        }
    }
}

/// The levels of a forest. Without a ground there is none that could show its far trees as a surface.
fn levels(settings: &ForestSettings, ground: Option<Entity>) -> Levels {
    let levels = settings.levels.clone();
    if ground.is_some() { levels } else { levels.to_size(0.0) }
}

fn show(
    commands: &mut Commands,
    entity: Entity,
    built: Built,
    settings: &ForestSettings,
    origin: DVec3,
    ground: Option<Entity>,
) {
    for warning in &built.warnings {
        warn!("the forest {entity}: {warning}");
    }
    let trees = built.stand.trees.len();
    let mut target = commands.entity(entity);
    match (built.cover, ground) {
        (Some(map), Some(ground)) => {
            let (surroundings, tree_height) = (built.surroundings, built.tree_height);
            target.try_insert(ForestCover { ground, map, surroundings, tree_height })
        }
        _ => target.try_remove::<ForestCover>(),
    };
    if trees > 0 {
        target.try_insert(Forest {
            stand: built.stand,
            plants: built.plants,
            suns: built.suns,
            origin,
            levels: levels(settings, ground),
            view_distance: settings.view_distance,
        });
    } else {
        target.try_remove::<Forest>();
    }
    commands.trigger(ForestReady { entity, trees });
}
