//! What takes part in a profile: this renderer with some settings, or stock Bevy with the same trees.

use std::{ops::Range, sync::Arc};

use bevy::{ecs::world::World, render::settings::WgpuSettings};

use chrono::{DateTime, Utc};

use super::{
    machine,
    record::{LevelCount, Memory, PictureRecord},
    stages::Stages,
    sweep::Point,
    timing,
    views::ProfileView,
};
use crate::{
    app::{
        AppError, RenderedImage, Renderer, UpdateTime,
        stock::{StockGround, StockRenderer, StockScene},
    },
    assets::Stage,
    bake::BakedPlant,
    light::{Atmosphere, AtmosphereParams, LightState},
    lod::level_distance::{NOMINAL_FIELD_OF_VIEW, NOMINAL_HEIGHT},
    progress::Progress,
    render::{
        exposure::{CameraExposure, StandTotals},
        forest::{ForestStatistics, LevelStatistics},
        frame_work::FrameWork,
        terrain::TerrainStatistics,
    },
    scatter::PackedTree,
    scene::Viewpoint,
};

/// A renderer of another kind, to compare with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Peer {
    /// The most trees that it draws: those that are nearest in the views.
    pub most_trees: usize,
}

/// Frames of stock Bevy until all that it needs is on the device.
const FIRST_UPDATES: u32 = 3;

/// A renderer under test.
pub trait Contestant {
    /// Sets camera and light of the next frame.
    ///
    /// # Errors
    /// [`AppError::Light`].
    fn set_view(&mut self, view: &Viewpoint, instant: DateTime<Utc>) -> Result<(), AppError>;

    /// Draws a frame and waits until the device has finished it.
    ///
    /// # Errors
    /// [`AppError::Render`].
    fn update(&mut self) -> Result<UpdateTime, AppError>;

    /// Reads the last frame back.
    ///
    /// # Errors
    /// [`AppError::Render`].
    fn read(&self) -> Result<RenderedImage, AppError>;

    /// The main world, whose diagnostics have the device's figures.
    fn world(&self) -> &World;

    /// What the names of its passes have in common.
    fn pass_prefix(&self) -> &'static str;

    /// What the last frame drew, and the processor's work since the last call.
    fn counts(&self) -> PictureRecord {
        PictureRecord::default()
    }

    /// Memory in use.
    fn memory(&self) -> Memory {
        machine::memory(self.world())
    }
}

/// This renderer with a stage.
pub struct Canopy<'a> {
    renderer: &'a mut Renderer,
    stage: &'a Stage,
}

impl<'a> Canopy<'a> {
    /// Shows `stage` in `renderer`.
    pub fn new(renderer: &'a mut Renderer, stage: &'a Stage) -> Self {
        renderer.replace(stage);
        Self { renderer, stage }
    }
}

impl Contestant for Canopy<'_> {
    fn set_view(&mut self, view: &Viewpoint, instant: DateTime<Utc>) -> Result<(), AppError> {
        self.renderer.set_instant(self.stage, instant);
        self.renderer.set_view(view);
        Ok(())
    }

    fn update(&mut self) -> Result<UpdateTime, AppError> {
        self.renderer.update_timed()
    }

    fn read(&self) -> Result<RenderedImage, AppError> {
        self.renderer.read()
    }

    fn world(&self) -> &World {
        self.renderer.world()
    }

    fn pass_prefix(&self) -> &'static str {
        "canopy_"
    }

    fn counts(&self) -> PictureRecord {
        let world = self.renderer.render_world();
        let mut record = PictureRecord::default();
        if let Some(forest) = world.get_resource::<ForestStatistics>() {
            let level = |level: &LevelStatistics| LevelCount {
                name: level.representation.name().to_owned(),
                trees: level.trees as f64,
                triangles: level.triangles as f64,
            };
            record.levels = forest.levels.iter().map(level).collect();
        }
        if let Some(terrain) = world.get_resource::<TerrainStatistics>() {
            record.tiles = terrain.tiles;
            record.ground_triangles = terrain.triangles;
        }
        if let Some(work) = world.get_resource::<FrameWork>() {
            let [bytes, calls, _, _] = work.take();
            (record.uploaded_bytes, record.forest_calls) = (Some(bytes), Some(calls));
        }
        record
    }
}

