//! What an inventory lists.

use canopy::scatter::Inventory;

/// Position, diameter, height, species and line of a tree.
pub type Listed<'a> = (f64, f64, Option<f64>, Option<f64>, Option<&'a str>, u64);

/// All trees of an inventory.
pub fn listed(inventory: &Inventory) -> Vec<Listed<'_>> {
    let rows = inventory.rows.iter();
    rows.map(|tree| (tree.x, tree.y, tree.dbh_m, tree.height_m, tree.species.as_deref(), tree.line)).collect()
}
