//! Plants in pots: rubber plant, spider plant, begonia.

use std::f32::consts::{PI, TAU};

use glam::{Quat, Vec2, Vec3};

use super::assembly::{Assembly, Blade, Matter};
use super::blade::Pose;
use super::solid;
use crate::plant::grow::random::Random;
use crate::plant::grow::textures::masonry::Masonry;

/// The golden angle, by which leaves follow each other around a stem.
const GOLDEN: f32 = 2.399_963;

/// A pot: its radii at foot and rim, its height, and its material.
struct Pot {
    foot: f32,
    rim: f32,
    height: f32,
    stone: Masonry,
}

impl Pot {
    /// Adds the pot at `at`, with its soil; gives the height of the soil.
    fn add(&self, assembly: &mut Assembly, at: Vec3) -> f32 {
        let Self { foot, rim, height, stone } = *self;
        let wall = 0.055 * rim + 0.004;
        let collar = 0.16 * height;
        let (below, above) = (height - collar, height);
        let outside = foot + (rim - foot) * (below / height);
        let profile = [
            Vec2::new(0.0, 0.0),
            Vec2::new(foot - 0.006, 0.0),
            Vec2::new(foot, 0.006),
            Vec2::new(outside, below),
            // The collar, with rounded edges.
            Vec2::new(outside + wall, below + 0.002),
            Vec2::new(rim + wall - 0.002, above - 0.005),
            Vec2::new(rim + wall - 0.006, above),
            Vec2::new(rim - 0.004, above),
            Vec2::new(rim - 0.008, above - 0.005),
            Vec2::new(rim - wall, above - 0.10 * height - 0.01),
        ];
        solid::turned(assembly.stone(stone), at, &profile, 56);
        let soil = above - 0.085 * height;
        let heap =
            [Vec2::new(rim - 0.6 * wall, soil), Vec2::new(0.5 * rim, soil + 0.012), Vec2::new(0.0, soil + 0.016)];
        solid::turned(assembly.stone(Masonry::Soil), at, &heap, 40);
        at.y + soil
    }
}

/// Points on a curve from `from` with the direction `along`, which bends towards `to`: positions and radii.
fn shoot(from: Vec3, along: Vec3, to: Vec3, length: f32, radii: [f32; 2], steps: usize) -> Vec<(Vec3, f32)> {
    let mut points = vec![(from, radii[0])];
    for step in 0..steps {
        let t = (step as f32 + 0.5) / steps as f32;
        let direction = along.lerp(to, t).normalize_or(along);
        let radius = radii[0] + (radii[1] - radii[0]) * (step + 1) as f32 / steps as f32;
        points.push((points[step].0 + direction * (length / steps as f32), radius));
    }
    points
}

/// Position and direction at the fraction `t` of a polyline.
pub(super) fn on(points: &[(Vec3, f32)], t: f32) -> (Vec3, Vec3) {
    let last = points.len() - 1;
    let x = (t.clamp(0.0, 1.0) * last as f32).min(last as f32 - 1e-3).max(0.0);
    let i = x as usize;
    let (a, b) = (points[i].0, points[(i + 1).min(last)].0);
    (a.lerp(b, x - i as f32), (b - a).normalize_or(Vec3::Y))
}

/// A horizontal direction.
pub(super) fn around(angle: f32) -> Vec3 {
    Vec3::new(angle.cos(), 0.0, angle.sin())
}

/// Cells along a leaf's side.
pub(super) fn cells(count: f32, detail: f32) -> usize {
    (count * detail).round().max(2.0) as usize
}

