//! A texture of the terrain seen from above that every pass reads: the horizon map of the key light, and the canopy
//! cover. It takes some 30 ms to compute, in the frame or beside it ([`LightUpdates`]).

use std::sync::Arc;

use bevy::{
    ecs::{
        resource::Resource,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    log::error_once,
    render::renderer::{RenderDevice, RenderQueue},
};
use glam::{DVec2, DVec3, Vec3};
use half::f16;
use rayon::prelude::*;

use super::map_area::MapArea;
use crate::{
    render::{
        bindings::{SharedPlacement, SharedTextures},
        components::LightUpdates,
        extract::ExtractedScene,
        follow::{Followed, Follower},
        light_table::LightTable,
        report::FrameReport,
        view::PreparedFrame,
    },
    scatter::{Area, CoverMap, distance_beyond, surroundings_density},
    terrain::{
        TerrainError,
        sun_horizon::{HorizonGrid, sun_horizon_over},
    },
};

/// Texels along the longer side of the terrain's data.
const LONGEST_SIDE: f64 = 512.0;
/// The most texels along the longer side of a map that reaches beyond them.
const MOST_SIDE: f64 = 1024.0;
/// Metres towards the light within which relief can hide it.
const HORIZON_DISTANCE: u32 = 12_000;

/// Radius in metres of the cover that shades a tree: oblique light passes over about as much ground as trees are high.
const SHADING_RADIUS: f64 = 32.0;

/// Height in metres above the ground from which the key light is visible (R), canopy cover (G), canopy cover of the
/// surroundings (B), and cover of trees that are not drawn, because they are beyond those of the scene (A).
#[derive(Resource)]
pub struct GroundMap {
    table: LightTable<MapKey>,
    content: Follower<MapKey, Result<MapContent, TerrainError>>,
    mean_cover: f32,
    extent: DVec2,
}

/// What the map depends on. The cover is compared by address.
#[derive(Clone)]
struct MapKey {
    area: MapArea,
    cover: Option<Arc<CoverMap>>,
    /// Unit vector to the key light.
    light: Vec3,
}

impl PartialEq for MapKey {
    fn eq(&self, other: &Self) -> bool {
        self.area == other.area && self.has_cover_of(other) && self.light == other.light
    }
}

impl MapKey {
    fn has_cover_of(&self, other: &Self) -> bool {
        match (&self.cover, &other.cover) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        }
    }

    /// Whether the map that was computed for `old` may be drawn meanwhile. The cover of a forest that appears may come
    /// some frames after its trees.
    fn is_near(&self, old: &Self) -> bool {
        self.area == old.area && LightUpdates::is_near(old.light, self.light)
    }

    /// Columns and rows of the map.
    fn size(&self) -> (u32, u32) {
        self.area.size(LONGEST_SIDE, MOST_SIDE)
    }

    /// The middle of a texel, metres from the terrain's centre.
    fn place(&self, column: u32, row: u32) -> DVec2 {
        let ((columns, rows), extent) = (self.size(), self.area.extent());
        let cell = extent / DVec2::new(f64::from(columns), f64::from(rows));
        (DVec2::new(f64::from(column), f64::from(row)) + 0.5) * cell - 0.5 * extent
    }

    /// Computes the map; `wide` is the cover of the surroundings, if it is known.
    fn content(&self, wide: Option<Arc<CoverMap>>) -> Result<MapContent, TerrainError> {
        let (columns, rows) = self.size();
        let grid = HorizonGrid { columns: columns as usize, rows: rows as usize, max_distance: HORIZON_DISTANCE };
        let horizon = sun_horizon_over(&self.area.terrain, self.area.extent(), &grid, self.light.as_dvec3())?;
        let wide = wide.or_else(|| self.cover.as_ref().map(|cover| Arc::new(cover.widened(SHADING_RADIUS))));
        let mut texels = texels(self, wide.as_deref(), &horizon);
        // Of the data, not of what thins out around it.
        let half = 0.5 * self.area.terrain.extent();
        let beyond = |index: usize| {
            distance_beyond(&Area { min: -half, max: half }, self.place(index as u32 % columns, index as u32 / columns))
        };
        let of_data = texels.iter().enumerate().filter(|(index, _)| beyond(*index) <= 0.0);
        let (sum, count) = of_data.fold((0.0f32, 0), |(sum, count), (_, texel)| (sum + texel[1].to_f32(), count + 1));
        let mean_cover = sum / count.max(1) as f32;
        if self.area.surroundings > 0.0 {
            for (index, texel) in texels.iter_mut().enumerate() {
                let drawn = surroundings_density(beyond(index), self.area.surroundings) as f32;
                texel[3] = f16::from_f32(mean_cover * (1.0 - drawn));
            }
        }
        Ok(MapContent { mean_cover, texels, wide })
    }
}

