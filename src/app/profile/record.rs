//! What is measured, and what follows from it: the data of a report. docs/reports.md documents its JSON.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::measure::{Change, Comparison, Interval, Summary};

/// Version of the JSON and the CSV; it rises when a member or column changes its meaning or goes.
pub const PROFILE_VERSION: u32 = 2;

/// A profile of a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ProfileReport {
    /// `"canopy-profile"`.
    pub schema: String,
    /// [`PROFILE_VERSION`].
    pub version: u32,
    /// The scene's name.
    pub scene: String,
    /// The scene's file.
    pub file: String,
    /// The command that makes the report.
    pub command: String,
    /// When it was begun, RFC 3339.
    pub begun: String,
    /// Whether all was measured that was asked for.
    pub complete: bool,
    /// What tells it from other profiles.
    pub fingerprint: String,
    /// What tells the scene from others, on any machine and for any version of the program; empty where it is not known.
    #[serde(default)]
    pub scene_fingerprint: String,
    /// The machine.
    pub machine: Machine,
    /// How it was measured.
    pub method: Method,
    /// The views, in order.
    pub views: Vec<ViewRecord>,
    /// The settings that were compared; the first is the scene as written.
    pub points: Vec<PointRecord>,
    /// Indices of the points that no other one beats in time and error.
    pub front: Vec<usize>,
    /// The index of the front's knee.
    pub knee: Option<usize>,
}

/// What measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// Graphics adapter.
    pub adapter: String,
    /// Its driver with version.
    pub driver: String,
    /// Graphics interface, such as Vulkan.
    pub backend: String,
    /// Whether the adapter is the processor itself.
    pub software: bool,
    /// Whether it measures times of passes.
    pub gpu_times: bool,
    /// Processor; `None` where the system does not say.
    pub processor: Option<String>,
    /// Threads that may run at once.
    pub threads: usize,
    /// Operating system.
    pub system: String,
    /// Version of Canopy.
    pub canopy: String,
}

/// How it was measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Method {
    /// Width and height of a frame in pixels.
    pub size: (u32, u32),
    /// Rounds asked for; every round draws all views with all settings, in turn from the first to the last and back.
    pub rounds: u32,
    /// Frames before those that count, each time that settings change.
    pub warm_up: u32,
    /// What errors are counted from: `none`, `full`, `traced`, or a folder.
    pub reference: String,
    /// How the reference was made.
    pub reference_details: String,
    /// Pixels per degree of FLIP.
    pub pixels_per_degree: f32,
    /// Seconds between two neighbouring views of a flight.
    pub step_seconds: Option<f64>,
}

/// One view.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ViewRecord {
    /// Its name.
    pub name: String,
    /// Seconds on the path.
    pub seconds: Option<f64>,
    /// As in a scene file: metres east, above the ground and south, then bearing and pitch in degrees.
    pub camera: [f64; 5],
    /// Date and time, RFC 3339.
    pub instant: String,
    /// The reference's image, relative to the report.
    pub reference: Option<String>,
}

/// One combination of settings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointRecord {
    /// For people.
    pub label: String,
    /// Settings by name; none for the scene as written.
    pub settings: BTreeMap<String, String>,
    /// The values of all settings that the profile sweeps: those of `settings`, and else the scene's own, where it has one.
    #[serde(default)]
    pub values: BTreeMap<String, String>,
    /// Whether it takes no part in the front: another renderer, or the control.
    #[serde(default)]
    pub unranked: bool,
    /// Why it could not be measured, if it could not.
    pub fault: Option<String>,
    /// One entry for each round that was timed.
    pub rounds: Vec<Round>,
    /// One entry for each view that was drawn and compared.
    pub pictures: Vec<PictureRecord>,
    /// Memory with these settings.
    pub memory: Memory,
    /// What follows from the rest.
    pub summary: PointSummary,
}

/// The frames of one round.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Round {
    /// Whether the settings came in order, not from the last to the first.
    pub forward: bool,
    /// One for each view.
    pub frames: Vec<FrameTime>,
}

