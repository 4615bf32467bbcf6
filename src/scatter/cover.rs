//! Canopy cover as a map: the fraction of the ground under crowns. It darkens the forest floor where trees are too far
//! away to be drawn.

use std::ops::Range;

use glam::DVec2;
use rayon::prelude::*;

use super::ScatterError;
use super::packed::{PackedStand, PlantSize, check_bounds};
use super::stand::{Area, MAX_SCALE, MIN_SCALE, Stand, XzPlane};

/// Maximum number of texels of a map: 64 MiB.
const MAX_TEXELS: f64 = (1u64 << 26) as f64;

/// Smallest texel, metres. It limits the work for one crown.
const MIN_TEXEL_M: f64 = 0.01;

/// Rows that one task fills.
const BAND: usize = 16;

/// Fraction of the ground under crowns. Row 0 is the northernmost (smallest Z); columns run east.
#[derive(Clone, Debug, PartialEq)]
pub struct CoverMap {
    /// X and Z of the north-west corner, metres.
    pub origin: DVec2,
    /// Side of a texel, metres.
    pub texel: f64,
    /// Texels in a row.
    pub columns: u32,
    /// Number of rows.
    pub rows: u32,
    /// Texels row by row: 0 is open ground, 255 is closed canopy.
    pub cover: Vec<u8>,
}

impl CoverMap {
    /// The map without trees.
    fn empty(texel: f64) -> Self {
        Self { origin: DVec2::ZERO, texel, columns: 0, rows: 0, cover: Vec::new() }
    }

    /// Fraction of the ground under crowns at a point (X, Z), 0 to 1: the value of the texel that contains it. It is 0
    /// outside the map, and where `cover` is too short.
    pub fn at(&self, point: DVec2) -> f32 {
        let location = ((point - self.origin) / self.texel).floor();
        let inside = |value: f64, count: u32| (0.0..f64::from(count)).contains(&value).then_some(value as usize);
        match (inside(location.x, self.columns), inside(location.y, self.rows)) {
            (Some(column), Some(row)) => {
                let texel = self.cover.get(row * self.columns as usize + column);
                f32::from(texel.copied().unwrap_or_default()) / 255.0
            }
            _ => 0.0,
        }
    }
}

impl CoverMap {
    /// Fraction of the ground under crowns around a point (X, Z), 0 to 1, interpolated between the texels' middles; 0
    /// outside the map.
    pub fn smooth_at(&self, point: DVec2) -> f32 {
        let at = (point - self.origin) / self.texel - 0.5;
        let low = at.floor();
        let f = (at - low).as_vec2();
        let texel = |x: f64, z: f64| self.at(self.origin + (low + DVec2::new(x + 0.5, z + 0.5)) * self.texel);
        let row = |z: f64| texel(0.0, z) * (1.0 - f.x) + texel(1.0, z) * f.x;
        let value = row(0.0) * (1.0 - f.y) + row(1.0) * f.y;
        if value.is_finite() { value } else { 0.0 }
    }

    /// The map, blurred with the weights 1, 2, 1 along both axes and enlarged by a border of one texel, because the
    /// light of a point does not end at the edge of a texel.
    pub fn smoothed(&self) -> Self {
        let (columns, rows) = (self.columns as usize, self.rows as usize);
        if self.cover.len() != columns * rows || self.cover.is_empty() {
            return self.clone();
        }
        let value = |column: Option<usize>, row: Option<usize>| match (column, row) {
            (Some(column), Some(row)) if column < columns && row < rows => {
                u32::from(self.cover[row * columns + column])
            }
            _ => 0,
        };
        // Texel `at` of the larger map averages the texels at - 2, at - 1 and at of this one.
        let taps = |at: usize| [(at.checked_sub(2), 1), (at.checked_sub(1), 2), (Some(at), 1)];
        let sum = |column: usize, row: usize| -> u32 {
            let weighted =
                |(r, wr): (Option<usize>, u32)| taps(column).map(|(c, wc)| wr * wc * value(c, r)).iter().sum::<u32>();
            taps(row).map(weighted).iter().sum()
        };
        let is_open = |row: Option<usize>| {
            let line = row.and_then(|row| self.cover.get(row * columns..(row + 1) * columns));
            line.is_none_or(|line| line.iter().all(|value| *value == 0))
        };
        let mut cover = vec![0; (columns + 2) * (rows + 2)];
        cover.par_chunks_mut(columns + 2).enumerate().for_each(|(row, line)| {
            // Few rows of a large map have trees.
            if !taps(row).iter().all(|(row, _)| is_open(*row)) {
                line.iter_mut().enumerate().for_each(|(column, to)| *to = ((sum(column, row) + 8) / 16) as u8);
            }
        });
        Self {
            origin: self.origin - self.texel,
            texel: self.texel,
            columns: self.columns + 2,
            rows: self.rows + 2,
            cover,
        }
    }
}

