//! A regular grid of heights in metres.

use std::fmt;

use glam::DVec2;

use super::TerrainError;

/// The largest magnitude of a height, in metres. Far above any terrain, and low enough that no interpolation of
/// finite heights overflows.
pub const MAX_HEIGHT: f32 = 1.0e6;

/// The most samples a height field may have (2^28: 1 GiB of heights, or 16384 x 16384).
pub const MAX_SAMPLES: usize = 1 << 28;

/// A validated grid of heights: at least 2x2 finite samples.
///
/// Local frame: the origin is the centre of the grid, x points east, z south. Column `c` lies at
/// `x = (c - (columns - 1) / 2) * spacing.x`, row `r` at `z = (r - (rows - 1) / 2) * spacing.y`.
#[derive(Clone, PartialEq)]
pub struct HeightField {
    columns: usize,
    rows: usize,
    spacing: DVec2,
    heights: Vec<f32>,
}

impl HeightField {
    /// Makes a field of `columns` (west to east) times `rows` (north to south) samples; `heights` holds them row by
    /// row in metres above the datum, `spacing` is the distance of neighbours in metres (x: between columns, y:
    /// between rows).
    ///
    /// # Errors
    /// Less than 2x2 or more than [`MAX_SAMPLES`] samples, a count that does not fit, a spacing outside 1e-3 m to
    /// 1e6 m, a height that is not finite or beyond [`MAX_HEIGHT`].
    pub fn new(columns: usize, rows: usize, spacing: DVec2, heights: Vec<f32>) -> Result<Self, TerrainError> {
        if columns < 2 || rows < 2 {
            return Err(TerrainError::TooSmall { columns, rows });
        }
        match columns.checked_mul(rows) {
            Some(count) if count <= MAX_SAMPLES => {
                if count != heights.len() {
                    return Err(TerrainError::WrongCount { heights: heights.len(), columns, rows });
                }
            }
            _ => return Err(TerrainError::TooLarge { columns, rows, limit: MAX_SAMPLES }),
        }
        for value in [spacing.x, spacing.y] {
            if !(1.0e-3..=1.0e6).contains(&value) {
                return Err(TerrainError::BadParameter {
                    name: "the spacing of the samples",
                    value,
                    range: "0.001 m to 1000000 m",
                });
            }
        }
        // `abs() <= limit` is false for NaN too.
        if let Some(at) = heights.iter().position(|h| h.is_nan() || h.abs() > MAX_HEIGHT) {
            return Err(TerrainError::BadHeight {
                column: at % columns,
                row: at / columns,
                height: heights[at],
                limit: MAX_HEIGHT,
            });
        }
        Ok(Self { columns, rows, spacing, heights })
    }

    /// Samples from west to east, at least 2.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Samples from north to south, at least 2.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Distance between columns (x) and between rows (y) in metres, both positive.
    pub fn spacing(&self) -> DVec2 {
        self.spacing
    }

    /// The heights in metres above the datum, row by row from the north, each row from the west.
    pub fn heights(&self) -> &[f32] {
        &self.heights
    }

    /// Size of the area between the outermost samples in metres (x: west to east, y: north to south).
    pub fn extent(&self) -> DVec2 {
        DVec2::new((self.columns - 1) as f64, (self.rows - 1) as f64) * self.spacing
    }

    /// Local position (x east, z south, metres) of a sample. Indices outside the grid give the position where that
    /// sample would be.
    pub fn position(&self, column: usize, row: usize) -> DVec2 {
        let centre = DVec2::new((self.columns - 1) as f64, (self.rows - 1) as f64) * 0.5;
        (DVec2::new(column as f64, row as f64) - centre) * self.spacing
    }

    /// The heights of the lowest and the highest sample in metres.
    pub fn min_max(&self) -> (f32, f32) {
        self.heights.iter().fold((f32::MAX, f32::MIN), |(low, high), &h| (low.min(h), high.max(h)))
    }
}

impl fmt::Debug for HeightField {
    /// Size and range; the heights themselves would fill the screen.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("HeightField")
            .field("columns", &self.columns)
            .field("rows", &self.rows)
            .field("spacing", &self.spacing)
            .field("min_max", &self.min_max())
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_fields_are_refused_with_the_place_of_the_fault() {
        let spacing = DVec2::splat(10.0);
        assert!(matches!(HeightField::new(1, 5, spacing, vec![0.0; 5]), Err(TerrainError::TooSmall { .. })));
        assert!(matches!(HeightField::new(5, 1, spacing, vec![0.0; 5]), Err(TerrainError::TooSmall { .. })));
        assert!(matches!(HeightField::new(2, 2, spacing, vec![0.0; 5]), Err(TerrainError::WrongCount { .. })));
        assert!(matches!(HeightField::new(usize::MAX, 9, spacing, vec![]), Err(TerrainError::TooLarge { .. })));
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let made = HeightField::new(2, 2, DVec2::new(1.0, bad), vec![0.0; 4]);
            assert!(matches!(made, Err(TerrainError::BadParameter { .. })));
        }
        for bad in [f32::NAN, f32::INFINITY, -2.0e6] {
            let made = HeightField::new(3, 2, spacing, vec![0.0, 0.0, 0.0, 0.0, bad, 0.0]);
            assert!(matches!(made, Err(TerrainError::BadHeight { column: 1, row: 1, .. })));
        }
    }
}
