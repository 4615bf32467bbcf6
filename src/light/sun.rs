//! Position of the sun, and the visible part of its disc.
//!
//! Position: Reda & Andreas 2003, "Solar Position Algorithm for Solar Radiation Applications" (error 0.0003 degrees),
//! through the crate `solar-positioning`. Refraction: the same report, eq. 42, whose own rule (none at all once the
//! disc is below the horizon) makes the sun jump by 0.6 degrees; here it fades out over the three degrees below
//! instead, so that the light is continuous in time.

use std::f64::consts::PI;

use chrono::{DateTime, SecondsFormat, Utc};
use glam::Vec3;
use solar_positioning::{spa, time::DeltaT, time::JulianDate};

use super::error::{LightError, check_range};
use crate::math::Range;

/// Angular radius of the sun's disc in radians: 0.2666 degrees, the mean over the year (+-1.7 %).
pub const SUN_ANGULAR_RADIUS: f64 = 0.266_6 * PI / 180.0;

/// Location of the observer, and the air there (for refraction).
#[derive(Debug, Clone, Copy, Default, PartialEq, bevy::reflect::Reflect)]
pub struct Observer {
    /// Geographic latitude in degrees, north positive, -90 to 90.
    #[reflect(@Range::steps(-90.0..=90.0, 1.0, 0.1).unit("°"))]
    pub latitude_deg: f64,
    /// Geographic longitude in degrees, EAST positive, -180 to 180.
    #[reflect(@Range::steps(-180.0..=180.0, 1.0, 0.1).unit("°"))]
    pub longitude_deg: f64,
    /// Height above the sea in metres, -500 to 9000.
    #[reflect(@Range::steps(-500.0..=9000.0, 100.0, 10.0).unit("m"))]
    pub height_m: f64,
    /// Air pressure in millibar, 0 (no refraction) to 1100.
    #[reflect(@Range::steps(0.0..=1100.0, 10.0, 1.0).unit("mbar"))]
    pub pressure_mbar: f64,
    /// Air temperature in degrees Celsius, -90 to 60.
    #[reflect(@Range::steps(-90.0..=60.0, 1.0, 0.1).unit("°C"))]
    pub temperature_c: f64,
}

impl Observer {
    /// An observer in a standard atmosphere: 15 degrees Celsius less 6.5 per kilometre, pressure to match (ISO 2533).
    ///
    /// # Errors
    /// [`LightError::OutOfRange`] for an impossible latitude, longitude or height.
    pub fn new(latitude_deg: f64, longitude_deg: f64, height_m: f64) -> Result<Self, LightError> {
        let height_m = check_range("height above the sea", height_m, "m", -500.0, 9000.0, "give metres, not feet")?;
        let temperature_c = 15.0 - 0.0065 * height_m;
        let pressure_mbar = 1013.25 * (1.0 - 2.255_77e-5 * height_m).max(0.0).powf(5.255_88);
        let observer = Self { latitude_deg, longitude_deg, height_m, pressure_mbar, temperature_c };
        observer.validate()?;
        Ok(observer)
    }

    /// Checks every field against its range.
    ///
    /// # Errors
    /// [`LightError::OutOfRange`] for the first field that is outside of it.
    pub fn validate(&self) -> Result<(), LightError> {
        check_range(
            "latitude",
            self.latitude_deg,
            "deg",
            -90.0,
            90.0,
            "south is negative; was longitude given first?",
        )?;
        check_range("longitude", self.longitude_deg, "deg", -180.0, 180.0, "east is positive, west is negative")?;
        check_range("height above the sea", self.height_m, "m", -500.0, 9000.0, "give metres, not feet")?;
        check_range("air pressure", self.pressure_mbar, "mbar", 0.0, 1100.0, "give millibar (hectopascal)")?;
        check_range("air temperature", self.temperature_c, "deg C", -90.0, 60.0, "give degrees Celsius")?;
        Ok(())
    }
}

/// The apparent position of the sun's centre in the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SunPosition {
    /// Azimuth in radians, 0 to 2 pi, clockwise from north (east is pi / 2).
    pub azimuth: f64,
    /// Apparent elevation above the horizontal in radians, -pi/2 to pi/2, refraction included.
    pub elevation: f64,
}

impl SunPosition {
    /// The sun at an instant, with the difference of ephemeris time estimated (Espenak & Meeus 2014).
    ///
    /// # Errors
    /// [`LightError::OutOfRange`] for an impossible observer, [`LightError::Instant`] outside the years -500 to 3000.
    pub fn at(instant: DateTime<Utc>, observer: &Observer) -> Result<Self, LightError> {
        let delta_t = DeltaT::estimate_from_date_like(instant).map_err(|e| instant_error(instant, &e))?;
        Self::at_with_delta_t(instant, observer, delta_t)
    }

