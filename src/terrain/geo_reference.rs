//! What a file's horizontal coordinates mean, and how they map to the local frame.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::TerrainError;
use super::projection::{self, Kind, Projection};

/// Semi-major axis of the WGS84 ellipsoid in metres.
const WGS84_A: f64 = 6_378_137.0;
/// Flattening of the WGS84 ellipsoid.
const WGS84_F: f64 = 1.0 / 298.257_223_563;
/// Scale of the UTM projections on their central meridian.
const UTM_SCALE: f64 = 0.9996;
/// Geographic data nearer to a pole than this (degrees of latitude) cannot be laid out flat.
const MAX_LATITUDE: f64 = 89.0;

/// The horizontal coordinate system of a file.
///
/// A scene file writes it as `Geographic`, `Utm(zone: 17)`, `Utm(zone: 33, south: true)`, `Local`,
/// `Projected(metres_per_unit: 0.3048)` or by its EPSG code, `Epsg(25832)` (see [`from_epsg`](Self::from_epsg)).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(from = "Written", into = "Written")]
pub enum CoordinateSystem {
    /// Degrees of longitude (x) and latitude (y). The datum is taken as WGS84: others differ by some 100 m in place
    /// and by less than 0.01 % in scale.
    Geographic,
    /// Universal Transverse Mercator in metres. Grid metres are taken as ground metres (they differ by 0.04 % to
    /// 0.1 %) and grid north as true north (they differ by up to about 3 degrees at a zone's rim).
    Utm {
        /// Zone 1 to 60.
        zone: u8,
        /// Southern hemisphere: false northing of 10 000 km.
        south: bool,
    },
    /// The web maps' Mercator projection (EPSG:3857). Its metres are stretched by `1 / cos(latitude)`, which is undone
    /// here for the terrain's centre.
    WebMercator,
    /// Another projection, of which only the unit is used: its location on earth is unknown here.
    Projected {
        /// The EPSG code, if the file names one.
        epsg: Option<u32>,
        /// Metres per unit of the coordinates (0.3048 for feet).
        metres_per_unit: f64,
    },
    /// Metres from a corner or any other point, x east and y north, without a location on earth.
    Local,
}

/// A coordinate system as a scene file writes it.
#[derive(Deserialize, Serialize)]
#[serde(rename = "CoordinateSystem", deny_unknown_fields)]
enum Written {
    Geographic,
    Utm {
        zone: u8,
        #[serde(default)]
        south: bool,
    },
    Epsg(u32),
    Projected {
        #[serde(default, skip_serializing_if = "Option::is_none")]
        epsg: Option<u32>,
        #[serde(default = "one")]
        metres_per_unit: f64,
    },
    Local,
}

fn one() -> f64 {
    1.0
}

impl From<Written> for CoordinateSystem {
    /// A code that stands for no system that is known here becomes a projection in metres with that code.
    fn from(written: Written) -> Self {
        match written {
            Written::Geographic => Self::Geographic,
            Written::Utm { zone, south } => Self::Utm { zone, south },
            Written::Epsg(code) => {
                Self::from_epsg(code).unwrap_or(Self::Projected { epsg: Some(code), metres_per_unit: 1.0 })
            }
            Written::Projected { epsg, metres_per_unit } => Self::Projected { epsg, metres_per_unit },
            Written::Local => Self::Local,
        }
    }
}

impl From<CoordinateSystem> for Written {
    fn from(system: CoordinateSystem) -> Self {
        match system {
            CoordinateSystem::Geographic => Self::Geographic,
            CoordinateSystem::Utm { zone, south } => Self::Utm { zone, south },
            CoordinateSystem::WebMercator => Self::Epsg(3857),
            CoordinateSystem::Projected { epsg, metres_per_unit } => Self::Projected { epsg, metres_per_unit },
            CoordinateSystem::Local => Self::Local,
        }
    }
}

