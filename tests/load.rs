//! Scenes that are built beside a Bevy program: progress, failure, one in the place of the other, an early end. No device.

use std::{path::PathBuf, sync::Arc, thread};

use bevy::prelude::*;
use canopy::{
    assets::LoadedScene,
    prelude::*,
    render::{components::Forest, daylight::SkySettings},
    scene::{GroundFlat, GrownPlants, Lighting, Quality, ScatteredTrees, Scene, SceneSource, Species},
};
use tempfile::TempDir;

use crate::support::stage::{PLACE, quality};

/// What was told, in its order.
#[derive(Resource, Default)]
struct Told {
    ready: Vec<(PathBuf, Arc<Stage>)>,
    scenes: Vec<SceneSource>,
    failed: Vec<String>,
    progress: Vec<SceneProgress>,
}

fn listen(
    mut told: ResMut<Told>,
    mut ready: MessageReader<SceneReady>,
    mut failed: MessageReader<SceneFailed>,
    progress: Res<SceneProgress>,
    loaded: Option<Res<LoadedScene>>,
) {
    for scene in ready.read() {
        // What is ready is there.
        assert!(loaded.as_ref().is_some_and(|loaded| Arc::ptr_eq(&loaded.stage, &scene.stage)));
        told.ready.push((scene.scene.file().unwrap_or("".as_ref()).to_owned(), scene.stage.clone()));
        told.scenes.push(scene.scene.clone());
    }
    told.failed.extend(failed.read().map(ToString::to_string));
    if progress.is_changed() {
        told.progress.push(progress.clone());
    }
}

/// An app and the folder of its scenes.
struct Program {
    app: App,
    folder: TempDir,
}

impl Program {
    fn new(plugins: &[CanopyScenePlugin], folder: TempDir) -> Self {
        let mut app = App::new();
        app.add_plugins(MinimalPlugins);
        for plugin in plugins {
            app.add_plugins(plugin.clone());
        }
        app.init_resource::<Told>().add_systems(Update, listen);
        Self { app, folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn load(&mut self, name: &str) {
        let wanted = LoadScene::new(self.path(name));
        self.app.world_mut().write_message(wanted);
    }

    fn told(&self) -> &Told {
        self.app.world().resource()
    }

    /// Updates until `done`. A scene that is being built takes as long as it takes; when nothing is built any more, what is
    /// told comes with the next update.
    #[track_caller]
    fn until(&mut self, done: impl Fn(&Told) -> bool) {
        let mut idle = 0;
        while !done(self.told()) {
            assert!(idle < 3, "nothing is built any more: {:?}", self.told().progress.last());
            self.app.update();
            let state = self.app.world().resource::<SceneProgress>().state;
            idle = if state == SceneState::Building { 0 } else { idle + 1 };
            thread::yield_now();
        }
    }

    fn all<C: Component>(&mut self) -> Vec<Entity> {
        let world = self.app.world_mut();
        world.query_filtered::<Entity, With<C>>().iter(world).collect()
    }
}

/// A scene with so many plants, on flat ground of this width.
fn scene(individuals: u32, size: f64) -> String {
    let quality = quality(1);
    format!(
        "(terrain: Flat(size: {size}), species: [(name: \"broadleaf\", lighting: Local, plant: Grown(form: Broadleaf, \
         individuals: {individuals}, triangles: 5000, seed: 1), height: (9, 12))], trees: Scattered(stems_per_hectare: \
         110, min_distance: 3), {PLACE}, {quality})"
    )
}

fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).expect("a temporary file");
    }
    folder
}

fn is_file(scene: &SceneSource, name: &str) -> bool {
    scene.file().is_some_and(|file| file.ends_with(name))
}

/// The plugin with a scene of `folder`.
fn first(folder: &TempDir, name: &str) -> CanopyScenePlugin {
    CanopyScenePlugin::new(folder.path().join(name))
}

