//! The trees of a scene: scattered by rule, read from an inventory, or none.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec2;
use serde::Deserialize;

use super::check::Check;
use super::error::nearest;
use super::species::{ELEVATIONS, Species};

/// Where the trees stand. In a scene file: `trees: Scattered(...)`, `Inventory(...)` or `None`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub enum Trees {
    /// No trees. The default.
    #[default]
    None,
    /// Placed by rule.
    Scattered(ScatteredTrees),
    /// Read from a CSV file.
    Inventory(InventoryTrees),
}

/// Placement rules.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ScatteredTrees {
    /// Stems per hectare of ground where trees stand (clearings, cliffs and the like not counted), 0.01 to 100000.
    /// Default 300.
    pub stems_per_hectare: f64,
    /// The sequence of points. Default `Halton`.
    pub sequence: Sequence,
    /// Least distance between two stems in metres, 0 to 100; discs of this diameter must leave room for all stems.
    /// Default 0: none.
    pub min_distance: f64,
    /// Steepest wooded ground in degrees, 0 to 90. Default 50.
    pub slope_limit: f64,
    /// Range of wooded ground heights in metres above the terrain's datum. Default: everywhere.
    pub elevation: Option<(f64, f64)>,
    /// The wooded part of the terrain. Default: all of it.
    pub area: Option<Area>,
    /// Clearings. Default: none.
    pub clearings: Option<Clearings>,
}

impl Default for ScatteredTrees {
    fn default() -> Self {
        Self {
            stems_per_hectare: 300.0,
            sequence: Sequence::Halton,
            min_distance: 0.0,
            slope_limit: 50.0,
            elevation: None,
            area: None,
            clearings: None,
        }
    }
}

/// A sequence of points in the unit square ([Franzke 2005], 4.3.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Sequence {
    /// Halton's, bases 2 and 3: evenly spread, and any prefix of it is.
    Halton,
    /// Hammersley's, base 2: a little more even, for a number of points known beforehand.
    Hammersley,
    /// Independent random points: clumps and gaps, to compare with.
    Random,
}

/// A rectangle in metres from the terrain's centre, east and north positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Area {
    /// Western edge, below `east`. Required.
    pub west: f64,
    /// Southern edge, below `north`. Required.
    pub south: f64,
    /// Eastern edge. Required.
    pub east: f64,
    /// Northern edge. Required.
    pub north: f64,
}

/// Treeless patches where smooth noise is high.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Clearings {
    /// Distance between clearings in metres, about, 1 to 100000. Default 400.
    pub wavelength: f64,
    /// Share of the ground that they cover, about, 0 to 1. Default 0.1.
    pub share: f64,
    /// Width of the margin in which trees thin out, as a fraction of the wavelength, 0 (sharp) to 1. Default 0.15.
    pub edge: f64,
}

impl Default for Clearings {
    fn default() -> Self {
        Self { wavelength: 400.0, share: 0.1, edge: 0.15 }
    }
}

/// Trees from a CSV file with a header line. Columns are found by name: `x` and `y` in metres (required), `dbh`,
/// `height` and `species`; a unit in a column's name (`dbh_cm`, `height_m`) overrides the one stated here.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InventoryTrees {
    /// The file, relative to the scene file. Required.
    pub path: PathBuf,
    /// Unit of `dbh` (trunk diameter at breast height) where the column does not say. Default `Centimetres`.
    #[serde(default = "centimetres")]
    pub dbh_unit: LengthUnit,
    /// Unit of `height` where the column does not say. Default `Metres`.
    #[serde(default)]
    pub height_unit: LengthUnit,
    /// What the coordinates are measured from; x grows eastward, y northward. Default `Centre`.
    #[serde(default)]
    pub anchor: Anchor,
    /// Height in metres of trees that have neither height nor diameter, 0.1 to 150. Default: the mean of their
    /// species' range.
    #[serde(default)]
    pub default_height: Option<f64>,
    /// The scene's species for each name in the file's `species` column: `{"Quercus alba": "oak"}`. Names that are
    /// the scene's own need no entry. Default: empty.
    #[serde(default)]
    pub species: BTreeMap<String, String>,
    /// The species of trees without a name, or with one that neither the scene nor `species` knows. Default: the
    /// scene's first.
    #[serde(default)]
    pub default_species: Option<String>,
}

/// A unit of length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum LengthUnit {
    /// 1 m.
    #[default]
    Metres,
    /// 0.01 m.
    Centimetres,
    /// 0.001 m.
    Millimetres,
}

impl LengthUnit {
    /// One of this unit, in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::Metres => 1.0,
            Self::Centimetres => 0.01,
            Self::Millimetres => 0.001,
        }
    }
}

/// What an inventory's coordinates are measured from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum Anchor {
    /// From the terrain's centre.
    #[default]
    Centre,
    /// From the terrain's south-western corner, as plot coordinates mostly are.
    SouthWest,
    /// The middle of the stand's bounding box is put on the terrain's centre, whatever its coordinates.
    Middle,
    /// The terrain file's own coordinates: easting and northing, or degrees of longitude and latitude.
    Terrain,
}