impl CoverMap {
    /// The map with texels of `times` the size (1 or more), each the mean of those below it. They begin at multiples of
    /// their size, as those of [`cover_map`] do.
    pub fn coarsened(&self, times: u32) -> Self {
        if times <= 1 || self.cover.is_empty() {
            return self.clone();
        }
        let texel = self.texel * f64::from(times);
        let origin = (self.origin / texel).floor() * texel;
        let first = ((self.origin - origin) / self.texel).round();
        let (left, top, times) = (first.x as usize, first.y as usize, times as usize);
        let columns = (self.columns as usize + left).div_ceil(times);
        let rows = (self.rows as usize + top).div_ceil(times);
        let mut sums = vec![0u32; columns * rows];
        for (row, line) in self.cover.chunks_exact(self.columns as usize).enumerate() {
            let start = (row + top) / times * columns;
            for (column, value) in line.iter().enumerate() {
                sums[start + (column + left) / times] += u32::from(*value);
            }
        }
        let area = (times * times) as f64;
        let cover = sums.iter().map(|sum| (f64::from(*sum) / area).round() as u8).collect();
        Self { origin, texel, columns: columns as u32, rows: rows as u32, cover }
    }

    /// The map blurred by a pyramid-shaped kernel that falls to 0 at `radius` metres along either axis, with texels of
    /// the same size. The cover outside the map counts as 0, and the result is larger than the map by the kernel. It
    /// takes a few milliseconds for a million texels.
    pub fn widened(&self, radius: f64) -> Self {
        let (columns, rows) = (self.columns as usize, self.rows as usize);
        let half = (0.5 * radius / self.texel).round();
        // Two box filters of `2 half + 1` texels make a pyramid.
        if self.cover.len() != columns * rows || self.cover.is_empty() || !(1.0..1024.0).contains(&half) {
            return self.clone();
        }
        let half = half as usize;
        let border = 2 * half;
        let (width, height) = (columns + 2 * border, rows + 2 * border);
        let mut out = vec![0.0f32; width * height];
        out.par_chunks_mut(width).enumerate().for_each(|(row, line)| {
            let Some(row) = row.checked_sub(border).filter(|row| *row < rows) else { return };
            let from = &self.cover[row * columns..(row + 1) * columns];
            line[border..border + columns].iter_mut().zip(from).for_each(|(to, from)| *to = f32::from(*from));
            box_mean(line, half);
            box_mean(line, half);
        });
        let mut columns_first = transposed(&out, width);
        columns_first.par_chunks_mut(height).for_each(|line| {
            box_mean(line, half);
            box_mean(line, half);
        });
        let cover = transposed(&columns_first, height).iter().map(|value| value.round() as u8).collect();
        Self {
            origin: self.origin - border as f64 * self.texel,
            texel: self.texel,
            columns: width as u32,
            rows: height as u32,
            cover,
        }
    }
}

/// Replaces each value by the mean of those up to `half` elements away. Values outside the line are 0.
fn box_mean(line: &mut [f32], half: usize) {
    let mut sums = Vec::with_capacity(line.len() + 1);
    let mut sum = 0.0f64;
    sums.push(sum);
    sums.extend(line.iter().map(|value| {
        sum += f64::from(*value);
        sum
    }));
    let count = (2 * half + 1) as f64;
    for (i, value) in line.iter_mut().enumerate() {
        let (from, to) = (i.saturating_sub(half), (i + half + 1).min(sums.len() - 1));
        *value = ((sums[to] - sums[from]) / count) as f32;
    }
}

