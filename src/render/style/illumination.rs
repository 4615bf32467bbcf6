//! The lighting map and the soft shadow [Luft 2006, 3.2 and 3.3], once a pixel.
//!
//! As published the light is the normalised diffuse term; we darken it by the ambient visibility, so that the inside of crowns
//! stays dark. The shadow is the blurred depth test in light space; its Gaussian is taken where it is read, 25 points of the
//! cascade's map, instead of over whole maps.

use bevy::{
    ecs::{query::With, system::Res},
    render::{
        render_resource::{BindGroupEntries, PipelineCache},
        renderer::{RenderContext, RenderDevice, ViewQuery},
    },
};

use super::{
    full_screen, inputs::StyleInputs, layouts::illumination_layout, pipelines::StylePipelines, targets::StyleTargets,
};
use crate::render::{
    bindings::FrameBindGroup,
    components::{CanopyCamera, DrawnStyle},
};

/// Lights the surfaces.
pub fn illumination_pass(
    view: ViewQuery<&DrawnStyle, With<CanopyCamera>>,
    group: Res<FrameBindGroup>,
    targets: Res<StyleTargets>,
    inputs: Res<StyleInputs>,
    pipelines: Res<StylePipelines>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let pipeline = pipelines.illumination().and_then(|id| cache.get_render_pipeline(id));
    let (Some(group), Some(maps), Some(pipeline)) = (group.of(view.entity()), &targets.0, pipeline) else { return };
    let own = device.create_bind_group(
        "canopy_style_light",
        &cache.get_bind_group_layout(&illumination_layout()),
        &BindGroupEntries::sequential((inputs.uniform.as_entire_binding(), &maps.depth, &maps.surfaces)),
    );
    full_screen::draw(&mut ctx, "canopy_style_light", &maps.lights, pipeline, &[(group, &[]), (&own, &[])]);
}
