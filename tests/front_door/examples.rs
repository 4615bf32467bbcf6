//! The examples, drawn without a window.

use std::time::Duration;

use bevy::{prelude::*, render::RenderApp, time::TimeUpdateStrategy};
use canopy::{
    app::Renderer,
    components::DrawnSun,
    prelude::*,
    render::{
        forest::{ForestStatistics, GpuForests},
        report::{FrameReport, PassOutcome},
    },
    scene::{Pose, Viewpoint},
};

use super::PATIENCE;
use crate::support::gpu::gpu;

#[expect(dead_code, reason = "its window")]
#[path = "../../examples/forest_in_code.rs"]
mod forest_in_code;

#[expect(dead_code, reason = "its window")]
#[path = "../../examples/clock.rs"]
mod clock;

#[expect(dead_code, reason = "its file")]
#[path = "../../examples/headless.rs"]
mod headless;

#[expect(dead_code, reason = "its window")]
#[path = "../../examples/meshes.rs"]
mod meshes;

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
    let view = Pose { position: (0.0, 250.0, 0.0), yaw: 0.0, pitch: -90.0 }.viewpoint(ground, 60.0);
    assert!(drawn(&mut renderer, &view) > 1000);
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn two_forests_are_both_drawn() {
    let gpu = gpu();
    let mut renderer = run(two_forests::plugin, 2);
    let ready = renderer.app().world().resource::<Heard>().ready.clone();
    let view = Pose { position: (0.0, 250.0, 0.0), yaw: 0.0, pitch: -90.0 }.viewpoint(0.0, 60.0);
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

#[test]
fn a_program_without_a_window_draws_a_whole_image() {
    let gpu = gpu();
    let size = UVec2::new(192, 108);
    let image = headless::draw("assets/scenes/inventory.ron", size).expect("an image");
    let again = headless::draw("assets/scenes/inventory.ron", size).expect("an image");
    assert!(image == again, "two images differ");
    // The sky is bright and blue, the trees below it are not.
    let mean = |rows: std::ops::Range<u32>| {
        let pixels = rows.clone().flat_map(|y| (0..size.x).map(move |x| (x, y)));
        let sum = pixels.fold(Vec3::ZERO, |sum, (x, y)| sum + Vec3::from(image.get_pixel(x, y).0.map(f32::from)));
        sum / (rows.len() as f32 * size.x as f32)
    };
    let (sky, ground) = (mean(0..10), mean(80..108));
    assert!(sky.z > sky.x && sky.z > 100.0 && ground.z < 0.7 * sky.z, "{sky} over {ground}");
    assert_eq!(gpu.messages(), Vec::<String>::new());
    assert!(headless::draw("assets/scenes/absent.ron", size).is_err());
}

/// Runs the example until its scene is shown.
#[track_caller]
fn run_scene(example: fn(&mut App)) -> Renderer {
    let mut renderer = Renderer::new((192, 108), None, 1).expect("a renderer");
    let app = renderer.app();
    example(app);
    app.add_observer(|failed: On<SceneFailed>| panic!("{}", *failed));
    for _ in 0..PATIENCE {
        app.update();
        let world = app.world_mut();
        if world.query::<&LoadedScene>().iter(world).next().is_some() {
            return renderer;
        }
        std::thread::yield_now();
    }
    panic!("in vain");
}

#[test]
fn a_clock_that_runs_moves_the_light_beside_the_frames() {
    let gpu = gpu();
    let mut renderer = run_scene(clock::plugin);
    let app = renderer.app();
    // A tenth of a second a frame: 72 seconds of the example's clock.
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(100)));
    let drawn = |app: &App| app.world().resource::<DrawnSun>().0.instant;
    let (start, mut frames) = (drawn(app), 0);
    while drawn(app) == start && frames < PATIENCE {
        app.update();
        std::thread::yield_now();
        frames += 1;
    }
    let world = app.world_mut();
    let sun = world.query::<&Sun>().single(world).expect("one sun, the program's").instant;
    assert!(start < drawn(app) && drawn(app) <= sun, "{start} {} {sun}", drawn(app));
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn ordinary_meshes_give_and_take_shadow() {
    let gpu = gpu();
    let mut renderer = run_scene(meshes::plugin);
    let view = Pose { position: (0.0, 12.0, 26.0), yaw: 0.0, pitch: -25.0 }.viewpoint(0.0, 60.0);
    assert_eq!(drawn(&mut renderer, &view), 1);
    let world = renderer.app().world_mut();
    assert_eq!(world.query_filtered::<(), (With<Mesh3d>, With<CastsCanopyShadow>)>().iter(world).count(), 2);
    let outcomes = world.resource::<FrameReport>().outcomes();
    let ran =
        |pass: &str| outcomes.iter().any(|(name, outcome)| name == pass && matches!(outcome, PassOutcome::Ran(_)));
    assert!(ran("mesh_shadow"), "{outcomes:?}");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}
