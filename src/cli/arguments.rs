//! The arguments of `canopy`.

use std::path::PathBuf;

use canopy::{
    app::{parse_exposure, parse_lighting, parse_pose, parse_positive, parse_samples, parse_seconds, parse_size},
    scene::{Lighting, LocalTime, Pose},
};
use clap::{Args, Parser, Subcommand};

/// Default width and height of images and windows.
const DEFAULT_SIZE: &str = "1280x720";

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
    /// Show this year of an inventory of repeated surveys [default: the scene's, or the last].
    #[arg(long, global = true, value_name = "YEAR")]
    pub year: Option<i32>,
    /// Show this variant or scenario of an inventory with several [default: the scene's, or the first].
    #[arg(long, global = true, value_name = "NAME")]
    pub variant: Option<String>,
    /// Refuse an inventory with rows that cannot be used, instead of leaving them out with a warning.
    #[arg(long, global = true)]
    pub strict: bool,
    /// Print which passes ran, which were skipped, and why.
    #[arg(long, global = true)]
    pub explain: bool,
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
    /// Make the levels of detail of a plant, and show them on a contact sheet.
    Bake(Bake),
    /// Describe a plant, terrain, inventory or scene file.
    Info(Info),
}

/// Where the camera is.
#[derive(Clone, Debug, Args)]
pub struct CameraArguments {
    /// Camera: metres east of the terrain's centre, above the ground and south; compass bearing and pitch in degrees.
    #[arg(long, value_name = "X,Y,Z,YAW,PITCH", value_parser = parse_pose, allow_hyphen_values = true, conflicts_with = "along")]
    pub camera: Option<Pose>,
    /// Time on the scene's camera path, such as 12.5s; a sequence starts there.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    pub along: Option<f64>,
}

/// Arguments of `canopy fly`.
#[derive(Debug, Args)]
#[command(after_help = "Keys:
  W A S D Q E   fly              mouse   look around
  wheel         set the speed    Shift   five times faster
  F             fly the scene's path
  L             open or close the settings: leaves, view, sun, shadows
  R             load the changed scene file
  H             show all keys

Keys of the settings, which the mouse changes too:
  Up, Down      select a value
  Left, Right   decrease or increase it; with Shift in small steps
  Backspace     reset it to the scene's own
  Delete        make it automatic
  Tab           next section; with Shift the previous one
  Enter         print the lighting for the scene file in the terminal

Examples:
  canopy fly
  canopy fly my-valley.ron --at 2026-10-03T18:05+02:00 --clock 60
  canopy fly my-valley.ron --camera 0,30,200,0,-10 --size 1920x1080")]
pub struct Fly {
    /// Scene file [default: the demo scene].
    pub scene: Option<PathBuf>,
    /// Size of the window in pixels.
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = DEFAULT_SIZE)]
    pub size: (u32, u32),
    /// Date and time with the offset from UTC, such as 2026-06-21T15:30+02:00 [default: the scene's].
    #[arg(long, value_name = "TIME")]
    pub at: Option<LocalTime>,
    /// Where to start [default: the scene's].
    #[command(flatten)]
    pub view: CameraArguments,
    /// Simulated seconds per second at the start [default: 0, the clock is stopped].
    #[arg(long, value_name = "FACTOR", value_parser = parse_positive)]
    pub clock: Option<f64>,
    /// Let the camera go below the ground.
    #[arg(long)]
    pub underground: bool,
}

/// Arguments of `canopy render`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  One image:
    canopy render demo.ron --out noon.png --at 2026-06-21T13:30-04:00 --camera 0,20,0,90,-5
  Several times of day from one camera (one --out for each --at):
    canopy render demo.ron --at 2026-06-21T06:30-04:00 --out dawn.png --at 2026-06-21T23:00-04:00 --out night.png
  A flight along the scene's path, written to flight/0000.png and so on:
    canopy render demo.ron --out flight --along 10s --frames 250 --fps 25
  A day from a fixed camera:
    canopy render demo.ron --out day.png --frames 96 --from 2026-06-21T04:00-04:00 --to 2026-06-21T22:00-04:00