impl CoordinateSystem {
    /// The system that a text in WKT or in the words of PROJ.4 describes, as `.prj` files have it; `None` where it is not
    /// understood.
    pub fn from_wkt(text: &str) -> Option<Self> {
        super::read::system_of_wkt(text)
    }

    /// The system that an EPSG code stands for, by the definitions of the registry: degrees, UTM on a datum that is WGS84 to a
    /// metre (WGS84, NAD83, ETRS89, GDA), 3857, or a projection with the unit of its coordinates. Codes of state plane systems
    /// together with heights (8700 to 8790) are in feet. Other codes from 1024 to 32767 are taken as projections in metres;
    /// geocentric systems and anything else are `None`.
    pub fn from_epsg(code: u32) -> Option<Self> {
        let zone = (code % 100) as u8;
        Some(match code {
            32601..=32660 | 26901..=26923 | 25828..=25838 => Self::Utm { zone, south: false },
            32701..=32760 => Self::Utm { zone, south: true },
            3857 => Self::WebMercator,
            _ => match projection::kind_of(code) {
                Some(Kind::Geographic) => Self::Geographic,
                Some(Kind::Geocentric) => return None,
                Some(Kind::Utm { zone, south }) => Self::Utm { zone, south },
                Some(Kind::Projected { metres_per_unit }) => Self::Projected { epsg: Some(code), metres_per_unit },
                None if (8700..=8790).contains(&code) => {
                    Self::Projected { epsg: Some(code), metres_per_unit: 1200.0 / 3937.0 }
                }
                None if (4001..=4999).contains(&code) => Self::Geographic,
                None if (1024..=32766).contains(&code) => Self::Projected { epsg: Some(code), metres_per_unit: 1.0 },
                None => return None,
            },
        })
    }

    /// Metres per unit of the heights, where the code of the system says so: a compound one.
    pub fn metres_per_height_unit(self) -> Option<f64> {
        match self {
            Self::Projected { epsg: Some(code), .. } => projection::metres_per_height_unit(code)
                .or_else(|| (8700..=8790).contains(&code).then_some(1200.0 / 3937.0)),
            _ => None,
        }
    }
}

/// Ties the local frame of a terrain (metres, x east, z south, origin at the centre) to the coordinates of its file.
///
/// The map is affine: scales are those at the centre. For geographic data this is the equirectangular projection;
/// `b` metres north of the centre a length along a parallel is wrong by the fraction `b * tan(latitude) / 6.4e6` (0.2 %
/// at 15 km and 40 degrees), the same for the heights and for everything placed with this reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeoReference {
    system: CoordinateSystem,
    centre: DVec2,
    metres_per_unit: DVec2,
}

impl GeoReference {
    /// The reference of a terrain whose centre has these file coordinates (x east, y north).
    ///
    /// # Errors
    /// A centre that is not finite or beyond 1e9, a latitude beyond 89 degrees, a UTM zone outside 1 to 60, a unit
    /// outside 1e-6 m to 1e6 m.
    pub fn new(system: CoordinateSystem, centre: DVec2) -> Result<Self, TerrainError> {
        let bad = |name, value, range| Err(TerrainError::BadParameter { name, value, range });
        for value in [centre.x, centre.y] {
            if value.is_nan() || value.abs() > 1.0e9 {
                return bad("a coordinate of the terrain's centre", value, "within +-1e9");
            }
        }
        let metres_per_unit = match system {
            CoordinateSystem::Geographic => {
                if centre.y.abs() > MAX_LATITUDE {
                    return bad(
                        "the latitude of the terrain's centre",
                        centre.y,
                        "within +-89 degrees (check that x is longitude; nearer to a pole, project the data to metres)",
                    );
                }
                metres_per_degree(centre.y)
            }
            CoordinateSystem::Utm { zone, .. } => {
                if !(1..=60).contains(&zone) {
                    return bad("the UTM zone", f64::from(zone), "1 to 60");
                }
                DVec2::ONE
            }
            CoordinateSystem::WebMercator => {
                let latitude = web_mercator_latitude(centre.y);
                if latitude.abs() > MAX_LATITUDE {
                    return bad("the latitude of the terrain's centre", latitude, "within +-89 degrees");
                }
                // One metre of the map is 1 / a radians of longitude and cos(latitude) / a radians of latitude.
                let per_degree = metres_per_degree(latitude);
                per_degree * DVec2::new(1.0, latitude.to_radians().cos()) * (1.0 / WGS84_A).to_degrees()
            }
            CoordinateSystem::Projected { metres_per_unit, .. } => {
                if !(1.0e-6..=1.0e6).contains(&metres_per_unit) {
                    return bad("the linear unit in metres", metres_per_unit, "1e-6 to 1e6");
                }
                DVec2::splat(metres_per_unit)
            }
            CoordinateSystem::Local => DVec2::ONE,
        };
        Ok(Self { system, centre, metres_per_unit })
    }

