//! How the foliage of a species is lit.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::check::Check;
use crate::bake::{
    implicit::{AmbientField, NormalSource},
    lighting::SunLight,
};

/// The light of a species' foliage. Each choice has its own fields, all of which may be left out: `Transfer()`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub enum Lighting {
    /// Each leaf by its own normal, the sky unhindered: nothing is baked. To compare with.
    Local,
    /// By the implicit surface of the crown [Luft 2007]: light follows the crown's shape, its inside is dark.
    Expressive(Expressive),
    /// The sky by radiance transfer, the sun by shadow maps [Franzke 2005]: nearest to the truth.
    Transfer(Transfer),
}

/// Radiance transfer.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Transfer {
    /// Bands of spherical harmonics, 2 to 6. More: truer, and memory grows with the square. Default 4.
    pub bands: u32,
    /// Whether light takes on colour on its way through the crown; three times the memory. Default false.
    pub color: bool,
    /// Rays of a vertex, 16 to 16384. More: a slower bake with less noise. Default 1024.
    pub rays: u32,
    /// How often light is followed from leaf to leaf, 0 to 8; 0: straight through leaves only. Default 3.
    pub bounces: u32,
    /// How the sun lights full models, `LeafShader` or `Harmonics`; costs no bake of its own. Default `LeafShader`.
    pub sun: SunLight,
}

impl Default for Transfer {
    fn default() -> Self {
        Self { bands: 4, color: false, rays: 1024, bounces: 3, sun: SunLight::LeafShader }
    }
}

/// The light of an implicit surface. What is left out follows from the plant.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Expressive {
    /// Radius of a leaf's influence, rho, in metres, 0.000001 to 1000. Larger: a smoother crown.
    pub radius: Option<f64>,
    /// Density at the surface, tau, in leaves, 0 to 1000000. Larger: a surface closer to the densest foliage.
    pub threshold: Option<f64>,
    /// What the ambient light is a function of: `Depth`, how many leaves a ray meets on its way out, on average (near to what
    /// the path tracer finds), or `Published`, the density within rho less tau. Default `Depth`.
    pub ambient: AmbientField,
    /// First radius of `Depth` in metres, 0 to 1000. Larger: gaps between twigs no longer count.
    pub ambient_radius: Option<f64>,
    /// Ambient light of the crown's core, k_a_min, 0 to 1.
    pub least: Option<f64>,
    /// Depth or density from which on the ambient light is that of the core, d_min, in leaves, 0 to 1000000. Larger:
    /// brighter.
    pub core: Option<f64>,
    /// Exponent n, 0.01 to 100: below 1 the crown darkens late on the way inside, above 1 early.
    pub exponent: Option<f64>,
    /// Share of the leaves that make the surface, 0.001 to 1. Smaller: a faster bake, a little off. Default 1.
    pub share: Option<f64>,
    /// Where normals come from: `Nearest`, the nearest point of the surface, as published (they jump between lobes of the
    /// crown), or `Smooth`, the gradient of the density. Default `Nearest`.
    pub normals: NormalSource,
    /// Share of a leaf's own normal, 0 to 1. Default 0.
    pub own_normal: Option<f64>,
    /// Whether all trees of such species are lit together, so that a small tree is darkened by its tall neighbour [Luft
    /// 2007, 5]. Each tree then is a model of its own, of which a scene has at most 64. The first such species' values
    /// count for all. Default false.
    pub together: bool,
}

impl Expressive {
    /// Range of [`radius`](Self::radius), metres.
    pub const RADIUS: RangeInclusive<f64> = 1e-6..=1e3;
    /// Range of [`threshold`](Self::threshold) and [`core`](Self::core), leaves.
    pub const DENSITY: RangeInclusive<f64> = 0.0..=1e6;
    /// Range of [`ambient_radius`](Self::ambient_radius), metres.
    pub const AMBIENT_RADIUS: RangeInclusive<f64> = 0.0..=1e3;
    /// Range of [`exponent`](Self::exponent).
    pub const EXPONENT: RangeInclusive<f64> = 0.01..=100.0;
    /// Range of [`share`](Self::share).
    pub const SHARE: RangeInclusive<f64> = 1e-3..=1.0;
    /// Range of [`least`](Self::least) and [`own_normal`](Self::own_normal).
    pub const UNIT: RangeInclusive<f64> = 0.0..=1.0;
}

/// A choice without fields, as a scene file writes it.
pub(crate) fn word(choice: &impl Serialize) -> String {
    ron::to_string(choice).unwrap_or_default()
}

impl Lighting {
    /// The light as a scene file writes it behind `lighting:`, as in `Expressive(radius: 0.8, normals: Smooth)`. What is as
    /// it is when left out is left out. A scene that has it gets the same light, to the last bit.
    pub fn to_ron(&self) -> String {
        let mut fields = Vec::new();
        let name = match self {
            Self::Local => return "Local".to_owned(),
            Self::Expressive(expressive) => {
                for (name, value) in [
                    ("radius", expressive.radius),
                    ("threshold", expressive.threshold),
                    ("ambient_radius", expressive.ambient_radius),
                    ("least", expressive.least),
                    ("core", expressive.core),
                    ("exponent", expressive.exponent),
                    ("share", expressive.share),
                    ("own_normal", expressive.own_normal),
                ] {
                    fields.extend(value.map(|value| format!("{name}: {value}")));
                }
                if expressive.ambient != AmbientField::default() {
                    fields.push(format!("ambient: {}", word(&expressive.ambient)));
                }
                if expressive.normals != NormalSource::default() {
                    fields.push(format!("normals: {}", word(&expressive.normals)));
                }
                if expressive.together {
                    fields.push("together: true".to_owned());
                }
                "Expressive"
            }
            Self::Transfer(transfer) => {
                let default = Transfer::default();
                let mut field = |differs: bool, text: String| fields.extend(differs.then_some(text));
                field(transfer.bands != default.bands, format!("bands: {}", transfer.bands));
                field(transfer.color != default.color, format!("color: {}", transfer.color));
                field(transfer.rays != default.rays, format!("rays: {}", transfer.rays));
                field(transfer.bounces != default.bounces, format!("bounces: {}", transfer.bounces));
                field(transfer.sun != default.sun, format!("sun: {}", word(&transfer.sun)));
                "Transfer"
            }
        };
        format!("{name}({})", fields.join(", "))
    }

    pub(super) fn check(&self, at: &str, check: &mut Check) {
        if let Self::Transfer(transfer) = self {
            check.count(&format!("{at}.lighting.bands"), transfer.bands, 2..=6);
            check.count(&format!("{at}.lighting.rays"), transfer.rays, 16..=16_384);
            check.count(&format!("{at}.lighting.bounces"), transfer.bounces, 0..=8);
        }
        let Self::Expressive(expressive) = self else { return };
        let mut number = |name: &str, value: Option<f64>, range: RangeInclusive<f64>, unit: &str| {
            if let Some(value) = value {
                check.number(&format!("{at}.lighting.{name}"), value, range, unit);
            }
        };
        number("radius", expressive.radius, Expressive::RADIUS, "m");
        number("threshold", expressive.threshold, Expressive::DENSITY, "leaves");
        number("ambient_radius", expressive.ambient_radius, Expressive::AMBIENT_RADIUS, "m");
        number("least", expressive.least, Expressive::UNIT, "");
        number("core", expressive.core, Expressive::DENSITY, "leaves");
        number("exponent", expressive.exponent, Expressive::EXPONENT, "");
        number("share", expressive.share, Expressive::SHARE, "");
        number("own_normal", expressive.own_normal, Expressive::UNIT, "");
    }
}
