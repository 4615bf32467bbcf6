//! Question: how much faster is a frame of Canopy than the same field built the way a Bevy user would build it today,
//! and is the speed bought with error?
//!
//! Two apps in one process draw the same field from the same places, and their frames alternate (A B A B ...), so
//! that whatever else the machine does slows both. A frame's time runs from before `App::update` until the device has
//! finished ([`wgpu::PollType::Wait`]); that the frames' times add up to the wall time is checked to 3 %.
//!
//! - `ours`: [`canopy::app::Renderer`] with a [`Forest`](canopy::render::components::Forest) and a
//!   [`Ground`](canopy::render::components::Ground).
//! - `stock`: one entity a tree and level (see `peer/stock.rs`).
//!
//! Run `cargo bench --bench peer -- --help` for the arguments; benches/README.md has results.

#[path = "peer/error.rs"]
mod error;
#[path = "peer/field.rs"]
mod field;
#[path = "peer/measure.rs"]
mod measure;
#[path = "peer/ours.rs"]
#[expect(dead_code, reason = "another benchmark uses the rest")]
mod ours;
#[path = "peer/stock.rs"]
mod stock;

use std::path::PathBuf;

use anyhow::Context;
use canopy::render::components::{TreeListMaker, TreeLists};
use clap::{Parser, ValueEnum};

use field::{Field, Look};
use measure::Series;
use ours::Ours;
use stock::Stock;

/// Canopy against stock Bevy, frame by frame.
#[derive(Parser, Debug)]
#[command(name = "peer")]
struct Arguments {
    /// Sizes of the stands, at 282 trees a hectare.
    #[arg(long, value_delimiter = ',', default_values_t = [1_000, 28_200, 100_000])]
    trees: Vec<u32>,
    /// Image size in pixels.
    #[arg(long, default_value = "640x360", value_parser = parse_size)]
    size: (u32, u32),
    /// Timed frames of each side and series.
    #[arg(long, default_value_t = 12)]
    frames: usize,
    /// Untimed frames of each side before a series.
    #[arg(long, default_value_t = 3)]
    warm_up: usize,
    /// The tree, as glTF. Without it $CANOPY_DATA/trees/oak-medium.glb, or where that is absent one grown by rule.
    #[arg(long)]
    plant: Option<PathBuf>,
    /// Folder for the images of both sides.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Metres to which trees are full models on both sides.
    #[arg(long, default_value_t = 30.0)]
    near: f32,
    /// Metres of the fade from full models to crosses.
    #[arg(long, default_value_t = 10.0)]
    band: f32,
    /// Cascades of the sun's shadow.
    #[arg(long, default_value_t = 4)]
    cascades: usize,
    /// Metres that the shadow reaches.
    #[arg(long, default_value_t = 800.0)]
    shadow_distance: f64,
    /// Texels along a side of a shadow map.
    #[arg(long, default_value_t = 2048)]
    shadow_size: u32,
    /// Who makes our lists of drawn trees.
    #[arg(long, value_enum, default_value_t = Maker::Automatic)]
    lists: Maker,
    /// Leaves out what is named, on both sides, to see what it costs.
    #[arg(long, value_delimiter = ',')]
    without: Vec<Piece>,
    /// Samples per pixel of our side, 1 or 4.
    #[arg(long, default_value_t = 1)]
    msaa: u32,
    /// Shades our crosses with their depth, and not once a pixel after it.
    #[arg(long)]
    shade_at_once: bool,
    /// Which series to run.
    #[arg(long, value_delimiter = ',', default_values_t = [Series::SunFixed, Series::SunMoving])]
    series: Vec<Series>,
    /// Runs one side alone, for a profiler; no ratios then.
    #[arg(long)]
    only: Option<Side>,
    /// Trees of the stand whose images are compared with full models; 0 for none. Full models and their shadows are
    /// slow without a GPU: choose fewer there.
    #[arg(long, default_value_t = 1_000)]
    error_trees: u32,
    /// Hours of the day, UTC, at which images are compared: the sun from behind, high, low and from the front.
    #[arg(long, value_delimiter = ',', default_values_t = [8.5, 11.25, 17.0, 19.0])]
    error_hours: Vec<f64>,
    /// Cargo says so to every benchmark; nothing depends on it.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Pieces of the field that can be left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Piece {
    Shadow,
    Ground,
    Trees,
}

