//! Location on earth and time, on which the sun, the moon and the air depend.

use serde::Deserialize;

use super::check::Check;
use super::ground::Ground;
use super::time::LocalTime;
use crate::light::MoonSetting;

/// Location and time of a scene, as far as the scene states them.
///
/// An [`Observer`](crate::light::sun::Observer) has a location in any case, that of the terrain file if need be, and a
/// height and an air pressure, which follow from the terrain.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Place {
    /// Degrees north of the equator, -90 to 90. Default: the middle of the terrain file; required for terrain that is
    /// not a file with a coordinate system.
    pub latitude: Option<f64>,
    /// Degrees east of Greenwich, -180 to 180. Default: as for `latitude`.
    pub longitude: Option<f64>,
    /// Date and time with the offset from UTC, years 1900 to 2200: `"2026-06-21T15:30+02:00"`.
    /// Default `"2026-06-21T12:00Z"`.
    pub time: LocalTime,
    /// The moon that lights the night: `Full`, `Astronomical` or `None`. Default `Full`.
    pub moon: MoonSetting,
    /// Distance in metres at which the air has taken all but 2 % of the contrast (Koschmieder 1924), 2000 to 250000.
    /// Lower is hazier. Default 40000.
    pub visibility: f64,
}

impl Default for Place {
    fn default() -> Self {
        Self {
            latitude: None,
            longitude: None,
            time: LocalTime::default(),
            moon: MoonSetting::Full,
            visibility: 40_000.0,
        }
    }
}

impl Place {
    /// Degrees north of the equator and east of Greenwich; defaults for everything else.
    pub fn at(latitude: f64, longitude: f64) -> Self {
        Self { latitude: Some(latitude), longitude: Some(longitude), ..Self::default() }
    }

    pub(super) fn check(&self, ground: &Ground, check: &mut Check) {
        for (name, value, limit) in [("latitude", self.latitude, 90.0), ("longitude", self.longitude, 180.0)] {
            let field = format!("place.{name}");
            match value {
                Some(value) => {
                    check.number(&field, value, -limit..=limit, "degrees");
                }
                None if !ground.may_know_its_place() => check.problem(
                    &field,
                    "is missing, and this kind of terrain has no location on earth",
                    format!("add `place: (latitude: 47.5, longitude: 9.2)` with the {name} that the sun shall have"),
                ),
                None => {}
            }
        }
        if self.latitude.is_some() != self.longitude.is_some() && ground.may_know_its_place() {
            check.problem(
                "place",
                "states only one of `latitude` and `longitude`",
                "state both, or neither to take them from the terrain file",
            );
        }
        check.number("place.visibility", self.visibility, 2_000.0..=250_000.0, "m");
    }
}