fn transposed(values: &[f32], width: usize) -> Vec<f32> {
    let height = values.len() / width.max(1);
    let mut out = vec![0.0; values.len()];
    out.par_chunks_mut(height.max(1)).enumerate().for_each(|(column, line)| {
        line.iter_mut().enumerate().for_each(|(row, value)| *value = values[row * width + column]);
    });
    out
}

/// A stand whose crowns can be mapped.
pub trait Crowns {
    /// Foot (X, Z), variant and scale of each tree.
    fn crowns(&self) -> impl Iterator<Item = (DVec2, u16, f32)>;
}

impl Crowns for Stand {
    fn crowns(&self) -> impl Iterator<Item = (DVec2, u16, f32)> {
        self.trees.iter().map(|tree| (tree.position.xz_plane(), tree.variant, tree.scale))
    }
}

impl Crowns for PackedStand {
    fn crowns(&self) -> impl Iterator<Item = (DVec2, u16, f32)> {
        self.trees.iter().map(|tree| (tree.position(&self.grid).xz_plane(), tree.variant(), tree.scale()))
    }
}

#[derive(Clone, Copy)]
struct Crown {
    center: DVec2,
    radius: f64,
}

/// Maps the crowns of `stand` on texels of `texel` metres.
///
/// A crown is a full disc with the radius of its variant, scaled. The fraction of a texel that a disc covers is exact
/// along X, and integrated over slabs along Z (at least 8 per disc and 4 per texel); the area of each disc is
/// preserved. Several discs cover `1 − Π (1 − share)`, as if they were independent. The map spans `extent`, or all
/// crowns if that is `None`, in whole texels that begin at multiples of `texel`. Without trees it is empty. It takes
/// about 50 ms for 300,000 trees of 3 m radius with texels of 8 m (two cores).
///
/// # Errors
/// [`ScatterError::PlantSize`], [`ScatterError::TooManyVariants`], [`ScatterError::UnknownVariant`] for the bounds,
/// [`ScatterError::Unpackable`] for a scale out of range, [`ScatterError::Size`] for a texel below 1 cm, or so small
/// that the map would have more than 2²⁶.
pub fn cover_map<S: Crowns>(
    stand: &S,
    bounds: &[PlantSize],
    texel: f64,
    extent: Option<Area>,
) -> Result<CoverMap, ScatterError> {
    check_texel(texel)?;
    let crowns = crowns_of(stand, bounds)?;
    let Some(span) = extent.or_else(|| span(&crowns)) else { return Ok(CoverMap::empty(texel)) };
    draw_within(&crowns, texel, &span)
}

fn bad_texel(texel: f64, remedy: String) -> ScatterError {
    ScatterError::Size { what: "the texel of the cover map", value: texel, remedy }
}

fn check_texel(texel: f64) -> Result<(), ScatterError> {
    if (MIN_TEXEL_M..=f64::MAX).contains(&texel) {
        return Ok(());
    }
    Err(bad_texel(texel, format!("give finite metres, at least {MIN_TEXEL_M}")))
}

fn draw_within(crowns: &[Crown], texel: f64, span: &Area) -> Result<CoverMap, ScatterError> {
    let origin = (span.min / texel).floor() * texel;
    let counts = ((span.max - origin) / texel).ceil().max(DVec2::ONE);
    if !(0.0..=MAX_TEXELS).contains(&(counts.x * counts.y)) {
        let least = (span.size().x * span.size().y / MAX_TEXELS).sqrt().max(span.size().max_element() / MAX_TEXELS);
        let remedy = format!("the map would have more than {MAX_TEXELS} texels; give more than {least:.2} m");
        return Err(bad_texel(texel, remedy));
    }
    Ok(draw(crowns, origin, texel, (counts.x as usize, counts.y as usize)))
}

/// As [`cover_map`] of all crowns, on texels of at least `texel` metres: of that size times the least power of two with
/// which the map has at most `most` texels (1 to 2²⁶). So a stand may be as wide as it likes.
///
/// # Errors
/// Those of [`cover_map`], except for a map that is too large.
pub fn bounded_cover_map<S: Crowns>(
    stand: &S,
    bounds: &[PlantSize],
    texel: f64,
    most: u32,
) -> Result<CoverMap, ScatterError> {
    check_texel(texel)?;
    let crowns = crowns_of(stand, bounds)?;
    let Some(span) = span(&crowns) else { return Ok(CoverMap::empty(texel)) };
    let most = f64::from(most).clamp(1.0, MAX_TEXELS);
    let size = span.size();
    let fits = |texel: f64| {
        let counts = (size / texel).ceil() + 1.0;
        counts.x * counts.y <= most.max(4.0)
    };
    let mut bounded = texel;
    while bounded.is_finite() && !fits(bounded) {
        bounded *= 2.0;
    }
    draw_within(&crowns, bounded, &span)
}

