//! Question: who should make the lists of drawn trees, the processor or the device, and what do more trees of the same
//! density cost?
//!
//! The field of `peer` is drawn by two renderers in one process, whose frames alternate: `ours` with lists of the
//! processor, and `ours` with lists of the device. A frame's time runs from before `App::update` until the device has
//! finished it. The camera moves in every frame. All sizes are in the run, frame after frame, so that sizes can be compared
//! as well as makers; memory for all of them must be there.
//!
//! `cargo bench --bench lists -- --help` lists the arguments.

#[path = "peer/field.rs"]
#[expect(dead_code, reason = "the other benchmark uses the rest")]
mod field;
#[path = "peer/ours.rs"]
#[expect(dead_code, reason = "another benchmark uses the rest")]
mod ours;

use std::{path::PathBuf, time::Instant};

use canopy::render::components::{TreeListMaker, TreeLists};
use clap::Parser;

use field::{Field, Look};
use ours::Ours;

/// Lists of the processor against lists of the device, frame by frame.
#[derive(Parser, Debug)]
#[command(name = "lists")]
struct Arguments {
    /// Sizes of the stands, at 282 trees a hectare.
    #[arg(long, value_delimiter = ',', default_values_t = [28_200, 100_000, 1_000_000])]
    trees: Vec<u32>,
    /// Timed frames of each size and maker.
    #[arg(long, default_value_t = 12)]
    frames: usize,
    /// Untimed frames of each before.
    #[arg(long, default_value_t = 3)]
    warm_up: usize,
    /// Width and height of the images, pixels.
    #[arg(long, value_delimiter = ',', default_values_t = [640, 360])]
    size: Vec<u32>,
    /// Cascades of the sun's shadow.
    #[arg(long, default_value_t = 4)]
    cascades: usize,
    /// The tree, as glTF. Without it $CANOPY_DATA/trees/oak-medium.glb, or where that is absent one grown by rule.
    #[arg(long)]
    plant: Option<PathBuf>,
    /// Whether the sun moves too, so that every cascade is drawn in every frame.
    #[arg(long)]
    sun: bool,
    /// Cargo says so to every benchmark; nothing depends on it.
    #[arg(long, hide = true)]
    bench: bool,
}

const MAKERS: [(&str, TreeListMaker); 2] = [("processor", TreeListMaker::Processor), ("device", TreeListMaker::Device)];

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let look = Look {
        size: (arguments.size[0], arguments.size.get(1).copied().unwrap_or(arguments.size[0])),
        cascades: arguments.cascades,
        ..Look::default()
    };
    let plant = field::plant(arguments.plant.as_deref())?;
    let fields = arguments.trees.iter().map(|trees| Field::new(&plant, *trees, look)).collect::<Result<Vec<_>, _>>()?;
    let mut sides = Vec::new();
    for (field, trees) in fields.iter().zip(&arguments.trees) {
        for (name, maker) in MAKERS {
            let mut ours = Ours::new(field)?;
            ours.make_lists(TreeLists { maker, ..TreeLists::default() });
            sides.push((field, *trees, name, ours, Vec::new()));
        }
    }
    for frame in 0..arguments.warm_up + arguments.frames {
        for (field, _, _, ours, times) in &mut sides {
            let (view, sky) = (field.view(frame), field.sky(frame, arguments.sun));
            let start = Instant::now();
            ours.light(&sky);
            ours.place(&view);
            ours.frame()?;
            if frame >= arguments.warm_up {
                times.push(1e3 * start.elapsed().as_secs_f64());
            }
        }
    }
    println!(
        "| trees | sun | lists by | frame, ms: median (least to most) | of the processor's | of the fewest trees |"
    );
    println!("|--:|---|---|--:|--:|--:|");
    let medians: Vec<f64> = sides.iter().map(|(.., times)| median(times)).collect();
    for (index, (_, trees, name, ours, times)) in sides.iter().enumerate() {
        let (least, most) = times.iter().fold((f64::MAX, 0f64), |(low, high), time| (low.min(*time), high.max(*time)));
        println!(
            "| {trees} | {} | {name} | {:.0} ({least:.0} to {most:.0}) | {:.2} | {:.2} |",
            if arguments.sun { "moving" } else { "fixed" },
            medians[index],
            medians[index] / medians[index - index % 2],
            medians[index] / medians[index % 2],
        );
        if index % 2 == 1 {
            let same = sides[index - 1].3.read()? == ours.read()?;
            println!("\n{trees} trees: the last images are {}\n", if same { "equal" } else { "NOT EQUAL" });
        }
    }
    Ok(())
}

fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}
