//! Where the moon stands, how full it is, and how much light it gives.
//!
//! Position: the low-precision series of the Astronomical Almanac (page D46; the largest terms of Meeus 1998, ch. 47):
//! 0.3 degrees in longitude, 0.2 in latitude, then the observer's parallax (up to 1 degree) and refraction.
//! Illuminance: the phase law of Krisciunas & Schaefer 1991, eq. 20 (after Allen 1976), within about 15 %; it has no
//! opposition surge (up to 35 % more within 2 degrees of full moon).

use chrono::{DateTime, Utc};
use glam::{DMat3, DVec3, Mat3, Vec3};

use super::error::LightError;
use super::sun::{Observer, SunPosition, refraction_deg};

/// Angular radius of the moon's disc in radians at its mean distance: 0.2590 degrees (varies by 6 %).
pub const MOON_ANGULAR_RADIUS: f64 = 0.259_0 * std::f64::consts::PI / 180.0;

/// Lux of the full moon above the atmosphere at its mean distance (Krisciunas & Schaefer 1991, eq. 20: 0.0291
/// footcandles).
const FULL_MOON_LUX: f64 = 0.313;

/// Colour of moonlight above the atmosphere: sunlight reddened by the moon's soil (B-V of 0.92 against 0.65),
/// luminance 1.
const MOON_COLOR: Vec3 = Vec3::new(1.213, 0.961, 0.760);

/// Which moon a scene has.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Default, Hash, serde::Serialize, serde::Deserialize, bevy::reflect::Reflect,
)]
pub enum MoonSetting {
    /// The real one at the scene's instant and location. A scene that gives its sun by angles has no instant, and no
    /// moon.
    #[default]
    Astronomical,
    /// A full moon opposite the sun, as in lunar orbit without its inclination: every night is moonlit and readable.
    Full,
    /// No moon.
    None,
}

/// A moon in the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moon {
    /// Unit vector from the ground to the moon's apparent centre: +X east, +Y up, -Z north.
    pub direction: Vec3,
    /// Angle sun-moon-earth in radians: 0 at full moon, pi at new moon.
    pub phase_angle: f32,
    /// Illuminance above the atmosphere on a surface that faces it, lux per channel.
    pub illuminance: Vec3,
    /// Whether it follows the sun ([`MoonSetting::Full`]); exposure then does not depend on its height.
    pub opposite_sun: bool,
}

impl MoonSetting {
    /// The moon of this setting; `when` is the scene's instant and observer, if it has them.
    ///
    /// # Errors
    /// [`LightError`] for an impossible observer.
    pub fn moon(self, when: Option<(DateTime<Utc>, &Observer)>, sun: &SunPosition) -> Result<Option<Moon>, LightError> {
        match (self, when) {
            (Self::Astronomical, Some((instant, observer))) => Moon::at(instant, observer).map(Some),
            (Self::Full, _) => Ok(Some(Moon::full_opposite(sun))),
            (Self::Astronomical, None) | (Self::None, _) => Ok(None),
        }
    }
}

