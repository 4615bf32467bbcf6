//! Positions, lengths and radii of the branches of a stem (Weber & Penn 1995, 4.3 and 4.4).

use glam::{Quat, Vec3};

use super::super::parameters::BranchParameters;
use super::super::random::Random;
use super::axis::{Knot, at};
use super::radii::node_at;
use super::{Grower, MIN_RADIUS, Node, Sprout};

impl Grower<'_> {
    /// The branches of a piece of a stem (4.3), before they grow.
    pub(super) fn children(
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
            let (row, rows) = (index / whorl, count.div_ceil(whorl));
            let jitter = if whorl == 1 { 0.8 } else { 0.35 };
            let along = (row as f32 + 0.5 + jitter * (draw.unit() - 0.5)) / rows as f32;
            let distance = first + (last - first) * along;
            let wobble = branches.rotate_variation_deg * draw.signed();
            let turn = if branches.rotate_deg < 0.0 {
                let side = if index % 2 == 0 { 1.0 } else { -1.0 };
                side * -branches.rotate_deg + wobble
            } else {
                azimuth += branches.rotate_deg + if whorl == 1 { wobble } else { 0.0 };
                let spoke = if whorl == 1 { 0.0 } else { 360.0 * (index % whorl) as f32 / whorl as f32 + wobble };
                // The golden angle is between whorls, not between the branches of a whorl.
                if whorl == 1 { azimuth } else { row as f32 * branches.rotate_deg + spoke }
            };
            let knot = at(knots, distance);
            let under = node_at(nodes, distance);
            let ratio = ((sprout.length - distance) / (sprout.length * (1.0 - parent.bare))).clamp(0.0, 1.0);
            let variation = branches.down_angle_variation_deg;
            let down = branches.down_angle_deg
                + if variation >= 0.0 {
                    variation * draw.signed()
                } else {
                    // 4.3, negative nDownAngleV: ordered along the parent, with a random part of a tenth.
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

    /// Length in metres that a mean stem of a level has at the base of its parent.
    fn reach(&self, level: usize) -> f32 {
        (0..=level).map(|level| self.parameters(level).length).product::<f32>() * self.height
    }
}
