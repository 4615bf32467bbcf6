//! The skeleton of a tree: its stems as polylines with radii (Weber & Penn 1995, 4.1 to 4.6 and 4.8).
//!
//! The frame of a stem has its z axis along the stem; x is the axis about which the stem bends away from its parent.
//! Every stem has its own random stream, which is split from that of its parent by index. So a change of the parameters
//! of a level does not affect the levels before it.

mod axis;
mod branches;
mod envelope;
mod radii;

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Quat, Vec3};

use super::parameters::{GrowParameters, StemParameters};
use super::random::Random;
use envelope::Side;

pub(super) use radii::node_at;

/// A point of a stem's axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// Position in the frame of the plant, metres.
    pub position: Vec3,
    /// Radius of the wood in metres; 0 at the tip.
    pub radius: f32,
    /// Distance from the base along the stem, metres.
    pub distance: f32,
    /// Depth of the root lobes as a fraction of the radius.
    pub lobe: f32,
    /// How far out in the crown it is: 0 at the trunk, 1 at the outside.
    pub outward: f32,
}

/// A stem, or a prong of it beyond a fork, from base to tip. It has at least two nodes.
#[derive(Clone, Debug)]
pub(super) struct Stem {
    /// 0 for the trunk, 1 for boughs, and so on.
    pub level: usize,
    /// The axis.
    pub nodes: Vec<Node>,
}

/// All wood of a tree. The trunk is the first stem; parents precede their children.
#[derive(Clone, Debug)]
pub(super) struct Skeleton {
    /// The stems.
    pub stems: Vec<Stem>,
    /// Height of this individual divided by the mean height of the species.
    pub scale: f32,
}

/// Maximum number of stems of a tree; further ones are omitted. A valid species without forks stays below it.
const STEM_LIMIT: usize = 120_000;
/// Smallest radius of wood in metres, except at tips.
const MIN_RADIUS: f32 = 0.0012;

/// Grows the stems of an individual of a valid species.
pub(super) fn grow(species: &GrowParameters, random: &Random) -> Skeleton {
    let mut draw = random.split(0);
    let height = species.height + species.height_variation * draw.signed();
    let trunk = &species.trunk;
    let length = height * (trunk.length + trunk.length_variation * draw.signed()).max(0.01);
    let lean = Quat::from_axis_angle(
        Quat::from_rotation_y(draw.range(0.0, TAU)) * Vec3::X,
        (species.lean_deg * draw.unit()).to_radians(),
    );
    let spin = Quat::from_rotation_z(draw.range(0.0, TAU));
    let sides = std::array::from_fn(|i| Side {
        waves: (i + 1) as f32,
        phase: draw.range(0.0, TAU),
        twist: draw.range(-4.0, 4.0),
        weight: draw.range(0.5, 1.0) / (i + 1) as f32,
    });
    let mut grower = Grower { species, height, sides, axis: Vec::new(), stems: Vec::new() };
    let sprout = Sprout {
        level: 0,
        origin: Vec3::ZERO,
        rotation: lean * Quat::from_rotation_x(-FRAC_PI_2) * spin,
        length,
        begin: 0.0,
        radius: length * species.ratio,
        thickness: 1.0,
        outward: 0.0,
        debt: draw.unit(),
    };
    grower.stem(sprout, random.split(1));
    Skeleton { stems: grower.stems, scale: height / species.height }
}

/// The beginning of a stem or a prong.
struct Sprout {
    level: usize,
    origin: Vec3,
    rotation: Quat,
    /// Length of the whole stem, from its base.
    length: f32,
    /// Distance from the base of the stem at which this piece begins: 0, or that of its fork.
    begin: f32,
    /// Radius of the whole stem at its base.
    radius: f32,
    /// Factor on the radius, from the forks so far.
    thickness: f32,
    outward: f32,
    /// Accumulated fraction of the next fork, 0 to 1 (the error diffusion of 4.2).
    debt: f32,
}

struct Grower<'a> {
    species: &'a GrowParameters,
    height: f32,
    sides: [Side; 3],
    /// The axis of the trunk, from below: the middle of the envelope.
    axis: Vec<Vec3>,
    stems: Vec<Stem>,
}

impl Grower<'_> {
    fn parameters(&self, level: usize) -> &StemParameters {
        match level {
            0 => &self.species.trunk,
            _ => &self.species.branches[level - 1].stem,
        }
    }

    /// Grows a stem with its prongs and branches.
    fn stem(&mut self, mut sprout: Sprout, random: Random) {
        if self.stems.len() >= STEM_LIMIT {
            return;
        }
        let (mut knots, mut prongs) = self.trace(&sprout, &random);
        if self.stems.is_empty() {
            self.axis = knots.iter().map(|knot| knot.position).collect();
        } else {
            // 4.6: shorten until the tip is within the envelope. A stem that becomes too short does not grow. Only
            // prongs of the trunk and boughs are pruned, each to its own limit: a crown is not clipped like a hedge.
            let whole = sprout.length - sprout.begin;
            let mut rest = whole;
            let slack = random.split(2).range(0.84, 1.16);
            while sprout.level < 2 && knots.last().is_some_and(|tip| self.is_outside(tip.position, slack)) {
                rest *= 0.85;
                if rest < 0.25 * whole {
                    return;
                }
                sprout.length = sprout.begin + rest;
                if sprout.begin == 0.0 {
                    sprout.radius *= 0.92;
                }
                (knots, prongs) = self.trace(&sprout, &random);
            }
        }
        let nodes = self.nodes(&sprout, &knots);
        if let Some(branches) = self.species.branches.get(sprout.level) {
            let children = self.children(branches, &sprout, &knots, &nodes, &random);
            self.stems.push(Stem { level: sprout.level, nodes });
            for (index, child) in children.into_iter().enumerate() {
                self.stem(child, random.split(100 + index as u64));
            }
        } else {
            self.stems.push(Stem { level: sprout.level, nodes });
        }
        for (index, prong) in prongs.into_iter().enumerate() {
            self.stem(prong, random.split(10 + index as u64));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branches_start_on_wood_that_is_thicker() {
        let skeleton = grow(&GrowParameters::broadleaf(), &Random::new(3));
        for stem in skeleton.stems.iter().filter(|stem| (1..=2).contains(&stem.level)) {
            let base = stem.nodes[0];
            let touches = skeleton.stems.iter().filter(|other| other.level + 1 >= stem.level).any(|other| {
                !std::ptr::eq(other, stem)
                    && other.nodes.windows(2).any(|pair| {
                        let axis = pair[1].position - pair[0].position;
                        let t = ((base.position - pair[0].position).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
                        let reach = pair[0].radius.max(pair[1].radius) + 1e-3;
                        (pair[0].position + axis * t).distance(base.position) < reach
                    })
            });
            assert!(touches, "a stem of level {} hangs in the air at {}", stem.level, base.position);
        }
    }
}
