//! Paints single broad leaves: front, back, transmission, thickness, absorption and bump, as figure 3.8 of
//! [Franzke 2005] has them from cameras and scanners.
//!
//! ```text
//!  outline (polygon) ─> mask             veins (strokes) + net (cells) ─┬─> thickness, absorption: more in veins
//!  chemistry ─> PROSPECT-D ─> mean colours of the tissue ───────────────┼─> front, back, transmission
//!                                                                      └─> relief ─> bump: veins sunk, tissue domed
//! ```
//!
//! The means over the leaf are those of its chemistry, whatever is painted into it. Coordinates: u to the right, v down,
//! both 0..=1 over the texture; lengths inside are in heights of the texture.

mod letters;
mod outline;
mod paint;
mod veins;

use std::sync::Arc;

use glam::{Vec2, Vec3};
use image::RgbaImage;

use crate::plant::LeafTextures;
use crate::plant::prospect::{Constituents, Spectra};

pub use letters::{LETTERS, can_stamp};
pub(in crate::plant::grow) use outline::Outline;
pub(in crate::plant::grow) use paint::paint;

/// The textures of one kind of leaf.
#[derive(Clone, Debug)]
pub struct BladeTextures {
    /// What the upper side reflects, sRGB; the mask in alpha.
    pub front: Arc<RgbaImage>,
    /// The bump: tangent-space normals of the upper side (+Y up, OpenGL convention).
    pub normal: Arc<RgbaImage>,
    /// Back, transmission, thickness, absorption.
    pub layers: LeafTextures,
}

/// Colours of tissue, linear, 0..=1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::plant::grow) struct Tissue {
    /// Reflected by the upper side.
    pub front: Vec3,
    /// Reflected by the lower side.
    pub back: Vec3,
    /// Transmitted.
    pub transmission: Vec3,
}

impl Tissue {
    /// The colours of a leaf. The lower side has the spongy tissue before the chlorophyll, so it looks like a leaf with
    /// the fraction `below` of it.
    pub fn of(leaf: &Constituents, below: f64) -> Self {
        let whole = leaf.colors(Spectra::visible());
        let paler =
            Constituents { chlorophyll: below * leaf.chlorophyll, carotenoid: below * leaf.carotenoid, ..*leaf };
        let transmission = whole.transmittance;
        // No side gives back more light than the other lets it have.
        let back = paler.colors(Spectra::visible()).reflectance.min(Vec3::ONE - transmission);
        Self { front: whole.reflectance, back, transmission }
    }

    fn lerp(self, other: Self, t: f32) -> Self {
        Self {
            front: self.front.lerp(other.front, t),
            back: self.back.lerp(other.back, t),
            transmission: self.transmission.lerp(other.transmission, t),
        }
    }
}

/// How the veins run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::plant::grow) enum Venation {
    /// A midrib with side veins that loop within the margin.
    Pinnate {
        /// Side veins on each side.
        pairs: u32,
        /// Angle between midrib and side veins, radians.
        angle: f32,
    },
    /// Main veins that spread from the petiole.
    Palmate {
        /// Main veins beside the middle one, on each side.
        pairs: u32,
    },
    /// Fine veins from base to tip.
    Parallel {
        /// Veins across the leaf.
        count: u32,
    },
}

/// A kind of leaf, to be painted.
#[derive(Clone, Debug)]
pub(in crate::plant::grow) struct BladeStyle {
    /// Width and height of the textures in texels.
    pub size: [u32; 2],
    /// The rim.
    pub outline: Outline,
    /// The veins.
    pub venation: Venation,
    /// Half width of the midrib at its base, in heights of the texture.
    pub midrib: f32,
    /// Cells of the fine net along the height.
    pub net: f32,
    /// Strength of net and side veins in the colours, 0..=1.
    pub contrast: f32,
    /// Colours of the tissue.
    pub tissue: Tissue,
    /// Colours of the veins, relative to the tissue only in their place.
    pub vein: Tissue,
    /// A stripe along the middle: its colours and its half width as a fraction of the leaf's.
    pub stripe: Option<(Tissue, f32)>,
    /// Height of the relief in heights of the texture.
    pub relief: f32,
    /// Letters that are stamped into the absorption.
    pub letters: Option<String>,
    /// Seed of what is random.
    pub seed: u32,
}

impl BladeStyle {
    /// Width of the texture over its height.
    pub fn aspect(&self) -> f32 {
        self.size[0] as f32 / self.size[1].max(1) as f32
    }

    /// From texture coordinates to heights of the texture, origin where the petiole joins, y towards the tip.
    pub fn flat(&self, uv: Vec2) -> Vec2 {
        Vec2::new((uv.x - self.outline.joint.x) * self.aspect(), self.outline.joint.y - uv.y)
    }
}