impl Moon {
    /// The real moon at an instant. Error about 0.3 degrees from 1900 to 2100.
    ///
    /// # Errors
    /// [`LightError::OutOfRange`] for an impossible observer.
    pub fn at(instant: DateTime<Utc>, observer: &Observer) -> Result<Self, LightError> {
        observer.validate()?;
        let days = days_since_2000(instant);
        let (longitude, latitude, parallax) = ecliptic_moon(days / 36_525.0);
        let toward_moon = from_ecliptic(longitude, latitude, days);
        // In units of the Earth's radius, from the Earth's centre.
        let distance = 1.0 / parallax.sin();
        let local = equatorial_to_local(observer.latitude_deg, sidereal_angle(days, observer.longitude_deg));
        let topocentric = local * toward_moon * distance - DVec3::Y;
        let d = topocentric.normalize_or(DVec3::Y);
        let geometric = d.y.clamp(-1.0, 1.0).asin().to_degrees();
        let bent = geometric + refraction_deg(geometric, observer.pressure_mbar, observer.temperature_c);
        let (sin_e, cos_e) = bent.clamp(-90.0, 90.0).to_radians().sin_cos();
        let horizontal = DVec3::new(d.x, 0.0, d.z).normalize_or(DVec3::NEG_Z) * cos_e;
        let direction = (horizontal + DVec3::Y * sin_e).as_vec3().normalize_or(Vec3::Y);

        let sun = from_ecliptic(ecliptic_sun(days), 0.0, days);
        let elongation = toward_moon.dot(sun).clamp(-1.0, 1.0).acos();
        // The sun is 389 times as far as the moon (Meeus 1998, 48.3).
        let phase_angle = (389.0 * elongation.sin()).atan2(1.0 - 389.0 * elongation.cos());
        let closeness = (60.27 / distance).powi(2);
        Ok(Self {
            direction,
            phase_angle: phase_angle as f32,
            illuminance: MOON_COLOR * (phase_law(phase_angle) * FULL_MOON_LUX * closeness) as f32,
            opposite_sun: false,
        })
    }

    /// A full moon at its mean distance, opposite the sun.
    pub fn full_opposite(sun: &SunPosition) -> Self {
        Self {
            direction: -sun.direction(),
            phase_angle: 0.0,
            illuminance: MOON_COLOR * FULL_MOON_LUX as f32,
            opposite_sun: true,
        }
    }

    /// The lit part of the disc, 0 to 1.
    pub fn lit_fraction(&self) -> f32 {
        0.5 * (1.0 + self.phase_angle.cos())
    }

    /// Mean radiance of the lit part of the disc above the atmosphere, nits per channel: what the shader draws.
    pub fn disc_radiance(&self) -> Vec3 {
        let solid_angle = std::f64::consts::PI * MOON_ANGULAR_RADIUS.powi(2);
        self.illuminance / (solid_angle as f32 * self.lit_fraction().max(1e-3))
    }
}

/// Light of the moon relative to full moon at the phase angle `alpha` in radians (Krisciunas & Schaefer 1991, eq. 20).
fn phase_law(alpha: f64) -> f64 {
    let degrees = alpha.abs().to_degrees();
    10f64.powf(-0.4 * (0.026 * degrees + 4e-9 * degrees.powi(4)))
}

/// Days since 2000-01-01 12:00 UTC.
fn days_since_2000(instant: DateTime<Utc>) -> f64 {
    (instant.timestamp() as f64 + f64::from(instant.timestamp_subsec_nanos()) * 1e-9) / 86_400.0 - 10_957.5
}

/// Geocentric ecliptic longitude and latitude and horizontal parallax of the moon, radians, `t` centuries after 2000
/// (Astronomical Almanac, page D46).
fn ecliptic_moon(t: f64) -> (f64, f64, f64) {
    let angle = |a: f64, b: f64| (a + b * t).to_radians();
    let sin = |a: f64, b: f64| angle(a, b).sin();
    let cos = |a: f64, b: f64| angle(a, b).cos();
    let longitude = 218.32 + 481_267.881 * t + 6.29 * sin(135.0, 477_198.87) - 1.27 * sin(259.3, -413_335.36)
        + 0.66 * sin(235.7, 890_534.22)
        + 0.21 * sin(269.9, 954_397.74)
        - 0.19 * sin(357.5, 35_999.05)
        - 0.11 * sin(186.5, 966_404.03);
    let latitude = 5.13 * sin(93.3, 483_202.02) + 0.28 * sin(228.2, 960_400.89)
        - 0.28 * sin(318.3, 6_003.15)
        - 0.17 * sin(217.6, -407_332.21);
    let parallax = 0.9508
        + 0.0518 * cos(135.0, 477_198.87)
        + 0.0095 * cos(259.3, -413_335.36)
        + 0.0078 * cos(235.7, 890_534.22)
        + 0.0028 * cos(269.9, 954_397.74);
    (longitude.to_radians(), latitude.to_radians(), parallax.to_radians())
}

