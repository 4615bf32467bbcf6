//! Terrain and forests as components: built, built anew, swapped, taken away.

use std::{any::TypeId, sync::Arc};

use bevy::{
    asset::{AssetLoadError, AssetLoadFailedEvent, LoadState},
    prelude::*,
};
use canopy::{
    lod::{Levels, Representation},
    prelude::*,
    render::components::Forest,
    scatter::{Area, Tree},
    scene::InventoryTrees,
};
use glam::{DVec2, DVec3};

use super::{Program, species, tree};

/// A program with a species of one tree, `small.species.ron`.
fn program() -> Program {
    Program::new(&[("tree.glb", &tree()), ("small.species.ron", species(1, (8.0, 12.0)).as_bytes())])
}

fn square(center: f64, size: f64) -> Area {
    Area::centered(DVec2::new(center, 0.0), DVec2::splat(size))
}

#[test]
fn a_forest_is_built_on_its_terrain_and_its_observers_hear_of_it() {
    let mut program = program();
    let (plane, plant) = (program.plane(200.0), program.load("small.species.ron"));
    let ground = program.spawn(Terrain3d(plane));
    let forest = program.spawn(Forest3d::scatter(100.0).on(ground).of(plant, 1.0));
    program.until_heard(|heard| !heard.ready.is_empty());
    let trees = program.heard().ready[0].1;
    assert_eq!(program.heard().ready, [(forest, trees)]);
    assert!((300..500).contains(&trees), "{trees} trees on four hectares");
    assert_eq!(program.heard().terrains, [ground]);
    let shown = program.forest(forest).expect("a forest");
    assert_eq!((shown.stand.trees.len(), shown.plants.len(), shown.origin), (trees, 1, DVec3::ZERO));
    let cover = program.ground(ground).and_then(|ground| ground.cover.clone()).expect("canopy cover");
    assert!(cover.at(DVec2::ZERO) > 0.0);
    // At rest nothing is built anew.
    for _ in 0..50 {
        program.app.update();
    }
    assert_eq!(program.heard().ready.len(), 1);
    assert!(program.heard().failed.is_empty());
}

#[test]
fn two_forests_stand_in_one_world_and_cover_their_ground_together() {
    let mut program = program();
    let (plane, plant) = (program.plane(400.0), program.load("small.species.ron"));
    let ground = program.spawn(Terrain3d(plane));
    let stand = |area| Forest3d::scatter(400.0).on(ground).of(plant.clone(), 1.0).area(area);
    let west = program.spawn(stand(square(-100.0, 100.0)));
    let east = program.spawn(stand(square(100.0, 100.0)).seed(2));
    program.until_heard(|heard| heard.ready.len() == 2);
    assert!(program.forest(west).is_some() && program.forest(east).is_some());
    let cover = |program: &Program, x: f64| {
        let cover = program.ground(ground).and_then(|ground| ground.cover.clone());
        cover.map_or(0.0, |cover| cover.at(DVec2::new(x, 0.0)))
    };
    assert!(cover(&program, -100.0) > 0.0 && cover(&program, 100.0) > 0.0);
    assert_eq!(cover(&program, 0.0), 0.0);
    program.app.world_mut().despawn(west);
    program.app.update();
    assert!(cover(&program, -100.0) == 0.0 && cover(&program, 100.0) > 0.0);
    program.app.world_mut().entity_mut(east).remove::<Forest3d>();
    program.app.update();
    assert!(program.forest(east).is_none(), "what the renderer draws goes with the component");
    assert!(program.ground(ground).is_some_and(|ground| ground.cover.is_none()));
}

#[test]
fn a_changed_file_builds_the_forest_anew_and_a_broken_one_leaves_it() {
    let mut program = program();
    let plant = program.load("small.species.ron");
    let forest = program.spawn(Forest3d::scatter(50.0).of(plant, 1.0));
    program.until_heard(|heard| heard.ready.len() == 1);
    assert_eq!(program.forest(forest).map(|forest| forest.plants.len()), Some(1));

    program.write("small.species.ron", species(3, (8.0, 12.0)).as_bytes());
    program.server().reload("small.species.ron");
    program.until_heard(|heard| heard.ready.len() == 2);
    assert_eq!(program.forest(forest).map(|forest| forest.plants.len()), Some(3));

    program.write("small.species.ron", b"(name: \"small\", plant: Gltf(files: [\"gone.glb\"]))");
    program.server().reload("small.species.ron");
    program.until_heard(|heard| !heard.failed.is_empty());
    let (entity, error) = program.heard().failed[0].clone();
    assert_eq!(entity, forest);
    assert!(error.contains("gone.glb") && error.contains("check the path"), "{error}");
    assert_eq!(program.forest(forest).map(|forest| forest.plants.len()), Some(3));

    program.write("small.species.ron", species(2, (8.0, 12.0)).as_bytes());
    program.server().reload("small.species.ron");
    program.until_heard(|heard| heard.ready.len() == 3);
    assert_eq!(program.forest(forest).map(|forest| forest.plants.len()), Some(2));
}