    /// The coordinate system of the file.
    pub fn system(&self) -> CoordinateSystem {
        self.system
    }

    /// File coordinates (x east, y north, in the file's units) of the local origin.
    pub fn centre(&self) -> DVec2 {
        self.centre
    }

    /// Metres per unit of the file's coordinates, east (x) and north (y), at the centre.
    pub fn metres_per_unit(&self) -> DVec2 {
        self.metres_per_unit
    }

    /// File coordinates (easting and northing, or longitude and latitude in degrees) to local metres (x: east,
    /// y: **south**, the local z). Longitudes may be given in either convention (-84 or 276). Not finite in, zero out.
    pub fn to_local(&self, x_file: f64, y_file: f64) -> DVec2 {
        let mut offset = DVec2::new(x_file, y_file) - self.centre;
        if self.system == CoordinateSystem::Geographic {
            offset.x -= 360.0 * (offset.x / 360.0).round();
        }
        let local = DVec2::new(offset.x, -offset.y) * self.metres_per_unit;
        if local.is_finite() { local } else { DVec2::ZERO }
    }

    /// Local metres (x east, z south) to file coordinates (x east, y north, in the file's units). Not finite in, the
    /// centre out.
    pub fn to_file(&self, x: f64, z: f64) -> DVec2 {
        let file = self.centre + DVec2::new(x, -z) / self.metres_per_unit;
        if file.is_finite() { file } else { self.centre }
    }

    /// Local metres (x: east, y: south) of a place on earth, in degrees of WGS84; `None` where the coordinate system does not
    /// say where it lies, or the place is far outside it. Longitudes may be given in either convention (-84 or 276).
    pub fn local_of(&self, longitude: f64, latitude: f64) -> Option<DVec2> {
        let file = SystemMap::new(self.system)?.coordinates_of(longitude, latitude)?;
        Some(self.to_local(file.x, file.y))
    }

    /// Latitude and longitude of the centre in degrees (north and east positive, longitude in -180..180), where the
    /// coordinate system tells.
    pub fn latitude_longitude(&self) -> Option<(f64, f64)> {
        SystemMap::new(self.system)?.to_earth(self.centre)
    }

    /// The angle from true north to the north of the file's coordinates at the centre, in degrees, clockwise positive: 0 to
    /// about 3 for UTM. `None` where the system does not say where it lies.
    pub fn grid_north(&self) -> Option<f64> {
        let map = SystemMap::new(self.system)?;
        let (latitude, longitude) = map.to_earth(self.centre)?;
        let step = 100.0 / self.metres_per_unit.y;
        let (north, east) = map.to_earth(self.centre + DVec2::new(0.0, step))?;
        let along = metres_per_degree(latitude) * DVec2::new(wrapped(east - longitude), north - latitude);
        let angle = along.x.atan2(along.y).to_degrees();
        angle.is_finite().then_some(angle)
    }
}

