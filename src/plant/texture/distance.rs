//! The exact Euclidean distance transform on a grid, in linear time.

use rayon::prelude::*;

/// For every texel of a grid, the nearest site.
#[derive(Clone, Debug)]
pub struct NearestSites {
    /// Width of the grid in texels.
    pub width: usize,
    /// Column and row of the nearest site of each texel, row by row; `None` throughout if there is no site.
    pub nearest: Vec<Option<[u32; 2]>>,
}

impl NearestSites {
    /// Distance from texel (`x`, `y`) to its nearest site's centre in texels; infinite where there is none.
    pub fn distance(&self, x: usize, y: usize) -> f32 {
        self.nearest.get(y * self.width + x).copied().flatten().map_or(f32::INFINITY, |[sx, sy]| {
            let (dx, dy) = (f64::from(sx) - x as f64, f64::from(sy) - y as f64);
            (dx * dx + dy * dy).sqrt() as f32
        })
    }
}

/// Finds the nearest site of every texel of a `width` x `sites.len() / width` grid, exactly, in O(texels).
///
/// Columns first, by two scans; then each row as the lower envelope of the parabolas
/// `(x - i)^2 + column_distance(i)^2` [Felzenszwalb & Huttenlocher 2012, "Distance transforms of sampled
/// functions", section 2.1; the integer form of Meijster, Roerdink & Hesselink 2000]. Of equally near sites
/// the same one is always chosen. Excess values that do not fill a row, and a width of 0, give an empty result.
pub fn nearest_sites(sites: &[bool], width: usize) -> NearestSites {
    let height = sites.len().checked_div(width).unwrap_or(0);
    if width * height != sites.len() || height == 0 {
        return NearestSites { width, nearest: Vec::new() };
    }
    let columns = nearest_in_columns(sites, width, height);
    let mut nearest = vec![None; sites.len()];
    nearest.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        nearest_in_row(&columns[y * width..][..width], y as i64, row);
    });
    NearestSites { width, nearest }
}

/// Row of the nearest site in the same column, or [`NO_SITE`].
fn nearest_in_columns(sites: &[bool], width: usize, height: usize) -> Vec<u32> {
    let mut rows = vec![NO_SITE; sites.len()];
    for y in 0..height {
        for x in 0..width {
            let at = y * width + x;
            rows[at] = if sites[at] {
                y as u32
            } else if y > 0 {
                rows[at - width]
            } else {
                NO_SITE
            };
        }
    }
    for y in (0..height.saturating_sub(1)).rev() {
        for x in 0..width {
            let at = y * width + x;
            let below = rows[at + width];
            let nearer = rows[at] == NO_SITE || below.abs_diff(y as u32) < rows[at].abs_diff(y as u32);
            if below != NO_SITE && nearer {
                rows[at] = below;
            }
        }
    }
    rows
}

/// A row number that no grid reaches.
const NO_SITE: u32 = u32::MAX;

/// Fills `out` with the nearest sites of row `y`, whose columns' nearest sites lie in the rows `columns`.
fn nearest_in_row(columns: &[u32], y: i64, out: &mut [Option<[u32; 2]>]) {
    let square = |value: i64| value * value;
    let height = |column: usize| square(i64::from(columns[column]) - y);
    // The first column at which the parabola of `right` is not above that of `left` (left < right).
    let meet = |left: usize, right: usize| {
        let (l, r) = (left as i64, right as i64);
        let numerator = square(r) - square(l) + height(right) - height(left);
        let denominator = 2 * (r - l);
        numerator.div_euclid(denominator) + i64::from(numerator.rem_euclid(denominator) > 0)
    };
    // The envelope: columns of the parabolas that form it, and the column at which each begins.
    let mut envelope: Vec<(usize, i64)> = Vec::with_capacity(columns.len());
    for column in (0..columns.len()).filter(|&column| columns[column] != NO_SITE) {
        let mut begin = 0;
        while let Some(&(last, last_begin)) = envelope.last() {
            begin = meet(last, column).max(0);
            if begin > last_begin {
                break;
            }
            envelope.pop();
            begin = 0;
        }
        if begin < columns.len() as i64 {
            envelope.push((column, begin));
        }
    }
    let mut at = 0;
    for (x, site) in out.iter_mut().enumerate() {
        while at + 1 < envelope.len() && envelope[at + 1].1 <= x as i64 {
            at += 1;
        }
        *site = envelope.get(at).map(|&(column, _)| [column as u32, columns[column]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn distances_equal_those_of_a_search(width in 1usize..18, bits in prop::collection::vec(0u8..12, 1..300)) {
            let height = bits.len() / width;
            let sites: Vec<bool> = bits[..width * height].iter().map(|&bit| bit == 0).collect();
            let found = nearest_sites(&sites, width);
            for y in 0..height {
                for x in 0..width {
                    let searched = (0..sites.len())
                        .filter(|&i| sites[i])
                        .map(|i| (((i % width) as f32 - x as f32).powi(2) + ((i / width) as f32 - y as f32).powi(2)).sqrt())
                        .fold(f32::INFINITY, f32::min);
                    let distance = found.distance(x, y);
                    prop_assert!(distance == searched || (distance - searched).abs() < 1e-4);
                    if let Some([sx, sy]) = found.nearest[y * width + x] {
                        prop_assert!(sites[sy as usize * width + sx as usize]);
                    }
                }
            }
        }
    }

    #[test]
    fn a_grid_that_is_not_whole_gives_nothing() {
        assert!(nearest_sites(&[true; 7], 3).nearest.is_empty());
        assert!(nearest_sites(&[true; 7], 0).nearest.is_empty());
    }
}
