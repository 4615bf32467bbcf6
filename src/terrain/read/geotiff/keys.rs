//! The GeoKeys of a GeoTIFF, which define its coordinates and heights [OGC 19-008r4, 7.3 and annex B].

use tiff::decoder::Decoder;
use tiff::tags::Tag;

use super::super::{Source, side_files};
use super::overlay::Overlay;
use crate::terrain::{CoordinateSystem, SystemMap, TerrainError, Warning};

const MODEL_TYPE: u16 = 1024;
const RASTER_TYPE: u16 = 1025;
const GEODETIC_CRS: u16 = 2048;
const ANGULAR_UNITS: u16 = 2054;
const PROJECTED_CRS: u16 = 3072;
const PROJECTION: u16 = 3074;
const LINEAR_UNITS: u16 = 3076;
const LINEAR_UNIT_SIZE: u16 = 3077;
const VERTICAL_CRS: u16 = 4096;
const VERTICAL_UNITS: u16 = 4099;
/// The value of a key that is described by other keys.
const USER_DEFINED: u16 = 32767;

/// Linear units in use, with their length in metres [EPSG registry].
const UNITS: [(u16, f64); 6] =
    [(9001, 1.0), (9002, 0.3048), (9003, 1200.0 / 3937.0), (9005, 0.304_797_265_4), (9036, 1000.0), (9096, 0.9144)];

/// The content of the keys.
pub(super) struct GeoKeys {
    pub(super) system: CoordinateSystem,
    /// Whether the raster consists of points, not of cells.
    pub(super) point: bool,
    /// Metres per unit of the heights, if the keys state one.
    pub(super) metres_per_height_unit: Option<f64>,
    pub(super) warnings: Vec<Warning>,
}

impl GeoKeys {
    pub(super) fn read(source: &Source, decoder: &mut Decoder<Overlay>) -> Result<Self, TerrainError> {
        let directory: Vec<u16> = decoder
            .find_tag_unsigned_vec(Tag::GeoKeyDirectoryTag)
            .map_err(|error| source.malformed("GeoKeyDirectory", error, super::FETCH))?
            .unwrap_or_default();
        let doubles = decoder
            .find_tag(Tag::GeoDoubleParamsTag)
            .ok()
            .flatten()
            .and_then(|value| value.into_f64_vec().ok())
            .unwrap_or_default();
        Self::interpret(source, &Directory { entries: directory.get(4..).unwrap_or_default(), doubles: &doubles })
    }

    fn interpret(source: &Source, keys: &Directory) -> Result<Self, TerrainError> {
        let mut warnings = Vec::new();
        let system = match source.options.coordinate_system {
            Some(system) => system,
            None => match system_of(source, keys, &mut warnings) {
                Ok(system) => system,
                // The projection file beside it may know more.
                Err(error) => side_files::system(source).ok_or(error)?,
            },
        };
        if system == CoordinateSystem::Geographic
            && let Some(unit) = keys.short(ANGULAR_UNITS)
            && ![9102, 9122].contains(&unit)
        {
            return Err(source.unsupported(
                format!("the coordinates are angles in unit {unit}, not degrees"),
                "bring it to degrees: `gdalwarp -t_srs EPSG:4326 IN OUT.tif`",
            ));
        }
        let vertical = keys.short(VERTICAL_UNITS).filter(|unit| ![0, USER_DEFINED].contains(unit));
        let unit_of_heights = vertical.and_then(metres_of_unit);
        if let (Some(unit), None) = (vertical, unit_of_heights) {
            warnings.push(Warning::UnknownHeightUnit { unit: format!("EPSG unit {unit}") });
        }
        let unit_of_heights = unit_of_heights
            .or_else(|| keys.short(VERTICAL_CRS).and_then(metres_of_vertical_system))
            .or_else(|| system.metres_per_height_unit());
        Ok(Self {
            system,
            point: keys.short(RASTER_TYPE) == Some(2),
            metres_per_height_unit: unit_of_heights,
            warnings,
        })
    }
}

fn system_of(source: &Source, keys: &Directory, warnings: &mut Vec<Warning>) -> Result<CoordinateSystem, TerrainError> {
    let unknown =
        |problem: String| Err(TerrainError::UnknownCoordinateSystem { path: source.path.to_owned(), problem });
    match keys.short(MODEL_TYPE) {
        Some(2) => match keys.short(GEODETIC_CRS) {
            Some(4978) => unknown("it is geocentric".into()),
            _ => Ok(CoordinateSystem::Geographic),
        },
        Some(1) => projected_system(source, keys, warnings),
        Some(other) => unknown(format!("its GTModelType is {other}, neither projected nor geographic")),
        None if keys.short(PROJECTED_CRS).is_some() => projected_system(source, keys, warnings),
        None if keys.short(GEODETIC_CRS).is_some_and(|code| code != 4978) => Ok(CoordinateSystem::Geographic),
        None => unknown("the TIFF has no GeoKeys".into()),
    }
}

