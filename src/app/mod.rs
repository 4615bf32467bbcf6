//! The program, behind the cargo feature `program`: the interactive flight, rendering without a window, the ground
//! truth of a scene, what a file holds, and the levels of detail of a plant. The command line fills the requests ([`FlyOptions`], [`RenderOptions`],
//! [`ReferenceOptions`]), and the functions here carry them out.
//!
//! It uses the library as any program does. The flight spawns a [`CanopyScene`](crate::components::CanopyScene), which is
//! built in the background. [`render`] and [`reference()`] have nothing to show before their scene is built, so they wait
//! for [`Stage::build`](crate::assets::Stage::build).

mod adapter;
mod bake;
mod camera;
mod error;
mod fly;
mod headless;
mod info;
mod interrupt;
mod notes;
mod parse;
mod plan;
mod reference;
mod rendered_image;
mod request;
mod tone;

pub use adapter::list_adapters;
pub use bake::{LevelFacts, Side, Studio, bake, facts};
pub use error::AppError;
pub use fly::fly;
pub use headless::{Renderer, render};
pub use info::info;
pub use interrupt::{Interrupt, listen as listen_to_interrupts, received as interrupt_received};
pub use parse::{
    ArgumentError, parse_exposure, parse_lighting, parse_palette, parse_paper, parse_pose, parse_positive,
    parse_samples, parse_seconds, parse_size, parse_style,
};
pub use plan::{Frame, PlanError, RenderPlan};
pub use reference::reference;
pub use rendered_image::RenderedImage;
pub use request::{
    BakeOptions, Clock, FlyOptions, LightGroup, Output, ReferenceOptions, RenderOptions, RenderReport, Still, View,
};
