//! Radiance transfer: how the light of the whole sky reaches each vertex through the plant itself.
//!
//! After [Franzke 2005, 2.2.2.2 and 4.2.3] and [Sloan, Kautz & Snyder 2002]. For every vertex, and for either side of
//! a leaf, a vector of spherical-harmonic coefficients (basis and order: [`crate::light::sh`]) answers how much of the
//! surroundings' light arrives there. The surroundings are projected once when the sun has moved, turned into the
//! plant's yaw, and what a vertex sends out is one dot product (the one that follows eq. 4.2; eq. 2.11 to 2.13 bake
//! the light in and are not what is wanted):
//!
//! ```text
//!  E_side / pi = max(0, light . side)                     side: front or back, the vertex normal's or the other
//!  exitant from the front = base colour (E_front / pi + t E_back / pi)       t: transmission's relative colour
//!  exitant from the back  = base colour (E_back / pi + t E_front / pi)
//!
//!  side_i = 1/pi integral over that side's hemisphere of |n . w| (V(w) y_i(w) + indirect_i(w)) dw
//! ```
//!
//! # What is in the coefficients, and what is not
//! The vertex's own colour is not, neither for reflection nor for transmission: textures apply when shading
//! [Franzke 2005, 4.2.3, "Modulation"], at their full resolution, and transmission keeps its colour even with one
//! channel. The two hemispheres are stored, rather than a sum for each side, for that reason; it costs a second dot
//! product and no memory. The colour of what lies between the vertex and the sky is: see [`Interior`].
//!
//! # One channel or three
//! Direct light has no colour of its own here, so one channel loses only the tint that light takes on from leaf to
//! leaf; what it holds is scaled by the luminance of the colours on the way. Three channels cost three times the
//! memory. Franzke's limits (2 to 6 bands in one channel, 2 and 3 in colour) are his vertex format's: [`Channels`].
//!
//! # Projection or fit
//! The coefficients that reproduce the transfer function best are its projection; those that reproduce the light of
//! the *skies that occur* best are a fit to them ([`Projection::Fit`]). Both are a fixed matrix applied to the sampled
//! directions, so they cost the same. `benches/transfer.rs` has both, band by band; the fit is the default. What it
//! pays: with 2 bands a free level leaf gets 12 % too little of an even sky, with 3 or more less than 3 %.
//!
//! # Limits
//! Light reaches a vertex from its own plant and from infinitely far away, not from its neighbours (4.3.3). The sun's
//! disc is not meant to be put into the light: a few bands hold it badly, and a shadow map would count the plant's own
//! shadow twice. The side and the cosine are the *vertex normal's*, whatever a leaf's true plane. A vertex that other
//! geometry swallows is dark, and darkens its triangles. Light that bounces is
//! even over a triangle.
//! The bright surroundings of a low sun are narrow, and few bands hold them as badly as they hold the disc: most of
//! the error that remains is theirs (`benches/transfer.rs`, table of the hours). It cannot be had back by counting them
//! to the sun: a shadow map knows whether the sun's centre is seen, not how much of what surrounds it.

mod bounce;
mod evaluate;
mod fit;
mod gather;
mod pack;
mod points;
mod rays;
mod scene;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

pub use evaluate::{exitant_radiance, scattered_share, share};
pub use pack::{PackedPart, PackedTransfer, TransferFormat, code_words, mean_words};
pub use rays::direction_set;

use crate::light::sh::MAX_BANDS;
use crate::plant::{PartKind, Plant};
use crate::trace::PlantTracer;
use points::Points;
use rays::Directions;
use scene::Scene;

/// How many coefficients a vertex and side have, and whether they have a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Channels {
    /// One channel.
    One,
    /// Red, green, blue.
    Rgb,
}

impl Channels {
    /// 1 or 3.
    pub fn count(self) -> usize {
        match self {
            Self::One => 1,
            Self::Rgb => 3,
        }
    }
}

/// How the coefficients follow from the sampled directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Projection {
    /// The integral against each basis function, by quadrature [Franzke 2005, 4.2.3].
    Quadrature,
    /// Least squares over the light of clear day skies of all elevations and azimuths of the sun, and of an even sky.
    Fit,
}

/// What happens to light that meets the plant on its way to a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Interior {
    /// Light goes straight on through up to this many leaves (0..=8; 0: none), dimmed and tinted by the transmission
    /// of each; wood, and one leaf more, stop it. Nothing is reflected. A leaf under an even sky shines through as
    /// brightly as one that scatters; a leaf under a bright spot does not spread it.
    Straight(u8),
    /// Leaves and wood reflect and transmit diffusely, and light is followed over this many of them (1..=8) [Franzke
    /// 2005, 4.2.3, note 4; Sloan et al. 2002, 5]. It is followed along some of the lines only, evenly chosen, of which
    /// there are half as many as [`rays`](TransferSettings::rays): 57 of 512 by default.
    Diffuse(u8),
}

/// How transfer is baked. Values out of range are moved into it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct TransferSettings {
    /// Bands n, 2..=6: n² coefficients a side and channel. More: sharper, memory and run time grow with the square.
    pub bands: u8,
    /// One channel or three.
    pub channels: Channels,
    /// Directions over the whole sphere, an even number of 16..=16384: each with its opposite. More: less noise,
    /// proportionally more time.
    pub rays: u32,
    /// How the coefficients follow from the rays.
    pub projection: Projection,
    /// What leaves and wood do to light on its way.
    pub interior: Interior,
}

