//! Builds what the renderer draws from a validated scene: terrain, plants and stand, baked and packed.

use std::{ops::Range, sync::Arc, time::Instant};

use bevy::render::renderer::RenderDevice;
use glam::DVec3;
use rayon::prelude::*;

use super::{
    StageError, ground, plants, together,
    trees::{StandPlan, WoodBeyond},
};
use crate::{
    bake::{BakeSource, BakedPlant, bake_plant, cache::Cache, lighting::SunLight, textures::filter_together},
    light::sun::Observer,
    progress::Progress,
    render::{
        components::{CanopyStyle, Forest, ForestSurface, Ground, GroundDrape, SunShadowSettings},
        exposure::StandTotals,
        forest::most_trees,
    },
    scatter::{CoverMap, PackedStand, PlantSize, ScatterError, Surveys, bounded_cover_map, packed::DEFAULT_CELL_SIZE},
    scene::{self, Lighting, Quality, Scene},
    terrain::Terrain,
};

/// Metres per texel of the cover map of a forest up to some 32 km wide.
pub(crate) const COVER_TEXEL: f64 = 8.0;
/// The most texels of a cover map: those of wider forests are larger.
pub(crate) const MOST_COVER_TEXELS: u32 = 1 << 24;
/// Size of a plant without any surface, metres.
const NO_PLANT: PlantSize = PlantSize { radius: 0.08, height: 0.1 };
/// The least size of a plant that has some, metres.
const LEAST: PlantSize = PlantSize { radius: 0.008, height: 0.01 };

/// A built scene.
pub struct Stage {
    /// The ground.
    pub terrain: Arc<Terrain>,
    /// The photograph over it.
    pub drape: Option<GroundDrape>,
    /// The trees.
    pub stand: Arc<PackedStand>,
    /// The plants, by variant.
    pub plants: Arc<Vec<BakedPlant>>,
    /// Variants of each of the scene's species.
    pub variants: Vec<Range<u16>>,
    /// How the sun lights each plant.
    pub suns: Arc<[SunLight]>,
    /// Canopy cover; `None` without trees.
    pub cover: Option<Arc<CoverMap>>,
    /// Metres beyond the terrain's data that are wooded too.
    pub surroundings: f64,
    /// Location on earth.
    pub observer: Observer,
    /// The scene as written.
    pub scene: Scene,
    /// The style of its pictures, for the camera that takes them.
    pub style: CanopyStyle,
    /// The years and variants of its inventory, and which of them is shown.
    pub surveys: Surveys,
}

impl Stage {
    /// Builds `scene`: one from a file ([`Scene::read`]), or one that was built in code.
    ///
    /// # Errors
    /// [`StageError`] for anything in the scene or its files that cannot be used; [`StageError::Cancelled`] soon after
    /// `progress` [is cancelled](Progress::is_cancelled); during the bakes, after the current few plants.
    pub fn build(scene: &Scene, progress: &mut dyn Progress) -> Result<Self, StageError> {
        Self::build_within(scene, None, progress)
    }

    /// As [`build`](Self::build), for a device that holds at most `most_trees` trees (see [`most_trees`](crate::assets::most_trees)): a scene that
    /// asks for more is refused before the long work.
    ///
    /// # Errors
    /// Those of [`build`](Self::build), and [`StageError::TooManyTrees`].
    pub fn build_within(
        scene: &Scene,
        most_trees: Option<usize>,
        progress: &mut dyn Progress,
    ) -> Result<Self, StageError> {
        scene.validate()?;
        let style = CanopyStyle::new(scene.style.clone())?;
        let started = Instant::now();
        progress.begin("Terrain", 0);
        let terrain = Arc::new(ground::build_terrain(&scene.terrain, progress)?);
        progress.end();
        progress.note(&format!("terrain: {:.2} s", started.elapsed().as_secs_f64()));
        Self::build_on(terrain, style, scene, None, most_trees, progress)
    }

    /// As [`build_within`](Self::build_within), for a `scene` that differs from this one's in the year or the variant of its
    /// inventory alone. It stands on the same ground and shares the plants, unless trees are lit together.
    ///
    /// # Errors
    /// Those of [`build_within`](Self::build_within).
    pub fn build_beside(
        &self,
        scene: &Scene,
        most_trees: Option<usize>,
        progress: &mut dyn Progress,
    ) -> Result<Self, StageError> {
        scene.validate()?;
        Self::build_on(self.terrain.clone(), self.style.clone(), scene, Some(&self.plants), most_trees, progress)
    }

