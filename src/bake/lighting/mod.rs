//! How a plant is lit: the data that is baked per vertex, and the part of it that billboards use.
//!
//! | model | baked | vertex bytes beyond position, normal, texture coordinates |
//! |---|---|--:|
//! | [`LightingSettings::Local`] | nothing | 0 |
//! | [`LightingSettings::Expressive`] | realigned normals, ambient term ([`implicit`]) | 0: see [`implicit::packing`] |
//! | [`LightingSettings::Transfer`] | radiance transfer of each side ([`transfer`]) | see there; foliage, 4 bands: 40 |
//!
//! The models are alternatives: data that a plant does not use is not baked, stored or uploaded.

pub mod implicit;
pub mod transfer;

use std::sync::Arc;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::plant::{PartKind, Plant};
use implicit::{AmbientField, ImplicitSettings, NoSurface, bake_implicit};
use transfer::{
    INDIRECT_SUN_COEFFICIENTS, PackedPart, PackedTransfer, TransferFormat, TransferSettings, bake_transfer,
};

/// How the key light (sun or moon) lights a plant's full models. It needs no bake of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize, Serialize, bevy::reflect::Reflect)]
pub enum SunLight {
    /// The sun projected onto spherical harmonics, through the plant's transfer, as [`Harmonics`](Self::Harmonics), plus what
    /// the shadow map shows in finer detail: its value less its mean within 0.6 m. The amount of light is that of the transfer,
    /// the flecks of sun are those of the shadow map, which also lights wood. Only for plants that are lit by transfer; others use the leaf shader.
    #[default]
    Combined,
    /// Each leaf by the angle between its own normal and the sun, front and back, times the shadow map [Franzke 2005,
    /// 4.2.2]. A texel of the map is larger than a leaf: what the map's bias lets through makes crowns up to a third too
    /// bright, and more the coarser the map.
    LeafShader,
    /// The sun projected onto spherical harmonics, through the plant's transfer [Franzke 2005, 4.3.3]. The shadow map adds
    /// the shade of other plants only, where the light enters the crown. A few bands cannot represent a disc: the result is
    /// soft. Only for plants that are lit by transfer; others use the leaf shader.
    Harmonics,
}

/// The lighting model of a plant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightingSettings {
    /// The leaves' own normals, without ambient occlusion [Luft 2007, fig. 1a], for comparison.
    Local,
    /// Normals and ambient term from the crown's implicit surface [Luft 2007].
    Expressive(ImplicitSettings),
    /// The sky by radiance transfer [Franzke 2005, 4.2], the sun as [`SunLight`] says.
    Transfer(TransferSettings),
}

impl Default for LightingSettings {
    fn default() -> Self {
        Self::Transfer(TransferSettings::default())
    }
}

/// How coefficients are stored.
const TRANSFER_FORMAT: TransferFormat = TransferFormat::Snorm8;

impl LightingSettings {
    /// The settings with every value clamped to its range.
    pub fn sanitized(self) -> Self {
        match self {
            Self::Local => Self::Local,
            Self::Expressive(settings) => Self::Expressive(settings.sanitized()),
            Self::Transfer(settings) => Self::Transfer(settings.sanitized()),
        }
    }

    /// Bytes of baked radiance transfer of a vertex in a part of `kind`; 0 in another light.
    pub fn vertex_bytes(&self, kind: PartKind) -> usize {
        match self {
            Self::Transfer(settings) => {
                let sides = if kind == PartKind::Foliage { 2 } else { 1 };
                TRANSFER_FORMAT.vertex_bytes(&settings.sanitized(), sides) + INDIRECT_SUN_COEFFICIENTS
            }
            Self::Local | Self::Expressive(_) => 0,
        }
    }
}

/// Baked lighting data. Lists have one entry per part in the plant's order, each with one value per vertex.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum BakedLighting {
    /// Nothing.
    #[default]
    Local,
    /// From the implicit surface.
    Expressive(ExpressiveLighting),
    /// Radiance transfer.
    Transfer(TransferLighting),
}

