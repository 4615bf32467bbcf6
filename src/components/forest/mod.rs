//! A forest as a component: its species, and where its trees stand.

mod build;
mod error;
mod tend;

use bevy::{
    asset::{AssetId, Handle},
    camera::visibility::Visibility,
    ecs::{component::Component, entity::Entity, event::EntityEvent, reflect::ReflectComponent},
    reflect::{Reflect, std_traits::ReflectDefault},
    transform::components::Transform,
};
use glam::DVec2;

pub use error::ForestError;
pub use tend::tend_forests;

use crate::{
    assets::PlantAsset,
    lod::{FadeBand, Levels},
    scatter::{Area, ClearingNoise, Tree},
    scene::{InventoryTrees, Quality, ScatteredTrees},
};
use tend::ForestWork;

/// Width in metres of the square that a forest without a terrain and without an area fills.
pub const DEFAULT_WIDTH: f64 = 200.0;

/// A forest: trees of some species, by rule, from an inventory or at given positions, on a terrain or on level ground.
///
/// ```no_run
/// # use bevy::prelude::*;
/// # use canopy::prelude::*;
/// fn setup(mut commands: Commands, assets: Res<AssetServer>) {
///     let oak = assets.load("oak.glb");
///     let spruce = assets.load(PlantAsset::CONIFER);
///     let ground = commands.spawn(Terrain3d(assets.load("valley.tif"))).id();
///     commands
///         .spawn(Forest3d::scatter(300.0).on(ground).of(oak, 3.0).of(spruce, 1.0))
///         .observe(|ready: On<ForestReady>| info!("{} trees", ready.trees));
/// }
/// ```
///
/// Once all its plants and its terrain are loaded, the forest is built in the background. Then the entity gets the
/// renderer's [`Forest`](crate::render::components::Forest), and [`ForestReady`] is triggered on it. It is rebuilt when
/// this component, an asset or its terrain changes. The previous forest is drawn until then, and stays if the new one
/// cannot be built ([`ForestFailed`]).
///
/// A forest on a terrain uses the terrain's coordinates, metres from its centre. A forest without a terrain stands on
/// level ground at the position and height of its own transform, whose rotation and scale have no effect.
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
#[require(Transform, Visibility, ForestSettings, ForestWork)]
pub struct Forest3d {
    /// Where the trees stand.
    pub trees: ForestTrees,
    /// The species.
    pub species: Vec<ForestSpecies>,
    /// The [`Terrain3d`](super::Terrain3d) that they stand on; `None` is level ground.
    #[entities]
    pub ground: Option<Entity>,
    /// Seed of everything random: positions, species, rotation, size and tint.
    pub seed: u64,
}

/// Where the trees of a forest stand.
#[derive(Clone, Debug, PartialEq, Reflect)]
#[reflect(Clone, Debug, PartialEq)]
pub enum ForestTrees {
    /// By rule.
    Scattered(ScatteredTrees),
    /// From an inventory: a CSV file, which is read from the file system.
    Inventory(InventoryTrees),
    /// At these positions, which are used as they are: no terrain lifts them. A tree's
    /// [`variant`](crate::scatter::Tree::variant) counts the individuals of all the forest's plants, in the order of
    /// [`Forest3d::species`].
    Given(Vec<Tree>),
}

/// One species of a forest.
#[derive(Clone, Debug, PartialEq, Reflect)]
#[reflect(Clone, Debug, PartialEq)]
pub struct ForestSpecies {
    /// Its plants.
    pub plant: Handle<PlantAsset>,
    /// Weight relative to the other species that may grow at the same position, 0.000001 to 1000000.
    pub weight: f64,
    /// Range of heights in metres; `None` takes the plant's own ([`Growth::heights`](crate::assets::Growth::heights)).
    pub heights: Option<(f64, f64)>,
    /// Its name in an inventory; `None` takes the plant's own.
    pub name: Option<String>,
}

impl ForestSpecies {
    /// `plant` with this weight; everything else from the plant.
    pub fn new(plant: Handle<PlantAsset>, weight: f64) -> Self {
        Self { plant, weight, heights: None, name: None }
    }
}

