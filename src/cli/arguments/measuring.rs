//! What is measured: `canopy compare`, `profile` and `tune`.

use std::path::PathBuf;

use canopy::{
    app::{
        Part, Sweep, parse_flip, parse_milliseconds, parse_part, parse_pixels_per_degree, parse_pose, parse_positive,
        parse_seconds, parse_size,
    },
    scene::{LocalTime, Pose},
};
use clap::Args;

/// Arguments of `canopy compare`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy compare noon.png truth.png --map difference.png
  canopy compare noon.png truth.png --limit 0.05          exit code 1 where the mean FLIP is above
  canopy compare noon.exr truth.exr --half truth-half.exr the noise of the truth is no contrast
  canopy compare flight 'truth/frame-*.png' --json > comparison.json
FLIP is 0 where nobody sees a difference and 1 for black against white [Andersson et al. 2020]; EXR files are compared by its
version for radiance, in which negative light counts as none, and pixels that are not finite are an error. Light, contrast and
correlation by area tell wrong light from another leaf at the same pixel.")]
pub struct Compare {
    /// The image to judge (PNG, JPEG or OpenEXR), or a sequence: a folder or a pattern with one `*`.
    pub test: PathBuf,
    /// What it should look like.
    pub reference: PathBuf,
    /// Pixels per degree of the visual field, 1 to 1000 [default: 67, a 4K monitor at arm's length].
    #[arg(long, value_name = "NUMBER", value_parser = parse_pixels_per_degree)]
    pub ppd: Option<f32>,
    /// Image that is white where pixels count.
    #[arg(long, value_name = "FILE")]
    pub mask: Option<PathBuf>,
    /// The reference from the first half of its samples (or a sequence of these), to take its noise out of the contrast.
    #[arg(long, value_name = "FILE")]
    pub half: Option<PathBuf>,
    /// Write the errors of the pixels as PNG; for sequences a folder.
    #[arg(long, value_name = "FILE")]
    pub map: Option<PathBuf>,
    /// Fail with exit code 1 where the mean FLIP of an image is above this.
    #[arg(long, value_name = "FLIP", value_parser = parse_flip)]
    pub limit: Option<f64>,
    /// Print JSON instead of a table.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `canopy profile`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy profile demo.ron --list-settings
  canopy profile demo.ron --out near --sweep quality.near_distance=20,40,60,120
  canopy profile demo.ron --sweep quality.shadow_map_size=512,2048 --sweep lighting=expressive,transfer
  canopy profile demo.ron --sweep 'quality.levels=[(draw: \"model\", until: 40), (draw: \"cloud\")]' --reference traced
  canopy profile demo.ron --camera 0,2,0,90,0 --at 2026-06-21T13:30-04:00 --at 2026-06-21T20:00-04:00
  canopy profile demo.ron --sweep style=photograph,watercolour --against stock
  canopy profile demo.ron --out new --baseline old/report.json --limit 1.05
The report is a page (report.html), two tables (points.csv, frames.csv) and all figures (report.json) in the folder --out.
Ctrl-C keeps what was measured; the same command with --resume goes on.")]
pub struct Profile {
    /// Scene file.
    pub scene: PathBuf,
    /// Folder of the report. A complete report in it is kept in its folder `earlier` until this profile is complete.
    #[arg(long, value_name = "FOLDER", default_value = "profile")]
    pub out: PathBuf,
    /// Values of a setting, NAME=VALUE,VALUE; several sweeps are combined, each value with each.
    #[arg(long, value_name = "SWEEP")]
    pub sweep: Vec<Sweep>,
    /// Change one setting at a time instead of combining sweeps.
    #[arg(long)]
    pub each: bool,
    /// Print the names of all settings with their values and exit.
    #[arg(long)]
    pub list_settings: bool,
    /// Measure only the i-th of n pieces of the settings, and the scene as written, so that several machines share a sweep.
    #[arg(long, value_name = "i/n", value_parser = parse_part)]
    pub chunk: Option<Part>,
    /// Measure the scene as written a second time: its ratio to the first says what a difference is worth.
    #[arg(long)]
    pub control: bool,
    /// Draw the same trees and ground with another renderer too. stock: Bevy without Canopy, as its users would build it.
    #[arg(long, value_enum, value_name = "RENDERER")]
    pub against: Option<PeerChoice>,
    /// The most trees that the renderer of --against draws: those nearest in the views.
    #[arg(long, value_name = "NUMBER", default_value_t = 100_000, requires = "against")]
    pub peer_trees: usize,
    /// What is measured, and how.
    #[command(flatten)]
    pub measured: Measured,
    /// Number of views whose images the page shows.
    #[arg(long, value_name = "NUMBER", default_value_t = 3)]
    pub pictures: u32,
    /// Compare with the report of an earlier profile (report.json) of the same scene, size and views, and fail where it is slower;
    /// another machine, driver or version is warned of.
    #[arg(long, value_name = "FILE")]
    pub baseline: Option<PathBuf>,
    /// Frame time, as a fraction of the baseline's, above which --baseline fails, unless that may be chance: the 95 % interval of the
    /// fraction begins at 1 or below (for a limit below 1, at the limit or below).
    #[arg(long, value_name = "RATIO", default_value_t = 1.1, value_parser = parse_positive, requires = "baseline")]
    pub limit: f64,
    /// Go on with an earlier, interrupted profile of the same scene and settings.
    #[arg(long)]
    pub resume: bool,
}

/// Renderers to compare with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum PeerChoice {
    /// Bevy without Canopy.
    Stock,
}

