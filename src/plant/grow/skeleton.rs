//! The skeleton of a tree: its stems as polylines with radii (Weber & Penn 1995, 4.1 to 4.6 and 4.8).
//!
//! A stem's frame has its z axis along the stem; x is the axis about which the stem turns away from its parent.
//! Every stem draws from a random stream of its own, split from its parent's by its index, so that a change of one
//! level's parameters leaves the levels before it as they were.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Quat, Vec3};

use super::ROOT_DEPTH;
use super::parameters::{BranchParameters, GrowParameters, StemParameters};
use super::random::Random;

/// A point of a stem's axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// Metres in the plant's frame.
    pub position: Vec3,
    /// Radius of the wood in metres; 0 at the tip.
    pub radius: f32,
    /// Metres along the stem from its base.
    pub distance: f32,
    /// Depth of the root lobes as a fraction of the radius.
    pub lobe: f32,
    /// 0 inside the crown, at the trunk, to 1 at the crown's outside.
    pub outward: f32,
}

/// A stem, or from a fork on one prong of it, from base to tip; two nodes at least.
#[derive(Clone, Debug)]
pub(super) struct Stem {
    /// 0 for the trunk, 1 for boughs and so on.
    pub level: usize,
    /// The axis.
    pub nodes: Vec<Node>,
}

/// All wood of a tree. The trunk is the first stem; parents precede their children.
#[derive(Clone, Debug)]
pub(super) struct Skeleton {
    /// The stems.
    pub stems: Vec<Stem>,
    /// Height of this individual over the species' mean height.
    pub scale: f32,
}

/// Stems of one tree at most; what would grow beyond is left out. Above what a valid species asks for without forks.
const STEM_LIMIT: usize = 120_000;
/// The thinnest wood in metres, but for tips.
const MIN_RADIUS: f32 = 0.0012;
/// Radius of each prong of a fork over the radius below it. Between Leonardo's rule for two equal prongs (0.71) and
/// the paper (1).
const PRONG: f32 = 0.82;
/// Distances from the ground, in metres, at which the trunk's foot has nodes for its flare.
const FOOT: [f32; 7] = [0.12, 0.3, 0.55, 0.9, 1.35, 1.9, 2.6];

/// Grows the stems of an individual. The species must be valid.
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

/// A wave around the crown by which its sides differ.
struct Side {
    waves: f32,
    phase: f32,
    twist: f32,
    weight: f32,
}

/// How a stem (or a prong) begins.
struct Sprout {
    level: usize,
    origin: Vec3,
    rotation: Quat,
    /// Of the whole stem, from its base.
    length: f32,
    /// Distance from the stem's base at which this piece begins: 0, or that of its fork.
    begin: f32,
    /// Radius that the whole stem has at its base.
    radius: f32,
    /// Factor on the radius from the forks so far.
    thickness: f32,
    outward: f32,
    /// Part of a fork that is due, 0 to 1 (the error diffusion of 4.2).
    debt: f32,
}

/// A node with its frame, while the stem grows.
#[derive(Clone, Copy)]
struct Knot {
    position: Vec3,
    rotation: Quat,
    distance: f32,
    thickness: f32,
}

