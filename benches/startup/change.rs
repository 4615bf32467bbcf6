//! How long does a program wait from another scene on the same entity to `SceneReady`, and to the frame that draws it?
//!
//! Both scenes were built before, so plants come from the cache. Frames run on meanwhile, as in a program with a window.

use std::time::Instant;

use anyhow::{Context, bail};
use bevy::ecs::{observer::On, resource::Resource, system::ResMut};
use canopy::{
    app::Renderer,
    components::{CanopyScene, LoadedScene, SceneFailed, SceneReady},
    render::{
        components::ForestUpdates,
        report::{FrameReport, PassOutcome},
    },
    scene::Pose,
};

use super::Arguments;

/// What was heard of the last scene.
#[derive(Resource, Default)]
struct Heard(Option<Result<(), String>>);

/// Times changes between the scene of the arguments and another one.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let scenes = [&arguments.scene, &arguments.other];
    let mut renderer = Renderer::new(arguments.size, None, 1)?;
    let app = renderer.app();
    app.insert_resource(ForestUpdates::Spread).init_resource::<Heard>();
    app.add_observer(|_: On<SceneReady>, mut heard: ResMut<Heard>| heard.0 = Some(Ok(())));
    app.add_observer(|failed: On<SceneFailed>, mut heard: ResMut<Heard>| heard.0 = Some(Err(failed.to_string())));
    let entity = app.world_mut().spawn_empty().id();
    println!("| scene | to SceneReady, s | to its first frame, s | longest frame meanwhile, s | its frames: median |");
    println!("|---|--:|--:|--:|--:|");
    for change in 0..2 * (arguments.turns + 1) {
        let path = scenes[change % 2];
        let world = renderer.app().world_mut();
        world.insert_resource(Heard::default());
        let started = Instant::now();
        world.entity_mut(entity).insert(CanopyScene::new(path.clone()));
        let (mut ready, mut longest) = (None, 0.0_f64);
        loop {
            longest = longest.max(frame(&mut renderer)?);
            if ready.is_none() {
                match renderer.app().world_mut().resource_mut::<Heard>().0.take() {
                    Some(Ok(())) => ready = Some(started.elapsed().as_secs_f64()),
                    Some(Err(why)) => bail!(why),
                    None => {}
                }
                if ready.is_some() {
                    let loaded = renderer.app().world().get::<LoadedScene>(entity).context("no scene")?;
                    let height = loaded.stage.terrain.height(0.0, 0.0);
                    let pose = Pose { position: (0.0, 30.0, 0.0), yaw: 0.0, pitch: -10.0 };
                    renderer.set_view(&pose.viewpoint(height, 50.0));
                }
            } else if is_drawn(&mut renderer) {
                break;
            }
        }
        let (ready, drawn) = (ready.unwrap_or(f64::NAN), started.elapsed().as_secs_f64());
        let mut times = (0..20).map(|_| frame(&mut renderer)).collect::<anyhow::Result<Vec<_>>>()?;
        times.sort_by(f64::total_cmp);
        let median = times.get(times.len() / 2).copied().unwrap_or(f64::NAN);
        // The first time of each fills the caches.
        if change >= 2 {
            println!("| {} | {ready:.2} | {drawn:.2} | {longest:.2} | {median:.2} |", path.display());
        }
    }
    Ok(())
}

fn frame(renderer: &mut Renderer) -> anyhow::Result<f64> {
    let started = Instant::now();
    renderer.update()?;
    Ok(started.elapsed().as_secs_f64())
}

/// Whether the last frame drew all forests that there are.
fn is_drawn(renderer: &mut Renderer) -> bool {
    let outcomes = renderer.app().world().resource::<FrameReport>().outcomes();
    let ran =
        |name: &str| outcomes.iter().any(|(pass, outcome)| pass == name && matches!(outcome, PassOutcome::Ran(_)));
    ran("forest") && !ran("forest upload")
}
