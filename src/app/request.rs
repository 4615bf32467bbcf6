//! The requests of a user: plain data that the command line fills and the other files of this module carry out.

use std::path::PathBuf;

pub use crate::plant::LeafKind;
pub use crate::reference::LeafModel;
use crate::scene::{Lighting, LocalTime, Overrides, Pose, SceneSource};

/// Everything about an interactive flight.
#[derive(Clone, Debug, PartialEq)]
pub struct FlyOptions {
    /// The scene.
    pub scene: SceneSource,
    /// Size of the window in pixels, each at least 1.
    pub size: (u32, u32),
    /// Date and time at the start; `None` takes the scene's.
    pub at: Option<LocalTime>,
    /// Where the camera starts; on the path it starts flying.
    pub view: View,
    /// Simulated seconds per real second at the start; 0 is a stopped clock.
    pub clock: f64,
    /// Whether the camera may go below the ground.
    pub underground: bool,
    /// Values that replace those of the scene.
    pub overrides: Overrides,
    /// Part of the name of the graphics adapter to use; `None` lets the driver choose.
    pub adapter: Option<String>,
    /// No progress and no notes, only warnings and errors.
    pub quiet: bool,
    /// Print which passes ran, which were skipped, and why.
    pub explain: bool,
}

/// Everything about a headless render.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderOptions {
    /// The scene.
    pub scene: SceneSource,
    /// The images, and where they are written. [`super::RenderPlan`] turns them into frames.
    pub output: Output,
    /// Where the camera is.
    pub view: View,
    /// Size of an image in pixels, each at least 1; the device may have a lower limit. Of several panels it is the size of each.
    pub size: (u32, u32),
    /// Years and variants of an inventory to show side by side.
    pub beside: Beside,
    /// Which frames of a sequence to render.
    pub selection: Selection,
    /// Whether to keep images that an earlier render of the same request has finished: files of the same size and with
    /// the same notes. The scene must be the same too.
    pub resume: bool,
    /// Values that replace those of the scene.
    pub overrides: Overrides,
    /// Part of the name of the graphics adapter to use; `None` lets the driver choose.
    pub adapter: Option<String>,
    /// No progress and no notes, only warnings and errors.
    pub quiet: bool,
    /// Report which passes ran, which were skipped, and why.
    pub explain: bool,
}

/// Years and variants of an inventory that one picture shows side by side, from one camera and with one exposure; none: the
/// scene as it is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Beside {
    /// Years, beside each other in this order.
    pub years: Vec<i32>,
    /// Variants in this order: beside each other, or with several years above each other. A text that is no variant of the
    /// inventory is a list of them, separated by commas.
    pub variants: Vec<String>,
}

/// The light sources of a ground truth render. Light is additive, so the errors of each source can be separated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LightGroup {
    /// All light sources.
    #[default]
    All,
    /// The key light, sun or moon, with its bounces off ground and plants.
    Sun,
    /// The sky, with its bounces off ground and plants.
    Sky,
}

/// Everything about a ground truth render.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceOptions {
    /// The scene.
    pub scene: SceneSource,
    /// The images, and where they are written: `.exr` (radiance in nits), `.png` (as the renderer shows it), or `.film` (sums of
    /// samples for [`merge`](super::merge)). In a folder they are `.png`, or `.film` with a `part`.
    pub output: Output,
    /// Which frames of a sequence to trace.
    pub selection: Selection,
    /// Where the camera is.
    pub view: View,
    /// Size of the image in pixels, each at least 1.
    pub size: (u32, u32),
    /// Samples per pixel, at least 1.
    pub samples: u32,
    /// Trace this part of the samples alone, so that several machines share an image. All outputs are films then.
    pub part: Option<Part>,
    /// Maximum number of bounces between surfaces; `None` is unlimited.
    pub bounces: Option<u32>,
    /// The light sources to include.
    pub light: LightGroup,
    /// How leaves scatter light.
    pub leaf: LeafModel,
    /// Whether to include the renderer's fog.
    pub fog: bool,
    /// Whether to continue an earlier trace of the same scene, light and camera, and to keep the state for the next
    /// one.
    pub resume: bool,
    /// Values that replace those of the scene.
    pub overrides: Overrides,
    /// No progress and no notes, only warnings and errors.
    pub quiet: bool,
}

