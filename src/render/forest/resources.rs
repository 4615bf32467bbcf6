//! A forest on the GPU: made when the entity appears or changes, dropped when it is gone.

use std::sync::Arc;

use bevy::{
    ecs::{
        entity::Entity,
        resource::Resource,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    platform::collections::HashMap,
    render::{
        render_resource::{
            AddressMode, BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            BufferUsages, FilterMode, MipmapFilterMode, PipelineCache, Sampler, SamplerBindingType, SamplerDescriptor,
            ShaderStages, Texture, TextureFormat, TextureSampleType, TextureView,
            binding_types::{
                sampler, storage_buffer_read_only_sized, texture_2d, texture_2d_array, uniform_buffer_sized,
            },
        },
        renderer::{RenderDevice, RenderQueue},
    },
};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::{
    relight,
    transfer::{TransferLight, TransferUniform},
    vertex::PlantVertex,
};
use crate::{
    bake::{
        BakedPlant,
        billboard::SPREAD_LEVELS,
        lighting::BakedLighting,
        transfer::{Channels, TransferSettings},
    },
    plant::{
        PartKind, PlantMaterial, PlantMesh,
        texture::{MipChain, color_mips, leaf_mips, normal_mips},
    },
    render::{
        components::{Forest, SunLight},
        cull::VariantSize,
        extract::ExtractedScene,
        gpu,
    },
    scatter::{PackedStand, PackedTree},
};

/// `ForestView` of `shaders/forest/instance.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ForestViewUniform {
    /// Cell of the anchor.
    pub anchor_cell: [i32; 2],
    /// Metres of the anchor inside its cell.
    pub anchor_offset: [f32; 2],
    /// Anchor's height over the stand's datum.
    pub anchor_y: f32,
    /// Metres along a cell's side.
    pub cell_size: f32,
    /// Where the full model begins to give way, metres.
    pub fade_start: f32,
    /// Where it is gone, metres.
    pub fade_end: f32,
}

/// `Plane` of `shaders/forest/instance.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PlaneUniform {
    /// Middle of the picture, metres in the plant's frame.
    pub center: [f32; 4],
    /// Half extent to the picture's right.
    pub u: [f32; 4],
    /// Half extent upwards.
    pub v: [f32; 4],
    /// Unit normal towards the side that the picture was taken from.
    pub normal: [f32; 4],
}

/// Planes of a cross.
pub const PLANES: usize = 3;

/// `Variant` of `shaders/forest/instance.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct VariantUniform {
    /// Two upright planes and a level one.
    pub planes: [PlaneUniform; PLANES],
    /// Height, crown radius, first layer of its pictures, 1 where it has a full model.
    pub size: [f32; 4],
    /// Transmission of its leaves; w: 1 where k_a was traced and holds what leaves send each other.
    pub transmission: [f32; 4],
    /// How far the leaves of a texel face everywhere, mip by mip.
    pub spread: [[f32; 4]; SPREAD_LEVELS / 4],
    /// Gloss of its leaves: reflectance, roughness, 1 where normals point out of the crown; w: first layer of its lighting
    /// pictures.
    pub gloss: [f32; 4],
}

/// `Part` of `shaders/forest/model.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PartUniform {
    /// Linear factor on the texture.
    pub base_color: [f32; 4],
    /// Transmission factor; w: 1 where the normals point out of the crown, whichever side of a leaf is seen.
    pub transmission: [f32; 4],
    /// Gloss: reflectance, roughness; unused, unused.
    pub gloss: [f32; 4],
}

/// Bind group layouts of everything that draws trees.
#[derive(Resource)]
pub struct ForestLayouts {
    /// Group 1: instances.
    pub instances: BindGroupLayoutDescriptor,
    /// Group 2 of full models.
    pub part: BindGroupLayoutDescriptor,
    /// Group 2 of crosses.
    pub cross: BindGroupLayoutDescriptor,
    /// Group 3 of crosses of which some are lit by radiance transfer.
    pub cross_light: BindGroupLayoutDescriptor,
    /// Group 3: radiance transfer.
    pub transfer: BindGroupLayoutDescriptor,
    part_sampler: Sampler,
    cross_sampler: Sampler,
}