#[test]
fn a_scene_is_built_beside_the_program_and_shown() {
    let folder = folder(&[("grove.ron", &scene(3, 100.0))]);
    let overrides = Overrides { seed: Some(5), ..Overrides::default() };
    let wanted = LoadScene { scene: folder.path().join("grove.ron").into(), overrides };
    let mut program = Program::new(&[CanopyScenePlugin { first: Some(wanted) }], folder);
    program.app.update();
    let building = program.told().progress.first().expect("progress in the first frame");
    assert_eq!(building.state, SceneState::Building);
    assert!(is_file(&building.scene, "grove.ron"));
    program.until(|told| !told.ready.is_empty());

    let (path, stage) = program.told().ready[0].clone();
    assert_eq!(path, program.path("grove.ron"));
    assert_eq!(stage.scene.seed, 5);
    let (grounds, forests) = (program.all::<Ground>(), program.all::<Forest>());
    assert_eq!((grounds.len(), forests.len()), (1, 1));
    let world = program.app.world();
    let shown = world.resource::<LoadedScene>().shown;
    assert_eq!((shown.ground, shown.forest), (grounds[0], Some(forests[0])));
    assert!(world.get::<Forest>(forests[0]).is_some_and(|forest| Arc::ptr_eq(&forest.stand, &stage.stand)));
    assert_eq!(world.resource::<SunShadowSettings>().map_size, 512);
    assert_eq!(world.resource::<SkySettings>().instant, stage.scene.place.time.utc());

    let progress = &program.told().progress;
    let last = progress.last().expect("progress");
    assert_eq!((last.state, last.step.as_str()), (SceneState::Ready, "Trees"));
    for word in ["terrain: ", "3 plants, ", " trees: "] {
        assert!(last.notes.iter().any(|note| note.contains(word)), "no `{word}` in {:?}", last.notes);
    }
    let at_plants: Vec<(u64, u64)> =
        progress.iter().filter(|seen| seen.step == "Plants").map(|seen| (seen.done, seen.total)).collect();
    assert!(!at_plants.is_empty() && at_plants.iter().all(|(done, total)| done <= total && *total == 3));
    assert!(at_plants.is_sorted(), "{at_plants:?}");

    // At rest nothing changes any more.
    let seen = program.told().progress.len();
    program.app.update();
    program.app.update();
    assert_eq!((program.told().progress.len(), program.told().ready.len()), (seen, 1));
    assert!(program.told().failed.is_empty());
}

#[test]
fn a_scene_built_in_code_needs_no_file() {
    let plant = GrownPlants { individuals: 1, triangles: 5000, ..GrownPlants::default() };
    let scene = Scene {
        name: "in code".to_owned(),
        species: vec![Species { lighting: Some(Lighting::Local), ..Species::new("broadleaf", plant) }],
        trees: ScatteredTrees { stems_per_hectare: 20.0, ..ScatteredTrees::default() }.into(),
        quality: Quality { cross_resolution: 64, ..Quality::default() },
        ..Scene::new(GroundFlat { size: 100.0 })
    };
    let broken =
        Scene { trees: ScatteredTrees { min_distance: f64::NAN, ..ScatteredTrees::default() }.into(), ..scene.clone() };
    let mut program = Program::new(&[CanopyScenePlugin::new(broken)], folder(&[]));
    program.until(|told| !told.failed.is_empty());
    let message = program.told().failed[0].clone();
    for word in ["the scene `in code`: `trees.min_distance` is NaN", "write a value from 0 to 100 m"] {
        assert!(message.contains(word), "no `{word}` in {message}");
    }
    program.app.world_mut().write_message(LoadScene::new(scene.clone()));
    program.until(|told| !told.scenes.is_empty());
    assert_eq!(program.told().scenes, [SceneSource::from(scene)]);
    assert_eq!((program.all::<Ground>().len(), program.all::<Forest>().len()), (1, 1));
}

