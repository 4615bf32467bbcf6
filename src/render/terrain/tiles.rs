//! The tiles that a frame draws.

use bevy::{
    ecs::{
        resource::Resource,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    log::{error_once, warn_once},
    render::{
        render_resource::{BindGroup, BindGroupEntries, Buffer, BufferUsages, PipelineCache},
        renderer::{RenderDevice, RenderQueue},
    },
};
use glam::DVec3;

use super::{
    drape::GpuDrape,
    layout::{GroundFeatures, terrain_layout},
    tile_cache::{TILE_VERTICES, TileCache},
    vertex::GpuTile,
};
use crate::{
    render::{
        extract::ExtractedScene,
        gpu::{self, GrowingBuffer},
        report::FrameReport,
        view::PreparedFrame,
    },
    terrain::tiles::{Tile, TileSettings, skirt_indices, tile_indices},
};

/// Finest vertex spacing in metres.
const FINEST_SPACING: f64 = 1.0;

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
    /// What lies over it.
    pub features: GroundFeatures,
    /// The photograph over it.
    drape: Option<GpuDrape>,
    frame: u64,
}

impl FromWorld for GpuTerrain {
    fn from_world(world: &mut World) -> Self {
        let device = world.resource::<RenderDevice>();
        let indices = [tile_indices(), skirt_indices()].concat();
        Self {
            cache: None,
            tiles: GrowingBuffer::new(device, "canopy_terrain_tiles"),
            indices: gpu::buffer_with(device, "canopy_terrain_indices", BufferUsages::INDEX, &indices),
            index_count: indices.len() as u32,
            count: 0,
            bind_group: None,
            features: GroundFeatures::default(),
            drape: None,
            frame: 0,
        }
    }
}

/// Counts of the last prepared frame.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TerrainStatistics {
    /// Tiles drawn.
    pub tiles: usize,
    /// Number of their triangles.
    pub triangles: usize,
}

/// Chooses the tiles of the view and uploads the new ones.
pub fn prepare_tiles(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
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
    let Some((_, ground, origin)) = &scene.ground else {
        gpu.cache = None;
        gpu.bind_group = None;
        gpu.drape = None;
        report.skipped("terrain", "the scene has no ground");
        return;
    };
    let Some(view) = &frame.view else { return };
    // In the terrain's own metres.
    let camera = view.camera - *origin;
    let settings = TileSettings {
        finest_spacing: FINEST_SPACING,
        max_distance: ground.view_distance,
        pixel_error: ground.error_pixels,
        ..TileSettings::default()
    };
    if !gpu.cache.as_ref().is_some_and(|cache| cache.is_of(&ground.terrain, &settings)) {
        gpu.cache = match TileCache::new(&device, &ground.terrain, &settings) {
            Ok(cache) => Some(cache),
            Err(error) => {
                error_once!("the ground cannot be drawn: {error}");
                None
            }
        };
    }
    let Some(cache) = &mut gpu.cache else { return };
    gpu.frame += 1;
    let mut chosen: Vec<Tile> = Vec::new();
    // The surface of a forest lies above the ground.
    let above = ground.forest_surface.map_or(0.0, |surface| f64::from(surface.tree_height));
    let (clearance, factor) = cache.tree.select_at_most(
        TileCache::most(&device),
        camera,
        f64::from(view.focal_pixels),
        |min: DVec3, max: DVec3| {
            view.frustum.sees_box((min - camera).as_vec3(), (max - camera + DVec3::Y * above).as_vec3())
        },
        &mut chosen,
    );
    cache.reserve(&device, chosen.len());
    let mut made = 0;
    let mut tiles = Vec::with_capacity(chosen.len());
    for tile in &chosen {
        let Some(slot) = cache.slot((tile.level, tile.ix, tile.iz), gpu.frame, &queue, &mut made) else {
            // A bound on the number of tiles is in the selection.
            error_once!("a terrain tile found no room on the device");
            break;
        };
        let corner = cache.tree.tile_origin(tile.level, tile.ix, tile.iz);
        tiles.push(GpuTile {
            origin: [(corner.x - camera.x) as f32, (corner.y - camera.z) as f32],
            spacing: cache.tree.spacing(tile.level) as f32,
            first: (slot * TILE_VERTICES) as u32,
            morph_start: tile.morph_start,
            morph_end: tile.morph_end,
            clearance: clearance as f32,
            camera_height: camera.y as f32,
        });
    }
    gpu.tiles.write(&device, &queue, &tiles);
    gpu.count = tiles.len() as u32;
    *statistics = TerrainStatistics { tiles: tiles.len(), triangles: tiles.len() * gpu.index_count as usize / 3 };
    let coarser = if factor > 1.0 {
        warn_once!(
            "the device cannot hold the terrain tiles of the view: they are coarser than `terrain_error` asks for; raise it"
        );
        format!(", with {factor} times the error, because the device holds no more")
    } else {
        String::new()
    };
    report.ran("terrain", format!("{} tiles{coarser}", tiles.len()));
    if made == 0 {
        report.skipped("terrain tiles", "all tiles of the view are on the GPU");
    } else {
        report.ran("terrain tiles", format!("{made} uploaded"));
    }
    let same = match (&gpu.drape, &ground.drape) {
        (Some(known), Some(wanted)) => known.is_of(wanted),
        (known, wanted) => known.is_none() && wanted.is_none(),
    };
    if !same {
        gpu.drape = ground.drape.as_ref().map(|drape| GpuDrape::new(&device, &queue, &drape.drape));
        let what = if gpu.drape.is_some() { "a new one was uploaded" } else { "the ground has one no more" };
        report.ran("photograph", what);
    } else if gpu.drape.is_some() {
        report.skipped("photograph", "it is on the GPU");
    }
    if let (Some(known), Some(drape)) = (&gpu.drape, &ground.drape) {
        known.place(&queue, camera, drape.brightness);
    }
    gpu.features = GroundFeatures {
        draped: gpu.drape.is_some(),
        forest_surface: ground.forest_surface.is_some(),
        soft_shadow: false,
    };
    let tiles =
        BindGroupEntries::sequential((cache.vertices.as_entire_binding(), gpu.tiles.buffer().as_entire_binding()));
    let mut entries = tiles.to_vec();
    entries.extend(gpu.drape.iter().flat_map(|drape| drape.entries(2)));
    gpu.bind_group = Some(device.create_bind_group(
        "canopy_terrain",
        &pipelines.get_bind_group_layout(&terrain_layout(gpu.features.draped)),
        &entries,
    ));
}
