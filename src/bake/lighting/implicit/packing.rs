//! Normal and ambient term (k_a) in one vector of small integers [Luft 2007, 3.2]: the ambient term is the length of
//! the stored normal and needs no memory of its own.
//!
//! A length of 0 would lose the direction, so the length runs from [`LEAST_LENGTH`] at an ambient term of 0 to 1 at 1.
//! The vertex shader decodes, before interpolation (in textures, where filtering shortens normals, the two are stored
//! apart):
//!
//! ```wgsl
//!   let stored = vertex.normal.xyz * ((2.0 * NORMAL_STEPS + 1.0) / NORMAL_STEPS) - 1.0;      // unorm10-10-10-2
//!   let size = length(stored);
//!   let normal = stored / size;
//!   let ambient = saturate((size - NORMAL_LEAST_LENGTH) / (1.0 - NORMAL_LEAST_LENGTH));
//! ```
//!
//! Each axis has 511 steps on either side of a zero that is exact. Rounding moves the stored vector by at most √3/2 of
//! a step: the direction by at most 0.1° at an ambient term of 1 and 0.4° at 0, the term by at most 0.0023. (Four bytes
//! of snorm8, which take the same space, would have errors of 1.6° and 0.0092.)

use glam::Vec3;

/// Length of the stored normal where the ambient term is 0. Longer: more accurate directions, less accurate terms.
pub const LEAST_LENGTH: f32 = 0.25;

/// The stored vector: `normal` (any length but 0), scaled to the length that encodes `ambient` (clamped to 0..=1). Up
/// if there is no normal; NaN counts as 1.
fn scaled(normal: Vec3, ambient: f32) -> Vec3 {
    let ambient = if ambient.is_nan() { 1.0 } else { ambient.clamp(0.0, 1.0) };
    normal.try_normalize().unwrap_or(Vec3::Y) * (LEAST_LENGTH + (1.0 - LEAST_LENGTH) * ambient)
}

/// Unit normal and ambient term (0..=1) of a stored vector; up where it has no length.
fn unscaled(stored: Vec3) -> (Vec3, f32) {
    let ambient = (stored.length() - LEAST_LENGTH) / (1.0 - LEAST_LENGTH);
    (stored.try_normalize().unwrap_or(Vec3::Y), ambient.clamp(0.0, 1.0))
}

/// Steps on either side of zero.
pub const STEPS: f32 = 511.0;

/// Packs a normal and an ambient term (0..=1) as unorm10-10-10-2, x in the lowest bits. Any input gives a vector that
/// can be decoded.
pub fn encode(normal: Vec3, ambient: f32) -> u32 {
    let [x, y, z] = scaled(normal, ambient).to_array().map(|axis| (axis * STEPS).round() as i32 + STEPS as i32);
    (x | y << 10 | z << 20) as u32
}

/// Unit normal and ambient term of a vector packed by [`encode`], as the shader decodes them.
pub fn decode(stored: u32) -> (Vec3, f32) {
    unscaled(Vec3::from([0, 10, 20].map(|shift| (stored >> shift & 0x3ff) as f32 / STEPS - 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::SphereQuadrature;

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
                let (n, k) = decode(encode(*normal, ambient));
                assert!(degrees(n, *normal) <= 0.1 / length && n.dot(*normal) > 0.0, "{}", degrees(n, *normal));
                assert!((k - ambient).abs() <= 0.0023, "{k} {ambient}");
            }
        }
    }

    #[test]
    fn nonsense_is_harmless() {
        for normal in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::MAX] {
            for ambient in [f32::NAN, f32::INFINITY, -5.0] {
                let (n, k) = decode(encode(normal, ambient));
                assert!(n.is_normalized() && (0.0..=1.0).contains(&k));
            }
        }
        // The axes are kept exactly, and words that nobody encoded mean something too.
        assert_eq!(decode(encode(Vec3::NEG_Y, 1.0)), (Vec3::NEG_Y, 1.0));
        for stored in [0, u32::MAX, 511 | 511 << 10 | 511 << 20] {
            let (n, k) = decode(stored);
            assert!(n.is_normalized() && (0.0..=1.0).contains(&k));
        }
    }
}
