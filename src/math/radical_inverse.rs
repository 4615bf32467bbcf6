//! The radical inverse, computed in integers: the digits of an index, mirrored at the radix point.
//!
//! `i = Σ dₖ bᵏ  →  Φ_b(i) = Σ dₖ b⁻ᵏ⁻¹` ([van der Corput 1935]; [Halton 1964] for several bases at once).
//!
//! The obvious loop adds `dₖ * b⁻ᵏ⁻¹` in floating point. It divides and rounds once per digit, and in f32 neighbouring
//! indices collapse from 2²⁴ on. Here the mirrored digits first form an exact integer `N` over `D = bᵏ`, and only the
//! quotient is rounded, down to a multiple of 2⁻⁵³. So for every index and every base
//!
//! `0 <= Φ - result < 2⁻⁵³`, the result is in [0, 1), and a larger Φ never has a smaller result.
//!
//! Base 2 is a bit reversal. Other bases mirror several digits at once through a table, after the digit blocks of
//! [Kollig & Keller 2002] and [Struckmeier 1995]. For base 3 an entry mirrors seven digits: 2187 entries of two bytes,
//! so three look-ups are enough for any 32-bit index.

use super::MathError;

/// 2⁻⁵³: all results are multiples of it.
const STEP: f64 = 1.0 / (1u64 << 53) as f64;

/// 3⁷: the number of indices whose digits one table entry can mirror.
pub(super) const TERNARY_BLOCK: u64 = 2187;

/// 3¹⁴.
pub(super) const TERNARY_BLOCK_2: u64 = TERNARY_BLOCK * TERNARY_BLOCK;

/// 3²¹, which is above every 32-bit index.
pub(super) const TERNARY_BLOCK_3: u64 = TERNARY_BLOCK_2 * TERNARY_BLOCK;

/// Mirrors of all numbers of seven ternary digits.
static TERNARY: [u16; TERNARY_BLOCK as usize] = ternary_table();

/// Maximum number of entries in the table of a [`RadicalInverse`]. Its 8 KiB stay in the first-level cache beside
/// everything else.
const MAX_BLOCK: u32 = 4096;

const fn ternary_table() -> [u16; TERNARY_BLOCK as usize] {
    let mut table = [0; TERNARY_BLOCK as usize];
    let mut i = 0;
    while i < table.len() {
        let (mut rest, mut mirrored, mut digit) = (i, 0, 0);
        while digit < 7 {
            mirrored = mirrored * 3 + rest % 3;
            rest /= 3;
            digit += 1;
        }
        table[i] = mirrored as u16;
        i += 1;
    }
    table
}

/// `floor(n / d * 2⁵³) * 2⁻⁵³` for `n < d <= 2⁵³`.
///
/// The floating-point quotient is within half a step of the exact one, so its integer part is off by at most one. The
/// sign of the remainder (computed modulo 2⁶⁴, as it is small) shows the direction.
#[inline]
pub(super) fn floor_quotient(n: u64, d: u64) -> f64 {
    // Signed integers, because processors convert them in one instruction.
    let (n, d) = (n as i64, d as i64);
    let q = (n as f64 / d as f64 * (1u64 << 53) as f64) as i64;
    let rest = (n << 53).wrapping_sub(q.wrapping_mul(d));
    (q - i64::from(rest < 0) + i64::from(rest >= d)) as f64 * STEP
}

/// `floor(n / 3²¹ * 2⁵³) * 2⁻⁵³` for `n < 3²¹`, without a division.
///
/// Division by an invariant integer ([Granlund & Montgomery 1994]): with `M = (2¹²⁰ + e) / 3²¹`, `0 < e < 3²¹`,
/// `n M / 2⁶⁷` exceeds the quotient by `n e / 2⁶⁷ < 3⁴² / 2⁶⁷ < 1` units of 1 / 3²¹, too little to reach the next
/// integer.
#[inline]
pub(super) fn ternary_quotient(n: u64) -> f64 {
    const M: u128 = (1 << 120) / TERNARY_BLOCK_3 as u128 + 1;
    const UPPER: u64 = (M >> 64) as u64;
    const LOWER: u64 = M as u64;
    let carried = ((u128::from(n) * u128::from(LOWER)) >> 64) as u64;
    ((n * UPPER + carried) >> 3) as i64 as f64 * STEP
}

/// The same for `n < d <= 2⁹⁶`, by long division in 128 bits.
fn floor_quotient_wide(n: u128, d: u128) -> f64 {
    let upper = (n << 32) / d;
    let lower = (((n << 32) % d) << 32) / d;
    (((upper << 32) | lower) as u64 >> 11) as i64 as f64 * STEP
}

/// Φ₂. It is exact for indices below 2⁵³; otherwise the exact value is rounded down to a multiple of 2⁻⁵³.
#[inline]
pub fn radical_inverse_2(i: u64) -> f64 {
    (i.reverse_bits() >> 11) as i64 as f64 * STEP
}

/// The lowest seven ternary digits of `block`, mirrored, as a numerator over 3⁷.
#[inline]
pub(super) fn ternary_mirror(block: u64) -> u64 {
    u64::from(TERNARY[(block % TERNARY_BLOCK) as usize])
}

