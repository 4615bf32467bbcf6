//! How long are the frames around the one in which a forest appears?
//!
//! The plants come from the cache. The ground is drawn for some frames, then the forest is spawned, drawn, and despawned,
//! several times: the first time brings its pipelines too. A frame's time includes the device.

use std::{path::PathBuf, time::Instant};

use anyhow::Context;
use bevy::ecs::{entity::Entity, query::With};
use canopy::{
    app::Renderer,
    assets::Stage,
    progress::Silent,
    render::{
        components::{Forest, ForestUpdates, SunShadowSettings},
        report::{FrameReport, PassOutcome},
    },
    scene::{GltfPlants, GroundNoise, Pose, ScatteredTrees, Scene, Species},
};

use super::Arguments;

/// Frames before the forest is spawned.
const NEIGHBOURS: usize = 4;
/// Frames after the one that draws it first. In the last ones it has all its shadows.
const AFTER: usize = 24;

/// Times the frames around the appearance of a forest.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let name = |path: &PathBuf| path.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let species = |path: &PathBuf| Species::new(name(path), GltfPlants::new([path]));
    let scene = Scene {
        species: arguments.appear.iter().map(species).collect(),
        trees: ScatteredTrees { stems_per_hectare: arguments.stems, ..ScatteredTrees::default() }.into(),
        ..Scene::new(GroundNoise { size: 400.0, ..GroundNoise::default() })
    };
    // The first time fills the cache.
    Stage::build(&scene, &mut Silent)?;
    let started = Instant::now();
    let stage = Stage::build(&scene, &mut Silent)?;
    println!("scene from the cache: {:.2} s", started.elapsed().as_secs_f64());
    let mut renderer = Renderer::new(arguments.size, None, 1)?;
    renderer.app().world_mut().spawn(stage.ground());
    let cascades = if arguments.no_shadows { 0 } else { stage.shadow().cascades };
    renderer.set_shadow(SunShadowSettings { cascades, ..stage.shadow() });
    renderer.set_instant(&stage, stage.scene.place.time.utc());
    renderer.set_view(
        &Pose { position: (0.0, 20.0, 60.0), yaw: 0.0, pitch: -10.0 }.viewpoint(stage.terrain.height(0.0, 60.0), 50.0),
    );
    let updates = if arguments.blocking { ForestUpdates::Blocking } else { ForestUpdates::Spread };
    renderer.app().insert_resource(updates);
    frames(&mut renderer, NEIGHBOURS)?;
    println!(
        "| time | ground alone, s | while it arrives | first drawn | next frames | stays: median | longest / stays | longest \
         / its longer neighbour |\n|---|---|---|--:|---|--:|--:|--:|"
    );
    for turn in 1..=arguments.turns {
        let mut times = frames(&mut renderer, NEIGHBOURS)?;
        let forest = stage.forest().context("the scene has no trees")?;
        renderer.app().world_mut().spawn(forest);
        while !is_drawn(&mut renderer) {
            times.extend(frames(&mut renderer, 1)?);
        }
        let first = times.len() - 1;
        times.extend(frames(&mut renderer, AFTER)?);
        let stays = median(&times[times.len() - NEIGHBOURS..]);
        let (longest, worst) = (times[NEIGHBOURS..].iter().copied().fold(0.0, f64::max), worst(&times));
        println!(
            "| {turn} | {} | {} | {:.3} | {} | {stays:.3} | {:.2} | {worst:.2} |",
            list(&times[..NEIGHBOURS]),
            list(&times[NEIGHBOURS..first]),
            times[first],
            list(&times[first + 1..]),
            longest / stays,
        );
        let world = renderer.app().world_mut();
        let shown: Vec<Entity> = world.query_filtered::<Entity, With<Forest>>().iter(world).collect();
        shown.into_iter().for_each(|entity| _ = world.despawn(entity));
        frames(&mut renderer, NEIGHBOURS)?;
    }
    Ok(())
}

/// Whether the last frame drew trees.
fn is_drawn(renderer: &mut Renderer) -> bool {
    let outcomes = renderer.app().world().resource::<FrameReport>().outcomes();
    outcomes.iter().any(|(pass, outcome)| pass == "forest" && matches!(outcome, PassOutcome::Ran(_)))
}

/// The largest ratio of a frame to the longer one of its neighbours.
fn worst(times: &[f64]) -> f64 {
    times.windows(3).map(|three| three[1] / three[0].max(three[2])).fold(0.0, f64::max)
}

fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Seconds of a frame.
fn frame(renderer: &mut Renderer) -> anyhow::Result<f64> {
    let started = Instant::now();
    renderer.update()?;
    Ok(started.elapsed().as_secs_f64())
}

fn frames(renderer: &mut Renderer, count: usize) -> anyhow::Result<Vec<f64>> {
    (0..count).map(|_| frame(renderer)).collect()
}

fn list(seconds: &[f64]) -> String {
    seconds.iter().map(|seconds| format!("{seconds:.3}")).collect::<Vec<_>>().join(" ")
}
