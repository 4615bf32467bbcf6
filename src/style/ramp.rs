//! Colour ramps over the light: 0 is turned away from the light, 1 faces it.
//!
//! [Luft 2006, 3.2] combines two as [Gooch 1998] does: a *hue ramp* for the whole picture, such as cool to warm, and an
//! *object ramp* for each layer. The alpha of a ramp is how much pigment there is.

use glam::{Vec3, Vec4, Vec4Swizzles};
use serde::{Deserialize, Deserializer, de};

use crate::math::srgb_to_linear;

/// A ramp: stops in ascending order of the light. Between two stops it is linear, beyond the ends constant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ramp {
    /// Light (0..1), and linear colour with alpha, each 0..1.
    stops: Vec<(f32, Vec4)>,
}

/// Why stops are no ramp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RampError {
    /// No stop.
    #[error("a ramp has no stop; write at least one, as in [(0, \"#405030\", 1)]")]
    Empty,
    /// A number out of range.
    #[error("the light and the alpha of a ramp's stop are 0 to 1")]
    Range,
    /// Stops in another order.
    #[error("the stops of a ramp are listed from dark (0) to bright (1)")]
    Order,
}

impl Ramp {
    /// A ramp of `stops`: light, then linear colour with alpha.
    ///
    /// # Errors
    /// [`RampError`] for no stop, values outside 0..1, or another order than that of the light.
    pub fn new(stops: Vec<(f32, Vec4)>) -> Result<Self, RampError> {
        let fine = |value: f32| (0.0..=1.0).contains(&value);
        if stops.is_empty() {
            return Err(RampError::Empty);
        }
        if !stops.iter().all(|(light, color)| fine(*light) && color.to_array().into_iter().all(fine)) {
            return Err(RampError::Range);
        }
        if !stops.is_sorted_by(|a, b| a.0 <= b.0) {
            return Err(RampError::Order);
        }
        Ok(Self { stops })
    }

    /// A ramp of one linear colour.
    pub fn of(color: Vec3, alpha: f32) -> Self {
        let color = if color.is_finite() { color.clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::ZERO };
        Self { stops: vec![(0.0, color.extend(if alpha.is_finite() { alpha.clamp(0.0, 1.0) } else { 0.0 }))] }
    }

    /// Linear colour and alpha at `light`; that of the dark end for NaN. Transparent black for a default ramp.
    pub fn at(&self, light: f32) -> Vec4 {
        let after = self.stops.iter().position(|(stop, _)| *stop > light).unwrap_or(self.stops.len());
        let after = if light.is_nan() { 0 } else { after };
        match (after.checked_sub(1).and_then(|before| self.stops.get(before)), self.stops.get(after)) {
            (Some((start, from)), Some((end, to))) => from.lerp(*to, (light - start) / (end - start)),
            (Some((_, color)), None) | (None, Some((_, color))) => *color,
            (None, None) => Vec4::ZERO,
        }
    }

    /// `count` colours at even steps of the light, the first at 0 and the last at 1.
    pub fn table(&self, count: usize) -> Vec<Vec4> {
        (0..count).map(|i| self.at(i as f32 / (count.max(2) - 1) as f32)).collect()
    }

    /// The colour of a layer at `light`: the sum of the hue ramp, weighted by its alpha, and the object ramp
    /// [Gooch 1998; Luft 2006, 3.2], at most 1. The alpha is the object's.
    pub fn with_hue(&self, hue: &Self, light: f32) -> Vec4 {
        let (own, hue) = (self.at(light), hue.at(light));
        (own.xyz() + hue.xyz() * hue.w).min(Vec3::ONE).extend(own.w)
    }
}

/// Reads `#rrggbb` (sRGB) as a linear colour.
pub fn color_of_hex(text: &str) -> Option<Vec3> {
    let digits = text.trim().strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii())?;
    let byte = |at: usize| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok();
    let linear = |byte: u8| srgb_to_linear(f32::from(byte) / 255.0);
    Some(Vec3::new(linear(byte(0)?), linear(byte(2)?), linear(byte(4)?)))
}

