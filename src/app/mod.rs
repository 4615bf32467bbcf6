//! The program, behind the cargo feature `program`: the interactive flight, rendering without a window, the ground
//! truth of a scene, what a file holds, the levels of detail of a plant, images against references, run time against error, and
//! the settings that fit a budget. The command line fills the requests ([`FlyOptions`], [`RenderOptions`],
//! [`ReferenceOptions`], ...), and the functions here carry them out.
//!
//! It uses the library as any program does. The flight spawns a [`CanopyScene`](crate::components::CanopyScene), which is
//! built in the background. [`render`] and [`reference()`] have nothing to show before their scene is built, so they wait
//! for [`Stage::build`](crate::assets::Stage::build).

mod adapter;
mod bake;
mod beside;
mod camera;
mod compare;
mod error;
mod export;
mod film_notes;
mod fingerprint;
mod fly;
mod ground_grid;
mod headless;
mod info;
mod interrupt;
mod leaf;
mod merge;
mod notes;
mod parse;
mod plan;
mod profile;
mod reference;
mod rendered_image;
mod renderer;
mod request;
pub mod stock;
mod text;
mod tone;
mod tune;
mod windowless;

pub use crate::measure::PIXELS_PER_DEGREE;
pub use adapter::list_adapters;
pub use bake::{LevelFacts, Side, Studio, bake, bake_scene, facts};
pub use beside::BesideError;
pub use compare::{
    COMPARE_VERSION, CompareError, CompareOptions, CompareReport, FrameComparison, compare, read_image, save_map,
};
pub use error::AppError;
pub use export::{ExportOptions, ExportReport, export};
pub use fly::fly;
pub use headless::render;
pub use info::info;
pub use interrupt::{Interrupt, listen as listen_to_interrupts, received as interrupt_received};
pub use leaf::{LeafImages, LeafOptions, LeafReport, leaf};
pub use merge::{MergeError, MergeOptions, merge};
pub use parse::{
    ArgumentError, parse_chunk, parse_exposure, parse_flip, parse_frames, parse_leaf_kind, parse_lighting,
    parse_milliseconds, parse_palette, parse_paper, parse_part, parse_pixels_per_degree, parse_pose, parse_positive,
    parse_samples, parse_seconds, parse_size, parse_style,
};
pub use plan::{Frame, PlanError, RenderPlan};
pub use profile::{
    BaselineRow, Combination, FrameTime, LevelCount, Machine, Memory, Method, PROFILE_VERSION, Peer, PictureRecord,
    PointRecord, PointSummary, ProfileError, ProfileOptions, ProfileReport, ReferenceKind, ReportFiles, Round,
    SettingError, SettingInfo, Sweep, ViewRecord, Views, against, cautions, check_baseline, profile, profiled_scene,
    read_report, set_setting, settings_of,
};
pub use reference::reference;
pub use rendered_image::RenderedImage;
pub use renderer::{Renderer, UpdateTime};
pub use request::{
    BakeOptions, Beside, Clock, FlyOptions, LeafKind, LeafModel, LightGroup, Output, Part, ReferenceOptions,
    RenderOptions, RenderReport, Selection, Still, View,
};
pub use tune::{Goal, TuneOptions, Tuned, tune};
