//! Inventories: the columns and their contents.

use std::{collections::BTreeMap, path::Path};

use glam::DVec2;

use super::page::{Page, length};
use crate::{
    app::AppError,
    math::digits::grouped,
    scatter::{Coordinates, Inventory, InventoryOptions, read_inventory},
};

/// Species that are listed by name.
const LISTED: usize = 12;

pub(super) fn describe_file(page: &mut Page, path: &Path) -> Result<(), AppError> {
    let name = path.display().to_string();
    let inventory = read_inventory(path, InventoryOptions::default())?;
    page.title(format!("{name}: an inventory of {} trees", grouped(inventory.rows.len())));
    page.inset(|page| {
        for column in &inventory.columns {
            let meaning = column.meaning.as_deref().unwrap_or("ignored: unknown column name");
            page.row("column", format!("{}: {meaning}", column.name));
        }
        describe(page, &inventory);
        for note in &inventory.notes {
            page.row("note", note);
        }
    });
    Ok(())
}

/// The contents of the rows.
pub(super) fn describe(page: &mut Page, inventory: &Inventory) {
    let rows = &inventory.rows;
    if rows.is_empty() {
        page.row("trees", "none: the table has no rows");
        return;
    }
    let (low, high) = rows.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), row| {
        let at = DVec2::new(row.x, row.y);
        (low.min(at), high.max(at))
    });
    match inventory.coordinates {
        Coordinates::Planar => {
            let size = high - low;
            let hectares = size.x * size.y * 1e-4;
            let density = if hectares > 0.0 {
                format!(", {:.0} stems per hectare", rows.len() as f64 / hectares)
            } else {
                String::new()
            };
            page.row("system", "metres, x east and y north (of a plot or a projected system)");
            page.row(
                "extent",
                format!(
                    "x {:.2} to {:.2}, y {:.2} to {:.2}: {} x {}{density}",
                    low.x,
                    high.x,
                    low.y,
                    high.y,
                    length(size.x),
                    length(size.y)
                ),
            );
        }
        Coordinates::Geographic => {
            page.row("system", "degrees of longitude and latitude");
            page.row(
                "extent",
                format!("longitude {:.6} to {:.6}, latitude {:.6} to {:.6}", low.x, high.x, low.y, high.y),
            );
        }
    }
    known(page, "dbh", "cm", rows.iter().filter_map(|row| row.dbh_m).map(|metres| 100.0 * metres), rows.len());
    known(page, "height", "m", rows.iter().filter_map(|row| row.height_m), rows.len());
    species(page, inventory);
}

fn known(page: &mut Page, label: &str, unit: &str, values: impl Iterator<Item = f64>, rows: usize) {
    let (mut low, mut high, mut sum, mut count) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0usize);
    for value in values {
        (low, high, sum, count) = (low.min(value), high.max(value), sum + value, count + 1);
    }
    if count == 0 {
        page.row(label, "unknown for all trees");
    } else {
        let whole = if count == rows { "all".to_owned() } else { format!("{} of {}", grouped(count), grouped(rows)) };
        page.row(label, format!("of {whole}: {low:.1} to {high:.1} {unit}, mean {:.1} {unit}", sum / count as f64));
    }
}

fn species(page: &mut Page, inventory: &Inventory) {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for row in &inventory.rows {
        *counts.entry(row.species.as_deref().unwrap_or("")).or_default() += 1;
    }
    let nameless = counts.remove("").unwrap_or(0);
    if counts.is_empty() {
        page.row("species", "unknown for all trees");
        return;
    }
    let mut ranked: Vec<(&str, usize)> = counts.into_iter().collect();
    ranked.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(b.0)));
    let more = ranked.len().saturating_sub(LISTED);
    let mut lines: Vec<String> =
        ranked.iter().take(LISTED).map(|(name, count)| format!("{name}: {}", grouped(*count))).collect();
    if more > 0 {
        lines.push(format!("and {more} more species"));
    }
    if nameless > 0 {
        lines.push(format!("without a name: {}", grouped(nameless)));
    }
    page.row("species", lines.join("\n"));
}
