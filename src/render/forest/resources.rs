//! A forest on the GPU: made when the entity appears or changes, dropped when it is gone.

use std::sync::Arc;

use bevy::{
    ecs::{
        entity::Entity,
        resource::Resource,
        system::{Res, ResMut},
    },
    platform::collections::HashMap,
    render::{
        render_resource::{BindGroup, Buffer, BufferUsages, PipelineCache, Texture},
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    crosses::{CrossLight, upload_cross_light, upload_crosses},
    layouts::ForestLayouts,
    parts::{GpuPart, upload_parts},
    relight,
    textures::TextureShelf,
    transfer::TransferLight,
    uniforms::variants,
};
use crate::{
    bake::BakedPlant,
    light::StandTrees,
    render::{components::Forest, cull::VariantSize, extract::ExtractedScene, gpu},
    scatter::{PackedStand, PackedTree},
};
use glam::Vec3;

/// A forest's GPU side.
pub struct GpuForest {
    stand: Arc<PackedStand>,
    /// What the buffers and textures hold.
    pub(super) plants: Arc<Vec<BakedPlant>>,
    /// What the entity asks for now.
    pub forest: Forest,
    /// [`PackedTree`]s.
    pub trees: Buffer,
    /// [`VariantUniform`](super::VariantUniform)s.
    pub variants: Buffer,
    /// The leaves of all trees.
    leaves: Leaves,
    /// Size of each variant, for culling.
    pub sizes: Vec<VariantSize>,
    /// Largest scale of any tree.
    pub max_scale: f32,
    /// Parts by variant.
    pub parts: Vec<Vec<GpuPart>>,
    /// Normals, k_a and foliage of the crosses, three layers a variant.
    pub(super) cross_properties: Texture,
    /// Group 2 of the crosses.
    pub cross_bind_group: BindGroup,
    /// Which pipeline draws the crosses.
    pub cross_light: CrossLight,
    /// Group 3 of the crosses, where some have lighting pictures.
    pub cross_pictures: Option<BindGroup>,
    /// Counts up with every change of content, so that shadows know.
    pub generation: u64,
}

/// All forests of the world by their main-world entity.
#[derive(Resource, Default)]
pub struct GpuForests {
    forests: HashMap<Entity, GpuForest>,
    /// Entities in a fixed order.
    pub order: Vec<Entity>,
    generations: u64,
}

impl GpuForests {
    /// Forests in a fixed order.
    pub fn iter(&self) -> impl Iterator<Item = (Entity, &GpuForest)> {
        self.order.iter().filter_map(|entity| self.forests.get(entity).map(|forest| (*entity, forest)))
    }

    /// What the trees of all of them are to light, in the mean over the areas of their leaves.
    pub fn trees(&self) -> StandTrees {
        self.iter().map(|(_, forest)| forest.leaves).fold(Leaves::default(), Leaves::add).trees()
    }

    /// One forest.
    pub fn get(&self, entity: Entity) -> Option<&GpuForest> {
        self.forests.get(&entity)
    }
}

/// Uploads new and changed forests, forgets despawned ones.
pub fn prepare_forests(
    scene: Res<ExtractedScene>,
    layouts: Res<ForestLayouts>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    pipelines: Res<PipelineCache>,
    mut forests: ResMut<GpuForests>,
    mut transfer: ResMut<TransferLight>,
) {
    let forests = &mut *forests;
    forests.order = scene.forests.iter().map(|(entity, _)| *entity).collect();
    let alive: Vec<Entity> = forests.order.clone();
    forests.forests.retain(|entity, _| alive.contains(entity));
    for (entity, forest) in &scene.forests {
        if let Some(known) = forests.forests.get_mut(entity)
            && Arc::ptr_eq(&known.stand, &forest.stand)
            && (Arc::ptr_eq(&known.plants, &forest.plants) || relight::differ_in_light(&known.plants, &forest.plants))
            && known.forest.suns == forest.suns
        {
            if !Arc::ptr_eq(&known.plants, &forest.plants) {
                relight::relight(known, &forest.plants, &layouts, &mut transfer, &device, &queue, &pipelines);
            }
            if known.forest.origin != forest.origin {
                forests.generations += 1;
                known.generation = forests.generations;
            }
            known.forest = forest.clone();
            continue;
        }
        forests.generations += 1;
        let made = upload(forest, forests.generations, &layouts, &mut transfer, &device, &queue, &pipelines);
        forests.forests.insert(*entity, made);
    }
}

fn upload(
    forest: &Forest,
    generation: u64,
    layouts: &ForestLayouts,
    transfer: &mut TransferLight,
    device: &RenderDevice,
    queue: &RenderQueue,
    pipelines: &PipelineCache,
) -> GpuForest {
    let storage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
    let mut textures = TextureShelf::default();
    let parts = forest
        .plants
        .iter()
        .enumerate()
        .map(|(index, plant)| {
            let sun = forest.suns.get(index).copied().unwrap_or_default();
            upload_parts(plant, sun, layouts, &mut textures, transfer, device, queue, pipelines)
        })
        .collect();
    let sizes: Vec<VariantSize> = forest.plants.iter().map(variant_size).collect();
    let (cross_properties, cross_bind_group) = upload_crosses(&forest.plants, layouts, device, queue, pipelines);
    let variants = variants(&forest.plants, &sizes);
    GpuForest {
        stand: forest.stand.clone(),
        plants: forest.plants.clone(),
        forest: forest.clone(),
        trees: gpu::buffer_with::<PackedTree>(device, "canopy_trees", storage, &forest.stand.trees),
        variants: gpu::buffer_with(device, "canopy_variants", storage, &variants),
        leaves: Leaves::of(forest),
        sizes,
        max_scale: forest.stand.cells.iter().map(|cell| cell.max_scale).fold(0.0, f32::max),
        parts,
        cross_properties,
        cross_bind_group,
        cross_light: CrossLight::of(&forest.plants),
        cross_pictures: upload_cross_light(&forest.plants, layouts, device, queue, pipelines),
        generation,
    }
}

/// Sums over leaves, each counted by its area.
#[derive(Clone, Copy, Debug, Default)]
struct Leaves {
    area: f32,
    reflected: Vec3,
    transmitted: Vec3,
    crown_width: f32,
    crown_length: f32,
}

impl Leaves {
    /// Of all trees of a stand.
    fn of(forest: &Forest) -> Self {
        let mut areas = vec![0.0; forest.plants.len()];
        for tree in &forest.stand.trees {
            if let Some(area) = areas.get_mut(usize::from(tree.variant())) {
                *area += tree.scale().powi(2);
            }
        }
        let of_plant = |(plant, scaled): (&BakedPlant, f32)| {
            let colors = plant.plant.leaf_colors();
            let area = colors.area * scaled;
            Self {
                area,
                reflected: colors.reflected * area,
                transmitted: colors.transmitted * area,
                crown_width: plant.plant.crown_width() * area,
                crown_length: plant.plant.crown_length() * area,
            }
        };
        forest.plants.iter().zip(areas).map(of_plant).fold(Self::default(), Self::add)
    }

    fn add(self, other: Self) -> Self {
        Self {
            area: self.area + other.area,
            reflected: self.reflected + other.reflected,
            transmitted: self.transmitted + other.transmitted,
            crown_width: self.crown_width + other.crown_width,
            crown_length: self.crown_length + other.crown_length,
        }
    }

    fn trees(self) -> StandTrees {
        if self.area > 0.0 && self.area.is_finite() {
            StandTrees {
                reflectance: self.reflected / self.area,
                transmittance: self.transmitted / self.area,
                crown_width: self.crown_width / self.area,
                crown_length: self.crown_length / self.area,
            }
        } else {
            StandTrees::BLACK
        }
    }
}

fn variant_size(plant: &BakedPlant) -> VariantSize {
    VariantSize { height: plant.plant.height(), radius: plant.plant.reach() }
}
