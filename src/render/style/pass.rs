//! What the passes of a style have in common.

use bevy::{
    ecs::{
        entity::Entity,
        system::{Res, SystemParam},
    },
    render::{
        render_resource::{
            BindGroupEntry, BindGroupLayoutDescriptor, BindingResource, CachedRenderPipelineId, PipelineCache,
            RenderPipeline, TextureView,
        },
        renderer::{RenderContext, RenderDevice},
    },
};

use super::{
    full_screen,
    inputs::StyleInputs,
    pipelines::StylePipelines,
    targets::{StyleMaps, StyleTargets},
};
use crate::render::{bindings::FrameBindGroup, report::FrameReport};

/// What a pass reads, and where it says that it ran.
#[derive(SystemParam)]
pub struct StylePass<'w> {
    /// Group 0.
    pub frame: Res<'w, FrameBindGroup>,
    targets: Res<'w, StyleTargets>,
    /// The style's values.
    pub inputs: Res<'w, StyleInputs>,
    /// The pipelines that were requested.
    pub pipelines: Res<'w, StylePipelines>,
    /// Those that are compiled.
    pub cache: Res<'w, PipelineCache>,
    /// The device.
    pub device: Res<'w, RenderDevice>,
    report: Res<'w, FrameReport>,
}

/// A pass over a whole map: its pipeline, what it reads in group 1, and where it draws.
pub struct FullScreenPass<'a> {
    /// Names the pass, its group and its time stamps; begins with `canopy_style_`.
    pub label: &'static str,
    /// `None` until it was requested.
    pub pipeline: Option<CachedRenderPipelineId>,
    /// Of group 1.
    pub layout: BindGroupLayoutDescriptor,
    /// Of group 1.
    pub entries: &'a [BindGroupEntry<'a>],
    /// What is drawn over.
    pub target: &'a TextureView,
}

impl StylePass<'_> {
    /// The maps; `None` while no view has a style.
    pub fn maps(&self) -> Option<&StyleMaps> {
        self.targets.0.as_ref()
    }

    /// A pipeline that is compiled.
    pub fn pipeline(&self, id: Option<CachedRenderPipelineId>) -> Option<&RenderPipeline> {
        id.and_then(|id| self.cache.get_render_pipeline(id))
    }

    /// The style's values as a binding.
    pub fn uniform(&self) -> BindingResource<'_> {
        self.inputs.uniform.as_entire_binding()
    }

    /// Says in the report of the frame that the pass `label` ran.
    pub fn ran(&self, label: &str, on: impl Into<String>) {
        self.report.ran(label.trim_start_matches("canopy_").replace('_', " "), on);
    }

    /// Draws `pass` for `camera` once its pipeline is compiled.
    pub fn draw(&self, ctx: &mut RenderContext, camera: Entity, pass: FullScreenPass) {
        let (Some(frame), Some(pipeline)) = (self.frame.of(camera), self.pipeline(pass.pipeline)) else { return };
        let layout = self.cache.get_bind_group_layout(&pass.layout);
        let own = self.device.create_bind_group(pass.label, &layout, pass.entries);
        full_screen::draw(ctx, pass.label, pass.target, pipeline, &[(frame, &[]), (&own, &[])]);
        self.ran(pass.label, "over all pixels");
    }
}