impl FromWorld for ForestLayouts {
    fn from_world(world: &mut World) -> Self {
        let device = world.resource::<RenderDevice>();
        let float = TextureSampleType::Float { filterable: true };
        let part_sampler = |address| {
            device.create_sampler(&SamplerDescriptor {
                label: Some("canopy_plant"),
                address_mode_u: address,
                address_mode_v: address,
                mag_filter: FilterMode::Linear,
                min_filter: FilterMode::Linear,
                mipmap_filter: MipmapFilterMode::Linear,
                ..Default::default()
            })
        };
        Self {
            instances: BindGroupLayoutDescriptor::new(
                "canopy_instances",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::VERTEX,
                    (
                        uniform_buffer_sized(true, std::num::NonZeroU64::new(size_of::<ForestViewUniform>() as u64)),
                        storage_buffer_read_only_sized(false, None),
                        storage_buffer_read_only_sized(false, None),
                        storage_buffer_read_only_sized(false, None).visibility(ShaderStages::VERTEX_FRAGMENT),
                    ),
                ),
            ),
            part: BindGroupLayoutDescriptor::new(
                "canopy_plant_part",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::FRAGMENT,
                    (
                        texture_2d(float),
                        texture_2d(float),
                        sampler(SamplerBindingType::Filtering),
                        uniform_buffer_sized(false, std::num::NonZeroU64::new(size_of::<PartUniform>() as u64)),
                    ),
                ),
            ),
            cross: BindGroupLayoutDescriptor::new(
                "canopy_cross",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::FRAGMENT,
                    (texture_2d_array(float), texture_2d_array(float), sampler(SamplerBindingType::Filtering)),
                ),
            ),
            cross_light: BindGroupLayoutDescriptor::new(
                "canopy_cross_light",
                &BindGroupLayoutEntries::single(ShaderStages::FRAGMENT, texture_2d_array(float)),
            ),
            transfer: BindGroupLayoutDescriptor::new(
                "canopy_transfer",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::VERTEX,
                    (
                        storage_buffer_read_only_sized(false, None),
                        storage_buffer_read_only_sized(false, None),
                        storage_buffer_read_only_sized(
                            false,
                            std::num::NonZeroU64::new(size_of::<TransferUniform>() as u64),
                        ),
                    ),
                ),
            ),
            part_sampler: part_sampler(AddressMode::Repeat),
            cross_sampler: part_sampler(AddressMode::ClampToEdge),
        }
    }
}

/// How the sky's light reaches the crosses of a forest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CrossLight {
    /// All by normal and k_a.
    Plain,
    /// Some by lighting pictures.
    Mixed,
    /// All by lighting pictures.
    Pictures,
}

impl CrossLight {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Plain, Self::Mixed, Self::Pictures];

    /// That of crosses of these plants.
    pub(super) fn of(plants: &[BakedPlant]) -> Self {
        let lit = plants.iter().filter(|plant| !plant.cross.textures.light.is_empty()).count();
        match lit {
            0 => Self::Plain,
            all if all == plants.len() => Self::Pictures,
            _ => Self::Mixed,
        }
    }
}

/// Vertices and indices of one part, full or proxy.
pub struct GpuMesh {
    /// [`PlantVertex`]es.
    pub vertices: Buffer,
    /// 32-bit indices.
    pub indices: Buffer,
    /// Number of indices; 0 draws nothing.
    pub index_count: u32,
}

/// One part of a plant.
pub struct GpuPart {
    /// Wood or foliage.
    pub kind: PartKind,
    /// [`PartUniform`] of group 2.
    pub(super) uniform: Buffer,
    /// The full model.
    pub model: GpuMesh,
    /// What casts the near shadow.
    pub proxy: GpuMesh,
    /// Group 2.
    pub bind_group: BindGroup,
    /// Which pipeline draws it.
    pub light: PartLight,
    /// Group 3 of plants that are lit by radiance transfer.
    pub transfer: Option<BindGroup>,
}

/// What light reaches a part's full model, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PartLight {
    /// Sky by normal and k_a, sun by the leaf shader.
    Plain,
    /// Sky by transfer.
    Transfer {
        /// Whether light takes on colour on its way through the crown.
        color: bool,
        /// What the sun comes by.
        sun: SunLight,
    },
}

impl PartLight {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Plain,
        Self::Transfer { color: false, sun: SunLight::LeafShader },
        Self::Transfer { color: false, sun: SunLight::Harmonics },
        Self::Transfer { color: true, sun: SunLight::LeafShader },
        Self::Transfer { color: true, sun: SunLight::Harmonics },
    ];

    /// The light of a part, with the settings of its transfer if it has one.
    pub(super) fn new(transfer: Option<&TransferSettings>, sun: SunLight) -> Self {
        transfer.map_or(Self::Plain, |settings| Self::Transfer { color: settings.channels == Channels::Rgb, sun })
    }
}