/// The computed map.
struct MapContent {
    texels: Vec<[f16; 4]>,
    mean_cover: f32,
    /// The canopy cover of the surroundings of each texel.
    wide: Option<Arc<CoverMap>>,
}

impl FromWorld for GroundMap {
    fn from_world(world: &mut World) -> Self {
        Self::empty(world.resource::<RenderDevice>(), world.resource::<RenderQueue>())
    }
}

impl GroundMap {
    /// The map without a ground: the light is visible everywhere, and the canopy cover is 0.
    fn empty(device: &RenderDevice, queue: &RenderQueue) -> Self {
        let table = LightTable::new(device, "canopy_ground_map", (1, 1));
        table.write(queue, &[[f16::from_f32(-6.0e4), f16::ZERO, f16::ZERO, f16::ZERO]]);
        Self { table, content: Follower::default(), mean_cover: 0.0, extent: DVec2::ONE }
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
    textures.ground = map.table.view().clone();
    placement.mean_cover = map.mean_cover;
    if let Some(view) = &frame.view {
        let origin = scene.ground.as_ref().map_or(DVec3::ZERO, |(.., origin)| *origin);
        placement.ground = map.placement(view.camera - origin);
    }
}

/// Brings the map to the current terrain, its cover and the key light's direction.
fn update(
    map: &mut GroundMap,
    scene: &ExtractedScene,
    device: &RenderDevice,
    queue: &RenderQueue,
    report: &FrameReport,
) {
    let Some((_, ground, _)) = &scene.ground else {
        // A despawned ground is freed together with its shadow.
        if map.content.key().is_some() {
            *map = GroundMap::empty(device, queue);
        }
        return;
    };
    let Some(daylight) = &scene.daylight else { return };
    let wanted = MapKey { area: MapArea::of(ground), cover: ground.cover.clone(), light: daylight.0.key_direction };
    let known = map.content.key().is_some_and(|key| key.has_cover_of(&wanted));
    let wide = map.content.value().and_then(|content| content.as_ref().ok()?.wide.clone()).filter(|_| known);
    let key = wanted.clone();
    let followed =
        map.content.follow(&wanted, scene.light_updates, |old| wanted.is_near(old), move || key.content(wide));
    let (Some(key), Some(content)) = (map.content.key(), map.content.value()) else { return };
    let content = match content {
        Ok(content) => content,
        Err(error) => {
            error_once!("the terrain's shadow cannot be computed: {error}");
            return;
        }
    };
    let size = key.size();
    map.table.resize(device, size);
    map.extent = key.area.extent();
    map.mean_cover = content.mean_cover;
    map.table.update(queue, key.clone(), || &content.texels);
    let cells = format!("{} × {} cells", size.0, size.1);
    match followed {
        Followed::Waited => report.ran("terrain shadow", cells),
        Followed::Taken => report.ran("terrain shadow", format!("{cells}, computed in the background")),
        Followed::Lags => report.skipped("terrain shadow", "it is being computed in the background"),
        Followed::Same => report.skipped("terrain shadow", "light and terrain have not changed"),
    }
}

/// One texel per cell, row by row from the north.
fn texels(key: &MapKey, wide: Option<&CoverMap>, horizon: &[f32]) -> Vec<[f16; 4]> {
    let (columns, rows) = key.size();
    let texel = |column: u32, row: u32| {
        let place = key.place(column, row);
        let height = key.area.terrain.height(place.x, place.y) as f32;
        let clears = horizon.get((row * columns + column) as usize).map_or(0.0, |h| h - height);
        let cover = key.cover.as_ref().map_or(0.0, |cover| cover.at(place));
        let around = wide.map_or(0.0, |cover| cover.at(place));
        [clears.clamp(-6.0e4, 6.0e4), cover, around, 0.0].map(f16::from_f32)
    };
    (0..rows).into_par_iter().flat_map_iter(|row| (0..columns).map(move |column| texel(column, row))).collect()
}
