//! Question: what do evenly placed trees cost, and how even are they?
//!
//! 1. Points per second of the integer radical inverse against the loop that everyone writes first (one digit at a
//!    time, in floating point).
//! 2. Milliseconds for a whole stand of a million trees on a height field, against the same done by that loop on one
//!    thread; then what packing it for the GPU and mapping its crowns add.
//! 3. Star discrepancy of Halton, Hammersley and random points.
//!
//! The contestants of a table take turns in one run; medians are printed, as Markdown.

#![allow(clippy::expect_used)]

use std::hint::black_box;
use std::time::Instant;

use canopy::math::hash::unit_f32;
use canopy::math::radical_inverse::{radical_inverse_2, radical_inverse_3};
use canopy::math::{HaltonSequence, RadicalInverse, halton, hammersley, star_discrepancy};
use canopy::scatter::{
    Area, ClearingNoise, Ground, PackedStand, PlacementRules, PlantSize, Sequence, SizeRule, SpeciesRule, Stream,
    cover_map, place_trees, random,
};
use glam::{DVec2, DVec3};

/// Turns of each contestant.
const TURNS: usize = 9;

/// Points of the first table; indices of the size a large stand has.
const POINTS: u64 = 2_000_000;
const FIRST_INDEX: u64 = 1_000_000;

