//! Radii along a stem (Weber & Penn 1995, 4.4), and the foot of the trunk.

use glam::Vec3;

use super::super::ROOT_DEPTH;
use super::axis::{Knot, at};
use super::{Grower, MIN_RADIUS, Node, Sprout};
use crate::math::smoothstep;

/// Heights above the ground, in metres, at which the foot of the trunk has nodes for its flare.
const FOOT: [f32; 7] = [0.12, 0.3, 0.55, 0.9, 1.35, 1.9, 2.6];

impl Grower<'_> {
    /// The nodes of the axis with their radii (4.4), and those of the foot of the trunk.
    pub(super) fn nodes(&self, sprout: &Sprout, knots: &[Knot]) -> Vec<Node> {
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
                // The tip: a point if the stem tapers to one, otherwise a round end as long as the radius.
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
}

/// Radius at the fraction `along` of a stem (4.4 with `nTaper` from 0 to 2).
fn tapered(radius: f32, length: f32, taper: f32, along: f32) -> f32 {
    let unit = if taper < 1.0 { taper } else { 2.0 - taper };
    let cone = radius * (1.0 - unit * along);
    let left = (1.0 - along) * length;
    if taper <= 1.0 || left >= cone { cone } else { (cone * cone - (left - cone) * (left - cone)).max(0.0).sqrt() }
}

/// 1 at the foot of the trunk, falling to 0 at an eighth of its length (4.4).
fn flare(along: f32) -> f32 {
    ((100f32.powf(1.0 - 8.0 * along) - 1.0) / 99.0).clamp(0.0, 1.0)
}

/// The node at a distance along a stem, interpolated linearly.
pub(in crate::plant::grow) fn node_at(nodes: &[Node], distance: f32) -> Node {
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
        // A round end has the whole radius one radius before its tip, and none at the tip.
        assert!((tapered(0.2, 5.0, 2.0, 0.96) - 0.2).abs() < 1e-6);
        assert!(tapered(0.2, 5.0, 2.0, 1.0) < 1e-6);
    }
}
