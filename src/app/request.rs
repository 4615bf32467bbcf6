//! What a user asks of the program: plain data that the command line fills and the other files here carry out.

use std::path::PathBuf;

use crate::scene::{LocalTime, Overrides, Pose, SceneSource};

/// Everything about an interactive flight.
#[derive(Clone, Debug, PartialEq)]
pub struct FlyOptions {
    /// The scene.
    pub scene: SceneSource,
    /// Size of the window in pixels, each at least 1.
    pub size: (u32, u32),
    /// Date and time at the start; `None` takes the scene's.
    pub at: Option<LocalTime>,
    /// Where the camera starts; along the path it starts flying.
    pub view: View,
    /// Simulated seconds per real second at the start; 0 is a standing clock.
    pub clock: f64,
    /// Whether the camera may go under the ground.
    pub underground: bool,
    /// Replaces values of the scene.
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
    /// Which pictures, and where they go. [`super::RenderPlan`] turns them into frames.
    pub pictures: Pictures,
    /// Where the camera stands.
    pub view: View,
    /// Size of a picture in pixels, each at least 1; the device may allow less than what is asked.
    pub size: (u32, u32),
    /// Replaces values of the scene.
    pub overrides: Overrides,
    /// Part of the name of the graphics adapter to use; `None` lets the driver choose.
    pub adapter: Option<String>,
    /// No progress and no notes, only warnings and errors.
    pub quiet: bool,
    /// Report which passes ran, which were skipped, and why.
    pub explain: bool,
}

/// Which light a picture of the ground truth has: light adds up, so errors of the two can be told apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LightGroup {
    /// All of it.
    #[default]
    All,
    /// What casts shadows, sun or moon, and what ground and plants make of it.
    Sun,
    /// The sky, and what ground and plants make of it.
    Sky,
}

/// Everything about a picture of the ground truth.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceOptions {
    /// The scene.
    pub scene: SceneSource,
    /// The `.exr` (radiance in nits) or `.png` (as the renderer shows it) to write.
    pub out: PathBuf,
    /// Date and time; `None` takes the scene's.
    pub at: Option<LocalTime>,
    /// Where the camera stands.
    pub view: View,
    /// Size of the picture in pixels, each at least 1.
    pub size: (u32, u32),
    /// Samples a pixel, at least 1.
    pub samples: u32,
    /// How often light may be scattered between surfaces; `None` is as often as it will.
    pub bounces: Option<u32>,
    /// Which light there is.
    pub light: LightGroup,
    /// Whether the renderer's fog lies before what the camera sees.
    pub fog: bool,
    /// Go on from where an earlier picture of the same scene, light and camera stopped, and keep the state for the next.
    pub resume: bool,
    /// Replaces values of the scene.
    pub overrides: Overrides,
    /// No progress and no notes, only warnings and errors.
    pub quiet: bool,
}

/// Single pictures or a sequence.
#[derive(Clone, Debug, PartialEq)]
pub enum Pictures {
    /// Pictures from one camera at one or several instants.
    Stills(Vec<Still>),
    /// Numbered pictures.
    Sequence {
        /// A `.png` file name, into which the numbers go (`flight.png` becomes `flight-0000.png`, ...), or a folder
        /// (no `.png` ending), in which the files are called `0000.png`, ...
        out: PathBuf,
        /// How many, at least 1.
        frames: u32,
        /// Pictures per second of flight along the scene's path, above 0; `None` is 25 for a flight, and a camera
        /// that stands still for a time-lapse.
        fps: Option<f64>,
        /// The instants.
        clock: Clock,
    },
}

/// One picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Still {
    /// The PNG to write.
    pub out: PathBuf,
    /// Date and time; `None` takes the scene's.
    pub at: Option<LocalTime>,
}

/// The instants of a sequence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clock {
    /// All pictures at one instant; `None` takes the scene's.
    Standing(Option<LocalTime>),
    /// A time-lapse: evenly spaced from the first to the last, both included.
    Lapse {
        /// Instant of the first picture.
        from: LocalTime,
        /// Instant of the last picture.
        to: LocalTime,
    },
}

/// Where the camera stands.
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

/// What a headless render did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderReport {
    /// The files written, in order.
    pub files: Vec<PathBuf>,
    /// With [`RenderOptions::explain`]: which passes ran, which were skipped, and why, one line each.
    pub explanation: Vec<String>,
}
