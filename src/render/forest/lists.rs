//! The trees that the view draws.

use std::ops::Range;

use bevy::{
    ecs::{
        entity::Entity,
        resource::Resource,
        system::{Res, ResMut},
    },
    platform::collections::HashMap,
    render::render_resource::Buffer,
};

use super::{
    drawn_trees::PageTrees,
    gpu_forest::{GpuForest, GpuForests, ListTarget},
    instances::{LevelLook, forest_view},
    list_slot::{ListSlot, ListWork, PreparedPage},
    representation::Representations,
};
use crate::{
    cull::Volume,
    lod::{MAX_LEVELS, Representation},
    render::{
        cull::{CullJobs, ListMaker, TreeList},
        gpu::{self, Gpu, UNIFORM_STRIDE},
        report::{FrameReport, PassOutcome},
        view::PreparedFrame,
    },
};

/// Weight of a level's tint in its trees' colour.
const TINT_AMOUNT: f32 = 0.6;

/// The trees of one forest that a view draws.
pub struct PreparedForest {
    /// Page by page.
    pub pages: Vec<PreparedPage>,
    slots: Vec<ListSlot>,
    uniform: Buffer,
}

impl PreparedForest {
    /// Dynamic offset of `level` in group 1.
    pub fn offset(level: usize) -> u32 {
        level as u32 * UNIFORM_STRIDE as u32
    }

