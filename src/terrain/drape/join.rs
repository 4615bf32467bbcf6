//! Photographs brought to the frame of a terrain.

use std::path::{Path, PathBuf};

use glam::{DVec2, Vec4};
use rayon::prelude::*;

use super::{Drape, MOST_SIDE, encode};
use crate::math::color::LINEAR_OF_CODE;
use crate::terrain::read::photo::{Photo, Pixels};
use crate::terrain::{CoordinateSystem, GeoReference, Surroundings, SystemMap, Terrain, TerrainError, Warning};

/// Texels between the nodes at which coordinates are computed; between them they are interpolated.
const NODE_DISTANCE: usize = 64;
/// Points along a side of the terrain, or of the photograph, by which the one is found in the other.
const BORDER_POINTS: usize = 17;
/// The finest texel, metres.
const FINEST: f64 = 0.002;

/// Reads a photograph, or several tiles of one, for a terrain. Where two tiles overlap, the first that is not transparent counts.
/// `coordinates` replaces the coordinate system of the files.
///
/// Only what lies on the terrain is kept, in the resolution of the finest tile, or in the best that [`MOST_SIDE`] allows.
///
/// # Errors
/// [`TerrainError`]: a file that cannot be read; [`TerrainError::PhotoOutside`] if none of them reaches the terrain.
pub fn read_drape(
    paths: &[PathBuf],
    coordinates: Option<CoordinateSystem>,
    terrain: &Terrain,
) -> Result<(Drape, Vec<Warning>), TerrainError> {
    let photos = paths.iter().map(|path| Photo::open(path, coordinates)).collect::<Result<_, _>>()?;
    join(photos, terrain)
}

/// As [`read_drape`], of the bytes of one file; `name` is its name in messages.
///
/// # Errors
/// Those of [`read_drape`].
pub fn read_drape_bytes(
    bytes: Vec<u8>,
    name: &Path,
    coordinates: Option<CoordinateSystem>,
    terrain: &Terrain,
) -> Result<(Drape, Vec<Warning>), TerrainError> {
    join(vec![Photo::of_bytes(bytes, name, coordinates)?], terrain)
}

fn join(photos: Vec<Photo>, terrain: &Terrain) -> Result<(Drape, Vec<Warning>), TerrainError> {
    let mut warnings = Vec::new();
    let mut placed = Vec::new();
    let mut outside = None;
    for photo in photos {
        let path = photo.path.clone();
        match Placed::new(photo, terrain, &mut warnings)? {
            Ok(photo) => placed.push(photo),
            Err(error) => {
                outside = Some(error);
                warnings.push(Warning::PhotoTileUnused { path });
            }
        }
    }
    let Some(first) = placed.first() else {
        let none = TerrainError::BadParameter { name: "the number of photographs", value: 0.0, range: "at least 1" };
        return Err(outside.unwrap_or(none));
    };
    let target = Target::new(first, &placed);
    let finest = placed.iter().map(|photo| photo.pixel).fold(DVec2::INFINITY, DVec2::min);
    if target.factor > 1 {
        warnings.push(Warning::PhotoReduced { drawn: target.texel.max_element(), own: finest.max_element() });
    }
    let mut texels = vec![0; 4 * target.columns * target.rows];
    for photo in &placed {
        photo.draw(&target, &mut texels)?;
    }
    let half = 0.5 * terrain.extent();
    let covers = |low: DVec2, high: DVec2| {
        (low + half).max_element() <= 1.5 * target.texel.max_element()
            && (half - high).max_element() <= 1.5 * target.texel.max_element()
    };
    let end = target.min + target.extent();
    let mirrored = terrain.surroundings() == Surroundings::Mirror && covers(target.min, end);
    let drape = Drape::new(target.min, target.extent(), target.columns as u32, target.rows as u32, texels, mirrored);
    drape.map(|drape| (drape, warnings)).ok_or(TerrainError::TooSmall { columns: target.columns, rows: target.rows })
}

/// The rectangle of a drape in metres (x east, z south), and its texels.
struct Target {
    min: DVec2,
    texel: DVec2,
    columns: usize,
    rows: usize,
    /// How many pixels of the finest photograph a texel is wide.
    factor: usize,
}

