//! What do time and memory cost as a forest grows?
//!
//! For each number of trees, in a process of its own: the build (plants from the cache), the first frame with its
//! uploads and pipelines, the frames of a flight, and the memory of the process. A frame's time includes the device.

use std::{process::Command, time::Instant};

use anyhow::{Context, ensure};
use canopy::{
    app::Renderer,
    assets::Stage,
    progress::Silent,
    scene::{GroundFlat, GrownPlants, Pose, ScatteredTrees, Scene, Species},
};

use super::Arguments;

/// Trees per hectare.
const STEMS: f64 = 282.0;
/// Frames of the flight: those that fill the driver's caches, and those that are reported.
const FLIGHT: (usize, usize) = (5, 40);
/// After so many seconds no further frame is begun: a frame of millions of trees takes a software driver ten and more.
const LONGEST_FLIGHT: f64 = 120.0;
/// Reported frames that are always drawn.
const FEWEST: usize = 3;

/// Prints a row for each number of trees.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    println!(
        "| trees | build, s | first frame, s | next frames | s: median | memory after the build, MB | after the flight | growth \
         of a frame, kB |\n|--:|--:|--:|--:|--:|--:|--:|--:|"
    );
    for trees in &arguments.trees {
        let size = format!("{}x{}", arguments.size.0, arguments.size.1);
        let output = Command::new(std::env::current_exe()?)
            .args(["--turn", "--size", &size, "--trees", &trees.to_string()])
            .output()?;
        ensure!(output.status.success(), "{trees} trees: {}", String::from_utf8_lossy(&output.stderr));
        print!("{}", String::from_utf8(output.stdout)?);
    }
    Ok(())
}

/// Prints the row of a forest of `trees`.
pub fn turn(arguments: &Arguments, trees: u64) -> anyhow::Result<()> {
    let size = (trees as f64 / STEMS * 1e4).sqrt();
    let scene = Scene {
        species: vec![Species::new("broadleaf", GrownPlants { individuals: 2, ..GrownPlants::default() })],
        trees: ScatteredTrees { stems_per_hectare: STEMS, ..ScatteredTrees::default() }.into(),
        ..Scene::new(GroundFlat { size })
    };
    // The first time fills the cache with plants.
    let few = Scene { terrain: GroundFlat { size: 50.0 }.into(), ..scene.clone() };
    Stage::build(&few, &mut Silent)?;
    let started = Instant::now();
    let stage = Stage::build(&scene, &mut Silent)?;
    let build = started.elapsed().as_secs_f64();
    let after_build = resident();
    let count = stage.stand.trees.len();
    let mut renderer = Renderer::new(arguments.size, None, 1)?;
    renderer.show(&stage);
    renderer.set_instant(&stage, stage.scene.place.time.utc());
    let mut frame = |number: usize| -> anyhow::Result<f64> {
        let started = Instant::now();
        let position = (0.1 * number as f64, 40.0, 0.4 * size - 3.0 * number as f64);
        let pose = Pose { position, yaw: 2.0 * number as f64, pitch: -8.0 };
        renderer.set_view(&pose.viewpoint(0.0, 50.0));
        renderer.update()?;
        Ok(started.elapsed().as_secs_f64())
    };
    let first = frame(0)?;
    let flight = Instant::now();
    let goes_on = |frames: usize| frames < FEWEST || flight.elapsed().as_secs_f64() < LONGEST_FLIGHT;
    (1..FLIGHT.0).filter(|_| goes_on(FEWEST)).try_for_each(|number| frame(number).map(|_| ()))?;
    let before = resident();
    let mut times = Vec::new();
    while times.len() < FLIGHT.1 && goes_on(times.len()) {
        times.push(frame(FLIGHT.0 + times.len())?);
    }
    let frames = times.len();
    let after = resident();
    times.sort_by(f64::total_cmp);
    let median = times.get(times.len() / 2).context("a flight without frames")?;
    let megabytes = |bytes: Option<i64>| bytes.map_or("n/a".to_owned(), |bytes| format!("{:.0}", bytes as f64 / 1e6));
    let growth = before.zip(after).map(|(before, after)| (after - before) as f64 / 1e3 / frames as f64);
    let growth = growth.map_or("n/a".to_owned(), |kilobytes| format!("{kilobytes:.0}"));
    let (after_build, after) = (megabytes(after_build), megabytes(after));
    println!("| {count} | {build:.2} | {first:.2} | {frames} | {median:.3} | {after_build} | {after} | {growth} |");
    Ok(())
}

/// Resident memory of this process in bytes; `None` where the system does not say.
fn resident() -> Option<i64> {
    let pages = std::fs::read_to_string("/proc/self/statm").ok()?;
    Some(pages.split_whitespace().nth(1)?.parse::<i64>().ok()? * 4096)
}
