//! The forest pass of a view.

use bevy::{
    ecs::{query::With, system::Res},
    render::{
        camera::ExtractedCamera,
        diagnostic::RecordDiagnostics,
        render_resource::{IndexFormat, PipelineCache, RenderPassDescriptor, StoreOp},
        renderer::{RenderContext, ViewQuery},
        view::{ViewDepthTexture, ViewTarget},
    },
};

use super::{ForestPipelines, GpuForests, PLANES, PreparedForests, crosses::CrossLight};
use crate::render::{components::CanopyCamera, frame::FrameBindGroup};

/// Vertices that the cross shader pulls for one tree.
pub const VERTICES_A_CROSS: u32 = 6 * PLANES as u32;

/// Draws every forest into the camera's colour and depth.
pub fn forest_pass(
    view: ViewQuery<(&ViewTarget, &ViewDepthTexture, &ExtractedCamera), With<CanopyCamera>>,
    frame: Res<FrameBindGroup>,
    forests: Res<GpuForests>,
    prepared: Res<PreparedForests>,
    pipelines: Res<ForestPipelines>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let frame = frame.of(view.entity());
    let (target, depth, camera) = view.into_inner();
    let (Some(frame), Some(current)) = (frame, &pipelines.current) else { return };
    let something = forests.iter().any(|(entity, _)| {
        prepared.get(entity).is_some_and(|forest| forest.lists.model_count() + forest.lists.cross_count() > 0)
    });
    let ready = |id| cache.get_render_pipeline(id);
    let mut crosses = Vec::with_capacity(CrossLight::ALL.len());
    for (light, id) in CrossLight::ALL.into_iter().zip(current.crosses) {
        let Some(id) = id else { continue };
        let Some(pipeline) = ready(id) else { return };
        crosses.push((light, pipeline));
    }
    let mut models = Vec::with_capacity(current.models.len());
    for &(surface, light, id) in &current.models {
        let Some(pipeline) = ready(id) else { return };
        models.push((surface, light, pipeline));
    }
    if !something {
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
    for (entity, forest) in forests.iter() {
        let Some(lists) = prepared.get(entity) else { continue };
        pass.set_bind_group(0, frame, &[]);
        pass.set_bind_group(1, &lists.bind_group, &[0]);
        for &(surface, light, pipeline) in &models {
            pass.set_render_pipeline(pipeline);
            for (range, parts) in lists.lists.models.iter().zip(&forest.parts) {
                if range.is_empty() {
                    continue;
                }
                for part in parts.iter().filter(|part| part.surface() == surface && part.light == light) {
                    if part.model.index_count == 0 {
                        continue;
                    }
                    if let Some(group) = &part.transfer {
                        pass.set_bind_group(3, group, &[]);
                    }
                    pass.set_bind_group(2, &part.bind_group, &[]);
                    pass.set_vertex_buffer(0, part.model.vertices.slice(..));
                    pass.set_index_buffer(part.model.indices.slice(..), IndexFormat::Uint32);
                    pass.draw_indexed(0..part.model.index_count, 0, range.clone());
                }
            }
        }
        let range = &lists.lists.crosses;
        let pipeline = crosses.iter().find(|(light, _)| *light == forest.cross_light);
        if let Some((_, pipeline)) = pipeline.filter(|_| !range.is_empty()) {
            pass.set_render_pipeline(pipeline);
            pass.set_bind_group(2, &forest.cross_bind_group, &[]);
            if let Some(pictures) = &forest.cross_pictures {
                pass.set_bind_group(3, pictures, &[]);
            }
            pass.draw(range.start * VERTICES_A_CROSS..range.end * VERTICES_A_CROSS, 0..1);
        }
    }
    span.end(&mut pass);
}