impl Target {
    fn new(first: &Placed, placed: &[Placed]) -> Self {
        let mut texel =
            placed.iter().map(|photo| photo.pixel).fold(DVec2::INFINITY, DVec2::min).max(DVec2::splat(FINEST));
        let (min, max) = placed
            .iter()
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(min, max), photo| (min.min(photo.min), max.max(photo.max)));
        // On the pixels of the first photograph, where these lie straight: they are then drawn as they are.
        let lattice = first.way.local_of(&first.photo, DVec2::ZERO).unwrap_or(min);
        let min = lattice + ((min - lattice) / texel + 1e-4).floor() * texel;
        let size = (max - min) / texel;
        let factor = (size.max_element() / f64::from(MOST_SIDE) - 1e-6).ceil().max(1.0);
        texel *= factor;
        let [columns, rows] =
            [size.x, size.y].map(|size| ((size / factor - 1e-4).ceil() as usize).clamp(1, MOST_SIDE as usize));
        Self { min, texel, columns, rows, factor: factor as usize }
    }

    fn extent(&self) -> DVec2 {
        self.texel * DVec2::new(self.columns as f64, self.rows as f64)
    }

    /// Metres of a corner of texels.
    fn corner(&self, column: usize, row: usize) -> DVec2 {
        self.min + DVec2::new(column as f64, row as f64) * self.texel
    }
}

/// From the metres of a terrain to the coordinates of a photograph, and back.
enum Way {
    /// The photograph covers the whole terrain, which measures this many metres.
    Whole { extent: DVec2 },
    /// Both have the same coordinate system.
    Direct(GeoReference),
    /// They have different ones.
    Across { reference: GeoReference, terrain: SystemMap, photo: SystemMap },
}

impl Way {
    fn pixel_of(&self, photo: &Photo, local: DVec2) -> Option<DVec2> {
        let point = match self {
            Self::Whole { extent } => {
                return Some((local / *extent + 0.5) * photo.size());
            }
            Self::Direct(reference) => reference.to_file(local.x, local.y),
            Self::Across { reference, terrain, photo } => {
                let (latitude, longitude) = terrain.to_earth(reference.to_file(local.x, local.y))?;
                photo.coordinates_of(longitude, latitude)?
            }
        };
        photo.pixel_of(point)
    }

    fn local_of(&self, photo: &Photo, pixel: DVec2) -> Option<DVec2> {
        if let Self::Whole { extent } = self {
            return Some((pixel / photo.size() - 0.5) * *extent);
        }
        let point = photo.point_of(pixel)?;
        match self {
            Self::Across { reference, terrain, photo } => {
                let (latitude, longitude) = photo.to_earth(point)?;
                let file = terrain.coordinates_of(longitude, latitude)?;
                Some(reference.to_local(file.x, file.y))
            }
            Self::Direct(reference) => Some(reference.to_local(point.x, point.y)),
            Self::Whole { .. } => None,
        }
    }
}

/// A photograph and where it lies on the terrain.
struct Placed {
    photo: Photo,
    way: Way,
    /// The rectangle that it covers of the terrain, metres.
    min: DVec2,
    max: DVec2,
    /// Metres of a pixel.
    pixel: DVec2,
}

/// Points of a rectangle: a grid over it, border included.
fn points(min: DVec2, max: DVec2) -> impl Iterator<Item = DVec2> {
    let along = move |i: usize| i as f64 / (BORDER_POINTS - 1) as f64;
    (0..BORDER_POINTS * BORDER_POINTS)
        .map(move |i| min + DVec2::new(along(i % BORDER_POINTS), along(i / BORDER_POINTS)) * (max - min))
}

/// The least rectangle around points; `None` without any.
fn bounds(points: impl Iterator<Item = DVec2>) -> Option<(DVec2, DVec2)> {
    points.fold(None, |bounds, point| {
        let (min, max) = bounds.unwrap_or((point, point));
        Some((min.min(point), max.max(point)))
    })
}

