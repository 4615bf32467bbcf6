//! The height field's samples continued over the whole plane, and the smooth surface through them.
//!
//! The surface is the tensor product of Catmull-Rom splines [Catmull & Rom 1974, "A class of local interpolating
//! splines"] over an *infinite* grid of samples: it passes through the samples, is C1 everywhere, and reproduces
//! every plane inside the field. What lies outside is decided sample by sample:
//!
//! ```text
//!   ... mirrored  | blend of 7 samples    | the field          | blend | mirrored ...
//!   H[-k] = H[k]  | H[-k] = H[k] + 2S c_k | H[0] .. H[n - 1]   |
//! ```
//!
//! with the rise `S` per sample across the border, averaged along it, and `c_k = k ((1 - k/8) / (1 - 1/8))^2`. At `k =
//! 1` this continues a plane, which makes the border cells exact for planes; further out the correction ends, so that
//! the surroundings neither crease at the border nor drift away from the mirror image. The rule is linear and applied
//! along columns first, then along rows.

use super::HeightField;

/// How the surface goes on outside the field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Surroundings {
    /// The field is mirrored at its borders again and again: hills remain hills up to the horizon.
    #[default]
    Mirror,
    /// The border's heights are carried outwards: for an island in a plain or in the sea.
    Border,
}

/// Samples kept outside the field on each side: the blend, and what a 4x4 neighbourhood needs beyond it.
pub(super) const PAD: usize = 10;

/// The correction at the border has run out at this many samples outside.
const BLEND: f64 = 8.0;

/// The rise at the border is taken over this many samples inwards and averaged over this many to each side along the
/// border: the roughness of single samples would be drawn out into streaks.
const RISE_DEPTH: i64 = 3;
const RISE_REACH: usize = 6;

/// Indices of samples are held within this, where f64 still counts in ones.
const FAR: f64 = 1.0e15;

/// The samples of a field with [`PAD`] more on each side; further ones are found by folding.
#[derive(Clone)]
pub(super) struct ExtendedGrid {
    columns: usize,
    rows: usize,
    stride: usize,
    samples: Vec<f32>,
    surroundings: Surroundings,
}

/// A 4x4 neighbourhood (rows from the north) and the position inside its middle cell, each in 0..=1.
pub(super) struct Patch {
    samples: [[f32; 4]; 4],
    column_fraction: f64,
    row_fraction: f64,
}

impl ExtendedGrid {
    pub(super) fn new(field: &HeightField, surroundings: Surroundings) -> Self {
        let (columns, rows) = (field.columns(), field.rows());
        let (stride, total_rows) = (columns + 2 * PAD, rows + 2 * PAD);
        let mut samples = vec![0.0; stride * total_rows];
        for (row, source) in field.heights().chunks_exact(columns).enumerate() {
            samples[(row + PAD) * stride + PAD..][..columns].copy_from_slice(source);
        }
        let lines = Lines { first: PAD * stride, next: stride, lines: rows, pads: 0, step: 1, count: columns };
        lines.extend(&mut samples, surroundings);
        let lines = Lines { first: 0, next: 1, lines: stride, pads: PAD, step: stride, count: rows };
        lines.extend(&mut samples, surroundings);
        Self { columns, rows, stride, samples, surroundings }
    }

    /// The neighbourhood of a position given in samples (0 is the first column or row). Positions that are not finite
    /// are taken as the first sample.
    #[inline]
    pub(super) fn patch(&self, column: f64, row: f64) -> Patch {
        let (first_column, column_fraction) = split(column);
        let (first_row, row_fraction) = split(row);
        let mut samples = [[0.0; 4]; 4];
        if let (Some(column), Some(row)) = (stored(first_column, self.columns), stored(first_row, self.rows)) {
            let start = row * self.stride + column;
            let block = &self.samples[start..start + 3 * self.stride + 4];
            for (line, at) in samples.iter_mut().zip([0, self.stride, 2 * self.stride, 3 * self.stride]) {
                line.copy_from_slice(&block[at..at + 4]);
            }
        } else {
            let columns = self.neighbours(first_column, self.columns);
            let rows = self.neighbours(first_row, self.rows);
            for (line, row) in samples.iter_mut().zip(rows) {
                for (sample, column) in line.iter_mut().zip(columns) {
                    *sample = self.samples[row * self.stride + column];
                }
            }
        }
        Patch { samples, column_fraction, row_fraction }
    }

