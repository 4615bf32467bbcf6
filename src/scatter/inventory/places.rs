//! What the surveys and variants of a table have in common: the places of their trees.

use std::collections::HashMap;

use glam::DVec2;

use super::text::Row;
use super::{InventoryTree, Reading};

/// The places of all surveys and variants.
pub(super) struct Places {
    numbers: HashMap<[u64; 2], u32>,
    /// Least and greatest coordinates of the trees.
    pub extent: Option<(DVec2, DVec2)>,
}

impl Places {
    /// The number of a place. A tree that was measured anew, at other coordinates, is another one.
    pub fn number(&self, x: f64, y: f64) -> Option<u32> {
        self.numbers.get(&key(x, y)).copied()
    }
}

/// Zero without its sign has one key.
fn key(x: f64, y: f64) -> [u64; 2] {
    [x, y].map(|value| (value + 0.0).to_bits())
}

impl Reading<'_> {
    /// The places of the living trees of all rows, shown or not.
    pub(super) fn places(&mut self, rows: &[Row]) -> Places {
        let mut all: Vec<InventoryTree> = rows.iter().filter_map(|row| self.bare_tree(row)).collect();
        let mut numbers = HashMap::new();
        for tree in &all {
            let next = u32::try_from(numbers.len()).unwrap_or(u32::MAX);
            numbers.entry(key(tree.x, tree.y)).or_insert(next);
        }
        // What is left out is said of the rows that are shown.
        let said = self.notes.len();
        self.leave_out_zeros(&mut all);
        self.leave_out_strays(&mut all);
        self.notes.truncate(said);
        let extent = all.iter().map(|tree| DVec2::new(tree.x, tree.y)).fold(None, |extent, at| {
            let (low, high) = extent.unwrap_or((at, at));
            Some((low.min(at), high.max(at)))
        });
        Places { numbers, extent }
    }

    /// The tree of a row without its sizes, if it lives and has a position.
    fn bare_tree(&self, row: &Row) -> Option<InventoryTree> {
        let coordinate = |axis: usize| {
            let value = self.place.coordinate(axis, &row.cells, self.table.decimal_comma)?;
            // Written so that what is not a number is left out.
            self.place.limit(axis).is_none_or(|(largest, _)| value.abs() <= largest).then_some(value)
        };
        let (x, y) = (coordinate(0)?, coordinate(1)?);
        let tree = InventoryTree { x, y, dbh_m: None, height_m: None, species: None, place: None, line: row.line };
        self.not_a_tree(&row.cells).is_none().then_some(tree)
    }
}