impl Anchor {
    /// The inventory coordinates (east, north, in metres) of the terrain's centre: a tree at `(x, y)` stands
    /// `x - origin.x` east and `y - origin.y` north of it.
    ///
    /// `stand` are the least and the greatest coordinates of the stand and `extent` the terrain's size, all in metres.
    /// `None` for [`Anchor::Terrain`]: there the terrain's own georeference leads from coordinates to places.
    pub fn origin(self, stand: (DVec2, DVec2), extent: DVec2) -> Option<DVec2> {
        match self {
            Self::Centre => Some(DVec2::ZERO),
            Self::SouthWest => Some(0.5 * extent),
            Self::Middle => Some(0.5 * (stand.0 + stand.1)),
            Self::Terrain => None,
        }
    }
}

fn centimetres() -> LengthUnit {
    LengthUnit::Centimetres
}

impl InventoryTrees {
    /// The trees of the CSV file `path`, with the defaults of a scene file.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self {
            path: path.into(),
            dbh_unit: centimetres(),
            height_unit: LengthUnit::default(),
            anchor: Anchor::default(),
            default_height: None,
            species: BTreeMap::new(),
            default_species: None,
        }
    }
}

impl From<ScatteredTrees> for Trees {
    fn from(rules: ScatteredTrees) -> Self {
        Self::Scattered(rules)
    }
}

impl From<InventoryTrees> for Trees {
    fn from(inventory: InventoryTrees) -> Self {
        Self::Inventory(inventory)
    }
}

impl Trees {
    pub(super) fn check(&self, species: &[Species], check: &mut Check) {
        if matches!(self, Self::None) {
            return;
        }
        if species.is_empty() {
            check.problem(
                "species",
                "is empty, but `trees` asks for trees",
                "add `species: [(name: \"oak\", plant: Grown(form: Broadleaf))]`, or write `trees: None`",
            );
        }
        match self {
            Self::None => {}
            Self::Scattered(rules) => rules.check(check),
            Self::Inventory(inventory) => inventory.check(species, check),
        }
    }

    pub(super) fn resolve(&mut self, folder: &Path) {
        if let Self::Inventory(inventory) = self {
            inventory.path = folder.join(&inventory.path);
        }
    }
}

impl ScatteredTrees {
    fn check(&self, check: &mut Check) {
        check.number("trees.stems_per_hectare", self.stems_per_hectare, 0.01..=100_000.0, "stems/ha");
        check.number("trees.min_distance", self.min_distance, 0.0..=100.0, "m");
        check.number("trees.slope_limit", self.slope_limit, 0.0..=90.0, "degrees");
        if let Some(elevation) = self.elevation {
            check.interval("trees.elevation", elevation, ELEVATIONS, "m");
        }
        if let Some(area) = self.area {
            area.check(check);
        }
        if let Some(clearings) = self.clearings {
            check.number("trees.clearings.wavelength", clearings.wavelength, 1.0..=100_000.0, "m");
            check.number("trees.clearings.share", clearings.share, 0.0..=1.0, "");
            check.number("trees.clearings.edge", clearings.edge, 0.0..=1.0, "");
        }
    }
}

impl Area {
    fn check(&self, check: &mut Check) {
        let mut finite = true;
        for (name, value) in [("west", self.west), ("south", self.south), ("east", self.east), ("north", self.north)] {
            finite &= check.number(&format!("trees.area.{name}"), value, -1e7..=1e7, "m");
        }
        if finite && self.west >= self.east {
            check.problem(
                "trees.area.west",
                format!("is {} m, not west of `east` ({} m)", self.west, self.east),
                "exchange the two, or widen the area",
            );
        }
        if finite && self.south >= self.north {
            check.problem(
                "trees.area.south",
                format!("is {} m, not south of `north` ({} m)", self.south, self.north),
                "exchange the two, or widen the area",
            );
        }
    }
}

impl InventoryTrees {
    fn check(&self, species: &[Species], check: &mut Check) {
        check.path("trees.path", &self.path);
        if let Some(height) = self.default_height {
            check.number("trees.default_height", height, 0.1..=150.0, "m");
        }
        let known: Vec<&str> = species.iter().map(|one| one.name.as_str()).collect();
        for (theirs, ours) in &self.species {
            unknown_species(&format!("trees.species.{theirs}"), ours, &known, check);
        }
        if let Some(ours) = &self.default_species {
            unknown_species("trees.default_species", ours, &known, check);
        }
    }
}

fn unknown_species(field: &str, name: &str, known: &[&str], check: &mut Check) {
    if known.contains(&name) {
        return;
    }
    let list = known.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let remedy = match nearest(name, known) {
        Some(meant) => format!("did you mean `{meant}`? The scene's species are {list}"),
        None => format!("the scene's species are {list}"),
    };
    check.problem(field, format!("is `{name}`, no species of this scene"), remedy);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anchors_put_a_stand_where_they_say() {
        let stand = (DVec2::new(500_100.0, 4_000_000.0), DVec2::new(500_300.0, 4_000_100.0));
        let extent = DVec2::new(400.0, 200.0);
        let place = |anchor: Anchor, tree: DVec2| anchor.origin(stand, extent).map(|origin| tree - origin);
        assert_eq!(place(Anchor::Centre, DVec2::new(3.0, 4.0)), Some(DVec2::new(3.0, 4.0)));
        assert_eq!(place(Anchor::SouthWest, DVec2::ZERO), Some(DVec2::new(-200.0, -100.0)));
        assert_eq!(place(Anchor::Middle, stand.0), Some(DVec2::new(-100.0, -50.0)));
        assert_eq!(place(Anchor::Terrain, stand.0), None);
    }
}
