//! Noise that is fixed to the scene.

use glam::{DVec3, Vec3};

/// Metres after which the styles' noise repeats, a power of two.
pub const NOISE_SPAN: f32 = 4096.0;

/// A position in scene metres modulo [`NOISE_SPAN`], 0..=NOISE_SPAN each: what of it a shader needs to look the noise up.
pub fn anchor(position: DVec3) -> Vec3 {
    let wrapped = position.rem_euclid(DVec3::splat(NOISE_SPAN.into())).as_vec3();
    if wrapped.is_finite() { wrapped } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_stays_where_it_is_when_the_camera_moves() {
        let far = DVec3::new(1_234_567.25, -40.0, -9.5e6);
        let moved = anchor(far + DVec3::new(0.25, 0.0, 0.0)) - anchor(far);
        assert!((moved - Vec3::new(0.25, 0.0, 0.0)).length() < 1e-3, "{moved}");
        assert!(anchor(far).min_element() >= 0.0 && anchor(far).max_element() <= NOISE_SPAN);
        assert_eq!(anchor(DVec3::NAN), Vec3::ZERO);
    }
}