/// The crowns of a stand.
fn crowns_of<S: Crowns>(stand: &S, bounds: &[PlantSize]) -> Result<Vec<Crown>, ScatterError> {
    check_bounds(bounds)?;
    stand
        .crowns()
        .enumerate()
        .map(|(tree, (center, variant, scale))| {
            let Some(bound) = bounds.get(usize::from(variant)) else {
                return Err(ScatterError::UnknownVariant { tree, variant, count: bounds.len() });
            };
            if !(MIN_SCALE..=MAX_SCALE).contains(&scale) {
                let remedy = format!("scales are {MIN_SCALE} to {MAX_SCALE}");
                return Err(ScatterError::Unpackable { tree, what: "scale", value: scale.into(), remedy });
            }
            Ok(Crown { center, radius: f64::from(bound.radius * scale) })
        })
        .collect()
}

/// The rectangle around all crowns; `None` without any.
fn span(crowns: &[Crown]) -> Option<Area> {
    crowns.iter().fold(None, |span: Option<Area>, crown| {
        let (min, max) = (crown.center - crown.radius, crown.center + crown.radius);
        Some(span.map_or(Area { min, max }, |span| Area { min: span.min.min(min), max: span.max.max(max) }))
    })
}

/// The map of `crowns`. Only bands of rows that crowns touch cost more than their zeros.
fn draw(crowns: &[Crown], origin: DVec2, texel: f64, (columns, rows): (usize, usize)) -> CoverMap {
    let mut cover = vec![0u8; columns * rows];
    let largest = crowns.iter().fold(0f64, |largest, crown| largest.max(crown.radius));
    let discs = UnitDisc::ladder(largest / texel);
    let bands = crowns_by_band(crowns, origin, texel, rows);
    cover.par_chunks_mut(BAND * columns).zip(&bands).enumerate().for_each(|(band, (texels, crowns))| {
        if crowns.is_empty() {
            return;
        }
        let grid =
            BandGrid { origin: origin + DVec2::new(0.0, (band * BAND) as f64 * texel), texel, columns, discs: &discs };
        let (mut open, mut shares) = (vec![1f32; texels.len()], vec![0f32; columns]);
        for crown in crowns {
            grid.splat(*crown, &mut open, &mut shares);
        }
        texels.iter_mut().zip(open).for_each(|(to, open)| *to = ((1.0 - open) * 255.0).round() as u8);
    });
    CoverMap { origin, texel, columns: columns as u32, rows: rows as u32, cover }
}

/// The crowns that touch each band of rows, in order.
fn crowns_by_band(crowns: &[Crown], origin: DVec2, texel: f64, rows: usize) -> Vec<Vec<Crown>> {
    let depth = BAND as f64 * texel;
    let mut bands = vec![Vec::new(); rows.div_ceil(BAND)];
    for crown in crowns {
        let first = ((crown.center.y - crown.radius - origin.y) / depth).floor().max(0.0) as usize;
        let last = ((crown.center.y + crown.radius - origin.y) / depth).floor();
        if last >= 0.0 {
            for band in bands.iter_mut().take((last as usize).saturating_add(1)).skip(first) {
                band.push(*crown);
            }
        }
    }
    bands
}

/// A disc of radius 1, cut into equally spaced chords.
struct UnitDisc {
    /// Distance of each chord from the centre, -1 to 1, and its half length.
    chords: Vec<(f64, f64)>,
    /// Factor from a chord's length to its part of the disc's area: the spacing of the chords, minus the small excess
    /// of the midpoint rule.
    depth: f64,
}

/// Number of chords of the smallest crowns, as a power of two.
const MIN_CHORDS_LOG2: u32 = 3;

