//! National and state coordinate systems by their EPSG codes: where on earth they lie, and the unit of their coordinates.
//!
//! The definitions are those of the EPSG registry (crate `crs-definitions`), the mathematics that of PROJ.4 (crate `proj4rs`)
//! without grids of datum shifts: places are right to some metres, for old datums to some ten.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec2;
use proj4rs::Proj;
use proj4rs::transform::transform;

/// A system between coordinates and places on earth.
pub(super) struct Projection {
    system: Proj,
    earth: Proj,
}

/// The definition of a code in the words of PROJ.4.
fn definition(code: u32) -> Option<&'static str> {
    crs_definitions::from_code(u16::try_from(code).ok()?)
        .map(|definition| definition.proj4)
        .filter(|text| !text.is_empty())
}

/// The value of a parameter such as `+proj=utm`.
pub(super) fn parameter<'a>(definition: &'a str, name: &str) -> Option<&'a str> {
    definition.split_whitespace().find_map(|word| {
        let word = word.strip_prefix('+')?;
        let (key, value) = word.split_once('=').unwrap_or((word, ""));
        (key == name).then_some(value)
    })
}

/// What kind of system a definition is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Geographic,
    Geocentric,
    /// UTM on a datum that is WGS84 to a metre.
    Utm {
        zone: u8,
        south: bool,
    },
    Projected {
        metres_per_unit: f64,
    },
}

/// What a code stands for; `None` if it is not known.
pub(super) fn kind_of(code: u32) -> Option<Kind> {
    kind_of_definition(definition(code)?)
}

/// What a definition in the words of PROJ.4 stands for.
pub(super) fn kind_of_definition(text: &str) -> Option<Kind> {
    match parameter(text, "proj")? {
        "longlat" | "latlong" => Some(Kind::Geographic),
        "geocent" => Some(Kind::Geocentric),
        name => {
            let metres = metres_per_unit(text);
            let number = |name: &str| parameter(text, name).and_then(|value| value.parse::<f64>().ok());
            let modern = is_modern(text) && metres == 1.0;
            if name == "utm" && modern {
                let zone = parameter(text, "zone")?.parse().ok().filter(|zone| (1..=60).contains(zone))?;
                return Some(Kind::Utm { zone, south: parameter(text, "south").is_some() });
            }
            // UTM as a transverse Mercator projection, as files of ArcGIS define it.
            let scale = number("k").or(number("k_0")).unwrap_or(1.0);
            let zone = (number("lon_0").unwrap_or(f64::NAN) + 183.0) / 6.0;
            let north = number("y_0").unwrap_or(0.0);
            let is_utm = (name == "tmerc" || name == "etmerc")
                && modern
                && (scale - 0.9996).abs() < 1e-9
                && number("x_0") == Some(500_000.0)
                && number("lat_0").unwrap_or(0.0) == 0.0
                && (north == 0.0 || north == 10_000_000.0)
                && zone.fract() == 0.0
                && (1.0..=60.0).contains(&zone);
            Some(if is_utm {
                Kind::Utm { zone: zone as u8, south: north > 0.0 }
            } else {
                Kind::Projected { metres_per_unit: metres }
            })
        }
    }
}

/// Whether a datum is WGS84 to about a metre: its ellipsoid is, and it is not shifted.
fn is_modern(text: &str) -> bool {
    let shifted = parameter(text, "towgs84").is_some_and(|shift| {
        shift.split(',').any(|value| value.parse::<f64>().map_or(true, |value| value.abs() > 2.0))
    });
    !shifted && (semi_major(text).is_none_or(|a| (a - 6_378_137.0).abs() < 0.5))
}

/// Metres per unit of the coordinates of a definition.
fn metres_per_unit(text: &str) -> f64 {
    let stated = parameter(text, "to_meter").and_then(|value| value.parse().ok());
    let named = || {
        Some(match parameter(text, "units")? {
            "us-ft" => 1200.0 / 3937.0,
            "ft" => 0.3048,
            "km" => 1000.0,
            "link" => 0.201_168,
            "ind-yd" => 0.914_398_41,
            _ => 1.0,
        })
    };
    stated.or_else(named).filter(|metres: &f64| metres.is_finite() && *metres > 0.0).unwrap_or(1.0)
}