struct Grower<'a> {
    species: &'a GrowParameters,
    height: f32,
    sides: [Side; 3],
    /// The trunk, from below: the middle of the envelope.
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
            // 4.6: shorten until the tip is within the envelope; what is left of it too short does not grow. Only
            // prongs of the trunk and boughs obey, each to its own measure: a crown is not clipped as a hedge is.
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

    /// Follows the axis (4.1) and notes the prongs that leave it (4.2).
    fn trace(&self, sprout: &Sprout, random: &Random) -> (Vec<Knot>, Vec<Sprout>) {
        let stem = self.parameters(sprout.level);
        let mut draw = random.split(0);
        let segments = stem.segments as f32;
        let step = sprout.length / segments;
        let fork_rate = stem.splits / (segments * (1.0 - stem.split_from).max(1.0 / segments));
        let (mut position, mut rotation) = (sprout.origin, sprout.rotation);
        let (mut distance, mut thickness, mut debt) = (sprout.begin, sprout.thickness, sprout.debt);
        let mut knots = vec![Knot { position, rotation, distance, thickness }];
        let mut prongs = Vec::new();
        if sprout.begin > 0.0 {
            thickness *= PRONG;
        }
        while sprout.length - distance > 0.01 * step {
            let advance = step.min(sprout.length - distance);
            position += rotation * Vec3::Z * advance;
            distance += advance;
            knots.push(Knot { position, rotation, distance, thickness });

            let along = distance / sprout.length;
            let turn = if stem.curve_back_deg == 0.0 {
                stem.curve_deg / segments
            } else if along < 0.5 {
                2.0 * stem.curve_deg / segments
            } else {
                2.0 * stem.curve_back_deg / segments
            };
            let wander = stem.curve_variation_deg / segments;
            let about_x = (turn + wander * draw.signed()).to_radians();
            let about_y = (wander * draw.signed()).to_radians();
            rotation = rotation * Quat::from_rotation_x(about_x) * Quat::from_rotation_y(about_y);
            rotation = attract(rotation, stem.attraction_up / segments);

            debt += if along >= stem.split_from { fork_rate } else { 0.0 };
            if debt >= 1.0 && along < 0.85 {
                debt -= 1.0;
                let angle = (stem.split_angle_deg + stem.split_angle_variation_deg * draw.signed()).to_radians();
                // A trunk forks to any side, a bough rather into a fan that lies level.
                let azimuth = if sprout.level == 0 {
                    draw.range(0.0, TAU)
                } else {
                    FRAC_PI_2.copysign(draw.signed()) + 0.5 * draw.signed()
                };
                let (to, fro) = (Quat::from_rotation_z(azimuth), Quat::from_rotation_z(-azimuth));
                let share = draw.range(0.6, 0.85);
                prongs.push(Sprout {
                    level: sprout.level,
                    origin: position,
                    rotation: (rotation * to * Quat::from_rotation_x(share * angle) * fro).normalize(),
                    length: distance + (sprout.length - distance) * draw.range(0.65, 0.98),
                    begin: distance,
                    radius: sprout.radius,
                    thickness,
                    outward: sprout.outward,
                    debt: 0.5 * draw.unit(),
                });
                rotation = rotation * to * Quat::from_rotation_x((share - 1.0) * angle) * fro;
                thickness *= PRONG;
            }
            rotation = rotation.normalize();
        }
        (knots, prongs)
    }

    /// Is a point outside the envelope of 4.6, widened by `slack`? It is measured from the middle between the trunk
    /// and the vertical of the paper, so that a bent tree keeps its top, and the sides of the crown differ.
    fn is_outside(&self, point: Vec3, slack: f32) -> bool {
        self.species.pruning.is_some_and(|pruning| {
            let ratio = (self.height - point.y) / (self.height * (1.0 - self.species.trunk.bare));
            let above = self.axis.partition_point(|p| p.y < point.y).min(self.axis.len() - 1);
            let (low, high) = (self.axis[above.saturating_sub(1)], self.axis[above]);
            let t = ((point.y - low.y) / (high.y - low.y).max(1e-3)).clamp(0.0, 1.0);
            let out = (point - 0.5 * low.lerp(high, t)) * Vec3::new(1.0, 0.0, 1.0);
            out.length() > slack * self.height * pruning.radius(ratio) * self.side(out, ratio)
        })
    }

    /// Gives the axis its radii (4.4), and the trunk its foot.
    fn nodes(&self, sprout: &Sprout, knots: &[Knot]) -> Vec<Node> {
        let stem = self.parameters(sprout.level);
        let node = |knot: &Knot| {
            let along = (knot.distance / sprout.length).clamp(0.0, 1.0);
            let flare = if sprout.level == 0 { flare(along) } else { 0.0 };
            let radius = knot.thickness * tapered(sprout.radius, sprout.length, stem.taper, along);
            let outward = match sprout.level {
                0 => smoothstep(0.6, 1.0, along),
                1 => sprout.outward + (1.0 - sprout.outward) * along,
                _ => sprout.outward + (1.0 - sprout.outward) * 0.4 * along,
            };
            Node {
                position: knot.position,
                radius: radius.max(MIN_RADIUS) * (1.0 + self.species.flare * flare),
                distance: knot.distance,
                lobe: self.species.lobe_depth * flare.sqrt(),
                outward,
            }
        };
        let mut nodes = Vec::with_capacity(knots.len() + FOOT.len() + 2);
        let is_foot = sprout.level == 0 && sprout.begin == 0.0;
        if is_foot {
            let mut root = node(&knots[0]);
            root.position.y -= ROOT_DEPTH;
            root.distance = -ROOT_DEPTH;
            root.radius *= 1.12;
            nodes.push(root);
        }
        let mut feet = FOOT.iter().copied().filter(|_| is_foot && self.species.flare > 0.0).peekable();
        for (index, knot) in knots.iter().enumerate() {
            while let Some(foot) = feet.next_if(|&foot| foot < knot.distance) {
                nodes.push(node(&at(knots, foot)));
            }
            let mut new = node(knot);
            if index + 1 == knots.len() {
                // The tip: a point where the stem tapers to one, else a round end a radius long.
                let blunt = new.radius > 0.25 * nodes.last().map_or(0.0, |before: &Node| before.radius);
                if blunt {
                    nodes.push(new);
                    new.position += knot.rotation * Vec3::Z * new.radius;
                    new.distance += new.radius;
                }
                new.radius = 0.0;
            }
            nodes.push(new);
        }
        nodes
    }

    /// The branches of a piece of a stem (4.3), before they grow.
    fn children(
        &self,
        branches: &BranchParameters,
        sprout: &Sprout,
        knots: &[Knot],
        nodes: &[Node],
        random: &Random,
    ) -> Vec<Sprout> {
        let parent = self.parameters(sprout.level);
        let mut draw = random.split(1);
        let (first, last) = (sprout.begin.max(parent.bare * sprout.length), sprout.length);
        let share = (last - first) / (sprout.length * (1.0 - parent.bare));
        // 4.3: a parent shorter than its siblings has fewer branches.
        let fullness = match sprout.level {
            0 => 1.0,
            level => {
                let mean = self.parameters(level).length * self.reach(level - 1);
                0.2 + 0.8 * (sprout.length / mean).min(1.25)
            }
        };
        let crowding = if sprout.begin > 0.0 { 0.75 } else { 1.0 };
        let count = (branches.count as f32 * share * fullness * crowding + draw.unit()) as usize;
        let mut azimuth = draw.range(0.0, 360.0);
        let mut children = Vec::with_capacity(count);
        for index in 0..count {
            let whorl = branches.whorl.max(1) as usize;
            let (place, places) = (index / whorl, count.div_ceil(whorl));
            let jitter = if whorl == 1 { 0.8 } else { 0.35 };
            let along = (place as f32 + 0.5 + jitter * (draw.unit() - 0.5)) / places as f32;
            let distance = first + (last - first) * along;
            let wobble = branches.rotate_variation_deg * draw.signed();
            let turn = if branches.rotate_deg < 0.0 {
                let side = if index % 2 == 0 { 1.0 } else { -1.0 };
                side * -branches.rotate_deg + wobble
            } else {
                azimuth += branches.rotate_deg + if whorl == 1 { wobble } else { 0.0 };
                let spoke = if whorl == 1 { 0.0 } else { 360.0 * (index % whorl) as f32 / whorl as f32 + wobble };
                // Within a whorl the golden angle turns the whorl, not the branch.
                if whorl == 1 { azimuth } else { place as f32 * branches.rotate_deg + spoke }
            };
            let knot = at(knots, distance);
            let under = node_at(nodes, distance);
            let ratio = ((sprout.length - distance) / (sprout.length * (1.0 - parent.bare))).clamp(0.0, 1.0);
            let variation = branches.down_angle_variation_deg;
            let down = branches.down_angle_deg
                + if variation >= 0.0 {
                    variation * draw.signed()
                } else {
                    // 4.3, negative nDownAngleV: ordered along the parent; a tenth of it at random.
                    variation * (1.0 - 2.0 * (0.2 + 0.8 * ratio)) + 0.25 * variation * draw.signed()
                };
            let rotation = knot.rotation
                * Quat::from_rotation_z(turn.to_radians())
                * Quat::from_rotation_x(down.clamp(0.0, 180.0).to_radians());
            let relative = branches.stem.length + branches.stem.length_variation * draw.signed();
            let length = if sprout.level == 0 {
                sprout.length * relative * self.species.shape.ratio(ratio) * self.side(rotation * Vec3::Z, ratio)
            } else {
                relative * (sprout.length - 0.6 * distance)
            };
            let debt = draw.unit();
            if length < 0.02 {
                continue;
            }
            let radius = sprout.radius * sprout.thickness * (length / sprout.length).powf(self.species.ratio_power);
            children.push(Sprout {
                level: sprout.level + 1,
                origin: knot.position,
                rotation: rotation.normalize(),
                length,
                begin: 0.0,
                radius: radius.min(0.85 * under.radius).max(MIN_RADIUS),
                thickness: 1.0,
                outward: under.outward,
                debt,
            });
        }
        children
    }

    /// Length in metres of a mean stem of a level, were it at its parent's base.
    fn reach(&self, level: usize) -> f32 {
        (0..=level).map(|level| self.parameters(level).length).product::<f32>() * self.height
    }

    /// Factor on the length of the boughs of one side of the crown.
    fn side(&self, direction: Vec3, ratio: f32) -> f32 {
        let azimuth = direction.x.atan2(direction.z);
        let (sum, weights) = self.sides.iter().fold((0.0, 0.0), |(sum, weights), side| {
            let wave = (side.waves * azimuth + side.phase + side.twist * ratio).sin();
            (sum + side.weight * wave, weights + side.weight)
        });
        1.0 + self.species.irregularity * sum / weights
    }
}

