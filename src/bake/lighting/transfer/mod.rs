//! Radiance transfer: how the light of the whole sky reaches each vertex through the plant itself.
//!
//! After [Franzke 2005, 2.2.2.2 and 4.2.3] and [Sloan, Kautz & Snyder 2002]. Every vertex, and either side of a leaf,
//! has a vector of spherical-harmonic coefficients (basis and order: [`crate::light::sh`]) that says how much of the
//! surroundings' light arrives there. The surroundings are projected once when the sun has moved and rotated into the
//! plant's yaw. The light that leaves a vertex is then one dot product (the one after eq. 4.2; eq. 2.11 to 2.13 bake
//! the light in, which is not wanted here):
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
//! They exclude the vertex's own colour, of reflection and of transmission: textures apply during shading [Franzke
//! 2005, 4.2.3, "Modulation"], at their full resolution, and transmission keeps its colour even with one channel. For
//! the same reason the two hemispheres are stored apart instead of a sum for each side; this costs a second dot product
//! and no memory. They include the colour of everything between the vertex and the sky: see [`Scattering`].
//!
//! # One channel or three
//! Direct light has no colour of its own here, so one channel loses only the tint that light takes on from leaf to
//! leaf; the channel is scaled by the luminance of the colours on the way. Three channels cost three times the memory.
//! Franzke's limits (2 to 6 bands in one channel, 2 or 3 in colour) come from his vertex format: [`Channels`].
//!
//! # Projection or fit
//! The projection reproduces the transfer function best. A fit reproduces the light of the *skies that occur* best
//! ([`Projection::Fit`]). Both apply a fixed matrix to the sampled directions, so they cost the same.
//! `benches/transfer.rs` compares them band by band; the fit is the default. Its price: with 2 bands a free level leaf
//! gets 12 % too little light of a uniform sky, with 3 or more less than 3 %.
//!
//! # Limits
//! Light reaches a vertex from its own plant and from infinity, not from neighbouring plants (4.3.3). Do not put the
//! sun's disc into the light: a few bands represent it badly, and a shadow map would count the plant's own shadow
//! twice. Side and cosine are those of the *vertex normal*, whatever the leaf's true plane. A vertex inside other
//! geometry is dark and darkens its triangles. Bounced light is constant over a triangle. The bright aureole of a low
//! sun is narrow, and a few bands represent it as badly as the disc: it causes most of the remaining error
//! (`benches/transfer.rs`, table of the hours). Counting it to the sun does not help: a shadow map knows whether the
//! sun's centre is visible, not how much of its surroundings.

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

pub use evaluate::{exitant_radiance, indirect_sun_share, share};
pub use pack::{PackedPart, PackedTransfer, TransferFormat, code_words, mean_words};
pub use rays::direction_set;

use crate::light::sh::MAX_BANDS;
use crate::plant::{PartKind, Plant};
use crate::trace::PlantTracer;
use points::Points;
use rays::Directions;
use scene::Scene;

/// Whether the coefficients of a vertex and side have a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Channels {
    /// One channel: the luminance.
    #[serde(alias = "One")]
    Luminance,
    /// Red, green, blue.
    Rgb,
}

impl Channels {
    /// 1 or 3.
    pub fn count(self) -> usize {
        match self {
            Self::Luminance => 1,
            Self::Rgb => 3,
        }
    }
}

/// How the coefficients are computed from the sampled directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Projection {
    /// The integral against each basis function, by quadrature [Franzke 2005, 4.2.3].
    Quadrature,
    /// Least squares over the light of clear day skies of all elevations and azimuths of the sun, and of an even sky.
    Fit,
}

/// How the plant scatters light on its way to a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Scattering {
    /// Light continues in a straight line through up to this many leaves (0..=8; 0: none). Each leaf multiplies it by
    /// its transmission. Wood, and one leaf more, stop it. Nothing is reflected. Under a uniform sky a leaf transmits
    /// as much light as one that scatters; under a bright spot it does not blur it.
    #[serde(alias = "Straight")]
    TransmitOnly(u8),
    /// Leaves and wood reflect and transmit diffusely. Light is followed over this many bounces (1..=8) [Franzke 2005,
    /// 4.2.3, note 4; Sloan et al. 2002, 5]. Bounces use an even choice of the lines, of which there are half as many as
    /// [`rays`](TransferSettings::rays): 57 of 512 by default.
    Diffuse(u8),
}