/// Metres per unit of the heights of a compound system, where its definition states one.
pub(super) fn metres_per_height_unit(code: u32) -> Option<f64> {
    Some(match parameter(definition(code)?, "vunits")? {
        "us-ft" => 1200.0 / 3937.0,
        "ft" => 0.3048,
        "m" => 1.0,
        _ => return None,
    })
}

/// Semi-major axis of a definition, as far as it is known here.
fn semi_major(text: &str) -> Option<f64> {
    if let Some(a) = parameter(text, "a").and_then(|value| value.parse().ok()) {
        return Some(a);
    }
    let ellipsoid = parameter(text, "ellps").or_else(|| {
        Some(match parameter(text, "datum")? {
            "WGS84" | "NAD83" => "GRS80",
            "NAD27" => "clrk66",
            "OSGB36" => "airy",
            "potsdam" | "hermannskogel" => "bessel",
            "ire65" => "mod_airy",
            "nzgd49" => "intl",
            "carthage" => "clrk80",
            _ => return None,
        })
    })?;
    Some(match ellipsoid {
        "GRS80" | "WGS84" => 6_378_137.0,
        "bessel" => 6_377_397.155,
        "clrk66" => 6_378_206.4,
        "clrk80" | "clrk80ign" => 6_378_249.2,
        "intl" => 6_378_388.0,
        "krass" => 6_378_245.0,
        "airy" => 6_377_563.396,
        "mod_airy" => 6_377_340.189,
        _ => return None,
    })
}

/// The code of the projected system with the same parameters as a definition; the lowest if there are several.
pub(super) fn code_of(wanted: &str) -> Option<u32> {
    let name = parameter(wanted, "proj")?;
    let number = |text: &str, name: &str| parameter(text, name).and_then(|value| value.parse::<f64>().ok());
    let scale = |text: &str| number(text, "k").or(number(text, "k_0")).unwrap_or(1.0);
    let angles = ["lat_0", "lat_1", "lat_2", "lon_0", "lonc", "alpha"];
    (2000..=32_760).find(|code| {
        let Some(text) = definition(*code).filter(|text| parameter(text, "proj") == Some(name)) else { return false };
        let close = |name: &str, tolerance: f64| {
            (number(text, name).unwrap_or(0.0) - number(wanted, name).unwrap_or(0.0)).abs() < tolerance
        };
        let same_ellipsoid = match (semi_major(text), semi_major(wanted)) {
            (Some(a), Some(b)) => (a - b).abs() < 0.5,
            _ => true,
        };
        same_ellipsoid
            && angles.iter().all(|name| close(name, 1e-7))
            && close("x_0", 0.01)
            && close("y_0", 0.01)
            && close("zone", 0.5)
            && (scale(text) - scale(wanted)).abs() < 1e-9
            && (metres_per_unit(text) / metres_per_unit(wanted) - 1.0).abs() < 1e-7
    })
}

impl Projection {
    /// The system of a code, if it is known and can be computed.
    pub fn from_epsg(code: u32) -> Option<Self> {
        let text = definition(code)?;
        let system = Proj::from_proj_string(text).ok().or_else(|| {
            // Grids of datum shifts are not at hand.
            let plain: Vec<&str> = text
                .split_whitespace()
                .filter(|word| !word.starts_with("+nadgrids") && !word.starts_with("+geoidgrids"))
                .collect();
            Proj::from_proj_string(&plain.join(" ").replace("+datum=NAD27", "+ellps=clrk66")).ok()
        })?;
        let earth = Proj::from_proj_string("+proj=longlat +datum=WGS84 +no_defs").ok()?;
        (!system.is_latlong() && !system.is_geocent()).then_some(Self { system, earth })
    }

