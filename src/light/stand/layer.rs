//! The layer of crowns, and what it leaves of sky and sun.

use std::f32::consts::PI;

use glam::Vec3;

use super::StandTrees;
use crate::light::{
    LightState,
    own_crown::{Entry, OwnCrown},
};

/// Rings of the upper hemisphere, of equal solid angle, and directions in each ring.
pub const RINGS: usize = 32;
const AZIMUTHS: usize = 32;

/// Sine of a ring's elevation, and its mean radiance.
pub type Ring = (f32, Vec3);

/// Rings of the sky, from the horizon up.
pub fn rings(light: &LightState) -> Vec<Ring> {
    let ring = |index: usize| {
        let sine = ring_sine(index);
        let cosine = (1.0 - sine * sine).sqrt();
        let sum: Vec3 = (0..AZIMUTHS)
            .map(|azimuth| {
                let (z, x) = (2.0 * PI * (azimuth as f32 + 0.5) / AZIMUTHS as f32).sin_cos();
                light.sky_view.sample(Vec3::new(cosine * x, sine, cosine * z))
            })
            .sum();
        (sine, sum / AZIMUTHS as f32)
    };
    (0..RINGS).map(ring).collect()
}

fn ring_sine(ring: usize) -> f32 {
    (ring as f32 + 0.5) / RINGS as f32
}

/// Ratio of two sums over the sky; 1 where the sky is black.
fn ratio(part: Vec3, whole: Vec3) -> Vec3 {
    Vec3::from([0, 1, 2].map(|c| if whole[c] > 0.0 { (part[c] / whole[c]).clamp(0.0, 1.0) } else { 1.0 }))
}

/// Crowns of one cover.
pub struct Layer {
    /// Optical depth of all of it, seen straight up.
    tau: f32,
    /// Area of a crown's side over that of its top.
    side: f32,
    /// Radius of the own crown over the tree's height.
    own: f32,
    /// Length of crowns over the tree's height.
    pub length: f32,
}

impl Layer {
    /// Crowns of `trees` that cover this fraction of the ground.
    pub fn new(cover: f32, trees: &StandTrees) -> Self {
        let (width, length, fill) = trees.crown();
        Self { tau: -(1.0 - fill * cover).ln(), side: 4.0 / (PI * width), own: 0.5 * width, length }
    }

    /// Fraction of light from an elevation of this sine that arrives at `depth`.
    pub fn transmittance(&self, depth: f32, sine: f32) -> f32 {
        let sine = sine.clamp(0.02, 1.0);
        let cotangent = (1.0 - sine * sine).sqrt() / sine;
        (-self.tau * (1.0 / self.length + self.side * cotangent) * depth.min(self.length)).exp()
    }

    /// The same without the tree's own crown.
    pub fn neighbour_transmittance(&self, depth: f32, sine: f32) -> f32 {
        let sine = sine.clamp(0.02, 1.0);
        let tangent = sine / (1.0 - sine * sine).max(1e-6).sqrt();
        self.transmittance((depth - self.own * tangent).max(0.0), sine)
    }

    /// The neighbours' transmittance for the sky's radiance that passes the own crown by these entries.
    fn sky_transmittance_through<'a>(&self, sky: impl Iterator<Item = (&'a Ring, &'a [Entry])>) -> Vec3 {
        let (mut part, mut whole) = (Vec3::ZERO, Vec3::ZERO);
        for ((sine, radiance), entries) in sky {
            for entry in entries {
                let seen = *radiance * entry.transmittance;
                whole += seen;
                part += seen * self.transmittance(entry.depth, *sine);
            }
        }
        ratio(part, whole)
    }

    /// Fraction of the sky's irradiance on level ground that the crowns let through.
    pub fn sky_flux_transmittance(&self, rings: &[Ring]) -> Vec3 {
        let part = rings.iter().map(|(sine, radiance)| *radiance * *sine * self.transmittance(1.0, *sine)).sum();
        ratio(part, rings.iter().map(|(sine, radiance)| *radiance * *sine).sum())
    }

    /// Transmittance for diffuse light of a layer of the thickness `depth` within the crowns: from the mean of the
    /// cosine-weighted optical depths.
    pub fn diffuse_transmittance(&self, depth: f32) -> f32 {
        (-self.tau * (1.0 / self.length + 0.5 * PI * self.side) * depth).exp()
    }
}

/// What the own crown leaves of the sky at a depth, ring by ring.
pub struct OwnSky {
    leaves: Vec<Vec<Entry>>,
    trunk: Vec<Entry>,
}

impl OwnSky {
    /// That of the crown `crown`.
    pub fn new(crown: &OwnCrown, depth: f32) -> Self {
        let tangent = |ring: usize| {
            let sine = ring_sine(ring);
            sine / (1.0 - sine * sine).max(1e-6).sqrt()
        };
        Self {
            leaves: (0..RINGS).map(|ring| crown.entries_of_leaves(depth, tangent(ring)).collect()).collect(),
            trunk: (0..RINGS).map(|ring| crown.entry_of_trunk(depth, tangent(ring))).collect(),
        }
    }

    /// The neighbours' transmittance for what leaves see of the sky.
    pub fn of_leaves(&self, layer: &Layer, rings: &[Ring]) -> Vec3 {
        layer.sky_transmittance_through(rings.iter().zip(self.leaves.iter().map(Vec::as_slice)))
    }

    /// The same for a trunk.
    pub fn of_trunk(&self, layer: &Layer, rings: &[Ring]) -> Vec3 {
        layer.sky_transmittance_through(rings.iter().zip(self.trunk.iter().map(std::slice::from_ref)))
    }
}
