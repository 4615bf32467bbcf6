//! The ambient term (the paper's ambient reflection coefficient k_a) from the density [Luft 2007, 3.2, eq. 4].

use super::parameters::ImplicitParameters;

/// Eq. 4: the ambient term k_a of a point with the density `d` (F - τ as published, else the depth). It is 1 for `d` up
/// to 0, falls to k_a_min at d_min, and stays there. In `least..=1` for any input; 1 if the density is NaN.
pub fn ambient_term(d: f32, parameters: &ImplicitParameters) -> f32 {
    let ImplicitParameters { least, core, exponent, .. } = *parameters;
    if d.is_nan() || d <= 0.0 {
        1.0
    } else if d < core {
        let k = least + (1.0 - least) * (1.0 - d / core).powf(exponent);
        if k.is_finite() { k.clamp(least, 1.0) } else { least }
    } else {
        least
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters(least: f32, core: f32, exponent: f32) -> ImplicitParameters {
        ImplicitParameters { radius: 1.0, threshold: 0.0, ambient_radius: 1.0, least, core, exponent }
    }

    #[test]
    fn figure_4_of_the_publication() {
        for exponent in [1.0 / 3.0, 1.0, 3.0] {
            let p = parameters(0.2, 8.0, exponent);
            assert_eq!(ambient_term(-1.0, &p), 1.0);
            assert_eq!(ambient_term(0.0, &p), 1.0);
            assert_eq!(ambient_term(8.0, &p), 0.2);
            assert_eq!(ambient_term(100.0, &p), 0.2);
            let half = 0.2 + 0.8 * 0.5f32.powf(exponent);
            assert!((ambient_term(4.0, &p) - half).abs() < 1e-6);
            let mut last = 1.0;
            for i in 0..100 {
                let k = ambient_term(0.1 * i as f32, &p);
                assert!(k <= last, "monotone");
                last = k;
            }
        }
    }

    #[test]
    fn nonsense_stays_in_range() {
        for core in [0.0, 1.0e-30, f32::MAX] {
            for d in [f32::NAN, f32::NEG_INFINITY, f32::MIN_POSITIVE, 1.0, f32::MAX, f32::INFINITY] {
                let k = ambient_term(d, &parameters(0.1, core, 0.01));
                assert!((0.1..=1.0).contains(&k), "{core} {d}: {k}");
            }
        }
    }
}
