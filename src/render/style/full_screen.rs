//! Passes over a whole picture or map.

use std::borrow::Cow;

use bevy::{
    asset::Handle,
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{
            BindGroup, BindGroupLayoutDescriptor, ColorTargetState, ColorWrites, FragmentState, LoadOp, Operations,
            RenderPassColorAttachment, RenderPassDescriptor, RenderPipeline, RenderPipelineDescriptor, StoreOp,
            TextureFormat, TextureView, VertexState,
        },
        renderer::RenderContext,
    },
    shader::{Shader, ShaderDefVal},
};

/// A pipeline that draws one triangle over a target of `format`.
pub fn full_screen(
    label: &'static str,
    shader: Handle<Shader>,
    defs: Vec<ShaderDefVal>,
    layout: Vec<BindGroupLayoutDescriptor>,
    format: TextureFormat,
) -> RenderPipelineDescriptor {
    RenderPipelineDescriptor {
        label: Some(Cow::Borrowed(label)),
        layout,
        vertex: VertexState {
            shader: shader.clone(),
            shader_defs: defs.clone(),
            entry_point: Some("vertex".into()),
            ..Default::default()
        },
        fragment: Some(FragmentState {
            shader,
            shader_defs: defs,
            entry_point: Some("fragment".into()),
            targets: vec![Some(ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL })],
        }),
        ..Default::default()
    }
}

/// A colour attachment that begins at 0.
pub fn cleared(view: &TextureView) -> Option<RenderPassColorAttachment<'_>> {
    Some(RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: Operations { load: LoadOp::Clear(Default::default()), store: StoreOp::Store },
    })
}

/// Draws one triangle over `target`. `groups` have a dynamic offset, or none.
pub fn draw(
    ctx: &mut RenderContext,
    label: &'static str,
    target: &TextureView,
    pipeline: &RenderPipeline,
    groups: &[(&BindGroup, &[u32])],
) {
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[cleared(target)],
        depth_stencil_attachment: None,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let span = diagnostics.pass_span(&mut pass, label);
    pass.set_render_pipeline(pipeline);
    for (index, (group, offsets)) in groups.iter().enumerate() {
        pass.set_bind_group(index, group, offsets);
    }
    pass.draw(0..3, 0..1);
    span.end(&mut pass);
}