/// What is measured of a scene, and how.
#[derive(Clone, Debug, Args)]
pub struct Measured {
    /// Size of the frames in pixels.
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "640x360")]
    pub size: (u32, u32),
    /// Number of views along the scene's path.
    #[arg(long, value_name = "NUMBER", default_value_t = 24, value_parser = clap::value_parser!(u32).range(1..=100_000), conflicts_with = "camera")]
    pub frames: u32,
    /// Frames per second of the flight [default: the views are spread over the whole path].
    #[arg(long, value_name = "RATE", value_parser = parse_positive, conflicts_with = "camera")]
    pub fps: Option<f64>,
    /// Time on the path of the first view, such as 12.5s.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, conflicts_with = "camera")]
    pub along: Option<f64>,
    /// Look from this camera instead of along the path; may be repeated.
    #[arg(long, value_name = "X,Y,Z,YAW,PITCH", value_parser = parse_pose, allow_hyphen_values = true)]
    pub camera: Vec<Pose>,
    /// Date and time with the offset from UTC [default: the scene's]; with --camera it may be repeated.
    #[arg(long, value_name = "TIME")]
    pub at: Vec<LocalTime>,
    /// Rounds, each of which draws all views with all settings; 0 times nothing, and ratios of times need 4.
    #[arg(long, value_name = "NUMBER", default_value_t = 8, value_parser = clap::value_parser!(u32).range(0..=10_000))]
    pub rounds: u32,
    /// Frames before those that count, each time that settings change.
    #[arg(long, value_name = "NUMBER", default_value_t = 3, value_parser = clap::value_parser!(u32).range(0..=10_000))]
    pub warm_up: u32,
    /// What errors are counted from: full (full models, supersampled), traced (path tracer), none, or a folder with
    /// images 0000.png and so on.
    #[arg(long, value_name = "REFERENCE", default_value = "full")]
    pub reference: PathBuf,
    /// Samples along a pixel's side of the reference `full`, 1 to 8.
    #[arg(long, value_name = "NUMBER", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=8))]
    pub supersample: u32,
    /// Samples per pixel of the reference `traced`.
    #[arg(long, value_name = "NUMBER", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: u32,
}

/// Arguments of `canopy tune`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy tune demo.ron --budget 8ms
  canopy tune demo.ron --error 0.08 --size 1280x720 --reference traced
  canopy tune demo.ron --budget 8ms --sweep quality.near_distance=10,20,40,80 --sweep quality.msaa=1,4
The search steps from the scene's own settings to the best neighbour, one rung of one setting at a time, until none is better.
It writes the settings as a scene file has them (quality.ron), and the report of each step beside it (step-01 and so on). It needs at
least 4 rounds. Ctrl-C keeps the steps; the same command with --resume goes on.")]
pub struct Tune {
    /// Scene file.
    pub scene: PathBuf,
    /// Find the least error with 95 of 100 frames within this time, such as 8ms.
    #[arg(long, value_name = "TIME", value_parser = parse_milliseconds, required_unless_present = "error", conflicts_with = "error")]
    pub budget: Option<f64>,
    /// Find the least time with a mean FLIP of at most this.
    #[arg(long, value_name = "FLIP", value_parser = parse_flip)]
    pub error: Option<f64>,
    /// Folder of the results.
    #[arg(long, value_name = "FOLDER", default_value = "tune")]
    pub out: PathBuf,
    /// Go on with an earlier, interrupted search of the same scene: what its steps have measured is kept.
    #[arg(long)]
    pub resume: bool,
    /// Values to step between, NAME=VALUE,VALUE from cheap to dear, instead of the built-in ones.
    #[arg(long, value_name = "SWEEP")]
    pub sweep: Vec<Sweep>,
    /// What is measured, and how.
    #[command(flatten)]
    pub measured: Measured,
}
