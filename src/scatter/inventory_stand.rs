//! From the rows of an inventory to a stand on a ground.

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::ops::Range;

use glam::DVec3;

use super::inventory::InventoryTree;
use super::stand::{Ground, MAX_SCALE, MIN_SCALE, Stand, Tree, sink};
use super::{Allometry, ScatterError, Stream};
use crate::math::hash;

/// Two trees nearer than this are one tree that is listed twice, metres.
const SAME_PLACE_M: f64 = 0.01;

/// Lines that a message of the warnings lists.
const LISTED: usize = 5;
/// Names of species that a message of the warnings lists.
const NAMES_LISTED: usize = 12;

/// The plants and sizes of a species of an inventory.
#[derive(Clone, Debug, PartialEq)]
pub struct InventorySpecies {
    /// Its name in the file; letter case and surrounding blanks do not count.
    pub name: String,
    /// Indices of the species' plants; each tree picks one at random.
    pub variants: Range<u16>,
    /// Height of each variant's plant at scale 1, metres, as many as there are variants.
    pub plant_heights_m: Vec<f32>,
    /// Height of a tree of which neither height nor dbh is known, metres.
    pub default_height_m: f32,
    /// Height of a tree of which only the dbh is known.
    pub allometry: Allometry,
    /// Radius of the trunk at the ground at scale 1, root flare included, metres; sinks the foot on slopes.
    pub trunk_radius_m: f32,
}

impl InventorySpecies {
    fn validate(&self) -> Result<(), ScatterError> {
        let fail = |message: String| Err(ScatterError::Species { species: self.name.clone(), message });
        if self.variants.is_empty() || self.plant_heights_m.len() != self.variants.len() {
            return fail(format!(
                "{} variants with {} plant heights: give at least one variant and a height for each",
                self.variants.len(),
                self.plant_heights_m.len()
            ));
        }
        let usable = |metres: f32| metres.is_finite() && metres > 0.0;
        if let Some(bad) = self.plant_heights_m.iter().find(|&&height| !usable(height)) {
            return fail(format!("a plant height of {bad} m: give finite metres above 0"));
        }
        if !usable(self.default_height_m) {
            return fail(format!("a default height of {} m: give finite metres above 0", self.default_height_m));
        }
        if !(0.0..=20.0).contains(&self.trunk_radius_m) {
            return fail(format!("a trunk radius of {} m: give metres from 0 to 20", self.trunk_radius_m));
        }
        Ok(())
    }
}

/// Rows of an inventory that could not be used as written. Lines are those of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InventoryWarnings {
    /// Lines of trees outside the ground; they are left out.
    pub outside: Vec<u64>,
    /// Lines of trees within 1 cm of an earlier one, with that one's line; they are left out. The thickest of them gives
    /// the size of the tree: they are stems of one.
    pub duplicates: Vec<(u64, u64)>,
    /// Species that the table lacks, with the number of their trees; drawn as the table's first.
    pub unknown_species: BTreeMap<String, usize>,
    /// Species that the table has under a shorter name (without cultivar, without epithet), with that name and the number
    /// of their trees.
    pub shortened_species: BTreeMap<String, (String, usize)>,
    /// Lines of trees so much smaller or larger than their plant that they are drawn at the limit of the scale.
    pub rescaled: Vec<u64>,
}

impl InventoryWarnings {
    /// Whether the whole inventory was used as written.
    pub fn is_empty(&self) -> bool {
        self.outside.is_empty()
            && self.duplicates.is_empty()
            && self.unknown_species.is_empty()
            && self.shortened_species.is_empty()
            && self.rescaled.is_empty()
    }
}

impl fmt::Display for InventoryWarnings {
    /// One line for each kind of warning, each ended by a newline.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lines = |lines: &mut dyn Iterator<Item = u64>| {
            lines.take(LISTED).map(|line| line.to_string()).collect::<Vec<_>>().join(", ")
        };
        if !self.outside.is_empty() {
            let (count, first) = (self.outside.len(), lines(&mut self.outside.iter().copied()));
            writeln!(f, "{count} tree(s) outside the terrain are left out; the first in line(s) {first}")?;
        }
        if !self.duplicates.is_empty() {
            let (count, first) = (self.duplicates.len(), lines(&mut self.duplicates.iter().map(|pair| pair.0)));
            writeln!(
                f,
                "{count} tree(s) at the position of an earlier one are left out, the thickest stem counts; the first in \
                 line(s) {first}"
            )?;
        }
        if !self.unknown_species.is_empty() {
            let names = most_frequent(self.unknown_species.iter().map(|(name, count)| (name.clone(), *count)));
            writeln!(f, "species without an entry are drawn as the first one: {names}")?;
        }
        if !self.shortened_species.is_empty() {
            let names = self.shortened_species.iter();
            let names = most_frequent(names.map(|(name, (short, count))| (format!("{name} as {short}"), *count)));
            writeln!(f, "species are drawn by the entry of a shorter name: {names}")?;
        }
        if !self.rescaled.is_empty() {
            let (count, first) = (self.rescaled.len(), lines(&mut self.rescaled.iter().copied()));
            writeln!(
                f,
                "{count} tree(s) are beyond {MIN_SCALE} to {MAX_SCALE} times their plant and drawn at that limit; the \
                 first in line(s) {first}"
            )?;
        }
        Ok(())
    }
}

