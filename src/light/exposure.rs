//! Exposure of a camera or an eye to the light of an hour: from the illuminance alone, without history.
//!
//! Full adaptation would show midnight as bright as noon; no adaptation would show it black. As in the eye, the
//! brightness that is displayed falls with a small power of the illuminance `E`: `exposure * E ~ E^(1 - adaptation)`,
//! and as in the eye there are two branches, for cones and for rods, that meet at the end of civil twilight:
//!
//! ```text
//! EV100 = day_ev100 + cone_adaptation * log2(max(E, knee) / day) + rod_adaptation * log2(min(E, knee) / knee)
//! ```
//!
//! By default white in full sun (100,000 lux) is displayed at 1.6; of that brightness a sunset (900 lux) has 37 %,
//! the end of civil twilight (5 lux) 12 %, full moon (0.1 lux) 7.5 %, stars alone (0.001 lux) 4 %. The sky, which at
//! dusk is brighter than everything that it lights, looks about three times as bright as that. Continuous, and
//! increasing in `E`, which increases with the sun's elevation.
//!
//! Without cones there is no colour: below a few nits vision becomes blue and grey (Purkinje). The terms for it follow
//! Jensen, Premoze, Shirley, Thompson, Ferwerda & Stark 2000, "Night Rendering".

use glam::{Mat3, Vec3};

use super::error::{LightError, check_range};

/// The exposure curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExposureSettings {
    /// EV100 at [`ExposureSettings::day_illuminance`], -10 to 25. Up: everything is darker. At 14 a white sheet in full
    /// sun comes out at 1.6, a clear sky at 0.25, summer forest at 0.1, before tone mapping.
    pub day_ev100: f32,
    /// Horizontal illuminance in lux to which `day_ev100` belongs, 1 to 1e6.
    pub day_illuminance: f32,
    /// Horizontal illuminance in lux at which rods take over from cones, 1e-3 to 1000.
    pub knee_illuminance: f32,
    /// Fraction of adaptation in EV above the knee, 0 (a fixed exposure) to 1 (dusk as bright as day).
    pub cone_adaptation: f32,
    /// Fraction of adaptation in EV below the knee, 0 to 1 (night as bright as the end of dusk).
    pub rod_adaptation: f32,
    /// EV added on top, -20 to 20. Up: brighter.
    pub compensation: f32,
    /// Maximum desaturation by night vision, 0 (colours at night as by day) to 1 (rods alone).
    pub scotopic_strength: f32,
    /// Fraction of adaptation in EV to the shade of a stand that the camera is in, 0 (as on open ground) to 1 (the floor of a
    /// wood as bright as a meadow). A camera in a wood sees bright gaps too, so that its eye does not adapt in full.
    pub stand_adaptation: f32,
    /// EV100 that is kept whatever the light, -10 to 25; `None`: the exposure follows the light.
    pub fixed_ev100: Option<f32>,
}

impl Default for ExposureSettings {
    fn default() -> Self {
        Self {
            day_ev100: 14.0,
            day_illuminance: 1e5,
            knee_illuminance: 5.0,
            cone_adaptation: 0.79,
            rod_adaptation: 0.87,
            compensation: 0.0,
            scotopic_strength: 0.85,
            stand_adaptation: 0.9,
            fixed_ev100: None,
        }
    }
}

impl ExposureSettings {
    /// Checks every field against its range.
    ///
    /// # Errors
    /// [`LightError::OutOfRange`] for the first field that is outside of it.
    pub fn validate(&self) -> Result<(), LightError> {
        let check =
            |what, v: f32, unit, min, max| check_range(what, f64::from(v), unit, min, max, "see its documentation");
        check("exposure at day", self.day_ev100, "EV", -10.0, 25.0)?;
        check("illuminance at day", self.day_illuminance, "lx", 1.0, 1e6)?;
        check("illuminance of the knee", self.knee_illuminance, "lx", 1e-3, 1e3)?;
        check("adaptation of cones", self.cone_adaptation, "", 0.0, 1.0)?;
        check("adaptation of rods", self.rod_adaptation, "", 0.0, 1.0)?;
        check("strength of night sight", self.scotopic_strength, "", 0.0, 1.0)?;
        check("exposure compensation", self.compensation, "EV", -20.0, 20.0)?;
        check("adaptation in a stand", self.stand_adaptation, "", 0.0, 1.0)?;
        check("fixed exposure", self.fixed_ev100.unwrap_or_default(), "EV", -10.0, 25.0)?;
        Ok(())
    }