/// Turns a frame towards the zenith (4.8; the paper turns about x only, which leaves stems that wander sideways).
fn attract(rotation: Quat, amount: f32) -> Quat {
    let axis = (rotation * Vec3::Z).cross(Vec3::Y);
    let sine = axis.length();
    if sine < 1e-3 { rotation } else { Quat::from_axis_angle(axis / sine, amount * sine) * rotation }
}

/// Radius at the fraction `along` of a stem (4.4 with `nTaper` from 0 to 2).
fn tapered(radius: f32, length: f32, taper: f32, along: f32) -> f32 {
    let unit = if taper < 1.0 { taper } else { 2.0 - taper };
    let cone = radius * (1.0 - unit * along);
    let left = (1.0 - along) * length;
    if taper <= 1.0 || left >= cone { cone } else { (cone * cone - (left - cone) * (left - cone)).max(0.0).sqrt() }
}

/// 1 at the trunk's foot, falling to 0 at an eighth of its length (4.4).
fn flare(along: f32) -> f32 {
    ((100f32.powf(1.0 - 8.0 * along) - 1.0) / 99.0).clamp(0.0, 1.0)
}

/// The knot at a distance within a piece.
fn at(knots: &[Knot], distance: f32) -> Knot {
    let after = knots.partition_point(|knot| knot.distance < distance).clamp(1, knots.len() - 1);
    let (a, b) = (knots[after - 1], knots[after]);
    let t = ((distance - a.distance) / (b.distance - a.distance).max(1e-6)).clamp(0.0, 1.0);
    Knot {
        position: a.position.lerp(b.position, t),
        rotation: a.rotation.slerp(b.rotation, t),
        distance,
        thickness: a.thickness + (b.thickness - a.thickness) * t,
    }
}