    /// The lists that the device made, page by page; none where the processor made them.
    pub fn device_lists(&self) -> impl Iterator<Item = &TreeList> {
        self.slots.iter().filter_map(ListSlot::device_list)
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

    /// Whether the view may draw any tree.
    pub fn draw_something(&self) -> bool {
        self.0.values().flat_map(|forest| &forest.pages).any(|page| match &page.trees {
            PageTrees::Listed(lists) => !lists.visible.is_empty(),
            PageTrees::Indirect { .. } => true,
        })
    }

    /// The counts of the lists: of this frame where the processor made them, else the last that came back. `None` if none
    /// has come back yet.
    fn count(&self, forests: &GpuForests) -> Option<ForestStatistics> {
        let mut statistics = ForestStatistics::default();
        for (entity, forest) in forests.iter() {
            let Some(prepared) = self.0.get(&entity) else { continue };
            statistics.add(forest, |_| &[]);
            for (page, slot) in prepared.pages.iter().zip(&prepared.slots) {
                match &page.trees {
                    PageTrees::Listed(lists) => statistics.add(forest, |level| lists.ranges(level)),
                    PageTrees::Indirect { .. } => {
                        let groups = &slot.counts()?.groups;
                        statistics.add(forest, |level| {
                            let before = &forest.groupings[..level];
                            let first: usize = before.iter().map(|grouping| grouping.groups(forest.sizes.len())).sum();
                            let own = forest.groupings[level].groups(forest.sizes.len());
                            groups.get(first..first + own).unwrap_or(&[])
                        });
                    }
                }
            }
        }
        Some(statistics)
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

    /// Adds the trees of one list; `ranges` are those of a level.
    fn add<'a>(&mut self, forest: &GpuForest, ranges: impl Fn(usize) -> &'a [Range<u32>]) {
        for (index, level) in forest.levels() {
            let ranges = ranges(index);
            let trees: usize = ranges.iter().map(|range| range.len()).sum();
            // A level that draws all variants together has the same number of triangles for each of them.
            let triangles =
                ranges.iter().enumerate().map(|(variant, range)| range.len() * level.gpu.triangles(variant)).sum();
            let (representation, label) = (level.renderer.representation(), level.renderer.label());
            match self.levels.iter_mut().find(|known| known.representation == representation) {
                Some(known) => {
                    known.trees += trees;
                    known.triangles += triangles;
                }
                None => {
                    self.levels.push(LevelStatistics { representation, label, trees, triangles });
                }
            }
        }
    }
}

/// Has the lists of every forest made for the view.
pub fn prepare_view_lists(
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    representations: Res<Representations>,
    gpu: Gpu,
    (maker, mut jobs): (Res<ListMaker>, ResMut<CullJobs>),
    report: Res<FrameReport>,
    mut prepared: ResMut<PreparedForests>,
    mut statistics: ResMut<ForestStatistics>,
) {
    let order = &forests.order;
    prepared.0.retain(|entity, _| order.contains(entity));
    *statistics = ForestStatistics::default();
    let Some(view) = &frame.view else { return };
    let mut work = ListWork { maker: *maker, gpu: &gpu, jobs: &mut jobs, report: &report };
    for (entity, forest) in forests.iter() {
        let settings = &forest.forest;
        let camera = view.camera - settings.origin;
        let levels = view.levels(&settings.levels);
        // A forest that was replaced on the same entity has other buffers, so group 1 is created again each frame.
        let (mut slots, uniform) = match prepared.0.remove(&entity) {
            Some(old) => (old.slots, old.uniform),
            None => (Vec::new(), gpu::uniform_slots(&gpu.device, "canopy_forest_view", MAX_LEVELS as u64)),
        };
        for (index, representation) in settings.levels.representations().iter().enumerate() {
            let tint = representations.get(*representation).map(|renderer| renderer.tint()).unwrap_or_default();
            let amount = if view.options.tint_levels { TINT_AMOUNT } else { 0.0 };
            let look = LevelLook {
                fade_in: levels.fade_in(index),
                fade_out: levels.fade_out(index),
                tint: tint.extend(amount),
            };
            let values = forest_view(forest, view.camera, Some(look));
            gpu.write(&uniform, PreparedForest::offset(index).into(), bytemuck::bytes_of(&values));
        }
        slots.resize_with(forest.page_count(), ListSlot::default);
        let mut pages = Vec::with_capacity(slots.len());
        for (page, slot) in slots.iter_mut().enumerate() {
            let Some(drawn) = forest.drawn(page) else { continue };
            let volume = Volume::view(&drawn, camera, &view.frustum, &levels, settings.view_distance);
            slot.collect(&gpu, forest, page, ListTarget::View);
            pages.push(slot.prepare(&mut work, forest, page, ListTarget::View, &volume, &uniform));
        }
        prepared.0.insert(entity, PreparedForest { pages, slots, uniform });
    }
    let counted = prepared.count(&forests);
    let (pass, outcome) = forest_outcome(&forests, counted.as_ref());
    report.record(pass, outcome);
    *statistics = counted.unwrap_or_default();
}

/// What the report says of the forest pass.
fn forest_outcome(forests: &GpuForests, counted: Option<&ForestStatistics>) -> (&'static str, PassOutcome) {
    let outcome = match counted {
        _ if forests.order.is_empty() => PassOutcome::Skipped("the world has no forest".to_owned()),
        None => PassOutcome::Ran("the device has not counted the trees yet".to_owned()),
        Some(counted) if counted.trees() == 0 => PassOutcome::Skipped("no tree is in view".to_owned()),
        Some(counted) => {
            let counts: Vec<String> =
                counted.levels.iter().map(|level| format!("{} {}", level.trees, level.label)).collect();
            PassOutcome::Ran(counts.join(", "))
        }
    };
    ("forest", outcome)
}

/// Takes the counts of the last frame's lists, after the device has finished it, and puts them into its report and
/// statistics. `true` if a list was too short: it has grown, and the frame must be drawn again to be complete.
pub fn collect_view_counts(
    gpu: Gpu,
    forests: Res<GpuForests>,
    report: Res<FrameReport>,
    mut prepared: ResMut<PreparedForests>,
    mut statistics: ResMut<ForestStatistics>,
) -> bool {
    let mut short = false;
    for (entity, forest) in forests.iter() {
        let Some(known) = prepared.0.get_mut(&entity) else { continue };
        for (page, slot) in known.slots.iter_mut().enumerate() {
            short |= slot.collect(&gpu, forest, page, ListTarget::View);
        }
    }
    if prepared.0.values().any(|forest| forest.device_lists().next().is_some())
        && let Some(counted) = prepared.count(&forests)
    {
        let (pass, outcome) = forest_outcome(&forests, Some(&counted));
        report.amend(pass, outcome);
        *statistics = counted;
    }
    short
}