/// Stock Bevy with the trees of a stage.
pub struct Stock {
    renderer: StockRenderer,
    stage: Arc<Stage>,
    totals: StandTotals,
    atmosphere: Atmosphere,
    trees: usize,
    /// The light that was computed last: stock Bevy has no sky to compute it from, and no frame pays for it.
    light: Option<(DateTime<Utc>, Arc<LightState>)>,
}

impl Stock {
    /// Spawns what stock Bevy draws of `stage` for `views` of `size` pixels.
    ///
    /// # Errors
    /// [`AppError::Light`].
    pub fn new(
        peer: Peer,
        stage: Arc<Stage>,
        views: &[ProfileView],
        size: (u32, u32),
        settings: WgpuSettings,
    ) -> Result<Self, AppError> {
        let quality = &stage.scene.quality;
        let trees = nearest(&stage, views, size, peer.most_trees);
        let extent = stage.terrain.extent();
        // The ground goes on as far again as it has data, so that slopes have a background.
        let reach = extent.max_element().max(0.5 * extent.max_element() + stage.surroundings);
        let renderer = StockRenderer::new(
            &StockScene {
                trees: &trees,
                grid: &stage.stand.grid,
                plants: &stage.plants,
                fades: &fades(&stage, views, size),
                ground: StockGround::Terrain(&stage.terrain),
                reach,
                far: quality.view_distance,
                size,
                samples: quality.msaa,
                cascades: quality.cascades as usize,
                shadow_map_size: quality.shadow_map_size,
                shadow_distance: quality.shadow_distance,
            },
            settings,
            timing::prepare,
        );
        let sun = stage.sun(views.first().map_or(stage.scene.place.time.utc(), |view| view.instant));
        let mut stock = Self {
            renderer,
            totals: StandTotals::of(&stage.stand, &stage.plants),
            atmosphere: Atmosphere::new(AtmosphereParams::with_visibility_km(sun.visibility_km))?,
            trees: trees.len(),
            light: None,
            stage,
        };
        // Meshes, textures and shaders reach the device.
        if let Some(first) = views.first() {
            stock.set_view(&first.view, first.instant)?;
            for _ in 0..FIRST_UPDATES {
                stock.update()?;
            }
        }
        Ok(stock)
    }

    /// Its name in a report.
    pub fn label(&self) -> String {
        let all = self.stage.stand.trees.len();
        if self.trees == all { "stock Bevy".to_owned() } else { format!("stock Bevy, {} of {all} trees", self.trees) }
    }
}

impl Contestant for Stock {
    fn set_view(&mut self, view: &Viewpoint, instant: DateTime<Utc>) -> Result<(), AppError> {
        let light = match &self.light {
            Some((of, light)) if *of == instant => light.clone(),
            _ => Arc::new(self.stage.sun(instant).light(&self.atmosphere)?),
        };
        self.light = Some((instant, light.clone()));
        // As bright as Canopy shows it.
        let exposure = CameraExposure::new(light.clone(), self.totals);
        let exposure = exposure.at(&self.stage.ground(), view.position);
        self.renderer.set_light(&light, exposure.ev100);
        self.renderer.set_view(view);
        Ok(())
    }

    fn update(&mut self) -> Result<UpdateTime, AppError> {
        self.renderer.update()
    }

    fn read(&self) -> Result<RenderedImage, AppError> {
        self.renderer.read()
    }

    fn world(&self) -> &World {
        self.renderer.world()
    }

    fn pass_prefix(&self) -> &'static str {
        "main_"
    }

    fn memory(&self) -> Memory {
        // Both renderers live in one process, whose memory is nobody's alone.
        Memory { program: None, ..machine::memory(self.world()) }
    }
}

/// Those that take part.
pub struct Contestants {
    /// This renderer.
    pub renderer: Renderer,
    /// The scenes that it draws.
    pub stages: Stages,
    /// Stock Bevy, if it takes part.
    pub stock: Option<Stock>,
}

