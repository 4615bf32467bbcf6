//! Per frame: which tiles are drawn, and their vertices on the GPU.

use std::sync::Arc;

use bevy::{
    ecs::{
        resource::Resource,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    log::error_once,
    platform::collections::HashMap,
    render::{
        render_resource::{
            AddressMode, BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            BufferDescriptor, BufferUsages, CachedRenderPipelineId, ColorTargetState, ColorWrites, Face, FilterMode,
            FragmentState, MipmapFilterMode, MultisampleState, PipelineCache, PrimitiveState, RenderPipelineDescriptor,
            Sampler, SamplerBindingType, SamplerDescriptor, ShaderStages, TextureFormat, TextureSampleType,
            TextureView, VertexState,
            binding_types::{sampler, storage_buffer_read_only_sized, texture_2d},
        },
        renderer::{RenderDevice, RenderQueue},
    },
};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec2, Vec3};

use super::noise_texture::noise_texture;
use crate::{
    render::{
        extract::ExtractedScene,
        forest::opaque_depth,
        frame::{FrameLayout, PreparedFrame},
        gpu::{self, GrowingBuffer},
        report::FrameReport,
        shaders::{CanopyShaders, ShaderFile},
    },
    terrain::{
        Terrain,
        tiles::{TILE_QUADS, Tile, TileSettings, TileTree, TileVertex, tile_indices},
    },
};

/// Vertices of a tile.
const TILE_VERTICES: usize = (TILE_QUADS + 1) * (TILE_QUADS + 1);
/// Tiles that the GPU holds at first; doubled while a view needs more.
const FIRST_SLOTS: usize = 512;
/// Finest vertex spacing in metres.
const FINEST_SPACING: f64 = 1.0;

/// `TileVertex` of `shaders/terrain/terrain.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct GpuTileVertex {
    /// Metres above the datum.
    pub height: f32,
    /// The same in the next coarser mesh.
    pub parent_height: f32,
    /// Octahedral normal about +Y, two snorm16 (within 0.01°).
    pub normal: u32,
    /// The same of the next coarser mesh.
    pub parent_normal: u32,
}

impl From<&TileVertex> for GpuTileVertex {
    fn from(vertex: &TileVertex) -> Self {
        Self {
            height: vertex.height,
            parent_height: vertex.parent_height,
            normal: pack_octahedral(vertex.normal),
            parent_normal: pack_octahedral(vertex.parent_normal),
        }
    }
}

/// Octahedral encoding about +Y [Cigolle et al. 2014] as two snorm16.
fn pack_octahedral(normal: Vec3) -> u32 {
    let n = normal / (normal.x.abs() + normal.y.abs() + normal.z.abs()).max(1e-12);
    let mut e = Vec2::new(n.x, n.z);
    if n.y < 0.0 {
        let sign = Vec2::new(1f32.copysign(e.x), 1f32.copysign(e.y));
        e = (Vec2::ONE - Vec2::new(e.y.abs(), e.x.abs())) * sign;
    }
    let snorm = |v: f32| ((v.clamp(-1.0, 1.0) * 32767.0).round() as i16) as u16;
    u32::from(snorm(e.x)) | u32::from(snorm(e.y)) << 16
}

/// `Tile` of `shaders/terrain/terrain.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct GpuTile {
    /// North-western corner relative to the camera (x, z), metres.
    pub origin: [f32; 2],
    /// Metres between vertices.
    pub spacing: f32,
    /// First vertex.
    pub first: u32,
    /// Distance at which the morph begins, metres.
    pub morph_start: f32,
    /// Distance at which it ends, metres.
    pub morph_end: f32,
    /// Lower bound of the distance from the camera to the ground, metres.
    pub clearance: f32,
    /// Level of detail.
    pub level: f32,
}

/// Group 1 of the terrain pass.
#[derive(Resource)]
pub struct TerrainLayout(pub BindGroupLayoutDescriptor);

impl FromWorld for TerrainLayout {
    fn from_world(_: &mut World) -> Self {
        Self(BindGroupLayoutDescriptor::new(
            "canopy_terrain",
            &BindGroupLayoutEntries::sequential(
                ShaderStages::VERTEX_FRAGMENT,
                (
                    storage_buffer_read_only_sized(false, None),
                    storage_buffer_read_only_sized(false, None),
                    texture_2d(TextureSampleType::Float { filterable: true }),
                    sampler(SamplerBindingType::Filtering),
                ),
            ),
        ))
    }
}

type TileKey = (u32, i32, i32);

/// Tiles on the GPU by their place in the quadtree.
struct TileCache {
    terrain: Arc<Terrain>,
    settings: TileSettings,
    tree: TileTree,
    slots: HashMap<TileKey, (usize, u64)>,
    free: Vec<usize>,
    vertices: Buffer,
    capacity: usize,
}