/// The node at a distance within a stem, interpolated linearly.
pub(super) fn node_at(nodes: &[Node], distance: f32) -> Node {
    let after = nodes.partition_point(|node| node.distance < distance).clamp(1, nodes.len() - 1);
    let (a, b) = (nodes[after - 1], nodes[after]);
    let t = ((distance - a.distance) / (b.distance - a.distance).max(1e-6)).clamp(0.0, 1.0);
    let mix = |a: f32, b: f32| a + (b - a) * t;
    Node {
        position: a.position.lerp(b.position, t),
        radius: mix(a.radius, b.radius),
        distance,
        lobe: mix(a.lobe, b.lobe),
        outward: mix(a.outward, b.outward),
    }
}

fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flare_follows_the_paper() {
        assert_eq!(flare(0.0), 1.0);
        assert!((flare(0.0625) - 9.0 / 99.0).abs() < 1e-6);
        assert_eq!(flare(0.125), 0.0);
        assert_eq!(flare(0.9), 0.0);
    }

    #[test]
    fn taper_runs_from_cylinder_to_cone_to_round_end() {
        assert_eq!(tapered(0.2, 5.0, 0.0, 1.0), 0.2);
        assert!((tapered(0.2, 5.0, 1.0, 0.75) - 0.05).abs() < 1e-6);
        assert!((tapered(0.2, 5.0, 2.0, 0.5) - 0.2).abs() < 1e-6);
        // A radius before the end of a round end the whole radius is left, at the end none.
        assert!((tapered(0.2, 5.0, 2.0, 0.96) - 0.2).abs() < 1e-6);
        assert!(tapered(0.2, 5.0, 2.0, 1.0) < 1e-6);
    }

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

    #[test]
    fn pruned_tips_stay_in_the_envelope() {
        let mut species = GrowParameters::broadleaf();
        species.pruning = Some(super::super::Pruning { width: 0.12, width_peak: 0.4, power_low: 0.5, power_high: 0.5 });
        species.irregularity = 0.0;
        species.lean_deg = 0.0;
        species.trunk.curve_variation_deg = 0.0;
        species.trunk.splits = 0.0;
        species.branches.truncate(1);
        let skeleton = grow(&species, &Random::new(11));
        assert!(skeleton.stems.len() > 10);
        let widest = 0.12 * species.height * skeleton.scale;
        let radii = skeleton.stems[1..]
            .iter()
            .filter_map(|stem| stem.nodes.last())
            .map(|tip| tip.position.x.hypot(tip.position.z));
        let reached = radii.fold(0.0, f32::max);
        assert!(reached <= 1.16 * widest + 0.01 && reached > 0.7 * widest, "{reached} of {widest}");
    }
}
