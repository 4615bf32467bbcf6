//! A pyramid of height bounds: how low and how high the surface gets over any rectangle, in a few look-ups.

use std::sync::Arc;

use glam::DVec2;
use rayon::prelude::*;

use super::extended_grid::{ExtendedGrid, PAD};
use super::{HeightField, Surroundings};

/// Fields with more cells than this are bounded in blocks of 4x4 cells, so that the pyramid stays small beside them.
const FINE_CELLS: usize = 1 << 20;

/// Bounds over blocks of cells of the stored (padded) grid; each level halves the one before.
#[derive(Clone)]
pub(super) struct HeightBounds {
    /// A block of the finest level is `1 << shift` cells wide.
    shift: u32,
    levels: Vec<Level>,
    columns: usize,
    rows: usize,
    surroundings: Surroundings,
}

/// Height bounds in metres, shared by all who ask.
#[derive(Clone)]
pub(super) struct BoundsInMetres {
    pub(super) bounds: Arc<HeightBounds>,
    /// Samples per metre.
    pub(super) per_metre: DVec2,
    /// The local origin in samples.
    pub(super) centre: DVec2,
}

impl BoundsInMetres {
    /// Lowest and highest point of the surface over a rectangle of the local frame (x east, y south), metres.
    pub(super) fn over(&self, min: DVec2, max: DVec2) -> (f32, f32) {
        let low = min.min(max) * self.per_metre + self.centre;
        let high = min.max(max) * self.per_metre + self.centre;
        if !(low.is_finite() && high.is_finite()) {
            return self.bounds.total();
        }
        self.bounds.over((low.x, high.x), (low.y, high.y))
    }
}

#[derive(Clone)]
struct Level {
    columns: usize,
    rows: usize,
    bounds: Vec<(f32, f32)>,
}

const NOTHING: (f32, f32) = (f32::MAX, f32::MIN);

fn union(a: (f32, f32), b: (f32, f32)) -> (f32, f32) {
    (a.0.min(b.0), a.1.max(b.1))
}

impl HeightBounds {
    pub(super) fn new(field: &HeightField, grid: &ExtendedGrid) -> Self {
        // Stored cells: those whose 4x4 neighbourhood is stored. Cell 0 here has storage index 1.
        let (cell_columns, cell_rows) = (field.columns() + 2 * PAD - 3, field.rows() + 2 * PAD - 3);
        let shift = if cell_columns * cell_rows > FINE_CELLS { 2 } else { 0 };
        let columns = cell_columns.div_ceil(1 << shift);
        let rows = cell_rows.div_ceil(1 << shift);
        let mirror = grid.surroundings() == Surroundings::Mirror;
        let border = |cell: usize, count: usize| [cell + 1 == PAD, cell + 1 == PAD + count - 2];
        let cell_bounds = |column: usize, row: usize| {
            let patch = grid.stored_patch(column + 1, row + 1);
            let bounds = patch.bounds();
            let at_columns = border(column, field.columns());
            let at_rows = border(row, field.rows());
            // The border cells also stand for their images at the far seams, where the neighbourhood is mirrored.
            if mirror && (at_columns.contains(&true) || at_rows.contains(&true)) {
                let images = [(at_columns, [false; 2]), ([false; 2], at_rows), (at_columns, at_rows)];
                return images.iter().fold(bounds, |all, (c, r)| union(all, patch.mirrored(*c, *r).bounds()));
            }
            bounds
        };
        let bounds = (0..columns * rows)
            .into_par_iter()
            .with_min_len(256)
            .map(|block| {
                let (block_column, block_row) = ((block % columns) << shift, (block / columns) << shift);
                let mut all = NOTHING;
                for row in block_row..(block_row + (1 << shift)).min(cell_rows) {
                    for column in block_column..(block_column + (1 << shift)).min(cell_columns) {
                        all = union(all, cell_bounds(column, row));
                    }
                }
                all
            })
            .collect();
        let mut levels = vec![Level { columns, rows, bounds }];
        while let Some(coarser) = levels.last().and_then(Level::halved) {
            levels.push(coarser);
        }
        Self { shift, levels, columns: field.columns(), rows: field.rows(), surroundings: grid.surroundings() }
    }