/// Names with their counts for a message: all of a few, the most frequent of many.
fn most_frequent(names: impl Iterator<Item = (String, usize)>) -> String {
    let mut names: Vec<(String, usize)> = names.collect();
    let more = names.len().saturating_sub(NAMES_LISTED);
    if more > 0 {
        names.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
        names.truncate(NAMES_LISTED);
    }
    let mut text = names.iter().map(|(name, count)| format!("{name} ({count})")).collect::<Vec<_>>().join(", ");
    if more > 0 {
        text.push_str(&format!(" and {more} more"));
    }
    text
}

/// A stand from an inventory, and what to tell the user.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InventoryStand {
    /// The trees in the order of the rows; [`Tree::index`] is the row's index, from 0.
    pub stand: Stand,
    /// What was left out or changed.
    pub warnings: InventoryWarnings,
}

/// Puts the trees of an inventory on `ground`.
///
/// `to_local` maps x and y of the file to scene-local metres (X and Z of the result count). `species` is the table of
/// what is drawn; a name that it lacks is looked up without cultivar, then without epithet; its first entry serves trees
/// without a species or of one that is not in the table. Of rows at one place the thickest counts. The height is the row's, else from its dbh by the species' [`Allometry`], else the species' default; the tree's scale is that height
/// over its plant's. Yaw, tint and the variant come from `seed` and the row's index.
///
/// # Errors
/// [`ScatterError::NoSpecies`] for an empty table, [`ScatterError::Species`] for an entry that nothing can be drawn
/// from, [`ScatterError::TooManyTrees`] beyond 2³² - 1 rows.
pub fn stand_from_inventory<G: Ground + ?Sized>(
    rows: &[InventoryTree],
    to_local: impl Fn(f64, f64) -> DVec3,
    ground: &G,
    species: &[InventorySpecies],
    seed: u64,
) -> Result<InventoryStand, ScatterError> {
    let default = species.first().ok_or(ScatterError::NoSpecies)?;
    species.iter().try_for_each(InventorySpecies::validate)?;
    if u32::try_from(rows.len()).is_err() {
        return Err(ScatterError::TooManyTrees { count: rows.len() as f64, limit: u32::MAX });
    }
    let table: HashMap<String, &InventorySpecies> =
        species.iter().rev().map(|entry| (key(&entry.name), entry)).collect();
    let mut result = InventoryStand::default();
    let mut taken = Places::default();
    let thickest = thickest_stems(rows, &to_local);
    for (row, index) in rows.iter().zip(0u32..) {
        let point = to_local(row.x, row.y);
        let known = point.x.is_finite() && point.z.is_finite() && ground.contains(point.x, point.z);
        let height = if known { ground.height(point.x, point.z) } else { f64::NAN };
        if !height.is_finite() {
            result.warnings.outside.push(row.line);
            continue;
        }
        if let Some(first) = taken.earlier(point.x, point.z, row.line) {
            result.warnings.duplicates.push((row.line, first));
            continue;
        }
        let entry = match &row.species {
            None => default,
            Some(name) => match lookup(&table, name) {
                Some((entry, None)) => entry,
                Some((entry, Some(short))) => {
                    let found = result.warnings.shortened_species.entry(name.trim().to_owned());
                    found.or_insert((short, 0)).1 += 1;
                    entry
                }
                None => {
                    *result.warnings.unknown_species.entry(name.trim().to_owned()).or_default() += 1;
                    default
                }
            },
        };
        let n = u64::from(row.place.unwrap_or(index));
        let variant = hash::below(seed, n, Stream::Variant, entry.variants.len() as u32) as u16;
        let stem = thickest.get(&row.line).and_then(|at| rows.get(*at)).unwrap_or(row);
        let tree_height = stem
            .height_m
            .or_else(|| entry.allometry.height_m(stem.dbh_m?))
            .map_or(entry.default_height_m, |metres| metres as f32);
        let plant_height = entry.plant_heights_m.get(usize::from(variant)).copied().unwrap_or(entry.default_height_m);
        let wanted = tree_height / plant_height;
        let scale = wanted.clamp(MIN_SCALE, MAX_SCALE);
        if scale != wanted {
            result.warnings.rescaled.push(row.line);
        }
        let slope = ground.slope(point.x, point.z);
        let sunk = if slope.is_finite() { sink(entry.trunk_radius_m * scale, slope) } else { 0.0 };
        result.stand.trees.push(Tree {
            position: DVec3::new(point.x, height - sunk, point.z),
            yaw: hash::angle_f32(seed, n, Stream::Yaw),
            scale,
            variant: entry.variants.start + variant,
            tint: hash::unit_f32(seed, n, Stream::Tint) * 2.0 - 1.0,
            index,
        });
    }
    Ok(result)
}