/// A forest's GPU side.
pub struct GpuForest {
    stand: Arc<PackedStand>,
    /// What the buffers and textures hold.
    pub(super) plants: Arc<Vec<BakedPlant>>,
    /// What the entity asks for now.
    pub forest: Forest,
    /// [`PackedTree`]s.
    pub trees: Buffer,
    /// [`VariantUniform`]s.
    pub variants: Buffer,
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

fn variant_size(plant: &BakedPlant) -> VariantSize {
    VariantSize { height: plant.plant.height(), radius: plant.plant.reach() }
}

/// What the shaders know of each plant.
pub(super) fn variants(plants: &[BakedPlant], sizes: &[VariantSize]) -> Vec<VariantUniform> {
    let mut lit_layer = 0;
    plants
        .iter()
        .zip(sizes)
        .enumerate()
        .map(|(index, (plant, size))| {
            let variant = variant(index, plant, size, lit_layer);
            lit_layer += plant.cross.textures.light.len();
            variant
        })
        .collect()
}

/// `lit_layer`: the first of its lighting pictures, if it has any.
fn variant(index: usize, plant: &BakedPlant, size: &VariantSize, lit_layer: usize) -> VariantUniform {
    let mut planes = [PlaneUniform::default(); PLANES];
    for (slot, plane) in planes.iter_mut().zip(&plant.cross.planes) {
        *slot = PlaneUniform {
            center: plane.center.extend(0.0).to_array(),
            u: plane.u.extend(0.0).to_array(),
            v: plane.v.extend(0.0).to_array(),
            normal: plane.normal.extend(0.0).to_array(),
        };
    }
    let traced = f32::from(u8::from(matches!(*plant.lighting, BakedLighting::Transfer(_))));
    let gloss = plant.plant.leaf_gloss();
    VariantUniform {
        planes,
        size: [size.height, size.radius, (index * PLANES) as f32, 1.0],
        transmission: plant.cross.transmission.extend(traced).to_array(),
        spread: bytemuck::cast(plant.cross.spread),
        gloss: [gloss.reflectance, gloss.roughness, realigned(&plant.lighting), lit_layer as f32],
    }
}

/// 1 where the foliage's normals point out of the crown.
fn realigned(lighting: &BakedLighting) -> f32 {
    f32::from(u8::from(lighting.is_realigned()))
}

/// What an image is used for: each use filters it otherwise.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum TextureUse {
    Wood,
    /// With the bits of the alpha test's threshold.
    Foliage(u32),
    Normal,
}

/// Textures that several parts share are uploaded once.
#[derive(Default)]
struct TextureShelf {
    views: HashMap<(usize, TextureUse), TextureView>,
}

