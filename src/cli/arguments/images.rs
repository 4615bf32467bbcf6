//! Images of scenes: `canopy fly`, `render` and `reference`.

use std::path::PathBuf;

use canopy::{
    app::{
        Part, Selection, parse_chunk, parse_frames, parse_palette, parse_paper, parse_part, parse_pose, parse_positive,
        parse_seconds, parse_size, parse_style,
    },
    scene::{LocalTime, Pose},
    style::Style,
};
use clap::Args;

/// Default width and height of images and windows.
const DEFAULT_SIZE: &str = "1280x720";

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
    /// Palette of a watercolour, of lines or of toon shading: natural, sepia, cool-to-warm, autumn, indigo, botanical, or a .ron file [default: the
    /// scene's].
    #[arg(long, value_name = "PALETTE", value_parser = parse_palette)]
    pub palette: Option<String>,
    /// Paper of a watercolour or of lines: hot-pressed, cold-pressed, rough, laid or canvas [default: the scene's].
    #[arg(long, value_name = "PAPER", value_parser = parse_paper)]
    pub paper: Option<String>,
}

/// A sequence of images, or some of them.
#[derive(Clone, Debug, Args)]
pub struct SequenceArguments {
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
    /// Make only these frames of the sequence: numbers and ranges.
    #[arg(long, value_name = "10-19,30", value_parser = parse_frames, requires = "frames")]
    pub frames_only: Option<Selection>,
    /// Make only the i-th of n pieces of the sequence, 1/n to n/n, so that several machines share it.
    #[arg(long, value_name = "i/n", value_parser = parse_chunk, requires = "frames", conflicts_with = "frames_only")]
    pub chunk: Option<Selection>,
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
  Enter         print the lighting or the style for the scene file in the terminal

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
  Before and after a felling side by side, or years and variants in a grid: each panel has --size, and all have one exposure:
    canopy render stand.ron --out felling.png --variant kept,felled --size 960x540
    canopy render stand.ron --out growth.png --year 2000,2010,2020 --size 640x360
  A day from a fixed camera:
    canopy render demo.ron --out day.png --frames 96 --from 2026-06-21T04:00-04:00 --to 2026-06-21T22:00-04:00
Ctrl-C stops after the current image; the same command with --resume renders the others.")]
pub struct Render {
    /// Scene file.
    pub scene: PathBuf,
    /// PNG file to write; for a sequence, a PNG name to which numbers are added, or a folder.
    #[arg(long, value_name = "FILE", required = true)]
    pub out: Vec<PathBuf>,
    /// Size of the images in pixels; of several years or variants side by side the size of each.
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = DEFAULT_SIZE)]
    pub size: (u32, u32),
    /// Date and time with the offset from UTC, such as 2026-06-21T15:30+02:00 [default: the scene's].
    #[arg(long, value_name = "TIME", conflicts_with_all = ["from", "to"])]
    pub at: Vec<LocalTime>,
    /// Where the camera is [default: the scene's start, or its path for a sequence].
    #[command(flatten)]
    pub view: CameraArguments,
    /// The images of a sequence.
    #[command(flatten)]
    pub sequence: SequenceArguments,
    /// The style of the pictures.
    #[command(flatten)]
    pub style: StyleArguments,
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
    /// The images of a sequence.
    #[command(flatten)]
    pub sequence: SequenceArguments,
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