impl Default for Forest3d {
    /// 300 stems per hectare, without species yet.
    fn default() -> Self {
        Self { trees: ForestTrees::Scattered(ScatteredTrees::default()), species: Vec::new(), ground: None, seed: 1 }
    }
}

impl Forest3d {
    /// Trees by rule, with this number of stems per hectare of wooded ground, 0.01 to 100000.
    pub fn scatter(stems_per_hectare: f64) -> Self {
        Self::scattered(ScatteredTrees { stems_per_hectare, ..ScatteredTrees::default() })
    }

    /// Trees by these rules, which are those of a scene file.
    pub fn scattered(rules: ScatteredTrees) -> Self {
        Self { trees: ForestTrees::Scattered(rules), ..Self::default() }
    }

    /// The trees of an inventory. Without a terrain its coordinates are metres from the forest's own position.
    pub fn of_inventory(inventory: InventoryTrees) -> Self {
        Self { trees: ForestTrees::Inventory(inventory), ..Self::default() }
    }

    /// Trees at given positions.
    pub fn of_trees(trees: Vec<Tree>) -> Self {
        Self { trees: ForestTrees::Given(trees), ..Self::default() }
    }

    /// On the terrain of this entity.
    #[must_use]
    pub fn on(mut self, ground: Entity) -> Self {
        self.ground = Some(ground);
        self
    }

    /// Adds a species of this plant, with this weight relative to the other species.
    #[must_use]
    pub fn of(self, plant: Handle<PlantAsset>, weight: f64) -> Self {
        self.with(ForestSpecies::new(plant, weight))
    }

    /// With this species.
    #[must_use]
    pub fn with(mut self, species: ForestSpecies) -> Self {
        self.species.push(species);
        self
    }

    /// With another seed.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// Restricts the trees to this rectangle; for trees by rule.
    #[must_use]
    pub fn area(self, area: Area) -> Self {
        self.with_rules(|rules| rules.area = Some(area))
    }

    /// Minimum distance between two trees in metres; for trees by rule.
    #[must_use]
    pub fn min_distance(self, metres: f64) -> Self {
        self.with_rules(|rules| rules.min_distance = metres)
    }

    /// Adds clearings; for trees by rule.
    #[must_use]
    pub fn clearings(self, clearings: ClearingNoise) -> Self {
        self.with_rules(|rules| rules.clearings = Some(clearings))
    }

    /// Changes the rules of trees by rule; nothing else has any.
    fn with_rules(mut self, change: impl FnOnce(&mut ScatteredTrees)) -> Self {
        if let ForestTrees::Scattered(rules) = &mut self.trees {
            change(rules);
        }
        self
    }

    /// The rectangle that a forest on level ground fills.
    fn level_area() -> Area {
        Area::centered(DVec2::ZERO, DVec2::splat(DEFAULT_WIDTH))
    }

    /// Whether it has trees of this plant.
    fn has(&self, plant: AssetId<PlantAsset>) -> bool {
        self.species.iter().any(|species| species.plant.id() == plant)
    }
}

/// How a forest is drawn. A change takes effect at once, without a rebuild.
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
pub struct ForestSettings {
    /// The representations of the trees, from near to far. Distances are those of trees 20 m high, in a camera with a
    /// field of view of 50°: [`level_distance`](crate::lod::level_distance).
    pub levels: Levels,
    /// Metres beyond which no tree is drawn.
    pub view_distance: f32,
}

impl Default for ForestSettings {
    /// The settings of a scene file without `quality`.
    fn default() -> Self {
        let quality = Quality::default();
        Self {
            levels: Levels::model_and_cross(FadeBand::new(quality.near_distance as f32, quality.fade_band as f32)),
            view_distance: quality.view_distance as f32,
        }
    }
}

/// A [`Forest3d`] is built, or rebuilt, and drawn from this frame on. Triggered on its entity.
#[derive(EntityEvent, Clone, Copy, Debug, PartialEq, Eq)]
pub struct ForestReady {
    /// The forest.
    pub entity: Entity,
    /// Number of its trees.
    pub trees: usize,
}

/// A [`Forest3d`] cannot be built or rebuilt; the previous one stays. Triggered on its entity, and logged.
#[derive(EntityEvent, Debug)]
pub struct ForestFailed {
    /// The forest.
    pub entity: Entity,
    /// What is wrong.
    pub error: ForestError,
}