impl<'de> Deserialize<'de> for Ramp {
    /// A list of stops `(light, "#rrggbb", alpha)`.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let stops: Vec<(f32, String, f32)> = Deserialize::deserialize(deserializer)?;
        let read = |(light, color, alpha): (f32, String, f32)| {
            let linear = color_of_hex(&color)
                .ok_or_else(|| de::Error::custom(format!("`{color}` is no colour (expected \"#rrggbb\")")))?;
            Ok((light, linear.extend(alpha)))
        };
        let stops = stops.into_iter().map(read).collect::<Result<Vec<_>, D::Error>>()?;
        Self::new(stops).map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gray(light: f32, value: f32) -> (f32, Vec4) {
        (light, Vec4::new(value, value, value, 1.0))
    }

    #[test]
    fn a_ramp_is_linear_between_stops_and_constant_beyond() -> Result<(), RampError> {
        let ramp = Ramp::new(vec![gray(0.25, 0.0), gray(0.75, 1.0)])?;
        let at = |light: f32| ramp.at(light).x;
        assert_eq!([at(-1.0), at(0.0), at(0.25), at(0.5), at(0.75), at(9.0)], [0.0, 0.0, 0.0, 0.5, 1.0, 1.0]);
        assert_eq!(at(f32::NAN), 0.0);
        assert_eq!(ramp.table(5).iter().map(|color| color.x).collect::<Vec<_>>(), [0.0, 0.0, 0.5, 1.0, 1.0]);
        Ok(())
    }

    #[test]
    fn a_ramp_of_one_colour_has_it_everywhere() {
        let ramp = Ramp::of(Vec3::new(0.1, 0.2, 0.3), 0.5);
        assert!(ramp.table(7).iter().all(|color| *color == Vec4::new(0.1, 0.2, 0.3, 0.5)));
        assert_eq!(Ramp::of(Vec3::NAN, f32::NAN).at(0.5), Vec4::ZERO);
        assert_eq!(Ramp::default().at(0.5), Vec4::ZERO);
    }

    #[test]
    fn stops_at_one_light_are_a_step() -> Result<(), RampError> {
        let ramp = Ramp::new(vec![gray(0.0, 0.2), gray(0.5, 0.2), gray(0.5, 0.8), gray(1.0, 0.8)])?;
        assert!((ramp.at(0.499).x - 0.2).abs() < 1e-6 && (ramp.at(0.5).x - 0.8).abs() < 1e-6);
        Ok(())
    }

    #[test]
    fn hue_and_object_add_up_as_gooch_has_it() -> Result<(), RampError> {
        // k_cool = k_blue + alpha k_d, k_warm = k_yellow + beta k_d.
        let hue = Ramp::new(vec![(0.0, Vec4::new(0.0, 0.0, 0.4, 0.5)), (1.0, Vec4::new(0.4, 0.4, 0.0, 0.5))])?;
        let object = Ramp::new(vec![(0.0, Vec4::new(0.1, 0.2, 0.1, 1.0)), (1.0, Vec4::new(0.5, 0.9, 0.9, 0.6))])?;
        assert_eq!(object.with_hue(&hue, 0.0), Vec4::new(0.1, 0.2, 0.3, 1.0));
        // At most 1.
        assert_eq!(object.with_hue(&hue, 1.0), Vec4::new(0.7, 1.0, 0.9, 0.6));
        Ok(())
    }

    #[test]
    fn what_is_no_ramp_is_said() {
        assert_eq!(Ramp::new(Vec::new()), Err(RampError::Empty));
        assert_eq!(Ramp::new(vec![gray(0.5, 2.0)]), Err(RampError::Range));
        assert_eq!(Ramp::new(vec![gray(f32::NAN, 0.0)]), Err(RampError::Range));
        assert_eq!(Ramp::new(vec![gray(1.0, 0.0), gray(0.0, 0.0)]), Err(RampError::Order));
        assert_eq!((color_of_hex("#fff"), color_of_hex("ffffff"), color_of_hex("#gg0000")), (None, None, None));
        assert_eq!(color_of_hex("#ff0000"), Some(Vec3::X));
    }
}
