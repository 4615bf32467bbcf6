//! The arguments of `canopy`.

use std::path::PathBuf;

use canopy::{
    app::{
        LeafKind, Part, Selection, Sweep, parse_chunk, parse_exposure, parse_flip, parse_frames, parse_leaf_kind,
        parse_lighting, parse_milliseconds, parse_palette, parse_paper, parse_part, parse_pixels_per_degree,
        parse_pose, parse_positive, parse_samples, parse_seconds, parse_size, parse_style,
    },
    scene::{Lighting, LocalTime, Pose},
    style::Style,
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

/// The style of the pictures.
#[derive(Clone, Debug, Args)]
pub struct StyleArguments {
    /// Draw in a style: photograph, watercolour, lines or toon [default: the scene's].
    #[arg(long, value_name = "STYLE", value_parser = parse_style)]
    pub style: Option<Style>,
    /// Palette of a watercolour or of lines: natural, sepia, cool-to-warm, autumn, indigo, botanical, or a .ron file [default: the
    /// scene's].
    #[arg(long, value_name = "PALETTE", value_parser = parse_palette)]
    pub palette: Option<String>,
    /// Paper of a watercolour or of lines: hot-pressed, cold-pressed, rough, laid or canvas [default: the scene's].
    #[arg(long, value_name = "PAPER", value_parser = parse_paper)]
    pub paper: Option<String>,
}

/// Arguments of `canopy fly`.
#[derive(Debug, Args)]
#[command(after_help = "Keys:
  W A S D Q E   fly              mouse   look around
  wheel         set the speed    Shift   five times faster
  F             fly the scene's path
  L             open or close the settings: leaves, view, sun, shadows
  R             load the changed scene file
  Y V           next year / next variant of the inventory; with Shift, the previous one
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
    /// The style of the pictures.
    #[command(flatten)]
    pub style: StyleArguments,
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
  The second of eight machines renders its part of a flight, and nothing that is there already:
    canopy render demo.ron --out flight --frames 250 --chunk 2/8 --skip-existing
  The same as a watercolour in sepia:
    canopy render demo.ron --out sepia.png --style watercolour --palette sepia
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
    /// The style of the pictures.
    #[command(flatten)]
    pub style: StyleArguments,
    /// Render only these frames of the sequence: numbers and ranges.
    #[arg(long, value_name = "10-19,30", value_parser = parse_frames, requires = "frames")]
    pub frames_only: Option<Selection>,
    /// Render only the i-th of n pieces of the sequence, 1/n to n/n, so that several machines share it.
    #[arg(long, value_name = "i/n", value_parser = parse_chunk, requires = "frames", conflicts_with = "frames_only")]
    pub chunk: Option<Selection>,
    /// Keep the images that an earlier run of the same command has finished. The settings and the scene that are stored in
    /// each of them must be the same; else it is rendered again.
    #[arg(long, visible_alias = "skip-existing")]
    pub resume: bool,
}

/// Arguments of `canopy reference`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy reference demo.ron --out truth.exr --spp 256 --size 640x360
  canopy reference demo.ron --out truth.png --at 2026-06-21T19:30-04:00 --camera 0,2,0,270,5 --spp 64 --resume
  Twenty images along the scene's path, the first of four pieces:
    canopy reference demo.ron --out truth --frames 20 --fps 1 --chunk 1/4
  A quarter of the samples of one image, to be merged with the others:
    canopy reference demo.ron --out part-1.film --spp 1024 --part 1/4
