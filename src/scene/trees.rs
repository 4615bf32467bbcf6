//! The trees of a scene: scattered by rule, read from an inventory, or none.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use glam::DVec2;
use serde::Deserialize;

use super::check::Check;
use super::error::nearest;
use super::species::{ELEVATIONS, Species};
use crate::scatter::{Area, ClearingNoise, LengthUnit, Sequence};
use crate::terrain::CoordinateSystem;

/// Where the trees stand. In a scene file: `trees: Scattered(...)`, `Inventory(...)` or `None`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub enum Trees {
    /// No trees. The default.
    #[default]
    None,
    /// Placed by rule.
    Scattered(ScatteredTrees),
    /// Read from a table of text, GeoJSON, a shapefile or a GeoPackage.
    Inventory(InventoryTrees),
}

/// Placement rules for all species of a scene.
///
/// [`PlacementRules`](crate::scatter::PlacementRules) are the same for known ground and plants: angles in radians, the
/// area cut to the terrain, and the scene's seed and species.
#[derive(Clone, Debug, PartialEq, Deserialize, bevy::reflect::Reflect)]
#[serde(deny_unknown_fields, default)]
pub struct ScatteredTrees {
    /// Stems per hectare of ground where trees stand (clearings, cliffs and the like not counted), 0.01 to 100000.
    /// Default 300.
    pub stems_per_hectare: f64,
    /// The sequence of points, `Halton`, `Hammersley` or `Random` [Franzke 2005, 4.3.3]. Default `Halton`.
    pub sequence: Sequence,
    /// Least distance between two stems in metres, 0 to 100; discs of this diameter must leave room for all stems.
    /// Default 0: none.
    pub min_distance: f64,
    /// Steepest wooded ground in degrees, 0 to 90. Default 50.
    pub slope_limit: f64,
    /// Range of wooded ground heights in metres above the terrain's datum. Default: everywhere.
    pub elevation: Option<(f64, f64)>,
    /// The wooded part of the terrain, `(west: ..., south: ..., east: ..., north: ...)` in metres from its centre, east
    /// and north positive. Default: all of it.
    pub area: Option<Area>,
    /// Metres beyond the terrain's data over which the wood goes on by the same rules, 0 (it ends with the data) to 50000;
    /// without effect where `area` says where it ends. In the outer half it thins out into ground that has the colour of
    /// crowns. Default: 1000 in a scene, or less where that would be more than twice the trees of the data or farther than
    /// `quality.view_distance`; 0 for a forest that a program spawns.
    pub surroundings: Option<f64>,
    /// Treeless patches where smooth noise is high: `(wavelength: 400, share: 0.1, edge: 0.15)`. Default: none.
    pub clearings: Option<ClearingNoise>,
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
            surroundings: None,
            clearings: None,
        }
    }
}

/// Trees from a table of text (CSV) with a header line, from GeoJSON, from a shapefile, or from a GeoPackage (cargo feature
/// `geopackage`). Columns are found by name in the words of the large public tables
/// ([`scatter::inventory`](crate::scatter::inventory)): `x` and `y` in metres or `lon` and `lat` (required), `dbh` or a
/// girth, `height`, `species`; a unit in a column's name or a cell (`dbh_cm`, `12 m`) overrides the one stated here.
#[derive(Clone, Debug, PartialEq, Deserialize, bevy::reflect::Reflect)]
#[serde(deny_unknown_fields)]
pub struct InventoryTrees {
    /// The file, relative to the scene file. Required.
    pub path: PathBuf,
    /// Unit of `dbh` (trunk diameter at breast height) where neither the column nor its cells say: `Metres`,
    /// `Centimetres`, `Millimetres`, `Inches`. Default: guessed from the values with a warning, mostly `Centimetres`.
    #[serde(default)]
    pub dbh_unit: Option<LengthUnit>,
    /// Unit of `height` where neither the column nor its cells say: the same, or `Feet`. Default: guessed from the values
    /// with a warning, mostly `Metres`.
    #[serde(default)]
    pub height_unit: Option<LengthUnit>,
    /// The year of a table of repeated surveys. Default: its last; of years without rows the one before.
    #[serde(default)]
    pub year: Option<i32>,
    /// The variant or scenario of a table that has several. Default: its first.
    #[serde(default)]
    pub variant: Option<String>,
    /// The layer of a GeoPackage. Default: its first one of points, with a warning that names the others.
    #[serde(default)]
    pub layer: Option<String>,
    /// Refuses a table with any row or size that cannot be used, instead of leaving it out with a warning. Default false.
    #[serde(default)]
    pub strict: bool,
    /// What the coordinates are measured from; x grows eastward, y northward. Degrees of longitude and latitude need no
    /// anchor but `StandCentre`, where they are to be put elsewhere. Default `TerrainCentre`.
    #[serde(default)]
    pub anchor: Anchor,
    /// The coordinate system of the positions, as of a terrain: `Utm(zone: 33)`, `Epsg(25833)`; they are brought to that of
    /// the terrain file. Default: that of the terrain (for degrees: WGS84).
    #[serde(default)]
    #[reflect(ignore)]
    pub coordinates: Option<CoordinateSystem>,
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

/// What an inventory's coordinates are measured from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, bevy::reflect::Reflect)]
pub enum Anchor {
    /// From the terrain's centre. Older scene files call it `Centre`.
    #[default]
    #[serde(alias = "Centre")]
    TerrainCentre,
    /// From the terrain's south-western corner, as plot coordinates mostly are.
    SouthWest,
    /// From the centre of the stand's bounding box, which is put on the terrain's centre whatever the coordinates are.
    /// Older scene files call it `Middle`.
    #[serde(alias = "Middle")]
    StandCentre,
    /// The terrain file's own coordinates: easting and northing, or degrees of longitude and latitude.
    Terrain,
}

impl Anchor {
    /// All anchors.
    pub const ALL: [Self; 4] = [Self::TerrainCentre, Self::SouthWest, Self::StandCentre, Self::Terrain];

