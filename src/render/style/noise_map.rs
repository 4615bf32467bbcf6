//! Noise that is broad enough for a coarser map, which the washes of a watercolour look up.

use bevy::{
    ecs::query::With,
    render::{
        render_resource::BindGroupEntries,
        renderer::{RenderContext, ViewQuery},
    },
};

use super::{
    layouts::noises_layout,
    pass::{FullScreenPass, StylePass},
};
use crate::{
    render::components::{CanopyCamera, DrawnStyle},
    style::Style,
};

/// Draws the map of noise for a watercolour.
pub fn noise_map_pass(view: ViewQuery<&DrawnStyle, With<CanopyCamera>>, pass: StylePass, mut ctx: RenderContext) {
    let camera = view.entity();
    let Some(maps) = pass.maps() else { return };
    if matches!(view.into_inner().style, Style::Watercolour(_)) {
        let noises = FullScreenPass {
            label: "canopy_style_noises",
            pipeline: pass.pipelines.noises(),
            layout: noises_layout(),
            entries: &BindGroupEntries::sequential((pass.uniform(), &maps.depth)),
            target: &maps.noises,
        };
        pass.draw(&mut ctx, camera, noises);
    }
}