/// Ecliptic longitude of the sun in radians (Astronomical Almanac, page C5; 0.01 degrees), `days` after 2000-01-01
/// 12:00.
fn ecliptic_sun(days: f64) -> f64 {
    let anomaly = (357.528 + 0.985_600_3 * days).to_radians();
    (280.460 + 0.985_647_4 * days + 1.915 * anomaly.sin() + 0.020 * (2.0 * anomaly).sin()).to_radians()
}

/// The equatorial unit vector (x to the vernal equinox, z to the north pole) of an ecliptic longitude and latitude.
fn from_ecliptic(longitude: f64, latitude: f64, days: f64) -> DVec3 {
    let obliquity = (23.4393 - 3.563e-7 * days).to_radians();
    let ((sl, cl), (sb, cb), (so, co)) = (longitude.sin_cos(), latitude.sin_cos(), obliquity.sin_cos());
    let (x, y, z) = (cb * cl, cb * sl, sb);
    DVec3::new(x, co * y - so * z, so * y + co * z)
}

/// Local mean sidereal time as an angle in radians (Meeus 1998, 12.4), `days` after 2000-01-01 12:00 UT.
fn sidereal_angle(days: f64, longitude_deg: f64) -> f64 {
    (280.460_618_37 + 360.985_647_366_29 * days + longitude_deg).rem_euclid(360.0).to_radians()
}

/// Turns equatorial directions into ours (+X east, +Y up, -Z north) at a latitude and a local sidereal angle.
fn equatorial_to_local(latitude_deg: f64, sidereal: f64) -> DMat3 {
    let ((s, c), (sp, cp)) = (sidereal.sin_cos(), latitude_deg.to_radians().sin_cos());
    // East = -cos(dec) sin(H), north = sin(dec) cos(lat) - cos(dec) cos(H) sin(lat), up = sin(dec) sin(lat) +
    // cos(dec) cos(H) cos(lat).
    DMat3::from_cols(DVec3::new(-s, c * cp, c * sp), DVec3::new(c, s * cp, s * sp), DVec3::new(0.0, sp, -cp))
}

/// The rotation from our world (+X east, +Y up, -Z north) into the equatorial frame in which the stars stand still
/// (x to the vernal equinox, z to the north pole), at an instant and location: `star direction = rotation * view
/// direction`.
pub fn celestial_rotation(instant: DateTime<Utc>, observer: &Observer) -> Mat3 {
    let sidereal = sidereal_angle(days_since_2000(instant), observer.longitude_deg);
    equatorial_to_local(observer.latitude_deg, sidereal).transpose().as_mat3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::LUMINANCE_WEIGHTS;

    /// Meeus 1998, example 47.a: 1992 April 12, 0h TD.
    #[test]
    fn ecliptic_place_agrees_with_meeus() {
        let days = days_since_2000("1992-04-12T00:00:00Z".parse().unwrap());
        let (longitude, latitude, parallax) = ecliptic_moon(days / 36_525.0);
        assert!((longitude.to_degrees().rem_euclid(360.0) - 133.1627).abs() < 0.3);
        assert!((latitude.to_degrees() + 3.2291).abs() < 0.2);
        assert!((parallax.to_degrees() - 0.99199).abs() < 0.01);
    }

    #[test]
    fn colour_has_unit_luminance_and_half_moon_is_a_tenth() {
        assert!((MOON_COLOR.dot(LUMINANCE_WEIGHTS) - 1.0).abs() < 2e-3);
        let half = phase_law(std::f64::consts::FRAC_PI_2);
        assert!((0.08..0.11).contains(&half), "{half}");
    }
}
