//! Periodic noise: value noise and cells on a lattice that wraps around (Perlin 1985; Worley 1996).

/// 32 random bits for a lattice point (the finaliser of MurmurHash3, Appleby 2011).
fn hash(x: i32, y: i32, seed: u32) -> u32 {
    let mut h =
        (x as u32).wrapping_mul(0x85eb_ca6b) ^ (y as u32).wrapping_mul(0xc2b2_ae35) ^ seed.wrapping_mul(0x27d4_eb2f);
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

/// Wraps a lattice coordinate that is outside by less than a period.
fn wrap(x: i32, period: i32) -> i32 {
    if x < 0 {
        x + period
    } else if x >= period {
        x - period
    } else {
        x
    }
}

/// Value noise, -1 to 1, that repeats after `period` lattice points along each axis. `x` and `y` may be outside the
/// period by less than one more period.
pub(super) fn noise(x: f32, y: f32, period: [i32; 2], seed: u32) -> f32 {
    let (cell_x, cell_y) = (x.floor(), y.floor());
    let fade = |t: f32| t * t * t * (t * (6.0 * t - 15.0) + 10.0);
    let (u, v) = (fade(x - cell_x), fade(y - cell_y));
    let (x0, y0) = (wrap(cell_x as i32, period[0]), wrap(cell_y as i32, period[1]));
    let (x1, y1) = (wrap(x0 + 1, period[0]), wrap(y0 + 1, period[1]));
    let at = |x: i32, y: i32| hash(x, y, seed) as f32 * (1.0 / 4_294_967_296.0);
    let low = at(x0, y0) + (at(x1, y0) - at(x0, y0)) * u;
    let high = at(x0, y1) + (at(x1, y1) - at(x0, y1)) * u;
    2.0 * (low + (high - low) * v) - 1.0
}

/// Octaves of [`noise`], each twice as fine and half as strong as the one before; about -1 to 1. `x` and `y` run from 0
/// to 1 over the texture. `period` is that of the first octave.
pub(super) fn octaves(x: f32, y: f32, period: [i32; 2], count: u32, seed: u32) -> f32 {
    let (mut sum, mut weight, mut total) = (0.0, 1.0, 0.0);
    for octave in 0..count {
        let period = [period[0] << octave, period[1] << octave];
        sum += weight * noise(x * period[0] as f32, y * period[1] as f32, period, seed + octave);
        total += weight;
        weight *= 0.5;
    }
    sum / total
}

/// The cell at a position.
pub(super) struct Cell {
    /// Distance to the border with the nearest other cell, in widths of a cell.
    pub border: f32,
    /// Vector to the cell's own point, in cells.
    pub to_point: [f32; 2],
    /// A random number of the cell, `0.0..1.0`.
    pub value: f32,
}

/// The cell at a position of a lattice that repeats after `period` cells along each axis. Cells are `stretch` times as
/// high as wide. `x` and `y`, in cells, may be outside the period by less than one more period.
pub(super) fn cell(x: f32, y: f32, period: [i32; 2], stretch: f32, seed: u32) -> Cell {
    let (cell_x, cell_y) = (x.floor() as i32, y.floor() as i32);
    let mut points = [(f32::MAX, [0.0; 2], 0.0); 9];
    let mut nearest = 0;
    for (i, entry) in points.iter_mut().enumerate() {
        let (i_x, i_y) = (cell_x + i as i32 % 3 - 1, cell_y + i as i32 / 3 - 1);
        let bits = hash(wrap(i_x, period[0]), wrap(i_y, period[1]), seed);
        let part = |shift: u32| (bits >> shift & 0x3ff) as f32 / 1024.0;
        let to = [i_x as f32 + 0.1 + 0.8 * part(0) - x, i_y as f32 + 0.1 + 0.8 * part(10) - y];
        *entry = (to[0] * to[0] + to[1] * to[1], to, part(20));
    }
    for i in 1..9 {
        if points[i].0 < points[nearest].0 {
            nearest = i;
        }
    }
    let own = points[nearest];
    let border = points.iter().enumerate().filter(|&(i, _)| i != nearest).fold(f32::MAX, |border, (_, other)| {
        // Distance to the bisector of the two points, measured with the true proportions of the cells.
        let between = [other.1[0] - own.1[0], other.1[1] - own.1[1]];
        let middle = [0.5 * (other.1[0] + own.1[0]), 0.5 * (other.1[1] + own.1[1])];
        let up = between[1] / stretch;
        let length = (between[0] * between[0] + up * up).sqrt().max(1e-6);
        border.min((middle[0] * between[0] + middle[1] * between[1]) / length)
    });
    Cell { border: border.max(0.0), to_point: own.1, value: own.2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_repeats_without_a_seam() {
        for i in 0..50 {
            let y = i as f32 / 50.0;
            assert!((octaves(0.0, y, [5, 7], 4, 1) - octaves(1.0, y, [5, 7], 4, 1)).abs() < 1e-3);
            assert!((octaves(y, 0.0, [5, 7], 4, 1) - octaves(y, 1.0, [5, 7], 4, 1)).abs() < 1e-3);
            let (left, right) = (cell(0.0, 5.0 * y, [8, 5], 2.0, 3), cell(8.0, 5.0 * y, [8, 5], 2.0, 3));
            assert!((left.border - right.border).abs() < 1e-3 && left.value == right.value);
        }
    }

    #[test]
    fn borders_of_cells_are_met_in_true_proportions() {
        // Walking straight up through a lattice of cells four times as high as wide, a metre is a quarter cell: the
        // border must grow no faster than the metres walked.
        let metre = 0.01;
        for i in 0..400 {
            let y = i as f32 * metre;
            let (a, b) = (cell(2.3, y / 4.0, [8, 8], 4.0, 9), cell(2.3, (y + metre) / 4.0, [8, 8], 4.0, 9));
            assert!((a.border - b.border).abs() <= metre * 1.01, "at {y}: {} and {}", a.border, b.border);
        }
    }
}