A trace can be interrupted: its state is saved every 30 s and at Ctrl-C next to the image, and --resume continues from
there.")]
pub struct Reference {
    /// Scene file.
    pub scene: PathBuf,
    /// Image to write: .exr for radiance in nits, .png as the renderer shows it; for a sequence, such a name to which numbers are
    /// added, or a folder.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Samples per pixel.
    #[arg(long, value_name = "NUMBER", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: u32,
    /// Size of the image in pixels.
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = DEFAULT_SIZE)]
    pub size: (u32, u32),
    /// Date and time with the offset from UTC, such as 2026-06-21T15:30+02:00 [default: the scene's].
    #[arg(long, value_name = "TIME", conflicts_with_all = ["from", "to"])]
    pub at: Option<LocalTime>,
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
    /// Trace only these frames of the sequence: numbers and ranges.
    #[arg(long, value_name = "10-19,30", value_parser = parse_frames, requires = "frames")]
    pub frames_only: Option<Selection>,
    /// Trace only the i-th of n pieces of the sequence, 1/n to n/n, so that several machines share it.
    #[arg(long, value_name = "i/n", value_parser = parse_chunk, requires = "frames", conflicts_with = "frames_only")]
    pub chunk: Option<Selection>,
    /// Trace only the i-th of n parts of the samples, so that several machines share an image. The result is a film (.film), and
    /// `canopy merge` makes an image of all of them.
    #[arg(long, value_name = "i/n", value_parser = parse_part)]
    pub part: Option<Part>,
    /// Maximum number of bounces between surfaces; 0: only direct light from sun and sky [default: unlimited].
    #[arg(long, value_name = "NUMBER")]
    pub bounces: Option<u32>,
    /// Light sources to include: the sun (or moon) alone, the sky alone, or all.
    #[arg(long, value_enum, default_value_t = LightChoice::All)]
    pub light: LightChoice,
    /// How leaves scatter light.
    #[arg(long, value_enum, default_value_t = LeafChoice::Species)]
    pub leaf: LeafChoice,
    /// Leave out the renderer's fog.
    #[arg(long)]
    pub clear_air: bool,
    /// Continue an earlier trace of the same scene, light and camera; PNG images and films of a sequence that are finished are kept.
    #[arg(long, visible_alias = "skip-existing")]
    pub resume: bool,
}

/// Arguments of `canopy export`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy export my-valley.ron --out valley.glb
  canopy export my-valley.ron --out middle.glb --within 250 --nodes
Each plant is one mesh. Its trees are instances (EXT_mesh_gpu_instancing), which Blender 3.6 and newer, three.js and others read, or with
--nodes a node each. +X is east, -Z north; heights are metres above the datum of the terrain.")]
pub struct Export {
    /// Scene file.
    pub scene: PathBuf,
    /// Binary glTF file to write (.glb).
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Write a node for each tree, for programs that do not know instances; at most 200000 trees.
    #[arg(long)]
    pub nodes: bool,
    /// Leave out the ground.
    #[arg(long)]
    pub no_ground: bool,
    /// Only what lies within this many metres of the centre, to the east, north, west and south.
    #[arg(long, value_name = "M", value_parser = parse_positive)]
    pub within: Option<f64>,
}

/// Arguments of `canopy merge`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy merge part-1.film part-2.film part-3.film part-4.film --out truth.exr
  canopy merge machine-1 machine-2 --out truth            folders with films of a sequence; those of one name are one image
The parts are those of `canopy reference --part`. The image is that of one trace with all samples.")]
pub struct Merge {
    /// Films, or folders of films.
    #[arg(required = true)]
    pub parts: Vec<PathBuf>,
    /// Image to write: .exr for radiance in nits, .png as the renderer shows it, .film to merge it further; for folders a folder.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Write the images of folders as OpenEXR instead of PNG.
    #[arg(long)]
    pub exr: bool,
    /// Accept that samples are missing at the end.
    #[arg(long)]
    pub incomplete: bool,
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

/// How leaves scatter light in a ground truth render.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum LeafChoice {
    /// As the renderer: by layers where a species has a tissue, otherwise by the standard model.
    Species,
    /// By front and transmission, the same from every angle.
    Standard,
    /// All by the layers of their tissue, with all textures of the leaf.
    Layers,
    /// All by the layers with the printed formulas of [Franzke 2005].
    Published,
}

/// Arguments of `canopy bake`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy bake oak.glb --out oak-levels.png
  canopy bake oak.glb --out oak-200.png --planes 200 --lighting local
  canopy bake my-valley.ron           bakes all plants of a scene, so that later calls find them in the cache
The sheet shows each level from four sides and from above, and its triangles, memory, deviation and error.")]
pub struct Bake {
    /// The plant (.glb, .gltf), or a scene (.ron), whose plants are baked into the cache.
    pub plant: PathBuf,
    /// PNG file to write; required for a plant, none for a scene.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Planes of the billboard cloud, 1 to 1000. More are nearer to the plant, and slower.
    #[arg(long, value_name = "NUMBER", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub planes: u32,
}