impl TextureShelf {
    fn color(
        &mut self,
        material: &PlantMaterial,
        kind: PartKind,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> TextureView {
        let format = TextureFormat::Rgba8UnormSrgb;
        let Some(image) = &material.base_color_texture else {
            return gpu::texture(device, queue, "canopy_white", format, &plain([255; 4]), 1);
        };
        let foliage = kind == PartKind::Foliage;
        let usage = if foliage { TextureUse::Foliage(material.alpha_cutoff.to_bits()) } else { TextureUse::Wood };
        self.views
            .entry((Arc::as_ptr(image) as usize, usage))
            .or_insert_with(|| {
                let chain = if foliage { leaf_mips(image, material.alpha_cutoff) } else { color_mips(image) };
                let smallest = if foliage { gpu::SMALLEST_TESTED_MIP } else { 1 };
                gpu::texture(device, queue, "canopy_base_color", format, &chain, smallest)
            })
            .clone()
    }

    fn normal(&mut self, material: &PlantMaterial, device: &RenderDevice, queue: &RenderQueue) -> TextureView {
        let format = TextureFormat::Rgba8Unorm;
        let Some(image) = &material.normal_texture else {
            return gpu::texture(device, queue, "canopy_flat", format, &plain([128, 128, 255, 255]), 1);
        };
        self.views
            .entry((Arc::as_ptr(image) as usize, TextureUse::Normal))
            .or_insert_with(|| gpu::texture(device, queue, "canopy_normal", format, &normal_mips(image), 1))
            .clone()
    }
}

fn plain(texel: [u8; 4]) -> MipChain {
    MipChain { width: 1, height: 1, levels: vec![texel.to_vec()] }
}

fn upload_parts(
    plant: &BakedPlant,
    sun: SunLight,
    layouts: &ForestLayouts,
    textures: &mut TextureShelf,
    transfer: &mut TransferLight,
    device: &RenderDevice,
    queue: &RenderQueue,
    pipelines: &PipelineCache,
) -> Vec<GpuPart> {
    let layout = pipelines.get_bind_group_layout(&layouts.part);
    let mut parts = Vec::new();
    for (index, part) in plant.plant.parts.iter().enumerate() {
        let empty = PlantMesh::default();
        let proxy = plant.shadow_proxy.get(index).unwrap_or(&empty);
        let material = &part.material;
        let coefficients = plant.lighting.transfer(index);
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let uniform = part_uniform(material, &plant.lighting);
        let uniform = gpu::buffer_with(device, "canopy_plant_part", usage, &[uniform]);
        let color = textures.color(material, part.kind, device, queue);
        let normal = textures.normal(material, device, queue);
        let bind_group = device.create_bind_group(
            "canopy_plant_part",
            &layout,
            &BindGroupEntries::sequential((&color, &normal, &layouts.part_sampler, uniform.as_entire_binding())),
        );
        parts.push(GpuPart {
            kind: part.kind,
            uniform,
            model: upload_mesh(&part.mesh, &vertices(&part.mesh, &plant.lighting, index), device),
            proxy: upload_mesh(proxy, &vertices(proxy, &BakedLighting::Local, index), device),
            bind_group,
            light: PartLight::new(coefficients.map(|(settings, _)| settings), sun),
            transfer: coefficients.map(|part| transfer.bind_group(part, sun, layouts, device, pipelines)),
        });
    }
    parts
}

pub(super) fn part_uniform(material: &PlantMaterial, lighting: &BakedLighting) -> PartUniform {
    let gloss = material.gloss.in_range();
    PartUniform {
        base_color: material.base_color.extend(1.0).to_array(),
        transmission: material.transmission.extend(realigned(lighting)).to_array(),
        gloss: [gloss.reflectance, gloss.roughness, 0.0, 0.0],
    }
}

/// The vertices of `mesh`, which is part `part` of a plant, with the normals and the k_a of its `lighting`; what is missing
/// there is the mesh's own, or 1.
pub(super) fn vertices(mesh: &PlantMesh, lighting: &BakedLighting, part: usize) -> Vec<PlantVertex> {
    let (normals, ambient) = (lighting.normals(part).unwrap_or(&mesh.normals), lighting.ambient(part));
    let vertex = |(i, &position): (usize, &Vec3)| {
        let normal = normals.get(i).copied().unwrap_or(Vec3::Y);
        let uv = mesh.uvs.get(i).copied().unwrap_or_default();
        PlantVertex::new(position, normal, ambient.get(i).copied().unwrap_or(1.0), uv)
    };
    mesh.positions.iter().enumerate().map(vertex).collect()
}

fn upload_mesh(mesh: &PlantMesh, vertices: &[PlantVertex], device: &RenderDevice) -> GpuMesh {
    let indices: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    let vertex = BufferUsages::VERTEX | BufferUsages::COPY_DST;
    GpuMesh {
        vertices: gpu::buffer_with(device, "canopy_plant_vertices", vertex, vertices),
        indices: gpu::buffer_with(device, "canopy_plant_indices", BufferUsages::INDEX, &indices),
        index_count: indices.len() as u32,
    }
}

/// The pictures of all crosses: the texture of their properties, and both kinds in a bind group.
fn upload_crosses(
    plants: &[BakedPlant],
    layouts: &ForestLayouts,
    device: &RenderDevice,
    queue: &RenderQueue,
    pipelines: &PipelineCache,
) -> (Texture, BindGroup) {
    let colors: Vec<&MipChain> = plants.iter().flat_map(|plant| &plant.cross.textures.color).collect();
    let properties: Vec<&MipChain> = plants.iter().flat_map(|plant| &plant.cross.textures.properties).collect();
    let upload = |label: &str, format: TextureFormat, layers: &[&MipChain]| {
        gpu::texture_array(device, queue, label, format, layers, gpu::SMALLEST_TESTED_MIP)
    };
    let (_, colors) = upload("canopy_cross_color", TextureFormat::Rgba8UnormSrgb, &colors);
    let (texture, properties) = upload("canopy_cross_properties", TextureFormat::Rgba8Unorm, &properties);
    let bind_group = device.create_bind_group(
        "canopy_cross",
        &pipelines.get_bind_group_layout(&layouts.cross),
        &BindGroupEntries::sequential((&colors, &properties, &layouts.cross_sampler)),
    );
    (texture, bind_group)
}

/// The lighting pictures, of those plants that have them.
pub(super) fn upload_cross_light(
    plants: &[BakedPlant],
    layouts: &ForestLayouts,
    device: &RenderDevice,
    queue: &RenderQueue,
    pipelines: &PipelineCache,
) -> Option<BindGroup> {
    let layers: Vec<&MipChain> = plants.iter().flat_map(|plant| &plant.cross.textures.light).collect();
    if layers.is_empty() {
        return None;
    }
    let format = TextureFormat::Rgba8Snorm;
    let (_, view) = gpu::texture_array(device, queue, "canopy_cross_light", format, &layers, gpu::SMALLEST_TESTED_MIP);
    let layout = pipelines.get_bind_group_layout(&layouts.cross_light);
    Some(device.create_bind_group("canopy_cross_light", &layout, &BindGroupEntries::single(&view)))
}
