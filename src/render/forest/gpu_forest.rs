//! A forest on the device: created when the entity appears or changes, dropped when it is removed.

use std::{ops::Range, sync::Arc};

use bevy::{
    ecs::{
        entity::Entity,
        resource::Resource,
        system::{Res, ResMut},
    },
    log::error_once,
    platform::collections::HashMap,
    render::{
        render_resource::{Buffer, BufferUsages},
        settings::WgpuLimits,
    },
};

use super::{
    leaves::Leaves,
    pipelines::{LevelPipelines, targets},
    representation::{ForestLevel, Relight, Representations},
    transfer::TransferLight,
    uniforms::{foliage_groups, variants},
    upload::{BYTES_PER_FRAME, DeviceWrites, ForestUpload},
};
use crate::{
    bake::BakedPlant,
    cull::Grouping,
    light::StandTrees,
    render::{
        components::{Forest, ForestUpdates},
        extract::ExtractedScene,
        gpu::{self, Gpu},
        report::FrameReport,
        view::PreparedFrame,
    },
    scatter::{PackedStand, PackedTree, PlantSize},
};

/// A forest on the device.
pub struct GpuForest {
    /// The stand of the component.
    stand: Arc<PackedStand>,
    /// The plants that the buffers and textures hold.
    plants: Arc<Vec<BakedPlant>>,
    /// The current component of the entity, with the stand that is drawn: an empty one if plants are missing.
    pub forest: Forest,
    /// [`PackedTree`]s.
    pub trees: Buffer,
    /// [`VariantUniform`](super::VariantUniform)s.
    pub variants: Buffer,
    leaves: Leaves,
    /// Layer of foliage in the styles, by variant.
    groups: Vec<u8>,
    /// Size of each variant, for culling.
    pub sizes: Vec<PlantSize>,
    /// Largest scale of any tree.
    pub max_scale: f32,
    /// The levels in the order of [`Forest::levels`]; `None` for a representation without a renderer.
    levels: Vec<Option<ForestLevel>>,
    /// How each level groups its trees.
    pub groupings: Vec<Grouping>,
    /// Increases with every change of content, so that shadows are drawn again.
    pub generation: u64,
}

impl GpuForest {
    /// The levels that can be drawn, with their index.
    pub fn levels(&self) -> impl DoubleEndedIterator<Item = (usize, &ForestLevel)> {
        self.levels.iter().enumerate().filter_map(|(index, level)| level.as_ref().map(|level| (index, level)))
    }

    /// The baked plants, by variant.
    pub fn plants(&self) -> &[BakedPlant] {
        &self.plants
    }

    /// The layer of foliage (0, 1, ...) of each plant in the styles, by variant.
    pub fn foliage_groups(&self) -> &[u8] {
        &self.groups
    }

    /// Distances in metres from the centre of a shadow map at which each level casts into a map of `texel` metres per
    /// texel; `near` are those of the first level.
    ///
    /// A tree casts in the first level whose range contains it. That is the level in which the view draws it, except
    /// for levels that are too fine for the map: the farthest level casts instead of them.
    pub fn casting_distances(&self, near: Range<f64>, texel: f64) -> Vec<Range<f64>> {
        let levels = &self.forest.levels;
        let mut casting = vec![0.0..0.0; levels.len()];
        let mut ends = near.end;
        for (index, level) in self.levels() {
            let start = if index == 0 { near.start } else { near.start.max(ends) };
            ends =
                if index == 0 { ends } else { levels.fade_out(index).map_or(ends, |fade| ends.max(fade.end.into())) };
            if level.renderer.coarsest_shadow_texel().is_some_and(|coarsest| texel < coarsest) {
                casting[index] = start..ends;
            }
        }
        if let Some((last, _)) = self.levels().rev().find(|(_, level)| level.renderer.coarsest_shadow_texel().is_some())
        {
            casting[last] = 0.0..f64::INFINITY;
        }
        casting
    }