/// A rubber plant.
pub(super) fn rubber(random: &mut Random, detail: f32) -> Assembly {
    let mut assembly = Assembly::default();
    let pot = Pot { foot: 0.105, rim: 0.150, height: 0.26, stone: Masonry::Terracotta };
    let soil = pot.add(&mut assembly, Vec3::ZERO);
    let bark = Matter::Stem(Vec3::new(0.115, 0.095, 0.055));
    let green = Matter::Stem(Vec3::new(0.135, 0.165, 0.055));
    let sheath = Matter::Stem(Vec3::new(0.30, 0.055, 0.045));
    let grid = Blade::Rubber.grid(cells(10.0, detail), cells(22.0, detail));
    for (stem, (height, count)) in [(0.82, 22), (0.60, 16), (0.40, 12)].into_iter().enumerate() {
        let out = around(GOLDEN * 1.7 * stem as f32 + 0.5);
        let foot = Vec3::Y * (soil - 0.02) + out * (0.012 + 0.028 * stem as f32);
        let lean = (Vec3::Y + out * (0.06 + 0.17 * stem as f32)).normalize_or(Vec3::Y);
        let axis = shoot(foot, lean, (Vec3::Y + out * 0.02).normalize_or(Vec3::Y), height, [0.0105, 0.0058], 16);
        solid::tube(assembly.mesh(&bark), &axis, 12);
        let mut angle = TAU * random.unit();
        for index in 0..count {
            let share = index as f32 / (count - 1) as f32;
            let (at, tangent) = on(&axis, 0.16 + 0.83 * share.powf(0.85));
            angle += GOLDEN + 0.25 * random.signed();
            let outward = around(angle);
            // The upper leaves stand up, the lower ones spread and sag.
            let rise = 0.28 + 0.85 * share * share + 0.16 * random.signed();
            let direction = (outward * rise.cos() + tangent * rise.sin()).normalize_or(outward);
            let petiole = 0.035 + 0.022 * (1.0 - share);
            let stalk =
                shoot(at, (direction + tangent).normalize_or(direction), direction, petiole, [0.0036, 0.0027], 4);
            solid::tube(assembly.mesh(&green), &stalk, 7);
            let (joint, _) = on(&stalk, 1.0);
            let side = direction.cross(tangent).normalize_or(Vec3::X);
            let up = Quat::from_axis_angle(direction, 0.25 * random.signed()) * side.cross(direction);
            let grown = 1.0 - 0.38 * share.powi(3) - 0.10 * (1.0 - share).powi(4);
            let pose = Pose {
                joint: joint - direction * 0.006,
                along: direction,
                up,
                height: 0.27 * grown * (1.0 + 0.09 * random.signed()),
                bend: 0.38 + 0.45 * (1.0 - share) + 0.22 * random.signed(),
                late: 0.35,
                fold: 0.20 + 0.22 * share + 0.06 * random.signed(),
                curl: 0.10 + 0.05 * random.signed(),
                waves: (0.004, 2.0),
                twist: 0.18 * random.signed(),
                phase: TAU * random.unit(),
            };
            assembly.leaf(&Blade::Rubber, &grid, &pose);
        }
        // The next leaf in its red sheath.
        let (tip, direction) = on(&axis, 1.0);
        let bud: Vec<(Vec3, f32)> = (0..=10)
            .map(|i| {
                let t = i as f32 / 10.0;
                (tip + direction * (0.085 * t), 0.0056 * (1.0 - t).powf(0.6) + 0.0004)
            })
            .collect();
        solid::tube(assembly.mesh(&sheath), &bud, 10);
    }
    assembly
}

/// A tuft of straps at `at`, of about the length `length`.
pub(super) fn tuft(
    assembly: &mut Assembly,
    random: &mut Random,
    at: Vec3,
    axis: Vec3,
    length: f32,
    count: usize,
    cells: [usize; 2],
) {
    let grid = Blade::Spider.grid(cells[0], cells[1]);
    let tilt = Quat::from_rotation_arc(Vec3::Y, axis.normalize_or(Vec3::Y));
    for index in 0..count {
        let share = (index as f32 + 0.5) / count as f32;
        let angle = GOLDEN * index as f32 + 0.3 * random.signed();
        let outward = tilt * around(angle);
        // Outer leaves are older: longer, lower, more bent.
        let rise = 0.60 + 0.90 * share + 0.14 * random.signed();
        let direction = (outward * rise.cos() + axis * rise.sin()).normalize_or(outward);
        let up = (axis * rise.cos() - outward * rise.sin()).normalize_or(axis);
        let long = length * (1.0 - 0.35 * share) * (1.0 + 0.16 * random.signed());
        let pose = Pose {
            joint: at + outward * (0.055 * length * (1.0 - 0.7 * share)),
            along: direction,
            up,
            height: long,
            bend: 0.95 + 0.85 * rise + 0.40 * random.signed(),
            late: 0.45,
            fold: 0.42 + 0.1 * random.signed(),
            curl: 0.02,
            waves: (0.0015, 3.0),
            twist: 0.5 * random.signed(),
            phase: TAU * random.unit(),
        };
        assembly.leaf(&Blade::Spider, &grid, &pose);
    }
}