#[test]
fn a_broken_scene_is_told_of_and_the_program_goes_on() {
    let broken = scene(1, 100.0).replace("terrain: Flat(size: 100)", "\nterrain: Flat(size: -1)");
    let folder = folder(&[("broken.ron", &broken), ("good.ron", &scene(1, 100.0))]);
    let mut program = Program::new(&[first(&folder, "broken.ron")], folder);
    program.until(|told| !told.failed.is_empty());
    let message = program.told().failed[0].clone();
    for word in ["broken.ron:2:", "terrain.size", "-1"] {
        assert!(message.contains(word), "no `{word}` in {message}");
    }
    assert_eq!(program.told().progress.last().map(|seen| seen.state), Some(SceneState::Failed));
    assert!(program.all::<Ground>().is_empty());

    program.load("good.ron");
    program.until(|told| !told.ready.is_empty());
    let grounds = program.all::<Ground>();
    // What is shown stays when its successor is broken, or not there at all.
    program.load("broken.ron");
    program.until(|told| told.failed.len() == 2);
    program.load("missing.ron");
    program.until(|told| told.failed.len() == 3);
    assert!(program.told().failed[2].contains("missing.ron"), "{}", program.told().failed[2]);
    assert_eq!(program.all::<Ground>(), grounds);
    assert!(is_file(&program.app.world().resource::<LoadedScene>().scene, "good.ron"));
}

#[test]
fn a_scene_takes_the_place_of_the_one_before() {
    let folder = folder(&[("one.ron", &scene(1, 100.0)), ("two.ron", &scene(2, 150.0))]);
    let mut program = Program::new(&[CanopyScenePlugin::default()], folder);
    program.app.update();
    assert_eq!(program.app.world().resource::<SceneProgress>().state, SceneState::Idle);
    program.load("one.ron");
    program.until(|told| told.ready.len() == 1);
    let (ground, forest) = (program.all::<Ground>(), program.all::<Forest>());

    program.load("two.ron");
    // The old one is there until the new one is.
    program.app.update();
    assert!(program.told().ready.len() == 2 || program.all::<Forest>() == forest);
    program.until(|told| told.ready.len() == 2);
    let (new_ground, new_forest) = (program.all::<Ground>(), program.all::<Forest>());
    assert_eq!((new_ground.len(), new_forest.len()), (1, 1));
    assert!(new_ground != ground && new_forest != forest);
    assert_eq!(program.app.world().get::<Forest>(new_forest[0]).map(|forest| forest.plants.len()), Some(2));

    // A program may have despawned the forest on its own account.
    program.app.world_mut().despawn(new_forest[0]);
    program.load("one.ron");
    program.until(|told| told.ready.len() == 3);
    assert_eq!((program.all::<Ground>().len(), program.all::<Forest>().len()), (1, 1));
}

#[test]
fn of_several_scenes_the_last_one_counts() {
    let folder = folder(&[("one.ron", &scene(16, 100.0)), ("two.ron", &scene(2, 150.0))]);
    // A second plugin is no panic, and its scene comes instead of the first one's.
    let mut program = Program::new(&[first(&folder, "two.ron"), first(&folder, "one.ron")], folder);
    program.app.update();
    assert!(is_file(&program.told().progress[0].scene, "one.ron"));
    // Nor is a scene that is wanted while another is being built, nor two at once.
    program.load("missing.ron");
    program.load("two.ron");
    program.until(|told| !told.ready.is_empty());
    for _ in 0..20 {
        program.app.update();
    }
    let told = program.told();
    assert_eq!((told.ready.len(), told.failed.len()), (1, 0));
    assert!(told.ready[0].0.ends_with("two.ron"));
}

/// That the end of the program waits for nothing is tested where the thread can be held: `src/app/load/job.rs`.
#[test]
fn a_program_may_end_while_a_scene_is_built() {
    let folder = folder(&[("many.ron", &scene(16, 100.0))]);
    let mut program = Program::new(&[first(&folder, "many.ron")], folder);
    program.until(|told| told.progress.iter().any(|seen| seen.step == "Plants"));
    assert!(program.told().ready.is_empty(), "too quick to be a test");
    drop(program.app);
}