/// A coordinate system between its coordinates and places on earth.
pub struct SystemMap {
    system: CoordinateSystem,
    projection: Option<Box<Projection>>,
}

impl std::fmt::Debug for SystemMap {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("SystemMap").field(&self.system).finish()
    }
}

impl SystemMap {
    /// The map of a system; `None` if it does not say where on earth it lies.
    pub fn new(system: CoordinateSystem) -> Option<Self> {
        let projection = match system {
            CoordinateSystem::Projected { epsg, .. } => Some(Box::new(Projection::from_epsg(epsg?)?)),
            CoordinateSystem::Local => return None,
            _ => None,
        };
        Some(Self { system, projection })
    }

    /// Latitude and longitude in degrees (north and east positive, longitude in -180..180) of coordinates.
    pub fn to_earth(&self, point: DVec2) -> Option<(f64, f64)> {
        let (latitude, longitude) = match self.system {
            CoordinateSystem::Geographic => (point.y, point.x),
            CoordinateSystem::WebMercator => (web_mercator_latitude(point.y), (point.x / WGS84_A).to_degrees()),
            CoordinateSystem::Utm { zone, south } => utm_to_geographic(point, zone, south)?,
            CoordinateSystem::Projected { metres_per_unit, .. } => {
                self.projection.as_ref()?.to_earth(point, metres_per_unit)?
            }
            CoordinateSystem::Local => return None,
        };
        let wrapped = wrapped(longitude);
        (latitude.abs() <= 90.0 && wrapped.is_finite()).then_some((latitude, wrapped))
    }

    /// Coordinates (x east, y north, in the system's unit) of a place in degrees of WGS84; `None` for places far outside the
    /// system. Longitudes may be given in either convention (-84 or 276).
    pub fn coordinates_of(&self, longitude: f64, latitude: f64) -> Option<DVec2> {
        if !(longitude.is_finite() && latitude.abs() <= 90.0) {
            return None;
        }
        let point = match self.system {
            CoordinateSystem::Geographic => DVec2::new(longitude, latitude),
            CoordinateSystem::WebMercator => {
                DVec2::new(wrapped(longitude).to_radians(), latitude.to_radians().tan().asinh()) * WGS84_A
            }
            CoordinateSystem::Utm { zone, south } => geographic_to_utm(longitude, latitude, zone, south)?,
            CoordinateSystem::Projected { metres_per_unit, .. } => {
                self.projection.as_ref()?.coordinates_of(wrapped(longitude), latitude, metres_per_unit)?
            }
            CoordinateSystem::Local => return None,
        };
        point.is_finite().then_some(point)
    }
}

/// A longitude between -180 and 180 degrees.
fn wrapped(longitude: f64) -> f64 {
    longitude - 360.0 * ((longitude + 180.0) / 360.0).floor()
}

/// Metres per degree of longitude (x) and of latitude (y) on the WGS84 ellipsoid: the radii of curvature in the prime
/// vertical and in the meridian [Snyder 1987, "Map Projections", eq. 4-20 and 4-18].
fn metres_per_degree(latitude: f64) -> DVec2 {
    let e2 = WGS84_F * (2.0 - WGS84_F);
    let (sin, cos) = latitude.to_radians().sin_cos();
    let w2 = 1.0 - e2 * sin * sin;
    let prime_vertical = WGS84_A / w2.sqrt();
    let meridian = prime_vertical * (1.0 - e2) / w2;
    DVec2::new(prime_vertical * cos, meridian) * 1.0_f64.to_radians()
}

/// Inverse of the spherical Mercator projection, in degrees.
fn web_mercator_latitude(northing: f64) -> f64 {
    (northing / WGS84_A).sinh().atan().to_degrees()
}

