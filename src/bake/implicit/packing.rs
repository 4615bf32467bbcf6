//! Normal and k_a in one vector of small integers [Luft 2007, 3.2]: k_a is the length of the stored normal, and needs
//! no memory of its own.
//!
//! A length of 0 would lose the direction, so the length runs from [`LEAST_LENGTH`] at k_a = 0 to 1 at k_a = 1. The
//! vertex shader decodes, before interpolation (in textures, where filtering shortens normals, the two are stored
//! apart):
//!
//! ```wgsl
//!   let stored = vertex.normal.xyz;              // snorm8x4 or snorm16x4
//!   let size = length(stored);
//!   let normal = stored / size;
//!   let k_a = saturate((size - 0.25) / (1.0 - 0.25));
//! ```
//!
//! Rounding moves the stored vector by at most √3/2 steps, so that the errors are at most
//!
//! | format | direction at k_a = 1 | direction at k_a = 0 | k_a |
//! |---|---|---|---|
//! | snorm8 | 0.40° | 1.57° | 0.0092 |
//! | snorm16 | 0.0016° | 0.0062° | 0.00004 |

use glam::Vec3;

/// Length of the stored normal where k_a is 0. Longer: directions are better kept and k_a is kept worse.
pub const LEAST_LENGTH: f32 = 0.25;

/// The vector that is stored: `normal` (any length but 0) with the length that means `ambient` (moved into 0..=1).
/// Up where there is no normal; a k_a that is not a number counts as 1.
fn scaled(normal: Vec3, ambient: f32) -> Vec3 {
    let ambient = if ambient.is_nan() { 1.0 } else { ambient.clamp(0.0, 1.0) };
    normal.try_normalize().unwrap_or(Vec3::Y) * (LEAST_LENGTH + (1.0 - LEAST_LENGTH) * ambient)
}

/// Unit normal and k_a (0..=1) of a stored vector; up where it has no length.
fn unscaled(stored: Vec3) -> (Vec3, f32) {
    let ambient = (stored.length() - LEAST_LENGTH) / (1.0 - LEAST_LENGTH);
    (stored.try_normalize().unwrap_or(Vec3::Y), ambient.clamp(0.0, 1.0))
}

/// Packs a normal and k_a (0..=1) as snorm8. Any input gives a vector that can be decoded.
pub fn encode_snorm8(normal: Vec3, ambient: f32) -> [i8; 3] {
    scaled(normal, ambient).to_array().map(|c| (c * 127.0).round() as i8)
}

/// Unit normal and k_a of a vector packed by [`encode_snorm8`], as the shader finds them.
pub fn decode_snorm8(stored: [i8; 3]) -> (Vec3, f32) {
    unscaled(Vec3::from(stored.map(|c| (f32::from(c) / 127.0).max(-1.0))))
}

/// Packs a normal and k_a (0..=1) as snorm16. Any input gives a vector that can be decoded.
pub fn encode_snorm16(normal: Vec3, ambient: f32) -> [i16; 3] {
    scaled(normal, ambient).to_array().map(|c| (c * 32767.0).round() as i16)
}

/// Unit normal and k_a of a vector packed by [`encode_snorm16`], as the shader finds them.
pub fn decode_snorm16(stored: [i16; 3]) -> (Vec3, f32) {
    unscaled(Vec3::from(stored.map(|c| (f32::from(c) / 32767.0).max(-1.0))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::quadrature::SphereQuadrature;

    /// Angle in degrees, good for small ones.
    fn degrees(a: Vec3, b: Vec3) -> f32 {
        a.as_dvec3().cross(b.as_dvec3()).length().asin().to_degrees() as f32
    }

    #[test]
    fn errors_are_below_those_stated() {
        let sphere = SphereQuadrature::new(23, 61);
        for step in 0..=20 {
            let ambient = step as f32 / 20.0;
            let length = LEAST_LENGTH + (1.0 - LEAST_LENGTH) * ambient;
            for (normal, _) in sphere.sphere() {
                let (n, k) = decode_snorm8(encode_snorm8(*normal, ambient));
                assert!(degrees(n, *normal) <= 0.40 / length && n.dot(*normal) > 0.0);
                assert!((k - ambient).abs() <= 0.0092, "{k} {ambient}");
                let (n, k) = decode_snorm16(encode_snorm16(*normal, ambient));
                assert!(degrees(n, *normal) <= 0.0016 / length, "{}", degrees(n, *normal));
                assert!((k - ambient).abs() <= 0.00004);
            }
        }
    }

    #[test]
    fn nonsense_is_harmless() {
        for normal in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::MAX] {
            for ambient in [f32::NAN, f32::INFINITY, -5.0] {
                let (n, k) = decode_snorm8(encode_snorm8(normal, ambient));
                assert!(n.is_normalized() && (0.0..=1.0).contains(&k));
                let (n, k) = decode_snorm16(encode_snorm16(normal, ambient));
                assert!(n.is_normalized() && (0.0..=1.0).contains(&k));
            }
        }
        assert_eq!(decode_snorm8([0; 3]), (Vec3::Y, 0.0));
        assert!(decode_snorm8([i8::MIN; 3]).0.is_normalized());
    }
}