/// A spider plant, on a stool or without one and without runners.
pub(super) fn spider(random: &mut Random, detail: f32, on_stool: bool) -> Assembly {
    let mut assembly = Assembly::default();
    if on_stool {
        stool(&mut assembly);
    }
    let pot = Pot { foot: 0.080, rim: 0.112, height: 0.18, stone: Masonry::Glaze };
    let soil = pot.add(&mut assembly, if on_stool { Vec3::Y * STOOL } else { Vec3::ZERO });
    let crown = Vec3::Y * (soil + 0.008);
    tuft(&mut assembly, random, crown, Vec3::Y, 0.42, 84, [cells(4.0, detail), cells(26.0, detail)]);
    // Runners with plantlets.
    let runner = Matter::Stem(Vec3::new(0.34, 0.36, 0.14));
    for (index, angle) in [0.9f32, 2.35, 3.7, 5.6].into_iter().enumerate().filter(|_| on_stool) {
        let out = around(angle);
        let length = 0.36 + 0.07 * random.signed();
        let sag = (out * 0.45 - Vec3::Y).normalize_or(Vec3::NEG_Y);
        let rise = (out + Vec3::Y * (1.0 + 0.3 * random.unit())).normalize_or(out);
        let curve = shoot(crown, rise, sag, length + 0.16 * (index % 2) as f32, [0.0017, 0.0011], 22);
        solid::tube(assembly.mesh(&runner), &curve, 6);
        let (end, direction) = on(&curve, 1.0);
        let axis = (out * 0.55 + Vec3::Y * 0.8 - direction * 0.2).normalize_or(Vec3::Y);
        let length = 0.13 + 0.03 * random.unit();
        tuft(&mut assembly, random, end, axis, length, 13, [2, cells(10.0, detail)]);
        let (middle, _) = on(&curve, 0.72);
        tuft(&mut assembly, random, middle, (out + Vec3::Y).normalize_or(Vec3::Y), 0.075, 6, [2, cells(8.0, detail)]);
    }
    assembly
}

/// Height of the stool's seat, metres.
const STOOL: f32 = 0.40;

/// A wooden stool.
fn stool(assembly: &mut Assembly) {
    let mesh = assembly.stone(Masonry::Planks);
    let seat = [
        Vec2::new(0.0, STOOL - 0.030),
        Vec2::new(0.150, STOOL - 0.030),
        Vec2::new(0.160, STOOL - 0.022),
        Vec2::new(0.160, STOOL - 0.006),
        Vec2::new(0.154, STOOL),
        Vec2::new(0.0, STOOL),
    ];
    solid::turned(mesh, Vec3::ZERO, &seat, 48);
    for leg in 0..3 {
        let out = around(TAU * leg as f32 / 3.0 + 0.4);
        let points = [
            (out * 0.165, 0.011),
            (out * 0.135 + Vec3::Y * 0.2, 0.015),
            (out * 0.105 + Vec3::Y * (STOOL - 0.02), 0.014),
        ];
        solid::tube(mesh, &points, 10);
    }
    let ring: Vec<(Vec3, f32)> =
        (0..=24).map(|i| (around(TAU * i as f32 / 24.0) * 0.142 + Vec3::Y * 0.15, 0.005)).collect();
    solid::tube(mesh, &ring, 8);
}

/// A begonia.
pub(super) fn begonia(random: &mut Random, detail: f32) -> Assembly {
    let mut assembly = Assembly::default();
    let pot = Pot { foot: 0.072, rim: 0.100, height: 0.155, stone: Masonry::Terracotta };
    saucer(&mut assembly, 0.105);
    let soil = pot.add(&mut assembly, Vec3::Y * 0.012);
    let crown = Vec3::Y * (soil - 0.004);
    let red = Matter::Stem(Vec3::new(0.30, 0.10, 0.065));
    let grid = Blade::Begonia.grid(cells(9.0, detail), cells(9.0, detail));
    let count = 92;
    for index in 0..count {
        let share = (index as f32 + 0.5) / count as f32;
        let angle = GOLDEN * index as f32 + 0.2 * random.signed();
        let outward = around(angle);
        // Joints lie on a dome, in three storeys.
        let tilt = (0.05 + 1.42 * share.powf(0.62) + 0.10 * random.signed()).clamp(0.03, 1.62);
        let dome = Vec3::new(0.205, 0.225, 0.205) * (0.80 + 0.30 * random.unit());
        let joint = crown + (outward * tilt.sin() + Vec3::Y * tilt.cos()) * dome + Vec3::Y * 0.02;
        let root = crown + outward * (0.030 * share) + around(TAU * random.unit()) * 0.008;
        let rise = (joint - root).normalize_or(Vec3::Y);
        let stalk = shoot(
            root,
            (rise + Vec3::Y * 0.45).normalize_or(Vec3::Y),
            (rise - Vec3::Y * 0.45).normalize_or(rise),
            joint.distance(root),
            [0.0026, 0.0016],
            5,
        );
        solid::tube(assembly.mesh(&red), &stalk, 5);
        let (joint, _) = on(&stalk, 1.0);
        let facing = (outward * tilt.sin() * 0.8 + Vec3::Y * (0.45 + tilt.cos())).normalize_or(Vec3::Y);
        let facing =
            (facing + 0.22 * Vec3::new(random.signed(), random.signed(), random.signed())).normalize_or(Vec3::Y);
        let turned = Quat::from_axis_angle(Vec3::Y, 0.7 * random.signed()) * outward;
        let along = (turned * tilt.cos().max(0.25) - Vec3::Y * (0.15 + 0.6 * tilt.sin())).normalize_or(outward);
        let pose = Pose {
            joint,
            along,
            up: facing,
            height: (0.108 + 0.045 * share) * (1.0 + 0.20 * random.signed()),
            bend: 0.35 + 0.30 * random.unit(),
            late: 0.2,
            fold: 0.18 + 0.10 * random.signed(),
            curl: 0.14 + 0.08 * random.signed(),
            waves: (0.022, 2.0),
            twist: 0.2 * random.signed(),
            phase: TAU * random.unit(),
        };
        assembly.leaf(&Blade::Begonia, &grid, &pose);
    }
    blossoms(&mut assembly, random, crown, &red);
    assembly
}

