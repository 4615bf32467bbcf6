//! The shadow of the relief: above which height a point sees the sun over the terrain.
//!
//! For a sun of elevation tangent `t` in the horizontal direction `u`, a point at `p` sees it from the height
//!
//! ```text
//! H(p) = max over s > 0 of  h(p + s u) - s t
//! ```
//!
//! upwards. Along one line towards the sun this is a running maximum, `H <- max(H, h) - step * t`, so all heights of a
//! line cost one pass. The grid is swept along lines that run exactly in the sun's azimuth (a sheared grid; each line
//! is stepped from row to row, or from column to column where the azimuth is nearer to those), and the cells take the
//! linear interpolation between the two lines beside them. Nothing is interpolated twice, so shadows do not blur with
//! their length.
//!
//! Cost: one [`Terrain::height`] per line and row, 5 to 15 ms for 384² cells on two cores.
//! Limits: relief between two steps of a line (outside the field: within a sample of the field) is not seen; the
//! earth's curvature (8 m over 10 km) and refraction are left out.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{MAX_SAMPLES, Terrain, TerrainError};

/// Tangents of the sun's elevation beyond these change nothing that can be seen, and would overflow at the zenith.
const TANGENTS: (f64, f64) = (-1.0, 1000.0);
/// Steps towards the sun beyond the field at most.
const MAX_STEPS: f64 = 65_536.0;

/// The grid that horizons are computed on: it covers the field (`Terrain::extent`) with equal cells. Cell `(c, r)` has
/// its centre at `x = ((c + 0.5) / columns - 0.5) * extent.x`, `z = ((r + 0.5) / rows - 0.5) * extent.y`, like the
/// texels of a texture spread over the field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HorizonGrid {
    /// Cells from west to east, 1 or more.
    pub columns: usize,
    /// Cells from north to south, 1 or more.
    pub rows: usize,
    /// Obstacles are looked for this far towards the sun, in whole metres; the surroundings of the field included.
    pub max_distance: u32,
}

/// For each cell of the grid (row by row from the north) the height in metres above the datum from which on a point
/// sees the centre of the sun over the terrain. `sun` points to the sun (x east, y up, z south; any length).
///
/// In the shader, visibility is a smooth step of `y - horizon` over the sun's penumbra: its width is about `0.0093 *
/// distance` to the obstacle. The ground before the first step does not shade itself here; that is left to the normal.
///
/// At and below the horizon the result is what the flat continuation gives: finite, and higher the lower the sun
/// stands. A `sun` that is zero or not finite counts as the zenith.
///
/// # Errors
/// A grid without cells or of more than [`MAX_SAMPLES`].
pub fn sun_horizon(terrain: &Terrain, grid: &HorizonGrid, sun: DVec3) -> Result<Vec<f32>, TerrainError> {
    sun_horizon_over(terrain, terrain.extent(), grid, sun)
}

/// As [`sun_horizon`], with the grid over `extent` metres around the field's centre instead of the field: its surroundings
/// included, or a part of it.
///
/// # Errors
/// Those of [`sun_horizon`], and an extent that is not above 0 and finite.
pub fn sun_horizon_over(
    terrain: &Terrain,
    extent: DVec2,
    grid: &HorizonGrid,
    sun: DVec3,
) -> Result<Vec<f32>, TerrainError> {
    if !(extent.is_finite() && extent.min_element() > 0.0) {
        let value = extent.min_element();
        return Err(TerrainError::BadParameter { name: "the extent of the horizons", value, range: "above 0 m" });
    }
    let HorizonGrid { columns, rows, .. } = *grid;
    if columns == 0 || rows == 0 {
        return Err(TerrainError::TooSmall { columns, rows });
    }
    if columns.checked_mul(rows).is_none_or(|count| count > MAX_SAMPLES) {
        return Err(TerrainError::TooLarge { columns, rows, limit: MAX_SAMPLES });
    }
    let sweep = Sweep::new(terrain, extent, grid, sun);
    let lines: Vec<Vec<f32>> = (0..sweep.lines).into_par_iter().map(|line| sweep.line(terrain, line)).collect();
    let mut horizon = vec![0.0; columns * rows];
    horizon.par_chunks_mut(columns).enumerate().for_each(|(row, cells)| {
        for (column, cell) in cells.iter_mut().enumerate() {
            let (along, across) = if sweep.along_x { (column, row) } else { (row, column) };
            *cell = sweep.between_lines(&lines, along, across);
        }
    });
    Ok(horizon)
}

/// Lines in the sun's azimuth. "Along" counts cells on the axis that the azimuth is nearer to, "across" on the other.
struct Sweep {
    along_x: bool,
    /// Cells along and across.
    along: usize,
    across: usize,
    /// The sun stands towards growing "along".
    towards_end: bool,
    /// Cells across per step towards the sun, -1 to 1.
    shear: f64,
    /// Ground distance of a step in metres, and the fall of a sun ray over it.
    fall: f64,
    /// Steps towards the sun beyond a line's first cell, and how many of them are taken at once: out there a sample of
    /// the field is fine enough.
    run_up: usize,
    stride: usize,
    /// "Across" coordinate of line 0 at the cell farthest from the sun, and the number of lines.
    first_line: f64,
    lines: usize,
    extent: DVec2,
    cell: DVec2,
}

