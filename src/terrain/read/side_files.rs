//! Files beside a raster: the world file (`.tfw`) with its place, and the projection (`.prj`) with its coordinate system.

use std::path::PathBuf;

use glam::DVec2;

use super::Source;
use crate::terrain::projection::{self, Kind};
use crate::terrain::{CoordinateSystem, TerrainError};

/// Largest side file that is read, in bytes.
const LARGEST: u64 = 64 << 10;
/// The deepest brackets of a definition that is parsed.
const DEEPEST: usize = 32;

/// The text of the first of these files that exists beside the raster.
fn text(source: &Source, endings: &[&str]) -> Option<(PathBuf, String)> {
    // Bytes in memory have no neighbours.
    if source.bytes.is_some() {
        return None;
    }
    let whole = source.path.as_os_str().to_owned();
    endings.iter().find_map(|ending| {
        let replaced = source.path.with_extension(ending);
        let mut appended = whole.clone();
        appended.push(".");
        appended.push(ending);
        [replaced, PathBuf::from(appended)].into_iter().filter(|path| path != source.path).find_map(|path| {
            let small = std::fs::metadata(&path).is_ok_and(|found| found.is_file() && found.len() <= LARGEST);
            let bytes = small.then(|| std::fs::read(&path).ok()).flatten()?;
            Some((path, String::from_utf8_lossy(&bytes).into_owned()))
        })
    })
}

/// Position of the north-western sample and the distance between samples (to the east, to the north: mostly negative) from a
/// world file: six numbers, of which the second and third are rotations. `None` where there is none.
///
/// # Errors
/// [`TerrainError::Unsupported`] for a world file that rotates the raster, or is no world file.
pub(super) fn world(source: &Source) -> Result<Option<(DVec2, DVec2)>, TerrainError> {
    const ENDINGS: [&str; 16] = [
        "tfw", "TFW", "tifw", "tiffw", "wld", "WLD", "pgw", "PGW", "pngw", "jgw", "JGW", "jpgw", "jpegw", "jpw", "wbw",
        "webpw",
    ];
    let Some((path, text)) = text(source, &ENDINGS) else { return Ok(None) };
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.replace(',', ".").parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[width, a, b, height, x, y]) if is_straight([width, a, b, height]) => {
            Ok(Some((DVec2::new(x, y), DVec2::new(width, height))))
        }
        Some([_, _, _, _, _, _]) => Err(source.unsupported(
            format!("the world file {} rotates the raster against its coordinates", path.display()),
            "turn it to the north: `gdalwarp IN OUT.tif`",
        )),
        _ => Err(source.unsupported(
            format!("the world file {} does not hold six numbers", path.display()),
            "correct it: width of a pixel, two zeros, minus its height, and x and y of the middle of the first one",
        )),
    }
}

/// Whether the rotation terms of a transformation are nothing but rounding.
pub(super) fn is_straight([width, a, b, height]: [f64; 4]) -> bool {
    a.abs() <= 1e-6 * width.abs() && b.abs() <= 1e-6 * height.abs()
}

/// The coordinate system that a `.prj` file states, if it is understood.
pub(super) fn system(source: &Source) -> Option<CoordinateSystem> {
    let stated = text(source, &["prj", "PRJ"]).and_then(|(_, text)| of_wkt(&text));
    stated.or_else(|| auxiliary(source).system)
}

/// What GDAL keeps of the first band in a file `.aux.xml` beside the raster.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Auxiliary {
    pub scale: Option<f64>,
    pub offset: Option<f64>,
    pub unit: Option<String>,
    pub missing: Option<f64>,
    pub system: Option<CoordinateSystem>,
    /// Origin (corner of the first pixel) and size of a pixel, to the east and to the north.
    pub place: Option<(DVec2, DVec2)>,
}

/// The auxiliary file of a raster.
pub(super) fn auxiliary(source: &Source) -> Auxiliary {
    text(source, &["aux.xml"]).map(|(_, text)| Auxiliary::parse(&text)).unwrap_or_default()
}

