//! The arguments of `canopy`: here what all commands share.

mod files;
mod images;
mod measuring;
mod plants;

use canopy::{
    app::{parse_exposure, parse_lighting, parse_samples},
    scene::Lighting,
};
use clap::{Args, Parser, Subcommand};

pub use self::{
    files::{Export, Info, Merge},
    images::{CameraArguments, Fly, LeafChoice, LightChoice, Reference, Render, SequenceArguments, StyleArguments},
    measuring::{Compare, Measured, PeerChoice, Profile, Tune},
    plants::{Bake, Leaf},
};

/// A real-time forest renderer and landscape simulator.
#[derive(Debug, Parser)]
#[command(
    name = "canopy",
    version,
    arg_required_else_help = true,
    after_help = "Examples:
  canopy fly                                          the demo forest in a window
  canopy fly my-valley.ron --at 2026-10-03T18:05+02:00
  canopy render my-valley.ron --out noon.png
  canopy reference my-valley.ron --out truth.exr --spp 256
  canopy bake oak.glb --out oak-levels.png
  canopy compare noon.png truth.png
  canopy profile my-valley.ron --sweep quality.near_distance=20,60,120
  canopy export my-valley.ron --out valley.glb
  canopy info stand.csv

`canopy help render` shows how to render images, sequences and time-lapses."
)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// List the graphics adapters for --adapter, and exit.
    #[arg(long)]
    pub list_adapters: bool,
    /// Options of all commands.
    #[command(flatten)]
    pub common: Common,
}

/// Options of all commands.
#[derive(Clone, Debug, Args)]
pub struct Common {
    /// Print warnings and errors only: no progress bars and no notes.
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// Replace the scene's seed: other positions, sizes and rotations of the trees.
    #[arg(long, global = true, value_name = "NUMBER")]
    pub seed: Option<u64>,
    /// Part of the name of the graphics adapter to use (see --list-adapters).
    #[arg(long, global = true, value_name = "NAME")]
    pub adapter: Option<String>,
    /// Samples per pixel, 1 (rough leaf edges, faster) or 4 [default: the scene's].
    #[arg(long, global = true, value_name = "1|4", value_parser = parse_samples)]
    pub msaa: Option<u32>,
    /// Lighting of all foliage: local, expressive, transfer, or transfer with another sun: leaf-shader or harmonics [default: each
    /// species' own].
    #[arg(long, global = true, value_name = "LIGHT", value_parser = parse_lighting)]
    pub lighting: Option<Lighting>,
    /// Keep this exposure value at ISO 100, -10 to 25 (14: a sunny day, 10: the inside of a wood) [default: the scene's, or
    /// else it follows the light at the camera].
    #[arg(long, global = true, value_name = "EV", value_parser = parse_exposure, allow_hyphen_values = true)]
    pub exposure: Option<f64>,
    /// Show this year of an inventory of repeated surveys [default: the scene's, or the last]. `render` shows several side by
    /// side: 2000,2020.
    #[arg(long, global = true, value_name = "YEAR", value_delimiter = ',')]
    pub year: Vec<i32>,
    /// Show this variant or scenario of an inventory with several [default: the scene's, or the first]. `render` shows several
    /// side by side: kept,felled.
    #[arg(long, global = true, value_name = "NAME")]
    pub variant: Vec<String>,
    /// Refuse an inventory with rows that cannot be used, instead of leaving them out with a warning.
    #[arg(long, global = true)]
    pub strict: bool,
    /// Print which passes ran, which were skipped, and why.
    #[arg(long, global = true)]
    pub explain: bool,
}

impl Common {
    /// The year to show, if it is a single one.
    pub fn single_year(&self) -> Option<i32> {
        self.year.first().copied().filter(|_| self.year.len() == 1)
    }

    /// The variant to show, if it is a single one.
    pub fn single_variant(&self) -> Option<&String> {
        self.variant.first().filter(|_| self.variant.len() == 1)
    }
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Fly through a scene in a window.
    Fly(Fly),
    /// Render a scene to PNG files, without a window.
    Render(Render),
    /// Path-trace the ground truth of a scene on the CPU: slow, but accurate.
    Reference(Reference),
    /// Write the trees and the ground of a scene as binary glTF, for Blender and other programs.
    Export(Export),
    /// Make one image of parts of its samples that were traced separately.
    Merge(Merge),
    /// Make the levels of detail of a plant, and show them on a contact sheet; or bake all plants of a scene.
    Bake(Bake),
    /// Complete the textures of a leaf, and show it in front light, grazing light and against the light.
    Leaf(Leaf),
    /// Compare images with references: how different they look, and why.
    Compare(Compare),
    /// Measure what settings cost in run time, and how wrong they are.
    Profile(Box<Profile>),
    /// Search the settings with the least error within a time, or the least time within an error.
    Tune(Box<Tune>),
    /// Describe a plant, terrain, inventory or scene file.
    Info(Info),
}
