//! The trees that the view draws, and their indices on the device.

use bevy::{
    ecs::{
        entity::Entity,
        resource::Resource,
        system::{Res, ResMut},
    },
    platform::collections::HashMap,
    render::render_resource::{BindGroup, Buffer},
};

use super::{
    gpu_forest::{GpuForest, GpuForests},
    instances::{LevelLook, forest_view, instance_bind_group},
    representation::Representations,
};
use crate::{
    cull::{DrawLists, cull_view},
    lod::{MAX_LEVELS, Representation},
    render::{
        gpu::{self, Gpu, GrowingBuffer, UNIFORM_STRIDE},
        report::FrameReport,
        view::PreparedFrame,
    },
};

/// Weight of a level's tint in its trees' colour.
const TINT_AMOUNT: f32 = 0.6;

/// The trees of one forest that a view draws.
pub struct PreparedForest {
    /// Ranges of trees.
    pub lists: DrawLists,
    /// Group 1, with the dynamic offset of a level.
    pub bind_group: BindGroup,
    visible: GrowingBuffer,
    uniform: Buffer,
}

impl PreparedForest {
    /// Dynamic offset of `level` in group 1.
    pub fn offset(level: usize) -> u32 {
        level as u32 * UNIFORM_STRIDE as u32
    }
}

/// The trees of every forest that the view draws.
#[derive(Resource, Default)]
pub struct PreparedForests(HashMap<Entity, PreparedForest>);

impl PreparedForests {
    /// The trees of the forest `entity` that the view draws.
    pub fn get(&self, entity: Entity) -> Option<&PreparedForest> {
        self.0.get(&entity)
    }

    /// Whether the view draws any tree.
    pub fn draw_something(&self) -> bool {
        self.0.values().any(|forest| !forest.lists.visible.is_empty())
    }
}

/// Trees of one representation in the last prepared frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelStatistics {
    /// Which representation.
    pub representation: Representation,
    /// Plural name of its trees.
    pub label: &'static str,
    /// Number of trees drawn with it.
    pub trees: usize,
    /// Number of their triangles.
    pub triangles: usize,
}

/// Counts of the last prepared frame, for overlays and reports.
#[derive(Resource, Clone, Debug, Default, PartialEq, Eq)]
pub struct ForestStatistics {
    /// One entry for each representation that a forest has, from near to far.
    pub levels: Vec<LevelStatistics>,
}

impl ForestStatistics {
    /// Triangles of all levels.
    pub fn triangles(&self) -> usize {
        self.levels.iter().map(|level| level.triangles).sum()
    }

    /// Trees of all levels; a tree that fades between two levels counts in both.
    pub fn trees(&self) -> usize {
        self.levels.iter().map(|level| level.trees).sum()
    }

    fn add(&mut self, forest: &GpuForest, lists: &DrawLists) {
        for (index, level) in forest.levels() {
            let ranges = lists.ranges(index);
            // A level that draws all variants together has the same number of triangles for each of them.
            let triangles =
                ranges.iter().enumerate().map(|(variant, range)| range.len() * level.gpu.triangles(variant)).sum();
            let (representation, label) = (level.renderer.representation(), level.renderer.label());
            match self.levels.iter_mut().find(|known| known.representation == representation) {
                Some(known) => {
                    known.trees += lists.count(index);
                    known.triangles += triangles;
                }
                None => {
                    self.levels.push(LevelStatistics { representation, label, trees: lists.count(index), triangles });
                }
            }
        }
    }
}

/// Culls every forest for the view and uploads the lists.
pub fn prepare_view_lists(
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    representations: Res<Representations>,
    gpu: Gpu,
    report: Res<FrameReport>,
    mut prepared: ResMut<PreparedForests>,
    mut statistics: ResMut<ForestStatistics>,
) {
    let order = &forests.order;
    prepared.0.retain(|entity, _| order.contains(entity));
    *statistics = ForestStatistics::default();
    let Some(view) = &frame.view else { return };
    for (entity, forest) in forests.iter() {
        let settings = &forest.forest;
        let camera = view.camera - settings.origin;
        let lists = cull_view(
            &settings.stand,
            &forest.sizes,
            camera,
            &view.frustum,
            &settings.levels,
            &forest.groupings,
            settings.view_distance,
        );
        statistics.add(forest, &lists);
        // A forest that was replaced on the same entity has other buffers, so group 1 is created again each frame.
        let (mut visible, buffer) = match prepared.0.remove(&entity) {
            Some(old) => (old.visible, old.uniform),
            None => (
                GrowingBuffer::new(&gpu.device, "canopy_visible_trees"),
                gpu::uniform_slots(&gpu.device, "canopy_forest_view", MAX_LEVELS as u64),
            ),
        };
        for (index, representation) in settings.levels.representations().iter().enumerate() {
            let tint = representations.get(*representation).map(|renderer| renderer.tint()).unwrap_or_default();
            let amount = if view.options.tint_levels { TINT_AMOUNT } else { 0.0 };
            let look = LevelLook {
                fade_in: settings.levels.fade_in(index),
                fade_out: settings.levels.fade_out(index),
                tint: tint.extend(amount),
            };
            let uniform = forest_view(forest, view.camera, Some(look));
            gpu.queue.write_buffer(&buffer, PreparedForest::offset(index).into(), bytemuck::bytes_of(&uniform));
        }
        visible.write(&gpu.device, &gpu.queue, &lists.visible);
        let bind_group = instance_bind_group(&gpu, forest, &buffer, visible.buffer());
        prepared.0.insert(entity, PreparedForest { lists, bind_group, visible, uniform: buffer });
    }
    if statistics.trees() == 0 {
        let why = if order.is_empty() { "the world has no forest" } else { "no tree is in view" };
        report.skipped("forest", why);
    } else {
        let counts: Vec<String> =
            statistics.levels.iter().map(|level| format!("{} {}", level.trees, level.label)).collect();
        report.ran("forest", counts.join(", "));
    }
}