/// Sprays of blossoms above the leaves.
fn blossoms(assembly: &mut Assembly, random: &mut Random, crown: Vec3, stem: &Matter) {
    let petal = Matter::Petal(Vec3::new(0.70, 0.30, 0.34));
    let heart = Matter::Petal(Vec3::new(0.72, 0.50, 0.06));
    for spray in 0..11 {
        let out = around(GOLDEN * spray as f32 + 0.8);
        let spread = 0.10 + 0.55 * random.unit();
        let direction = (Vec3::Y + out * spread).normalize_or(Vec3::Y);
        let nod = (direction + out * 0.5).normalize_or(direction);
        let stalk = shoot(crown, direction, nod, 0.275 + 0.055 * random.unit(), [0.0018, 0.0010], 8);
        solid::tube(assembly.mesh(stem), &stalk, 6);
        for blossom in 0..4 {
            let (at, along) = on(&stalk, 1.0 - 0.07 * blossom as f32);
            let side = around(TAU * random.unit());
            let pedicel = (along + side * 0.9).normalize_or(along);
            let twig = shoot(at, pedicel, (pedicel - Vec3::Y * 0.4).normalize_or(pedicel), 0.026, [0.0009, 0.0007], 3);
            solid::tube(assembly.mesh(stem), &twig, 5);
            let (center, face) = on(&twig, 1.0);
            let size = 0.013 * (1.0 + 0.25 * random.signed());
            for index in 0..4 {
                let across = face.any_orthonormal_vector();
                let turn = Quat::from_axis_angle(face, 0.5 * PI * index as f32 + 0.3);
                // Two large and two small petals.
                let long = size * if index % 2 == 0 { 1.25 } else { 0.9 };
                leaflet(assembly.mesh(&petal), center, turn * across, face, long, 0.55);
            }
            leaflet(
                assembly.mesh(&heart),
                center + face * 0.002,
                face.any_orthonormal_vector(),
                face,
                0.35 * size,
                0.6,
            );
        }
    }
}

/// A small rounded petal: a fan of triangles, cupped towards `face`.
fn leaflet(mesh: &mut crate::plant::PlantMesh, at: Vec3, along: Vec3, face: Vec3, length: f32, aspect: f32) {
    let side = along.cross(face).normalize_or(Vec3::X);
    let first = mesh.positions.len() as u32;
    let steps = 10;
    let place = |x: f32, y: f32| at + along * y + side * x + face * (0.35 * (y * y + 2.0 * x * x) / length.max(1e-4));
    let mut push = |x: f32, y: f32| {
        mesh.positions.push(place(x, y));
        mesh.normals.push((face - along * (0.5 * y / length) - side * (0.8 * x / length)).normalize_or(face));
        mesh.uvs.push(Vec2::new(0.5 + x / length, y / length));
    };
    push(0.0, 0.5 * length);
    for step in 0..=steps {
        let (sin, cos) = (TAU * step as f32 / steps as f32).sin_cos();
        push(aspect * length * cos, 0.5 * length * (1.0 + sin));
    }
    for step in 0..steps {
        mesh.triangles.push([first, first + 1 + step, first + 2 + step]);
    }
}

/// A saucer under a pot.
fn saucer(assembly: &mut Assembly, radius: f32) {
    let profile = [
        Vec2::new(0.0, 0.0),
        Vec2::new(0.82 * radius, 0.0),
        Vec2::new(1.08 * radius, 0.024),
        Vec2::new(1.04 * radius, 0.026),
        Vec2::new(0.84 * radius, 0.010),
        Vec2::new(0.0, 0.010),
    ];
    solid::turned(assembly.stone(Masonry::Terracotta), Vec3::ZERO, &profile, 48);
}