    /// The inventory coordinates (east, north, in metres) of the terrain's centre: a tree at `(x, y)` stands
    /// `x - origin.x` east and `y - origin.y` north of it.
    ///
    /// `stand` are the least and the greatest coordinates of the stand and `extent` the terrain's size, all in metres.
    /// `None` for [`Anchor::Terrain`]: there the terrain's own georeference leads from coordinates to places.
    pub fn origin(self, stand: (DVec2, DVec2), extent: DVec2) -> Option<DVec2> {
        match self {
            Self::TerrainCentre => Some(DVec2::ZERO),
            Self::SouthWest => Some(0.5 * extent),
            Self::StandCentre => Some(0.5 * (stand.0 + stand.1)),
            Self::Terrain => None,
        }
    }
}

impl InventoryTrees {
    /// The trees of the file `path`, with the defaults of a scene file.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self {
            path: path.into(),
            dbh_unit: None,
            height_unit: None,
            year: None,
            variant: None,
            layer: None,
            strict: false,
            anchor: Anchor::default(),
            coordinates: None,
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
            check_area(&area, check);
        }
        if let Some(surroundings) = self.surroundings {
            check.number("trees.surroundings", surroundings, 0.0..=50_000.0, "m");
        }
        if let Some(clearings) = self.clearings {
            check.number("trees.clearings.wavelength", clearings.wavelength_m, 1.0..=100_000.0, "m");
            check.number("trees.clearings.share", clearings.cover, 0.0..=1.0, "");
            check.number("trees.clearings.edge", clearings.edge, 0.0..=1.0, "");
        }
    }
}

fn check_area(area: &Area, check: &mut Check) {
    let [west, south, east, north] = area.sides();
    let mut finite = true;
    for (name, value) in [("west", west), ("south", south), ("east", east), ("north", north)] {
        finite &= check.number(&format!("trees.area.{name}"), value, -1e7..=1e7, "m");
    }
    if finite && west >= east {
        check.problem(
            "trees.area.west",
            format!("is {west} m, not west of `east` ({east} m)"),
            "exchange the two, or widen the area",
        );
    }
    if finite && south >= north {
        check.problem(
            "trees.area.south",
            format!("is {south} m, not south of `north` ({north} m)"),
            "exchange the two, or widen the area",
        );
    }
}

impl InventoryTrees {
    fn check(&self, species: &[Species], check: &mut Check) {
        check.path("trees.path", &self.path);
        if let Some(height) = self.default_height {
            check.number("trees.default_height", height, 0.1..=150.0, "m");
        }
        let known = Known::new(species);
        for (theirs, ours) in &self.species {
            unknown_species(&format!("trees.species.{theirs}"), ours, &known, check);
        }
        if let Some(ours) = &self.default_species {
            unknown_species("trees.default_species", ours, &known, check);
        }
    }
}

/// The names of a scene's species.
struct Known<'a> {
    all: HashSet<&'a str>,
    /// The first of them, for suggestions: thousands of names are compared with few.
    first: Vec<&'a str>,
    /// What a message says of them.
    list: String,
}

impl<'a> Known<'a> {
    /// Names that a message lists.
    const LISTED: usize = 20;
    /// Names that a suggestion is chosen from.
    const COMPARED: usize = 200;

    fn new(species: &'a [Species]) -> Self {
        let names = || species.iter().map(|one| one.name.as_str());
        let mut list = names().take(Self::LISTED).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        if species.len() > Self::LISTED {
            list.push_str(&format!(" and {} more", species.len() - Self::LISTED));
        }
        Self { all: names().collect(), first: names().take(Self::COMPARED).collect(), list }
    }
}

fn unknown_species(field: &str, name: &str, known: &Known, check: &mut Check) {
    if known.all.contains(name) {
        return;
    }
    let list = &known.list;
    let remedy = match nearest(name, &known.first) {
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
        assert_eq!(place(Anchor::TerrainCentre, DVec2::new(3.0, 4.0)), Some(DVec2::new(3.0, 4.0)));
        assert_eq!(place(Anchor::SouthWest, DVec2::ZERO), Some(DVec2::new(-200.0, -100.0)));
        assert_eq!(place(Anchor::StandCentre, stand.0), Some(DVec2::new(-100.0, -50.0)));
        assert_eq!(place(Anchor::Terrain, stand.0), None);
    }
}
