//! How the foliage of a species is lit.

use std::ops::RangeInclusive;

use serde::Deserialize;

use super::check::Check;

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
    /// Bands of spherical harmonics, 2 to 6. More: truer, and memory grows with the square. Default 3.
    pub bands: u32,
    /// Whether light takes on colour on its way through the crown; three times the memory. Default false.
    pub color: bool,
    /// Rays of a vertex, 16 to 16384. More: a slower bake with less noise. Default 256.
    pub rays: u32,
    /// How often light is followed from leaf to leaf, 0 to 8; 0: straight through leaves only. Default 3.
    pub bounces: u32,
    /// How the sun lights full models; costs no bake of its own. Default `LeafShader`.
    pub sun: SunLight,
}

/// How the sun lights foliage whose sky comes by radiance transfer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum SunLight {
    /// Each leaf by the angle of its own normal to the sun [Franzke 2005, 4.2.2]: sharp, and true.
    #[default]
    LeafShader,
    /// As published for landscapes [Franzke 2005, 4.3.3]: through the transfer as the sky, and dimmed by the shadow map. A
    /// few bands hold no disc, and the plant's own shadow counts twice: soft and dark, to compare with. Crosses keep
    /// `LeafShader`.
    Harmonics,
}

impl Default for Transfer {
    fn default() -> Self {
        Self { bands: 3, color: false, rays: 256, bounces: 3, sun: SunLight::LeafShader }
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
    /// Ambient light of the crown's core, k_a_min, 0 to 1.
    pub least: Option<f64>,
    /// Density from which on the ambient light is that of the core, d_min, in leaves, 0 to 1000000. Larger: brighter.
    pub core: Option<f64>,
    /// Exponent n, 0.01 to 100: below 1 the crown darkens late on the way inside, above 1 early.
    pub exponent: Option<f64>,
    /// Share of the leaves that make the surface, 0.001 to 1. Smaller: a faster bake, a little off. Default 1.
    pub share: Option<f64>,
    /// Where normals come from. Default `Nearest`.
    pub normals: CrownNormals,
    /// Share of a leaf's own normal, 0 to 1. Default 0.
    pub own_normal: Option<f64>,
}

/// Where the normals of an implicit surface's light come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum CrownNormals {
    /// The nearest point of the surface, as published; jumps between lobes of the crown.
    #[default]
    Nearest,
    /// The gradient of the density: smooth.
    Smooth,
}

impl Lighting {
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
        number("radius", expressive.radius, 1e-6..=1e3, "m");
        number("threshold", expressive.threshold, 0.0..=1e6, "leaves");
        number("least", expressive.least, 0.0..=1.0, "");
        number("core", expressive.core, 0.0..=1e6, "leaves");
        number("exponent", expressive.exponent, 0.01..=100.0, "");
        number("share", expressive.share, 1e-3..=1.0, "");
        number("own_normal", expressive.own_normal, 0.0..=1.0, "");
    }
}
