//! The examples, drawn without a window.

use bevy::{prelude::*, render::RenderApp};
use canopy::{
    app::Renderer,
    prelude::*,
    render::forest::{ForestStatistics, GpuForests},
    scene::{Pose, Viewpoint},
};

use super::PATIENCE;
use crate::support::gpu::gpu;

#[expect(dead_code, reason = "its window")]
#[path = "../../examples/forest_in_code.rs"]
mod forest_in_code;

#[expect(dead_code, reason = "its window")]
#[path = "../../examples/two_forests.rs"]
mod two_forests;

/// Forests that are ready, and why others are not.
#[derive(Resource, Default)]
struct Heard {
    ready: Vec<(Entity, usize)>,
    failed: Vec<String>,
}

/// Runs the example until `forests` are ready.
#[track_caller]
fn run(example: fn(&mut App), forests: usize) -> Renderer {
    let mut renderer = Renderer::new((192, 108), None, 1).expect("a renderer");
    let app = renderer.app();
    // The renderer's app has its plugins; the example's is a function.
    example(app);
    app.init_resource::<Heard>();
    app.add_observer(|event: On<ForestReady>, mut heard: ResMut<Heard>| heard.ready.push((event.entity, event.trees)));
    app.add_observer(|event: On<ForestFailed>, mut heard: ResMut<Heard>| heard.failed.push(event.error.to_string()));
    for _ in 0..PATIENCE {
        let heard = app.world().resource::<Heard>();
        assert_eq!(heard.failed, Vec::<String>::new());
        if heard.ready.len() == forests {
            return renderer;
        }
        app.update();
        std::thread::yield_now();
    }
    panic!("in vain");
}

/// Trees that a view from above draws.
#[track_caller]
fn drawn(renderer: &mut Renderer, view: &Viewpoint) -> usize {
    renderer.set_view(view);
    // What was spawned is on the device in the second frame.
    for _ in 0..2 {
        renderer.update().expect("a frame");
    }
    renderer.app().sub_app(RenderApp).world().resource::<ForestStatistics>().trees()
}

#[test]
fn forest_in_code_draws_its_trees() {
    let gpu = gpu();
    let mut renderer = run(forest_in_code::plugin, 1);
    let world = renderer.app().world_mut();
    let trees = world.resource::<Heard>().ready[0].1;
    assert!(trees > 1000, "{trees} trees on nine hectares");
    let map = world.query::<&Terrain3d>().single(world).expect("a terrain").0.clone();
    let ground = world.resource::<Assets<TerrainMap>>().get(&map).expect("a map").terrain.height(0.0, 0.0);
    let view = Pose { position: (0.0, 500.0, 0.0), yaw: 0.0, pitch: -90.0 }.viewpoint(ground, 60.0);
    assert!(drawn(&mut renderer, &view) > 1000);
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn two_forests_are_both_drawn() {
    let gpu = gpu();
    let mut renderer = run(two_forests::plugin, 2);
    let ready = renderer.app().world().resource::<Heard>().ready.clone();
    let view = Pose { position: (0.0, 500.0, 0.0), yaw: 0.0, pitch: -90.0 }.viewpoint(0.0, 60.0);
    let both = drawn(&mut renderer, &view);
    let on_device = renderer.app().sub_app(RenderApp).world().resource::<GpuForests>().iter().count();
    assert_eq!(on_device, 2);
    renderer.app().world_mut().despawn(ready[0].0);
    let one = drawn(&mut renderer, &view);
    assert!(0 < one && one < both, "{one} of {both}");
    renderer.app().world_mut().despawn(ready[1].0);
    assert_eq!(drawn(&mut renderer, &view), 0);
    assert_eq!(gpu.messages(), Vec::<String>::new());
}
