//! Neighbouring crowns on a slope.

/// What a slope of `angle` radians leaves of the optical depth of neighbouring crowns for the light of the sky: 1 on level ground, and less the
/// steeper it is. At least 0.
///
/// A layer of crowns lies parallel to the ground. From a depth in it, light from directions above both the horizon and the ground takes a
/// shorter way than on level ground: it is open downhill, and what lies uphill hides the sky there as relief ([`HiddenSky`](super::HiddenSky)), not
/// as crowns. The polynomial is within 0.05 of the ratio of the logarithms of both mean transmittances, for optical depths of 0.3 to 1.5 and up to 60°.
pub fn slope_factor(angle: f32) -> f32 {
    let angle = if angle.is_finite() { angle.clamp(0.0, std::f32::consts::FRAC_PI_2) } else { 0.0 };
    (1.0 - 0.31 * angle - 0.135 * angle * angle).max(0.0)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::math::SphereQuadrature;

    /// Mean transmittance of a layer with the normal `up` for the part of the sky above the ground, at a vertical optical depth.
    fn transmittance(up: Vec3, depth: f32) -> f32 {
        let rule = SphereQuadrature::new(64, 128);
        let open = rule.upper().iter().filter(|(direction, _)| direction.dot(up) > 0.0);
        let (mut passed, mut all) = (0.0, 0.0);
        for (direction, solid_angle) in open {
            passed += solid_angle * (-depth * up.y / direction.dot(up)).exp();
            all += solid_angle;
        }
        passed / all
    }

    #[test]
    fn crowns_on_a_slope_hide_as_much_less_as_their_layer_does() {
        for degrees in [0.0f32, 10.0, 20.0, 35.0, 45.0, 60.0] {
            let angle = degrees.to_radians();
            let up = Vec3::new(angle.sin(), angle.cos(), 0.0);
            for depth in [0.3, 0.6, 1.0, 1.5] {
                let factor = transmittance(up, depth).ln() / transmittance(Vec3::Y, depth).ln();
                let found = slope_factor(angle);
                assert!((factor - found).abs() < 0.05, "{degrees} degrees, depth {depth}: {factor} and {found}");
            }
        }
    }

    #[test]
    fn nothing_is_undefined() {
        for angle in [f32::NAN, -1.0, 0.0, 1.5707964, 1e30, f32::INFINITY] {
            assert!((0.0..=1.0).contains(&slope_factor(angle)), "{angle}");
        }
        assert_eq!(slope_factor(0.0), 1.0);
    }
}
