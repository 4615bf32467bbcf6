//! Draws the cascades that changed.

use bevy::{
    ecs::system::{Res, ResMut},
    render::{
        diagnostic::RecordDiagnostics,
        mesh::{RenderMesh, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_resource::{
            LoadOp, Operations, PipelineCache, RenderPassDepthStencilAttachment, RenderPassDescriptor, StoreOp,
        },
        renderer::{RenderContext, RenderDevice, ViewQuery},
    },
};

use super::{maps::ShadowMaps, meshes::MeshCasters};
use crate::render::{
    components::CanopyCamera,
    forest::{GpuForests, LevelPipelines, draw_levels, representation::LevelTarget},
    gpu::UNIFORM_STRIDE,
};

const TARGET: LevelTarget = LevelTarget::ShadowMap;

/// Draws every cascade whose key changed, and records its new state.
pub fn sun_shadow_pass(
    _view: ViewQuery<&CanopyCamera>,
    mut maps: ResMut<ShadowMaps>,
    forests: Res<GpuForests>,
    casters: Res<MeshCasters>,
    pipelines: Res<LevelPipelines>,
    meshes: Res<RenderAssets<RenderMesh>>,
    allocator: Res<MeshAllocator>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let maps = &mut *maps;
    let Some(cascade_group) = &maps.cascade_bind_group else { return };
    if !pipelines.ready(forests.levels(), TARGET, &cache) {
        return;
    }
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    for work in maps.work.drain(..) {
        let Some(layer) = maps.layers.get(work.index) else { continue };
        let offset = work.index as u32 * UNIFORM_STRIDE as u32;
        let mesh_group =
            (!casters.is_empty()).then(|| casters.bind_group(&device, &cache, maps.cascades[work.index].center));
        let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
            label: Some("canopy_sun_shadow"),
            color_attachments: &[],
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: layer,
                depth_ops: Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Store }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        let span = diagnostics.pass_span(&mut pass, "canopy_sun_shadow");
        pass.set_bind_group(0, cascade_group, &[offset]);
        for cast in &work.forests {
            let Some(forest) = forests.get(cast.entity) else { continue };
            pass.set_bind_group(1, &cast.bind_group, &[offset]);
            draw_levels(&mut pass, forest, &cast.lists, TARGET, &pipelines, &cache, |_, _| {});
        }
        let complete =
            mesh_group.as_ref().is_none_or(|group| casters.draw(&mut pass, group, &meshes, &allocator, &cache));
        span.end(&mut pass);
        drop(pass);
        if let Some(drawn) = maps.drawn.get_mut(work.index) {
            *drawn = complete.then_some(work.content);
        }
    }
}