Ctrl-C stops after the current image; the same command with --resume renders the others.")]
pub struct Render {
    /// Scene file.
    pub scene: PathBuf,
    /// PNG file to write; for a sequence, a PNG name to which numbers are added, or a folder.
    #[arg(long, value_name = "FILE", required = true)]
    pub out: Vec<PathBuf>,
    /// Size of the images in pixels.
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = DEFAULT_SIZE)]
    pub size: (u32, u32),
    /// Date and time with the offset from UTC, such as 2026-06-21T15:30+02:00 [default: the scene's].
    #[arg(long, value_name = "TIME", conflicts_with_all = ["from", "to"])]
    pub at: Vec<LocalTime>,
    /// Where the camera is [default: the scene's start, or its path for a sequence].
    #[command(flatten)]
    pub view: CameraArguments,
    /// Number of images in a sequence.
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: Option<u32>,
    /// Frames per second of flight along the path [default: 25; in a time-lapse the camera does not move].
    #[arg(long, value_name = "RATE", value_parser = parse_positive, requires = "frames")]
    pub fps: Option<f64>,
    /// First instant of a time-lapse.
    #[arg(long, value_name = "TIME", requires = "frames", requires = "to")]
    pub from: Option<LocalTime>,
    /// Last instant of a time-lapse.
    #[arg(long, value_name = "TIME", requires = "from")]
    pub to: Option<LocalTime>,
    /// Keep the images that an earlier, interrupted run of the same command has finished; the scene must be unchanged.
    #[arg(long)]
    pub resume: bool,
}

/// Arguments of `canopy reference`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy reference demo.ron --out truth.exr --spp 256 --size 640x360
  canopy reference demo.ron --out truth.png --at 2026-06-21T19:30-04:00 --camera 0,2,0,270,5 --spp 64 --resume
A trace can be interrupted: its state is saved every 30 s and at Ctrl-C next to the image, and --resume continues from
there.")]
pub struct Reference {
    /// Scene file.
    pub scene: PathBuf,
    /// Image to write: .exr for radiance in nits, .png as the renderer shows it.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Samples per pixel.
    #[arg(long, value_name = "NUMBER", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: u32,
    /// Size of the image in pixels.
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = DEFAULT_SIZE)]
    pub size: (u32, u32),
    /// Date and time with the offset from UTC, such as 2026-06-21T15:30+02:00 [default: the scene's].
    #[arg(long, value_name = "TIME")]
    pub at: Option<LocalTime>,
    /// Where the camera is [default: the scene's start].
    #[command(flatten)]
    pub view: CameraArguments,
    /// Maximum number of bounces between surfaces; 0: only direct light from sun and sky [default: unlimited].
    #[arg(long, value_name = "NUMBER")]
    pub bounces: Option<u32>,
    /// Light sources to include: the sun (or moon) alone, the sky alone, or all.
    #[arg(long, value_enum, default_value_t = LightChoice::All)]
    pub light: LightChoice,
    /// Leave out the renderer's fog.
    #[arg(long)]
    pub clear_air: bool,
    /// Continue an earlier trace of the same scene, light and camera.
    #[arg(long)]
    pub resume: bool,
}

/// Light sources of a ground truth render.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum LightChoice {
    /// All light sources.
    All,
    /// Sun or moon alone, with its bounces off ground and plants.
    Sun,
    /// The sky alone, with its bounces off ground and plants.
    Sky,
}

/// Arguments of `canopy bake`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy bake oak.glb --out oak-levels.png
  canopy bake oak.glb --out oak-200.png --planes 200 --lighting local
The sheet shows each level from four sides and from above, and its triangles, memory, deviation and error.")]
pub struct Bake {
    /// The plant (.glb, .gltf).
    pub plant: PathBuf,
    /// PNG file to write.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Planes of the billboard cloud, 1 to 1000. More are nearer to the plant, and slower.
    #[arg(long, value_name = "NUMBER", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub planes: u32,
}

/// Arguments of `canopy info`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy info oak.glb
  canopy info assets/scenes/demo.ron")]
pub struct Info {
    /// A plant (.glb, .gltf), a terrain (.tif, .asc, .hgt, .png), an inventory (.csv) or a scene (.ron).
    pub file: PathBuf,
}