    /// Lowest and highest point of the surface over a rectangle given in samples (`low <= high` for each axis).
    pub(super) fn over(&self, columns: (f64, f64), rows: (f64, f64)) -> (f32, f32) {
        let column_ranges = self.cell_ranges(columns, self.columns);
        let row_ranges = self.cell_ranges(rows, self.rows);
        let mut all = NOTHING;
        for &columns in column_ranges.iter().flatten() {
            for &rows in row_ranges.iter().flatten() {
                all = union(all, self.over_cells(columns, rows));
            }
        }
        all
    }

    /// Bounds of the whole surface, the surroundings included.
    pub(super) fn total(&self) -> (f32, f32) {
        self.levels.last().map_or(NOTHING, |level| level.bounds.iter().fold(NOTHING, |all, &b| union(all, b)))
    }

    /// The stored cells (inclusive ranges) whose surface stands for an interval: the stored part as it is, and the
    /// parts beyond it folded into the field.
    fn cell_ranges(&self, (low, high): (f64, f64), count: usize) -> [Option<(usize, usize)>; 3] {
        let first = 1.0 - PAD as f64;
        let end = (count + PAD - 2) as f64;
        // A position on a cell's edge may be evaluated from either side.
        let (low, high) = (low - 1e-9, high + 1e-9);
        let stored = |position: f64| (position - first) as usize;
        let cells = count + 2 * PAD - 3;
        let middle =
            (high >= first && low < end).then(|| (stored(low.max(first)), stored(high.min(end)).min(cells - 1)));
        let before = (low < first).then(|| self.folded(low, high.min(first), count));
        let behind = (high >= end).then(|| self.folded(low.max(end), high, count));
        let into_storage = |range: Option<(usize, usize)>| range.map(|(a, b)| (a + PAD - 1, b + PAD - 1));
        [middle, into_storage(before), into_storage(behind)]
    }

    /// The field's cells that an interval outside falls on.
    fn folded(&self, low: f64, high: f64, count: usize) -> (usize, usize) {
        let last = (count - 1) as f64;
        let cell = |position: f64| (position.max(0.0) as usize).min(count - 2);
        match self.surroundings {
            Surroundings::Border => (cell(low.min(last)), cell(high.min(last))),
            Surroundings::Mirror => {
                // Written so that NaN takes this branch too.
                if !(high - low < last && low.abs().max(high.abs()) < 1.0e15) {
                    return (0, count - 2);
                }
                let image = |position: f64| {
                    let turned = position - 2.0 * last * (position / (2.0 * last)).floor();
                    if turned > last { 2.0 * last - turned } else { turned }
                };
                let (a, b) = (image(low), image(high));
                let (mut from, mut to) = (a.min(b), a.max(b));
                let seam = (high / last).floor();
                if seam != (low / last).floor() {
                    if seam.rem_euclid(2.0) == 0.0 {
                        from = 0.0;
                    } else {
                        to = last;
                    }
                }
                (cell(from - 1e-6), cell(to + 1e-6))
            }
        }
    }

    fn over_cells(&self, columns: (usize, usize), rows: (usize, usize)) -> (f32, f32) {
        let narrow = |(from, to): (usize, usize), shift: u32| (to >> shift) - (from >> shift) < 4;
        let mut levels = (self.shift..).zip(&self.levels);
        let fitting = levels.find(|(shift, _)| narrow(columns, *shift) && narrow(rows, *shift));
        // The coarsest level is a single block, so one always fits.
        let Some((shift, level)) = fitting else { return self.total() };
        let mut all = NOTHING;
        for row in rows.0 >> shift..=rows.1 >> shift {
            for column in columns.0 >> shift..=columns.1 >> shift {
                all = union(all, level.bounds[row * level.columns + column]);
            }
        }
        all
    }
}

impl Level {
    fn halved(&self) -> Option<Level> {
        if self.columns == 1 && self.rows == 1 {
            return None;
        }
        let (columns, rows) = (self.columns.div_ceil(2), self.rows.div_ceil(2));
        let mut bounds = vec![NOTHING; columns * rows];
        for row in 0..self.rows {
            for column in 0..self.columns {
                let target = &mut bounds[(row / 2) * columns + column / 2];
                *target = union(*target, self.bounds[row * self.columns + column]);
            }
        }
        Some(Level { columns, rows, bounds })
    }
}
