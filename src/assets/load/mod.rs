//! Scenes in a Bevy program: built beside it with progress, shown when they are ready, one in the place of the other.
//!
//! The bakes run in parallel on threads of their own, all cores but one, and come from the cache where it has them. Until a
//! scene is ready a frame pays for a look at a list; then for uploading the scene. A program that closes meanwhile does not
//! wait: what is under way is given up, and as the cache's files appear whole or not at all, nothing half stays in it.

mod job;
mod progress;

use std::{fmt, sync::Arc};

use bevy::{
    app::{App, First, Plugin, PreStartup},
    ecs::{
        message::{Message, MessageReader, MessageWriter},
        resource::Resource,
        schedule::IntoScheduleConfigs,
        system::{Commands, Res, ResMut},
    },
    render::renderer::RenderDevice,
};
use tracing::{error, info, warn};

use super::{Shown, Stage, StageError};
use crate::scene::{Overrides, SceneSource};
use job::Job;
use progress::Said;
pub use progress::{SceneProgress, SceneState};

/// Loads scenes: one when the program starts, others when a [`LoadScene`] asks for them.
///
/// A scene that is ready puts its ground, its forest, its [`SunShadowSettings`] and the [`SkySettings`] of its own time into
/// the world, replaces [`LoadedScene`], and tells of it with [`SceneReady`]; entities of the scene before it are despawned in
/// the same moment. One that cannot be shown is told of with [`SceneFailed`], and the program goes on as it was. The log has
/// both, and [`SceneProgress`] how far it is.
///
/// One scene is shown at a time, and the one that was asked for last is the one that counts: of a scene that was still being
/// built nothing more is heard. So does a second plugin's scene, with a warning, replace that of the first.
///
/// [`SunShadowSettings`]: crate::render::components::SunShadowSettings
/// [`SkySettings`]: crate::render::daylight::SkySettings
#[derive(Clone, Debug, Default)]
pub struct CanopyScenePlugin {
    /// The scene to start with; `None` waits for a [`LoadScene`].
    pub first: Option<LoadScene>,
}

impl CanopyScenePlugin {
    /// Starts with `scene`, a file or a [`Scene`](crate::scene::Scene), as it is.
    pub fn new(scene: impl Into<SceneSource>) -> Self {
        Self { first: Some(LoadScene::new(scene)) }
    }
}

/// Asks for a scene in the place of the one that is shown.
#[derive(Message, Clone, Debug, Default, PartialEq)]
pub struct LoadScene {
    /// The scene: a file, or a value.
    pub scene: SceneSource,
    /// What replaces values in it.
    pub overrides: Overrides,
}

impl LoadScene {
    /// `scene`, a file or a [`Scene`](crate::scene::Scene), as it is.
    pub fn new(scene: impl Into<SceneSource>) -> Self {
        Self { scene: scene.into(), overrides: Overrides::default() }
    }
}

/// A scene is in the world, from this very frame on.
#[derive(Message, Clone)]
pub struct SceneReady {
    /// What was asked for.
    pub scene: SceneSource,
    /// What it is made of.
    pub stage: Arc<Stage>,
}

/// A scene cannot be shown. [`Display`](fmt::Display) has the whole message: what is wrong, where, and the remedy.
#[derive(Message, Debug)]
pub struct SceneFailed {
    /// What was asked for.
    pub scene: SceneSource,
    /// What is wrong.
    pub error: StageError,
}

impl fmt::Display for SceneFailed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.error.fmt(f)
    }
}

/// The scene that is shown. Not there before the first is ready.
#[derive(Resource, Clone)]
pub struct LoadedScene {
    /// What was asked for.
    pub scene: SceneSource,
    /// What it is made of.
    pub stage: Arc<Stage>,
    /// Its entities, which the next scene despawns.
    pub shown: Shown,
}

/// What is wanted and under way.
#[derive(Resource, Default)]
struct Loader {
    first: Option<LoadScene>,
    job: Option<Job>,
}

