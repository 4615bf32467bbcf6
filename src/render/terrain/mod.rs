//! The terrain pass: the ground as tiles of continuous level of detail, and the ground map that trees read.
//!
//! From [Strugar 2009], "Continuous Distance-Dependent Level of Detail for Rendering Heightmaps": a quadtree of square
//! tiles of 32 × 32 cells, each vertex morphs onto the next coarser grid before its tile is replaced, so that
//! neighbours always match ([`crate::terrain::tiles`]). A tile's heights and normals are evaluated on the CPU from the
//! same smooth surface on which the trees stand, once, and kept on the GPU while the tile is in use.
//!
//! Ground colour follows slope, canopy cover and noise that never repeats (`shaders/terrain/ground_color.wgsl`,
//! [`crate::terrain::ground_noise`]). Octaves finer than a pixel are not computed. A photograph over the ground
//! ([`GroundDrape`](super::components::GroundDrape)) replaces the colour; what it is too coarse for, it has from the ground's own.

mod drape;
mod ground_map;
mod hidden_sky;
mod layout;
mod map_area;
mod pass;
mod pipeline;
mod tile_cache;
mod tiles;
mod vertex;

use bevy::{
    app::{App, Plugin},
    core_pipeline::Core3d,
    ecs::schedule::IntoScheduleConfigs,
    render::{GpuResourceAppExt, Render, RenderApp, render_resource::SpecializedRenderPipelines},
};

use super::sets::{CanopyPasses, CanopyRenderSystems};
pub use drape::DrapeUniform;
pub use ground_map::GroundMap;
pub(super) use layout::{DRAPE, FOREST_SURFACE, GroundFeatures, terrain_layout};
pub(super) use tiles::GpuTerrain;
pub use tiles::TerrainStatistics;
pub use vertex::{GpuTile, GpuTileVertex};

/// Draws the [`Ground`](super::components::Ground).
pub struct TerrainPassPlugin;

impl Plugin for TerrainPassPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_gpu_resource::<GroundMap>()
            .init_gpu_resource::<hidden_sky::HiddenSkyMap>()
            .init_gpu_resource::<tiles::GpuTerrain>()
            .init_gpu_resource::<pipeline::TerrainPipeline>()
            .init_gpu_resource::<SpecializedRenderPipelines<pipeline::TerrainPipeline>>()
            .init_resource::<pipeline::CurrentTerrainPipeline>()
            .init_resource::<TerrainStatistics>()
            .add_systems(
                Render,
                (
                    (ground_map::prepare_ground_map, hidden_sky::prepare_hidden_sky).in_set(CanopyRenderSystems::Light),
                    tiles::prepare_tiles.in_set(CanopyRenderSystems::Cull),
                    pipeline::prepare_pipeline.in_set(CanopyRenderSystems::Pipelines),
                ),
            )
            .add_systems(Core3d, pass::terrain_pass.in_set(CanopyPasses::Terrain));
    }
}
