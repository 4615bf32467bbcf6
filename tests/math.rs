//! The room `math`: sequences against exact arithmetic, discrepancy against brute force.

use std::collections::HashSet;

use canopy::math::radical_inverse::{radical_inverse_2, radical_inverse_3};
use canopy::math::{HaltonSequence, RadicalInverse, halton, hammersley, radical_inverse, star_discrepancy};
use canopy::scatter::random;
use glam::DVec2;
use proptest::prelude::*;

// ---------------------------------------------------------------- radical inverse

/// Φ_base(i) as an exact fraction (numerator, denominator), digit by digit; base <= 1000.
fn exact(base: u32, mut i: u64) -> (u128, u128) {
    let (mut n, mut d) = (0u128, 1u128);
    while i > 0 {
        n = n * u128::from(base) + u128::from(i % u64::from(base));
        d *= u128::from(base);
        i /= u64::from(base);
    }
    (n, d)
}

/// Asserts `0 <= n/d - value < 2⁻⁵³` in integers.
fn assert_floor(value: f64, (n, d): (u128, u128), what: &str) {
    assert!((0.0..1.0).contains(&value), "{what}: {value} is outside [0, 1)");
    let steps = value * (1u64 << 53) as f64;
    assert_eq!(steps.fract(), 0.0, "{what}: {value} is no multiple of 2^-53");
    let steps = steps as u128;
    assert!(steps * d <= n << 53 && n << 53 < (steps + 1) * d, "{what}: {value} instead of {n}/{d}");
}

#[test]
fn radical_inverses_are_exact_at_the_corners() {
    let mut indices: Vec<u64> = (0..3000).collect();
    for bits in [7, 16, 23, 24, 25, 31, 32, 33, 52, 53, 54, 63] {
        indices.extend([-1i64, 0, 1].map(|k| (1u64 << bits).wrapping_add_signed(k)));
    }
    indices.extend((1..41).flat_map(|k| [-1i64, 0, 1].map(|d| 3u64.pow(k).wrapping_add_signed(d))));
    indices.push(u64::MAX);
    for i in indices {
        assert_floor(radical_inverse_2(i), exact(2, i), &format!("base 2, {i}"));
        assert_floor(radical_inverse_3(i), exact(3, i), &format!("base 3, {i}"));
    }
}

proptest! {
    #[test]
    fn radical_inverses_are_exact(base in 2u32..=1000, i: u64, short: u32) {
        let table = RadicalInverse::new(base).unwrap();
        for i in [i, short.into()] {
            let value = radical_inverse(base, i).unwrap();
            assert_floor(value, exact(base, i), &format!("base {base}, {i}"));
            prop_assert_eq!(table.value(i), value);
        }
        assert_floor(radical_inverse_3(short.into()), exact(3, short.into()), &format!("base 3, {short}"));
    }

    #[test]
    fn any_base_and_index_stay_in_the_unit_interval(base in 2u32.., i: u64) {
        prop_assert!((0.0..1.0).contains(&radical_inverse(base, i).unwrap()));
        prop_assert!((0.0..1.0).contains(&RadicalInverse::new(base).unwrap().value(i)));
    }
}

#[test]
fn floats_of_32_bits_fail_past_two_to_the_24() {
    let in_f32 = |mut i: u64| {
        let (mut sum, mut weight) = (0f32, 0.5f32);
        while i > 0 {
            sum += (i % 2) as f32 * weight;
            i /= 2;
            weight *= 0.5;
        }
        sum
    };
    let i = (1 << 24) + 1;
    assert_eq!(in_f32(i), in_f32(1), "the 25th digit is lost in f32");
    assert!(radical_inverse_2(i) > radical_inverse_2(1));
    // And all-ones indices reach 1, outside of the half-open interval.
    assert_eq!(in_f32((1 << 25) - 1), 1.0);
    assert!(radical_inverse_2((1 << 25) - 1) < 1.0);
}

#[test]
fn every_elementary_interval_holds_one_halton_point() {
    let (columns, rows) = (1u64 << 5, 3u64.pow(3));
    for start in [0, 17, 1_000_000_007, u64::from(u32::MAX) - 100] {
        let mut seen = HashSet::new();
        for point in HaltonSequence::new(start).take((columns * rows) as usize) {
            // Multiples of 1/27 are rounded down by less than 2^-53, so just below their interval.
            seen.insert(((point.x * columns as f64) as u64, (point.y * rows as f64 + 1e-9) as u64));
        }
        assert_eq!(seen.len() as u64, columns * rows, "from {start}");
    }
}

// ---------------------------------------------------------------- discrepancy

/// The supremum over all boxes with sides at coordinates of points, open and closed.
fn brute_force_discrepancy(points: &[DVec2]) -> f64 {
    let sides = |coordinate: fn(&DVec2) -> f64| points.iter().map(coordinate).chain([1.0]).collect::<Vec<_>>();
    let (xs, ys) = (sides(|p| p.x), sides(|p| p.y));
    let count = |inside: &dyn Fn(&&DVec2) -> bool| points.iter().filter(inside).count() as f64 / points.len() as f64;
    let mut worst = 0f64;
    for &x in &xs {
        for &y in &ys {
            worst = worst.max(count(&|p| p.x <= x && p.y <= y) - x * y).max(x * y - count(&|p| p.x < x && p.y < y));
        }
    }
    worst
}

proptest! {
    #[test]
    fn discrepancy_equals_brute_force(lattice in prop::collection::vec((0u8..=12, 0u8..=12), 1..25), seed: u64) {
        // Points of a coarse lattice have many equal coordinates.
        let tied: Vec<DVec2> = lattice.iter().map(|&(x, y)| DVec2::new(x.into(), y.into()) / 12.0).collect();
        let free: Vec<DVec2> = (0..lattice.len() as u64).map(|i| random(i, seed)).collect();
        for points in [tied, free] {
            let fast = star_discrepancy(&points).unwrap();
            prop_assert!((fast - brute_force_discrepancy(&points)).abs() < 1e-12);
        }
    }
}

#[test]
fn even_sequences_beat_chance() {
    for n in [256u64, 1024] {
        let of = |point: &dyn Fn(u64) -> DVec2| star_discrepancy(&(0..n).map(point).collect::<Vec<_>>()).unwrap();
        let (even, set) = (of(&halton), of(&|i| hammersley(i, n)));
        let chance = (0..5).map(|seed| of(&|i| random(i, seed))).fold(f64::MAX, f64::min);
        assert!(set < even && even < 0.4 * chance, "{n}: Hammersley {set}, Halton {even}, random {chance}");
        // [Niederreiter 1992], theorem 3.6 for bases 2 and 3, and the Hammersley bound of base 2.
        let ln = (n as f64).ln();
        let bound = (2.0 + (0.5 * ln / 2f64.ln() + 1.5) * (ln / 3f64.ln() + 2.0)) / n as f64;
        assert!(even < bound && set * (n as f64) < n.ilog2() as f64 / 2.0 + 2.0);
    }
}