/// Bevy reads a file that failed a second time. Where that second read began before the failure was heard, the forest of
/// the file before it was built again.
#[cfg(unix)]
#[test]
fn a_failure_heard_while_the_file_is_read_again_builds_nothing() {
    let mut program = program();
    let path = program.folder.path().join("small.species.ron");
    let plant = program.load::<PlantAsset>("small.species.ron");
    program.spawn(Forest3d::scatter(50.0).of(plant.clone(), 1.0));
    program.until_heard(|heard| heard.ready.len() == 1);
    program.write("small.species.ron", b"broken");
    let server = program.server();
    server.reload("small.species.ron");
    program.until_heard(|heard| heard.failed.len() == 1);

    // A pipe: it is being read until this test writes to it.
    std::fs::remove_file(&path).expect("the species file");
    let made = std::process::Command::new("mkfifo").arg(&path).status().expect("mkfifo runs");
    assert!(made.success());
    let again = program.load::<PlantAsset>("small.species.ron");
    program.until(|_| matches!(server.load_state(&again), LoadState::Loading));
    let error = AssetLoadError::RequestedHandleTypeMismatch {
        path: "small.species.ron".into(),
        requested: TypeId::of::<PlantAsset>(),
        actual_asset_name: "plant",
        loader_name: "test",
    };
    let failure = AssetLoadFailedEvent { id: plant.id(), path: "small.species.ron".into(), error };
    program.app.world_mut().write_message(failure);
    for _ in 0..2000 {
        program.app.update();
        std::thread::yield_now();
    }
    assert_eq!((program.heard().ready.len(), program.heard().failed.len()), (1, 1));
    // Ends the read, whose thread would wait for ever. Opened for both, a pipe does not wait for its other end, which may be gone.
    std::fs::File::options().read(true).write(true).open(&path).expect("the pipe");
}

#[test]
fn what_cannot_be_built_is_said_once() {
    let mut program = program();
    program.write("broken.glb", &tree()[..100]);
    let (plane, plant) = (program.plane(100.0), program.load::<PlantAsset>("small.species.ron"));
    let ground = program.spawn(Terrain3d(plane));
    let nowhere = program.spawn(Name::new("no terrain"));
    let broken = program.load("broken.glb");
    let dense = Forest3d::scatter(5000.0).min_distance(50.0).on(ground).of(plant.clone(), 1.0);
    let cases = [
        (Forest3d::scatter(100.0).on(ground), "add one, as in"),
        (Forest3d::scatter(100.0).on(nowhere).of(plant.clone(), 1.0), "no `Terrain3d`; give it one"),
        (Forest3d::scatter(100.0).of(broken, 1.0), "broken.glb"),
        (Forest3d::scatter(-1.0).of(plant.clone(), 1.0), "`trees.stems_per_hectare` is -1"),
        (dense, "min_distance"),
        (Forest3d::of_inventory(InventoryTrees::new("none.csv")).of(plant.clone(), 1.0), "none.csv"),
    ];
    for (number, (forest, words)) in cases.into_iter().enumerate() {
        let entity = program.spawn(forest);
        program.until_heard(|heard| heard.failed.len() > number);
        let (failed, error) = program.heard().failed[number].clone();
        assert_eq!(failed, entity);
        assert!(error.contains(words), "no `{words}` in {error}");
    }
    for _ in 0..50 {
        program.app.update();
    }
    assert_eq!((program.heard().failed.len(), program.heard().ready.len()), (6, 0));

    program.write("broken.tif", b"nothing");
    let map = program.load("broken.tif");
    let terrain = program.spawn(Terrain3d(map));
    program.until_heard(|heard| !heard.failed_terrains.is_empty());
    let (failed, error) = &program.heard().failed_terrains[0];
    assert!(*failed == terrain && error.contains("broken.tif") && error.contains("gdal_translate"), "{error}");
}

#[test]
fn a_change_of_the_component_builds_anew_and_one_of_the_settings_does_not() {
    let mut program = program();
    let plant = program.load("small.species.ron");
    let forest = program.spawn(Forest3d::scatter(50.0).of(plant, 1.0));
    program.until_heard(|heard| heard.ready.len() == 1);
    let stand = program.forest(forest).map(|forest| forest.stand.clone()).expect("a forest");

    let crosses = Levels::only(Representation::CROSS);
    let world = program.app.world_mut();
    world.entity_mut(forest).insert(ForestSettings { levels: crosses.clone(), view_distance: 700.0 });
    program.app.update();
    let shown = program.forest(forest).expect("a forest");
    assert!(shown.levels == crosses && shown.view_distance == 700.0 && Arc::ptr_eq(&shown.stand, &stand));

    let mut wanted = program.app.world_mut().get_mut::<Forest3d>(forest).expect("a forest");
    wanted.seed = 9;
    program.until_heard(|heard| heard.ready.len() == 2);
    let shown = program.forest(forest).expect("a forest");
    assert!(shown.stand != stand && shown.view_distance == 700.0);
}

