//! The axis of a stem (Weber & Penn 1995, 4.1 and 4.8), and where it forks (4.2).

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Quat, Vec3};

use super::super::random::Random;
use super::{Grower, Sprout};

/// Radius of each prong of a fork divided by the radius below the fork. It lies between Leonardo's rule for two equal
/// prongs (0.71) and the paper (1).
const PRONG: f32 = 0.82;

/// A node with its frame, used while the stem grows.
#[derive(Clone, Copy)]
pub(super) struct Knot {
    pub position: Vec3,
    pub rotation: Quat,
    pub distance: f32,
    pub thickness: f32,
}

impl Grower<'_> {
    /// Follows the axis (4.1) and records the prongs that leave it (4.2).
    pub(super) fn trace(&self, sprout: &Sprout, random: &Random) -> (Vec<Knot>, Vec<Sprout>) {
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
                // A trunk forks in any direction. The prongs of a bough form a roughly horizontal fan.
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
}

/// Rotates a frame towards the zenith (4.8). The paper rotates about x only, with which stems drift sideways.
fn attract(rotation: Quat, amount: f32) -> Quat {
    let axis = (rotation * Vec3::Z).cross(Vec3::Y);
    let sine = axis.length();
    if sine < 1e-3 { rotation } else { Quat::from_axis_angle(axis / sine, amount * sine) * rotation }
}

/// The knot at a distance along a piece.
pub(super) fn at(knots: &[Knot], distance: f32) -> Knot {
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
