//! Draws the cascades that changed.

use bevy::{
    ecs::system::{Res, ResMut},
    render::{
        diagnostic::RecordDiagnostics,
        mesh::{RenderMesh, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_resource::{
            Extent3d, LoadOp, Operations, Origin3d, PipelineCache, RenderPassDepthStencilAttachment,
            RenderPassDescriptor, StoreOp, TexelCopyTextureInfo, TextureAspect,
        },
        renderer::{RenderContext, RenderDevice, ViewQuery},
    },
};

use super::{maps::ShadowMaps, meshes::MeshCasters};
use crate::{
    cull::Share,
    render::{
        components::CanopyCamera,
        forest::{GpuForests, LevelPipelines, MAP_SHARES, draw_levels, representation::LevelTarget},
        frame_work::FrameWork,
        gpu::UNIFORM_STRIDE,
    },
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
    (device, frame_work): (Res<RenderDevice>, Res<FrameWork>),
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
        // A share of the casters into the map beside, or all of them into the cascade's own.
        let fresh = maps.fresh.as_mut().filter(|_| work.fresh);
        let Some(own) = maps.layers.get(work.index) else { continue };
        let (target, share) = fresh
            .as_ref()
            .map_or((own, Share::ALL), |fresh| (&fresh.view, Share { index: fresh.shares, of: MAP_SHARES }));
        let first = share.index == 0;
        let load = if first { LoadOp::Clear(0.0) } else { LoadOp::Load };
        let offset = work.index as u32 * UNIFORM_STRIDE as u32;
        let mesh_group = (!casters.is_empty() && first)
            .then(|| casters.bind_group(&device, &cache, maps.cascades[work.index].center));
        let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
            label: Some("canopy_sun_shadow"),
            color_attachments: &[],
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: target,
                depth_ops: Some(Operations { load, store: StoreOp::Store }),
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
            let pages = &cast.pages;
            draw_levels(&mut pass, forest, pages, share, TARGET, &pipelines, &cache, &frame_work, |_| offset);
        }
        let complete =
            mesh_group.as_ref().is_none_or(|group| casters.draw(&mut pass, group, &meshes, &allocator, &cache));
        span.end(&mut pass);
        drop(pass);
        if let Some(fresh) = fresh {
            // Without its meshes it is begun again.
            fresh.shares = if complete { fresh.shares + 1 } else { 0 };
            if fresh.shares < MAP_SHARES {
                continue;
            }
            let layer = |texture, index| TexelCopyTextureInfo {
                texture,
                mip_level: 0,
                origin: Origin3d { x: 0, y: 0, z: index },
                aspect: TextureAspect::All,
            };
            let size = Extent3d { width: maps.map_size, height: maps.map_size, depth_or_array_layers: 1 };
            let (from, to) = (layer(&*fresh.texture, 0), layer(&*maps.texture, work.index as u32));
            ctx.command_encoder().copy_texture_to_texture(from, to, size);
        }
        if let Some(drawn) = maps.drawn.get_mut(work.index) {
            *drawn = complete.then_some(work.content);
        }
    }
}
