//! The exponential integral E₁.

/// The Euler-Mascheroni constant.
const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;

/// The exponential integral E₁(x) = ∫ e⁻ᵗ/t dt from `x` > 0 to infinity [Abramowitz & Stegun 1964, 5.1.1], to a
/// relative error of 1e-14. Infinite at 0 and below, 0 at infinity and for NaN.
pub fn exponential_integral(x: f64) -> f64 {
    if x.is_nan() || x > 745.0 {
        return 0.0;
    }
    if x <= 0.0 {
        return f64::INFINITY;
    }
    if x <= 1.0 {
        // The power series, 5.1.11.
        let (mut sum, mut power) = (0.0, 1.0);
        for n in 1..=20 {
            let n = f64::from(n);
            power *= -x / n;
            sum -= power / n;
        }
        return sum - EULER_GAMMA - x.ln();
    }
    // The continued fraction of even convergents, 5.1.22, from the inside out. It needs fewer terms for larger numbers.
    let terms = (20.0 + 80.0 / x) as u32;
    let fraction = (1..=terms).rev().map(f64::from).fold(0.0, |below, n| n * n / (x + 2.0 * n + 1.0 - below));
    (-x).exp() / (x + 1.0 - fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_the_values_of_the_tables() {
        // Abramowitz & Stegun, tables 5.1 and 5.2; more digits from their series at 50 digits.
        for (x, value) in [
            (1e-10, 22.448_635_265_138_93),
            (0.01, 4.037_929_576_538_114),
            (0.1, 1.822_923_958_419_391),
            (0.5, 0.559_773_594_776_160_2),
            (0.999_999, 0.219_384_302_275_329_3),
            (1.0, 0.219_383_934_395_520_3),
            (1.000_001, 0.219_383_566_516_447),
            (2.0, 0.048_900_510_708_061_12),
            (5.0, 0.001_148_295_591_275_326),
            (10.0, 4.156_968_929_685_324e-6),
            (100.0, 3.683_597_761_682_032e-46),
        ] {
            let got = exponential_integral(x);
            assert!((got / value - 1.0).abs() < 1e-13, "{x}: {got} {value}");
        }
        assert_eq!(exponential_integral(0.0), f64::INFINITY);
        for x in [800.0, f64::INFINITY, f64::NAN] {
            assert_eq!(exponential_integral(x), 0.0);
        }
    }
}
