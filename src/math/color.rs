//! Colours: the sRGB transfer function, luminance, 8-bit codes.

use std::sync::LazyLock;

use glam::Vec3;

/// Weights of linear Rec. 709 red, green and blue in luminance (ITU-R BT.709-6).
pub const LUMINANCE_WEIGHTS: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Luminance of a linear Rec. 709 colour, in the colour's own unit.
pub fn luminance(color: Vec3) -> f32 {
    color.dot(LUMINANCE_WEIGHTS)
}

/// Decodes an sRGB value (0..1) to linear light (0..1), IEC 61966-2-1.
pub fn srgb_to_linear(encoded: f32) -> f32 {
    let encoded = encoded.clamp(0.0, 1.0);
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Encodes linear light (clamped to 0..1) as sRGB (0..1), IEC 61966-2-1.
pub fn linear_to_srgb(linear: f32) -> f32 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Linear light (0..1) of each 8-bit sRGB code.
pub static LINEAR_OF_CODE: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| srgb_to_linear(code as f32 / 255.0)));

/// The 8-bit code of a value in 0..1, rounded to nearest. Values below 0 and NaN give 0, values above 1 give 255.
pub fn unorm8(value: f32) -> u8 {
    // The conversion saturates, and turns NaN into 0.
    (value * 255.0 + 0.5) as u8
}

/// The 8-bit sRGB code of a linear value. Values below 0 and NaN give 0, values above 1 give 255.
pub fn srgb8(linear: f32) -> u8 {
    unorm8(linear_to_srgb(linear))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_of_srgb_goes_there_and_back() {
        assert!((0..=255u8).all(|code| srgb8(srgb_to_linear(f32::from(code) / 255.0)) == code));
        assert_eq!((srgb8(f32::NAN), srgb8(-1.0), srgb8(9.0)), (0, 0, 255));
    }

    #[test]
    fn codes_round_to_the_nearest_and_saturate() {
        assert!((0..=255u8).all(|code| unorm8(f32::from(code) / 255.0) == code));
        assert_eq!((unorm8(0.49 / 255.0), unorm8(0.51 / 255.0)), (0, 1));
        assert_eq!((unorm8(f32::NAN), unorm8(-3.0), unorm8(f32::INFINITY)), (0, 0, 255));
    }

    #[test]
    fn white_has_a_luminance_of_one() {
        assert!((luminance(Vec3::ONE) - 1.0).abs() < 1e-6);
        assert!(luminance(Vec3::Y) > luminance(Vec3::X) && luminance(Vec3::X) > luminance(Vec3::Z));
    }
}