impl Contestants {
    /// Lets `work` have the one that draws `point`.
    ///
    /// # Errors
    /// Those of [`Stages::stage`] and of `work`.
    pub fn with<R>(
        &mut self,
        point: &Point,
        progress: &mut dyn Progress,
        work: impl FnOnce(&mut dyn Contestant, &mut dyn Progress) -> Result<R, AppError>,
    ) -> Result<R, AppError> {
        match (&mut self.stock, point.peer) {
            (Some(stock), Some(_)) => work(stock, progress),
            _ => {
                let stage = self.stages.stage(&point.scene, progress)?;
                work(&mut Canopy::new(&mut self.renderer, &stage), progress)
            }
        }
    }
}

/// `most` trees of `stage`: of each of `views` in turn the nearest one in its picture that is not there yet, and then those nearest to
/// the first view.
fn nearest(stage: &Stage, views: &[ProfileView], size: (u32, u32), most: usize) -> Vec<PackedTree> {
    let (trees, grid) = (&stage.stand.trees, &stage.stand.grid);
    if trees.len() <= most {
        return trees.clone();
    }
    let by_distance = |view: &ProfileView, seen: bool| {
        let (camera, forward) = (view.view.position, view.view.forward());
        // A cone through the corners of the image.
        let aspect = f64::from(size.0) / f64::from(size.1.max(1));
        let least = ((0.5 * view.view.field_of_view).tan() * aspect.hypot(1.0)).atan().cos();
        let found = trees.iter().zip(0..).filter_map(|(tree, index): (&PackedTree, usize)| {
            let to = tree.position(grid) - camera;
            (!seen || to.dot(forward) >= least * to.length()).then(|| (to.length_squared(), index))
        });
        let mut found: Vec<(f64, usize)> = found.collect();
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.truncate(most);
        found.into_iter().map(|(_, index)| index)
    };
    let mut in_view: Vec<_> = views.iter().map(|view| by_distance(view, true)).collect();
    let mut taken = vec![false; trees.len()];
    let mut chosen = Vec::with_capacity(most);
    while chosen.len() < most {
        let before = chosen.len();
        for view in &mut in_view {
            if let Some(index) = view.find(|index| !taken[*index]).filter(|_| chosen.len() < most) {
                taken[index] = true;
                chosen.push(index);
            }
        }
        if chosen.len() == before {
            break;
        }
    }
    let rest = views.first().into_iter().flat_map(|view| by_distance(view, false));
    let missing = most - chosen.len();
    chosen.extend(rest.filter(|index| !taken[*index]).take(missing));
    chosen.into_iter().map(|index| trees[index]).collect()
}

/// The distances at which each plant's full model gives way to crosses: those of a tree of its mean height. Canopy has them for
/// each tree; stock Bevy's ranges belong to few kinds of entities.
fn fades(stage: &Stage, views: &[ProfileView], size: (u32, u32)) -> Vec<Option<Range<f32>>> {
    let field_of_view = views.first().map_or(NOMINAL_FIELD_OF_VIEW, |view| view.view.field_of_view as f32);
    let half = (0.5 * field_of_view).tan();
    let zoom = (0.5 * NOMINAL_FIELD_OF_VIEW).tan() / half;
    let levels = stage.scene.quality.lod_levels().in_view(zoom, 0.5 * size.1 as f32 / half);
    let Some(fade) = levels.fade_out(0) else { return vec![None; stage.plants.len()] };
    let mut scales = vec![(0.0f64, 0usize); stage.plants.len()];
    for tree in &stage.stand.trees {
        if let Some((sum, count)) = scales.get_mut(usize::from(tree.variant())) {
            (*sum, *count) = (*sum + f64::from(tree.scale()), *count + 1);
        }
    }
    let fade = |(plant, (sum, count)): (&BakedPlant, (f64, usize))| {
        let height = plant.plant.height() * (sum / count.max(1) as f64) as f32;
        let share = height / NOMINAL_HEIGHT;
        Some(share * fade.start..share * fade.end)
    };
    stage.plants.iter().zip(scales).map(fade).collect()
}
