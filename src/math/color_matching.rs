//! From spectra to linear colours: how an eye sees what a surface reflects or transmits.

use glam::{DMat3, DVec3, Vec3};

/// Temperature of the light, K: the correlated colour temperature of CIE D65, as the radiator of that temperature.
pub const DAYLIGHT_KELVIN: f64 = 6504.0;

/// Linear Rec. 709 primaries from CIE XYZ (IEC 61966-2-1).
const REC709: DMat3 = DMat3::from_cols(
    DVec3::new(3.240_454_2, -0.969_266_0, 0.055_643_4),
    DVec3::new(-1.537_138_5, 1.876_010_8, -0.204_025_9),
    DVec3::new(-0.498_531_4, 0.041_556_0, 1.057_225_2),
);

/// The CIE 1931 colour matching functions at a wavelength in nm: the multi-lobe fit of [Wyman, Sloan & Shirley 2013,
/// "Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2), listing 1], whose error is below
/// that between human eyes.
pub fn color_matching(nanometres: f64) -> DVec3 {
    let lobe = |height: f64, center: f64, below: f64, above: f64| {
        let t = (nanometres - center) * if nanometres < center { below } else { above };
        height * (-0.5 * t * t).exp()
    };
    DVec3::new(
        lobe(0.362, 442.0, 0.0624, 0.0374) + lobe(1.056, 599.8, 0.0264, 0.0323) + lobe(-0.065, 501.1, 0.0490, 0.0382),
        lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
        lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725),
    )
}

/// Spectral radiance of a black body at `kelvin` (> 0), without its constant factor [Planck 1901].
pub fn black_body(nanometres: f64, kelvin: f64) -> f64 {
    let micrometres = nanometres * 1e-3;
    1.0 / (micrometres.powi(5) * (14_387.769 / (micrometres * kelvin)).exp_m1())
}

/// Linear colour, Rec. 709 primaries, of a surface that reflects or transmits `fraction` (0..=1) of light of
/// [`DAYLIGHT_KELVIN`] at each wavelength in nm of `spectrum`, which must be evenly spaced and should cover 400 to 700.
/// Each channel is relative to that of a surface that returns all light, so equal fractions give grey. Colours outside
/// the primaries' gamut are clamped to 0..=1. Black where there are no samples.
pub fn reflected_color(spectrum: impl IntoIterator<Item = (f64, f64)>) -> Vec3 {
    let (mut seen, mut white) = (DVec3::ZERO, DVec3::ZERO);
    for (nanometres, fraction) in spectrum {
        let all = color_matching(nanometres) * black_body(nanometres, DAYLIGHT_KELVIN);
        if all.is_finite() && fraction.is_finite() {
            seen += all * fraction;
            white += all;
        }
    }
    let color = (REC709 * seen) / (REC709 * white);
    if color.is_finite() { color.as_vec3().clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn visible() -> impl Iterator<Item = f64> {
        (0..=76).map(|step| 400.0 + 5.0 * f64::from(step))
    }

    #[test]
    fn grey_is_grey_and_nothing_is_black() {
        for fraction in [0.0, 0.18, 1.0] {
            let color = reflected_color(visible().map(|w| (w, fraction)));
            assert!((color - fraction as f32).abs().max_element() < 1e-6, "{color}");
        }
        assert_eq!(reflected_color([]), Vec3::ZERO);
        assert_eq!(reflected_color([(f64::NAN, 0.5), (500.0, f64::NAN)]), Vec3::ZERO);
    }

    #[test]
    fn bands_have_their_hues_and_daylight_its_chromaticity() {
        let band = |low: f64, high: f64| {
            reflected_color(visible().map(|w| (w, if (low..high).contains(&w) { 1.0 } else { 0.0 })))
        };
        let (blue, green, red) = (band(400.0, 490.0), band(500.0, 570.0), band(600.0, 720.0));
        assert!(blue.z > 0.7 && blue.z > 3.0 * blue.x.max(blue.y), "{blue}");
        assert!(green.y > 0.5 && green.y > 3.0 * green.x.max(green.z), "{green}");
        assert!(red.x > 0.5 && red.x > 3.0 * red.y.max(red.z), "{red}");
        // A black body of 6504 K has the chromaticity (0.3135, 0.3237) [CIE 15].
        let sum: DVec3 = visible().map(|w| color_matching(w) * black_body(w, DAYLIGHT_KELVIN)).sum();
        let xy = sum.truncate() / sum.element_sum();
        assert!((xy.x - 0.3135).abs() < 0.003 && (xy.y - 0.3237).abs() < 0.003, "{xy}");
    }
}