    /// EV100 for a horizontal illuminance in lux on open ground. Below 1e-6 lux, far less than any sky has, it no longer
    /// falls. The fixed one if there is one.
    pub fn ev100(&self, illuminance: f32) -> f32 {
        if let Some(fixed) = self.fixed_ev100 {
            return fixed;
        }
        let e = if illuminance.is_finite() { illuminance.clamp(1e-6, 1e7) } else { self.day_illuminance };
        let knee = self.knee_illuminance;
        self.day_ev100
            + self.cone_adaptation * (e.max(knee) / self.day_illuminance).log2()
            + self.rod_adaptation * (e.min(knee) / knee).log2()
            - self.compensation
    }

    /// EV100 in a stand that lets the fraction `share` of the illuminance on open ground, `illuminance` in lux, through.
    /// Shares below [`DARKEST_SHARE`] count as that, those of 1 and more, or that are no number, as open ground.
    pub fn ev100_in_stand(&self, illuminance: f32, share: f32) -> f32 {
        let share = if share < 1.0 { share.max(DARKEST_SHARE) } else { 1.0 };
        match self.fixed_ev100 {
            Some(fixed) => fixed,
            None => self.ev100(illuminance) + self.stand_adaptation * share.log2(),
        }
    }
}

/// The smallest fraction of the light on open ground that exposure adapts to: the floor of a dense spruce stand.
pub const DARKEST_SHARE: f32 = 0.005;

/// The factor from nits to display values at an EV100, as Bevy has it: `1 / (1.2 * 2^EV)` (ISO 12232 saturation).
pub fn exposure_from_ev100(ev100: f32) -> f32 {
    1.0 / (1.2 * ev100.exp2())
}

/// Night vision: how far colours shift to the blue-grey of rods.
///
/// A pixel of the luminance `Y` nits loses `min(amount, strength * rods(Y))` of its colour: what is bright, the glow
/// of dusk or the moon, keeps its colour by night, and a shadow keeps it by day. `rods` falls from 1 at 0.01 nits to
/// 0 at 4 nits (10^0.6) as a smoothstep of the logarithm (Jensen et al. 2000, eq. 4).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ScotopicTint {
    /// Linear Rec. 709 colour of luminance 1 that rod vision is displayed in.
    pub tint: Vec3,
    /// The bound that the adaptation to the whole image sets: 0 (day: colours as they are) to `strength`.
    pub amount: f32,
    /// The most that any pixel loses, 0 to 1.
    pub strength: f32,
}

/// The share of rods in sight at a luminance in nits, 0 to 1 (Jensen et al. 2000, eq. 4).
fn rods(nits: f32) -> f32 {
    let sigma = ((nits.max(1e-12).log10() + 2.0) / 2.6).clamp(0.0, 1.0);
    1.0 - sigma * sigma * (3.0 - 2.0 * sigma)
}

/// The colour of chromaticity (0.25, 0.25) and luminance 1 (Jensen et al. 2000, section 4).
const ROD_COLOR: Vec3 = Vec3::new(0.706, 0.990, 1.966);

/// Linear Rec. 709 to CIE XYZ (ITU-R BT.709-6), by columns.
const XYZ_FROM_RGB: Mat3 = Mat3::from_cols(
    Vec3::new(0.412_456_4, 0.212_672_9, 0.019_333_9),
    Vec3::new(0.357_576_1, 0.715_152_2, 0.119_192),
    Vec3::new(0.180_437_5, 0.072_175, 0.950_304_1),
);

impl ScotopicTint {
    /// The tint for a horizontal illuminance in lux: the eye is adapted to ground of 18 % albedo. `strength`
    /// is kept within 0 to 1.
    pub fn for_illuminance(illuminance: f32, strength: f32) -> Self {
        let strength = if strength.is_finite() { strength.clamp(0.0, 1.0) } else { 1.0 };
        let adapted = if illuminance.is_finite() { 0.18 / std::f32::consts::PI * illuminance } else { 1e4 };
        Self { tint: ROD_COLOR, amount: strength * rods(adapted), strength }
    }