/// The data of an implicit-surface bake that rendering needs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExpressiveLighting {
    /// Unit normals. Those of foliage point out of the crown, whichever side of a leaf is visible, unless `no_surface`
    /// is set. Empty if the foliage keeps its own normals.
    pub normals: Vec<Vec<Vec3>>,
    /// Ambient term (the paper's k_a), 0..=1.
    pub ambient: Vec<Vec<f32>>,
    /// Why there is no surface, so that the foliage keeps its own normals.
    pub no_surface: Option<NoSurface>,
    /// What k_a is a function of, which decides what the shaders make of it.
    pub ambient_field: AmbientField,
    /// Whether k_a holds the shade of the plants around, as they were lit together
    /// ([`bake_implicit_stand`](implicit::bake_implicit_stand)).
    pub together: bool,
}

impl ExpressiveLighting {
    /// What is kept of the bake of one plant by `settings` with the normals and the k_a of every part. With an
    /// [`ImplicitSettings::own_normal`] of 1 a leaf is lit as itself, on both of its sides.
    pub fn new(
        normals: Vec<Vec<Vec3>>,
        ambient: Vec<Vec<f32>>,
        no_surface: Option<NoSurface>,
        settings: &ImplicitSettings,
    ) -> Self {
        let own_normal = settings.sanitized().own_normal;
        let normals = if own_normal < 1.0 { normals } else { Vec::new() };
        Self { normals, ambient, no_surface, ambient_field: settings.ambient, together: false }
    }
}

/// How the shaders light leaves by k_a. The numbers are those of the uniforms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u32)]
pub enum AmbientTerm {
    /// Nothing is known of the leaves around a leaf: k_a is 1, or was traced and holds all of their light.
    #[default]
    None = 0,
    /// With the constants that were fitted for [`AmbientField::Depth`].
    Fitted = 1,
    /// By [Luft 2007, eq. 1] alone: [`AmbientField::Published`].
    Published = 2,
}

/// What is kept of a transfer bake.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "PackedTransfer", into = "PackedTransfer")]
pub struct TransferLighting {
    /// The coefficients, as the vertex shader reads them.
    pub packed: PackedTransfer,
    /// Ambient term, 0..=1: light on both sides under a uniform sky, as a fraction of the light on an unoccluded leaf.
    pub ambient: Vec<Vec<f32>>,
}

impl TransferLighting {
    /// Derives the ambient term from the coefficients.
    pub fn new(packed: PackedTransfer) -> Self {
        /// The first coefficient of a side in the open.
        const OPEN: f32 = 0.282_094_79;
        let baked = packed.unpack();
        let count = baked.settings.coefficients().max(1);
        let channels = baked.settings.channels.count();
        let mean = |side: &[f32]| side.iter().take(channels).sum::<f32>() / channels as f32;
        let ambient = baked.parts.iter().map(|part| {
            let front = part.front.chunks_exact(count).map(mean);
            let back = part.back.chunks_exact(count).map(mean).map(Some).chain(std::iter::repeat(None));
            let both = front.zip(back).map(|(front, back)| back.map_or(front, |back| 0.5 * (front + back)));
            both.map(|first| (first / OPEN).clamp(0.0, 1.0)).collect()
        });
        Self { ambient: ambient.collect(), packed }
    }
}

impl From<TransferLighting> for PackedTransfer {
    fn from(lighting: TransferLighting) -> Self {
        lighting.packed
    }
}

impl TryFrom<PackedTransfer> for TransferLighting {
    type Error = NotWhole;

    fn try_from(packed: PackedTransfer) -> Result<Self, NotWhole> {
        if packed.is_whole() { Ok(Self::new(packed)) } else { Err(NotWhole) }
    }
}

/// Bytes of a transfer that do not fit its settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the bytes of the transfer do not fit its settings: bake it again")]
pub struct NotWhole;

impl BakedLighting {
    /// Bakes what `settings` ask for.
    pub fn bake(plant: &Arc<Plant>, settings: &LightingSettings) -> Self {
        match settings {
            LightingSettings::Local => Self::Local,
            LightingSettings::Expressive(settings) => {
                let baked = bake_implicit(plant, settings);
                let no_surface = baked.report.no_surface;
                Self::Expressive(ExpressiveLighting::new(baked.normals, baked.ambient, no_surface, settings))
            }
            LightingSettings::Transfer(settings) => {
                let packed = bake_transfer(plant, settings).pack(TRANSFER_FORMAT);
                Self::Transfer(TransferLighting::new(packed))
            }
        }
    }

