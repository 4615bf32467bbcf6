//! Kinds of leaves: how much of the light passes through them.
//!
//! In the plate model of a leaf [Jacquemoud & Baret 1990, "PROSPECT"] reflected and transmitted light come from the
//! same scattering, so they have the same colour. The difference between the light through a leaf and the light from
//! its face is the white light that the surface reflects ([`Gloss`](super::Gloss)). The amount of transmission depends
//! on the leaf's structure: many scattering layers reflect light, few let it pass. So a kind of leaf has one number:
//! its transmittance over its subsurface albedo, as [`PlantMaterial::transmission`](super::PlantMaterial::transmission)
//! has it, here by the luminances of a typical leaf.
//!
//! | kind | reflectance | transmittance | factor | from |
//! |---|---|---|--:|---|
//! | thin | 0.065 0.127 0.033 | 0.057 0.123 0.000 | 1.3 | PROSPECT-D, green leaf |
//! | young | 0.153 0.203 0.032 | 0.211 0.259 0.003 | 1.6 | PROSPECT-D, leaf in spring |
//! | leathery | 0.104 0.121 0.088 | 0.043 0.062 0.015 | 0.7 | measured, median of 11 woody species |
//! | needle | 0.070 0.128 0.033 | 0.017 0.046 0.000 | 0.5 | PROSPECT-D, thick needle |
//! | dead | 0.181 0.116 0.065 | 0.107 0.052 0.013 | 0.7 | PROSPECT-D, brown leaf |
//! | autumn yellow | 0.277 0.172 0.032 | 0.298 0.171 0.000 | 1.27 | PROSPECT-D, little chlorophyll left |
//! | autumn red | 0.138 0.048 0.040 | 0.150 0.022 0.002 | 1.28 | PROSPECT-D, anthocyanin |
//!
//! Colours are linear, Rec. 709 primaries, under light of 6504 K. PROSPECT-D: [Féret et al. 2017], from the
//! [`LeafKind::constituents`]; a test computes them again. Measured: the spectral
//! library of Helios [Bailey 2019]. A species differs from its kind by a fifth or more; a value in a file
//! ([`KHR_materials_diffuse_transmission`](super::gltf)) has priority.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::prospect::Constituents;

/// The structure of a leaf, as far as its transmission is concerned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum LeafKind {
    /// Green leaves of most broadleaved trees and herbs: about as much light passes as is reflected.
    #[default]
    Thin,
    /// Leaves of spring, which have just unfolded: thin and pale, more light passes.
    Young,
    /// Thick and tough leaves, such as of evergreen oak, holly, ivy, rhododendron: half of a thin leaf's.
    Leathery,
    /// Needles and scales of conifers: a little more than a third of a thin leaf's.
    Needle,
    /// Dry brown leaves: half of a thin leaf's.
    Dead,
    /// Yellow leaves of autumn, which have lost most of their chlorophyll: about a thin leaf's.
    AutumnYellow,
    /// Red leaves of autumn, which make anthocyanin: about a thin leaf's.
    AutumnRed,
}

impl LeafKind {
    /// All kinds.
    pub const ALL: [Self; 7] =
        [Self::Thin, Self::Young, Self::Leathery, Self::Needle, Self::Dead, Self::AutumnYellow, Self::AutumnRed];

    /// Transmittance over subsurface albedo, 0..=2: each channel of
    /// [`PlantMaterial::transmission`](super::PlantMaterial::transmission).
    pub const fn factor(self) -> f32 {
        match self {
            Self::Thin => 1.3,
            Self::Young => 1.6,
            Self::Leathery | Self::Dead => 0.7,
            Self::Needle => 0.5,
            Self::AutumnYellow => 1.27,
            Self::AutumnRed => 1.28,
        }
    }

    /// [`LeafKind::factor`] for each channel.
    pub const fn transmission(self) -> Vec3 {
        Vec3::splat(self.factor())
    }