impl Loader {
    fn load(&mut self, request: LoadScene, progress: &mut SceneProgress) -> Result<(), SceneFailed> {
        if let Some(replaced) = self.job.take() {
            info!("{}: given up for {}", replaced.request.scene, request.scene);
        }
        progress.begin(request.scene.clone());
        let scene = request.scene.clone();
        self.job = Some(Job::start(request).map_err(|error| SceneFailed { scene, error })?);
        Ok(())
    }
}

impl Plugin for CanopyScenePlugin {
    fn build(&self, app: &mut App) {
        if let Some(mut loader) = app.world_mut().get_resource_mut::<Loader>() {
            if let Some(first) = &self.first
                && let Some(replaced) = loader.first.replace(first.clone())
            {
                let (replaced, first) = (&replaced.scene, &first.scene);
                warn!(
                    "{replaced}: not loaded: another CanopyScenePlugin asks for {first}, and one scene is shown at a time"
                );
            }
            return;
        }
        app.insert_resource(Loader { first: self.first.clone(), job: None })
            .init_resource::<SceneProgress>()
            .add_message::<LoadScene>()
            .add_message::<SceneReady>()
            .add_message::<SceneFailed>()
            .add_systems(PreStartup, load_first)
            .add_systems(First, (load_wanted, follow).chain());
    }

    fn is_unique(&self) -> bool {
        false
    }
}

fn load_first(mut loader: ResMut<Loader>, mut progress: ResMut<SceneProgress>, mut failed: MessageWriter<SceneFailed>) {
    if let Some(request) = loader.first.take() {
        tell(loader.load(request, &mut progress), &mut progress, &mut failed);
    }
}

fn load_wanted(
    mut wanted: MessageReader<LoadScene>,
    mut loader: ResMut<Loader>,
    mut progress: ResMut<SceneProgress>,
    mut failed: MessageWriter<SceneFailed>,
) {
    if let Some(request) = wanted.read().last() {
        tell(loader.load(request.clone(), &mut progress), &mut progress, &mut failed);
    }
}

/// Hears how far the scene is, and shows it when it is ready.
fn follow(
    mut commands: Commands,
    mut loader: ResMut<Loader>,
    mut progress: ResMut<SceneProgress>,
    loaded: Option<Res<LoadedScene>>,
    device: Option<Res<RenderDevice>>,
    mut ready: MessageWriter<SceneReady>,
    mut failed: MessageWriter<SceneFailed>,
) {
    // What is said last is said before the end, so it is heard if the end is asked for first.
    let Some((job, finished)) = loader.job.as_ref().map(|job| (job, job.is_finished())) else { return };
    for said in job.said() {
        match &said {
            Said::Note(note) => info!("{}: {note}", progress.scene),
            Said::Warning(warning) => warn!("{}: {warning}", progress.scene),
            Said::Begin(..) | Said::Advance(_) | Said::End => {}
        }
        progress.hear(said);
    }
    let Some(job) = loader.job.take_if(|_| finished) else { return };
    let scene = job.request.scene.clone();
    let checked = job.finish().and_then(|stage| {
        device.map_or(Ok(()), |device| stage.check_device(&device))?;
        Ok(Arc::new(stage))
    });
    let stage = match checked {
        Ok(stage) => stage,
        Err(error) => return tell(Err(SceneFailed { scene, error }), &mut progress, &mut failed),
    };
    if let Some(loaded) = loaded {
        loaded.shown.despawn(&mut commands);
    }
    let shown = stage.show(&mut commands);
    commands.insert_resource(stage.sky(stage.scene.place.time.utc()));
    commands.insert_resource(LoadedScene { scene: scene.clone(), stage: stage.clone(), shown });
    info!("{scene}: ready, {} trees", stage.stand.trees.len());
    progress.state = SceneState::Ready;
    ready.write(SceneReady { scene, stage });
}

/// Tells of a failure, if there is one.
fn tell(outcome: Result<(), SceneFailed>, progress: &mut SceneProgress, failed: &mut MessageWriter<SceneFailed>) {
    if let Err(failure) = outcome {
        error!("{}: {failure}", failure.scene);
        progress.state = SceneState::Failed;
        failed.write(failure);
    }
}