impl Auxiliary {
    fn parse(text: &str) -> Self {
        let element = |within: &str, name: &str| -> Option<String> {
            let start = within.find(&format!("<{name}"))?;
            let (_, rest) = within.get(start..)?.split_once('>')?;
            let value = rest.split(&format!("</{name}")).next()?.trim();
            let value = value.replace("&quot;", "\"").replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
            (!value.is_empty()).then_some(value)
        };
        let band = text.find("<PAMRasterBand").and_then(|at| text.get(at..)).unwrap_or("");
        let band = band.split("</PAMRasterBand").next().unwrap_or("");
        let number = |name: &str| element(band, name)?.parse::<f64>().ok();
        Self {
            scale: number("Scale").filter(|scale| scale.is_finite() && *scale != 0.0),
            offset: number("Offset").filter(|offset| offset.is_finite()),
            unit: element(band, "UnitType"),
            missing: number("NoDataValue"),
            system: element(text, "SRS").and_then(|wkt| of_wkt(&wkt)),
            place: element(text, "GeoTransform").and_then(|text| transform(&text)),
        }
    }
}

/// The six numbers in which GDAL keeps origin, pixel and rotation, where there is no rotation.
fn transform(text: &str) -> Option<(DVec2, DVec2)> {
    let numbers: Vec<f64> = text.split(',').map(|word| word.trim().parse().ok()).collect::<Option<_>>()?;
    match *numbers.as_slice() {
        [x, width, a, y, b, height] if is_straight([width, a, b, height]) => {
            Some((DVec2::new(x, y), DVec2::new(width, height)))
        }
        _ => None,
    }
}

/// The system of a text in WKT or in the words of PROJ.4.
pub(in crate::terrain) fn of_wkt(text: &str) -> Option<CoordinateSystem> {
    let text = text.trim();
    if text.starts_with("+proj") {
        return of_definition(text);
    }
    // The code of the system itself is the last authority.
    if let Some(code) = authority(text)
        && let Some(system) = CoordinateSystem::from_epsg(code)
    {
        return Some(system);
    }
    if text.contains("Mercator_Auxiliary_Sphere") || text.contains("Pseudo-Mercator") {
        return Some(CoordinateSystem::WebMercator);
    }
    // The parser descends into brackets without a limit of its own. Real definitions have some six levels.
    if text.len() as u64 > LARGEST || depth(text) > DEEPEST {
        return None;
    }
    of_definition(&proj4wkt::wkt_to_projstring(&with_known_methods(text)).ok()?)
}

