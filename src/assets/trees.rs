//! The stand of a scene: scattered by rule or read from an inventory.
//!
//! [`StandPlan`] comes before the plants are baked: an inventory is read and placed, and the trees are counted or
//! estimated, so that what cannot be built is refused in the first second.

use std::ops::Range;

use glam::DVec2;

use super::{
    StageError,
    error::anchors,
    inventory_place::{self, Placement, read_and_place},
    plants::PlantPlan,
};
use crate::{
    progress::Progress,
    scatter::{
        Allometry, Area, Ground, Inventory, InventorySpecies, PlacementRules, PlantSize, SizeRule, SpeciesRule, Stand,
        Surveys, place_surroundings, place_trees, rules::MAX_TREES, stand_from_inventory,
    },
    scene::{InventoryTrees, ScatteredTrees, Scene, Species, Trees},
    terrain::Terrain,
};

/// Trees stand on the terrain's own samples only, not on its mirrored surroundings.
impl Ground for Terrain {
    fn height(&self, x: f64, z: f64) -> f64 {
        Terrain::height(self, x, z)
    }

    fn slope(&self, x: f64, z: f64) -> f32 {
        Terrain::slope(self, x, z)
    }

    fn contains(&self, x: f64, z: f64) -> bool {
        Terrain::contains(self, x, z)
    }
}

/// Points that the number of scattered trees is estimated from. It is met to about one part in a hundred.
const SAMPLES: f64 = 16_384.0;

/// What is known of a scene's stand before its plants.
pub struct StandPlan<'a> {
    scene: &'a Scene,
    terrain: &'a Terrain,
    source: Source<'a>,
    /// Trees that the scene asks for: of an inventory those on the terrain, of rules an estimate.
    count: f64,
    /// Metres around the terrain's data that are wooded too.
    surroundings: f64,
}

/// Width in metres of the wooded surroundings of a scene that states none.
const SURROUNDINGS: f64 = 1000.0;
/// The most trees that such surroundings have for each tree of the data.
const MOST_SURROUNDING: f64 = 2.0;

/// Whether the wood goes on beyond the terrain's data where its rules do not say so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WoodBeyond {
    /// It does, over a width that follows from the number of trees and the view distance: a scene.
    Grows,
    /// It ends with the data: a forest of a program.
    Ends,
}

