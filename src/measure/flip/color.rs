//! The colour spaces of FLIP, with the constants that its authors use: linear Rec. 709, YCxCz and CIE L*a*b* under D65.

use glam::{Mat3, Vec3};

/// The inverse of the white point's XYZ.
const INVERSE_WHITE: Vec3 = Vec3::new(1.052_156_9, 1.0, 0.918_357_7);
/// XYZ of the white point.
const WHITE: Vec3 = Vec3::new(0.950_428_55, 1.0, 1.088_900_4);

/// Linear Rec. 709 to XYZ.
const TO_XYZ: Mat3 = Mat3::from_cols_array(&[
    10_135_552.0 / 24_577_794.0,
    2_613_072.0 / 12_288_897.0,
    1_425_312.0 / 73_733_382.0,
    8_788_810.0 / 24_577_794.0,
    8_788_810.0 / 12_288_897.0,
    8_788_810.0 / 73_733_382.0,
    4_435_075.0 / 24_577_794.0,
    887_015.0 / 12_288_897.0,
    70_074_185.0 / 73_733_382.0,
]);

/// XYZ to linear Rec. 709.
const FROM_XYZ: Mat3 = Mat3::from_cols_array(&[
    3.241_003_3,
    -0.969_224_33,
    0.055_639_423,
    -1.537_399,
    1.875_930_1,
    -0.204_011_2,
    -0.498_615_86,
    0.041_554_224,
    1.057_149,
]);

/// Linear Rec. 709 (0..1) to YCxCz: opponent colours in which light adds up.
pub fn opponent(linear: Vec3) -> Vec3 {
    let xyz = TO_XYZ * linear * INVERSE_WHITE;
    Vec3::new(116.0 * xyz.y - 16.0, 500.0 * (xyz.x - xyz.y), 200.0 * (xyz.y - xyz.z))
}

/// YCxCz to linear Rec. 709, clamped to what a display shows.
pub fn displayed(opponent: Vec3) -> Vec3 {
    let y = (opponent.x + 16.0) / 116.0;
    let xyz = Vec3::new(y + opponent.y / 500.0, y, y - opponent.z / 200.0) * WHITE;
    (FROM_XYZ * xyz).clamp(Vec3::ZERO, Vec3::ONE)
}

/// Linear Rec. 709 to L*a*b*, with the chroma of the Hunt effect: colours look weaker in the dark.
pub fn perceived(linear: Vec3) -> Vec3 {
    const DELTA: f32 = 6.0 / 29.0;
    let curve = |value: f32| {
        if value > DELTA * DELTA * DELTA { value.powf(1.0 / 3.0) } else { value / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let xyz = (TO_XYZ * linear * INVERSE_WHITE).to_array().map(curve);
    let lightness = 116.0 * xyz[1] - 16.0;
    let hunt = |chroma: f32| 0.01 * lightness * chroma;
    Vec3::new(lightness, hunt(500.0 * (xyz[0] - xyz[1])), hunt(200.0 * (xyz[1] - xyz[2])))
}

/// Distance of two perceived colours: of the lightness along a street, of the chroma as the crow flies.
pub fn distance(a: Vec3, b: Vec3) -> f32 {
    let difference = a - b;
    difference.x.abs() + difference.y.hypot(difference.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_go_there_and_back_and_white_is_white() {
        for color in [Vec3::ZERO, Vec3::ONE, Vec3::new(0.2, 0.7, 0.01), Vec3::X] {
            assert!(displayed(opponent(color)).abs_diff_eq(color, 2e-6), "{color}");
        }
        assert!(perceived(Vec3::ONE).abs_diff_eq(Vec3::new(100.0, 0.0, 0.0), 1e-3), "{}", perceived(Vec3::ONE));
        assert!(perceived(Vec3::ZERO).abs_diff_eq(Vec3::ZERO, 1e-3));
        assert!(displayed(Vec3::new(300.0, 0.0, 0.0)) == Vec3::ONE);
    }
}
