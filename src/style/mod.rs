//! What watercolour, lines and toon need before a GPU draws them [Luft 2006; Luft 2007, section 4]: pure functions and small
//! text files, no device.
//!
//! | module | holds |
//! |---|---|
//! | [`settings`] | what a user chooses: the style and its values |
//! | [`palette`] | pigments, as a small RON file; those that ship with the program |
//! | [`ramp`] | colour ramps, and how a hue ramp and an object ramp combine [Luft 2006, 3.2; Gooch 1998] |
//! | [`paper`] | height maps of papers, drawn by code |
//! | [`depth`] | the blurred depth test and the coding of depth in four channels [Luft 2006, 2] |
//! | [`wash`] | one layer of watercolour: shape, edge, pigment, glazing |
//! | [`particles`] | the particles of a crown: how many, where, how large, in which intensity map [Luft 2006, 4.2] |
//! | [`anchor`](mod@anchor) | where noise is fixed to the scene |
//! | [`deviations`] | how wide the Gaussians of a style are, and how coarse the maps may be into which they blur |
//! | [`layers`] | which plants share a layer |

pub mod anchor;
pub mod depth;
pub mod deviations;
pub mod layers;
pub mod palette;
pub mod paper;
pub mod particles;
pub mod ramp;
pub mod settings;
pub mod wash;

pub use deviations::Deviations;
pub use palette::{Palette, PaletteError};
pub use paper::Paper;
pub use ramp::Ramp;
pub use settings::{LineNormals, Lines, NoiseAnchor, Style, Toon, Watercolour};
