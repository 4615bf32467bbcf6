//! Draws the casters into Bevy's maps.

use bevy::{
    ecs::system::{Query, Res},
    pbr::ShadowView,
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{PipelineCache, RenderPassDescriptor, StoreOp},
        renderer::{RenderContext, ViewQuery},
    },
};

use super::casters::MeshShadows;
use crate::{
    cull::Share,
    render::{
        components::CanopyCamera,
        forest::{GpuForests, LevelPipelines, draw_levels, representation::LevelTarget},
        frame_work::FrameWork,
        gpu::UNIFORM_STRIDE,
    },
};

const TARGET: LevelTarget = LevelTarget::ShadowMap;

/// Draws the casters of every map of the camera's directional lights.
pub fn draw_mesh_shadows(
    _view: ViewQuery<&CanopyCamera>,
    shadows: Res<MeshShadows>,
    forests: Res<GpuForests>,
    maps: Query<&ShadowView>,
    pipelines: Res<LevelPipelines>,
    cache: Res<PipelineCache>,
    work: Res<FrameWork>,
    mut ctx: RenderContext,
) {
    let Some(group) = &shadows.bind_group else { return };
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    for (slot, cast) in shadows.views.iter().enumerate().filter(|(_, cast)| !cast.forests.is_empty()) {
        let Ok(map) = maps.get(cast.entity) else { continue };
        let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
            label: Some("canopy_mesh_shadow"),
            color_attachments: &[],
            depth_stencil_attachment: Some(map.depth_attachment.get_attachment(StoreOp::Store)),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        let span = diagnostics.pass_span(&mut pass, "canopy_mesh_shadow");
        pass.set_bind_group(0, group, &[slot as u32 * UNIFORM_STRIDE as u32]);
        for forest in &cast.forests {
            let Some(of) = forests.get(forest.entity) else { continue };
            draw_levels(&mut pass, of, &forest.pages, Share::ALL, TARGET, &pipelines, &cache, &work, |_| 0);
        }
        span.end(&mut pass);
    }
}
