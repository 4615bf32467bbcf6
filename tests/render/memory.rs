//! Memory stays flat from frame to frame. A software driver that compiles a shader again for each value of a uniform keeps
//! every one of them ([`super::super::shaders`] has the rule that prevents it).

use std::{env, process::Command};

use super::{NOON, again, showing};
use crate::support::{
    gpu::gpu,
    stage::{PLACE, build, instant, quality, view},
};

/// Set to a lighting in the process that draws.
const LIGHTING: &str = "CANOPY_TEST_LIGHTING";
const MARK: &str = "growth per frame:";
/// Frames before the first measurement, and from one to the next.
const FRAMES: (usize, usize) = (10, 8);
/// Measurements after the first. The middle growth counts: what is allocated once, when a thread or a buffer is first
/// needed, is no growth.
const WINDOWS: usize = 5;
/// Bytes. A frame on the software driver grew by 4 to 5 MB while a shader branched on a uniform.
const MOST_PER_FRAME: i64 = 600 << 10;

/// Resident memory of this process in bytes; `None` where the system does not say.
fn resident() -> Option<i64> {
    let pages = std::fs::read_to_string("/proc/self/statm").ok()?;
    Some(pages.split_whitespace().nth(1)?.parse::<i64>().ok()? * 4096)
}

/// Draws a flight, and prints by how much a frame grows the memory.
#[test]
#[ignore = "runs in a process of its own, started by memory_stays_flat"]
fn fly_and_measure() {
    let Ok(lighting) = env::var(LIGHTING) else { return };
    let _gpu = gpu();
    let quality = quality(1);
    let built = build(
        &format!(
            "(terrain: Noise(size: 400, amplitude: 20, seed: 3), {PLACE}, {quality}, trees: Scattered(stems_per_hectare: 200), \
             species: [(name: \"oak\", plant: Grown(individuals: 2, triangles: 5000), lighting: {lighting})])"
        ),
        &[],
    );
    let mut renderer = showing(&built.stage);
    renderer.set_instant(&built.stage, instant(NOON));
    let mut frame = |number: usize| {
        let along = number as f64;
        renderer.set_view(&view(&built.stage, (along, 15.0, 40.0 - along), 5.0 * along, -5.0));
        again(&mut renderer);
    };
    (0..FRAMES.0).for_each(&mut frame);
    let Some(mut before) = resident() else { return };
    let mut growths: Vec<i64> = (0..WINDOWS)
        .filter_map(|window| {
            let first = FRAMES.0 + window * FRAMES.1;
            (first..first + FRAMES.1).for_each(&mut frame);
            let after = resident()?;
            Some(after - std::mem::replace(&mut before, after))
        })
        .collect();
    growths.sort_unstable();
    if let Some(middle) = growths.get(WINDOWS / 2) {
        println!("{MARK} {} {growths:?}", middle / FRAMES.1 as i64);
    }
}

#[test]
fn memory_stays_flat() {
    let _gpu = gpu();
    let program = env::current_exe().expect("a test has a program");
    for lighting in ["Local", "Expressive()", "Transfer(rays: 64)"] {
        let output = Command::new(&program)
            .args(["render::memory::fly_and_measure", "--exact", "--ignored", "--nocapture"])
            .env(LIGHTING, lighting)
            .output()
            .expect("the tests can be started again");
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{lighting}: {said}\n{}", String::from_utf8_lossy(&output.stderr));
        let number = |line: &str| line.split_once(MARK)?.1.split_whitespace().next()?.parse::<i64>().ok();
        let growth = said.lines().find_map(number);
        if cfg!(target_os = "linux") {
            let growth = growth.unwrap_or_else(|| panic!("{lighting}: nothing was measured: {said}"));
            println!("{lighting}: {growth} bytes a frame");
            assert!(growth < MOST_PER_FRAME, "{lighting}: memory grows by {growth} bytes a frame");
        }
    }
}