/// Latitude and longitude in degrees of a point in a UTM zone: Krueger's series to the fourth order of the third
/// flattening, exact to less than a millimetre inside a zone [Karney 2011, "Transverse Mercator with an accuracy of a
/// few nanometers", eq. 11, 14, 36]. `None` for points that no zone contains.
fn utm_to_geographic(point: DVec2, zone: u8, south: bool) -> Option<(f64, f64)> {
    let easting = point.x - 500_000.0;
    let northing = point.y - if south { 10_000_000.0 } else { 0.0 };
    if easting.abs() > 1.5e6 || northing.abs() > 1.0e7 {
        return None;
    }
    let n = WGS84_F / (2.0 - WGS84_F);
    let (n2, n3, n4) = (n * n, n * n * n, n * n * n * n);
    let rectifying_radius = WGS84_A / (1.0 + n) * (1.0 + n2 / 4.0 + n4 / 64.0);
    let beta = [
        n / 2.0 - 2.0 / 3.0 * n2 + 37.0 / 96.0 * n3 - n4 / 360.0,
        n2 / 48.0 + n3 / 15.0 - 437.0 / 1440.0 * n4,
        17.0 / 480.0 * n3 - 37.0 / 840.0 * n4,
        4397.0 / 161_280.0 * n4,
    ];
    let delta = [
        2.0 * n - 2.0 / 3.0 * n2 - 2.0 * n3 + 116.0 / 45.0 * n4,
        7.0 / 3.0 * n2 - 8.0 / 5.0 * n3 - 227.0 / 45.0 * n4,
        56.0 / 15.0 * n3 - 136.0 / 35.0 * n4,
        4279.0 / 630.0 * n4,
    ];
    let xi = northing / (UTM_SCALE * rectifying_radius);
    let eta = easting / (UTM_SCALE * rectifying_radius);
    let (mut xi_prime, mut eta_prime) = (xi, eta);
    for (j, beta) in (1..).zip(beta) {
        let twice = 2.0 * f64::from(j);
        xi_prime -= beta * (twice * xi).sin() * (twice * eta).cosh();
        eta_prime -= beta * (twice * xi).cos() * (twice * eta).sinh();
    }
    let conformal = (xi_prime.sin() / eta_prime.cosh()).asin();
    let mut latitude = conformal;
    for (j, delta) in (1..).zip(delta) {
        latitude += delta * (2.0 * f64::from(j) * conformal).sin();
    }
    let longitude = eta_prime.sinh().atan2(xi_prime.cos()).to_degrees() + 6.0 * f64::from(zone) - 183.0;
    Some((latitude.to_degrees(), longitude))
}

