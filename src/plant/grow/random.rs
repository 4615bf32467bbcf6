//! A small random number generator whose streams never change.
//!
//! `SplitMix64` (Steele, Lea & Flood 2014, "Fast splittable pseudorandom number generators", OOPSLA): 64 bits of state,
//! which can be split by a key. The generators of the `rand` crate may change their streams between versions. A tree
//! that a scene file names by its seed must not change.

use crate::math::hash::{GOLDEN, mix64};

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub(super) struct Random {
    state: u64,
}

impl Random {
    /// A stream for `seed`. Neighbouring seeds give unrelated streams.
    pub fn new(seed: u64) -> Self {
        Self { state: mix64(seed ^ 0x5851_f42d_4c95_7f2d) }
    }

    /// An independent stream for the part `key` of the object that this stream describes. This stream does not advance.
    pub fn split(&self, key: u64) -> Self {
        Self { state: mix64(self.state ^ mix64(key.wrapping_add(GOLDEN))) }
    }

    /// The next number, uniform in `0.0..1.0`.
    pub fn unit(&mut self) -> f32 {
        self.state = self.state.wrapping_add(GOLDEN);
        (mix64(self.state) >> 40) as f32 / (1u64 << 24) as f32
    }

    /// The next number, uniform in `-1.0..1.0`.
    pub fn signed(&mut self) -> f32 {
        2.0 * self.unit() - 1.0
    }

    /// The next number, uniform in `low..high`.
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }
}

#[cfg(test)]
mod tests {
    use super::Random;

    #[test]
    fn numbers_fill_the_unit_interval_evenly() {
        let mut random = Random::new(7);
        let mut bins = [0u32; 10];
        for _ in 0..10_000 {
            let x = random.unit();
            assert!((0.0..1.0).contains(&x));
            bins[(x * 10.0) as usize] += 1;
        }
        // Binomial: 1000 with a standard deviation of 30.
        assert!(bins.iter().all(|&n| (850..1150).contains(&n)), "{bins:?}");
    }

    #[test]
    fn parts_have_streams_of_their_own() {
        let whole = Random::new(1);
        let (mut a, mut b, mut again) = (whole.split(1), whole.split(2), whole.split(1));
        let first = a.unit();
        assert_ne!(first, b.unit());
        assert_eq!(first, again.unit());
    }
}