/// Φ₃, rounded down to a multiple of 2⁻⁵³. Three look-ups and no division below 2³².
#[inline]
pub fn radical_inverse_3(i: u64) -> f64 {
    match u32::try_from(i) {
        Ok(i) => {
            const BLOCK: u32 = TERNARY_BLOCK as u32;
            let (low, rest) = (i % BLOCK, i / BLOCK);
            let numerator = ternary_mirror(low.into()) * TERNARY_BLOCK_2
                + ternary_mirror((rest % BLOCK).into()) * TERNARY_BLOCK
                + ternary_mirror((rest / BLOCK).into());
            ternary_quotient(numerator)
        }
        Err(_) => mirrored_digits(3, i),
    }
}

/// Φ in any base, digit by digit in 128-bit integers; `base >= 2`.
fn mirrored_digits(base: u32, mut i: u64) -> f64 {
    // d <= i * base < 2⁹⁶, because the leading digit is not zero.
    let (mut n, mut d, base_wide, base) = (0u128, 1u128, u128::from(base), u64::from(base));
    while i > 0 {
        n = n * base_wide + u128::from(i % base);
        d *= base_wide;
        i /= base;
    }
    floor_quotient_wide(n, d)
}

/// Φ_base(i) in [0, 1), rounded down to a multiple of 2⁻⁵³.
///
/// For many indices in a base above 3, a [`RadicalInverse`] is faster.
///
/// # Errors
/// [`MathError::Base`] for bases 0 and 1.
pub fn radical_inverse(base: u32, i: u64) -> Result<f64, MathError> {
    match base {
        0 | 1 => Err(MathError::Base { base }),
        2 => Ok(radical_inverse_2(i)),
        3 => Ok(radical_inverse_3(i)),
        _ => Ok(mirrored_digits(base, i)),
    }
}

/// The radical inverse in one base, with a table of mirrored digit blocks.
#[derive(Clone, Debug)]
pub struct RadicalInverse {
    base: u32,
    /// `base` to the power of the number of digits that one table entry mirrors.
    block: u64,
    /// `ceil(2⁴⁴ / block)`. Its product with a 32-bit index, divided by 2⁴⁴, has the integer part of the quotient,
    /// because the rounding adds less than `2³² * block / 2⁴⁴ <= 1` units of 1 / `block`.
    reciprocal: u64,
    /// All numbers below `block`, mirrored; empty if even two digits are too many for a table.
    table: Vec<u16>,
}

impl RadicalInverse {
    /// Builds the table (at most 4096 entries).
    ///
    /// # Errors
    /// [`MathError::Base`] for bases 0 and 1.
    pub fn new(base: u32) -> Result<Self, MathError> {
        if base < 2 {
            return Err(MathError::Base { base });
        }
        let (mut block, mut digits) = (base, 1);
        while let Some(next) = block.checked_mul(base).filter(|&next| next <= MAX_BLOCK) {
            block = next;
            digits += 1;
        }
        let mirror = |i: u32| (0..digits).fold((0, i), |(n, rest), _| (n * base + rest % base, rest / base)).0 as u16;
        let table = if digits > 1 { (0..block).map(mirror).collect() } else { Vec::new() };
        Ok(Self { base, block: block.into(), reciprocal: (1u64 << 44).div_ceil(block.into()), table })
    }

    /// The base.
    pub fn base(&self) -> u32 {
        self.base
    }

    /// Φ of `i` in [0, 1), rounded down to a multiple of 2⁻⁵³; equal to [`radical_inverse`] in every bit.
    pub fn value(&self, i: u64) -> f64 {
        match (self.base, u32::try_from(i)) {
            (2, _) => return radical_inverse_2(i),
            (_, Ok(i)) if !self.table.is_empty() => return self.short_value(i),
            _ => {}
        }
        let (mut n, mut d, mut rest) = (0u64, 1u64, i);
        while rest > 0 {
            let Some(next) = d.checked_mul(self.block).filter(|&next| next <= 1 << 53) else {
                return mirrored_digits(self.base, i);
            };
            let low = rest % self.block;
            n = n * self.block + self.table.get(low as usize).map_or(low, |&mirrored| mirrored.into());
            d = next;
            rest /= self.block;
        }
        floor_quotient(n, d)
    }

    /// Φ of a 32-bit index in a base with a table; `D < 2³² * 4096`.
    fn short_value(&self, i: u32) -> f64 {
        let (mut n, mut d, mut rest) = (0u64, 1u64, u64::from(i));
        while rest > 0 {
            let quotient = ((u128::from(rest) * u128::from(self.reciprocal)) >> 44) as u64;
            let low = rest - quotient * self.block;
            n = n * self.block + u64::from(self.table[low as usize]);
            d *= self.block;
            rest = quotient;
        }
        floor_quotient(n, d)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_values() {
        let thirds: Vec<f64> = (0..9).map(radical_inverse_3).collect();
        for (value, ninths) in thirds.iter().zip([0.0, 3.0, 6.0, 1.0, 4.0, 7.0, 2.0, 5.0, 8.0]) {
            assert!((value - ninths / 9.0).abs() < 2e-16);
        }
        assert_eq!((0..4).map(radical_inverse_2).collect::<Vec<_>>(), [0.0, 0.5, 0.25, 0.75]);
    }

    #[test]
    fn bases_without_digits_are_refused() {
        for base in [0, 1] {
            assert!(matches!(radical_inverse(base, 5), Err(MathError::Base { .. })));
            assert!(RadicalInverse::new(base).is_err());
        }
    }

    #[test]
    fn the_largest_index_stays_below_one() {
        for base in [2, 3, 5, 64, 65, 4097, u32::MAX] {
            let value = radical_inverse(base, u64::MAX).unwrap();
            assert!((0.0..1.0).contains(&value), "base {base}: {value}");
        }
    }
}
