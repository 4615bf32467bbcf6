//! Question: what do the timestamps and counters of `canopy profile` cost of a frame?
//!
//! The field of `peer` is drawn by two renderers in one process, whose frames alternate in both orders: one as it is, and one with Bevy's
//! `RenderDiagnosticsPlugin`, which writes timestamps and counts shader calls of each pass. A frame's time runs from before `App::update`
//! until the device has finished it.
//!
//! `cargo bench --bench profiling -- --help` lists the arguments.

#[path = "peer/field.rs"]
#[expect(dead_code, reason = "another benchmark uses the rest")]
mod field;
#[path = "peer/ours.rs"]
#[expect(dead_code, reason = "another benchmark uses the rest")]
mod ours;

use std::time::Instant;

use anyhow::Context;
use canopy::measure::Interval;
use clap::Parser;

use field::{Field, Look};
use ours::Ours;

/// A frame that is measured against one that is not.
#[derive(Parser, Debug)]
#[command(name = "profiling")]
struct Arguments {
    /// Trees, at 282 a hectare.
    #[arg(long, default_value_t = 5_000)]
    trees: u32,
    /// Timed pairs of frames.
    #[arg(long, default_value_t = 60)]
    frames: usize,
    /// Untimed pairs before.
    #[arg(long, default_value_t = 4)]
    warm_up: usize,
    /// Cargo says so to every benchmark; nothing depends on it.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let field = Field::new(&field::plant(None)?, arguments.trees, Look::default())?;
    let mut plain = Ours::new(&field)?;
    let mut measured = Ours::new(&field)?;
    measured.measure();
    let time = |ours: &mut Ours, frame: usize| -> anyhow::Result<f64> {
        let start = Instant::now();
        ours.light(&field.sky(frame, false));
        ours.place(&field.view(frame));
        ours.frame()?;
        Ok(1e3 * start.elapsed().as_secs_f64())
    };
    let (mut there, mut back, mut times) = (Vec::new(), Vec::new(), Vec::new());
    for frame in 0..arguments.warm_up + arguments.frames {
        // Who comes first changes with each pair; the camera rests for both of them.
        let (of_plain, of_measured) = if frame % 2 == 0 {
            let first = time(&mut plain, frame)?;
            (first, time(&mut measured, frame)?)
        } else {
            let first = time(&mut measured, frame)?;
            (time(&mut plain, frame)?, first)
        };
        if frame >= arguments.warm_up {
            if frame % 2 == 0 { &mut there } else { &mut back }.push((of_measured / of_plain).ln());
            times.push(of_plain);
        }
    }
    let ratio = Interval::of_alternating(&there, &back).context("too few frames")?.exp();
    times.sort_by(f64::total_cmp);
    println!(
        "{} trees, {} pairs of frames, median {:.1} ms: measuring takes {:.2} % of a frame (95 %: {:.2} to {:.2})",
        arguments.trees,
        times.len(),
        times.get(times.len() / 2).copied().unwrap_or(f64::NAN),
        100.0 * (ratio.value - 1.0),
        100.0 * (ratio.low - 1.0),
        100.0 * (ratio.high - 1.0),
    );
    Ok(())
}