/// Arguments of `canopy leaf`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy leaf oak-leaf.png --out oak-leaf                  derives back, transmission, thickness, absorption and bump
  canopy leaf front.png --back back.png --transmission through.png --out leaf
  canopy leaf ficus.glb --material leaf --out ficus-leaf --kind leathery
The folder gets the six textures (PNG), leaf.gltf, a plant of one leaf that uses them, and sheet.png.")]
pub struct Leaf {
    /// Image of the front, with the outline in its alpha (.png, .jpg, .webp), or a plant (.glb, .gltf).
    pub file: PathBuf,
    /// Folder to write to.
    #[arg(long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// Material of a plant whose leaf is meant [default: the first of foliage].
    #[arg(long, value_name = "NAME")]
    pub material: Option<String>,
    /// Image of the back [default: the plant's, or guessed from the front].
    #[arg(long, value_name = "FILE")]
    pub back: Option<PathBuf>,
    /// Image of the light that comes through, such as a scan with a transparency unit [default: the plant's, or derived from the
    /// front].
    #[arg(long, value_name = "FILE")]
    pub transmission: Option<PathBuf>,
    /// Image of the thickness, white is thickest [default: the plant's, or derived from the transmission].
    #[arg(long, value_name = "FILE")]
    pub thickness: Option<PathBuf>,
    /// Image of the absorption, white absorbs most [default: the plant's, or derived from the transmission].
    #[arg(long, value_name = "FILE")]
    pub absorption: Option<PathBuf>,
    /// Tangent-space normal map, OpenGL convention [default: the plant's, or derived from the front].
    #[arg(long, value_name = "FILE")]
    pub bump: Option<PathBuf>,
    /// Kind of leaf, which decides how much light comes through where nothing else does: thin, young, leathery, needle, dead,
    /// autumn-yellow, autumn-red.
    #[arg(long, value_name = "KIND", default_value = "thin", value_parser = parse_leaf_kind)]
    pub kind: LeafKind,
    /// Greatest thickness in millimetres [default: the plant's, or 0.3].
    #[arg(long, value_name = "MM", value_parser = parse_positive)]
    pub max_thickness: Option<f64>,
    /// Width of the leaf in metres.
    #[arg(long, value_name = "M", default_value_t = 0.1, value_parser = parse_positive)]
    pub width: f64,
    /// Take slow changes out of the thickness: standard deviation of the blur as a fraction of the texture's longer side.
    #[arg(long, value_name = "FRACTION", value_parser = parse_positive)]
    pub high_pass: Option<f64>,
    /// Derive the absorption as the thesis prints it: bright absorbs.
    #[arg(long)]
    pub published: bool,
    /// Samples per pixel of the sheet.
    #[arg(long, value_name = "NUMBER", default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub spp: u32,
}

/// Arguments of `canopy compare`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  canopy compare noon.png truth.png --map difference.png
  canopy compare noon.png truth.png --limit 0.05          exit code 1 where the mean FLIP is above
  canopy compare noon.exr truth.exr --half truth-half.exr the noise of the truth is no contrast
  canopy compare flight 'truth/frame-*.png' --json > comparison.json
FLIP is 0 where nobody sees a difference and 1 for black against white [Andersson et al. 2020]; EXR files are compared by its
version for radiance. Light, contrast and correlation by area tell wrong light from another leaf at the same pixel.")]
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
    /// Folder of the report.
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
    /// Compare with the report of an earlier profile, and fail where it is slower.
    #[arg(long, value_name = "FILE")]
    pub baseline: Option<PathBuf>,
    /// Frame time, as a fraction of the baseline's, above which --baseline fails.
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
    #[arg(long, value_name = "NUMBER", default_value_t = 24, value_parser = clap::value_parser!(u32).range(1..=100_000))]
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
    /// Rounds, each of which draws all views with all settings; 0 times nothing.
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
It writes the settings as a scene file has them (quality.ron), and the report of each step beside it.")]
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
    /// Values to step between, NAME=VALUE,VALUE from cheap to dear, instead of the built-in ones.
    #[arg(long, value_name = "SWEEP")]
    pub sweep: Vec<Sweep>,
    /// What is measured, and how.
    #[command(flatten)]
    pub measured: Measured,
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