    /// The neighbourhood of the stored cell whose north-western sample has these storage indices (1 at least).
    pub(super) fn stored_patch(&self, column: usize, row: usize) -> Patch {
        let mut samples = [[0.0; 4]; 4];
        for (offset, line) in samples.iter_mut().enumerate() {
            line.copy_from_slice(&self.samples[(row + offset - 1) * self.stride + column - 1..][..4]);
        }
        Patch { samples, column_fraction: 0.0, row_fraction: 0.0 }
    }

    pub(super) fn surroundings(&self) -> Surroundings {
        self.surroundings
    }

    /// Storage indices of four samples from `first` on. Those that are not all stored lie so far out (8 samples at
    /// least) that they are pure images.
    fn neighbours(&self, first: i64, count: usize) -> [usize; 4] {
        if let Some(start) = stored(first, count) {
            return [start, start + 1, start + 2, start + 3];
        }
        let last = count as i64 - 1;
        let position = match self.surroundings {
            Surroundings::Border => first,
            Surroundings::Mirror => first.rem_euclid(2 * last),
        };
        [0, 1, 2, 3].map(|offset| {
            let index = match self.surroundings {
                Surroundings::Border => (position + offset).clamp(0, last),
                // Within four steps of a position in 0..period: at most a few reflections, even of the shortest period,
                // 2.
                Surroundings::Mirror => {
                    let mut turned = position + offset;
                    while turned >= 2 * last {
                        turned -= 2 * last;
                    }
                    if turned > last { 2 * last - turned } else { turned }
                }
            };
            (index + PAD as i64) as usize
        })
    }
}

/// The first of the four samples around a position, and the position's fraction between the second and the third.
#[inline]
fn split(position: f64) -> (i64, f64) {
    // Comparisons with NaN are false.
    let position = if position.abs() <= FAR {
        position
    } else if position.is_nan() {
        0.0
    } else {
        FAR.copysign(position)
    };
    // Without SSE 4.1 `floor` is a call; this is not.
    let truncated = position as i64;
    let floor = truncated - i64::from(position < truncated as f64);
    (floor - 1, position - floor as f64)
}

/// Storage index of a sample, if it and the three after it are stored.
#[inline]
fn stored(first: i64, count: usize) -> Option<usize> {
    let start = first + PAD as i64;
    (start >= 0 && start + 3 < (count + 2 * PAD) as i64).then_some(start as usize)
}

impl Patch {
    /// Height in metres.
    #[inline]
    pub(super) fn height(&self) -> f64 {
        let (u, v) = (weights(self.column_fraction), weights(self.row_fraction));
        let [a, b, c, d] = &self.samples;
        v[0] * dot(a, &u) + v[1] * dot(b, &u) + v[2] * dot(c, &u) + v[3] * dot(d, &u)
    }

    /// Height in metres and its derivatives along columns and rows in metres per sample.
    #[inline]
    pub(super) fn height_and_derivatives(&self) -> (f64, f64, f64) {
        let (u, v) = (weights(self.column_fraction), weights(self.row_fraction));
        let (du, dv) = (weight_slopes(self.column_fraction), weight_slopes(self.row_fraction));
        let (mut height, mut along_columns, mut along_rows) = (0.0, 0.0, 0.0);
        for (j, line) in self.samples.iter().enumerate() {
            let value = dot(line, &u);
            height += v[j] * value;
            along_rows += dv[j] * value;
            along_columns += v[j] * dot(line, &du);
        }
        (height, along_columns, along_rows)
    }