    fn new(component: &Forest, generation: u64, known: &Representations, upload: &mut ForestUpload) -> Self {
        let forest = &Forest { stand: drawn_stand(component), ..component.clone() };
        let storage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let sizes: Vec<PlantSize> = forest.plants.iter().map(BakedPlant::size).collect();
        let trees = upload.shared_buffer("canopy_trees", storage, &forest.stand, |stand| &stand.trees);
        let variants =
            gpu::buffer_with(&upload.gpu.device, "canopy_variants", storage, &variants(&forest.plants, &sizes));
        let level = |representation| {
            let renderer = known.get(representation).cloned();
            if renderer.is_none() {
                let names: Vec<_> = known.iter().map(|renderer| renderer.representation().name()).collect();
                error_once!(
                    "a forest has the level `{}`, which nothing can draw (known: {}): register it with \
                     `App::register_representation`",
                    representation.name(),
                    names.join(", ")
                );
            }
            renderer.map(|renderer| ForestLevel { gpu: renderer.upload(forest, upload), renderer })
        };
        let levels: Vec<_> = forest.levels.representations().iter().copied().map(level).collect();
        let grouping =
            |level: &Option<ForestLevel>| level.as_ref().map_or(Grouping::Together, |level| level.renderer.grouping());
        Self {
            stand: component.stand.clone(),
            plants: forest.plants.clone(),
            forest: forest.clone(),
            trees,
            variants,
            leaves: Leaves::of(&forest.stand, &forest.plants),
            groups: foliage_groups(&forest.plants),
            sizes,
            max_scale: forest.stand.cells.iter().map(|cell| cell.max_scale).fold(0.0, f32::max),
            groupings: levels.iter().map(grouping).collect(),
            levels,
            generation,
        }
    }

    /// Whether `forest` differs from the uploaded one only in lighting.
    fn can_follow(&self, forest: &Forest) -> bool {
        let same = |(old, new): (&BakedPlant, &BakedPlant)| {
            Arc::ptr_eq(&old.plant, &new.plant) && self.levels().all(|(_, level)| level.renderer.same_shape(old, new))
        };
        Arc::ptr_eq(&self.stand, &forest.stand)
            && self.forest.levels.representations() == forest.levels.representations()
            && self.forest.suns == forest.suns
            && (Arc::ptr_eq(&self.plants, &forest.plants)
                || (self.plants.len() == forest.plants.len() && self.plants.iter().zip(forest.plants.iter()).all(same)))
    }

    /// Updates the lighting of plants that are already drawn: new bakes overwrite the data on the device. Meshes,
    /// outlines, the stand and therefore the shadow maps stay.
    ///
    /// All of it happens in this frame. Cost: packing and writing 20 bytes per vertex, and 1 MB per plant whose crosses changed (256 texels).
    fn relight(&mut self, forest: &Forest, upload: &mut ForestUpload) {
        let relight = Relight { old: &self.plants, new: &forest.plants, suns: &forest.suns };
        for level in self.levels.iter_mut().flatten() {
            level.gpu.relight(&relight, upload);
        }
        let variants = variants(&forest.plants, &self.sizes);
        upload.gpu.queue.write_buffer(&self.variants, 0, bytemuck::cast_slice(&variants));
        upload.writes.run(&upload.gpu.queue, &mut { u64::MAX });
        self.plants = forest.plants.clone();
        self.groups = foliage_groups(&self.plants);
    }
}

/// The stand of `forest`, or one without trees if these refer to plants that are missing: buffers of plants that are too
/// short are errors on the device.
fn drawn_stand(forest: &Forest) -> Arc<PackedStand> {
    let variants = forest.stand.trees.iter().map(|tree| usize::from(tree.variant()) + 1).max().unwrap_or(0);
    if variants <= forest.plants.len() {
        return forest.stand.clone();
    }
    error_once!(
        "a forest has {} plants, but its trees refer to {variants}: it is not drawn. Give `Forest::plants` one for each \
         variant of the trees",
        forest.plants.len()
    );
    Arc::new(PackedStand { trees: Vec::new(), indices: Vec::new(), cells: Vec::new(), grid: forest.stand.grid })
}

/// A forest that is not drawn yet.
struct Arriving {
    forest: GpuForest,
    /// What the device does not have of it.
    writes: DeviceWrites,
}

/// All forests of the world by their main-world entity.
#[derive(Resource, Default)]
pub struct GpuForests {
    forests: HashMap<Entity, GpuForest>,
    arriving: HashMap<Entity, Arriving>,
    /// Entities of the forests that are drawn, in a fixed order.
    pub order: Vec<Entity>,
    generations: u64,
}

impl GpuForests {
    /// Forests in a fixed order.
    pub fn iter(&self) -> impl Iterator<Item = (Entity, &GpuForest)> {
        self.order.iter().filter_map(|entity| self.forests.get(entity).map(|forest| (*entity, forest)))
    }

    /// All levels of all forests.
    pub fn levels(&self) -> impl Iterator<Item = &ForestLevel> {
        self.iter().flat_map(|(_, forest)| forest.levels().map(|(_, level)| level))
    }

