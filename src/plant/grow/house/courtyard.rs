//! A courtyard: walls, paving, a door, a bench, a planter, and plants.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Quat, Vec2, Vec3};

use super::assembly::Assembly;
use super::shrub::{self, Wall};
use super::{potted, solid};
use crate::plant::PlantMesh;
use crate::plant::grow::random::Random;
use crate::plant::grow::textures::masonry::Masonry;

/// Half extents of the yard, and the height and thickness of its walls, metres.
const EAST: f32 = 3.4;
const NORTH: f32 = 3.0;
const HEIGHT: f32 = 2.7;
const THICK: f32 = 0.30;
/// Height of the paving above the ground.
pub(super) const PAVING: f32 = 0.03;

fn upright(mesh: &mut PlantMesh, low: Vec3, high: Vec3) {
    solid::block(mesh, 0.5 * (low + high), 0.5 * (high - low), Quat::IDENTITY);
}

/// A paved square of `half` metres to each side of the origin.
pub(super) fn paving(assembly: &mut Assembly, half: f32) {
    let mesh = assembly.stone(Masonry::Paving);
    upright(mesh, Vec3::new(-half, -0.3, -half), Vec3::new(half, PAVING, half));
}

/// The courtyard.
pub(super) fn courtyard(random: &mut Random) -> Assembly {
    let mut assembly = Assembly::default();
    let ground = PAVING;
    upright(
        assembly.stone(Masonry::Paving),
        Vec3::new(-EAST - THICK, -0.3, -NORTH - THICK),
        Vec3::new(EAST + THICK, ground, NORTH + 1.2),
    );
    walls(&mut assembly);
    bench(&mut assembly, Vec3::new(-EAST + 0.42, ground, 0.6));

    // The planter along the north wall, east of the door.
    let (low, high) = (Vec3::new(0.75, ground, -NORTH), Vec3::new(EAST - 0.02, ground + 0.46, -NORTH + 0.66));
    let plaster = assembly.stone(Masonry::Plaster);
    let rim = 0.10;
    upright(plaster, low, Vec3::new(low.x + rim, high.y, high.z));
    upright(plaster, Vec3::new(low.x, low.y, high.z - rim), high);
    let caps = assembly.stone(Masonry::Paving);
    let lid = |low: Vec3, high: Vec3| (low - Vec3::new(0.02, 0.0, 0.02), high + Vec3::new(0.02, 0.04, 0.02));
    for (a, b) in [
        lid(Vec3::new(low.x, high.y, low.z), Vec3::new(low.x + rim, high.y, high.z - rim - 0.02)),
        lid(Vec3::new(low.x, high.y, high.z - rim), high),
    ] {
        upright(caps, a, b);
    }
    let soil = high.y - 0.04;
    upright(
        assembly.stone(Masonry::Soil),
        Vec3::new(low.x + 0.01, low.y, low.z),
        Vec3::new(high.x - 0.01, soil, high.z - 0.02),
    );
    for (index, (x, scale)) in [(1.25, 0.92), (2.05, 1.08), (2.85, 0.86)].into_iter().enumerate() {
        let bush = shrub::bush(&mut random.split(10 + index as u64), 0.7, 0.65);
        assembly.add(&bush, Vec3::new(x, soil, -NORTH + 0.34), 1.3 * index as f32, scale);
    }

    // Plants in pots.
    let rubber = potted::rubber(&mut random.split(20), 0.6);
    assembly.add(&rubber, Vec3::new(-0.72, ground, -NORTH + 0.34), 0.4, 1.15);
    let tall = potted::rubber(&mut random.split(21), 0.6);
    assembly.add(&tall, Vec3::new(-EAST + 0.45, ground, -NORTH + 0.50), 2.0, 1.45);
    let beside = potted::rubber(&mut random.split(23), 0.6);
    assembly.add(&beside, Vec3::new(-EAST + 0.48, ground, 1.85), 4.0, 1.1);
    let spider = potted::spider(&mut random.split(22), 0.5, true);
    assembly.add(&spider, Vec3::new(-1.30, ground, -NORTH + 0.66), 0.3, 1.0);
    assembly.add(&spider, Vec3::new(2.75, ground, -1.35), 2.1, 1.1);
    let low = potted::spider(&mut random.split(24), 0.5, false);
    assembly.add(&low, Vec3::new(-EAST + 0.42, ground + 0.46, 1.12), 1.0, 1.0);
    for (index, (position, scale)) in [
        (Vec3::new(0.42, ground, -NORTH + 0.80), 1.0),
        (Vec3::new(0.98, ground, -NORTH + 1.02), 0.85),
        (Vec3::new(-EAST + 0.42, ground + 0.46, 0.15), 0.9),
        (Vec3::new(2.15, ground, -0.75), 1.15),
        (Vec3::new(2.75, ground, -0.45), 0.95),
    ]
    .into_iter()
    .enumerate()
    {
        let begonia = potted::begonia(&mut random.split(30 + index as u64), 0.6);
        assembly.add(&begonia, position, 1.9 * index as f32, scale);
    }

    basin(&mut assembly, &mut random.split(50), Vec3::new(-0.75, ground, -0.35));

    // Climbers on the west wall and over the door.
    let west = Wall {
        foot: Vec3::new(-EAST, ground, 1.9),
        along: Vec3::NEG_Z,
        face: Vec3::X,
        width: 4.6,
        height: HEIGHT - 0.1,
    };
    shrub::climber(&mut assembly, &mut random.split(40), &west, 0.68, 12);
    let north = Wall {
        foot: Vec3::new(-EAST, ground, -NORTH),
        along: Vec3::X,
        face: Vec3::Z,
        width: 3.2,
        height: HEIGHT - 0.05,
    };
    shrub::climber(&mut assembly, &mut random.split(41), &north, 0.30, 9);
    assembly
}

