//! Unit vectors as two coordinates: the octahedral encoding [Cigolle et al. 2014, "A Survey of Efficient
//! Representations for Independent Unit Vectors", 3.1; Meyer et al. 2010].
//!
//! The sphere is projected onto an octahedron, and the octahedron's lower half is folded outwards, so that all
//! directions fill the square -1..=1 x -1..=1. The axis in the middle of the square is preserved exactly. Which axis
//! that is depends on what is encoded.

use glam::{Vec2, Vec3};

/// Sum of absolute coordinates below which a vector has no direction.
const NO_DIRECTION: f32 = 1e-12;

/// The point of the octahedron in this direction; the origin for a vector without direction.
fn projected(direction: Vec3) -> Vec3 {
    let point = direction / direction.abs().element_sum().max(NO_DIRECTION);
    if point.is_finite() { point } else { Vec3::ZERO }
}

/// Folds the lower half of the octahedron outwards. `flat` is the projection without the axis; `below` says whether the
/// vector points against the axis.
fn folded(flat: Vec2, below: bool) -> Vec2 {
    let sign = |value: f32| if value < 0.0 { -1.0 } else { 1.0 };
    if below { Vec2::new((1.0 - flat.y.abs()) * sign(flat.x), (1.0 - flat.x.abs()) * sign(flat.y)) } else { flat }
}

/// Encodes a direction of any length as a point (x, y) of the square, each -1..=1, with +Z in the middle. A vector
/// without direction gives the middle.
pub fn encode_z(direction: Vec3) -> Vec2 {
    let n = projected(direction);
    folded(n.truncate(), n.z < 0.0)
}

/// Encodes a direction of any length as a point (x, z) of the square, each -1..=1, with +Y in the middle. A vector
/// without direction gives the middle.
pub fn encode_y(direction: Vec3) -> Vec2 {
    let n = projected(direction);
    folded(Vec2::new(n.x, n.z), n.y < 0.0)
}

/// The unit vector that [`encode_z`] encodes as `code`. Each coordinate of `code` is in -1..=1.
pub fn decode_z(code: Vec2) -> Vec3 {
    let z = 1.0 - code.x.abs() - code.y.abs();
    let fold = (-z).max(0.0);
    Vec3::new(code.x - fold * code.x.signum(), code.y - fold * code.y.signum(), z).normalize_or(Vec3::Z)
}

/// The unit vector that [`encode_y`] encodes as `code`. Each coordinate of `code` is in -1..=1.
pub fn decode_y(code: Vec2) -> Vec3 {
    let Vec3 { x, y, z } = decode_z(code);
    Vec3::new(x, z, y)
}

/// Two coordinates in -1..=1 as snorm16, the first one in the lower half of the word (WGSL's `unpack2x16snorm`).
pub fn pack_snorm16(code: Vec2) -> u32 {
    let snorm = |value: f32| ((value.clamp(-1.0, 1.0) * 32767.0).round() as i16) as u16;
    u32::from(snorm(code.x)) | u32::from(snorm(code.y)) << 16
}

#[cfg(test)]
mod tests {
    use super::*;

    fn directions() -> impl Iterator<Item = Vec3> {
        (0..500).map(|i| {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 500.0;
            let (sin, cos) = (2.399_963 * i as f32).sin_cos();
            Vec3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z)
        })
    }

    #[test]
    fn directions_survive() {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
        for direction in directions().chain(axes) {
            for (code, decoded) in [
                (encode_z(direction), decode_z(encode_z(direction))),
                (encode_y(3.0 * direction), decode_y(encode_y(3.0 * direction))),
            ] {
                assert!(code.abs().max_element() <= 1.0 + 1e-6, "{code}");
                assert!((decoded - direction).length() < 1e-5, "{direction}: {decoded}");
            }
        }
        assert_eq!((encode_z(Vec3::Z), encode_y(Vec3::Y)), (Vec2::ZERO, Vec2::ZERO));
        for none in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
            assert_eq!((encode_z(none), encode_y(none)), (Vec2::ZERO, Vec2::ZERO));
        }
        assert_eq!((decode_z(Vec2::NAN), decode_y(Vec2::NAN)), (Vec3::Z, Vec3::Y));
    }

    #[test]
    fn sixteen_bits_keep_a_direction_to_a_hundredth_of_a_degree() {
        for direction in directions() {
            let packed = pack_snorm16(encode_y(direction));
            let axis = |half: u32| f32::from(half as u16 as i16) / 32767.0;
            let decoded = decode_y(Vec2::new(axis(packed), axis(packed >> 16)));
            assert!((decoded - direction).length() < 1.7e-4, "{direction}: {decoded}");
        }
        assert_eq!(pack_snorm16(Vec2::new(f32::NAN, -9.0)), 0x8001_0000);
    }
}
