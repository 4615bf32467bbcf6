//! Filling of samples without data from the rim of their holes.
//!
//! The filled surface is the membrane over the hole: it solves Laplace's equation with the rim as boundary, so it is
//! smooth, and never higher or lower than its rim. The solution starts from a push-pull pyramid [Gortler et al. 1996,
//! "The Lumigraph", section 3.4] and is relaxed on each level on the way back (a cascadic multigrid), so that large
//! holes cost no more sweeps than small ones. Where a hole reaches the border, the slope across the border is zero.

/// Sweeps of relaxation on each level of the pyramid.
const SWEEPS: usize = 24;
/// Over-relaxation: faster than plain Gauss-Seidel, stable for every hole (below 2).
const RELAXATION: f32 = 1.5;

/// Replaces every sample that is not finite. `heights` holds `columns` times `rows` samples, row by row. Returns how
/// many were replaced; if there is no finite sample at all, nothing is changed.
pub(super) fn fill_holes(columns: usize, rows: usize, heights: &mut [f32]) -> usize {
    let holes = heights.iter().filter(|h| !h.is_finite()).count();
    if holes > 0 && holes < heights.len() {
        fill_level(columns, rows, heights);
    }
    holes
}

fn fill_level(columns: usize, rows: usize, heights: &mut [f32]) {
    let holes: Vec<usize> = (0..heights.len()).filter(|&at| !heights[at].is_finite()).collect();
    if holes.is_empty() {
        return;
    }
    let (coarse_columns, coarse_rows) = (columns.div_ceil(2), rows.div_ceil(2));
    let mut coarse = averaged(columns, rows, heights);
    if coarse.len() < heights.len() {
        fill_level(coarse_columns, coarse_rows, &mut coarse);
    }
    for &at in &holes {
        heights[at] = interpolated(&coarse, coarse_columns, coarse_rows, at % columns, at / columns);
    }
    for _ in 0..SWEEPS {
        // Red-black order: the result does not depend on the direction of the sweep.
        for colour in 0..2 {
            for &at in &holes {
                let (column, row) = (at % columns, at / columns);
                if (column + row) % 2 != colour {
                    continue;
                }
                let west = if column > 0 { at - 1 } else { at + usize::from(columns > 1) };
                let east = if column + 1 < columns { at + 1 } else { at - usize::from(columns > 1) };
                let north = if row > 0 { at - columns } else { at + if rows > 1 { columns } else { 0 } };
                let south = if row + 1 < rows { at + columns } else { at - if rows > 1 { columns } else { 0 } };
                let mean = 0.25 * (heights[west] + heights[east] + heights[north] + heights[south]);
                heights[at] += RELAXATION * (mean - heights[at]);
            }
        }
    }
}

/// The next coarser level: means of the finite samples of each 2x2 block.
fn averaged(columns: usize, rows: usize, heights: &[f32]) -> Vec<f32> {
    let mut coarse = Vec::with_capacity(columns.div_ceil(2) * rows.div_ceil(2));
    for row in (0..rows).step_by(2) {
        for column in (0..columns).step_by(2) {
            let (mut sum, mut count) = (0.0_f64, 0);
            for r in row..(row + 2).min(rows) {
                for h in &heights[r * columns + column..r * columns + (column + 2).min(columns)] {
                    if h.is_finite() {
                        sum += f64::from(*h);
                        count += 1;
                    }
                }
            }
            coarse.push(if count > 0 { (sum / f64::from(count)) as f32 } else { f32::NAN });
        }
    }
    coarse
}

/// Bilinear interpolation of the coarser level at a fine sample (a coarse sample lies in the middle of its block).
fn interpolated(coarse: &[f32], columns: usize, rows: usize, column: usize, row: usize) -> f32 {
    let axis = |index: usize, count: usize| {
        let position = (index as f32 * 0.5 - 0.25).clamp(0.0, (count - 1) as f32);
        let low = position as usize;
        (low, (low + 1).min(count - 1), position - low as f32)
    };
    let (c0, c1, u) = axis(column, columns);
    let (r0, r1, v) = axis(row, rows);
    let line = |r: usize| coarse[r * columns + c0] * (1.0 - u) + coarse[r * columns + c1] * u;
    line(r0) * (1.0 - v) + line(r1) * v
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane with a hole; returns the largest error after filling.
    fn filled_plane_error(columns: usize, rows: usize, hole: impl Fn(usize, usize) -> bool) -> f32 {
        let plane = |c: usize, r: usize| 100.0 + 3.0 * c as f32 - 2.0 * r as f32;
        let mut heights: Vec<f32> = (0..columns * rows)
            .map(|at| if hole(at % columns, at / columns) { f32::NAN } else { plane(at % columns, at / columns) })
            .collect();
        let expected = (0..columns * rows).filter(|at| hole(at % columns, at / columns)).count();
        assert_eq!(fill_holes(columns, rows, &mut heights), expected);
        (0..columns * rows).map(|at| (heights[at] - plane(at % columns, at / columns)).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn holes_in_a_plane_get_the_plane() {
        assert!(filled_plane_error(40, 30, |c, r| c == 7 && r == 9) < 0.01);
        assert!(filled_plane_error(40, 30, |c, r| (10..14).contains(&c) && (5..9).contains(&r)) < 0.05);
        // A hole 40 samples wide spans 200 m of height.
        let error = filled_plane_error(120, 90, |c, r| (30..70).contains(&c) && (20..60).contains(&r));
        assert!(error < 2.0, "{error}");
    }

    #[test]
    fn a_fill_stays_between_the_rims() {
        let mut heights = vec![f32::NAN; 64 * 48];
        heights[64 * 20 + 10] = 5.0;
        heights[64 * 40 + 60] = 25.0;
        fill_holes(64, 48, &mut heights);
        assert!(heights.iter().all(|h| (4.9..=25.1).contains(h)));
    }

    #[test]
    fn nothing_known_is_left_alone() {
        let mut heights = vec![f32::NAN; 12];
        assert_eq!(fill_holes(4, 3, &mut heights), 12);
        assert!(heights.iter().all(|h| h.is_nan()));
        let mut whole = vec![1.0; 12];
        assert_eq!(fill_holes(4, 3, &mut whole), 0);
    }
}