    /// Builds what stands on `terrain`. Plants that are `known` are those of `scene` before trees are lit together.
    fn build_on(
        terrain: Arc<Terrain>,
        style: CanopyStyle,
        scene: &Scene,
        known: Option<&[BakedPlant]>,
        most_trees: Option<usize>,
        progress: &mut dyn Progress,
    ) -> Result<Self, StageError> {
        let observer = observer(scene, &terrain)?;
        check_wanted(progress)?;
        let drape = match &scene.drape {
            Some(drape) => {
                let started = Instant::now();
                progress.begin("Photograph", 0);
                let read = ground::build_drape(drape, &terrain, progress)?;
                progress.end();
                progress.note(&format!("photograph over the ground: {:.2} s", started.elapsed().as_secs_f64()));
                Some(read)
            }
            None => None,
        };
        check_wanted(progress)?;

        let mut planned = StandPlan::new(scene, &terrain, WoodBeyond::Grows)?;
        planned.check(most_trees)?;
        if let Some(asked) = planned.fit_surroundings(most_trees) {
            progress.warn(&format!(
                "the wood goes on for {:.0} m beyond the terrain's data instead of {asked:.0} m: there is no room for more trees",
                planned.surroundings()
            ));
        }
        let surroundings = planned.surroundings();
        check_wanted(progress)?;

        let has_trees = !matches!(scene.trees, scene::Trees::None);
        let mut species = if has_trees { plants::plan(scene)? } else { plants::PlantPlan::default() };
        // Trees that are lit together have plants of their own.
        let known = known.filter(|_| !scene.species.iter().any(scene::Species::is_lit_together));
        let plants = match known.filter(|known| known.len() == species.individuals.len()) {
            Some(known) => known.to_vec(),
            None => bake(&species, &scene.quality, progress)?,
        };

        let started = Instant::now();
        progress.begin("Trees", 0);
        let sizes: Vec<PlantSize> = plants.iter().map(BakedPlant::size).collect();
        let mut stand = planned.build(&species, &sizes, progress)?;
        progress.end();
        check_wanted(progress)?;
        let plants = together::light_together(scene, &mut species, plants, &mut stand, progress)?;
        let sizes: Vec<PlantSize> = plants.iter().map(BakedPlant::size).collect();
        let packed = PackedStand::new(&stand, DEFAULT_CELL_SIZE, &sizes)?;
        let cover = if stand.trees.is_empty() { None } else { Some(Arc::new(cover(&packed, &plants)?)) };
        progress.note(&format!("{} trees: {:.2} s", stand.trees.len(), started.elapsed().as_secs_f64()));
        if stand.trees.is_empty() {
            match &scene.trees {
                scene::Trees::None => {}
                scene::Trees::Scattered(_) => {
                    progress.warn("the scene's rules leave no place for any tree: only the ground is drawn");
                }
                scene::Trees::Inventory(inventory) => {
                    progress.warn(&format!(
                        "{}: there are no trees in it: only the ground is drawn",
                        inventory.path.display()
                    ));
                }
            }
        }
        let sun = |(species, variants): (&scene::Species, &Range<u16>)| {
            std::iter::repeat_n(species.lighting.as_ref().map_or(SunLight::default(), Lighting::sun), variants.len())
        };
        let suns = scene.species.iter().zip(&species.variants).flat_map(sun).collect();
        let (stand, plants, variants) = (Arc::new(packed), Arc::new(plants), species.variants);
        let (scene, surveys) = (scene.clone(), planned.surveys());
        Ok(Self { terrain, drape, stand, plants, variants, suns, cover, surroundings, observer, scene, style, surveys })
    }

    /// Whether `device` can hold the trees, all of which lie in one storage buffer.
    ///
    /// # Errors
    /// [`StageError::TooManyTrees`].
    pub fn check_device(&self, device: &RenderDevice) -> Result<(), StageError> {
        check_trees(self.stand.trees.len(), device)?;
        // The crosses of all plants share texture arrays; that of the sun's light has the most layers.
        let planes = self.plants.iter().filter_map(BakedPlant::cross).map(|cross| cross.textures.sun.len());
        let layers = device.limits().max_texture_array_layers as usize;
        let (most, count) = (planes.clone().max().unwrap_or(1).max(1), planes.count());
        let limit = layers / most;
        if count > limit { Err(StageError::TooManyPlants { count, limit }) } else { Ok(()) }
    }

    /// The forest of the scene, or `None` without trees.
    pub fn forest(&self) -> Option<Forest> {
        let quality = &self.scene.quality;
        (!self.stand.trees.is_empty()).then(|| Forest {
            stand: self.stand.clone(),
            plants: self.plants.clone(),
            suns: self.suns.clone(),
            origin: DVec3::ZERO,
            levels: quality.lod_levels(),
            view_distance: quality.view_distance as f32,
        })
    }

    /// The surface of the forest, where its trees are drawn together.
    fn forest_surface(&self) -> Option<ForestSurface> {
        let fade = self.scene.quality.lod_levels().surface()?;
        let tree_height = StandTotals::of(&self.stand, &self.plants).height();
        (tree_height > 0.0).then_some(ForestSurface { fade, tree_height })
    }

    /// The ground of the scene.
    pub fn ground(&self) -> Ground {
        Ground {
            terrain: self.terrain.clone(),
            drape: self.drape.clone(),
            cover: self.cover.clone(),
            surroundings: self.surroundings,
            forest_surface: self.forest_surface(),
            error_pixels: self.scene.quality.terrain_error,
            view_distance: self.scene.quality.view_distance,
        }
    }

