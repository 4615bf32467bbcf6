//! A texture of the terrain seen from above that every pass reads: the horizon map of the key light, and the canopy
//! cover.

use std::sync::Arc;

use bevy::{
    ecs::{
        resource::Resource,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    log::error_once,
    render::{
        render_resource::{Texture, TextureView},
        renderer::{RenderDevice, RenderQueue},
    },
};
use glam::{DVec2, DVec3, Vec3};
use half::f16;

use crate::{
    render::{
        bindings::{SharedPlacement, SharedTextures},
        components::Ground,
        extract::ExtractedScene,
        gpu,
        report::FrameReport,
        view::PreparedFrame,
    },
    scatter::CoverMap,
    terrain::{
        Terrain,
        sun_horizon::{HorizonGrid, sun_horizon},
    },
};

/// Texels along the longer side of the map.
const LONGEST_SIDE: f64 = 512.0;
/// Metres towards the light within which relief can hide it.
const HORIZON_DISTANCE: u32 = 12_000;

/// Radius in metres of the cover that shades a tree: oblique light passes over about as much ground as trees are high.
const SHADING_RADIUS: f64 = 32.0;

/// Height in metres above the ground from which the key light is visible (R), canopy cover (G), and canopy cover of the
/// surroundings (B).
#[derive(Resource)]
pub struct GroundMap {
    view: TextureView,
    mean_cover: f32,
    texture: Texture,
    size: (u32, u32),
    extent: DVec2,
    /// The canopy cover of the surroundings of each texel.
    wide: Option<CoverMap>,
    uploaded: Option<Uploaded>,
}

struct Uploaded {
    terrain: Arc<Terrain>,
    cover: Option<Arc<CoverMap>>,
    light: Vec3,
}

impl FromWorld for GroundMap {
    fn from_world(world: &mut World) -> Self {
        Self::empty(world.resource::<RenderDevice>(), world.resource::<RenderQueue>())
    }
}

impl GroundMap {
    /// The map without a ground: the light is visible everywhere, and the canopy cover is 0.
    fn empty(device: &RenderDevice, queue: &RenderQueue) -> Self {
        let (texture, view) = gpu::table(device, "canopy_ground_map", (1, 1));
        let texel = [f16::from_f32(-6.0e4), f16::ZERO, f16::ZERO, f16::ZERO];
        gpu::write_level(queue, &texture, 0, 0, 1, 1, 8, bytemuck::cast_slice(&[texel]));
        Self { view, mean_cover: 0.0, texture, size: (1, 1), extent: DVec2::ONE, wide: None, uploaded: None }
    }

    /// Camera-relative origin and inverse size of the map, for a camera at `camera` (metres from the terrain's own
    /// origin).
    fn placement(&self, camera: DVec3) -> [f32; 4] {
        let origin = -0.5 * self.extent - DVec2::new(camera.x, camera.z);
        [origin.x as f32, origin.y as f32, (1.0 / self.extent.x) as f32, (1.0 / self.extent.y) as f32]
    }
}

/// Updates the map and passes it to all passes.
pub fn prepare_ground_map(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    report: Res<FrameReport>,
    mut map: ResMut<GroundMap>,
    mut textures: ResMut<SharedTextures>,
    mut placement: ResMut<SharedPlacement>,
) {
    update(&mut map, &scene, &device, &queue, &report);
    textures.ground = map.view.clone();
    placement.mean_cover = map.mean_cover;
    if let Some(view) = &frame.view {
        let origin = scene.ground.as_ref().map_or(DVec3::ZERO, |(.., origin)| *origin);
        placement.ground = map.placement(view.camera - origin);
    }
}

/// Computes the map when the terrain, its cover or the key light's direction changed.
fn update(
    map: &mut GroundMap,
    scene: &ExtractedScene,
    device: &RenderDevice,
    queue: &RenderQueue,
    report: &FrameReport,
) {
    let Some((_, ground, _)) = &scene.ground else {
        // A despawned ground is freed together with its shadow.
        if map.uploaded.is_some() {
            *map = GroundMap::empty(device, queue);
        }
        return;
    };
    let Some(daylight) = &scene.daylight else { return };
    let light = daylight.0.key_direction;
    let same_ground = map.uploaded.as_ref().is_some_and(|uploaded| {
        Arc::ptr_eq(&uploaded.terrain, &ground.terrain)
            && match (&uploaded.cover, &ground.cover) {
                (Some(a), Some(b)) => Arc::ptr_eq(a, b),
                (None, None) => true,
                _ => false,
            }
    });
    if same_ground && map.uploaded.as_ref().is_some_and(|uploaded| uploaded.light == light) {
        report.skipped("terrain shadow", "light and terrain have not changed");
        return;
    }
    let extent = ground.terrain.extent();
    let texel = extent.max_element() / LONGEST_SIDE;
    let size = ((extent.x / texel).ceil().max(1.0) as u32, (extent.y / texel).ceil().max(1.0) as u32);
    if size != map.size {
        (map.texture, map.view) = gpu::table(device, "canopy_ground_map", size);
        map.size = size;
    }
    map.extent = extent;
    let grid = HorizonGrid { columns: size.0 as usize, rows: size.1 as usize, max_distance: HORIZON_DISTANCE };
    let horizon = match sun_horizon(&ground.terrain, &grid, light.as_dvec3()) {
        Ok(horizon) => horizon,
        Err(error) => {
            error_once!("the terrain's shadow cannot be computed: {error}");
            return;
        }
    };
    if !same_ground {
        map.wide = ground.cover.as_ref().map(|cover| cover.widened(SHADING_RADIUS));
    }
    let texels = texels(ground, map.wide.as_ref(), &horizon, size);
    if !same_ground {
        let sum: f32 = texels.iter().map(|texel| texel[1].to_f32()).sum();
        map.mean_cover = sum / texels.len().max(1) as f32;
    }
    gpu::write_level(queue, &map.texture, 0, 0, size.0, size.1, 8, bytemuck::cast_slice(&texels));
    report.ran("terrain shadow", format!("{} × {} cells", size.0, size.1));
    map.uploaded = Some(Uploaded { terrain: ground.terrain.clone(), cover: ground.cover.clone(), light });
}

/// One texel per cell, row by row from the north.
fn texels(ground: &Ground, wide: Option<&CoverMap>, horizon: &[f32], size: (u32, u32)) -> Vec<[f16; 4]> {
    let extent = ground.terrain.extent();
    let cell = extent / DVec2::new(f64::from(size.0), f64::from(size.1));
    (0..size.1)
        .flat_map(|row| (0..size.0).map(move |column| (column, row)))
        .map(|(column, row)| {
            let place = (DVec2::new(f64::from(column), f64::from(row)) + 0.5) * cell - 0.5 * extent;
            let height = ground.terrain.height(place.x, place.y) as f32;
            let clears = horizon.get((row * size.0 + column) as usize).map_or(0.0, |h| h - height);
            let cover = ground.cover.as_ref().map_or(0.0, |cover| cover.at(place));
            let around = wide.map_or(0.0, |cover| cover.at(place));
            [clears.clamp(-6.0e4, 6.0e4), cover, around, 0.0].map(f16::from_f32)
        })
        .collect()
}
