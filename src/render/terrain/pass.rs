//! The terrain pass of a view.

use bevy::{
    ecs::system::Res,
    render::{
        camera::ExtractedCamera,
        diagnostic::RecordDiagnostics,
        render_resource::{IndexFormat, PipelineCache, RenderPassDescriptor, StoreOp},
        renderer::{RenderContext, ViewQuery},
        view::{ViewDepthTexture, ViewTarget},
    },
};

use super::{pipeline::CurrentTerrainPipeline, tiles::GpuTerrain};
use crate::render::{bindings::FrameBindGroup, components::Photographed};

/// Draws the ground into the camera's colour and depth.
pub fn terrain_pass(
    view: ViewQuery<(&ViewTarget, &ViewDepthTexture, &ExtractedCamera), Photographed>,
    frame: Res<FrameBindGroup>,
    terrain: Res<GpuTerrain>,
    pipeline: Res<CurrentTerrainPipeline>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let frame = frame.of(view.entity());
    let (target, depth, camera) = view.into_inner();
    let (Some(frame), Some(tiles), Some(pipeline)) =
        (frame, &terrain.bind_group, pipeline.0.and_then(|id| cache.get_render_pipeline(id)))
    else {
        return;
    };
    if terrain.count == 0 {
        return;
    }
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("canopy_terrain"),
        color_attachments: &[Some(target.get_color_attachment())],
        depth_stencil_attachment: Some(depth.get_attachment(StoreOp::Store)),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let span = diagnostics.pass_span(&mut pass, "canopy_terrain");
    if let Some(viewport) = &camera.viewport {
        pass.set_camera_viewport(viewport);
    }
    pass.set_render_pipeline(pipeline);
    pass.set_bind_group(0, frame, &[]);
    pass.set_bind_group(1, tiles, &[]);
    pass.set_index_buffer(terrain.indices.slice(..), IndexFormat::Uint32);
    pass.draw_indexed(0..terrain.index_count, 0, 0..terrain.count);
    span.end(&mut pass);
}