/// Everything about the levels of detail of a plant.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeOptions {
    /// The plant: a glTF file.
    pub plant: PathBuf,
    /// The PNG to write.
    pub out: PathBuf,
    /// Planes of the billboard cloud.
    pub planes: u32,
    /// Samples per pixel of the levels, 1 or 4; `None` is 4.
    pub msaa: Option<u32>,
    /// How its foliage is lit; `None` is the default.
    pub lighting: Option<Lighting>,
    /// Part of the name of the graphics adapter to use; `None` lets the driver choose.
    pub adapter: Option<String>,
    /// No progress and no notes, only warnings and errors.
    pub quiet: bool,
}

/// Single images or a sequence.
#[derive(Clone, Debug, PartialEq)]
pub enum Output {
    /// Images from one camera at one or several instants.
    Stills(Vec<Still>),
    /// Numbered frames.
    Sequence {
        /// A file name, to which the numbers are added (`flight.png` becomes `flight-0000.png`, ...), or a
        /// folder (no such ending), in which the files are called `0000.png`, ...
        out: PathBuf,
        /// How many, at least 1.
        frames: u32,
        /// Frames per second of flight along the scene's path, above 0; `None` is 25 for a flight, and a camera that
        /// does not move for a time-lapse.
        fps: Option<f64>,
        /// The instants.
        clock: Clock,
    },
}

/// Which frames of a sequence to render. Frames do not depend on each other: several machines may render some each, and the
/// files are those of one that renders all.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Selection {
    /// All of them.
    #[default]
    All,
    /// Those with these numbers, first and last of each range.
    Only(Vec<(u32, u32)>),
    /// One of several pieces of nearly the same length.
    Chunk {
        /// Its number, from 1.
        number: u32,
        /// Number of pieces.
        of: u32,
    },
}

/// One of several parts of nearly the same size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Its number, from 1 to `of`.
    pub number: u32,
    /// Number of parts.
    pub of: u32,
}

impl Part {
    /// The first and the end of its share of `total`.
    pub fn range(self, total: u32) -> std::ops::Range<u32> {
        let start = |part: u32| (u64::from(total) * u64::from(part) / u64::from(self.of.max(1))) as u32;
        start(self.number.saturating_sub(1))..start(self.number.min(self.of))
    }
}

/// One image.
#[derive(Clone, Debug, PartialEq)]
pub struct Still {
    /// The file to write.
    pub out: PathBuf,
    /// Date and time; `None` takes the scene's.
    pub at: Option<LocalTime>,
}

/// The instants of a sequence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clock {
    /// All frames at one instant; `None` takes the scene's.
    Standing(Option<LocalTime>),
    /// A time-lapse: evenly spaced from the first to the last, both included.
    Lapse {
        /// Instant of the first frame.
        from: LocalTime,
        /// Instant of the last frame.
        to: LocalTime,
    },
}

/// Where the camera is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum View {
    /// As the scene says: a still from its start, a sequence along its path if it has one.
    #[default]
    Scene,
    /// At a fixed pose.
    Pose(Pose),
    /// On the scene's path at this time in seconds; a sequence starts there.
    Along(f64),
}

/// The result of a headless render.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderReport {
    /// The images, in order: those written, and with [`RenderOptions::resume`] those that were finished before.
    pub files: Vec<PathBuf>,
    /// With [`RenderOptions::explain`]: which passes ran, which were skipped, and why, one line each.
    pub explanation: Vec<String>,
}
