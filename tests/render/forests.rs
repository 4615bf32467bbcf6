//! Forests that lack something, and what forests leave on the device.

use std::sync::Arc;

use bevy::{
    prelude::*,
    render::{RenderApp, renderer::RenderInstance},
};
use canopy::{
    app::Renderer,
    assets::Stage,
    bake::BakedPlant,
    render::components::{Forest, Ground},
    scatter::{PackedStand, PlantSize, Stand, packed::DEFAULT_CELL_SIZE},
};

use glam::DVec2;

use super::{NOON, again, despawn, draw, renderer, showing};
use crate::support::{
    gpu::gpu,
    stage::{grove, trees_at, view},
};

/// A renderer that shows the ground of `stage` alone.
fn bare(stage: &Stage) -> Renderer {
    let mut renderer = showing(stage);
    despawn::<With<Forest>>(&mut renderer);
    renderer
}

#[test]
fn a_forest_without_trees_or_plants_draws_nothing_and_is_no_error_of_the_device() {
    let gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    // So far and near that cells are taken as wholes, and trees one by one.
    let from = view(stage, (0.0, 30.0, 90.0), 0.0, -15.0);
    let whole = stage.forest().expect("a forest");
    let mut renderer = bare(stage);
    draw(&mut renderer, stage, &from, NOON);
    let nothing = again(&mut renderer);
    let sizes: Vec<PlantSize> = whole.plants.iter().map(BakedPlant::size).collect();
    let no_trees =
        Arc::new(PackedStand::new(&Stand { trees: Vec::new() }, DEFAULT_CELL_SIZE, &sizes).expect("no trees"));
    let no_plants = Arc::new(Vec::new());
    let without_trees = Forest { stand: no_trees.clone(), ..whole.clone() };
    let without_both = Forest { plants: no_plants.clone(), ..without_trees.clone() };
    for forest in [without_trees, without_both] {
        let entity = renderer.app().world_mut().spawn(forest).id();
        assert!(draw(&mut renderer, stage, &from, NOON) == nothing);
        renderer.app().world_mut().despawn(entity);
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());

    let without_plants = Forest { plants: no_plants, ..whole.clone() };
    let entity = renderer.app().world_mut().spawn(without_plants).id();
    for _ in 0..3 {
        assert!(draw(&mut renderer, stage, &from, NOON) == nothing);
    }
    let messages = gpu.messages();
    assert!(messages.len() == 1 && messages[0].contains("has 0 plants"), "{messages:?}");
    // With its plants it is drawn.
    renderer.app().world_mut().entity_mut(entity).insert(whole);
    assert!(draw(&mut renderer, stage, &from, NOON) != nothing);
    assert_eq!(gpu.messages().len(), 1);
}

/// Buffers, textures and bind groups that the program holds. Views and samplers are held by bind groups.
pub(super) fn objects(renderer: &mut Renderer) -> [usize; 3] {
    let instance = renderer.app().sub_app(RenderApp).world().resource::<RenderInstance>();
    let report = instance.generate_report().expect("a report of a native device");
    let hub = report.hub_report();
    [&hub.buffers, &hub.textures, &hub.bind_groups].map(|registry| registry.num_kept_from_user)
}

#[test]
fn forests_that_come_and_go_leave_nothing_on_the_device() {
    let gpu = gpu();
    let built = grove(1);
    let stage = &built.stage;
    let from = view(stage, (0.0, 10.0, 60.0), 0.0, -5.0);
    let mut renderer = bare(stage);
    let (mut counts, mut most) = (Vec::new(), [0; 3]);
    for _ in 0..100 {
        renderer.app().world_mut().spawn(stage.forest().expect("a forest"));
        draw(&mut renderer, stage, &from, NOON);
        most = objects(&mut renderer);
        despawn::<With<Forest>>(&mut renderer);
        draw(&mut renderer, stage, &from, NOON);
        again(&mut renderer);
        counts.push(objects(&mut renderer));
    }
    // The first forest brings what stays: pipelines' layouts, shadow maps, the tables of light.
    assert_eq!(counts.last(), counts.get(1), "{counts:?}");
    // What a forest holds is counted.
    assert!(
        counts.iter().all(|count| (0..3).all(|kind| 0 < count[kind] && count[kind] < most[kind])),
        "{most:?}, {counts:?}"
    );
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn scenes_that_replace_each_other_leave_nothing_on_the_device() {
    let gpu = gpu();
    let scenes = [grove(1), trees_at(&[DVec2::ZERO, DVec2::new(12.0, -5.0)], 1)];
    let mut renderer = renderer(1);
    let mut counts = Vec::new();
    for change in 0..20 {
        let stage = &scenes[change % 2].stage;
        despawn::<Or<(With<Forest>, With<Ground>)>>(&mut renderer);
        renderer.show(stage);
        draw(&mut renderer, stage, &view(stage, (0.0, 10.0, 60.0), 0.0, -5.0), NOON);
        again(&mut renderer);
        counts.push(objects(&mut renderer));
    }
    // The first change to either scene brings what stays.
    assert!((4..20).all(|change| counts[change] == counts[change - 2]), "{counts:?}");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}
