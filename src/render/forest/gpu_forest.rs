//! A forest on the device: created when the entity appears or changes, dropped when it is removed.

use std::{
    ops::Range,
    sync::{Arc, OnceLock},
};

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
        renderer::RenderAdapterInfo,
        settings::WgpuLimits,
    },
};

use super::{
    block_textures::why_texels,
    drawn_forests::{DrawnForest, DrawnForests},
    leaves::Leaves,
    pipelines::{LevelPipelines, targets},
    representation::{ForestLevel, LevelTarget, Relight, Representations},
    transfer::TransferLight,
    uniforms::{foliage_groups, variants},
    upload::{BYTES_PER_FRAME, DeviceWrites, ForestUpload, TextureArrays},
};
use crate::{
    bake::BakedPlant,
    cull::{Drawn, Grouping, Page, Share, TreeSize, pages},
    light::StandTrees,
    render::{
        components::{Forest, ForestUpdates},
        cull::{DrawTable, ListSources},
        extract::ExtractedScene,
        gpu::{self, Gpu},
        report::FrameReport,
        view::{PreparedFrame, PreparedView, ViewFormat},
    },
    scatter::{PackedStand, PackedTree, PlantSize},
};

/// A part of a forest whose trees fit into one buffer.
struct GpuPage {
    page: Page,
    /// [`PackedTree`]s.
    trees: Buffer,
    /// [`Cluster`](crate::cull::Cluster)s, for lists that the device makes.
    clusters: OnceLock<Buffer>,
}

/// Number of frames over which a shadow map is drawn that takes up forests which arrive over several frames: it is drawn
/// in so many shares.
pub const MAP_SHARES: u32 = 4;

/// What a list is for: its draw calls differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ListTarget {
    /// A view.
    View,
    /// A shadow map.
    ShadowMap,
}

/// A forest on the device.
pub struct GpuForest {
    /// The stand of the component.
    stand: Arc<PackedStand>,
    /// The plants that the buffers and textures hold.
    plants: Arc<Vec<BakedPlant>>,
    /// The current component of the entity, with the stand that is drawn: an empty one if plants are missing.
    pub forest: Forest,
    pages: Vec<GpuPage>,
    /// [`TreeSize`]s and draw calls, for lists that the device makes.
    sizes_buffer: OnceLock<Buffer>,
    tables: [OnceLock<Arc<DrawTable>>; 2],
    /// [`VariantUniform`](super::VariantUniform)s.
    pub variants: Buffer,
    leaves: Leaves,
    /// Layer of foliage in the styles, by variant.
    groups: Vec<u8>,
    /// Size of each variant.
    pub sizes: Vec<PlantSize>,
    /// The same for culling.
    pub tree_sizes: Vec<TreeSize>,
    /// Largest scale of any tree.
    pub max_scale: f32,
    /// The levels in the order of [`Forest::levels`]; `None` for a representation without a renderer.
    levels: Vec<Option<ForestLevel>>,
    /// How each level groups its trees.
    pub groupings: Vec<Grouping>,
    /// The texture arrays of its crosses and clouds.
    textures: TextureArrays,
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

    /// Number of pages.
    pub fn page_count(&self) -> usize {
        self.pages.len()
    }

    /// The trees of a page on the device.
    pub fn tree_buffer(&self, page: usize) -> Option<&Buffer> {
        self.pages.get(page).map(|page| &page.trees)
    }

    /// Bytes of the trees, and of what lists on the device are made from.
    pub fn tree_bytes(&self) -> u64 {
        let of_page = |page: &GpuPage| page.trees.size() + page.clusters.get().map_or(0, |clusters| clusters.size());
        self.pages.iter().map(of_page).sum()
    }

    /// A page and its trees.
    pub fn page_trees(&self, page: usize) -> Option<(&Page, &[PackedTree])> {
        let page = &self.pages.get(page)?.page;
        Some((page, self.forest.stand.trees.get(page.trees.clone())?))
    }