/// Times of one frame in milliseconds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameTime {
    /// Begin, since the profile began.
    pub start: f64,
    /// From its begin to when the device had finished it. No other frame was under way.
    pub frame: f64,
    /// Of it the main world, on the CPU.
    pub cpu_main: Option<f64>,
    /// Of it the render world, on the CPU, until everything was submitted. With a driver that draws while it is submitted to,
    /// as software drivers do, the device's work too.
    pub cpu_render: Option<f64>,
    /// Sum of all passes on the device.
    pub gpu: Option<f64>,
    /// Passes on the device.
    pub passes: BTreeMap<String, f64>,
}

/// One view with one combination of settings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PictureRecord {
    /// The image, relative to the report.
    pub file: String,
    /// The map of its errors, for the views that the page shows.
    pub map: Option<String>,
    /// Trees and triangles by level of detail, from near to far.
    pub levels: Vec<LevelCount>,
    /// Tiles of the ground.
    pub tiles: usize,
    /// Triangles of the ground.
    pub ground_triangles: usize,
    /// Calls of fragment shaders of the passes of the view, per pixel.
    pub fragments_per_pixel: Option<f64>,
    /// Draw calls and dispatches that were recorded for forests, in the view and in the shadow maps.
    #[serde(default)]
    pub forest_calls: Option<u64>,
    /// Bytes that were written to the device for forests.
    #[serde(default)]
    pub uploaded_bytes: Option<u64>,
    /// Against the reference.
    pub error: Option<Comparison>,
    /// Since the view before, beside the reference.
    pub change: Option<Change>,
}

/// What is drawn of a level of detail.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LevelCount {
    /// Name of its representation.
    pub name: String,
    /// Trees.
    pub trees: f64,
    /// Triangles.
    pub triangles: f64,
}

/// Memory in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// What the device's resources take.
    pub device: Option<u64>,
    /// What the program takes of main memory; on a software device that of the device too.
    pub program: Option<u64>,
}

/// What follows from the rounds and pictures of a point. What could not be measured is `None`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointSummary {
    /// Frame times in milliseconds, over all rounds and views.
    pub frame: Option<Summary>,
    /// Mean of the slowest hundredth of the frames (at least one) in milliseconds.
    pub low_1_percent: Option<f64>,
    /// The mean frame time over the views. A frame that is farther than a factor of 1.5 from the median of its view over the rounds was
    /// disturbed, and counts as that far.
    pub mean_frame: Option<f64>,
    /// The same with its 95 % interval over the rounds.
    pub mean: Option<Interval>,
    /// The same as a fraction of that of the scene as written, with its 95 % interval: round by round, in both orders of the settings.
    pub ratio: Option<Interval>,
    /// CPU time of the main world.
    pub cpu_main: Option<Summary>,
    /// CPU time of the render world.
    pub cpu_render: Option<Summary>,
    /// Sum of the passes on the device.
    pub gpu: Option<Summary>,
    /// Median time of each pass on the device.
    pub passes: BTreeMap<String, f64>,
    /// Means over the views.
    pub levels: Vec<LevelCount>,
    /// Mean triangles of trees and ground.
    pub triangles: Option<f64>,
    /// Mean calls of fragment shaders per pixel.
    pub fragments_per_pixel: Option<f64>,
    /// Mean draw calls and dispatches of forests.
    #[serde(default)]
    pub forest_calls: Option<f64>,
    /// Mean bytes written to the device for forests.
    #[serde(default)]
    pub uploaded_bytes: Option<f64>,
    /// Mean FLIP over the views.
    pub error: Option<f64>,
    /// Mean FLIP of the worst view.
    pub worst_error: Option<f64>,
    /// Means over the views of FLIP after averaging over blocks of 4, 8 and 16 pixels.
    pub filtered_error: [Option<f64>; 3],
    /// Means over the views.
    pub luminance_ratio: Option<f64>,
    /// Means over the views.
    pub contrast_ratio: Option<f64>,
    /// Means over the views.
    pub block_correlation: Option<f64>,
    /// Mean FLIP between neighbouring views, less that of the reference.
    pub excess_change: Option<f64>,
    /// Mean share of pixels that change by more than 0.1 beyond the reference.
    pub popping: Option<f64>,
}