impl Default for TransferSettings {
    fn default() -> Self {
        Self {
            bands: 4,
            channels: Channels::One,
            rays: 1024,
            projection: Projection::Fit,
            interior: Interior::Diffuse(3),
        }
    }
}

impl TransferSettings {
    /// Franzke's limits (2005, 4.2.3): 2 to 6 bands in one channel, 2 and 3 in colour.
    pub fn is_of_franzke(self) -> bool {
        let limit = if self.channels == Channels::One { 6 } else { 3 };
        (2..=limit).contains(&self.bands)
    }

    /// The settings with every value moved into its range.
    pub fn in_range(self) -> Self {
        Self {
            bands: self.bands.clamp(2, MAX_BANDS as u8),
            rays: self.rays.clamp(16, 16_384).next_multiple_of(2),
            interior: match self.interior {
                Interior::Straight(leaves) => Interior::Straight(leaves.min(8)),
                Interior::Diffuse(bounces) => Interior::Diffuse(bounces.clamp(1, 8)),
            },
            ..self
        }
    }

    /// Coefficients of a vertex and side: bands² times channels.
    pub fn coefficients(self) -> usize {
        usize::from(self.bands).pow(2) * self.channels.count()
    }
}

/// The transfer of one plant.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferBake {
    /// The settings it was baked with, in range.
    pub settings: TransferSettings,
    /// One a part, in the plant's order.
    pub parts: Vec<TransferPart>,
}

/// The transfer of one part's vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TransferPart {
    /// Coefficients of the vertex normal's side, vertex by vertex: [`TransferSettings::coefficients`] each, channels
    /// of one coefficient beside each other. Finite; the first of each channel is that of the mean over all
    /// directions, 0 to about 0.282 for an unoccluded vertex plus what is reflected.
    pub front: Vec<f32>,
    /// The same of the other side; empty for wood.
    pub back: Vec<f32>,
    /// The part of it that came over other leaves and wood, in one channel, both sides in the mean: the first
    /// [`SCATTERED`] coefficients of each vertex. The light of a sun whose direct part a shadow map knows
    /// ([`scattered_share`]). Zeros with [`Interior::Straight`].
    pub scattered: Vec<f32>,
}

/// Coefficients of light that comes over other leaves: two bands, as what comes from everywhere is smooth.
pub const SCATTERED: usize = 4;

impl TransferPart {
    /// The coefficients of one vertex's front; empty out of range.
    pub fn front_of(&self, vertex: usize, settings: &TransferSettings) -> &[f32] {
        slice_of(&self.front, vertex, settings.coefficients())
    }

    /// The coefficients of one vertex's back; empty for wood and out of range.
    pub fn back_of(&self, vertex: usize, settings: &TransferSettings) -> &[f32] {
        slice_of(&self.back, vertex, settings.coefficients())
    }
}

fn slice_of(all: &[f32], vertex: usize, count: usize) -> &[f32] {
    all.get(vertex * count..(vertex + 1) * count).unwrap_or(&[])
}

/// Bakes the transfer of every vertex of `plant`. Vertices without a finite position or a normal get zeros. The same
/// bytes whatever the number of threads.
pub fn bake_transfer(plant: &Arc<Plant>, settings: &TransferSettings) -> TransferBake {
    let settings = settings.in_range();
    let tracer = PlantTracer::new(plant);
    let points = Points::new(plant);
    let directions = Directions::new(&settings);
    let scene = Scene { tracer: &tracer, points: &points, settings };
    let (sides, direct) = match settings.interior {
        Interior::Straight(leaves) => (gather::straight(&scene, &directions, leaves).sides, None),
        Interior::Diffuse(bounces) => {
            let direct = gather::straight(&scene, &directions, 0);
            let links = gather::links(&scene, &directions, &direct.hidden);
            (bounce::bounce(&scene, &direct.sides, &links, bounces), Some(direct.sides))
        }
    };
    let count = settings.coefficients();
    let expand = |side: usize, part: usize| -> Vec<f32> {
        let vertices = points.of_part(part);
        let mut out = Vec::with_capacity(vertices.len() * count);
        for &slot in vertices {
            // A vertex without a slot has no such range.
            match sides[side].get(slot as usize * count..(slot as usize + 1) * count) {
                Some(values) => out.extend_from_slice(values),
                None => out.extend(std::iter::repeat_n(0.0, count)),
            }
        }
        out
    };
    let channels = settings.channels.count();
    let scattered = |part: usize, both: bool| -> Vec<f32> {
        let mut out = Vec::with_capacity(points.of_part(part).len() * SCATTERED);
        for &slot in points.of_part(part) {
            let first = slot as usize * count;
            let of_side = |side: usize, index: usize| -> f32 {
                let range = first + index * channels..first + (index + 1) * channels;
                let sum = |all: &[f32]| all.get(range.clone()).map_or(0.0, |values| values.iter().sum::<f32>());
                direct.as_ref().map_or(0.0, |direct| (sum(&sides[side]) - sum(&direct[side])) / channels as f32)
            };
            let mean = |index| if both { 0.5 * (of_side(0, index) + of_side(1, index)) } else { of_side(0, index) };
            out.extend((0..SCATTERED).map(mean));
        }
        out
    };
    let parts = plant
        .parts
        .iter()
        .enumerate()
        .map(|(index, part)| {
            let foliage = part.kind == PartKind::Foliage;
            TransferPart {
                front: expand(0, index),
                back: if foliage { expand(1, index) } else { Vec::new() },
                scattered: scattered(index, foliage),
            }
        })
        .collect();
    TransferBake { settings, parts }
}
