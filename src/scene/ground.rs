//! The ground of a scene: a terrain file, a height image, fractal noise or a plane.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::check::Check;
use crate::terrain::{CoordinateSystem, Crop, ImageScale, Surroundings};

/// Where the ground comes from. In a scene file: `terrain: File(path: "...")`, `Image(...)`, `Noise(...)`, `Flat(...)`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub enum Ground {
    /// A terrain model with a coordinate system: GeoTIFF, ESRI ASCII grid or SRTM `.hgt`.
    File(GroundFile),
    /// A 16-bit greyscale PNG, whose scale the scene states.
    Image(GroundImage),
    /// Fractal noise.
    Noise(GroundNoise),
    /// A horizontal plane at height 0.
    Flat(GroundFlat),
}

/// A terrain file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundFile {
    /// The file, relative to the scene file. Required.
    pub path: PathBuf,
    /// Further files of the same raster, which lie on its grid: `path` and these are one terrain. Default: none. A virtual raster
    /// (`.vrt`) names its tiles itself.
    #[serde(default)]
    pub tiles: Vec<PathBuf>,
    /// The part to use, `(west: ..., south: ..., east: ..., north: ...)` in the file's own coordinates: degrees for
    /// geographic files, metres (or feet) for projected ones. Default: all of it.
    #[serde(default)]
    pub crop: Option<Crop>,
    /// The coordinate system of the file, which overrides the one in the file; ESRI ASCII grids have none.
    /// Default: the file's own.
    #[serde(default)]
    pub coordinates: Option<CoordinateSystem>,
    /// How the terrain continues beyond the file. Default `Mirror`.
    #[serde(default)]
    pub surroundings: Surroundings,
    /// Factor on the heights, 0.01 to 100. Default 1: as measured.
    #[serde(default = "one")]
    pub exaggeration: f64,
}

/// A greyscale height image; its top is north. It has no location on earth: `place` must state one.
///
/// Its values beside `path` are an [`ImageScale`], written without brackets of their own.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundImage {
    /// The PNG, relative to the scene file. Required.
    pub path: PathBuf,
    /// Distance between neighbouring pixels in metres, 0.01 to 10000. Required.
    pub spacing: f64,
    /// Height of black in metres, -12000 to 9000. Default 0.
    #[serde(default)]
    pub low: f64,
    /// Height of white in metres, -12000 to 9000, not below `low`. Required.
    pub high: f64,
}

/// Ground made of fractal noise. It has no location on earth: `place` must state one.
///
/// A scene gives the size in metres; [`NoiseTerrain`](crate::terrain::NoiseTerrain) has the number of samples instead,
/// which follows from size and spacing.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GroundNoise {
    /// Seed of the noise, any integer from 0 to 4294967295. Default 1.
    pub seed: u32,
    /// Edge of the square in metres, 20 to 100000. Default 1000.
    pub size: f64,
    /// Height of the highest hills above the mean in metres, 0 to 5000. Default 40.
    pub amplitude: f64,
    /// Size of the largest hills in metres, 1 to 100000. Default 400.
    pub wavelength: f64,
    /// Number of octaves, each of half the wavelength of the one before, 1 to 16. Default 7.
    pub octaves: u32,
    /// Height of each octave relative to the one before, 0.01 to 0.99. Higher: rougher. Default 0.45.
    pub roughness: f64,
    /// Mean height above the datum in metres, -12000 to 9000. Default 0.
    pub base: f64,
    /// Distance of the samples in metres, at least 1/8192 of `size` and at most a quarter of it. Default: 1/256 of
    /// `size`.
    pub spacing: Option<f64>,
    /// Sharp ridges instead of rounded hills. Default false.
    pub ridged: bool,
}

impl Default for GroundNoise {
    fn default() -> Self {
        Self {
            seed: 1,
            size: 1000.0,
            amplitude: 40.0,
            wavelength: 400.0,
            octaves: 7,
            roughness: 0.45,
            base: 0.0,
            spacing: None,
            ridged: false,
        }
    }
}

/// A horizontal plane at height 0. It has no place on earth: `place` must state one.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GroundFlat {
    /// Edge of the square in metres, 20 to 100000. Default 1000.
    pub size: f64,
}

impl Default for GroundFlat {
    fn default() -> Self {
        Self { size: 1000.0 }
    }
}

impl GroundFile {
    /// All of the terrain file `path`, as it is.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self {
            path: path.into(),
            tiles: Vec::new(),
            crop: None,
            coordinates: None,
            surroundings: Surroundings::default(),
            exaggeration: one(),
        }
    }

    /// All files, in the order of preference.
    pub fn files(&self) -> Vec<PathBuf> {
        std::iter::once(&self.path).chain(&self.tiles).cloned().collect()
    }
}

impl GroundImage {
    /// The greyscale image `path` with `spacing` metres between pixels; black is at 0 m, white at `high` metres.
    pub fn new(path: impl Into<PathBuf>, spacing: f64, high: f64) -> Self {
        Self { path: path.into(), spacing, low: 0.0, high }
    }

    /// Its metres, as the reader of images takes them.
    pub fn scale(&self) -> ImageScale {
        ImageScale { spacing: self.spacing, lowest: self.low, highest: self.high }
    }
}