    /// What volumes of a page are made from.
    pub fn drawn(&self, page: usize) -> Option<Drawn<'_>> {
        let page = &self.pages.get(page)?.page;
        let grid = self.forest.stand.grid;
        Some(Drawn { page, grid, groupings: &self.groupings, variants: self.sizes.len() })
    }

    /// What the device makes a page's lists from. Uploaded when they are first made there.
    pub fn list_sources(&self, gpu: &Gpu, page: usize, target: ListTarget) -> Option<ListSources<'_>> {
        let page = self.pages.get(page)?;
        let storage = BufferUsages::STORAGE;
        let upload = || gpu.filled_buffer("canopy_clusters", storage, &page.page.clusters);
        let sizes = || gpu.filled_buffer("canopy_tree_sizes", storage, &self.tree_sizes);
        let draws = |target: LevelTarget, shares: &[Share]| {
            let calls = self
                .levels()
                .flat_map(|(index, level)| level.gpu.draws(target).into_iter().map(move |draw| (index, draw)));
            Arc::new(DrawTable::new(gpu, &self.groupings, self.sizes.len(), calls, shares))
        };
        let table = match target {
            ListTarget::View => self.tables[0].get_or_init(|| draws(LevelTarget::View(ViewFormat::ANY), &[Share::ALL])),
            ListTarget::ShadowMap => self.tables[1].get_or_init(|| {
                let shares: Vec<Share> = [Share::ALL].into_iter().chain(Share::each(MAP_SHARES)).collect();
                draws(LevelTarget::ShadowMap, &shares)
            }),
        };
        Some(ListSources {
            trees: &page.trees,
            tree_count: page.page.trees.len(),
            clusters: page.clusters.get_or_init(upload),
            cluster_count: page.page.clusters.len(),
            sizes: self.sizes_buffer.get_or_init(sizes),
            table,
            groupings: &self.groupings,
            variants: self.sizes.len(),
        })
    }

    /// The layer of foliage (0, 1, ...) of each plant in the styles, by variant.
    pub fn foliage_groups(&self) -> &[u8] {
        &self.groups
    }

    /// Distances in metres from the centre of a shadow map at which each level casts into a map of `texel` metres per
    /// texel; `near` are those of the first level. What is drawn nearer in `view` casts nearer too.
    ///
    /// A tree casts in the first level whose range contains it. That is the level in which the view draws it, except
    /// for levels that are too fine for the map: the farthest level casts instead of them.
    pub fn casting_distances(&self, near: Range<f64>, texel: f64, view: &PreparedView) -> Vec<Range<f64>> {
        let levels = view.levels(&self.forest.levels);
        let near = near.start..near.end * f64::from(self.forest.levels.view_factor(view.zoom, view.focal_pixels));
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

    fn new(
        component: &Forest,
        generation: u64,
        trees_per_buffer: usize,
        known: &Representations,
        upload: &mut ForestUpload,
    ) -> Self {
        let forest = &Forest { stand: drawn_stand(component), ..component.clone() };
        let storage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let sizes: Vec<PlantSize> = forest.plants.iter().map(BakedPlant::size).collect();
        let on_device = |page: Page| {
            let of_page = Arc::new((forest.stand.clone(), page.trees.clone()));
            let trees = upload.shared_buffer("canopy_trees", storage, &of_page, |(stand, range)| {
                stand.trees.get(range.clone()).unwrap_or(&[])
            });
            GpuPage { page, trees, clusters: OnceLock::new() }
        };
        let pages = pages(&forest.stand, &sizes, trees_per_buffer).into_iter().map(on_device).collect();
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
            pages,
            sizes_buffer: OnceLock::new(),
            tables: Default::default(),
            variants,
            leaves: Leaves::of(&forest.stand, &forest.plants),
            tree_sizes: sizes.iter().map(TreeSize::from).collect(),
            groups: foliage_groups(&forest.plants),
            sizes,
            max_scale: forest.stand.cells.iter().map(|cell| cell.max_scale).fold(0.0, f32::max),
            groupings: levels.iter().map(grouping).collect(),
            levels,
            textures: upload.textures,
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
    /// All of it happens in this frame. Cost: packing and writing 20 bytes per vertex, and 7 MB per plant whose crosses changed (256 texels; 2.6
    /// MB in blocks).
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
        self.leaves().trees()
    }

    /// Sums over the leaves of all forests.
    pub fn leaves(&self) -> Leaves {
        self.iter().map(|(_, forest)| forest.leaves).fold(Leaves::default(), Leaves::add)
    }

    /// One forest.
    pub fn get(&self, entity: Entity) -> Option<&GpuForest> {
        self.forests.get(&entity)
    }
}