    /// Fraction of the light that a typical leaf reflects, gloss included: linear colour, 0..1.
    pub const fn reflectance(self) -> Vec3 {
        match self {
            Self::Thin => Vec3::new(0.065, 0.127, 0.033),
            Self::Young => Vec3::new(0.153, 0.203, 0.032),
            Self::Leathery => Vec3::new(0.104, 0.121, 0.088),
            Self::Needle => Vec3::new(0.070, 0.128, 0.033),
            Self::Dead => Vec3::new(0.181, 0.116, 0.065),
            Self::AutumnYellow => Vec3::new(0.277, 0.172, 0.032),
            Self::AutumnRed => Vec3::new(0.138, 0.048, 0.040),
        }
    }

    /// Fraction of the light that a typical leaf transmits: linear colour, 0..1.
    pub const fn transmittance(self) -> Vec3 {
        match self {
            Self::Thin => Vec3::new(0.057, 0.123, 0.0),
            Self::Young => Vec3::new(0.211, 0.259, 0.003),
            Self::Leathery => Vec3::new(0.043, 0.062, 0.015),
            Self::Needle => Vec3::new(0.017, 0.046, 0.0),
            Self::Dead => Vec3::new(0.107, 0.052, 0.013),
            Self::AutumnYellow => Vec3::new(0.298, 0.171, 0.0),
            Self::AutumnRed => Vec3::new(0.150, 0.022, 0.002),
        }
    }

    /// What a typical leaf is made of: contents with which PROSPECT-D gives the colours above, to 0.004. `None` for
    /// leathery leaves, which are measured.
    pub const fn constituents(self) -> Option<Constituents> {
        let (structure, chlorophyll, carotenoid, anthocyanin, brown, water, dry_matter) = match self {
            Self::Thin => (1.5, 40.0, 8.0, 0.0, 0.0, 0.01, 0.008),
            Self::Young => (1.3, 15.0, 5.0, 0.0, 0.0, 0.01, 0.004),
            Self::Leathery => return None,
            Self::Needle => (2.2, 55.0, 12.0, 0.0, 0.1, 0.02, 0.02),
            Self::Dead => (2.0, 1.5, 2.0, 0.0, 2.0, 0.002, 0.002),
            Self::AutumnYellow => (1.5, 4.0, 8.0, 0.2, 0.48, 0.006, 0.0025),
            Self::AutumnRed => (1.5, 10.0, 6.0, 22.0, 0.0, 0.01, 0.005),
        };
        Some(Constituents { structure, chlorophyll, carotenoid, anthocyanin, brown, water, dry_matter })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Gloss, PlantMaterial};

    /// Relative luminance of a linear colour, Rec. 709.
    fn luminance(color: Vec3) -> f32 {
        color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
    }

    #[test]
    fn each_kind_transmits_what_was_measured() {
        for kind in LeafKind::ALL {
            let leaf =
                PlantMaterial { transmission: kind.transmission(), gloss: Gloss::LEAF, ..PlantMaterial::default() };
            let (got, want) = (leaf.transmitted(kind.reflectance()), kind.transmittance());
            assert!((luminance(got) / luminance(want) - 1.0).abs() < 0.08, "{kind:?}: {got} {want}");
            // The colour, which no factor was fitted to.
            assert!((got - want).abs().max_element() < 0.035, "{kind:?}: {got} {want}");
        }
    }

    #[test]
    fn one_factor_for_all_would_be_two_to_three_times_too_much_for_needles_and_leather() {
        for (kind, least) in [(LeafKind::Leathery, 1.8), (LeafKind::Needle, 2.5)] {
            let thin = PlantMaterial {
                transmission: LeafKind::Thin.transmission(),
                gloss: Gloss::LEAF,
                ..PlantMaterial::default()
            };
            let ratio = luminance(thin.transmitted(kind.reflectance())) / luminance(kind.transmittance());
            assert!((least..3.0).contains(&ratio), "{kind:?}: {ratio}");
        }
    }
}