/// Easting and northing of a place in a UTM zone, the inverse of [`utm_to_geographic`] [Karney 2011, eq. 7 to 10, 35].
/// `None` for places more than 40 degrees from the zone's meridian.
fn geographic_to_utm(longitude: f64, latitude: f64, zone: u8, south: bool) -> Option<DVec2> {
    let from_meridian = wrapped(longitude - (6.0 * f64::from(zone) - 183.0));
    if from_meridian.abs() > 40.0 {
        return None;
    }
    let n = WGS84_F / (2.0 - WGS84_F);
    let (n2, n3, n4) = (n * n, n * n * n, n * n * n * n);
    let rectifying_radius = WGS84_A / (1.0 + n) * (1.0 + n2 / 4.0 + n4 / 64.0);
    let alpha = [
        n / 2.0 - 2.0 / 3.0 * n2 + 5.0 / 16.0 * n3 + 41.0 / 180.0 * n4,
        13.0 / 48.0 * n2 - 3.0 / 5.0 * n3 + 557.0 / 1440.0 * n4,
        61.0 / 240.0 * n3 - 103.0 / 140.0 * n4,
        49_561.0 / 161_280.0 * n4,
    ];
    let eccentricity = (WGS84_F * (2.0 - WGS84_F)).sqrt();
    let tan = latitude.to_radians().tan();
    let sigma = (eccentricity * (eccentricity * tan / (1.0 + tan * tan).sqrt()).atanh()).sinh();
    let conformal = tan * (1.0 + sigma * sigma).sqrt() - sigma * (1.0 + tan * tan).sqrt();
    let (sin, cos) = from_meridian.to_radians().sin_cos();
    let xi_prime = conformal.atan2(cos);
    let eta_prime = (sin / (conformal * conformal + cos * cos).sqrt()).asinh();
    let (mut xi, mut eta) = (xi_prime, eta_prime);
    for (j, alpha) in (1..).zip(alpha) {
        let twice = 2.0 * f64::from(j);
        xi += alpha * (twice * xi_prime).sin() * (twice * eta_prime).cosh();
        eta += alpha * (twice * xi_prime).cos() * (twice * eta_prime).sinh();
    }
    let scale = UTM_SCALE * rectifying_radius;
    Some(DVec2::new(500_000.0 + scale * eta, scale * xi + if south { 10_000_000.0 } else { 0.0 }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn systems_are_written_as_they_are_read() -> Result<(), ron::Error> {
        use CoordinateSystem::{Geographic, Local, Projected, Utm, WebMercator};
        let feet = 0.3048;
        for system in [
            Geographic,
            Utm { zone: 33, south: true },
            WebMercator,
            Projected { epsg: Some(2056), metres_per_unit: 1.0 },
            Projected { epsg: None, metres_per_unit: feet },
            Local,
        ] {
            let text = ron::to_string(&system)?;
            assert_eq!(ron::from_str::<CoordinateSystem>(&text).map_err(|error| error.code)?, system, "{text}");
        }
        Ok(())
    }

    #[test]
    fn a_degree_has_its_published_length() {
        // Snyder 1987, table 6 gives WGS-like values; these are the WGS84 lengths at 0, 45 and 60 degrees.
        for (latitude, east, north) in
            [(0.0, 111_319.49, 110_574.28), (45.0, 78_846.81, 111_131.78), (60.0, 55_800.0, 111_412.27)]
        {
            let length = metres_per_degree(latitude);
            assert!((length.x - east).abs() < 1.0, "{latitude}: {length}");
            assert!((length.y - north).abs() < 1.0, "{latitude}: {length}");
        }
    }

    #[test]
    fn utm_finds_known_places() {
        // The CN Tower in Toronto (17T 630084 4833438) and the origin of a southern zone's central meridian.
        let tower =
            GeoReference::new(CoordinateSystem::Utm { zone: 17, south: false }, DVec2::new(630_084.0, 4_833_438.0));
        let (latitude, longitude) = tower.unwrap().latitude_longitude().unwrap();
        assert!((latitude - 43.642_567).abs() < 2e-5, "{latitude}");
        assert!((longitude + 79.387_139).abs() < 2e-5, "{longitude}");
        let equator = GeoReference::new(CoordinateSystem::Utm { zone: 31, south: true }, DVec2::new(500_000.0, 1.0e7));
        let (latitude, longitude) = equator.unwrap().latitude_longitude().unwrap();
        assert!(latitude.abs() < 1e-12 && (longitude - 3.0).abs() < 1e-12);
    }

    #[test]
    fn places_on_earth_are_found_in_every_system() {
        let tower = (-79.387_139, 43.642_567);
        let utm = geographic_to_utm(tower.0, tower.1, 17, false).unwrap();
        assert!((utm - DVec2::new(630_084.0, 4_833_438.0)).length() < 2.0, "{utm}");
        for (zone, south) in [(17, false), (33, true)] {
            for (east, north) in [(420_000.0, 5_100_000.0), (500_000.0, 8_000_000.0), (720_000.0, 7_000_000.0)] {
                let (latitude, longitude) = utm_to_geographic(DVec2::new(east, north), zone, south).unwrap();
                let back = geographic_to_utm(longitude, latitude, zone, south).unwrap();
                assert!((back - DVec2::new(east, north)).length() < 1e-3, "{back}");
            }
        }
        for (system, centre) in [
            (CoordinateSystem::Geographic, DVec2::new(tower.0, tower.1)),
            (CoordinateSystem::Utm { zone: 17, south: false }, utm),
            (CoordinateSystem::WebMercator, DVec2::new(-8_837_335.9, 5_410_875.9)),
        ] {
            let reference = GeoReference::new(system, centre).unwrap();
            let (latitude, longitude) = reference.latitude_longitude().unwrap();
            assert!(reference.local_of(longitude, latitude).unwrap().length() < 1e-3, "{system:?}");
            let north = reference.local_of(longitude, latitude + 0.001).unwrap();
            assert!((north.y + 111.1).abs() < 0.2 && north.x.abs() < 3.0, "{system:?}: {north}");
            assert_eq!(reference.local_of(f64::NAN, 0.0), None);
        }
        let local = GeoReference::new(CoordinateSystem::Local, DVec2::ZERO).unwrap();
        assert_eq!(local.local_of(8.0, 47.0), None);
    }

    #[test]
    fn grid_north_turns_away_from_the_meridian() {
        let north = |east: f64| {
            let utm = CoordinateSystem::Utm { zone: 33, south: false };
            GeoReference::new(utm, DVec2::new(east, 5_400_000.0)).unwrap().grid_north().unwrap()
        };
        assert!(north(500_000.0).abs() < 1e-6);
        // East of the meridian by 2.7 degrees, at 48.7 degrees north: 2.7 sin 48.7.
        assert!((north(700_000.0).abs() - 2.04).abs() < 0.05, "{}", north(700_000.0));
    }

    #[test]
    fn web_mercator_is_unstretched() {
        let northing = 6_378_137.0 * (std::f64::consts::FRAC_PI_4 + 30.0_f64.to_radians()).tan().ln();
        let reference = GeoReference::new(CoordinateSystem::WebMercator, DVec2::new(0.0, northing)).unwrap();
        let (latitude, _) = reference.latitude_longitude().unwrap();
        assert!((latitude - 60.0).abs() < 1e-9);
        assert!((reference.metres_per_unit().x - 0.5).abs() < 2e-3);
        assert!((reference.metres_per_unit().y - 0.5).abs() < 2e-3);
    }

    #[test]
    fn local_and_file_coordinates_are_inverse_and_z_points_south() {
        let reference = GeoReference::new(CoordinateSystem::Geographic, DVec2::new(276.0, 36.5)).unwrap();
        let north_east = reference.to_local(-83.99, 36.51);
        assert!(north_east.x > 890.0 && north_east.x < 900.0 && north_east.y < -1100.0);
        let back = reference.to_file(north_east.x, north_east.y);
        assert!((back - DVec2::new(276.01, 36.51)).length() < 1e-9);
        assert_eq!(reference.latitude_longitude().unwrap(), (36.5, -84.0));
        assert_eq!(reference.to_local(f64::NAN, 0.0), DVec2::ZERO);
    }

    #[test]
    fn impossible_places_are_refused() {
        assert!(GeoReference::new(CoordinateSystem::Geographic, DVec2::new(0.0, 89.5)).is_err());
        assert!(GeoReference::new(CoordinateSystem::Geographic, DVec2::new(f64::NAN, 0.0)).is_err());
        assert!(GeoReference::new(CoordinateSystem::Utm { zone: 61, south: false }, DVec2::ZERO).is_err());
        let odd = CoordinateSystem::Projected { epsg: None, metres_per_unit: 0.0 };
        assert!(GeoReference::new(odd, DVec2::ZERO).is_err());
        assert_eq!(CoordinateSystem::from_epsg(4978), None);
        assert_eq!(CoordinateSystem::from_epsg(32717), Some(CoordinateSystem::Utm { zone: 17, south: true }));
    }
}