impl Sweep {
    fn new(terrain: &Terrain, extent: DVec2, grid: &HorizonGrid, sun: DVec3) -> Self {
        let sun = if sun.is_finite() { sun.normalize_or(DVec3::Y) } else { DVec3::Y };
        let flat = DVec2::new(sun.x, sun.z);
        let tangent = if flat.length() > 1.0e-6 {
            (sun.y / flat.length()).clamp(TANGENTS.0, TANGENTS.1)
        } else if sun.y > 0.0 {
            TANGENTS.1
        } else {
            TANGENTS.0
        };
        let azimuth = flat.normalize_or(DVec2::X);
        let cell = extent / DVec2::new(grid.columns as f64, grid.rows as f64);
        let in_cells = azimuth / cell;
        let along_x = in_cells.x.abs() >= in_cells.y.abs();
        let (main, side) = if along_x { (in_cells.x, in_cells.y) } else { (in_cells.y, in_cells.x) };
        let (along, across) = if along_x { (grid.columns, grid.rows) } else { (grid.rows, grid.columns) };
        let shear = side / main.abs();
        let step = 1.0 / main.abs();
        // Nothing is higher than the relief, so nothing farther than this can shade.
        let (low, high) = terrain.min_max_height();
        let mut distance = f64::from(grid.max_distance);
        if tangent > 0.0 {
            distance = distance.min(f64::from(high - low) / tangent);
        }
        let run_up = (distance / step).ceil().clamp(1.0, MAX_STEPS) as usize;
        let stride = ((terrain.field().spacing().min_element() / step) as usize).max(1);
        // At the cell nearest to the sun all lines have moved by this much across.
        let drift = shear * (along - 1) as f64;
        let first_line = (-drift.max(0.0)).floor();
        let last_line = (across - 1) as f64 - drift.min(0.0).floor() + 1.0;
        let lines = (last_line - first_line) as usize + 1;
        Self {
            along_x,
            along,
            across,
            towards_end: main > 0.0,
            shear,
            fall: step * tangent,
            run_up: run_up.next_multiple_of(stride),
            stride,
            first_line,
            lines,
            extent,
            cell,
        }
    }

    /// Steps from the cell farthest from the sun.
    fn steps_sunward(&self, along: usize) -> usize {
        if self.towards_end { along } else { self.along - 1 - along }
    }

    /// The horizon on one line: one value per step, index 0 is the cell farthest from the sun. Steps at which the line
    /// lies beside the field keep 0: no cell reads them.
    fn line(&self, terrain: &Terrain, line: usize) -> Vec<f32> {
        let mut horizon = vec![0.0; self.along];
        let start = self.first_line + line as f64;
        let beside = |steps: usize| {
            let across = start + self.shear * steps as f64;
            across <= -1.0 || across >= self.across as f64
        };
        // "Across" moves one way only, so the steps on the field are one interval.
        let Some(nearest) = (0..self.along).find(|&steps| !beside(steps)) else { return horizon };
        let farthest = (nearest..self.along).find(|&steps| beside(steps)).unwrap_or(self.along) - 1;
        let mut highest = self.height(terrain, start, farthest + self.run_up);
        for steps in (farthest + 1..farthest + self.run_up).rev().filter(|steps| (steps - farthest) % self.stride == 0)
        {
            highest = (highest - self.fall * self.stride as f64).max(self.height(terrain, start, steps));
        }
        // What is known holds at the nearest of the strides: the remaining way to the field is one more of them.
        highest -= self.fall * (self.stride - 1) as f64;
        if self.stride > 1 {
            highest = highest.max(self.height(terrain, start, farthest + 1));
        }
        for steps in (nearest..=farthest).rev() {
            highest -= self.fall;
            horizon[steps] = highest as f32;
            highest = highest.max(self.height(terrain, start, steps));
        }
        horizon
    }

    fn height(&self, terrain: &Terrain, start: f64, steps: usize) -> f64 {
        let steps = steps as f64;
        let along = if self.towards_end { steps } else { (self.along - 1) as f64 - steps };
        let across = start + self.shear * steps;
        let position = if self.along_x { DVec2::new(along, across) } else { DVec2::new(across, along) };
        let metres = (position + 0.5) * self.cell - 0.5 * self.extent;
        terrain.height(metres.x, metres.y)
    }

    fn between_lines(&self, lines: &[Vec<f32>], along: usize, across: usize) -> f32 {
        let steps = self.steps_sunward(along);
        let position = (across as f64 - self.shear * steps as f64 - self.first_line).max(0.0);
        let line = (position as usize).min(self.lines - 2);
        let share = (position - line as f64) as f32;
        lines[line][steps] * (1.0 - share) + lines[line + 1][steps] * share
    }
}