    /// The colour `rgb`, in nits per channel, as night sight has it: `mix(rgb, tint * V, share)` with the scotopic
    /// luminance `V = Y (1.33 (1 + (Y + Z) / X) - 1.68) / 2.573` (Larson, Rushmeier & Piatko 1997, eq. 10, scaled so
    /// that white keeps its brightness). V of deep reds is negative: rods see them as black. Negative components
    /// count as 0.
    pub fn apply(&self, rgb: Vec3) -> Vec3 {
        let rgb = rgb.max(Vec3::ZERO);
        let Vec3 { x, y, z } = XYZ_FROM_RGB * rgb;
        if self.amount <= 0.0 || x <= 1e-30 {
            return rgb;
        }
        let v = (y * (1.33 * (1.0 + (y + z) / x) - 1.68) / 2.573).max(0.0);
        rgb.lerp(self.tint * v, self.amount.min(self.strength * rods(y)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curve_is_monotone_and_the_documented_brightness() {
        let s = ExposureSettings::default();
        assert_eq!(s.validate(), Ok(()));
        let shown = |e: f32| e * exposure_from_ev100(s.ev100(e)) / (1e5 * exposure_from_ev100(s.ev100(1e5)));
        for (lux, want) in [(900.0, 0.372), (5.0, 0.125), (0.1, 0.075), (1e-3, 0.041)] {
            assert!((shown(lux) - want).abs() < 0.002, "{lux} lux: {}", shown(lux));
        }
        let mut last = f32::NEG_INFINITY;
        for i in -60..60 {
            let ev = s.ev100(10f32.powf(i as f32 * 0.1));
            assert!(ev > last);
            last = ev;
        }
        assert!(s.ev100(f32::NAN).is_finite());
        assert!(ExposureSettings { rod_adaptation: 1.5, ..s }.validate().is_err());
        assert!(ExposureSettings { stand_adaptation: -0.1, ..s }.validate().is_err());
        assert!(ExposureSettings { fixed_ev100: Some(f32::NAN), ..s }.validate().is_err());
    }

    #[test]
    fn a_stand_opens_the_exposure_and_a_fixed_one_stays() {
        let s = ExposureSettings::default();
        assert_eq!(s.ev100_in_stand(1e5, 1.0), s.ev100(1e5));
        let mut last = s.ev100(1e5);
        for share in [0.5, 0.1, 0.02, DARKEST_SHARE] {
            let ev = s.ev100_in_stand(1e5, share);
            assert!(ev < last && ev > s.ev100(1e5) + share.log2(), "{share}: {ev}");
            last = ev;
        }
        assert_eq!(s.ev100_in_stand(1e5, 0.0), last);
        assert_eq!(s.ev100_in_stand(1e5, f32::NAN), s.ev100(1e5));
        assert_eq!(ExposureSettings { stand_adaptation: 0.0, ..s }.ev100_in_stand(1e5, 0.1), s.ev100(1e5));
        let fixed = ExposureSettings { fixed_ev100: Some(9.0), ..s };
        assert_eq!((fixed.ev100(1.0), fixed.ev100_in_stand(1e5, 0.1)), (9.0, 9.0));
    }

    #[test]
    fn rods_see_white_as_bright_blue_grey_and_red_as_black() {
        let night = ScotopicTint::for_illuminance(1e-3, 1.0);
        assert_eq!(night.amount, 1.0);
        let white = night.apply(Vec3::splat(1e-3)) * 1e3;
        assert!((white.dot(Vec3::new(0.2126, 0.7152, 0.0722)) - 1.0).abs() < 0.02, "{white}");
        assert!(white.z > 2.0 * white.x);
        assert!(night.apply(1e-3 * Vec3::X).max_element() < 1e-4);
        // What is bright keeps its colour by night, and everything by day.
        assert_eq!(night.apply(100.0 * Vec3::X), 100.0 * Vec3::X);
        let day = ScotopicTint::for_illuminance(1e4, 1.0);
        assert_eq!(day.apply(Vec3::new(0.3, 0.2, 0.1)), Vec3::new(0.3, 0.2, 0.1));
        assert_eq!(night.apply(Vec3::ZERO), Vec3::ZERO);
    }
}