#[test]
fn level_ground_is_where_the_forest_is() {
    let mut program = program();
    let plant = program.load("small.species.ron");
    let tree = |x: f64, scale: f32| Tree {
        position: DVec3::new(x, 2.0, 0.0),
        yaw: 0.0,
        scale,
        variant: 0,
        tint: 0.0,
        index: 0,
    };
    let trees = vec![tree(0.0, 1.0), tree(30.0, 2.0)];
    // The renderer adds the entity's own transform.
    let at = Transform::from_xyz(100.0, 5.0, -50.0);
    let forest = program.spawn((Forest3d::of_trees(trees).of(plant, 1.0), at));
    program.until_heard(|heard| heard.ready.len() == 1);
    let shown = program.forest(forest).expect("a forest");
    assert_eq!((shown.stand.trees.len(), shown.origin), (2, DVec3::ZERO));
    assert!((shown.stand.trees[1].position(&shown.stand.grid) - DVec3::new(30.0, 2.0, 0.0)).length() < 0.01);
    program.app.world_mut().entity_mut(forest).insert(Transform::from_xyz(1.0, 0.0, 0.0));
    program.app.update();
    assert_eq!(program.forest(forest).map(|forest| forest.origin), Some(DVec3::ZERO));
    assert_eq!(program.heard().ready.len(), 1, "nothing is built anew");
}

#[test]
fn an_inventory_stands_where_its_rows_say() {
    let mut program = program();
    program.write("trees.csv", b"x,y,height\n10,20,9\n-5,0,11\n");
    let (plant, path) = (program.load("small.species.ron"), program.folder.path().join("trees.csv"));
    let forest = program.spawn(Forest3d::of_inventory(InventoryTrees::new(path)).of(plant, 1.0));
    program.until_heard(|heard| heard.ready.len() == 1);
    let stand = program.forest(forest).map(|forest| forest.stand.clone()).expect("a forest");
    let near = |x: f64, z: f64| {
        let place = DVec3::new(x, 0.0, z);
        stand.trees.iter().any(|tree| (tree.position(&stand.grid) - place).length() < 0.2)
    };
    assert!(stand.trees.len() == 2 && near(10.0, -20.0) && near(-5.0, 0.0));
}

#[test]
fn another_terrain_takes_the_place_of_the_one_before() {
    let mut program = program();
    program.write("hill.asc", b"ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 100\n50 50\n50 50\n");
    let (plane, hill) = (program.plane(100.0), program.load::<TerrainMap>("hill.asc"));
    let plant = program.load("small.species.ron");
    let ground = program.spawn(Terrain3d(plane));
    let forest = program.spawn(Forest3d::scatter(200.0).on(ground).of(plant, 1.0));
    program.until_heard(|heard| heard.ready.len() == 1);
    let height = |forest: &Forest| forest.stand.trees[0].y;
    assert!(program.forest(forest).is_some_and(|forest| height(forest) < 1.0));

    program.app.world_mut().entity_mut(ground).insert(Terrain3d(hill));
    program.until_heard(|heard| heard.ready.len() == 2);
    assert!(program.forest(forest).is_some_and(|forest| height(forest) > 49.0));
    assert_eq!(program.heard().terrains, [ground, ground]);

    let settings = TerrainSettings { error_pixels: 4.0, view_distance: 900.0 };
    program.app.world_mut().entity_mut(ground).insert(settings);
    program.app.update();
    assert_eq!(program.ground(ground).map(|ground| (ground.error_pixels, ground.view_distance)), Some((4.0, 900.0)));
    assert_eq!(program.heard().terrains.len(), 2);

    program.app.world_mut().entity_mut(ground).remove::<Terrain3d>();
    program.app.update();
    assert!(program.ground(ground).is_none());
    assert!(program.forest(forest).is_some(), "the forest stays and says what it lacks");
    assert!(program.heard().failed[0].1.contains("no `Terrain3d`"));
}

#[test]
fn unused_assets_are_freed() {
    let mut program = program();
    let plant = program.load::<PlantAsset>("small.species.ron");
    let forest = program.spawn(Forest3d::scatter(50.0).of(plant, 1.0));
    // At once, while the file is being read.
    program.app.world_mut().despawn(forest);
    for _ in 0..100 {
        program.app.update();
        std::thread::yield_now();
    }
    let plants = |world: &World| world.resource::<Assets<PlantAsset>>().len();
    program.until(|world| plants(world) == 0);

    let plant = program.load::<PlantAsset>("small.species.ron");
    let forest = program.spawn(Forest3d::scatter(50.0).of(plant, 1.0));
    program.until_heard(|heard| heard.ready.len() == 1);
    let held = program.forest(forest).map(|forest| forest.plants.clone()).expect("a forest");
    program.app.world_mut().despawn(forest);
    program.until(|world| plants(world) == 0);
    assert_eq!(Arc::strong_count(&held), 1);
    assert!(program.heard().failed.is_empty());
}