    /// The second derivatives (column-column, column-row, row-row) in metres per sample squared at one of the cell's
    /// corners, as the limit from inside the cell.
    pub(super) fn second_derivatives_at_corner(&self, east: bool, south: bool) -> [f64; 3] {
        let position = |far: bool| if far { 1.0 } else { 0.0 };
        let (u, v) = (weights(position(east)), weights(position(south)));
        let (du, dv) = (weight_slopes(position(east)), weight_slopes(position(south)));
        let (ddu, ddv) = (weight_bends(position(east)), weight_bends(position(south)));
        [self.weighted(&ddu, &v), self.weighted(&du, &dv), self.weighted(&u, &ddv)]
    }

    /// Bounds of the surface over the cell: the convex hull of its Bezier control points.
    pub(super) fn bounds(&self) -> (f32, f32) {
        let lines = self.samples.map(|line| bezier(line.map(f64::from)));
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        let [first, second, third, fourth] = lines;
        for (((a, b), c), d) in first.into_iter().zip(second).zip(third).zip(fourth) {
            for control in bezier([a, b, c, d]) {
                low = low.min(control);
                high = high.max(control);
            }
        }
        // One part in a million more than the hull: covers the rounding to f32 here and in those who evaluate.
        let slack = 1.0e-6 * low.abs().max(high.abs()).max(1.0);
        ((low - slack) as f32, (high + slack) as f32)
    }

    /// The same patch as it looks where its border is a seam between mirror images: what lies beyond the second
    /// sample (`low`) or the third (`high`) is the image of what lies before.
    pub(super) fn mirrored(&self, columns: [bool; 2], rows: [bool; 2]) -> Patch {
        let mut samples = self.samples;
        for line in &mut samples {
            if columns[0] {
                line[0] = line[2];
            }
            if columns[1] {
                line[3] = line[1];
            }
        }
        if rows[0] {
            samples[0] = samples[2];
        }
        if rows[1] {
            samples[3] = samples[1];
        }
        Patch { samples, column_fraction: self.column_fraction, row_fraction: self.row_fraction }
    }

    fn weighted(&self, u: &[f64; 4], v: &[f64; 4]) -> f64 {
        self.samples.iter().zip(v).map(|(line, v)| v * dot(line, u)).sum()
    }
}

/// Index of the field's sample that stands for `index` outside the grid (0..count).
pub(super) fn fold(index: i64, count: usize, surroundings: Surroundings) -> usize {
    let last = count as i64 - 1;
    match surroundings {
        Surroundings::Border => index.clamp(0, last) as usize,
        Surroundings::Mirror => {
            let position = index.rem_euclid(2 * last);
            (if position > last { 2 * last - position } else { position }) as usize
        }
    }
}

/// Parallel lines of samples inside a padded array: sample `i` of line `l` is at `first + l * next + (PAD + i) * step`.
struct Lines {
    first: usize,
    next: usize,
    lines: usize,
    /// How many of the lines, first and last, are pads of the other axis.
    pads: usize,
    step: usize,
    count: usize,
}

impl Lines {
    /// Fills the pads of all lines.
    fn extend(&self, samples: &mut [f32], surroundings: Surroundings) {
        let last = self.count as i64 - 1;
        // How far the image across the border falls short of a straight continuation, in rises per sample.
        let shortfall = match surroundings {
            Surroundings::Mirror => 2.0,
            Surroundings::Border => 1.0,
        };
        for (edge, outward) in [(0, -1), (last, 1)] {
            let rises = smoothed(&self.border_rises(samples, edge, outward));
            for line in 0..self.lines {
                // A pad takes the rise of the line that it is the image of: pure images must be alike, to the last
                // sample.
                let rise = rises[fold(line as i64 - self.pads as i64, rises.len(), surroundings)];
                for k in 1..=PAD as i64 {
                    let image = samples[self.at(line, fold(edge + outward * k, self.count, surroundings) as i64)];
                    let run = (1.0 - k as f64 / BLEND).max(0.0) / (1.0 - 1.0 / BLEND);
                    let height = f64::from(image) + shortfall * rise * k as f64 * run * run;
                    samples[self.at(line, edge + outward * k)] = height as f32;
                }
            }
        }
    }

