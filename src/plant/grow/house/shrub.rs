//! A bush of many small leaves, and a climber on a wall.

use std::f32::consts::{PI, TAU};

use glam::{Quat, Vec3};

use super::assembly::{Assembly, Blade, Matter};
use super::blade::{BladeGrid, Pose};
use super::potted::{around, cells, on};
use super::solid;
use crate::plant::grow::random::Random;

/// A shoot that grows from `from`: each piece turns at random and towards the light.
fn wander(
    random: &mut Random,
    from: Vec3,
    along: Vec3,
    length: f32,
    radii: [f32; 2],
    lift: f32,
    steps: usize,
) -> Vec<(Vec3, f32)> {
    let mut points = vec![(from, radii[0])];
    let mut direction = along;
    for step in 0..steps {
        let stray = 0.16 * Vec3::new(random.signed(), random.signed(), random.signed());
        direction = (direction + stray + Vec3::Y * (lift / steps as f32)).normalize_or(direction);
        let radius = radii[0] + (radii[1] - radii[0]) * (step + 1) as f32 / steps as f32;
        points.push((points[step].0 + direction * (length / steps as f32), radius));
    }
    points
}

/// A leaf on a twig at `at`, turned by `side` about it.
fn leaf(assembly: &mut Assembly, random: &mut Random, grid: &BladeGrid, at: Vec3, twig: Vec3, angle: f32, size: f32) {
    let out = Quat::from_axis_angle(twig, angle) * twig.any_orthonormal_vector();
    let direction = (twig * 0.55 + out * 0.85 - Vec3::Y * (0.10 + 0.45 * random.unit())).normalize_or(out);
    let light = (Vec3::Y
        + 0.35 * Vec3::new(at.x, 0.0, at.z).normalize_or_zero()
        + 0.40 * Vec3::new(random.signed(), random.signed(), random.signed()))
    .normalize_or(Vec3::Y);
    let pose = Pose {
        joint: at + direction * (0.10 * size),
        along: direction,
        up: light,
        height: size * (1.0 + 0.22 * random.signed()),
        bend: 0.45 + 0.45 * random.unit(),
        late: 0.3,
        fold: 0.22 + 0.12 * random.signed(),
        curl: 0.06,
        waves: (0.008, 2.0),
        twist: 0.3 * random.signed(),
        phase: TAU * random.unit(),
    };
    assembly.leaf(&Blade::Fig, grid, &pose);
}

/// A weeping fig as a bush. `density`: number of its branches, relative to a full one.
pub(super) fn bush(random: &mut Random, detail: f32, density: f32) -> Assembly {
    let mut assembly = Assembly::default();
    let bark = Matter::Stem(Vec3::new(0.125, 0.100, 0.075));
    let young = Matter::Stem(Vec3::new(0.13, 0.15, 0.06));
    let grid = Blade::Fig.grid(2, cells(2.2, detail));
    let stems = 7;
    for stem in 0..stems {
        let out = around(TAU * (stem as f32 + 0.3 * random.signed()) / stems as f32);
        let spread = if stem == 0 { 0.05 } else { 0.24 + 0.26 * random.unit() };
        let along = (Vec3::Y + out * spread).normalize_or(Vec3::Y);
        let foot = out * 0.05 - Vec3::Y * 0.03;
        let length = 1.30 + 0.20 * random.signed() - 0.22 * spread;
        let axis = wander(random, foot, along, length, [0.014, 0.0045], 0.25, 14);
        solid::tube(assembly.mesh(&bark), &axis, 8);
        let mut angle = TAU * random.unit();
        let branches = (17.0 * density).round().max(1.0) as u32;
        for branch in 0..branches {
            let share = (branch as f32 + random.unit()) / branches as f32;
            let (at, tangent) = on(&axis, 0.12 + 0.86 * share);
            angle += 2.4 + 0.5 * random.signed();
            let side = Quat::from_axis_angle(tangent, angle) * tangent.any_orthonormal_vector();
            let direction = (side + tangent * 0.55).normalize_or(side);
            let length = (0.42 - 0.22 * share) * (1.0 + 0.2 * random.signed());
            let twig = wander(random, at, direction, length, [0.0040, 0.0018], 0.20, 7);
            solid::tube(assembly.mesh(&bark), &twig, 5);
            for shoot in 0..5 {
                let (at, tangent) = on(&twig, 0.22 + 0.18 * shoot as f32 + 0.08 * random.unit());
                let turn = TAU * random.unit();
                let side = Quat::from_axis_angle(tangent, turn) * tangent.any_orthonormal_vector();
                let direction = (side * 0.8 + tangent).normalize_or(side);
                let length = 0.12 + 0.06 * random.unit();
                let tender = wander(random, at, direction, length, [0.0016, 0.0008], -0.5, 3);
                solid::tube(assembly.mesh(&young), &tender, 3);
                for index in 0..6 {
                    let (at, tangent) = on(&tender, (index as f32 + 0.6) / 6.0);
                    let turn = PI * index as f32 + 0.5 * random.signed();
                    leaf(&mut assembly, random, &grid, at, tangent, turn, 0.062);
                }
            }
            for index in 0..4 {
                let (at, tangent) = on(&twig, 0.2 + 0.2 * index as f32);
                leaf(&mut assembly, random, &grid, at, tangent, PI * index as f32, 0.066);
            }
        }
    }
    assembly
}