/// Who makes lists of trees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Maker {
    Automatic,
    Processor,
    Device,
}

impl From<Maker> for TreeLists {
    fn from(maker: Maker) -> Self {
        let maker = match maker {
            Maker::Automatic => TreeListMaker::Automatic,
            Maker::Processor => TreeListMaker::Processor,
            Maker::Device => TreeListMaker::Device,
        };
        Self { maker, ..Self::default() }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Side {
    Ours,
    Stock,
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let pair = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    pair.filter(|&(w, h): &(u32, u32)| w > 0 && h > 0).ok_or_else(|| format!("`{text}` is not like 640x360"))
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let left_out = |piece| arguments.without.contains(&piece);
    if let Some(folder) = &arguments.out {
        std::fs::create_dir_all(folder)?;
    }
    let look = Look {
        size: arguments.size,
        near: arguments.near,
        band: arguments.band,
        cascades: if left_out(Piece::Shadow) { 0 } else { arguments.cascades },
        shadow_distance: arguments.shadow_distance,
        shadow_size: arguments.shadow_size,
        ground: !left_out(Piece::Ground),
        trees: !left_out(Piece::Trees),
        samples: arguments.msaa,
        depth_first: !arguments.shade_at_once,
    };
    let plant = field::plant(arguments.plant.as_deref())?;
    let triangles: usize = plant.plant.parts.iter().map(|part| part.mesh.triangles.len()).sum();
    println!(
        "{} ({triangles} triangles, {:.1} m) to {} m, crosses of {} planes beyond; {}x{} pixels, {} a pixel of ours; {} cascades \
         of {} texels to {} m; {} frames a side and series.\n",
        plant.plant.name,
        plant.plant.height(),
        look.near,
        plant.cross().map_or(0, |cross| cross.planes.len()),
        look.size.0,
        look.size.1,
        if look.samples > 1 { "four samples" } else { "one sample" },
        look.cascades,
        look.shadow_size,
        look.shadow_distance,
        arguments.frames,
    );
    println!("{}", measure::HEADING);
    for &trees in &arguments.trees {
        let field = Field::new(&plant, trees, look)?;
        let mut ours = (arguments.only != Some(Side::Stock)).then(|| Ours::new(&field)).transpose()?;
        let mut stock = (arguments.only != Some(Side::Ours)).then(|| Stock::new(&field)).transpose()?;
        if let Some(ours) = &mut ours {
            ours.make_lists(arguments.lists.into());
        }
        for &series in &arguments.series {
            let runs = measure::alternate(&field, series, arguments.warm_up, arguments.frames, &mut ours, &mut stock)?;
            println!("{}", runs.row(trees, series));
            if let Some(folder) = &arguments.out {
                let name = |side: &str| folder.join(format!("{trees}-{series}-{side}.png"));
                if let Some(ours) = &ours {
                    ours.read()?.save(name("ours"))?;
                }
                if let Some(stock) = &stock {
                    stock.read()?.save(name("stock"))?;
                }
            }
        }
    }
    if arguments.error_trees == 0 || arguments.only.is_some() {
        return Ok(());
    }
    let field = Field::new(&plant, arguments.error_trees, look)?;
    let rows = error::compare(&field, &arguments.error_hours, arguments.out.as_deref())
        .context("comparing with full models")?;
    println!("\n{}\n{rows}", error::HEADING);
    println!("\n{}", error::shadow_lag(&plant, &look)?);
    Ok(())
}
