//! The blurred depth test, and the coding of linear depth in four channels [Luft 2006, 2].

/// The smooth step of [Luft 2006, eq. 1]: 0 below `lower`, 1 above `upper`, cubic between them. Bounds that are equal are a
/// binary step; NaN gives 0.
pub fn smooth_step(lower: f32, upper: f32, value: f32) -> f32 {
    if upper <= lower {
        return f32::from(u8::from(value >= lower));
    }
    let v = ((value - lower) / (upper - lower)).clamp(0.0, 1.0);
    if v.is_nan() { 0.0 } else { v * v * (3.0 - 2.0 * v) }
}

/// Visibility (0..1) of a fragment at the linear depth `fragment` where the depth map has `map` (both 0..1): fragments
/// within `delta` (0..1) of it are partly visible. `shift` (−1..1) moves the test towards the viewer; with `shift = delta`
/// what lies on the surface is wholly visible [Luft 2006, eq. 2]. With `delta = 0` it is the ordinary depth test.
pub fn visibility(map: f32, fragment: f32, delta: f32, shift: f32) -> f32 {
    smooth_step(-delta, delta, map - fragment + shift)
}

/// A linear depth (0..1) as four 8-bit channels, each for a quarter of the range [Luft 2006, eq. 3].
pub fn encode(depth: f32) -> [u8; 4] {
    let code = |bias: f32| crate::math::color::unorm8((4.0 * depth - bias).clamp(0.0, 1.0));
    [code(0.0), code(1.0), code(2.0), code(3.0)]
}

/// The linear depth of four channels, each 0..1 [Luft 2006, eq. 4]. It is linear in the channels: the mean of codes decodes
/// to the mean of depths, so that codes may be filtered.
pub fn decode(channels: [f32; 4]) -> f32 {
    0.25 * channels.iter().sum::<f32>()
}

/// Distances that [`landscape_depth`] maps to 0 and 1, metres.
pub const LANDSCAPE: (f32, f32) = (0.5, 50_000.0);

/// Depth for landscapes, 0..1: the logarithm of the distance in metres. The published depth is linear over the few metres
/// of a plant; with it, a band of constant width over a landscape of kilometres would be one of many metres. In the
/// logarithm the band is a fraction of the distance.
pub fn landscape_depth(distance: f32) -> f32 {
    let (near, far) = LANDSCAPE;
    let depth = (distance.max(near) / near).ln() / (far / near).ln();
    if depth.is_nan() { 1.0 } else { depth.clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_step_is_hermites() {
        assert_eq!([-1.0, -0.5, 0.0, 0.5, 1.0].map(|v| smooth_step(-0.5, 0.5, v)), [0.0, 0.0, 0.5, 1.0, 1.0]);
        assert!((smooth_step(0.0, 1.0, 0.25) - 0.15625).abs() < 1e-7);
        assert_eq!(smooth_step(0.0, 1.0, f32::NAN), 0.0);
    }

    #[test]
    fn a_shift_by_delta_keeps_the_surface_and_none_halves_it() {
        let (delta, surface) = (0.02, 0.4);
        assert_eq!(visibility(surface, surface, delta, delta), 1.0);
        assert!((visibility(surface, surface, delta, 0.0) - 0.5).abs() < 1e-5);
        assert_eq!(visibility(surface, surface + 2.0 * delta + 1e-4, delta, delta), 0.0);
        // The ordinary test.
        assert_eq!([visibility(0.4, 0.39, 0.0, 0.0), visibility(0.4, 0.41, 0.0, 0.0)], [1.0, 0.0]);
        // A band of the whole range.
        assert!((visibility(0.0, 1.0, 1.0, 1.0) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn codes_keep_depth_to_a_two_thousandth() {
        let worst = (0..=100_000u32)
            .map(|i| i as f32 / 100_000.0)
            .map(|depth| (decode(encode(depth).map(|code| f32::from(code) / 255.0)) - depth).abs())
            .fold(0.0f32, f32::max);
        assert!(worst <= 1.0 / 2000.0, "{worst}");
        assert_eq!(encode(f32::NAN), [0; 4]);
    }

    proptest! {
        #[test]
        fn filtered_codes_decode_to_filtered_depths(depths in prop::collection::vec(0.0f32..1.0, 1..16)) {
            let count = depths.len() as f32;
            let mut mean = [0.0f32; 4];
            for depth in &depths {
                for (sum, code) in mean.iter_mut().zip(encode(*depth)) {
                    *sum += f32::from(code) / 255.0 / count;
                }
            }
            prop_assert!((decode(mean) - depths.iter().sum::<f32>() / count).abs() <= 1.0 / 2000.0);
        }

        #[test]
        fn landscape_depth_rises(a in 0.1f32..1e5, b in 0.1f32..1e5) {
            prop_assert!((landscape_depth(a) <= landscape_depth(b)) == (a <= b) || landscape_depth(a) == landscape_depth(b));
        }
    }

    #[test]
    fn a_band_of_landscape_depth_is_a_fraction_of_the_distance() {
        let band = |distance: f32| landscape_depth(1.1 * distance) - landscape_depth(distance);
        assert!((band(10.0) - band(1000.0)).abs() < 1e-6);
        assert_eq!([landscape_depth(0.0), landscape_depth(f32::INFINITY), landscape_depth(f32::NAN)], [0.0, 1.0, 0.0]);
    }
}
