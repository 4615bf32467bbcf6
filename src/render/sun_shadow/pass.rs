//! Draws the cascades that changed.

use bevy::{
    ecs::system::{Res, ResMut},
    render::{
        diagnostic::RecordDiagnostics,
        mesh::{RenderMesh, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_resource::{
            IndexFormat, LoadOp, Operations, PipelineCache, RenderPassDepthStencilAttachment, RenderPassDescriptor,
            StoreOp,
        },
        renderer::{RenderContext, RenderDevice, ViewQuery},
    },
};

use super::{
    meshes::MeshCasters,
    prepare::{CasterPipelines, ShadowMaps},
};
use crate::{
    plant::PartKind,
    render::{components::CanopyCamera, forest::GpuForests, gpu::UNIFORM_STRIDE},
};

/// Vertices that the caster shader pulls for one tree.
pub const VERTICES_A_CROSS: u32 = 12;

/// Draws every cascade whose key changed, and notes what it shows now.
pub fn sun_shadow_pass(
    _view: ViewQuery<&CanopyCamera>,
    mut maps: ResMut<ShadowMaps>,
    forests: Res<GpuForests>,
    casters: Res<MeshCasters>,
    pipelines: Res<CasterPipelines>,
    meshes: Res<RenderAssets<RenderMesh>>,
    allocator: Res<MeshAllocator>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let maps = &mut *maps;
    let Some(cascade_group) = &maps.cascade_bind_group else { return };
    let [Some(wood), Some(foliage), Some(crosses)] = pipelines.0.map(|id| cache.get_render_pipeline(id)) else {
        return;
    };
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
            for (kind, pipeline) in [(PartKind::Wood, wood), (PartKind::Foliage, foliage)] {
                pass.set_render_pipeline(pipeline);
                for (range, parts) in cast.lists.models.iter().zip(&forest.parts) {
                    if range.is_empty() {
                        continue;
                    }
                    for part in parts.iter().filter(|part| part.kind == kind && part.proxy.index_count > 0) {
                        pass.set_bind_group(2, &part.bind_group, &[]);
                        pass.set_vertex_buffer(0, part.proxy.vertices.slice(..));
                        pass.set_index_buffer(part.proxy.indices.slice(..), IndexFormat::Uint32);
                        pass.draw_indexed(0..part.proxy.index_count, 0, range.clone());
                    }
                }
            }
            let range = &cast.lists.crosses;
            if !range.is_empty() {
                pass.set_render_pipeline(crosses);
                pass.set_bind_group(2, &forest.cross_bind_group, &[]);
                pass.draw(range.start * VERTICES_A_CROSS..range.end * VERTICES_A_CROSS, 0..1);
            }
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
