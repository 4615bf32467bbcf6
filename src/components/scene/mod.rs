//! Scenes in a Bevy program: built in the background, shown as children of their entity when they are ready.
//!
//! The bakes run in parallel on background threads, on all cores but one; bakes that are in the cache are loaded from
//! it. Until a scene is ready, a frame only reads a list of events; then it uploads the scene. A program that closes
//! meanwhile does not wait: the build is cancelled. The cache stays valid, because its files appear whole or not at
//! all.

mod job;
mod progress;

use std::{fmt, sync::Arc};

use bevy::{
    app::{App, First, Plugin},
    camera::visibility::Visibility,
    ecs::{
        change_detection::DetectChanges,
        component::Component,
        entity::Entity,
        event::EntityEvent,
        hierarchy::ChildOf,
        lifecycle::Remove,
        observer::On,
        query::{Changed, Has, With},
        reflect::ReflectComponent,
        schedule::IntoScheduleConfigs,
        system::{Commands, Query, Res},
        world::Ref,
    },
    prelude::ReflectDefault,
    reflect::Reflect,
    render::renderer::RenderDevice,
    transform::components::Transform,
};
use tracing::{error, info, warn};

use super::{Sun, SunPlugin, report_missing, sets::CanopySystems};
use crate::{
    assets::{Stage, StageError, most_trees},
    render::components::TextureCompression,
    scene::{Overrides, SceneSource},
};
use job::Job;
use progress::BuildEvent;
pub use progress::{SceneProgress, SceneState};

/// A scene on an entity: a file ([scene files](crate::scene)), or a [`Scene`](crate::scene::Scene) that was built in
/// code.
///
/// It is built in the background. When it is ready, its ground, its forest and, if the world has no [`Sun`] yet, its
/// sun become children of the entity; the entity gets a [`LoadedScene`], and [`SceneReady`] is triggered on it. If the
/// scene cannot be shown, [`SceneFailed`] is triggered and the program continues unchanged. Both are logged.
/// [`SceneProgress`] has the progress.
///
/// A new value on the same entity replaces the scene once the new one is ready, not before. The entity's transform and
/// visibility apply to the whole scene. A world can hold several scenes; only one ground is drawn at a time.
#[derive(Component, Clone, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
#[require(Transform, Visibility, SceneProgress)]
pub struct CanopyScene {
    /// The scene: a file, or a value.
    pub source: SceneSource,
    /// Values that replace those of the scene.
    pub overrides: Overrides,
}

impl CanopyScene {
    /// The scene of `source`, a file or a [`Scene`](crate::scene::Scene), without overrides.
    pub fn new(source: impl Into<SceneSource>) -> Self {
        Self { source: source.into(), overrides: Overrides::default() }
    }
}

/// A scene is in the world, from this frame on. Triggered on its entity.
#[derive(EntityEvent, Clone)]
pub struct SceneReady {
    /// The entity of the [`CanopyScene`].
    pub entity: Entity,
    /// The built scene.
    pub stage: Arc<Stage>,
}

/// A scene cannot be shown. Triggered on its entity. [`Display`](fmt::Display) gives the whole message: what is wrong,
/// where, and the remedy.
#[derive(EntityEvent, Debug)]
pub struct SceneFailed {
    /// The entity of the [`CanopyScene`].
    pub entity: Entity,
    /// What is wrong.
    pub error: StageError,
}

impl fmt::Display for SceneFailed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.error.fmt(f)
    }
}

/// The scene that an entity shows. Added next to its [`CanopyScene`] when the scene is ready.
#[derive(Component, Clone, Reflect)]
#[reflect(Component, from_reflect = false)]
pub struct LoadedScene {
    /// The built scene. Reflection does not show it: it is the shared result of a build.
    #[reflect(ignore, clone)]
    pub stage: Arc<Stage>,
    /// Its entities, children of this one.
    pub shown: Shown,
}

/// Entities that show a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Reflect)]
pub struct Shown {
    /// Its ground.
    pub ground: Entity,
    /// Its forest, if it has trees.
    pub forest: Option<Entity>,
    /// Its sun, if the world had none.
    pub sun: Option<Entity>,
}

impl Shown {
    /// Removes those entities that still exist from the world.
    pub fn despawn(self, commands: &mut Commands) {
        for entity in self.sun.into_iter().chain(self.forest).chain([self.ground]) {
            commands.entity(entity).try_despawn();
        }
    }
}

impl Stage {
    /// Spawns the ground and the forest. A world has only one sun, so that is separate: see [`sun`](Self::sun). Sets the world's
    /// [`TextureCompression`] to that of the scene.
    pub fn show(&self, commands: &mut Commands) -> Shown {
        commands.insert_resource(TextureCompression(self.scene.quality.texture_compression));
        Shown {
            ground: commands.spawn(self.ground()).id(),
            forest: self.forest().map(|forest| commands.spawn(forest).id()),
            sun: None,
        }
    }