    /// Latitude and longitude in degrees of coordinates whose unit has `metres_per_unit` metres.
    pub fn to_earth(&self, point: DVec2, metres_per_unit: f64) -> Option<(f64, f64)> {
        let own = metres_per_unit / self.system.to_meter();
        let mut place = (point.x * own, point.y * own, 0.0);
        transform(&self.system, &self.earth, &mut place).ok()?;
        let sound = place.0.abs() <= PI + 1e-6 && place.1.abs() <= FRAC_PI_2 + 1e-6;
        sound.then(|| (place.1.to_degrees(), place.0.to_degrees()))
    }

    /// Coordinates in units of `metres_per_unit` metres of a place in degrees.
    pub fn coordinates_of(&self, longitude: f64, latitude: f64, metres_per_unit: f64) -> Option<DVec2> {
        let own = metres_per_unit / self.system.to_meter();
        let mut place = (longitude.to_radians(), latitude.to_radians(), 0.0);
        transform(&self.earth, &self.system, &mut place).ok()?;
        let point = DVec2::new(place.0, place.1) / own;
        point.is_finite().then_some(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_have_their_kinds_and_units() {
        for (code, expected) in [
            (4326, Some(Kind::Geographic)),
            (6318, Some(Kind::Geographic)),
            (4978, Some(Kind::Geocentric)),
            (32633, Some(Kind::Utm { zone: 33, south: false })),
            (28355, Some(Kind::Utm { zone: 55, south: true })),
            (2154, Some(Kind::Projected { metres_per_unit: 1.0 })),
            (2263, Some(Kind::Projected { metres_per_unit: 1200.0 / 3937.0 })),
            (2222, Some(Kind::Projected { metres_per_unit: 0.3048 })),
            (1, None),
            (70_000, None),
        ] {
            assert_eq!(kind_of(code), expected, "{code}");
        }
        assert!(matches!(kind_of(4647), Some(Kind::Projected { .. })), "{:?}", kind_of(4647));
    }

    #[test]
    fn places_in_national_systems_are_where_they_are() {
        // Coordinates of the registry's own examples and of well-known places, to the accuracy of the datum shift.
        for (code, point, latitude, longitude) in [
            // Eiffel tower, Lambert-93.
            (2154, (648_237.3, 6_862_271.7), 48.858_37, 2.294_48),
            // Tower of London, British National Grid.
            (27700, (533_600.0, 180_500.0), 51.508, -0.076),
            // Bern, old observatory, CH1903+ / LV95.
            (2056, (2_600_000.0, 1_200_000.0), 46.951_08, 7.438_64),
            // Amersfoort, RD New.
            (28992, (155_000.0, 463_000.0), 52.155_17, 5.387_2),
            // Statue of Liberty, New York Long Island in US survey feet.
            (2263, (971_466.0, 190_865.0), 40.690, -74.046),
        ] {
            let projection = Projection::from_epsg(code).expect("a known code");
            let Some(Kind::Projected { metres_per_unit }) = kind_of(code) else { panic!("{code}") };
            let point = DVec2::from(point);
            let (north, east) = projection.to_earth(point, metres_per_unit).expect("a place");
            assert!((north - latitude).abs() < 3e-3 && (east - longitude).abs() < 3e-3, "{code}: {north}, {east}");
            let back = projection.coordinates_of(east, north, metres_per_unit).expect("coordinates");
            assert!((back - point).length() < 0.05, "{code}: {back}");
        }
    }

    #[test]
    fn definitions_are_found_again() {
        for code in [2154, 2263, 27700, 31467] {
            let text = definition(code).expect("a definition");
            let found = code_of(text).expect("a code");
            assert!(found <= code, "{code}: {found}");
        }
        let arcgis =
            "+proj=tmerc +lat_0=0 +lon_0=15 +k=0.9996 +x_0=500000 +y_0=0 +a=6378137 +rf=298.257223563 +units=m";
        assert_eq!(kind_of_definition(arcgis), Some(Kind::Utm { zone: 33, south: false }));
    }
}