    /// All levels of the forests that are not drawn yet, in no fixed order.
    pub fn arriving_levels(&self) -> impl Iterator<Item = &ForestLevel> {
        self.arriving.values().flat_map(|arriving| arriving.forest.levels().map(|(_, level)| level))
    }

    /// Whether there is no tree in any forest.
    pub fn have_no_trees(&self) -> bool {
        self.iter().all(|(_, forest)| forest.forest.stand.trees.is_empty())
    }

    /// Optical properties of the trees of all forests, averaged over the areas of their leaves.
    pub fn trees(&self) -> StandTrees {
        self.iter().map(|(_, forest)| forest.leaves).fold(Leaves::default(), Leaves::add).trees()
    }

    /// One forest.
    pub fn get(&self, entity: Entity) -> Option<&GpuForest> {
        self.forests.get(&entity)
    }
}

/// The most trees of a forest on a device of these limits: all of them lie in one storage buffer.
pub fn most_trees(limits: &WgpuLimits) -> usize {
    let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    usize::try_from(bytes).unwrap_or(usize::MAX) / size_of::<PackedTree>()
}

/// Uploads new and changed forests, all at once or a share of them, and drops despawned ones.
pub fn prepare_forests(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    representations: Res<Representations>,
    pipelines: Res<LevelPipelines>,
    gpu: Gpu,
    report: Res<FrameReport>,
    mut forests: ResMut<GpuForests>,
    mut transfer: ResMut<TransferLight>,
) {
    let forests = &mut *forests;
    let limit = most_trees(&gpu.device.limits());
    let fits = |forest: &Forest| {
        let count = forest.stand.trees.len();
        if count > limit {
            error_once!("a forest of {count} trees is not drawn: this device holds at most {limit}");
        }
        count <= limit
    };
    let blocking = scene.forest_updates == ForestUpdates::Blocking;
    let mut budget = if blocking { u64::MAX } else { BYTES_PER_FRAME };
    let has_pipelines = |forest: &GpuForest| {
        let levels = || forest.levels().map(|(_, level)| level);
        targets(&scene, &frame).all(|target| pipelines.ready(levels(), target, &gpu.pipelines))
    };
    let drawn: Vec<_> = scene.forests.iter().filter(|(_, forest)| fits(forest)).collect();
    let alive: Vec<Entity> = drawn.iter().map(|(entity, _)| *entity).collect();
    forests.forests.retain(|entity, _| alive.contains(entity));
    forests.arriving.retain(|entity, _| alive.contains(entity));
    let mut uploads = Vec::new();
    for (entity, forest) in drawn {
        if let Some(known) = forests.forests.get_mut(entity).filter(|known| known.can_follow(forest)) {
            forests.arriving.remove(entity);
            if !Arc::ptr_eq(&known.plants, &forest.plants) {
                let mut writes = DeviceWrites::default();
                known.relight(forest, &mut ForestUpload { gpu: &gpu, transfer: &mut transfer, writes: &mut writes });
            }
            if known.forest.origin != forest.origin {
                forests.generations += 1;
                known.generation = forests.generations;
            }
            known.forest = Forest { stand: known.forest.stand.clone(), ..forest.clone() };
            continue;
        }
        let under_way = forests.arriving.remove(entity);
        let same = |arriving: &Arriving| {
            arriving.forest.can_follow(forest) && Arc::ptr_eq(&arriving.forest.plants, &forest.plants)
        };
        let mut arriving = match under_way.filter(same) {
            Some(mut arriving) => {
                arriving.forest.forest = Forest { stand: arriving.forest.forest.stand.clone(), ..forest.clone() };
                arriving
            }
            None => {
                forests.generations += 1;
                let mut writes = DeviceWrites::default();
                let mut upload = ForestUpload { gpu: &gpu, transfer: &mut transfer, writes: &mut writes };
                let forest = GpuForest::new(forest, forests.generations, &representations, &mut upload);
                Arriving { forest, writes }
            }
        };
        arriving.writes.run(&gpu.queue, &mut budget);
        let (done, total) = arriving.writes.progress();
        uploads.push(format!("{:.1} of {:.1} MB", done as f64 * 1e-6, total as f64 * 1e-6));
        if blocking || (arriving.writes.are_done() && has_pipelines(&arriving.forest)) {
            forests.forests.insert(*entity, arriving.forest);
        } else {
            forests.arriving.insert(*entity, arriving);
        }
    }
    forests.order = alive;
    forests.order.retain(|entity| forests.forests.contains_key(entity));
    if uploads.is_empty() {
        report.skipped("forest upload", "no forest is new");
    } else {
        report.ran("forest upload", uploads.join(", "));
    }
}