/// Median milliseconds of each contestant, taking turns.
fn medians(contestants: &mut [(&str, Box<dyn FnMut() + '_>)]) -> Vec<f64> {
    let mut times = vec![Vec::with_capacity(TURNS); contestants.len()];
    for _ in 0..TURNS {
        for ((_, contestant), times) in contestants.iter_mut().zip(&mut times) {
            let start = Instant::now();
            contestant();
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    times
        .iter_mut()
        .map(|times| {
            times.sort_by(f64::total_cmp);
            times[TURNS / 2]
        })
        .collect()
}

/// The radical inverse as it is usually written.
fn digit_loop(base: u64, mut i: u64) -> f64 {
    let (mut sum, mut weight, inverse) = (0.0, 1.0 / base as f64, 1.0 / base as f64);
    while i > 0 {
        sum += (i % base) as f64 * weight;
        i /= base;
        weight *= inverse;
    }
    sum
}

fn summed(point: impl Fn(u64) -> f64) {
    black_box((FIRST_INDEX..FIRST_INDEX + POINTS).map(point).sum::<f64>());
}

fn points_per_second() {
    let five = RadicalInverse::new(5).expect("5 is a base");
    let mut contestants: Vec<(&str, Box<dyn FnMut()>)> = vec![
        ("base 2, digit loop", Box::new(|| summed(|i| digit_loop(2, i)))),
        ("base 2, reversed bits", Box::new(|| summed(radical_inverse_2))),
        ("base 3, digit loop", Box::new(|| summed(|i| digit_loop(3, i)))),
        ("base 3, blocks of 7 digits", Box::new(|| summed(radical_inverse_3))),
        ("base 5 known at run time, digit loop", Box::new(|| summed(|i| digit_loop(black_box(5), i)))),
        ("base 5 known at run time, blocks of 5 digits", Box::new(|| summed(|i| five.value(i)))),
        ("Halton point, digit loops", Box::new(|| summed(|i| digit_loop(2, i) + digit_loop(3, i)))),
        ("Halton point, `halton(i)`", Box::new(|| summed(|i| halton(i).element_sum()))),
        (
            "Halton point, `HaltonSequence`",
            Box::new(|| {
                let points = HaltonSequence::new(FIRST_INDEX).take(POINTS as usize);
                black_box(points.map(DVec2::element_sum).sum::<f64>());
            }),
        ),
        ("random point, `random(i, seed)`", Box::new(|| summed(|i| random(i, 1).element_sum()))),
    ];
    println!("\n| {POINTS} points on one thread | million points a second |\n|---|---|");
    for (milliseconds, (name, _)) in medians(&mut contestants).iter().zip(&contestants) {
        println!("| {name} | {:.0} |", POINTS as f64 / milliseconds / 1e3);
    }
}

/// A height field of 1024 × 1024 samples over 10 km, read by bilinear interpolation.
struct Hills {
    heights: Vec<f32>,
}

impl Hills {
    const SIDE: usize = 1024;
    const STEP: f64 = 10_000.0 / 1023.0;

    fn new() -> Self {
        let height = |i: usize| {
            let (x, z) = ((i % Self::SIDE) as f32, (i / Self::SIDE) as f32);
            400.0 + 120.0 * (x * 0.021).sin() * (z * 0.017).cos() + 30.0 * (x * 0.11 + z * 0.07).sin()
        };
        Self { heights: (0..Self::SIDE * Self::SIDE).map(height).collect() }
    }

    /// The four samples around a point, and its place between them.
    fn corners(&self, x: f64, z: f64) -> ([f64; 4], DVec2) {
        let place = (DVec2::new(x, z) / Self::STEP + (Self::SIDE - 1) as f64 * 0.5)
            .clamp(DVec2::ZERO, DVec2::splat((Self::SIDE - 1) as f64 - 1e-6));
        let corner = place.floor();
        let at = corner.y as usize * Self::SIDE + corner.x as usize;
        let sample = |offset: usize| f64::from(self.heights[at + offset]);
        ([sample(0), sample(1), sample(Self::SIDE), sample(Self::SIDE + 1)], place - corner)
    }
}

impl Ground for Hills {
    fn height(&self, x: f64, z: f64) -> f64 {
        let ([a, b, c, d], f) = self.corners(x, z);
        let (near, far) = (a + (b - a) * f.x, c + (d - c) * f.x);
        near + (far - near) * f.y
    }

    fn slope(&self, x: f64, z: f64) -> f32 {
        let ([a, b, c, d], f) = self.corners(x, z);
        let along_x = (b - a) + ((d - c) - (b - a)) * f.y;
        let along_z = (c - a) + ((d - b) - (c - a)) * f.x;
        (along_x.hypot(along_z) / Self::STEP).atan() as f32
    }
}

fn rules(stems_per_hectare: f64) -> PlacementRules {
    PlacementRules {
        stems_per_hectare,
        sequence: Sequence::Halton,
        seed: 1,
        min_distance_m: 0.0,
        slope_limit: 0.8,
        height_range_m: None,
        area: Area::centered(DVec2::ZERO, DVec2::splat(10_000.0)),
        clearings: None,
        species: vec![
            SpeciesRule {
                weight: 2.0,
                size: SizeRule::Scale { min: 0.7, max: 1.2 },
                variants: 0..4,
                ..SpeciesRule::default()
            },
            SpeciesRule {
                weight: 1.0,
                size: SizeRule::Scale { min: 0.6, max: 1.1 },
                variants: 4..8,
                ..SpeciesRule::default()
            },
        ],
    }
}

/// The obvious way to the same trees: one thread, the digit loops, a growing vector.
fn obvious_stand(count: u64, rules: &PlacementRules, ground: &Hills) {
    let mut trees = Vec::new();
    for i in 0..count {
        let p = rules.area.min + DVec2::new(digit_loop(2, i), digit_loop(3, i)) * rules.area.size();
        let slope = ground.slope(p.x, p.y);
        if slope > rules.slope_limit {
            continue;
        }
        let first = unit_f32(1, i, Stream::Species) < 2.0 / 3.0;
        let scale = if first { 0.7 } else { 0.6 } + 0.5 * unit_f32(1, i, Stream::Scale);
        let foot = ground.height(p.x, p.y) - 0.3 * f64::from(scale) * f64::from(slope).tan();
        let variant = (unit_f32(1, i, Stream::Variant) * 4.0) as u16 + if first { 0 } else { 4 };
        let looks = (unit_f32(1, i, Stream::Yaw), scale, variant, unit_f32(1, i, Stream::Tint));
        trees.push((DVec3::new(p.x, foot, p.y), looks, i as u32));
    }
    black_box(trees);
}

fn stand_building() {
    let ground = Hills::new();
    let one_million = rules(100.0);
    let spaced = PlacementRules { min_distance_m: 5.0, ..one_million.clone() };
    let clearings = Some(ClearingNoise { wavelength_m: 400.0, cover: 0.25, edge: 0.1 });
    let cleared = PlacementRules { clearings, ..one_million.clone() };
    let hammersley_spaced = PlacementRules { sequence: Sequence::Hammersley, ..spaced.clone() };
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread pool");
    let placed = |rules: &PlacementRules| place_trees(rules, &ground).expect("the rules can be met");
    let stand = placed(&rules(30.0)).stand;
    let bounds = vec![PlantSize { radius: 3.5, height: 20.0 }; 8];

    let mut contestants: Vec<(&str, Box<dyn FnMut()>)> = vec![
        ("obvious loop, one thread", Box::new(|| obvious_stand(1_000_000, &one_million, &ground))),
        ("`place`, one thread", Box::new(|| drop(black_box(one_thread.install(|| placed(&one_million)))))),
        ("`place`", Box::new(|| drop(black_box(placed(&one_million))))),
        ("`place`, with clearings", Box::new(|| drop(black_box(placed(&cleared))))),
        ("`place`, 5 m apart", Box::new(|| drop(black_box(placed(&spaced))))),
        ("`place`, Hammersley, 5 m apart", Box::new(|| drop(black_box(placed(&hammersley_spaced))))),
        ("300,000 trees: `PackedStand::new`", Box::new(|| drop(black_box(PackedStand::new(&stand, 64.0, &bounds))))),
        (
            "300,000 trees: `cover_map`, texels of 8 m",
            Box::new(|| drop(black_box(cover_map(&stand, &bounds, 8.0, None)))),
        ),
        (
            "300,000 trees: `cover_map`, texels of 4 m",
            Box::new(|| drop(black_box(cover_map(&stand, &bounds, 4.0, None)))),
        ),
    ];
    println!(
        "\n| a million trees on 100 km² of height field, {} threads | ms |\n|---|---|",
        rayon::current_num_threads()
    );
    for (milliseconds, (name, _)) in medians(&mut contestants).iter().zip(&contestants) {
        println!("| {name} | {milliseconds:.0} |");
    }
    let report = placed(&spaced).report;
    println!("\n5 m apart: {} of {} trees from {} candidates", report.placed, report.wanted, report.candidates);
}

fn discrepancies() {
    println!("\n| n | Halton | Hammersley | random (median of 9) | ms for one |\n|---|---|---|---|---|");
    for n in [64u64, 256, 1024, 4096, 16_384] {
        let of = |point: &dyn Fn(u64) -> DVec2| {
            star_discrepancy(&(0..n).map(point).collect::<Vec<_>>()).expect("points of the unit square")
        };
        let start = Instant::now();
        let halton = of(&halton);
        let milliseconds = start.elapsed().as_secs_f64() * 1e3;
        let hammersley = of(&|i| hammersley(i, n));
        let mut chance: Vec<f64> = (0..9).map(|seed| of(&|i| random(i, seed))).collect();
        chance.sort_by(f64::total_cmp);
        println!("| {n} | {halton:.5} | {hammersley:.5} | {:.5} | {milliseconds:.1} |", chance[4]);
    }
}

fn main() {
    points_per_second();
    stand_building();
    discrepancies();
}
