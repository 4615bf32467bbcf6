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
    render::components::{Forest, SunShadowSettings},
    scene::{GltfPlants, GroundNoise, Pose, ScatteredTrees, Scene, Species},
};

use super::Arguments;

/// Frames before the forest appears, and after.
const NEIGHBOURS: usize = 4;

/// Times the frames around the appearance of a forest.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let name = |path: &PathBuf| path.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let species = |path: &PathBuf| {
        let plants = GltfPlants { files: vec![path.clone()], foliage: Vec::new(), wood: Vec::new() };
        Species::new(name(path), plants)
    };
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
    frames(&mut renderer)?;
    println!("| time | ground alone | the forest appears | and stays |\n|---|---|--:|---|");
    for turn in 1..=arguments.turns {
        let before = frames(&mut renderer)?;
        let forest = stage.forest().context("the scene has no trees")?;
        renderer.app().world_mut().spawn(forest);
        let appearing = frame(&mut renderer)?;
        let after = frames(&mut renderer)?;
        println!("| {turn} | {} | {appearing:.3} | {} |", list(&before), list(&after));
        let world = renderer.app().world_mut();
        let shown: Vec<Entity> = world.query_filtered::<Entity, With<Forest>>().iter(world).collect();
        shown.into_iter().for_each(|entity| _ = world.despawn(entity));
        frames(&mut renderer)?;
    }
    Ok(())
}

/// Seconds of a frame.
fn frame(renderer: &mut Renderer) -> anyhow::Result<f64> {
    let started = Instant::now();
    renderer.update()?;
    Ok(started.elapsed().as_secs_f64())
}

fn frames(renderer: &mut Renderer) -> anyhow::Result<Vec<f64>> {
    (0..NEIGHBOURS).map(|_| frame(renderer)).collect()
}

fn list(seconds: &[f64]) -> String {
    seconds.iter().map(|seconds| format!("{seconds:.3}")).collect::<Vec<_>>().join(" ")
}
