//! Scenes that are built beside a Bevy program: progress, failure, one in the place of the other, several at once. No
//! device.

use std::{path::PathBuf, sync::Arc, thread};

use bevy::{ecs::hierarchy::ChildOf, prelude::*, transform::TransformPlugin};
use canopy::{
    components::{ScenePlugin, SunPlugin},
    prelude::*,
    scene::{GroundFlat, GrownPlants, Lighting, Quality, ScatteredTrees, Scene, Species},
};
use tempfile::TempDir;

use crate::support::stage::{PLACE, quality};

/// What was heard, in its order.
#[derive(Resource, Default)]
struct Heard {
    ready: Vec<(Entity, Arc<Stage>)>,
    failed: Vec<(Entity, String)>,
    progress: Vec<(Entity, SceneProgress)>,
}

fn hear_ready(ready: On<SceneReady>, loaded: Query<&LoadedScene>, mut heard: ResMut<Heard>) {
    // What is ready is there.
    let shown = loaded.get(ready.entity).is_ok_and(|loaded| Arc::ptr_eq(&loaded.stage, &ready.stage));
    assert!(shown, "told before it is shown");
    heard.ready.push((ready.entity, ready.stage.clone()));
}

fn hear_failed(failed: On<SceneFailed>, mut heard: ResMut<Heard>) {
    heard.failed.push((failed.entity, failed.to_string()));
}

fn watch(progress: Query<(Entity, &SceneProgress), Changed<SceneProgress>>, mut heard: ResMut<Heard>) {
    heard.progress.extend(progress.iter().map(|(entity, progress)| (entity, progress.clone())));
}

/// An app and the folder of its scenes.
struct Program {
    app: App,
    folder: TempDir,
}

