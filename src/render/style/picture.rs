//! The picture: washes, lines or tones of the maps, after Bevy's tone mapping, which is for photographs.

use bevy::{
    ecs::query::With,
    render::{
        render_resource::BindGroupEntries,
        renderer::{RenderContext, ViewQuery},
        view::ViewTarget,
    },
};

use super::{
    layouts::{Picture, picture_layout},
    pass::{FullScreenPass, StylePass},
};
use crate::render::components::{CanopyCamera, DrawnStyle};

/// Draws the picture over the view's colours.
pub fn picture_pass(
    view: ViewQuery<(&DrawnStyle, &ViewTarget), With<CanopyCamera>>,
    pass: StylePass,
    mut ctx: RenderContext,
) {
    let camera = view.entity();
    let (drawn, target) = view.into_inner();
    let Some(picture) = Picture::of(&drawn.style) else { return };
    let (Some(maps), Some(of)) = (pass.maps(), &pass.inputs.drawn) else { return };
    let pipeline = pass.pipelines.picture(picture, target.main_texture_format());
    // Without it the view's colours stay what they are.
    if pass.frame.of(camera).is_none() || pass.pipeline(pipeline).is_none() {
        return;
    }
    let mut draw = |entries: &[_]| {
        let target = target.post_process_write().destination;
        let layout = picture_layout(picture);
        pass.draw(
            &mut ctx,
            camera,
            FullScreenPass { label: "canopy_style_picture", pipeline, layout, entries, target },
        );
    };
    match picture {
        Picture::Watercolour => draw(&BindGroupEntries::sequential((
            pass.uniform(),
            &maps.depth,
            &maps.identities,
            &maps.soft_lights,
            &maps.wide_lights,
            &maps.lines,
            &maps.shapes,
            &of.ramps,
            &of.paper,
            of.layers.as_entire_binding(),
            &pass.inputs.linear,
            &pass.inputs.repeating,
            &maps.soft_dabs,
            &maps.soft_colors,
            &maps.colors,
            &maps.noises,
        ))),
        Picture::Lines | Picture::Toon => draw(&BindGroupEntries::sequential((
            pass.uniform(),
            &maps.depth,
            &maps.colors,
            &maps.lights,
            &maps.soft_lights,
            &maps.lines,
            &of.paper,
            &of.ramps,
            &pass.inputs.linear,
            &pass.inputs.repeating,
            &maps.identities,
        ))),
    }
}
