//! The radiance that leaves a vertex under a light: the CPU twin of the vertex shader.

use glam::Vec3;

use super::INDIRECT_SUN_COEFFICIENTS;

/// Irradiance over pi, per channel, of a side with the transfer coefficients `side` under `light` (coefficients of
/// radiance, rotated into the plant's yaw). `side` has one channel or three, told apart by the number of coefficients,
/// as [`super::TransferPart`] holds them. Only the bands that both have are used. Never negative: where almost no light
/// arrives, the sum of a few bands can be, and is clamped.
///
/// The clamping error is measured in `benches/transfer.rs` under "clamped".
pub fn share(light: &[Vec3], side: &[f32]) -> Vec3 {
    // Three times a square is never a square.
    let one_channel = side.len().isqrt().pow(2) == side.len();
    let sum = if one_channel {
        light.iter().zip(side).map(|(l, t)| *l * *t).sum::<Vec3>()
    } else {
        light.iter().zip(side.chunks_exact(3)).map(|(l, t)| *l * Vec3::new(t[0], t[1], t[2])).sum::<Vec3>()
    };
    // `f32::max` also turns NaN into zero.
    Vec3::from(sum.to_array().map(|value| value.max(0.0)))
}

/// Irradiance over pi of the indirect sunlight at a vertex with the coefficients `indirect_sun`
/// ([`super::TransferPart::indirect_sun`]), for sunlight of 1 lux (on a surface that faces it) from the unit vector
/// `direction` in the plant's frame. The same on both sides. Never negative.
pub fn indirect_sun_share(indirect_sun: &[f32], direction: Vec3) -> f32 {
    let basis = crate::light::sh::basis::<INDIRECT_SUN_COEFFICIENTS>(direction);
    // `f32::max` also turns NaN into zero.
    indirect_sun.iter().zip(basis).map(|(value, basis)| value * basis).sum::<f32>().max(0.0)
}

/// Radiance that leaves the side `near`, diffusely reflected from it and transmitted from the side `far` (empty for
/// wood), per channel; nits where `light` is in nits. `base_color` and `transmission` (its factor on the base colour)
/// as [`crate::plant::PlantMaterial`] has them, texture included.
pub fn exitant_radiance(light: &[Vec3], near: &[f32], far: &[f32], base_color: Vec3, transmission: Vec3) -> Vec3 {
    base_color * (share(light, near) + transmission * share(light, far))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_told_apart_and_nothing_is_negative() {
        let light = [Vec3::new(1.0, 2.0, 3.0), Vec3::X, Vec3::Y, Vec3::Z];
        assert_eq!(share(&light, &[0.5, 0.0, 0.0, 1.0]), Vec3::new(0.5, 1.0, 2.5));
        let rgb: Vec<f32> = [[1.0, 0.5, 0.25], [0.0; 3], [0.0; 3], [9.0, 9.0, 0.25]].concat();
        assert_eq!(share(&light, &rgb), Vec3::new(1.0, 1.0, 1.0));
        assert_eq!(share(&light, &[-1.0, 0.0, 0.0, 0.0]), Vec3::ZERO);
        assert_eq!(share(&light, &[f32::NAN; 4]), Vec3::ZERO);
        assert_eq!(share(&light, &[]), Vec3::ZERO);
        assert_eq!(exitant_radiance(&light, &[0.5], &[1.0], Vec3::ONE, Vec3::X), Vec3::new(1.5, 1.0, 1.5));
    }
}