    /// The sun at an instant, with `delta_t` = terrestrial time minus UT1 in seconds (69 in 2024).
    ///
    /// # Errors
    /// As [`SunPosition::at`]; also for a `delta_t` beyond +-100,000 seconds.
    pub fn at_with_delta_t(instant: DateTime<Utc>, observer: &Observer, delta_t: f64) -> Result<Self, LightError> {
        observer.validate()?;
        check_range("delta T", delta_t, "s", -1e5, 1e5, "it is about 70 s in this century")?;
        let julian = JulianDate::from_datetime(&instant, delta_t).map_err(|e| instant_error(instant, &e))?;
        let position = spa::solar_position_from_julian(
            julian,
            observer.latitude_deg,
            observer.longitude_deg,
            observer.height_m,
            None,
        )
        .map_err(|e| instant_error(instant, &e))?;
        let geometric = position.elevation_angle();
        let elevation = geometric + refraction_deg(geometric, observer.pressure_mbar, observer.temperature_c);
        Self::from_degrees(position.azimuth(), elevation.clamp(-90.0, 90.0))
    }

    /// The sun at a given azimuth (degrees clockwise from north, -360 to 360) and elevation (degrees, -90 to 90).
    ///
    /// # Errors
    /// [`LightError::OutOfRange`] outside of these ranges.
    pub fn from_degrees(azimuth_deg: f64, elevation_deg: f64) -> Result<Self, LightError> {
        let azimuth = check_range("sun azimuth", azimuth_deg, "deg", -360.0, 360.0, "0 is north, 90 is east")?;
        let elevation = check_range("sun elevation", elevation_deg, "deg", -90.0, 90.0, "90 is overhead")?;
        Ok(Self { azimuth: azimuth.to_radians().rem_euclid(2.0 * PI), elevation: elevation.to_radians() })
    }

    /// Unit vector from the ground to the sun: +X east, +Y up, -Z north.
    pub fn direction(&self) -> Vec3 {
        direction_from(self.azimuth, self.elevation)
    }

    /// The part of the disc above the horizontal, 0 to 1.
    pub fn disc_fraction(&self) -> f64 {
        disc_fraction(self.elevation, SUN_ANGULAR_RADIUS)
    }
}

/// Unit vector with this azimuth (radians clockwise from north) and elevation (radians): +X east, +Y up, -Z north.
pub fn direction_from(azimuth: f64, elevation: f64) -> Vec3 {
    let ((sa, ca), (se, ce)) = (azimuth.sin_cos(), elevation.sin_cos());
    Vec3::new((ce * sa) as f32, se as f32, (-ce * ca) as f32)
}

/// The part, 0 to 1, of the area of a disc of angular radius `radius` above the horizontal when its centre stands at
/// `elevation` (both radians): the area of a circular segment. Continuous with a continuous derivative.
pub fn disc_fraction(elevation: f64, radius: f64) -> f64 {
    let d = (elevation / radius.max(1e-12)).clamp(-1.0, 1.0);
    if d.is_nan() {
        return 0.0;
    }
    (0.5 + (d * (1.0 - d * d).max(0.0).sqrt() + d.asin()) / PI).clamp(0.0, 1.0)
}

/// Atmospheric refraction in degrees for a geometric elevation in degrees (Reda & Andreas 2003, eq. 42; Saemundsson
/// 1986): 0.48 at the horizon, 0.016 at 45. Below -0.8333 degrees, where the formula loses its meaning, it fades to
/// nothing at -3.8333, so that the apparent elevation stays continuous and increasing.
pub fn refraction_deg(elevation_deg: f64, pressure_mbar: f64, temperature_c: f64) -> f64 {
    const LOWEST: f64 = -0.833_3;
    let e = elevation_deg.clamp(LOWEST, 90.0);
    let fade = ((elevation_deg - (LOWEST - 3.0)) / 3.0).clamp(0.0, 1.0);
    let fade = fade * fade * (3.0 - 2.0 * fade);
    let at_e = (pressure_mbar / 1010.0) * (283.0 / (273.0 + temperature_c)) * 1.02
        / (60.0 * (e + 10.3 / (e + 5.11)).to_radians().tan());
    at_e * fade
}

fn instant_error(instant: DateTime<Utc>, reason: &impl std::fmt::Display) -> LightError {
    LightError::Instant { instant: instant.to_rfc3339_opts(SecondsFormat::Secs, true), reason: reason.to_string() }
}
