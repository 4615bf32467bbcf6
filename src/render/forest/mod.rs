//! The forest pass: full models near the camera, crossed billboards far away, one lighting for both.
//!
//! From [Franzke 2005] 4.3 (billboards, blending by alpha test). A tree costs 16 bytes of instance data; the full
//! models are drawn instanced, one call a variant and part, the crosses of all variants in one call of eighteen
//! pulled vertices a tree. What is drawn is decided by [`cull`](super::cull) before the frame.
//!
//! Limits: at most 64 variants a forest; no motion vectors; one camera.

mod crosses;
mod layouts;
mod parts;
mod pass;
mod prepare;
mod relight;
mod resources;
mod textures;
mod transfer;
mod uniforms;
mod vertex;

use bevy::{
    app::{App, Plugin},
    core_pipeline::{
        Core3d, Core3dSystems,
        core_3d::{main_opaque_pass_3d, main_transparent_pass_3d},
    },
    ecs::schedule::IntoScheduleConfigs,
    render::{GpuResourceAppExt, Render, RenderApp, RenderSystems},
};

pub(crate) use layouts::ForestLayouts;
pub(super) use pass::VERTICES_A_CROSS;
pub use prepare::ForestStatistics;
pub(crate) use prepare::{
    ForestPipelines, PreparedForests, forest_view, instance_bind_group, opaque_depth, prepare_view_lists,
};
pub use resources::GpuForests;
pub(crate) use resources::prepare_forests;
pub use transfer::TransferUniform;
pub(super) use transfer::{STRIDE as LIGHT_STRIDE, WORDS as TRANSFER_WORDS, YAWS};
pub(super) use uniforms::PLANES;
pub use uniforms::{ForestViewUniform, PartUniform, PlaneUniform, VariantUniform};
pub use vertex::PlantVertex;

/// Draws [`Forest`](super::components::Forest)s.
pub struct ForestPassPlugin;

impl Plugin for ForestPassPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_gpu_resource::<ForestLayouts>()
            .init_gpu_resource::<GpuForests>()
            .init_gpu_resource::<PreparedForests>()
            .init_gpu_resource::<ForestPipelines>()
            .init_gpu_resource::<transfer::TransferLight>()
            .init_resource::<ForestStatistics>()
            .add_systems(
                Render,
                (prepare_forests, prepare_view_lists, transfer::prepare_transfer_light, prepare::prepare_pipelines)
                    .chain()
                    .in_set(RenderSystems::PrepareResources)
                    .after(super::frame::prepare_frame),
            )
            .add_systems(
                Core3d,
                pass::forest_pass
                    .after(main_opaque_pass_3d)
                    .before(super::terrain::terrain_pass)
                    .before(main_transparent_pass_3d)
                    .in_set(Core3dSystems::MainPass),
            );
    }
}