    /// Shadow settings of the scene's quality.
    pub fn shadow(&self) -> SunShadowSettings {
        shadow(&self.scene.quality)
    }
}

/// Shadow settings of `quality`.
fn shadow(quality: &Quality) -> SunShadowSettings {
    SunShadowSettings {
        map_size: quality.shadow_map_size,
        cascades: quality.cascades as usize,
        distance: quality.shadow_distance,
        softness: quality.shadow_softness,
        // A billboard's horizontal plane would draw a line across the crowns of full models.
        proxy_distance: quality.nearest_level_end(),
        ..SunShadowSettings::default()
    }
}

/// Whether `device` can hold the `count` trees of a forest.
///
/// # Errors
/// [`StageError::TooManyTrees`].
pub(crate) fn check_trees(count: usize, device: &RenderDevice) -> Result<(), StageError> {
    let limit = most_trees(&device.limits());
    if count > limit { Err(StageError::TooManyTrees { count, limit }) } else { Ok(()) }
}

/// Stops a cancelled build.
fn check_wanted(progress: &dyn Progress) -> Result<(), StageError> {
    if progress.is_cancelled() { Err(StageError::Cancelled) } else { Ok(()) }
}

/// The scene's location on earth: its own, or else that of its terrain file.
///
/// # Errors
/// [`StageError::NoPlace`] if both are missing.
pub(crate) fn observer(scene: &Scene, terrain: &Terrain) -> Result<Observer, StageError> {
    let known = terrain.reference().and_then(|reference| reference.latitude_longitude());
    let latitude = scene.place.latitude.or(known.map(|place| place.0));
    let longitude = scene.place.longitude.or(known.map(|place| place.1));
    let (Some(latitude), Some(longitude)) = (latitude, longitude) else {
        return Err(StageError::NoPlace { scene: scene.label() });
    };
    let height = terrain.height(0.0, 0.0).clamp(-500.0, 9000.0);
    Ok(Observer::new(latitude, longitude, height)?)
}

/// The canopy cover of a stand of `plants`.
///
/// # Errors
/// Those of [`bounded_cover_map`].
pub(crate) fn cover(stand: &PackedStand, plants: &[BakedPlant]) -> Result<CoverMap, ScatterError> {
    let crowns: Vec<PlantSize> = plants.iter().map(crown).collect();
    Ok(bounded_cover_map(stand, &crowns, COVER_TEXEL, MOST_COVER_TEXELS)?.smoothed())
}

/// What the plant covers of the ground.
fn crown(plant: &BakedPlant) -> PlantSize {
    plant.plant.bounds().map_or(NO_PLANT, |bounds| PlantSize {
        radius: plant.plant.covered_radius().max(LEAST.radius),
        height: bounds.max.y.max(LEAST.height),
    })
}

fn bake(
    species: &plants::PlantPlan,
    quality: &Quality,
    progress: &mut dyn Progress,
) -> Result<Vec<BakedPlant>, StageError> {
    let started = Instant::now();
    progress.begin("Plants", species.individuals.len() as u64);
    let cache = Cache::of_user();
    let mut baked = Vec::with_capacity(species.individuals.len());
    let mut fresh = 0;
    let uprights = plants::affordable_planes(quality.cross_planes, species.individuals.len(), 0);
    if uprights < quality.cross_planes {
        progress.note(&format!(
            "{} plants have crosses of {uprights} upright planes instead of {}: textures have no more layers",
            species.individuals.len(),
            quality.cross_planes
        ));
    }
    // A few at a time: in parallel, but with progress.
    for group in species.individuals.chunks(rayon::current_num_threads().max(1)) {
        check_wanted(progress)?;
        let built: Vec<_> = group.par_iter().map(plants::Individual::build).collect::<Result<_, _>>()?;
        let textures = filter_together(built.iter().map(|(plant, _)| plant), cache.as_ref());
        let results: Vec<_> = group
            .par_iter()
            .zip(built)
            .map(|(individual, (plant, mut warnings))| {
                let settings = plants::bake_settings(quality, individual.lighting, uprights);
                let baked = bake_plant(Arc::new(plant), &settings, cache.as_ref());
                warnings.extend(baked.0.lighting.warning().map(|what| format!("{}: {what}", baked.0.plant.name)));
                (baked, warnings)
            })
            .collect();
        drop(textures);
        for ((plant, source), warnings) in results {
            for warning in warnings {
                progress.warn(&warning);
            }
            if let BakeSource::Fresh { warning } = source {
                fresh += 1;
                if let Some(warning) = warning {
                    progress.warn(&warning.to_string());
                }
            }
            baked.push(plant);
            progress.advance(1);
        }
    }
    progress.end();
    let seconds = started.elapsed().as_secs_f64();
    progress.note(&format!("{} plants, {fresh} newly baked: {seconds:.2} s", baked.len()));
    Ok(baked)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shadows_and_the_quality_of_a_scene_have_the_same_defaults() {
        assert_eq!(shadow(&Quality::default()), SunShadowSettings::default());
    }
}
