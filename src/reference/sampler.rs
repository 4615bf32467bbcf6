//! Random numbers of a path: Owen-scrambled Sobol points, padded pair by pair.
//!
//! After B. Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4): each pair of dimensions of a pixel takes
//! the first two Sobol dimensions, a (0, 2)-sequence in base 2, with its index shuffled and its digits scrambled by
//! nested uniform permutations of their own. Any prefix of a power of two samples is stratified in every pair, and an
//! image can go on from any sample.
//!
//! A number depends on the seed, the pixel, the sample and the dimension alone: neither threads nor tiles, nor where a
//! render was interrupted, change it.

use glam::Vec2;

use crate::math::hash::{GOLDEN, mix64};

/// The numbers of one sample of one pixel, drawn in order.
#[derive(Clone, Debug)]
pub(crate) struct PathSampler {
    key: u64,
    index: u32,
    pair: u64,
}

impl PathSampler {
    /// Numbers of sample `index` of `pixel`.
    pub fn new(seed: u64, pixel: u64, index: u32) -> Self {
        Self { key: mix64(mix64(seed).wrapping_add(GOLDEN.wrapping_mul(pixel.wrapping_add(1)))), index, pair: 0 }
    }

    /// The next pair, each in [0, 1), a multiple of 2⁻²⁴.
    pub fn pair(&mut self) -> Vec2 {
        self.pair += 1;
        let shuffle = mix64(self.key.wrapping_add(GOLDEN.wrapping_mul(self.pair)));
        let scramble = mix64(shuffle ^ self.key);
        let index = scrambled(self.index, shuffle as u32);
        let x = scrambled(index.reverse_bits(), scramble as u32);
        let y = scrambled(sobol_second(index), (scramble >> 32) as u32);
        Vec2::new(unit(x), unit(y))
    }
}

fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1u32 << 24) as f32)
}

/// The second Sobol dimension of `index`, as digits after the point. Its generator matrix is Pascal's triangle modulo
/// 2: the product of five factors, one for each bit of a digit's place.
fn sobol_second(index: u32) -> u32 {
    let mut x = index;
    x ^= (x & 0xAAAA_AAAA) >> 1;
    x ^= (x & 0xCCCC_CCCC) >> 2;
    x ^= (x & 0xF0F0_F0F0) >> 4;
    x ^= (x & 0xFF00_FF00) >> 8;
    x ^= (x & 0xFFFF_0000) >> 16;
    x.reverse_bits()
}

/// Nested uniform scramble of the digits after the point: each digit is permuted by those before it (Burley 2020,
/// listings 3 and 4).
fn scrambled(digits: u32, seed: u32) -> u32 {
    let mut x = digits.reverse_bits().wrapping_add(seed);
    x ^= x.wrapping_mul(0x6C50_B47C);
    x ^= x.wrapping_mul(0xB82F_1E52);
    x ^= x.wrapping_mul(0xC7AF_E638);
    x ^= x.wrapping_mul(0x8D22_F6E6);
    x.reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_dimension_is_sobols() {
        let mut directions = [1u32 << 31; 32];
        for i in 1..32 {
            directions[i] = directions[i - 1] ^ (directions[i - 1] >> 1);
        }
        for index in (0..1000).chain([u32::MAX, 0x8000_0001]) {
            let expected = (0..32).filter(|bit| index >> bit & 1 == 1).fold(0, |sum, bit| sum ^ directions[bit]);
            assert_eq!(sobol_second(index), expected, "{index}");
        }
    }

    #[test]
    fn each_pair_of_a_power_of_two_samples_is_stratified() {
        for pair in 0..5 {
            for (columns, rows) in [(256, 1), (16, 16), (1, 256), (64, 4)] {
                let mut seen = vec![0; 256];
                for index in 0..256 {
                    let mut sampler = PathSampler::new(7, 1234, index);
                    let point = (0..=pair).map(|_| sampler.pair()).last().unwrap_or_default();
                    assert!(point.min_element() >= 0.0 && point.max_element() < 1.0);
                    seen[(point.y * rows as f32) as usize * columns + (point.x * columns as f32) as usize] += 1;
                }
                assert!(seen.iter().all(|&count| count == 1), "pair {pair}, {columns} x {rows}");
            }
        }
    }

    #[test]
    fn pixels_and_pairs_are_independent() {
        let mean = |f: &dyn Fn(u64) -> f32| (0..4096).map(|i| f64::from(f(i))).sum::<f64>() / 4096.0;
        let first = |pixel: u64| PathSampler::new(1, pixel, 0).pair();
        assert!((mean(&|pixel| first(pixel).x) - 0.5).abs() < 0.02);
        let covariance = mean(&|pixel| {
            let mut sampler = PathSampler::new(1, pixel, 0);
            let (a, b) = (sampler.pair(), sampler.pair());
            (a.x - 0.5) * (b.x - 0.5) + (a.x - 0.5) * (a.y - 0.5) + (a.y - 0.5) * (first(pixel + 1).x - 0.5)
        });
        assert!(covariance.abs() < 0.006, "{covariance}");
    }
}
