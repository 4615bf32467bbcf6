//! Interpolation between values.

/// Rises smoothly from 0 at `low` to 1 at `high`: the cubic Hermite step of WGSL's `smoothstep`, with the same
/// arithmetic. If `low` equals `high`, it is a hard step. It is 0 for NaN.
pub fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    if t.is_nan() { 0.0 } else { t * t * (3.0 - 2.0 * t) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_is_flat_outside_and_even_around_its_middle() {
        assert_eq!((smoothstep(1.0, 3.0, 0.0), smoothstep(1.0, 3.0, 2.0), smoothstep(1.0, 3.0, 9.0)), (0.0, 0.5, 1.0));
        for i in 0..=20 {
            let x = i as f32 / 20.0;
            assert!((smoothstep(0.0, 1.0, x) + smoothstep(0.0, 1.0, 1.0 - x) - 1.0).abs() < 1e-6);
        }
        assert_eq!([0.9, 1.0, 1.1].map(|x| smoothstep(1.0, 1.0, x)), [0.0, 0.0, 1.0]);
        assert_eq!(smoothstep(0.0, 1.0, f32::NAN), 0.0);
        // A step that falls: `low` above `high`.
        assert!((smoothstep(1.0, 0.0, 0.25) - smoothstep(0.0, 1.0, 0.75)).abs() < 1e-6);
    }
}