fn walls(assembly: &mut Assembly) {
    let (outer_x, outer_z) = (EAST + THICK, NORTH + THICK);
    // The door in the north wall: its opening.
    let (left, right, lintel) = (-0.38, 0.52, 2.06);
    let plaster = assembly.stone(Masonry::Plaster);
    upright(plaster, Vec3::new(-outer_x, -0.2, -outer_z), Vec3::new(left, HEIGHT, -NORTH));
    upright(plaster, Vec3::new(right, -0.2, -outer_z), Vec3::new(outer_x, HEIGHT, -NORTH));
    upright(plaster, Vec3::new(left, lintel, -outer_z), Vec3::new(right, HEIGHT, -NORTH));
    upright(plaster, Vec3::new(-outer_x, -0.2, -NORTH), Vec3::new(-EAST, HEIGHT, 2.2));
    // The east wall is low, so that the morning comes in.
    upright(plaster, Vec3::new(EAST, -0.2, -NORTH), Vec3::new(outer_x, 1.1, 2.2));
    let stone = assembly.stone(Masonry::Paving);
    let (over, cap) = (0.035, 0.07);
    upright(
        stone,
        Vec3::new(-outer_x - over, HEIGHT, -outer_z - over),
        Vec3::new(outer_x + over, HEIGHT + cap, -NORTH + over),
    );
    upright(
        stone,
        Vec3::new(-outer_x - over, HEIGHT, -NORTH + over),
        Vec3::new(-EAST + over, HEIGHT + cap, 2.2 + over),
    );
    upright(stone, Vec3::new(EAST - over, 1.1, -NORTH), Vec3::new(outer_x + over, 1.1 + cap, 2.2 + over));
    // The door's frame, step and leaf.
    let (frame, deep) = (0.11, 0.03);
    upright(stone, Vec3::new(left - frame, 0.0, -NORTH - 0.1), Vec3::new(left, lintel + frame, -NORTH + deep));
    upright(stone, Vec3::new(right, 0.0, -NORTH - 0.1), Vec3::new(right + frame, lintel + frame, -NORTH + deep));
    upright(stone, Vec3::new(left, lintel, -NORTH - 0.1), Vec3::new(right, lintel + frame, -NORTH + deep));
    upright(stone, Vec3::new(left - frame, 0.0, -NORTH), Vec3::new(right + frame, 0.14, -NORTH + 0.34));
    // Upright planks: the texture's planks lie, so the door is a block that lies and is turned up.
    let planks = assembly.stone(Masonry::Planks);
    let half = Vec3::new(0.5 * (lintel - 0.1), 0.5 * (right - left), 0.02);
    let center = Vec3::new(0.5 * (left + right), 0.5 * (lintel + 0.1), -NORTH - 0.10);
    solid::block(planks, center, half, Quat::from_rotation_z(FRAC_PI_2));
    for y in [0.55, 1.65] {
        let center = Vec3::new(center.x, y, center.z + 0.032);
        solid::block(planks, center, Vec3::new(0.42, 0.06, 0.014), Quat::IDENTITY);
    }
}

/// A round planter of stone with a bush, and straps around it.
fn basin(assembly: &mut Assembly, random: &mut Random, at: Vec3) {
    let profile = [
        Vec2::new(0.0, 0.0),
        Vec2::new(0.46, 0.0),
        Vec2::new(0.50, 0.05),
        Vec2::new(0.56, 0.36),
        Vec2::new(0.62, 0.38),
        Vec2::new(0.63, 0.40),
        Vec2::new(0.63, 0.44),
        Vec2::new(0.61, 0.46),
        Vec2::new(0.53, 0.46),
        Vec2::new(0.52, 0.44),
        Vec2::new(0.51, 0.36),
    ];
    solid::turned(assembly.stone(Masonry::Paving), at, &profile, 64);
    let soil = [Vec2::new(0.515, 0.39), Vec2::new(0.25, 0.42), Vec2::new(0.0, 0.43)];
    solid::turned(assembly.stone(Masonry::Soil), at, &soil, 48);
    let bush = shrub::bush(random, 0.7, 0.65);
    assembly.add(&bush, at + Vec3::Y * 0.42, 0.9, 0.78);
    for index in 0..7 {
        let out = potted::around(TAU * index as f32 / 7.0 + 0.3);
        let axis = (Vec3::Y + 0.35 * out).normalize_or(Vec3::Y);
        let length = 0.30 + 0.05 * random.signed();
        potted::tuft(assembly, random, at + Vec3::Y * 0.405 + out * 0.40, axis, length, 30, [2, 10]);
    }
}

/// A bench along the west wall.
fn bench(assembly: &mut Assembly, at: Vec3) {
    let planks = assembly.stone(Masonry::Planks);
    let turn = Quat::from_rotation_y(FRAC_PI_2);
    for slat in 0..4 {
        let x = -0.165 + 0.11 * slat as f32;
        solid::block(planks, at + Vec3::new(x, 0.44, 0.0), Vec3::new(0.80, 0.018, 0.048), turn);
    }
    for z in [-0.62, 0.62] {
        for x in [-0.16, 0.16] {
            solid::block(planks, at + Vec3::new(x, 0.21, z), Vec3::new(0.028, 0.21, 0.028), Quat::IDENTITY);
        }
        solid::block(planks, at + Vec3::new(0.0, 0.40, z), Vec3::new(0.19, 0.022, 0.026), Quat::IDENTITY);
    }
}
