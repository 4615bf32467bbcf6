//! The lighting map and the soft shadow [Luft 2006, 3.2 and 3.3], once a pixel.
//!
//! As published the light is the normalised diffuse term; we darken it by the ambient visibility, so that the inside of crowns
//! stays dark. The shadow is the blurred depth test in light space; its Gaussian is taken where it is read, 25 points of the
//! cascade's map, instead of over whole maps.

use bevy::{
    ecs::query::With,
    render::{
        render_resource::BindGroupEntries,
        renderer::{RenderContext, ViewQuery},
    },
};

use super::{
    layouts::illumination_layout,
    pass::{FullScreenPass, StylePass},
};
use crate::render::components::{CanopyCamera, DrawnStyle};

/// Lights the surfaces.
pub fn illumination_pass(view: ViewQuery<&DrawnStyle, With<CanopyCamera>>, pass: StylePass, mut ctx: RenderContext) {
    let Some(maps) = pass.maps() else { return };
    let light = FullScreenPass {
        label: "canopy_style_light",
        pipeline: pass.pipelines.illumination(),
        layout: illumination_layout(),
        entries: &BindGroupEntries::sequential((pass.uniform(), &maps.depth, &maps.surfaces)),
        target: &maps.lights,
    };
    pass.draw(&mut ctx, view.entity(), light);
}
