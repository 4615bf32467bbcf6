//! The terrain pass: the ground as tiles of continuous level of detail, and the ground map that trees read.
//!
//! From [Strugar 2009], "Continuous Distance-Dependent Level of Detail for Rendering Heightmaps": a quadtree of square
//! tiles of 32 × 32 cells, each vertex sliding onto the next coarser grid before its tile gives way, so that
//! neighbours always meet ([`crate::terrain::tiles`]). A tile's heights and normals are evaluated on the CPU from the
//! same smooth surface on which the trees stand, once, and kept on the GPU while it is in use.
//!
//! Ground colour follows slope, height, canopy cover and noise (`shaders/terrain/terrain.wgsl`).

mod ground_map;
mod noise_texture;
mod pass;
mod prepare;

use bevy::{
    app::{App, Plugin},
    core_pipeline::{
        Core3d, Core3dSystems,
        core_3d::{main_opaque_pass_3d, main_transparent_pass_3d},
    },
    ecs::schedule::IntoScheduleConfigs,
    render::{GpuResourceAppExt, Render, RenderApp, RenderSystems},
};

pub use ground_map::GroundMap;
pub(crate) use pass::terrain_pass;
pub use prepare::{GpuTile, GpuTileVertex, TerrainStatistics};

/// Draws the [`Ground`](super::components::Ground).
pub struct TerrainPassPlugin;

impl Plugin for TerrainPassPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_gpu_resource::<GroundMap>()
            .init_gpu_resource::<prepare::TerrainLayout>()
            .init_gpu_resource::<prepare::GpuTerrain>()
            .init_gpu_resource::<prepare::TerrainPipelines>()
            .init_resource::<TerrainStatistics>()
            .add_systems(
                Render,
                (ground_map::prepare_ground_map, prepare::prepare_tiles, prepare::prepare_pipeline)
                    .chain()
                    .in_set(RenderSystems::PrepareResources)
                    .after(super::frame::prepare_frame),
            )
            .add_systems(
                Core3d,
                terrain_pass
                    .after(main_opaque_pass_3d)
                    .before(main_transparent_pass_3d)
                    .in_set(Core3dSystems::MainPass),
            );
    }
}