/// How deep the brackets of a text are nested.
fn depth(text: &str) -> usize {
    let (mut depth, mut deepest) = (0usize, 0usize);
    for byte in text.bytes() {
        match byte {
            b'[' | b'(' => depth += 1,
            b']' | b')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        deepest = deepest.max(depth);
    }
    deepest
}

/// The text with the names of EPSG for the methods that ArcGIS names otherwise.
fn with_known_methods(text: &str) -> String {
    let two = text.to_ascii_lowercase().contains("standard_parallel_2");
    let conic = if two { "Lambert_Conformal_Conic_2SP\"" } else { "Lambert_Conformal_Conic_1SP\"" };
    text.replace("Lambert_Conformal_Conic\"", conic)
        .replace("Gauss_Kruger\"", "Transverse_Mercator\"")
        .replace("Double_Stereographic\"", "Oblique_Stereographic\"")
        .replace("\"Albers\"", "\"Albers_Conic_Equal_Area\"")
}

fn of_definition(text: &str) -> Option<CoordinateSystem> {
    Some(match projection::kind_of_definition(text)? {
        Kind::Geographic => CoordinateSystem::Geographic,
        Kind::Geocentric => return None,
        Kind::Utm { zone, south } => CoordinateSystem::Utm { zone, south },
        Kind::Projected { metres_per_unit } => {
            CoordinateSystem::Projected { epsg: projection::code_of(text), metres_per_unit }
        }
    })
}

/// The EPSG code at the end of a WKT: `AUTHORITY["EPSG","2154"]]` or `ID["EPSG",2154]]`.
fn authority(text: &str) -> Option<u32> {
    let end = text.trim_end_matches(|c: char| c == ']' || c.is_whitespace());
    let start = end.rfind("AUTHORITY[").max(end.rfind("ID["))?;
    let inside = end.get(start..)?;
    // Nothing but the code may follow.
    let code = inside.to_ascii_uppercase();
    if !code.contains("\"EPSG\"") || inside.matches('[').count() != 1 {
        return None;
    }
    code.rsplit(',').next()?.trim().trim_matches('"').parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parser of definitions once descended until the stack was used up.
    #[test]
    fn deep_brackets_are_no_system() {
        for open in ["A[", "PROJCS[\"a\",", "A("] {
            assert_eq!(of_wkt(&open.repeat(30_000)), None);
        }
    }

    #[test]
    fn systems_are_read_from_wkt() {
        let esri_utm = "PROJCS[\"WGS_1984_UTM_Zone_33N\",GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",\
                        6378137.0,298.257223563]],PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]],\
                        PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"False_Easting\",500000.0],PARAMETER[\
                        \"False_Northing\",0.0],PARAMETER[\"Central_Meridian\",15.0],PARAMETER[\"Scale_Factor\",0.9996],\
                        PARAMETER[\"Latitude_Of_Origin\",0.0],UNIT[\"Meter\",1.0]]";
        assert_eq!(of_wkt(esri_utm), Some(CoordinateSystem::Utm { zone: 33, south: false }));
        let lambert = "PROJCS[\"RGF_1993_Lambert_93\",GEOGCS[\"GCS_RGF_1993\",DATUM[\"D_RGF_1993\",SPHEROID[\"GRS_1980\",\
                       6378137.0,298.257222101]],PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]],PROJECTION[\
                       \"Lambert_Conformal_Conic\"],PARAMETER[\"False_Easting\",700000.0],PARAMETER[\"False_Northing\",\
                       6600000.0],PARAMETER[\"Central_Meridian\",3.0],PARAMETER[\"Standard_Parallel_1\",49.0],PARAMETER[\
                       \"Standard_Parallel_2\",44.0],PARAMETER[\"Latitude_Of_Origin\",46.5],UNIT[\"Meter\",1.0]]";
        assert_eq!(of_wkt(lambert), Some(CoordinateSystem::Projected { epsg: Some(2154), metres_per_unit: 1.0 }));
        let geographic = "GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137,298.257223563]],PRIMEM[\
                          \"Greenwich\",0],UNIT[\"Degree\",0.017453292519943295]]";
        assert_eq!(of_wkt(geographic), Some(CoordinateSystem::Geographic));
        let stated = "PROJCS[\"ETRS89 / UTM zone 32N\",GEOGCS[\"ETRS89\",AUTHORITY[\"EPSG\",\"4258\"]],AUTHORITY[\"EPSG\",\"25832\"]]";
        assert_eq!(of_wkt(stated), Some(CoordinateSystem::Utm { zone: 32, south: false }));
        assert_eq!(
            of_wkt("PROJCRS[\"x\",ID[\"EPSG\",2154]]")
                .map(|system| matches!(system, CoordinateSystem::Projected { epsg: Some(2154), .. })),
            Some(true)
        );
        assert_eq!(of_wkt("nothing"), None);
    }

    #[test]
    fn auxiliary_files_of_gdal_are_read() {
        let text = "<PAMDataset>\n<SRS dataAxisToSRSAxisMapping=\"1,2\">PROJCS[&quot;x&quot;,AUTHORITY[&quot;EPSG&quot;,\
                    &quot;25832&quot;]]</SRS><GeoTransform> 5.0e+05, 0.5, 0, 5.5e+06, 0,-0.5</GeoTransform><PAMRasterBand band=\"1\"><NoDataValue le_hex_endian=\"0\">-9.99900000000000E+03\
                    </NoDataValue><UnitType>ft</UnitType><Offset>5</Offset><Scale>0.5</Scale></PAMRasterBand></PAMDataset>";
        let expected = Auxiliary {
            scale: Some(0.5),
            offset: Some(5.0),
            unit: Some("ft".to_owned()),
            missing: Some(-9999.0),
            system: Some(CoordinateSystem::Utm { zone: 32, south: false }),
            place: Some((DVec2::new(500_000.0, 5.5e6), DVec2::new(0.5, -0.5))),
        };
        assert_eq!(Auxiliary::parse(text), expected);
        assert_eq!(Auxiliary::parse("<PAMDataset><PAMRasterBand"), Auxiliary::default());
    }

    #[test]
    fn rounding_is_no_rotation() {
        assert!(is_straight([10.0, 1e-16, -3e-9, -10.0]));
        assert!(!is_straight([10.0, 0.1, 0.1, -10.0]));
    }
}
