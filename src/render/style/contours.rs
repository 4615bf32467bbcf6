//! Contours: how strong they are, then lines of a chosen width on the ridges of that.

use bevy::{
    ecs::query::With,
    render::{
        render_resource::BindGroupEntries,
        renderer::{RenderContext, ViewQuery},
    },
};

use super::{
    layouts::{contours_layout, lines_layout},
    pass::{FullScreenPass, StylePass},
};
use crate::render::components::{CanopyCamera, DrawnStyle};

/// Draws the map of lines.
pub fn contours_pass(view: ViewQuery<&DrawnStyle, With<CanopyCamera>>, pass: StylePass, mut ctx: RenderContext) {
    let camera = view.entity();
    let (Some(maps), Some([contours, lines])) = (pass.maps(), pass.pipelines.contours()) else { return };
    if !view.into_inner().style.has_contours() {
        return;
    }
    let linear = &pass.inputs.linear;
    let strength = FullScreenPass {
        label: "canopy_style_contours",
        pipeline: Some(contours),
        layout: contours_layout(),
        entries: &BindGroupEntries::sequential((pass.uniform(), &maps.soft_lights, &maps.soft_normals, linear)),
        target: &maps.contours,
    };
    pass.draw(&mut ctx, camera, strength);
    let lines = FullScreenPass {
        label: "canopy_style_lines",
        pipeline: Some(lines),
        layout: lines_layout(),
        entries: &BindGroupEntries::sequential((pass.uniform(), &maps.contours, linear)),
        target: &maps.lines,
    };
    pass.draw(&mut ctx, camera, lines);
}
