//! Maps that the washes of a watercolour look up instead of computing them at every pixel: contours, which they need twice, and noise that is
//! broad enough for a coarser map.

use bevy::{
    ecs::{query::With, system::Res},
    render::{
        render_resource::{BindGroupEntries, PipelineCache},
        renderer::{RenderContext, RenderDevice, ViewQuery},
    },
};

use super::{
    full_screen,
    inputs::StyleInputs,
    layouts::{contours_layout, noises_layout},
    pipelines::StylePipelines,
    targets::StyleTargets,
};
use crate::{
    render::{
        bindings::FrameBindGroup,
        components::{CanopyCamera, DrawnStyle},
    },
    style::Style,
};

/// Draws both maps for a watercolour.
pub fn wash_maps_pass(
    view: ViewQuery<&DrawnStyle, With<CanopyCamera>>,
    group: Res<FrameBindGroup>,
    targets: Res<StyleTargets>,
    inputs: Res<StyleInputs>,
    pipelines: Res<StylePipelines>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let group = group.of(view.entity());
    if !matches!(view.into_inner().style, Style::Watercolour(_)) {
        return;
    }
    let pipelines = pipelines.contours_and_noises().map(|ids| ids.map(|id| cache.get_render_pipeline(id)));
    let (Some(group), Some(maps), Some([Some(contours), Some(noises)])) = (group, &targets.0, pipelines) else {
        return;
    };
    let own = device.create_bind_group(
        "canopy_style_contours",
        &cache.get_bind_group_layout(&contours_layout()),
        &BindGroupEntries::sequential((
            inputs.uniform.as_entire_binding(),
            &maps.soft_lights,
            &maps.soft_normals,
            &inputs.linear,
        )),
    );
    full_screen::draw(&mut ctx, "canopy_style_contours", &maps.contours, contours, &[(group, &[]), (&own, &[])]);
    let own = device.create_bind_group(
        "canopy_style_noises",
        &cache.get_bind_group_layout(&noises_layout()),
        &BindGroupEntries::sequential((inputs.uniform.as_entire_binding(), &maps.depth)),
    );
    full_screen::draw(&mut ctx, "canopy_style_noises", &maps.noises, noises, &[(group, &[]), (&own, &[])]);
}
