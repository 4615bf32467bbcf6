//! A texture of the terrain seen from above, over the same area as the [ground map](super::ground_map): what relief hides of the
//! sky's light, and what its slope leaves of the optical depth of crowns.

use std::sync::Arc;

use bevy::{
    ecs::{
        resource::Resource,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    render::renderer::{RenderDevice, RenderQueue},
};
use half::f16;
use rayon::prelude::*;

use super::map_area::MapArea;
use crate::{
    light::{HiddenLight, HiddenSky, slope_factor},
    render::{
        bindings::SharedTextures,
        components::{Daylight, LightUpdates},
        extract::ExtractedScene,
        follow::{Followed, Follower},
        light_table::LightTable,
        report::FrameReport,
    },
    terrain::relief_horizon::{AZIMUTHS, Horizon, horizons, slopes},
};

/// Texels along the longer side of the terrain's data.
const LONGEST_SIDE: f64 = 64.0;
/// The most texels along the longer side of a map that reaches beyond them.
const MOST_SIDE: f64 = 128.0;
/// Metres within which relief counts.
const FARTHEST: f64 = 12_000.0;

/// The texels of [`HiddenLight`]: two blocks, one below the other.
#[derive(Resource)]
pub struct HiddenSkyMap {
    table: LightTable<(MapArea, Daylight)>,
    relief: Follower<MapArea, Arc<Relief>>,
}

/// What the light needs of the terrain, place by place.
struct Relief {
    horizons: Vec<Horizon>,
    slope_factors: Vec<f32>,
}

fn is_level(area: &MapArea) -> bool {
    let (low, high) = area.terrain.min_max_height();
    low == high
}

/// Columns and rows: one place stands for a level terrain.
fn size(area: &MapArea) -> (u32, u32) {
    if is_level(area) { (1, 1) } else { area.size(LONGEST_SIDE, MOST_SIDE) }
}

fn relief_of(area: &MapArea) -> Relief {
    if is_level(area) {
        return Relief { horizons: vec![[0.0; AZIMUTHS]], slope_factors: vec![1.0] };
    }
    let (columns, rows) = size(area);
    let (terrain, extent, columns, rows) = (&area.terrain, area.extent(), columns as usize, rows as usize);
    Relief {
        horizons: horizons(terrain, extent, columns, rows, FARTHEST),
        slope_factors: slopes(terrain, extent, columns, rows).into_iter().map(slope_factor).collect(),
    }
}

impl FromWorld for HiddenSkyMap {
    fn from_world(world: &mut World) -> Self {
        Self::open(world.resource::<RenderDevice>(), world.resource::<RenderQueue>())
    }
}

impl HiddenSkyMap {
    /// The map without a ground: nothing is hidden.
    fn open(device: &RenderDevice, queue: &RenderQueue) -> Self {
        let table = LightTable::new(device, "canopy_hidden_sky", (1, 2));
        let open = HiddenLight { level_fraction: 1.0, ..HiddenLight::default() };
        table.write(queue, &blocks(&[open], &[1.0]));
        Self { table, relief: Follower::default() }
    }
}

/// Updates the map and passes it to all passes.
pub fn prepare_hidden_sky(
    scene: Res<ExtractedScene>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    report: Res<FrameReport>,
    mut map: ResMut<HiddenSkyMap>,
    mut textures: ResMut<SharedTextures>,
) {
    update(&mut map, &scene, &device, &queue, &report);
    textures.hidden_sky = map.table.view().clone();
}

fn update(
    map: &mut HiddenSkyMap,
    scene: &ExtractedScene,
    device: &RenderDevice,
    queue: &RenderQueue,
    report: &FrameReport,
) {
    let Some((_, ground, _)) = &scene.ground else {
        // A despawned ground is freed.
        if map.relief.key().is_some() {
            *map = HiddenSkyMap::open(device, queue);
        }
        return;
    };
    let Some(daylight) = &scene.daylight else { return };
    let wanted = MapArea::of(ground);
    let area = wanted.clone();
    let followed = map.relief.follow(&wanted, LightUpdates::Blocking, |_| false, move || Arc::new(relief_of(&area)));
    let Some(relief) = map.relief.value().cloned() else { return };
    let (columns, rows) = size(&wanted);
    map.table.resize(device, (columns, 2 * rows));
    let uploaded = map.table.update(queue, (wanted, daylight.clone()), || {
        let sky = HiddenSky::new(&daylight.0, AZIMUTHS);
        let hidden: Vec<_> = relief.horizons.par_iter().map(|horizon| sky.behind(horizon)).collect();
        blocks(&hidden, &relief.slope_factors)
    });
    match (followed, uploaded) {
        (Followed::Same, false) => report.skipped("sky behind relief", "light and terrain have not changed"),
        (Followed::Same, true) => report.ran("sky behind relief", format!("{} cells", relief.horizons.len())),
        _ => report.ran("sky behind relief", format!("{} cells, with their horizons", relief.horizons.len())),
    }
}

/// The first texel of each place, then the second of each.
fn blocks(hidden: &[HiddenLight], slope_factors: &[f32]) -> Vec<[f16; 4]> {
    let block = |index: usize| {
        let places = hidden.iter().zip(slope_factors);
        places.map(move |(light, factor)| light.texels(*factor)[index].to_array().map(f16::from_f32))
    };
    block(0).chain(block(1)).collect()
}