impl Placed {
    /// Finds the place of a photograph; the inner error if it does not reach the terrain.
    fn new(
        photo: Photo,
        terrain: &Terrain,
        warnings: &mut Vec<Warning>,
    ) -> Result<Result<Self, TerrainError>, TerrainError> {
        let half = 0.5 * terrain.extent();
        let way = way(&photo, terrain, warnings)?;
        let size = photo.size();
        let on_photo = bounds(points(-half, half).filter_map(|local| way.pixel_of(&photo, local)));
        let window = on_photo.map(|(low, high)| (low.max(DVec2::ZERO), high.min(size)));
        let Some((low, high)) = window.filter(|(low, high)| (*high - *low).min_element() > 1e-3) else {
            return Ok(Err(outside(&photo, &way)));
        };
        let around = bounds(points(low, high).filter_map(|pixel| way.local_of(&photo, pixel)));
        let middle = 0.5 * (low + high);
        let step = |offset: DVec2| {
            let (a, b) = (way.local_of(&photo, middle)?, way.local_of(&photo, middle + offset)?);
            Some(a.distance(b)).filter(|metres| metres.is_finite() && *metres > 0.0)
        };
        let (Some((min, max)), Some(width), Some(depth)) = (around, step(DVec2::X), step(DVec2::Y)) else {
            return Ok(Err(outside(&photo, &way)));
        };
        let (min, max) = (min.max(-half), max.min(half));
        Ok(Ok(Self { min, max, pixel: DVec2::new(width, depth), photo, way }))
    }

    /// Draws it under what `texels` hold.
    fn draw(&self, target: &Target, texels: &mut [u8]) -> Result<(), TerrainError> {
        let low = ((self.min - target.min) / target.texel + 1e-4).floor().max(DVec2::ZERO);
        let high = ((self.max - target.min) / target.texel - 1e-4).ceil();
        let [left, top] = [low.x, low.y].map(|value| value as usize);
        let (right, bottom) =
            ((high.x.max(0.0) as usize).min(target.columns), (high.y.max(0.0) as usize).min(target.rows));
        if left >= right || top >= bottom {
            return Ok(());
        }
        let nodes = Nodes::new(self, target, [left, top], [right, bottom]);
        let size = self.photo.size();
        let Some((low, high)) = bounds(nodes.pixels.iter().copied().filter(|pixel| pixel.is_finite())) else {
            return Ok(());
        };
        let (low, high) = ((low.floor() - 2.0).max(DVec2::ZERO), (high.ceil() + 2.0).min(size));
        if (high - low).min_element() < 1.0 {
            return Ok(());
        }
        // As many pixels as fit into a texel become one before they are looked up.
        let factor = (target.texel / self.pixel + 1e-3).floor().min_element().max(1.0) as usize;
        let origin = [low.x as usize, low.y as usize];
        let pixels = self.photo.pixels(origin, [(high.x - low.x) as usize, (high.y - low.y) as usize], factor)?;
        let row_bytes = 4 * target.columns;
        texels.par_chunks_exact_mut(row_bytes).enumerate().skip(top).take(bottom - top).for_each(|(row, texels)| {
            for column in left..right {
                let texel = &mut texels[4 * column..4 * column + 4];
                if texel[3] == 255 {
                    continue;
                }
                let at = (nodes.at(column, row) - low) / factor as f64;
                under(texel, &pixels, at);
            }
        });
        Ok(())
    }
}

/// Positions in a photograph, in pixels, at some corners of a target's texels.
struct Nodes {
    first: [usize; 2],
    columns: usize,
    pixels: Vec<DVec2>,
}

impl Nodes {
    fn new(placed: &Placed, target: &Target, first: [usize; 2], end: [usize; 2]) -> Self {
        let count = |axis: usize| (end[axis] - first[axis]).div_ceil(NODE_DISTANCE) + 1;
        let (columns, rows) = (count(0), count(1));
        let node = |index: usize| {
            let (column, row) = (index % columns, index / columns);
            let local = target.corner(first[0] + column * NODE_DISTANCE, first[1] + row * NODE_DISTANCE);
            placed.way.pixel_of(&placed.photo, local).unwrap_or(DVec2::NAN)
        };
        Self { first, columns, pixels: (0..columns * rows).map(node).collect() }
    }

