//! Point sets in the unit square: Halton and Hammersley (Franzke 2005, figure 4.17).
//!
//! - Halton ([Halton 1964]): (Φ₂(i), Φ₃(i)). It is a sequence: its first points are even, however many, so a stand can
//!   grow.
//! - Hammersley ([Hammersley & Handscomb 1964]): (i/n, Φ₂(i)). It is a set: more even than Halton, but `n` is fixed.
//!
//! Star discrepancies are in `benches/sequences.rs`.

use glam::DVec2;

use super::radical_inverse::{
    TERNARY_BLOCK, TERNARY_BLOCK_2, TERNARY_BLOCK_3, radical_inverse_2, radical_inverse_3, ternary_mirror,
    ternary_quotient,
};

/// The largest f64 below one.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// The i-th point of the Halton sequence in bases 2 and 3; both coordinates in [0, 1).
#[inline]
pub fn halton(i: u64) -> DVec2 {
    DVec2::new(radical_inverse_2(i), radical_inverse_3(i))
}

/// The i-th of the `n` Hammersley points; both coordinates in [0, 1). `i` counts modulo `n`. If `n` is 0, the point is
/// the origin.
#[inline]
pub fn hammersley(i: u64, n: u64) -> DVec2 {
    match i.checked_rem(n) {
        Some(i) => DVec2::new((i as f64 / n as f64).min(BELOW_ONE), radical_inverse_2(i)),
        None => DVec2::ZERO,
    }
}

/// The Halton sequence in order, from any index. The points are those of [`halton`], bit for bit.
///
/// Only the lowest seven ternary digits change at every step. The upper ones are mirrored once every 2187 points.
#[derive(Clone, Debug)]
pub struct HaltonSequence {
    next: u64,
    /// `next % 3⁷`, maintained by counting.
    low: u64,
    /// Mirror of the ternary digits above the seventh, over 3²¹.
    upper: u64,
}

impl HaltonSequence {
    /// Starts with the point `start`.
    pub fn new(start: u64) -> Self {
        Self { next: start, low: start % TERNARY_BLOCK, upper: Self::upper(start) }
    }

    fn upper(i: u64) -> u64 {
        let rest = i / TERNARY_BLOCK;
        ternary_mirror(rest) * TERNARY_BLOCK + ternary_mirror(rest / TERNARY_BLOCK)
    }
}

impl Iterator for HaltonSequence {
    type Item = DVec2;

    #[inline]
    fn next(&mut self) -> Option<DVec2> {
        let i = self.next;
        let third = if i < TERNARY_BLOCK_3 {
            ternary_quotient(ternary_mirror(self.low) * TERNARY_BLOCK_2 + self.upper)
        } else {
            radical_inverse_3(i)
        };
        self.next = i.wrapping_add(1);
        self.low += 1;
        if self.low == TERNARY_BLOCK || self.next == 0 {
            self.low = 0;
            self.upper = Self::upper(self.next);
        }
        Some(DVec2::new(radical_inverse_2(i), third))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_iterator_is_the_sequence() {
        for start in [0, 1, 2186, 2187, 4_782_960, u64::from(u32::MAX) - 3000, TERNARY_BLOCK_3 - 3000, u64::MAX - 2] {
            for (k, point) in HaltonSequence::new(start).take(6000).enumerate() {
                assert_eq!(point, halton(start.wrapping_add(k as u64)), "point {k} from {start}");
            }
        }
    }

    #[test]
    fn hammersley_counts_modulo_its_number() {
        assert_eq!(hammersley(5, 0), DVec2::ZERO);
        assert_eq!(hammersley(13, 10), hammersley(3, 10));
        assert!(hammersley(u64::MAX - 1, u64::MAX).x < 1.0);
    }
}
