//! Builds the renderer's forest from a component and loaded assets.

use std::{collections::HashSet, sync::Arc};

use super::{Forest3d, ForestError, ForestTrees};
use crate::{
    assets::{
        PlantAsset, StageError,
        background::Wanted,
        plants::PlantPlan,
        stage::cover,
        trees::{StandPlan, WoodBeyond},
    },
    bake::{BakedPlant, lighting::SunLight},
    progress::Progress,
    render::exposure::StandTotals,
    scatter::{
        CoverMap, PackedStand, PlantSize, Stand,
        packed::{DEFAULT_CELL_SIZE, MAX_VARIANTS},
    },
    scene::{Anchor, GroundFlat, GrownPlants, Scene, Species, Trees},
    terrain::{HeightField, Surroundings, Terrain},
};

/// Width in metres of the level ground: far more than the distance to which trees are drawn.
const LEVEL_WIDTH: f64 = 400_000.0;
/// Relative variation of the height for trees of a plant without a range of heights.
const HEIGHT_VARIATION: f64 = 0.15;
/// The range of heights that a scene allows, metres.
const HEIGHTS: (f64, f64) = (0.1, 150.0);

/// What a forest is built of.
pub struct Ingredients {
    pub forest: Forest3d,
    /// One for each species.
    pub plants: Vec<PlantAsset>,
    /// The ground; `None` is level.
    pub terrain: Option<Arc<Terrain>>,
    /// The most trees that the device holds; `None` without a device.
    pub most_trees: Option<usize>,
}

/// A built forest.
pub struct Built {
    pub stand: Arc<PackedStand>,
    pub plants: Arc<Vec<BakedPlant>>,
    pub suns: Arc<[SunLight]>,
    /// Canopy cover of the terrain; `None` on level ground, and without trees.
    pub cover: Option<Arc<CoverMap>>,
    /// Metres beyond the terrain's data on which its trees stand too.
    pub surroundings: f64,
    /// Mean height of its trees, metres.
    pub tree_height: f32,
    /// Warnings for the program's author.
    pub warnings: Vec<String>,
}

/// Collects the warnings of a build, and cancels it when it is no longer needed.
struct Listener<'a> {
    warnings: Vec<String>,
    wanted: &'a Wanted<'a>,
}

impl Progress for Listener<'_> {
    fn begin(&mut self, _what: &str, _steps: u64) {}

    fn advance(&mut self, _steps: u64) {}

    fn end(&mut self) {}

    fn warn(&mut self, message: &str) {
        self.warnings.push(message.to_owned());
    }

    fn note(&mut self, _message: &str) {}

    fn is_cancelled(&self) -> bool {
        !self.wanted.is_wanted()
    }
}

impl Ingredients {
    /// Builds the forest.
    pub fn build(self, wanted: &Wanted) -> Result<Built, ForestError> {
        let mut listener = Listener { warnings: Vec::new(), wanted };
        let mut plan = PlantPlan::default();
        let (mut plants, mut suns) = (Vec::new(), Vec::new());
        for asset in &self.plants {
            if asset.individuals.is_empty() {
                return Err(ForestError::EmptyPlant(asset.name.clone()));
            }
            let first = plants.len();
            plants.extend_from_slice(&asset.individuals);
            suns.resize(plants.len(), asset.sun);
            if plants.len() > MAX_VARIANTS {
                let count = self.plants.iter().map(|asset| asset.individuals.len()).sum();
                return Err(StageError::TooManyPlants { count, limit: MAX_VARIANTS }.into());
            }
            plan.variants.push(first as u16..plants.len() as u16);
        }
        let sizes: Vec<PlantSize> = plants.iter().map(BakedPlant::size).collect();
        let mut surroundings = 0.0;
        let stand = match &self.forest.trees {
            ForestTrees::Given(trees) => {
                if let Some(limit) = self.most_trees.filter(|limit| trees.len() > *limit) {
                    return Err(StageError::TooManyTrees { count: trees.len(), limit }.into());
                }
                Stand { trees: trees.clone() }
            }
            ForestTrees::Scattered(_) | ForestTrees::Inventory(_) => {
                let scene = self.scene();
                scene.validate().map_err(StageError::from)?;
                let terrain = match &self.terrain {
                    Some(terrain) => Arc::clone(terrain),
                    None => level_ground()?,
                };
                let mut planned = StandPlan::new(&scene, &terrain, WoodBeyond::Ends)?;
                planned.check(self.most_trees)?;
                planned.fit_surroundings(self.most_trees);
                surroundings = planned.surroundings();
                planned.build(&plan, &sizes, &mut listener)?
            }
        };
        let packed = PackedStand::new(&stand, DEFAULT_CELL_SIZE, &sizes).map_err(StageError::from)?;
        let has_cover = self.terrain.is_some() && !stand.trees.is_empty();
        let cover = has_cover.then(|| cover(&packed, &plants)).transpose().map_err(StageError::from)?;
        if stand.trees.is_empty() {
            listener.warn("the forest has no trees: its rules, area or positions leave no place for any");
        }
        let tree_height = StandTotals::of(&packed, &plants).height();
        Ok(Built {
            tree_height,
            stand: Arc::new(packed),
            plants: Arc::new(plants),
            suns: suns.into(),
            cover: cover.map(Arc::new),
            surroundings,
            warnings: listener.warnings,
        })
    }