    /// Unit normals that replace the own ones of part `part`; `None` where the own ones stay.
    pub fn normals(&self, part: usize) -> Option<&[Vec3]> {
        match self {
            Self::Expressive(lighting) if lighting.no_surface.is_none() => {
                lighting.normals.get(part).map(Vec::as_slice)
            }
            _ => None,
        }
    }

    /// Ambient term of the vertices of part `part`, 0..=1; empty if all of them are 1.
    pub fn ambient(&self, part: usize) -> &[f32] {
        match self {
            Self::Local => &[],
            Self::Expressive(lighting) => lighting.ambient.get(part).map_or(&[], Vec::as_slice),
            Self::Transfer(lighting) => lighting.ambient.get(part).map_or(&[], Vec::as_slice),
        }
    }

    /// The transfer of part `part`, with its settings; `None` where another model lights the plant.
    pub fn transfer(&self, part: usize) -> Option<(&TransferSettings, &PackedPart)> {
        match self {
            Self::Transfer(TransferLighting { packed, .. }) => Some((&packed.settings, packed.parts.get(part)?)),
            _ => None,
        }
    }

    /// Mean indirect sunlight (scattered between leaves) over the foliage's vertices, in SH: the first coefficient, and
    /// the zenith component of the second band ([`transfer::TransferPart::indirect_sun`]). Zeros if it was not baked.
    pub fn indirect_sun(&self) -> (f32, f32) {
        let Self::Transfer(TransferLighting { packed, .. }) = self else { return (0.0, 0.0) };
        let (mut mean, mut zenith, mut count) = (0.0, 0.0, 0.0);
        for part in packed.parts.iter().filter(|part| part.sides == 2) {
            for vertex in part.indirect_sun.chunks_exact(INDIRECT_SUN_COEFFICIENTS) {
                let value = |index: usize| f64::from(vertex[index] as i8) / 127.0 * f64::from(part.indirect_sun_scale);
                mean += value(0);
                zenith += value(2);
                count += 1.0;
            }
        }
        if count > 0.0 { ((mean / count) as f32, (zenith / count) as f32) } else { (0.0, 0.0) }
    }

    /// Whether the lists have as many entries as `plant` has parts and vertices, and all values are in their ranges.
    pub fn fits(&self, plant: &Plant) -> bool {
        let counts = || plant.parts.iter().map(|part| part.mesh.positions.len());
        match self {
            Self::Local => true,
            Self::Expressive(lighting) => {
                let own = lighting.normals.is_empty();
                (own || lighting.normals.iter().map(Vec::len).eq(counts()))
                    && lighting.ambient.iter().map(Vec::len).eq(counts())
                    && lighting.normals.iter().flatten().all(|normal| normal.is_finite())
                    && lighting.ambient.iter().flatten().all(|ambient| (0.0..=1.0).contains(ambient))
                    && lighting.no_surface.is_none_or(|reason| reason.is_finite())
            }
            Self::Transfer(lighting) => lighting.ambient.iter().map(Vec::len).eq(counts()),
        }
    }

    /// Whether the foliage's normals point out of the crown rather than out of each leaf.
    pub fn is_realigned(&self) -> bool {
        matches!(self, Self::Expressive(lighting) if lighting.no_surface.is_none() && !lighting.normals.is_empty())
    }

    /// How the shaders light the leaves by k_a. Where it is 1 throughout there is nothing to fit.
    pub fn ambient_term(&self) -> AmbientTerm {
        let Self::Expressive(lighting) = self else { return AmbientTerm::None };
        match lighting.ambient_field {
            AmbientField::Published => AmbientTerm::Published,
            AmbientField::Depth if lighting.ambient.iter().flatten().any(|ambient| *ambient < 1.0) => {
                AmbientTerm::Fitted
            }
            AmbientField::Depth => AmbientTerm::None,
        }
    }

    /// Whether k_a holds the shade of the plants around, so that nothing else may count it again.
    pub fn is_lit_together(&self) -> bool {
        matches!(self, Self::Expressive(lighting) if lighting.together)
    }

    /// What the user ought to know of the bake.
    pub fn warning(&self) -> Option<String> {
        match self {
            Self::Expressive(lighting) => lighting.no_surface.map(|reason| reason.to_string()),
            Self::Local | Self::Transfer(_) => None,
        }
    }
}
