//! The picture: washes, lines or tones of the maps, after Bevy's tone mapping, which is for photographs.

use bevy::{
    ecs::{query::With, system::Res},
    render::{
        render_resource::{BindGroupEntries, PipelineCache},
        renderer::{RenderContext, RenderDevice, ViewQuery},
        view::ViewTarget,
    },
};

use super::{
    full_screen,
    inputs::StyleInputs,
    layouts::{Picture, picture_layout},
    pipelines::StylePipelines,
    targets::StyleTargets,
};
use crate::render::{
    bindings::FrameBindGroup,
    components::{CanopyCamera, DrawnStyle},
};

/// Draws the picture over the view's colours.
pub fn picture_pass(
    view: ViewQuery<(&DrawnStyle, &ViewTarget), With<CanopyCamera>>,
    group: Res<FrameBindGroup>,
    targets: Res<StyleTargets>,
    inputs: Res<StyleInputs>,
    pipelines: Res<StylePipelines>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let group = group.of(view.entity());
    let (drawn, target) = view.into_inner();
    let Some(picture) = Picture::of(&drawn.style) else { return };
    let id = pipelines.picture(picture, target.main_texture_format());
    let pipeline = id.and_then(|id| cache.get_render_pipeline(id));
    let (Some(group), Some(maps), Some(of)) = (group, &targets.0, &inputs.drawn) else { return };
    let Some(pipeline) = pipeline else { return };
    let layout = cache.get_bind_group_layout(&picture_layout(picture));
    let own = match picture {
        Picture::Watercolour => device.create_bind_group(
            "canopy_style_picture",
            &layout,
            &BindGroupEntries::sequential((
                inputs.uniform.as_entire_binding(),
                &maps.depth,
                &maps.identities,
                &maps.soft_lights,
                &maps.wide_lights,
                &maps.contours,
                &maps.shapes,
                &of.ramps,
                &of.paper,
                of.layers.as_entire_binding(),
                &inputs.linear,
                &inputs.repeating,
                &maps.soft_dabs,
                &maps.soft_colors,
                &maps.colors,
                &maps.noises,
            )),
        ),
        Picture::Lines | Picture::Toon => device.create_bind_group(
            "canopy_style_picture",
            &layout,
            &BindGroupEntries::sequential((
                inputs.uniform.as_entire_binding(),
                &maps.depth,
                &maps.colors,
                &maps.lights,
                &maps.soft_lights,
                &maps.soft_normals,
                &of.paper,
                &of.ramps,
                &inputs.linear,
                &inputs.repeating,
                &maps.identities,
            )),
        ),
    };
    let write = target.post_process_write();
    full_screen::draw(&mut ctx, "canopy_style_picture", write.destination, pipeline, &[(group, &[]), (&own, &[])]);
}