fn projected_system(
    source: &Source,
    keys: &Directory,
    warnings: &mut Vec<Warning>,
) -> Result<CoordinateSystem, TerrainError> {
    let code = keys.short(PROJECTED_CRS).filter(|code| ![0, USER_DEFINED].contains(code)).map(u32::from);
    let unit = match keys.short(LINEAR_UNITS) {
        Some(USER_DEFINED) => keys.double(LINEAR_UNIT_SIZE),
        Some(unit) => match metres_of_unit(unit) {
            Some(metres) => Some(metres),
            None => {
                return Err(source.unsupported(
                    format!("the coordinates are lengths in unit {unit}, which is not known here"),
                    "bring it to metres: `gdalwarp -t_srs EPSG:<a UTM zone> IN OUT.tif`",
                ));
            }
        },
        None => None,
    };
    let known = match (code, keys.short(PROJECTION)) {
        (Some(code), _) => CoordinateSystem::from_epsg(code),
        // A user-defined projected system that uses a UTM zone without changes.
        (None, Some(zone @ 16001..=16060)) => Some(CoordinateSystem::Utm { zone: (zone - 16000) as u8, south: false }),
        (None, Some(zone @ 16101..=16160)) => Some(CoordinateSystem::Utm { zone: (zone - 16100) as u8, south: true }),
        (None, _) => None,
    };
    // A system of the file's own may be spelt out beside it.
    if code.is_none()
        && known.is_none()
        && let Some(system @ (CoordinateSystem::Utm { .. } | CoordinateSystem::Projected { epsg: Some(_), .. })) =
            side_files::system(source)
    {
        return Ok(system);
    }
    match known {
        Some(system @ (CoordinateSystem::Utm { .. } | CoordinateSystem::WebMercator))
            if unit.is_none_or(|u| u == 1.0) =>
        {
            Ok(system)
        }
        // The code of a system in degrees where one in metres belongs.
        Some(CoordinateSystem::Geographic) => Ok(CoordinateSystem::Geographic),
        _ => {
            let known_unit = match known {
                Some(system @ CoordinateSystem::Projected { metres_per_unit, .. }) => {
                    (SystemMap::new(system).is_some() || metres_per_unit != 1.0).then_some(metres_per_unit)
                }
                _ => None,
            };
            if unit.or(known_unit).is_none() {
                warnings.push(Warning::AssumedMetres);
            }
            let system =
                CoordinateSystem::Projected { epsg: code, metres_per_unit: unit.or(known_unit).unwrap_or(1.0) };
            warnings.extend(Warning::place_unknown(system));
            Ok(system)
        }
    }
}

/// Metres per unit of the heights of a vertical system in feet [EPSG registry]; the others are in metres.
fn metres_of_vertical_system(code: u16) -> Option<f64> {
    match code {
        5702 | 6358 | 6359 | 6360 | 8052 | 8053 | 8058 => Some(1200.0 / 3937.0),
        5754 | 6130 | 6131 | 6132 | 8050 | 8051 | 8054 | 8228 => Some(0.3048),
        0 | USER_DEFINED => None,
        _ => Some(1.0),
    }
}

fn metres_of_unit(code: u16) -> Option<f64> {
    UNITS.iter().find(|(unit, _)| *unit == code).map(|(_, metres)| *metres)
}

/// The entries of the keys (key, tag of the value or 0, count, value or index) and the doubles that they refer to.
struct Directory<'a> {
    entries: &'a [u16],
    doubles: &'a [f64],
}

impl Directory<'_> {
    fn entry(&self, key: u16) -> Option<&[u16]> {
        self.entries.chunks_exact(4).find(|entry| entry[0] == key)
    }

    fn short(&self, key: u16) -> Option<u16> {
        self.entry(key).filter(|entry| entry[1] == 0).map(|entry| entry[3])
    }

    fn double(&self, key: u16) -> Option<f64> {
        let entry = self.entry(key).filter(|entry| entry[1] == Tag::GeoDoubleParamsTag.to_u16())?;
        self.doubles.get(usize::from(entry[3])).copied().filter(|value| value.is_finite())
    }
}