    /// The outward rise per sample at the border of each line that is no pad, over a few samples.
    fn border_rises(&self, samples: &[f32], edge: i64, outward: i64) -> Vec<f64> {
        let depth = (self.count as i64 - 1).min(RISE_DEPTH);
        let rise = |line| {
            let inner = samples[self.at(line, edge - outward * depth)];
            (f64::from(samples[self.at(line, edge)]) - f64::from(inner)) / depth as f64
        };
        (self.pads..self.lines - self.pads).map(rise).collect()
    }

    fn at(&self, line: usize, index: i64) -> usize {
        self.first + line * self.next + (index + PAD as i64) as usize * self.step
    }
}

/// Means over a triangular window of `2 RISE_REACH + 1` values; less at the ends. A constant stays as it is.
fn smoothed(values: &[f64]) -> Vec<f64> {
    let reach = RISE_REACH as i64;
    (0..values.len() as i64)
        .map(|at| {
            let (mut sum, mut total) = (0.0, 0.0);
            for offset in -reach..=reach {
                if let Some(value) = usize::try_from(at + offset).ok().and_then(|index| values.get(index)) {
                    let weight = (reach + 1 - offset.abs()) as f64;
                    sum += weight * value;
                    total += weight;
                }
            }
            sum / total
        })
        .collect()
}

#[inline]
fn dot(samples: &[f32; 4], weights: &[f64; 4]) -> f64 {
    f64::from(samples[0]) * weights[0]
        + f64::from(samples[1]) * weights[1]
        + f64::from(samples[2]) * weights[2]
        + f64::from(samples[3]) * weights[3]
}

/// Catmull-Rom weights of the four samples around a position `t` in 0..=1 between the second and the third.
#[inline]
fn weights(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [0.5 * (2.0 * t2 - t - t3), 0.5 * (3.0 * t3 - 5.0 * t2 + 2.0), 0.5 * (4.0 * t2 + t - 3.0 * t3), 0.5 * (t3 - t2)]
}

#[inline]
fn weight_slopes(t: f64) -> [f64; 4] {
    let t2 = t * t;
    [
        0.5 * (4.0 * t - 1.0 - 3.0 * t2),
        0.5 * (9.0 * t2 - 10.0 * t),
        0.5 * (8.0 * t + 1.0 - 9.0 * t2),
        0.5 * (3.0 * t2 - 2.0 * t),
    ]
}

fn weight_bends(t: f64) -> [f64; 4] {
    [2.0 - 3.0 * t, 9.0 * t - 5.0, 4.0 - 9.0 * t, 3.0 * t - 1.0]
}

/// The Bezier control values of the Catmull-Rom piece between the second and the third sample.
fn bezier(p: [f64; 4]) -> [f64; 4] {
    [p[1], p[1] + (p[2] - p[0]) / 6.0, p[2] - (p[3] - p[1]) / 6.0, p[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folding_runs_back_and_forth() {
        let images: Vec<usize> = (-5..8).map(|i| fold(i, 4, Surroundings::Mirror)).collect();
        assert_eq!(images, [1, 2, 3, 2, 1, 0, 1, 2, 3, 2, 1, 0, 1]);
        assert_eq!(fold(-7, 4, Surroundings::Border), 0);
        assert_eq!(fold(9, 4, Surroundings::Border), 3);
    }

    #[test]
    fn weights_are_a_partition_and_their_slopes_match_differences() {
        for step in 0..=10 {
            let t = f64::from(step) / 10.0;
            assert!((weights(t).iter().sum::<f64>() - 1.0).abs() < 1e-14);
            for i in 0..4 {
                let e = 1e-5;
                let slope = (weights(t + e)[i] - weights(t - e)[i]) / (2.0 * e);
                let bend = (weight_slopes(t + e)[i] - weight_slopes(t - e)[i]) / (2.0 * e);
                assert!((slope - weight_slopes(t)[i]).abs() < 1e-8);
                assert!((bend - weight_bends(t)[i]).abs() < 1e-8);
            }
        }
    }
}
