//! Random numbers that depend only on a seed, an index and a stream.
//!
//! This is a counter-based generator: it applies the finaliser of SplitMix64 ([Steele, Lea, Flood 2014], constants
//! "variant 13" of [Stafford 2011]) to `key(seed, stream) + golden * index`. So each pair of seed and stream is a
//! SplitMix64 sequence that can be read at any position. Any thread can compute any tree, and a tree does not change
//! when its neighbours do.

use std::f64::consts::TAU;

/// 2⁶⁴ divided by the golden ratio, made odd: the increment of a Weyl sequence.
pub const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// The finaliser of SplitMix64: a bijection of the 64-bit integers. Each input bit flips each output bit with a
/// probability close to one half.
pub const fn mix64(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// 64 random bits for `index` in `stream` of `seed`. The streams of a seed are independent of each other.
pub fn hash64(seed: u64, index: u64, stream: impl Into<u64>) -> u64 {
    let key = mix64(seed.wrapping_add(GOLDEN.wrapping_mul(stream.into())));
    mix64(key.wrapping_add(GOLDEN.wrapping_mul(index)))
}

/// Mixes 32 bits. Each input bit flips each output bit with a probability close to one half [Wellons 2018, "Prospecting
/// for Hash Functions": lowbias32].
pub const fn mix32(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}

/// Uniform in [0, 1), a multiple of 2⁻²⁴.
pub fn unit_f32(seed: u64, index: u64, stream: impl Into<u64>) -> f32 {
    (hash64(seed, index, stream) >> 40) as f32 * (1.0 / (1u32 << 24) as f32)
}

/// Uniform in [0, 1), a multiple of 2⁻⁵³.
pub fn unit_f64(seed: u64, index: u64, stream: impl Into<u64>) -> f64 {
    (hash64(seed, index, stream) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

/// An integer below `count`, uniform to within `count / 2⁶⁴` (multiply and shift, [Lemire 2019]). It is 0 if `count` is
/// 0.
pub fn below(seed: u64, index: u64, stream: impl Into<u64>, count: u32) -> u32 {
    ((u128::from(hash64(seed, index, stream)) * u128::from(count)) >> 64) as u32
}

/// A nearly normal deviate with mean 0 and standard deviation 1, bounded by ±2√3: the sum of four uniform 16-bit
/// numbers (Irwin–Hall). Only the last step is not integer arithmetic, so the result is the same on every machine.
pub fn bell_f32(seed: u64, index: u64, stream: impl Into<u64>) -> f32 {
    let bits = hash64(seed, index, stream);
    let sum: u32 = (0..4).map(|k| (bits >> (16 * k)) as u32 & 0xFFFF).sum();
    (f64::from(sum) / 65535.0 - 2.0) as f32 * 3f32.sqrt()
}

/// A uniform angle in [0, 2π) radians.
pub fn angle_f32(seed: u64, index: u64, stream: impl Into<u64>) -> f32 {
    // 2π as f32 is above 2π, so the product is computed in f64. Then 1 - 2⁻²⁴ of a turn still rounds to less than 2π.
    (f64::from(unit_f32(seed, index, stream)) * TAU) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_input_bit_flips_about_half_of_the_output_bits() {
        for bit in 0..64 {
            let mut flips = 0u32;
            for n in 0..512u64 {
                let index = n.wrapping_mul(0x1234_5678_9ABC_DEF1);
                flips += (hash64(7, index, 3u64) ^ hash64(7, index ^ (1 << bit), 3u64)).count_ones();
            }
            let mean = f64::from(flips) / 512.0;
            assert!((mean - 32.0).abs() < 1.0, "bit {bit} flips {mean} of 64 bits");
        }
    }

    #[test]
    fn units_are_uniform_by_chi_squared() {
        for stream in [1u64, 5] {
            let mut bins = [0u32; 64];
            for i in 0..64_000 {
                bins[(unit_f32(3, i, stream) * 64.0) as usize] += 1;
            }
            let chi: f64 = bins.iter().map(|&n| (f64::from(n) - 1000.0).powi(2) / 1000.0).sum();
            // 63 degrees of freedom: the 0.1 % point is 103.
            assert!(chi < 103.0, "chi squared {chi}");
        }
    }

    #[test]
    fn streams_and_seeds_are_uncorrelated() {
        let correlation = |a: &dyn Fn(u64) -> f64, b: &dyn Fn(u64) -> f64| {
            (0..20_000).map(|i| (a(i) - 0.5) * (b(i) - 0.5)).sum::<f64>() / 20_000.0 * 12.0
        };
        let yaw = |i| unit_f64(1, i, 3u64);
        assert!(correlation(&yaw, &|i| unit_f64(1, i, 4u64)).abs() < 0.03);
        assert!(correlation(&yaw, &|i| unit_f64(2, i, 3u64)).abs() < 0.03);
        assert!(correlation(&yaw, &|i| unit_f64(1, i + 1, 3u64)).abs() < 0.03);
        assert!((correlation(&yaw, &yaw) - 1.0).abs() < 0.03);
    }

    #[test]
    fn bell_has_its_mean_deviation_and_bounds() {
        let values: Vec<f64> = (0..40_000).map(|i| f64::from(bell_f32(5, i, 4u64))).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
        assert!(mean.abs() < 0.02 && (variance - 1.0).abs() < 0.03, "mean {mean}, variance {variance}");
        assert!(values.iter().all(|v| v.abs() <= 12f64.sqrt() + 1e-6));
    }

    #[test]
    fn below_covers_its_range_and_nothing_else() {
        let mut seen = [0u32; 5];
        for i in 0..5000 {
            seen[below(9, i, 2u64, 5) as usize] += 1;
        }
        assert!(seen.iter().all(|&n| (850..1150).contains(&n)), "{seen:?}");
        assert_eq!(below(9, 1, 2u64, 0), 0);
    }
}
