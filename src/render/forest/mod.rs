//! The forest pass: trees in the levels of detail that [`Forest::levels`](super::components::Forest::levels) lists, one
//! lighting for all of them.
//!
//! From [Franzke 2005] 4.3 (billboards, blending by alpha test). A tree costs 16 bytes of instance data.
//! [`cull`](crate::cull) decides which trees are drawn before the frame; the [`representation`] of each level decides
//! how.
//!
//! Limits: at most 1,024 variants per forest; crosses for as many variants as a texture array has room for, two
//! layers a plane, and clouds, one layer each; no motion vectors; one camera.

mod block_textures;
mod cloud_uniforms;
mod draw;
mod drawn_forests;
mod drawn_trees;
mod gpu_forest;
mod instance_layout;
mod instances;
mod leaves;
mod levels;
mod list_slot;
mod lists;
mod pass;
mod pipelines;
pub mod representation;
mod request_pipelines;
mod rotated_light;
mod textures;
pub(super) mod transfer;
pub(super) mod uniforms;
mod upload;
mod vertex;

use bevy::{
    app::{App, Plugin},
    core_pipeline::Core3d,
    ecs::schedule::IntoScheduleConfigs,
    render::{GpuResourceAppExt, Render, RenderApp},
};

use super::{
    sets::{CanopyPasses, CanopyRenderSystems},
    shaders::CanopyShaders,
};
pub use cloud_uniforms::{CloudPlaneUniform, CloudVariantUniform};
pub use draw::draw_levels;
pub use drawn_forests::{DrawnForest, DrawnForests};
pub use drawn_trees::{DrawnTrees, PageTrees};
pub use gpu_forest::{GpuForest, GpuForests, ListTarget, MAP_SHARES, most_trees};
pub use instance_layout::instance_layout;
pub use instances::{LevelLook, forest_view, instance_bind_group};
pub(super) use leaves::Leaves;
pub use list_slot::{ListSlot, ListWork, PreparedPage};
pub(super) use lists::PreparedForest;
pub use lists::{ForestStatistics, LevelStatistics, PreparedForests, collect_view_counts};
pub use pipelines::LevelPipelines;
pub use representation::Representations;
pub use uniforms::{
    CROSS_VERTICES, CrossVariantUniform, ForestViewUniform, PartUniform, PlaneUniform, TransferUniform, VariantUniform,
};
pub use vertex::PlantVertex;

/// Draws [`Forest`](super::components::Forest)s.
pub struct ForestPassPlugin;

impl Plugin for ForestPassPlugin {
    fn build(&self, app: &mut App) {
        let mut known = app.world_mut().remove_resource::<Representations>().unwrap_or_default();
        let drawn = DrawnForests::default();
        app.insert_resource(drawn.clone());
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        if let Some(shaders) = render_app.world().get_resource::<CanopyShaders>() {
            for renderer in levels::built_in(shaders) {
                known.add(renderer);
            }
        }
        render_app
            .insert_resource(known)
            .insert_resource(drawn)
            .init_gpu_resource::<GpuForests>()
            .init_gpu_resource::<lists::PreparedForests>()
            .init_gpu_resource::<LevelPipelines>()
            .init_gpu_resource::<transfer::TransferLight>()
            .init_resource::<ForestStatistics>()
            .add_systems(
                Render,
                (
                    gpu_forest::prepare_forests.in_set(CanopyRenderSystems::Upload),
                    lists::prepare_view_lists.in_set(CanopyRenderSystems::Cull),
                    rotated_light::prepare_transfer_light.in_set(CanopyRenderSystems::Light),
                    request_pipelines::prepare_pipelines.in_set(CanopyRenderSystems::Pipelines),
                ),
            )
            .add_systems(Core3d, pass::forest_pass.in_set(CanopyPasses::Forest));
    }
}