    /// The forest as a scene, so that both share the rules for trees.
    fn scene(&self) -> Scene {
        let trees = match self.forest.trees.clone() {
            ForestTrees::Scattered(mut rules) => {
                if self.terrain.is_none() {
                    rules.area.get_or_insert_with(Forest3d::level_area);
                }
                Trees::Scattered(rules)
            }
            ForestTrees::Inventory(mut inventory) => {
                // Level ground has no corner as a reference.
                if self.terrain.is_none() && inventory.anchor == Anchor::SouthWest {
                    inventory.anchor = Anchor::TerrainCentre;
                }
                Trees::Inventory(inventory)
            }
            ForestTrees::Given(_) => Trees::None,
        };
        Scene {
            name: "forest".to_owned(),
            seed: self.forest.seed,
            species: self.species(),
            trees,
            ..Scene::new(GroundFlat::default())
        }
    }

    fn species(&self) -> Vec<Species> {
        let mut names = HashSet::new();
        self.forest
            .species
            .iter()
            .zip(&self.plants)
            .map(|(species, asset)| {
                let name = species.name.as_ref().unwrap_or(&asset.name);
                Species {
                    weight: species.weight,
                    height: species.heights.or(asset.growth.heights).unwrap_or_else(|| own_heights(asset)),
                    elevation: asset.growth.elevation,
                    slope_limit: asset.growth.slope_limit,
                    trunk_radius: asset.growth.trunk_radius,
                    // Only the sizes of the plants matter, and they are known.
                    ..Species::new(unique(name, &mut names), GrownPlants::default())
                }
            })
            .collect()
    }
}

/// `name`, made unique among `names`: one plant may be two species of a forest.
fn unique(name: &str, names: &mut HashSet<String>) -> String {
    let name = if name.trim().is_empty() { "plant" } else { name };
    let mut candidate = name.to_owned();
    let mut number = 2;
    while !names.insert(candidate.clone()) {
        candidate = format!("{name} {number}");
        number += 1;
    }
    candidate
}

/// The range of heights of a plant's individuals, slightly widened.
fn own_heights(asset: &PlantAsset) -> (f64, f64) {
    let heights = || asset.individuals.iter().map(|plant| f64::from(plant.size().height));
    let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(0.0, f64::max));
    let low = (low * (1.0 - HEIGHT_VARIATION)).clamp(HEIGHTS.0, HEIGHTS.1);
    (low, (high * (1.0 + HEIGHT_VARIATION)).clamp(low, HEIGHTS.1))
}

fn level_ground() -> Result<Arc<Terrain>, StageError> {
    let field = HeightField::new(2, 2, glam::DVec2::splat(LEVEL_WIDTH), vec![0.0; 4])?;
    Ok(Arc::new(Terrain::new(field, None, Surroundings::default())))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{assets::background, scatter::Tree};

    #[test]
    fn more_trees_than_the_device_holds_are_an_error_before_the_build() {
        let tree = Tree { position: DVec3::ZERO, yaw: 0.0, scale: 1.0, variant: 0, tint: 0.0, index: 0 };
        let refused = |trees: ForestTrees, most_trees| -> Result<(), ForestError> {
            let forest = Forest3d { trees, ..Forest3d::default() };
            let ingredients = Ingredients { forest, plants: Vec::new(), terrain: None, most_trees };
            let work = background::start(move |wanted| ingredients.build(wanted).map(|_| ()));
            loop {
                if let Some(built) = work.finished() {
                    return built.map_err(|error| StageError::from(error).into()).flatten();
                }
                std::thread::yield_now();
            }
        };
        let given = || ForestTrees::Given(vec![tree; 11]);
        let error = refused(given(), Some(10));
        assert!(
            matches!(error, Err(ForestError::Trees(StageError::TooManyTrees { count: 11, limit: 10 }))),
            "{error:?}"
        );
        // With room for them the next complaint is that they have no plant.
        for most_trees in [None, Some(11)] {
            let error = refused(given(), most_trees);
            assert!(matches!(error, Err(ForestError::Trees(StageError::Stand(_)))), "{error:?}");
        }
    }

    #[test]
    fn names_of_species_are_unique() {
        let mut names = HashSet::new();
        let given = ["oak", "oak", " ", "oak", "oak 2"].map(|name| unique(name, &mut names));
        assert_eq!(given, ["oak", "oak 2", "plant", "oak 3", "oak 2 2"]);
    }
}