impl From<GroundFile> for Ground {
    fn from(file: GroundFile) -> Self {
        Self::File(file)
    }
}

impl From<GroundImage> for Ground {
    fn from(image: GroundImage) -> Self {
        Self::Image(image)
    }
}

impl From<GroundNoise> for Ground {
    fn from(noise: GroundNoise) -> Self {
        Self::Noise(noise)
    }
}

impl From<GroundFlat> for Ground {
    fn from(flat: GroundFlat) -> Self {
        Self::Flat(flat)
    }
}

impl GroundNoise {
    /// Distance of the samples in metres, as stated or 1/256 of the size.
    pub fn spacing_m(&self) -> f64 {
        self.spacing.unwrap_or(self.size / 256.0)
    }
}

fn one() -> f64 {
    1.0
}

/// Heights on earth, in metres.
const HEIGHTS: std::ops::RangeInclusive<f64> = -12_000.0..=9_000.0;
/// Edges of made terrains, in metres.
const SIZES: std::ops::RangeInclusive<f64> = 20.0..=100_000.0;

impl Ground {
    /// Whether the source can say where on earth it lies: a file can, unless its coordinates are stated to be without
    /// a place.
    pub fn may_know_its_place(&self) -> bool {
        match self {
            Self::File(file) => !matches!(
                file.coordinates,
                Some(CoordinateSystem::Local | CoordinateSystem::Projected { epsg: None, .. })
            ),
            Self::Image(_) | Self::Noise(_) | Self::Flat(_) => false,
        }
    }

    pub(super) fn check(&self, check: &mut Check) {
        match self {
            Self::File(file) => file.check(check),
            Self::Image(image) => {
                check.path("terrain.path", &image.path);
                check.number("terrain.spacing", image.spacing, 0.01..=10_000.0, "m");
                let low = check.number("terrain.low", image.low, HEIGHTS, "m");
                let high = check.number("terrain.high", image.high, HEIGHTS, "m");
                if low && high && image.low > image.high {
                    check.problem(
                        "terrain.low",
                        format!("is {} m, above `high` ({} m)", image.low, image.high),
                        "black is the lowest ground: exchange the two",
                    );
                }
            }
            Self::Noise(noise) => {
                check.number("terrain.size", noise.size, SIZES, "m");
                check.number("terrain.amplitude", noise.amplitude, 0.0..=5_000.0, "m");
                check.number("terrain.wavelength", noise.wavelength, 1.0..=100_000.0, "m");
                check.count("terrain.octaves", noise.octaves, 1..=16);
                check.number("terrain.roughness", noise.roughness, 0.01..=0.99, "");
                check.number("terrain.base", noise.base, HEIGHTS, "m");
                if let Some(spacing) = noise.spacing.filter(|_| SIZES.contains(&noise.size)) {
                    check.number("terrain.spacing", spacing, noise.size / 8192.0..=noise.size / 4.0, "m");
                }
            }
            Self::Flat(flat) => {
                check.number("terrain.size", flat.size, SIZES, "m");
            }
        }
    }

    pub(super) fn resolve(&mut self, folder: &Path) {
        match self {
            Self::File(file) => {
                file.path = folder.join(&file.path);
                file.tiles.iter_mut().for_each(|tile| *tile = folder.join(&tile));
            }
            Self::Image(image) => image.path = folder.join(&image.path),
            Self::Noise(_) | Self::Flat(_) => {}
        }
    }
}

impl GroundFile {
    fn check(&self, check: &mut Check) {
        check.path("terrain.path", &self.path);
        for (number, tile) in self.tiles.iter().enumerate() {
            check.path(&format!("terrain.tiles[{number}]"), tile);
        }
        check.number("terrain.exaggeration", self.exaggeration, 0.01..=100.0, "");
        match self.coordinates {
            Some(CoordinateSystem::Utm { zone, .. }) => {
                check.count("terrain.coordinates.zone", u32::from(zone), 1..=60);
            }
            Some(CoordinateSystem::Projected { epsg, metres_per_unit }) => {
                check.number("terrain.coordinates.metres_per_unit", metres_per_unit, 1e-6..=1e6, "m");
                if let Some(code) = epsg {
                    check.count("terrain.coordinates", code, 1024..=32_767);
                }
            }
            Some(CoordinateSystem::Geographic | CoordinateSystem::WebMercator | CoordinateSystem::Local) | None => {}
        }
        let Some(crop) = self.crop else { return };
        // No wider limit than finite: projected coordinates may be anything, feet from a far origin included.
        let anything = f64::MIN..=f64::MAX;
        let mut finite = true;
        for (name, value) in [("west", crop.west), ("south", crop.south), ("east", crop.east), ("north", crop.north)] {
            finite &= check.number(&format!("terrain.crop.{name}"), value, anything.clone(), "");
        }
        if finite && crop.west >= crop.east {
            check.problem(
                "terrain.crop.west",
                format!("is {}, not west of `east` ({})", crop.west, crop.east),
                "eastward coordinates grow (western longitudes are negative): west must be below east",
            );
        }
        if finite && crop.south >= crop.north {
            check.problem(
                "terrain.crop.south",
                format!("is {}, not south of `north` ({})", crop.south, crop.north),
                "northward coordinates grow (southern latitudes are negative): south must be below north",
            );
        }
    }
}