impl UnitDisc {
    /// Discs with 8, 16, 32, ... chords, up to as many as a radius of `largest` texels needs.
    fn ladder(largest: f64) -> Vec<Self> {
        (0..=Self::rung(largest)).map(|rung| Self::new(1 << (MIN_CHORDS_LOG2 as usize + rung))).collect()
    }

    /// The index in the ladder of the disc for a radius in texels, which has at least four chords per texel.
    fn rung(radius: f64) -> usize {
        let chords = (8.0 * radius).ceil().max(1.0) as u64;
        chords.next_power_of_two().ilog2().saturating_sub(MIN_CHORDS_LOG2) as usize
    }

    fn new(count: usize) -> Self {
        let offset = |k: usize| (2 * k + 1) as f64 / count as f64 - 1.0;
        let chords: Vec<(f64, f64)> = (0..count).map(|k| (offset(k), (1.0 - offset(k).powi(2)).sqrt())).collect();
        let length: f64 = chords.iter().map(|chord| 2.0 * chord.1).sum();
        Self { chords, depth: std::f64::consts::PI / length }
    }
}

struct BandGrid<'a> {
    origin: DVec2,
    texel: f64,
    columns: usize,
    discs: &'a [UnitDisc],
}

impl BandGrid<'_> {
    /// Multiplies the open fraction of the texels under `crown`. `shares` is a row of zeros before and afterwards.
    fn splat(&self, crown: Crown, texels: &mut [f32], shares: &mut [f32]) {
        // All in texels from here on.
        let center = (crown.center - self.origin) / self.texel;
        let radius = crown.radius / self.texel;
        let Some(disc) = self.discs.get(UnitDisc::rung(radius)) else { return };
        let rows = texels.len() / self.columns;
        let depth = disc.depth * radius;
        // The chords are the middles of slabs of equal height. A slab that crosses the border between two rows is
        // divided between them.
        let half_slab = radius / disc.chords.len() as f64;
        let per_slab = 0.5 / half_slab;
        let mut row = None;
        let mut touched = 0..0;
        for &(offset, half) in &disc.chords {
            let (top, bottom) = (center.y + offset * radius - half_slab, center.y + offset * radius + half_slab);
            let half = half * radius;
            let (left, right) = ((center.x - half).max(0.0), (center.x + half).min(self.columns as f64));
            if !(bottom >= 0.0 && top < rows as f64 && left < right) {
                continue;
            }
            // Truncate instead of calling rounding functions, which would cost more than everything else here. `bottom`
            // and `left` are not negative, and a column that is only touched gets a share of 0.
            let (first, end) = (left as usize, (right as usize + 1).min(self.columns));
            let border = bottom as i64;
            let above = ((border as f64 - top) * per_slab).clamp(0.0, 1.0);
            for (location, part) in [(border - 1, above), (border, 1.0 - above)] {
                let Some(location) = usize::try_from(location).ok().filter(|&location| part > 0.0 && location < rows)
                else {
                    continue;
                };
                if row != Some(location) {
                    self.flush(row, touched.clone(), texels, shares);
                    row = Some(location);
                    touched = self.columns..0;
                }
                for (column, share) in (first..end).zip(&mut shares[first..end]) {
                    let overlap = right.min((column + 1) as f64) - left.max(column as f64);
                    *share += (overlap * part * depth) as f32;
                }
                touched = touched.start.min(first)..touched.end.max(end);
            }
        }
        self.flush(row, touched, texels, shares);
    }

    fn flush(&self, row: Option<usize>, touched: Range<usize>, texels: &mut [f32], shares: &mut [f32]) {
        let Some(row) = row else { return };
        let texels = &mut texels[row * self.columns + touched.start..row * self.columns + touched.end];
        for (texel, share) in texels.iter_mut().zip(&mut shares[touched]) {
            *texel *= (1.0 - *share).max(0.0);
            *share = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_with_too_few_texels_is_open_ground_where_they_are_missing() {
        let map = CoverMap { origin: DVec2::ZERO, texel: 1.0, columns: 2, rows: 2, cover: vec![255] };
        assert_eq!((map.at(DVec2::new(0.5, 0.5)), map.at(DVec2::new(1.5, 1.5))), (1.0, 0.0));
        assert_eq!((map.smoothed(), map.widened(10.0)), (map.clone(), map.clone()));
    }
}