/// Rows of several stems at one place: for the line of the first row of a place the index of the row with the thickest
/// stem, where that is another one.
fn thickest_stems(rows: &[InventoryTree], to_local: &impl Fn(f64, f64) -> DVec3) -> HashMap<u64, usize> {
    let mut places = Places::default();
    let mut thickest: HashMap<u64, usize> = HashMap::new();
    let mut first_row: HashMap<u64, usize> = HashMap::new();
    let size = |row: &InventoryTree| (row.dbh_m.unwrap_or(0.0), row.height_m.unwrap_or(0.0));
    for (at, row) in rows.iter().enumerate() {
        let point = to_local(row.x, row.y);
        if !(point.x.is_finite() && point.z.is_finite()) {
            continue;
        }
        match places.earlier(point.x, point.z, row.line) {
            None => {
                first_row.insert(row.line, at);
            }
            Some(first) => {
                let best = thickest.get(&first).or(first_row.get(&first)).and_then(|best| rows.get(*best));
                if best.is_some_and(|best| size(row) > size(best)) {
                    thickest.insert(first, at);
                }
            }
        }
    }
    thickest
}

/// The name in lower case, with single blanks, and the sign of a hybrid as the letter x.
fn key(name: &str) -> String {
    let plain = name.to_lowercase().replace('×', " x ");
    plain.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The entry of a species: of its name, of the name without what follows it (cultivar, author, common name), of its first
/// two words, of its genus; with the shorter name that was found.
fn lookup<'a>(
    table: &HashMap<String, &'a InventorySpecies>,
    name: &str,
) -> Option<(&'a InventorySpecies, Option<String>)> {
    let whole = key(name);
    if let Some(entry) = table.get(&whole) {
        return Some((*entry, None));
    }
    let end = whole.find(['(', '\'', '‘', '’', '"', '„', '“', ',', ';', ':', '/', '[', '\u{b4}', '`']);
    let bare = whole.get(..end.unwrap_or(whole.len())).unwrap_or(&whole).trim();
    let bare = bare.split(" - ").next().unwrap_or(bare).trim();
    let words: Vec<&str> = bare.split(' ').collect();
    let hybrid = words.get(1) == Some(&"x");
    let two = words.iter().take(if hybrid { 3 } else { 2 }).copied().collect::<Vec<_>>().join(" ");
    let genus = words.first().copied().unwrap_or("");
    let shorter = [
        bare.to_owned(),
        two,
        genus.to_owned(),
        format!("{genus} sp."),
        format!("{genus} spp."),
        format!("{genus} sp"),
    ];
    shorter.into_iter().find_map(|short| Some((*table.get(&short)?, Some(short))))
}

/// Positions of earlier trees, in squares of the distance below which two are the same.
#[derive(Default)]
struct Places {
    squares: HashMap<(i64, i64), Vec<(f64, f64, u64)>>,
}

impl Places {
    /// The line of an earlier tree at this position; if there is none, this one is remembered.
    fn earlier(&mut self, x: f64, z: f64, line: u64) -> Option<u64> {
        let (column, row) = ((x / SAME_PLACE_M).floor() as i64, (z / SAME_PLACE_M).floor() as i64);
        let around = (-1..=1).flat_map(|dz| (-1..=1).map(move |dx| (dx, dz)));
        let earlier = around
            .filter_map(|(dx, dz)| self.squares.get(&(column.saturating_add(dx), row.saturating_add(dz))))
            .flatten()
            .filter(|(other_x, other_z, _)| (other_x - x).hypot(other_z - z) < SAME_PLACE_M)
            .map(|&(_, _, line)| line)
            .min();
        if earlier.is_none() {
            self.squares.entry((column, row)).or_default().push((x, z, line));
        }
        earlier
    }
}