impl TileCache {
    fn buffer(device: &RenderDevice, capacity: usize) -> Buffer {
        device.create_buffer(&BufferDescriptor {
            label: Some("canopy_terrain_vertices"),
            size: (capacity * TILE_VERTICES * size_of::<GpuTileVertex>()) as u64,
            usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    fn clear(&mut self, device: &RenderDevice, capacity: usize) {
        self.vertices = Self::buffer(device, capacity);
        self.capacity = capacity;
        self.slots.clear();
        self.free = (0..capacity).rev().collect();
    }

    /// Makes room for `wanted` tiles at once; what is there may have to be made again.
    fn reserve(&mut self, device: &RenderDevice, wanted: usize) {
        let limit = device.limits().max_storage_buffer_binding_size as usize;
        let most = limit / (TILE_VERTICES * size_of::<GpuTileVertex>());
        let capacity = wanted.next_power_of_two().max(FIRST_SLOTS).min(most);
        if capacity > self.capacity {
            self.clear(device, capacity);
        }
    }

    /// The slot of a tile, made and uploaded where it is new. `None` while all slots are in use in this frame.
    fn slot(&mut self, key: TileKey, frame: u64, queue: &RenderQueue, made: &mut usize) -> Option<usize> {
        if let Some((slot, used)) = self.slots.get_mut(&key) {
            *used = frame;
            return Some(*slot);
        }
        if self.free.is_empty() {
            // Forget the half that was not used longest.
            let mut ages: Vec<(u64, TileKey, usize)> =
                self.slots.iter().filter(|(_, (_, used))| *used != frame).map(|(k, (s, u))| (*u, *k, *s)).collect();
            ages.sort_unstable();
            for (_, key, slot) in ages.iter().take(ages.len().div_ceil(2)) {
                self.slots.remove(key);
                self.free.push(*slot);
            }
        }
        let slot = self.free.pop()?;
        let vertices: Vec<GpuTileVertex> =
            self.tree.tile_vertices(&self.terrain, key.0, key.1, key.2).iter().map(GpuTileVertex::from).collect();
        let offset = slot * TILE_VERTICES * size_of::<GpuTileVertex>();
        queue.write_buffer(&self.vertices, offset as u64, bytemuck::cast_slice(&vertices));
        self.slots.insert(key, (slot, frame));
        *made += 1;
        Some(slot)
    }
}

/// The terrain on the GPU.
#[derive(Resource)]
pub struct GpuTerrain {
    cache: Option<TileCache>,
    tiles: GrowingBuffer,
    /// Indices that all tiles share.
    pub indices: Buffer,
    /// Number of [`indices`](Self::indices).
    pub index_count: u32,
    /// Tiles of this frame.
    pub count: u32,
    /// Group 1.
    pub bind_group: Option<BindGroup>,
    noise: Option<TextureView>,
    sampler: Sampler,
    frame: u64,
}

impl FromWorld for GpuTerrain {
    fn from_world(world: &mut World) -> Self {
        let device = world.resource::<RenderDevice>();
        let indices = tile_indices();
        Self {
            cache: None,
            tiles: GrowingBuffer::new(device, "canopy_terrain_tiles"),
            indices: gpu::buffer_with(device, "canopy_terrain_indices", BufferUsages::INDEX, &indices),
            index_count: indices.len() as u32,
            count: 0,
            bind_group: None,
            noise: None,
            sampler: device.create_sampler(&SamplerDescriptor {
                label: Some("canopy_ground_noise"),
                address_mode_u: AddressMode::Repeat,
                address_mode_v: AddressMode::Repeat,
                mag_filter: FilterMode::Linear,
                min_filter: FilterMode::Linear,
                mipmap_filter: MipmapFilterMode::Linear,
                ..Default::default()
            }),
            frame: 0,
        }
    }
}

/// Counts of the last prepared frame.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TerrainStatistics {
    /// Tiles drawn.
    pub tiles: usize,
    /// Triangles of these.
    pub triangles: usize,
}

/// Chooses the tiles of the view and uploads those that are new.
pub fn prepare_tiles(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    layout: Res<TerrainLayout>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    pipelines: Res<PipelineCache>,
    report: Res<FrameReport>,
    mut terrain: ResMut<GpuTerrain>,
    mut statistics: ResMut<TerrainStatistics>,
) {
    let gpu = &mut *terrain;
    gpu.count = 0;
    *statistics = TerrainStatistics::default();
    let Some((_, ground)) = &scene.ground else {
        gpu.cache = None;
        gpu.bind_group = None;
        report.skipped("terrain", "the scene has no ground");
        return;
    };
    let Some(view) = &frame.view else { return };
    let settings = TileSettings {
        finest_spacing: FINEST_SPACING,
        max_distance: ground.view_distance,
        pixel_error: ground.error_pixels,
        ..TileSettings::default()
    };
    let known = gpu.cache.as_ref().is_some_and(|c| Arc::ptr_eq(&c.terrain, &ground.terrain) && c.settings == settings);
    if !known {
        match TileTree::new(&ground.terrain, &settings) {
            Ok(tree) => {
                gpu.cache = Some(TileCache {
                    terrain: ground.terrain.clone(),
                    settings,
                    tree,
                    slots: HashMap::default(),
                    free: (0..FIRST_SLOTS).rev().collect(),
                    vertices: TileCache::buffer(&device, FIRST_SLOTS),
                    capacity: FIRST_SLOTS,
                });
            }
            Err(error) => {
                error_once!("the ground cannot be drawn: {error}");
                gpu.cache = None;
                return;
            }
        }
    }
    let Some(cache) = &mut gpu.cache else { return };
    gpu.frame += 1;
    let mut chosen: Vec<Tile> = Vec::new();
    let clearance = cache.tree.select(
        view.camera,
        f64::from(view.focal_pixels),
        |min: DVec3, max: DVec3| view.frustum.sees_box((min - view.camera).as_vec3(), (max - view.camera).as_vec3()),
        &mut chosen,
    );
    cache.reserve(&device, chosen.len());
    let mut made = 0;
    let mut tiles = Vec::with_capacity(chosen.len());
    for tile in &chosen {
        let Some(slot) = cache.slot((tile.level, tile.ix, tile.iz), gpu.frame, &queue, &mut made) else {
            error_once!("the view needs more terrain tiles than the device can hold; raise `terrain_error`");
            break;
        };
        let origin = cache.tree.tile_origin(tile.level, tile.ix, tile.iz);
        tiles.push(GpuTile {
            origin: [(origin.x - view.camera.x) as f32, (origin.y - view.camera.z) as f32],
            spacing: cache.tree.spacing(tile.level) as f32,
            first: (slot * TILE_VERTICES) as u32,
            morph_start: tile.morph_start,
            morph_end: tile.morph_end,
            clearance: clearance as f32,
            level: tile.level as f32,
        });
    }
    gpu.tiles.write(&device, &queue, &tiles);
    gpu.count = tiles.len() as u32;
    *statistics = TerrainStatistics { tiles: tiles.len(), triangles: tiles.len() * gpu.index_count as usize / 3 };
    report.ran("terrain", format!("{} tiles", tiles.len()));
    if made == 0 {
        report.skipped("terrain tiles", "all tiles of the view are on the GPU");
    } else {
        report.ran("terrain tiles", format!("{made} made"));
    }
    let noise = gpu.noise.get_or_insert_with(|| noise_texture(&device, &queue));
    gpu.bind_group = Some(device.create_bind_group(
        "canopy_terrain",
        &pipelines.get_bind_group_layout(&layout.0),
        &BindGroupEntries::sequential((
            cache.vertices.as_entire_binding(),
            gpu.tiles.buffer().as_entire_binding(),
            &*noise,
            &gpu.sampler,
        )),
    ));
}

/// Pipelines of the terrain pass.
#[derive(Resource, Default)]
pub struct TerrainPipelines {
    pipelines: HashMap<(TextureFormat, u32), CachedRenderPipelineId>,
    /// Pipeline of the prepared view.
    pub current: Option<CachedRenderPipelineId>,
}

/// Requests the pipeline that the view needs.
pub fn prepare_pipeline(
    frame: Res<PreparedFrame>,
    frame_layout: Res<FrameLayout>,
    layout: Res<TerrainLayout>,
    shaders: Res<CanopyShaders>,
    cache: Res<PipelineCache>,
    mut pipelines: ResMut<TerrainPipelines>,
) {
    pipelines.current = frame.view.as_ref().map(|view| {
        *pipelines.pipelines.entry((view.format, view.samples)).or_insert_with(|| {
            cache.queue_render_pipeline(RenderPipelineDescriptor {
                label: Some("canopy_terrain".into()),
                layout: vec![frame_layout.0.clone(), layout.0.clone()],
                vertex: VertexState {
                    shader: shaders.get(ShaderFile::Terrain),
                    entry_point: Some("vertex".into()),
                    ..Default::default()
                },
                primitive: PrimitiveState { cull_mode: Some(Face::Back), ..Default::default() },
                depth_stencil: Some(opaque_depth()),
                multisample: MultisampleState { count: view.samples, ..Default::default() },
                fragment: Some(FragmentState {
                    shader: shaders.get(ShaderFile::Terrain),
                    entry_point: Some("fragment".into()),
                    targets: vec![Some(ColorTargetState {
                        format: view.format,
                        blend: None,
                        write_mask: ColorWrites::ALL,
                    })],
                    ..Default::default()
                }),
                ..Default::default()
            })
        })
    });
}