enum Source<'a> {
    None,
    Rules(&'a ScatteredTrees),
    Inventory(&'a InventoryTrees, Box<Inventory>, Box<Placement>),
}

impl<'a> StandPlan<'a> {
    /// Reads the inventory of `scene`, or estimates what its rules ask for on `terrain`.
    ///
    /// # Errors
    /// [`StageError`] for rules that cannot be fulfilled, inventories that cannot be read, and
    /// [`StageError::InventoryOutside`].
    pub fn new(scene: &'a Scene, terrain: &'a Terrain, beyond: WoodBeyond) -> Result<Self, StageError> {
        let (source, count) = match &scene.trees {
            Trees::None => (Source::None, 0.0),
            Trees::Scattered(rules) => (Source::Rules(rules), estimate(scene, rules, terrain)?),
            Trees::Inventory(trees) => {
                let (inventory, placement) = read_and_place(scene, trees, terrain)?;
                let count = count_inside(scene, trees, &inventory, &placement, terrain)? as f64;
                (Source::Inventory(trees, Box::new(inventory), Box::new(placement)), count)
            }
        };
        let surroundings = match &source {
            Source::Rules(rules) => surroundings(scene, rules, terrain, count, beyond),
            Source::None | Source::Inventory(..) => 0.0,
        };
        Ok(Self { scene, terrain, source, count, surroundings })
    }

    /// The inventory that was read, if the scene has one.
    #[cfg(feature = "program")]
    pub fn inventory(&self) -> Option<&Inventory> {
        match &self.source {
            Source::Inventory(_, inventory, _) => Some(inventory),
            Source::None | Source::Rules(_) => None,
        }
    }

    /// The years and variants of the inventory; none without one.
    pub fn surveys(&self) -> Surveys {
        match &self.source {
            Source::Inventory(_, inventory, _) => inventory.surveys.clone(),
            Source::None | Source::Rules(_) => Surveys::default(),
        }
    }

    /// Refuses a scene that asks for more than `most` trees; `None` is no limit.
    ///
    /// # Errors
    /// [`StageError::TooManyTrees`].
    pub fn check(&self, most: Option<usize>) -> Result<(), StageError> {
        match most {
            Some(limit) if self.count > limit as f64 => {
                Err(StageError::TooManyTrees { count: self.count.round() as usize, limit })
            }
            _ => Ok(()),
        }
    }

    /// Metres around the terrain's data that are wooded too; 0: none.
    pub fn surroundings(&self) -> f64 {
        self.surroundings
    }

    /// Makes the surroundings narrower until they fit beside the trees of the data into `most` trees; `None` is no limit.
    /// Returns what was asked for if it was too much, in metres.
    pub fn fit_surroundings(&mut self, most: Option<usize>) -> Option<f64> {
        let Source::Rules(rules) = &self.source else { return None };
        let extent = self.terrain.extent();
        let room = (most.unwrap_or(usize::MAX) as f64).min(f64::from(MAX_TREES)) * 0.98 - self.count;
        let fits = widest(extent, self.count, room);
        // Placing tries the whole rectangle.
        let hectares = f64::from(MAX_TREES) / rules.stems_per_hectare;
        let tries = 0.75 * widest(extent, 1.0, hectares * 1e4 / (extent.x * extent.y) - 1.0);
        let asked = self.surroundings;
        self.surroundings = asked.min(fits).min(tries * 0.999);
        (self.surroundings < 0.999 * asked).then_some(asked)
    }

    /// Builds the stand from plants of these sizes, by variant.
    ///
    /// # Errors
    /// [`StageError`] for rules that cannot be fulfilled.
    pub fn build(
        &self,
        plan: &PlantPlan,
        sizes: &[PlantSize],
        progress: &mut dyn Progress,
    ) -> Result<Stand, StageError> {
        match &self.source {
            Source::None => Ok(Stand::default()),
            Source::Rules(rules) => scatter(self.scene, rules, plan, sizes, self.terrain, self.surroundings, progress),
            Source::Inventory(trees, inventory, placement) => from_inventory(
                self.scene,
                (trees, inventory.as_ref(), placement.as_ref()),
                plan,
                sizes,
                self.terrain,
                progress,
            ),
        }
    }
}

/// The number of trees that `trees` ask for on `terrain`, from a sample.
fn estimate(scene: &Scene, trees: &ScatteredTrees, terrain: &Terrain) -> Result<f64, StageError> {
    // Where trees may stand does not depend on the plants: each species has one, of a height from which it can be scaled
    // to all of its range.
    let middle = |(low, high): (f64, f64)| (low * high).sqrt() as f32;
    let plants = scene.species.iter().map(|species| (0..1, vec![middle(species.height)]));
    let mut rules = rules(scene, trees, plants, terrain);
    rules.validate()?;
    let full = rules.full_count();
    rules.stems_per_hectare *= (SAMPLES / full).min(1.0);
    rules.min_distance_m = 0.0;
    let report = place_trees(&rules, terrain)?.report;
    Ok(full * f64::from(report.placed) / report.candidates.max(1) as f64)
}

/// The number of an inventory's trees that stand on `terrain`.
fn count_inside(
    scene: &Scene,
    trees: &InventoryTrees,
    inventory: &Inventory,
    placement: &Placement,
    terrain: &Terrain,
) -> Result<usize, StageError> {
    let (area, count) = placement.extent(inventory, terrain);
    if count == 0 && !inventory.rows.is_empty() {
        let [west, south, east, north] = area.sides();
        return Err(StageError::InventoryOutside {
            path: trees.path.clone(),
            count: inventory.rows.len(),
            east: (west, east),
            north: (south, north),
            terrain: terrain.extent().to_array(),
            covers: inventory_place::file_extents(placement, inventory, terrain).map(String::into_boxed_str),
            fits: inventory_place::fitting_anchors(scene, trees, inventory, terrain).into_boxed_slice(),
        });
    }
    Ok(count)
}

fn plant_heights(variants: &Range<u16>, sizes: &[PlantSize]) -> Vec<f32> {
    variants.clone().map(|variant| sizes.get(usize::from(variant)).map_or(1.0, |size| size.height)).collect()
}

/// Trunk radius at scale 1, whereas a species states it for a tree of mean height.
fn trunk_radius(species: &Species, heights: &[f32]) -> f32 {
    let mean_plant = heights.iter().sum::<f32>() / heights.len().max(1) as f32;
    species.trunk_radius_m() as f32 * mean_plant / species.mean_height() as f32
}

fn scatter(
    scene: &Scene,
    trees: &ScatteredTrees,
    plan: &PlantPlan,
    sizes: &[PlantSize],
    terrain: &Terrain,
    surroundings: f64,
    progress: &mut dyn Progress,
) -> Result<Stand, StageError> {
    let plants = plan.variants.iter().map(|variants| (variants.clone(), plant_heights(variants, sizes)));
    let rules = rules(scene, trees, plants, terrain);
    let placement = place_trees(&rules, terrain)?;
    let report = &placement.report;
    if report.placed < report.wanted {
        progress.warn(&format!(
            "{} of {} trees found no place with a least distance of {} m; lower it or the density",
            report.wanted - report.placed,
            report.wanted,
            rules.min_distance_m
        ));
    }
    progress.note(&format!(
        "{:.0} stems per hectare on {:.0} wooded hectares",
        report.stems_per_hectare, report.allowed_hectares
    ));
    let mut stand = placement.stand;
    let around = place_surroundings(&rules, &stand, surroundings, terrain)?;
    stand.trees.extend(around.trees);
    Ok(stand)
}

/// Metres around the data of `terrain` on which `trees` shall stand too; the data has `count` of them.
fn surroundings(scene: &Scene, trees: &ScatteredTrees, terrain: &Terrain, count: f64, beyond: WoodBeyond) -> f64 {
    if trees.area.is_some() || count < 1.0 {
        return 0.0;
    }
    match (trees.surroundings, beyond) {
        (Some(stated), _) => stated.min(scene.quality.view_distance),
        (None, WoodBeyond::Ends) => 0.0,
        (None, WoodBeyond::Grows) => {
            SURROUNDINGS.min(scene.quality.view_distance).min(widest(terrain.extent(), count, MOST_SURROUNDING * count))
        }
    }
}

/// The widest surroundings in metres of an area of `extent` metres with `count` trees (1 or more) that have at most `most`:
/// those of half the width are full.
fn widest(extent: DVec2, count: f64, most: f64) -> f64 {
    // The outer half, which thins out, counts about half: together as much as three quarters of the width, full.
    let wanted = (most / count.max(1.0)).max(0.0) * extent.x * extent.y;
    let sum = extent.x + extent.y;
    // (extent.x + 2 w) (extent.y + 2 w) = extent.x extent.y + wanted
    let full = ((sum * sum + 4.0 * wanted).sqrt() - sum) / 4.0;
    full / 0.75
}

/// The rules of `trees` for plants with these variants and heights in metres, by species.
fn rules(
    scene: &Scene,
    trees: &ScatteredTrees,
    plants: impl Iterator<Item = (Range<u16>, Vec<f32>)>,
    terrain: &Terrain,
) -> PlacementRules {
    let area = trees.area.unwrap_or(Area::centered(DVec2::ZERO, terrain.extent()));
    let species = scene
        .species
        .iter()
        .zip(plants)
        .map(|(species, (variants, heights))| {
            let (low, high) = (species.height.0 as f32, species.height.1 as f32);
            SpeciesRule {
                weight: species.weight,
                height_range_m: species.elevation,
                slope_limit: Some((species.slope_limit as f32).to_radians()),
                trunk_radius_m: trunk_radius(species, &heights),
                size: SizeRule::Height {
                    mean_m: 0.5 * (low + high),
                    // The bell ends at 2 sqrt(3) deviations from its mean: at the range's ends.
                    deviation_m: 0.5 * (high - low) / (2.0 * 3f32.sqrt()) * 0.999,
                    plant_heights_m: heights,
                },
                variants,
            }
        })
        .collect();
    PlacementRules {
        stems_per_hectare: trees.stems_per_hectare,
        sequence: trees.sequence,
        seed: scene.seed,
        min_distance_m: trees.min_distance,
        slope_limit: (trees.slope_limit as f32).to_radians(),
        height_range_m: trees.elevation,
        area,
        clearings: trees.clearings,
        species,
    }
}

fn from_inventory(
    scene: &Scene,
    (trees, inventory, placement): (&InventoryTrees, &Inventory, &Placement),
    plan: &PlantPlan,
    sizes: &[PlantSize],
    terrain: &Terrain,
    progress: &mut dyn Progress,
) -> Result<Stand, StageError> {
    let table = species_table(scene, trees, plan, sizes);
    let to_local = |x: f64, y: f64| placement.local(terrain, x, y);
    let result = stand_from_inventory(&inventory.rows, to_local, terrain, &table, scene.seed)?;
    let warn = |line: &str, progress: &mut dyn Progress| progress.warn(&format!("{}: {line}", trees.path.display()));
    for note in inventory.notes.iter().chain(&placement.note) {
        warn(note, progress);
    }
    for line in result.warnings.to_string().lines() {
        warn(line, progress);
    }
    let outside = result.warnings.outside.len();
    if 2 * outside >= inventory.rows.len().max(1) {
        let (area, _) = placement.extent(inventory, terrain);
        let [west, south, east, north] = area.sides();
        let size = terrain.extent();
        let fits = inventory_place::fitting_anchors(scene, trees, inventory, terrain);
        warn(
            &format!(
                "the trees are at {west:.0} to {east:.0} m east and {south:.0} to {north:.0} m north of the terrain's \
                 centre, and the terrain is {:.0} m x {:.0} m{}; {}",
                size.x,
                size.y,
                inventory_place::file_extents(placement, inventory, terrain).unwrap_or_default(),
                anchors(&fits)
            ),
            progress,
        );
    }
    Ok(result.stand)
}

/// The default species first: the table's first takes trees of unknown species.
fn species_table(
    scene: &Scene,
    trees: &InventoryTrees,
    plan: &PlantPlan,
    sizes: &[PlantSize],
) -> Vec<InventorySpecies> {
    let entry = |name: &str, species: &Species, variants: &Range<u16>| {
        let heights = plant_heights(variants, sizes);
        InventorySpecies {
            name: name.to_owned(),
            variants: variants.clone(),
            default_height_m: trees.default_height.unwrap_or(species.mean_height()) as f32,
            allometry: Allometry::default(),
            trunk_radius_m: trunk_radius(species, &heights),
            plant_heights_m: heights,
        }
    };
    let known: Vec<_> = scene.species.iter().zip(&plan.variants).collect();
    let by_name = |name: &str| known.iter().find(|(species, _)| species.name == name);
    let default = trees.default_species.as_deref().and_then(by_name).or(known.first());
    let mut table: Vec<InventorySpecies> = default.iter().map(|(s, v)| entry(&s.name, s, v)).collect();
    for (species, variants) in &known {
        if table.iter().all(|row| row.name != species.name) {
            table.push(entry(&species.name, species, variants));
        }
    }
    for (alias, name) in &trees.species {
        if let Some((species, variants)) = by_name(name) {
            table.push(entry(alias, species, variants));
        }
    }
    table
}
