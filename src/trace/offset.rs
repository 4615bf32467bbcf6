//! Where a ray starts that leaves a surface, so that it does not meet the surface again.

use glam::Vec3;

/// The starting point of a ray in `direction` from the point `position` of a surface with the unit normal
/// `geometric_normal` (either side's): moved off the surface to the side the ray goes to, farther than the rounding
/// error of a point that was interpolated from a triangle's corners.
///
/// [Wächter & Binder 2019, "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems 6], where each
/// coordinate moves by up to 256 units in its last place, and within 1/32 m of zero, where these are tiny, by up to
/// 2^-16 m. For plants of centimetres, and near zero on triangles of a kilometre, [`super::SurfacePoint::leave`] is
/// the right one.
///
/// What is not finite is given back as it is.
pub fn offset_origin(position: Vec3, geometric_normal: Vec3, direction: Vec3) -> Vec3 {
    const UNITS: f32 = 256.0;
    const NEAR_ZERO: f32 = 1.0 / 32.0;
    const ABSOLUTE: f32 = 1.0 / 65_536.0;
    if !position.is_finite() || !geometric_normal.is_finite() {
        return position;
    }
    let normal = if geometric_normal.dot(direction) < 0.0 { -geometric_normal } else { geometric_normal };
    let moved = |p: f32, n: f32| {
        if p.abs() < NEAR_ZERO {
            return p + ABSOLUTE * n;
        }
        // One unit in the last place of p, up or down, is one integer step of its bits.
        let steps = (UNITS * n) as i32;
        let result = f32::from_bits(p.to_bits().wrapping_add_signed(if p < 0.0 { -steps } else { steps }));
        if result.is_finite() { result } else { p }
    };
    Vec3::new(moved(position.x, normal.x), moved(position.y, normal.y), moved(position.z, normal.z))
}

/// The starting point of a ray in `direction` from `position`, which lies at most `error` metres off its surface with
/// the unit normal `geometric_normal` (either side's).
pub(crate) fn leave(position: Vec3, geometric_normal: Vec3, error: f32, direction: Vec3) -> Vec3 {
    let away = if geometric_normal.dot(direction) < 0.0 { -error } else { error };
    position + geometric_normal * away
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moves_to_the_side_the_ray_goes_to_and_by_little() {
        for size in [1.0f32, 30.0, 1e4, 1e6] {
            for normal in [Vec3::X, Vec3::NEG_Y, Vec3::new(0.6, -0.64, 0.48)] {
                for position in [Vec3::new(0.3, -0.9, 0.7), Vec3::new(0.0, 1e-9, -1.0), Vec3::X] {
                    let position = position * size;
                    for side in [1.0, -1.0] {
                        let moved = offset_origin(position, normal, side * normal) - position;
                        assert!(side * moved.dot(normal) > 5e-6, "{moved} at {position}");
                        assert!(moved.length() < 1e-4 * size);
                    }
                }
            }
        }
    }

    #[test]
    fn strange_points_stay() {
        assert!(offset_origin(Vec3::splat(f32::NAN), Vec3::X, Vec3::X).is_nan());
        assert_eq!(offset_origin(Vec3::ONE, Vec3::NAN, Vec3::X), Vec3::ONE);
        assert!(offset_origin(Vec3::splat(f32::MAX), Vec3::X, Vec3::X).is_finite());
        assert!(offset_origin(Vec3::ZERO, Vec3::X, Vec3::ZERO).is_finite());
    }
}