impl Program {
    fn new(folder: TempDir) -> Self {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, TransformPlugin, ScenePlugin, SunPlugin))
            .init_resource::<Heard>()
            .add_observer(hear_ready)
            .add_observer(hear_failed)
            .add_systems(Update, watch);
        Self { app, folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn spawn(&mut self, name: &str) -> Entity {
        let scene = CanopyScene::new(self.path(name));
        self.app.world_mut().spawn(scene).id()
    }

    fn replace(&mut self, entity: Entity, name: &str) {
        let scene = CanopyScene::new(self.path(name));
        self.app.world_mut().entity_mut(entity).insert(scene);
    }

    fn heard(&self) -> &Heard {
        self.app.world().resource()
    }

    /// Updates until `done`. A scene that is being built takes as long as it takes; when nothing is built any more, what is
    /// heard comes with the next updates.
    #[track_caller]
    fn until(&mut self, done: impl Fn(&Heard) -> bool) {
        let mut idle = 0;
        while !done(self.heard()) {
            assert!(idle < 4, "nothing is built any more: {:?}", self.heard().progress.last());
            self.app.update();
            let world = self.app.world_mut();
            let mut states = world.query::<&SceneProgress>();
            let building = states.iter(world).any(|progress| progress.state == SceneState::Building);
            idle = if building { 0 } else { idle + 1 };
            thread::yield_now();
        }
    }

    fn all<C: Component>(&mut self) -> Vec<Entity> {
        let world = self.app.world_mut();
        world.query_filtered::<Entity, With<C>>().iter(world).collect()
    }

    fn get<C: Component>(&self, entity: Entity) -> &C {
        self.app.world().get(entity).expect("the component")
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

#[test]
fn a_scene_is_built_beside_the_program_and_shown() {
    let mut program = Program::new(folder(&[("grove.ron", &scene(3, 100.0))]));
    let overrides = Overrides { seed: Some(5), ..Overrides::default() };
    let wanted = CanopyScene { source: program.path("grove.ron").into(), overrides };
    let entity = program.app.world_mut().spawn(wanted).id();
    program.app.update();
    let (_, building) = program.heard().progress.first().expect("progress in the first frame");
    assert_eq!(building.state, SceneState::Building);
    program.until(|heard| !heard.ready.is_empty());

    let (of, stage) = program.heard().ready[0].clone();
    assert_eq!((of, stage.scene.seed), (entity, 5));
    let (grounds, forests, suns) = (program.all::<Ground>(), program.all::<Forest>(), program.all::<Sun>());
    assert_eq!((grounds.len(), forests.len(), suns.len()), (1, 1, 1));
    let shown = program.get::<LoadedScene>(entity).shown;
    assert_eq!((shown.ground, shown.forest, shown.sun), (grounds[0], Some(forests[0]), Some(suns[0])));
    for child in [grounds[0], forests[0], suns[0]] {
        assert_eq!(program.get::<ChildOf>(child).parent(), entity);
    }
    assert!(Arc::ptr_eq(&program.get::<Forest>(forests[0]).stand, &stage.stand));
    assert_eq!(program.get::<SunShadowSettings>(suns[0]).map_size, 512);
    assert_eq!(program.get::<Sun>(suns[0]).instant, stage.scene.place.time.utc());
    program.app.update();
    assert!(program.app.world().contains_resource::<Daylight>(), "the first light is waited for");

    let progress = &program.heard().progress;
    let (_, last) = progress.last().expect("progress");
    assert_eq!((last.state, last.step.as_str()), (SceneState::Ready, "Trees"));
    for word in ["terrain: ", "3 plants, ", " trees: "] {
        assert!(last.notes.iter().any(|note| note.contains(word)), "no `{word}` in {:?}", last.notes);
    }
    let at_plants: Vec<(u64, u64)> =
        progress.iter().filter(|(_, seen)| seen.step == "Plants").map(|(_, seen)| (seen.done, seen.total)).collect();
    // A frame that takes longer than the plants hears of them in the notes alone.
    assert!(at_plants.iter().all(|(done, total)| done <= total && *total == 3), "{at_plants:?}");
    assert!(at_plants.is_sorted(), "{at_plants:?}");

    // At rest nothing changes any more.
    let seen = program.heard().progress.len();
    program.app.update();
    program.app.update();
    assert_eq!((program.heard().progress.len(), program.heard().ready.len()), (seen, 1));
    assert!(program.heard().failed.is_empty());
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
    let mut program = Program::new(folder(&[]));
    let entity = program.app.world_mut().spawn(CanopyScene::new(broken)).id();
    program.until(|heard| !heard.failed.is_empty());
    let message = program.heard().failed[0].1.clone();
    for word in ["the scene `in code`: `trees.min_distance` is NaN", "write a value from 0 to 100 m"] {
        assert!(message.contains(word), "no `{word}` in {message}");
    }
    program.app.world_mut().entity_mut(entity).insert(CanopyScene::new(scene));
    program.until(|heard| !heard.ready.is_empty());
    assert_eq!((program.all::<Ground>().len(), program.all::<Forest>().len()), (1, 1));
}

#[test]
fn a_broken_scene_is_reported_and_the_program_goes_on() {
    let broken = scene(1, 100.0).replace("terrain: Flat(size: 100)", "\nterrain: Flat(size: -1)");
    let mut program = Program::new(folder(&[("broken.ron", &broken), ("good.ron", &scene(1, 100.0))]));
    let entity = program.spawn("broken.ron");
    program.until(|heard| !heard.failed.is_empty());
    let (of, message) = program.heard().failed[0].clone();
    assert_eq!(of, entity);
    for word in ["broken.ron:2:", "terrain.size", "-1"] {
        assert!(message.contains(word), "no `{word}` in {message}");
    }
    program.app.update();
    assert_eq!(program.get::<SceneProgress>(entity).state, SceneState::Failed);
    assert!(program.all::<Ground>().is_empty());

    program.replace(entity, "good.ron");
    program.until(|heard| !heard.ready.is_empty());
    let grounds = program.all::<Ground>();
    // What is shown stays when its successor is broken, or not there at all.
    program.replace(entity, "broken.ron");
    program.until(|heard| heard.failed.len() == 2);
    program.replace(entity, "missing.ron");
    program.until(|heard| heard.failed.len() == 3);
    assert!(program.heard().failed[2].1.contains("missing.ron"), "{}", program.heard().failed[2].1);
    assert_eq!(program.all::<Ground>(), grounds);
    assert_eq!(program.get::<LoadedScene>(entity).shown.ground, grounds[0]);
}

#[test]
fn a_scene_takes_the_place_of_the_one_before() {
    let mut program = Program::new(folder(&[("one.ron", &scene(1, 100.0)), ("two.ron", &scene(2, 150.0))]));
    let entity = program.spawn("one.ron");
    program.until(|heard| heard.ready.len() == 1);
    let (ground, forest) = (program.all::<Ground>(), program.all::<Forest>());

    program.replace(entity, "two.ron");
    // The old one is there until the new one is.
    program.app.update();
    assert!(program.heard().ready.len() == 2 || program.all::<Forest>() == forest);
    program.until(|heard| heard.ready.len() == 2);
    let (new_ground, new_forest) = (program.all::<Ground>(), program.all::<Forest>());
    assert_eq!((new_ground.len(), new_forest.len(), program.all::<Sun>().len()), (1, 1, 1));
    assert!(new_ground != ground && new_forest != forest);
    assert_eq!(program.get::<Forest>(new_forest[0]).plants.len(), 2);

    // A program may have despawned the forest on its own account.
    program.app.world_mut().despawn(new_forest[0]);
    program.replace(entity, "one.ron");
    program.until(|heard| heard.ready.len() == 3);
    assert_eq!((program.all::<Ground>().len(), program.all::<Forest>().len()), (1, 1));
}

#[test]
fn while_a_scene_is_built_the_last_wish_counts() {
    let mut program = Program::new(folder(&[("one.ron", &scene(16, 100.0)), ("two.ron", &scene(2, 150.0))]));
    let entity = program.spawn("one.ron");
    program.app.update();
    program.replace(entity, "missing.ron");
    program.replace(entity, "two.ron");
    program.until(|heard| !heard.ready.is_empty());
    for _ in 0..20 {
        program.app.update();
    }
    assert_eq!((program.heard().ready.len(), program.heard().failed.len()), (1, 0));
    assert_eq!(program.heard().ready[0].1.plants.len(), 2);
}

#[test]
fn several_scenes_share_a_world_and_go_with_their_entities() {
    let mut program = Program::new(folder(&[("one.ron", &scene(1, 100.0)), ("two.ron", &scene(2, 150.0))]));
    let (one, two) = (program.spawn("one.ron"), program.spawn("two.ron"));
    program.app.world_mut().entity_mut(two).insert(Transform::from_xyz(500.0, 0.0, 0.0));
    program.until(|heard| heard.ready.len() == 2);
    program.app.update();
    // One light for both.
    assert_eq!((program.all::<Ground>().len(), program.all::<Forest>().len(), program.all::<Sun>().len()), (2, 2, 1));
    let forest = program.get::<LoadedScene>(two).shown.forest.expect("a forest");
    assert_eq!(program.get::<GlobalTransform>(forest).translation(), Vec3::new(500.0, 0.0, 0.0));

    program.app.world_mut().despawn(two);
    program.app.update();
    assert_eq!((program.all::<Ground>().len(), program.all::<Forest>().len()), (1, 1));
    // A scene that is taken from its entity goes, the entity stays.
    program.app.world_mut().entity_mut(one).remove::<CanopyScene>();
    program.app.update();
    assert!(program.all::<Ground>().is_empty() && program.all::<Forest>().is_empty());
    assert!(program.app.world().get_entity(one).is_ok() && program.app.world().get::<LoadedScene>(one).is_none());
}

#[test]
fn a_scene_leaves_the_sun_of_the_program_alone() {
    let mut program = Program::new(folder(&[("one.ron", &scene(1, 100.0))]));
    let sun = program.app.world_mut().spawn(Sun::default()).id();
    let entity = program.spawn("one.ron");
    program.until(|heard| !heard.ready.is_empty());
    assert_eq!(program.all::<Sun>(), [sun]);
    assert_eq!(program.get::<LoadedScene>(entity).shown.sun, None);
}