    /// Sun, moon and air at an instant. Spawn it together with [`shadow`](Self::shadow).
    pub fn sun(&self, instant: chrono::DateTime<chrono::Utc>) -> Sun {
        Sun {
            observer: self.observer,
            instant,
            moon: self.scene.place.moon,
            visibility_km: self.scene.place.visibility * 1e-3,
            fixed_ev100: self.scene.camera.exposure.map(|ev100| ev100 as f32),
            ..Sun::default()
        }
    }
}

/// Builds and shows [`CanopyScene`]s.
pub struct ScenePlugin;

impl Plugin for ScenePlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<CanopyScene>()
            .register_type::<LoadedScene>()
            .register_type::<SceneProgress>()
            .add_systems(First, (begin, follow).chain().in_set(CanopySystems::Load))
            .add_observer(remove_scene);
    }

    fn finish(&self, app: &mut App) {
        let sun = app.is_plugin_added::<SunPlugin>();
        report_missing(app, "ScenePlugin", &[(sun, "SunPlugin", "a scene has no light")]);
    }
}

/// Starts to build the scenes that are new or have changed.
fn begin(
    mut commands: Commands,
    scenes: Query<(Entity, Ref<CanopyScene>, Has<Job>), Changed<CanopyScene>>,
    device: Option<Res<RenderDevice>>,
) {
    let limit = device.map(|device| most_trees(&device.limits()));
    for (entity, scene, building) in &scenes {
        if building && !scene.is_added() {
            info!("the build of another scene is cancelled in favour of {}", scene.source);
        }
        commands.entity(entity).insert((Job::start(&scene, limit), SceneProgress::default()));
    }
}

/// Updates the progress of the scenes, and shows those that are ready.
fn follow(
    mut commands: Commands,
    mut scenes: Query<(Entity, &CanopyScene, &mut Job, &mut SceneProgress, Option<&LoadedScene>)>,
    suns: Query<Entity, With<Sun>>,
    device: Option<Res<RenderDevice>>,
) {
    // Two scenes may become ready in the same frame.
    let mut lit = false;
    for (entity, scene, mut job, mut progress, loaded) in &mut scenes {
        // Take the result before reading the events: the build reports its last event before it ends, so none is lost.
        let result = job.finished();
        for event in job.events() {
            match &event {
                BuildEvent::Note(note) => info!("{}: {note}", scene.source),
                BuildEvent::Warning(warning) => warn!("{}: {warning}", scene.source),
                BuildEvent::Begin(..) | BuildEvent::Advance(_) | BuildEvent::End => {}
            }
            progress.apply(event);
        }
        let Some(result) = result else { continue };
        commands.entity(entity).remove::<Job>();
        let checked = result.and_then(|stage| {
            device.as_ref().map_or(Ok(()), |device| stage.check_device(device))?;
            Ok(Arc::new(stage))
        });
        let stage = match checked {
            Ok(stage) => stage,
            Err(error) => {
                progress.state = SceneState::Failed;
                fail(&mut commands, entity, scene, error);
                continue;
            }
        };
        let own_sun = loaded.and_then(|loaded| loaded.shown.sun);
        if let Some(loaded) = loaded {
            loaded.shown.despawn(&mut commands);
        }
        let mut shown = stage.show(&mut commands);
        if !lit && suns.iter().all(|sun| Some(sun) == own_sun) {
            let sun = stage.sun(stage.scene.place.time.utc());
            shown.sun = Some(commands.spawn((sun, stage.shadow())).id());
            lit = true;
        }
        for child in shown.sun.into_iter().chain(shown.forest).chain([shown.ground]) {
            commands.entity(child).insert(ChildOf(entity));
        }
        info!("{}: ready, {} trees", scene.source, stage.stand.trees.len());
        progress.state = SceneState::Ready;
        commands.entity(entity).insert(LoadedScene { stage: stage.clone(), shown });
        commands.trigger(SceneReady { entity, stage });
    }
}

/// Cancels and removes a scene whose component was removed.
fn remove_scene(removed: On<Remove, CanopyScene>, loaded: Query<&LoadedScene>, mut commands: Commands) {
    let entity = removed.entity;
    if let Ok(loaded) = loaded.get(entity) {
        loaded.shown.despawn(&mut commands);
    }
    commands.entity(entity).try_remove::<(Job, LoadedScene)>();
}

fn fail(commands: &mut Commands, entity: Entity, scene: &CanopyScene, error: StageError) {
    error!("{}: {error}", scene.source);
    commands.trigger(SceneFailed { entity, error });
}