/// The most trees that lie in one storage buffer of a device of these limits.
fn trees_in_buffer(limits: &WgpuLimits) -> usize {
    let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    usize::try_from(bytes).unwrap_or(usize::MAX) / size_of::<PackedTree>()
}

/// The most pages of a forest.
const MOST_PAGES: usize = 64;

/// The most trees of a forest on a device of these limits: so many lie in as many storage buffers as a forest may have.
pub fn most_trees(limits: &WgpuLimits) -> usize {
    trees_in_buffer(limits).saturating_mul(MOST_PAGES).min(u32::MAX as usize)
}

/// Uploads new and changed forests, all at once or a share of them, and drops despawned ones.
pub fn prepare_forests(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    representations: Res<Representations>,
    pipelines: Res<LevelPipelines>,
    gpu: Gpu,
    adapter: Res<RenderAdapterInfo>,
    report: Res<FrameReport>,
    told: Res<DrawnForests>,
    mut forests: ResMut<GpuForests>,
    mut transfer: ResMut<TransferLight>,
) {
    let forests = &mut *forests;
    let limit = most_trees(&gpu.device.limits());
    let trees_per_buffer = trees_in_buffer(&gpu.device.limits()).min(scene.tree_lists.trees_per_buffer);
    let fits = |forest: &Forest| {
        let count = forest.stand.trees.len();
        if count > limit {
            error_once!("a forest of {count} trees is not drawn: this device holds at most {limit}");
        }
        count <= limit
    };
    let why_texels = why_texels(scene.texture_compression.0, &gpu.device, adapter.device_type);
    let textures = TextureArrays { wanted: why_texels.is_none(), ..TextureArrays::default() };
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
                let (transfer, writes) = (&mut *transfer, &mut writes);
                known.relight(forest, &mut ForestUpload { gpu: &gpu, transfer, writes, textures });
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
                let upload = &mut ForestUpload { gpu: &gpu, transfer: &mut transfer, writes: &mut writes, textures };
                let forest = GpuForest::new(forest, forests.generations, trees_per_buffer, &representations, upload);
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
    let to_tell = |(entity, known): (Entity, &GpuForest)| DrawnForest {
        entity,
        stand: known.forest.stand.clone(),
        plants: known.plants.clone(),
    };
    told.set(forests.iter().map(to_tell).collect());
    let arrays = forests.iter().map(|(_, forest)| forest.textures);
    let (in_blocks, all) = arrays.fold((0, 0), |sum, arrays| (sum.0 + arrays.in_blocks, sum.1 + arrays.all));
    match why_texels {
        _ if all == 0 => report.skipped("texture compression", "no crosses or clouds are drawn"),
        Some(why) if in_blocks == 0 => report.skipped("texture compression", why),
        _ => report.ran("texture compression", format!("{in_blocks} of {all} texture arrays in blocks")),
    }
    if uploads.is_empty() {
        report.skipped("forest upload", "no forest is new");
    } else {
        report.ran("forest upload", uploads.join(", "));
    }
}
