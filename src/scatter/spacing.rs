//! Minimum distance between trees: a tree is rejected if an earlier one is too near.

use glam::DVec2;

use super::stand::Area;

const END: u32 = u32::MAX;

/// A grid of linked lists over the area. The cells hold about one tree each and are no smaller than the distance, so a
/// query reads nine at most and memory grows with the trees, not with area over distance.
pub(super) struct SpacingGrid {
    origin: DVec2,
    per_cell: f64,
    columns: usize,
    rows: usize,
    distance: f64,
    heads: Vec<u32>,
    points: Vec<(DVec2, u32)>,
}

impl SpacingGrid {
    /// For about `count` trees in `area`, `distance` metres apart.
    pub fn new(area: Area, distance: f64, count: f64) -> Self {
        let size = area.size();
        let spacing = (size.x * size.y / count.max(1.0)).sqrt();
        // The last term bounds the cells of an area that is nearly a line.
        let cell = distance.max(spacing).max(size.max_element() / 65_536.0);
        let (columns, rows) = ((size.x / cell) as usize + 1, (size.y / cell) as usize + 1);
        Self {
            origin: area.min,
            per_cell: cell.recip(),
            columns,
            rows,
            distance,
            heads: vec![END; columns * rows],
            points: Vec::with_capacity(count as usize),
        }
    }

    /// Adds `point` unless an earlier point is nearer than the distance. Returns whether it was added.
    pub fn insert(&mut self, point: DVec2) -> bool {
        let cell_of = |p: DVec2| {
            let cell = ((p - self.origin) * self.per_cell).max(DVec2::ZERO);
            ((cell.x as usize).min(self.columns - 1), (cell.y as usize).min(self.rows - 1))
        };
        let (first, last) = (cell_of(point - self.distance), cell_of(point + self.distance));
        let limit = self.distance * self.distance;
        for row in first.1..=last.1 {
            for column in first.0..=last.0 {
                let mut next = self.heads[row * self.columns + column];
                while let Some((other, following)) = self.points.get(next as usize) {
                    if other.distance_squared(point) < limit {
                        return false;
                    }
                    next = *following;
                }
            }
        }
        let (column, row) = cell_of(point);
        let head = &mut self.heads[row * self.columns + column];
        self.points.push((point, *head));
        *head = (self.points.len() - 1) as u32;
        true
    }
}
