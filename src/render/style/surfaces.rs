//! The surfaces that a styled view sees: normal, identifier and albedo of trees and ground, without light. One pass, whatever the
//! number of layers: layers are made of the identifiers afterwards.

use bevy::{
    ecs::{query::With, system::Res},
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{
            IndexFormat, LoadOp, Operations, RenderPassDepthStencilAttachment, RenderPassDescriptor, StoreOp,
        },
        renderer::{RenderContext, ViewQuery},
    },
};

use super::{full_screen::cleared, pass::StylePass, pipelines::LEVEL_TARGET};
use crate::{
    cull::Share,
    render::{
        components::{CanopyCamera, DrawnStyle},
        forest::{GpuForests, PreparedForest, PreparedForests},
        frame_work::FrameWork,
        terrain::GpuTerrain,
    },
};

/// Draws forests and ground into the maps.
pub fn surfaces_pass(
    view: ViewQuery<&DrawnStyle, With<CanopyCamera>>,
    style: StylePass,
    (forests, prepared, terrain): (Res<GpuForests>, Res<PreparedForests>, Res<GpuTerrain>),
    work: Res<FrameWork>,
    mut ctx: RenderContext,
) {
    let (Some(group), Some(maps)) = (style.frame.of(view.entity()), style.maps()) else { return };
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("canopy_style_surfaces"),
        color_attachments: &[cleared(&maps.surfaces), cleared(&maps.identities), cleared(&maps.colors)],
        depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
            view: &maps.depth,
            depth_ops: Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Store }),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let span = diagnostics.pass_span(&mut pass, "canopy_style_surfaces");
    pass.set_bind_group(0, group, &[]);
    for (entity, forest) in forests.iter() {
        let Some(lists) = prepared.get(entity) else { continue };
        for (index, level) in forest.levels() {
            for features in level.gpu.features(LEVEL_TARGET) {
                let Some(pipeline) = style.pipeline(style.pipelines.level(level, features)) else { continue };
                pass.set_render_pipeline(pipeline);
                for page in lists.pages.iter().filter(|page| page.trees.may_have(index)) {
                    pass.set_bind_group(1, &page.bind_group, &[PreparedForest::offset(index)]);
                    let trees = page.trees.level(index, Share::ALL);
                    level.gpu.draw(&mut pass, features, LEVEL_TARGET, &trees);
                    FrameWork::add(&work.commands, trees.calls());
                }
            }
        }
    }
    let ground = style.pipeline(style.pipelines.ground(terrain.features));
    if let (Some(pipeline), Some(tiles)) = (ground, &terrain.bind_group)
        && terrain.count > 0
    {
        pass.set_render_pipeline(pipeline);
        pass.set_bind_group(1, tiles, &[]);
        pass.set_index_buffer(terrain.indices.slice(..), IndexFormat::Uint32);
        pass.draw_indexed(0..terrain.index_count, 0, 0..terrain.count);
    }
    span.end(&mut pass);
    style.ran("canopy_style_surfaces", "trees and ground");
}