    /// The position of the middle of a texel.
    fn at(&self, column: usize, row: usize) -> DVec2 {
        let (x, y) = (column - self.first[0], row - self.first[1]);
        let (i, j) = (x / NODE_DISTANCE, y / NODE_DISTANCE);
        let along = |value: usize| ((value % NODE_DISTANCE) as f64 + 0.5) / NODE_DISTANCE as f64;
        let (fx, fy) = (along(x), along(y));
        let node = |i: usize, j: usize| self.pixels[j * self.columns + i];
        let north = node(i, j).lerp(node(i + 1, j), fx);
        north.lerp(node(i, j + 1).lerp(node(i + 1, j + 1), fx), fy)
    }
}

/// Draws the pixels at a position, bilinear, under a texel.
fn under(texel: &mut [u8], pixels: &Pixels, at: DVec2) {
    let size = DVec2::new(pixels.columns as f64, pixels.rows as f64);
    if !(at.is_finite() && at.min_element() >= 0.0 && (size - at).min_element() >= 0.0) {
        return;
    }
    let at = at - 0.5;
    let nearest = at.round();
    let code = |place: DVec2| {
        let place = place.clamp(DVec2::ZERO, size - 1.0);
        pixels.texels[place.y as usize * pixels.columns + place.x as usize]
    };
    if at.abs_diff_eq(nearest, 0.01) && texel[3] == 0 && code(nearest)[3] == 255 {
        texel.copy_from_slice(&code(nearest));
        return;
    }
    let corner = at.floor();
    let f = (at - corner).as_vec2();
    let color = |dx: f64, dy: f64| {
        let [r, g, b, a] = code(corner + DVec2::new(dx, dy));
        let opacity = f32::from(a) / 255.0;
        Vec4::new(LINEAR_OF_CODE[usize::from(r)], LINEAR_OF_CODE[usize::from(g)], LINEAR_OF_CODE[usize::from(b)], 1.0)
            * opacity
    };
    let north = color(0.0, 0.0).lerp(color(1.0, 0.0), f.x);
    let found = north.lerp(color(0.0, 1.0).lerp(color(1.0, 1.0), f.x), f.y);
    let over = super::linear(texel);
    let sum = over + (1.0 - over.w) * found;
    texel.copy_from_slice(&encode(sum.truncate(), sum.w));
}

/// How a photograph and a terrain are related.
fn way(photo: &Photo, terrain: &Terrain, warnings: &mut Vec<Warning>) -> Result<Way, TerrainError> {
    let path = || photo.path.clone();
    let reference = terrain.reference().cloned().filter(|reference| reference.system() != CoordinateSystem::Local);
    let stated = photo.description.system;
    // Local coordinates of both are taken as the same.
    let local = terrain.reference().filter(|_| matches!(stated, None | Some(CoordinateSystem::Local)));
    let (Some(reference), true) = (reference.or(local.cloned()), photo.has_place()) else {
        warnings.push(Warning::PhotoStretched { path: path(), has_place: photo.has_place() });
        return Ok(Way::Whole { extent: terrain.extent() });
    };
    let Some(system) = stated else {
        warnings.push(Warning::PhotoSystemAssumed { path: path() });
        return Ok(Way::Direct(reference));
    };
    if system == reference.system() {
        return Ok(Way::Direct(reference));
    }
    match (SystemMap::new(reference.system()), SystemMap::new(system)) {
        (Some(terrain), Some(photo)) => Ok(Way::Across { reference, terrain, photo }),
        (known, _) => Err(TerrainError::Unsupported {
            path: path(),
            problem: format!(
                "the photograph has other coordinates than the terrain, and it is not known where on earth those of the {} lie",
                if known.is_none() { "terrain" } else { "photograph" }
            ),
            remedy: "bring it to those of the terrain: `gdalwarp -t_srs <system of the terrain> IN OUT.tif`".to_owned(),
        }),
    }
}

/// The error of a photograph that does not reach the terrain.
fn outside(photo: &Photo, way: &Way) -> TerrainError {
    let point = |pixel: DVec2| photo.point_of(pixel).unwrap_or(DVec2::NAN);
    let (north_west, south_east) = (point(DVec2::ZERO), point(photo.size()));
    let centre = way.pixel_of(photo, DVec2::ZERO).map_or(DVec2::NAN, point);
    TerrainError::PhotoOutside {
        path: photo.path.clone(),
        west: north_west.x,
        south: south_east.y,
        east: south_east.x,
        north: north_west.y,
        centre_x: centre.x,
        centre_y: centre.y,
    }
}
