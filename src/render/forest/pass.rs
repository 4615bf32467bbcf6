//! The forest pass of a view.

use bevy::{
    ecs::system::Res,
    render::{
        camera::ExtractedCamera,
        diagnostic::RecordDiagnostics,
        render_resource::{PipelineCache, RenderPassDescriptor, StoreOp},
        renderer::{RenderContext, ViewQuery},
        view::{ViewDepthTexture, ViewTarget},
    },
};

use super::{
    draw::draw_levels,
    gpu_forest::GpuForests,
    lists::{PreparedForest, PreparedForests},
    pipelines::LevelPipelines,
    representation::LevelTarget,
};
use crate::{
    cull::Share,
    render::{bindings::FrameBindGroup, components::Photographed, frame_work::FrameWork, view::PreparedFrame},
};

/// Draws every forest into the camera's colour and depth, level by level.
pub fn forest_pass(
    view: ViewQuery<(&ViewTarget, &ViewDepthTexture, &ExtractedCamera), Photographed>,
    frame: Res<PreparedFrame>,
    group: Res<FrameBindGroup>,
    forests: Res<GpuForests>,
    prepared: Res<PreparedForests>,
    pipelines: Res<LevelPipelines>,
    cache: Res<PipelineCache>,
    work: Res<FrameWork>,
    mut ctx: RenderContext,
) {
    let group = group.of(view.entity());
    let (target, depth, camera) = view.into_inner();
    let (Some(group), Some(prepared_view)) = (group, &frame.view) else { return };
    let level_target = LevelTarget::View(prepared_view.attachment);
    if !prepared.draw_something() || !pipelines.ready(forests.levels(), level_target, &cache) {
        return;
    }
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("canopy_forest"),
        color_attachments: &[Some(target.get_color_attachment())],
        depth_stencil_attachment: Some(depth.get_attachment(StoreOp::Store)),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let span = diagnostics.pass_span(&mut pass, "canopy_forest");
    if let Some(viewport) = &camera.viewport {
        pass.set_camera_viewport(viewport);
    }
    pass.set_bind_group(0, group, &[]);
    for (entity, forest) in forests.iter() {
        let Some(lists) = prepared.get(entity) else { continue };
        let offset = PreparedForest::offset;
        let pages = &lists.pages;
        draw_levels(&mut pass, forest, pages, Share::ALL, level_target, &pipelines, &cache, &work, offset);
    }
    span.end(&mut pass);
}