/// A wall to climb on: the region `width` by `height` metres from its foot at `foot` on, along `along`, facing `face`.
pub(super) struct Wall {
    pub foot: Vec3,
    pub along: Vec3,
    pub face: Vec3,
    pub width: f32,
    pub height: f32,
}

/// A climber with `shoots` shoots, which start at the fraction `from` of the wall's width.
pub(super) fn climber(assembly: &mut Assembly, random: &mut Random, wall: &Wall, from: f32, shoots: usize) {
    let bark = Matter::Stem(Vec3::new(0.15, 0.115, 0.08));
    let grid = Blade::Begonia.grid(3, 2);
    let point = |x: f32, y: f32, off: f32| wall.foot + wall.along * x + Vec3::Y * y + wall.face * off;
    for _ in 0..shoots {
        let (mut x, mut y) = (wall.width * (from + 0.05 * random.signed()), 0.0);
        let mut angle = 0.9 * random.signed();
        let steps = 30 + (16.0 * random.unit()) as usize;
        let mut points = Vec::with_capacity(steps + 1);
        for step in 0..=steps {
            points.push((point(x, y, 0.008), 0.0045 * (1.0 - 0.8 * step as f32 / steps as f32)));
            angle = (angle + 0.32 * random.signed()) * 0.97;
            x = (x + 0.075 * angle.sin()).clamp(0.02, wall.width - 0.02);
            y = (y + 0.075 * angle.cos()).clamp(0.0, wall.height);
        }
        solid::tube(assembly.mesh(&bark), &points, 5);
        for index in 1..points.len() {
            let (at, along) = on(&points, index as f32 / (points.len() - 1) as f32);
            for side in [-1.0, 1.0] {
                if random.unit() < 0.18 {
                    continue;
                }
                let aside = along.cross(wall.face) * side;
                let out = 0.022 + 0.030 * random.unit();
                let droop = (Vec3::NEG_Y + aside * 0.8 * random.unit() + wall.face * 0.35).normalize_or(Vec3::NEG_Y);
                let up =
                    (wall.face + 0.35 * Vec3::Y + 0.35 * Vec3::new(random.signed(), random.signed(), random.signed()))
                        .normalize_or(wall.face);
                let pose = Pose {
                    joint: at + aside * (0.02 + 0.045 * random.unit()) + wall.face * out,
                    along: droop,
                    up,
                    height: 0.075 + 0.045 * random.unit(),
                    bend: 0.35,
                    fold: 0.12,
                    curl: 0.12,
                    twist: 0.2 * random.signed(),
                    ..Pose::default()
                };
                assembly.leaf(&Blade::Begonia, &grid, &pose);
            }
        }
    }
}