/// Settings of the transfer bake. Values out of range are clamped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct TransferSettings {
    /// Bands n, 2..=6: n² coefficients per side and channel. More bands are sharper; memory and run time grow with n².
    pub bands: u8,
    /// One channel or three.
    pub channels: Channels,
    /// Directions over the whole sphere, an even number in 16..=16384: each comes with its opposite. More directions
    /// give less noise and take proportionally more time.
    pub rays: u32,
    /// How the coefficients are computed from the rays.
    pub projection: Projection,
    /// How leaves and wood scatter the light on its way.
    #[serde(alias = "interior")]
    pub scattering: Scattering,
}

impl Default for TransferSettings {
    fn default() -> Self {
        Self {
            bands: 4,
            channels: Channels::Luminance,
            rays: 1024,
            projection: Projection::Fit,
            scattering: Scattering::Diffuse(3),
        }
    }
}

impl TransferSettings {
    /// Whether the settings keep to the published limits [Franzke 2005, 4.2.3]: 2 to 6 bands in one channel, 2 or 3 in
    /// colour.
    pub fn within_published_limits(self) -> bool {
        let limit = if self.channels == Channels::Luminance { 6 } else { 3 };
        (2..=limit).contains(&self.bands)
    }

    /// The settings with every value clamped to its range.
    pub fn sanitized(self) -> Self {
        Self {
            bands: self.bands.clamp(2, MAX_BANDS as u8),
            rays: self.rays.clamp(16, 16_384).next_multiple_of(2),
            scattering: match self.scattering {
                Scattering::TransmitOnly(leaves) => Scattering::TransmitOnly(leaves.min(8)),
                Scattering::Diffuse(bounces) => Scattering::Diffuse(bounces.clamp(1, 8)),
            },
            ..self
        }
    }

    /// Number of coefficients per vertex and side: bands² times channels.
    pub fn coefficients(self) -> usize {
        usize::from(self.bands).pow(2) * self.channels.count()
    }
}

/// The transfer of one plant.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferBake {
    /// The settings of the bake, sanitized.
    pub settings: TransferSettings,
    /// One per part, in the plant's order.
    pub parts: Vec<TransferPart>,
}

/// The transfer of one part's vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TransferPart {
    /// Coefficients of the side that the vertex normal points to, vertex by vertex: [`TransferSettings::coefficients`]
    /// each, the channels of one coefficient side by side. Finite. The first of each channel belongs to the mean over
    /// all directions: 0 to about 0.282 for an unoccluded vertex, plus reflected light.
    pub front: Vec<f32>,
    /// The same for the other side; empty for wood.
    pub back: Vec<f32>,
    /// Indirect sunlight: the part of the transfer that other leaves and wood scattered, in one channel, mean of both
    /// sides. The first [`INDIRECT_SUN_COEFFICIENTS`] coefficients of each vertex. It serves a sun whose direct light
    /// has a shadow map ([`indirect_sun_share`]). Zeros with [`Scattering::TransmitOnly`].
    pub indirect_sun: Vec<f32>,
}

/// Coefficients of indirect sunlight: two bands, because light that comes from all leaves around is smooth.
pub const INDIRECT_SUN_COEFFICIENTS: usize = 4;

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
    let settings = settings.sanitized();
    let tracer = PlantTracer::new(plant);
    let points = Points::new(plant);
    let directions = Directions::new(&settings);
    let scene = Scene { tracer: &tracer, points: &points, settings };
    let (sides, direct) = match settings.scattering {
        Scattering::TransmitOnly(leaves) => (gather::straight(&scene, &directions, leaves).sides, None),
        Scattering::Diffuse(bounces) => {
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
    let indirect_sun = |part: usize, both: bool| -> Vec<f32> {
        let mut out = Vec::with_capacity(points.of_part(part).len() * INDIRECT_SUN_COEFFICIENTS);
        for &slot in points.of_part(part) {
            let first = slot as usize * count;
            let of_side = |side: usize, index: usize| -> f32 {
                let range = first + index * channels..first + (index + 1) * channels;
                let sum = |all: &[f32]| all.get(range.clone()).map_or(0.0, |values| values.iter().sum::<f32>());
                direct.as_ref().map_or(0.0, |direct| (sum(&sides[side]) - sum(&direct[side])) / channels as f32)
            };
            let mean = |index| if both { 0.5 * (of_side(0, index) + of_side(1, index)) } else { of_side(0, index) };
            out.extend((0..INDIRECT_SUN_COEFFICIENTS).map(mean));
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
                indirect_sun: indirect_sun(index, foliage),
            }
        })
        .collect();
    TransferBake { settings, parts }
}
