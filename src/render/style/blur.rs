//! Gaussians of the maps, along one axis after the other. Those of the layers abstract their shapes: what is smaller than the
//! Gaussian falls below the threshold of its wash and vanishes, with the distance too [Luft 2006, fig. 11].
//!
//! What is blurred much, and drawn without sharp edges (the light around, the colours), is blurred into coarser maps ([`divisor`](crate::style::deviations::divisor)).

use bevy::{
    ecs::query::With,
    render::{
        render_resource::{BindGroup, BindGroupEntries, BufferBinding, RenderPipeline, TextureView},
        renderer::{RenderContext, ViewQuery},
    },
};

use super::{
    full_screen,
    layouts::{BLUR_SIZE, blur_layout},
    pass::StylePass,
};
use crate::{
    render::{
        components::{CanopyCamera, DrawnStyle},
        gpu::UNIFORM_STRIDE,
    },
    style::Style,
};

/// Number of blurred maps, whose Gaussians come first; then the dabs', then the layers'.
pub const MAPS: usize = 4;

/// The Gaussians of a view.
struct Blurs<'a> {
    pass: &'a StylePass<'a>,
    /// Of maps, of identifiers, of what they give.
    pipelines: [&'a RenderPipeline; 3],
}

impl<'a> Blurs<'a> {
    /// `None` until the pipelines are compiled.
    fn new(pass: &'a StylePass<'a>) -> Option<Self> {
        let [of_map, of_identities, of_shapes] = pass.pipelines.blurs()?.map(|id| pass.pipeline(Some(id)));
        Some(Self { pass, pipelines: [of_map?, of_identities?, of_shapes?] })
    }

    fn group(&self, identities: bool, source: &TextureView) -> BindGroup {
        let StylePass { inputs, cache, device, .. } = self.pass;
        let job = BufferBinding { buffer: &inputs.blurs, offset: 0, size: BLUR_SIZE };
        let layout = cache.get_bind_group_layout(&blur_layout(identities));
        if identities {
            device.create_bind_group("canopy_style_blur", &layout, &BindGroupEntries::sequential((job, source)))
        } else {
            let entries = BindGroupEntries::sequential((job, source, &inputs.linear));
            device.create_bind_group("canopy_style_blur", &layout, &entries)
        }
    }

    /// All stages of Gaussian `index` in both directions, by way of `half`. `kinds` are the pipelines of the first pass and of the others.
    fn draw(&self, ctx: &mut RenderContext, index: usize, kinds: [usize; 2], views: [&TextureView; 3]) {
        let [source, half, target] = views;
        let [first, others] = kinds;
        let stages = self.pass.inputs.blur_stages.get(index).cloned().unwrap_or_default();
        for (count, stage) in stages.enumerate() {
            let from = if count == 0 { (first, source) } else { (others, target) };
            for (axis, ((kind, from), to)) in [(from, half), ((others, half), target)].into_iter().enumerate() {
                let group = self.group(kind == 1, from);
                let offset = [(2 * stage + axis as u32) * UNIFORM_STRIDE as u32];
                full_screen::draw(ctx, "canopy_style_blur", to, self.pipelines[kind], &[(&group, &offset)]);
            }
        }
    }
}

/// Blurs light, depth, normals and albedo.
pub fn maps_pass(view: ViewQuery<&DrawnStyle, With<CanopyCamera>>, pass: StylePass, mut ctx: RenderContext) {
    let (Some(maps), Some(blurs)) = (pass.maps(), Blurs::new(&pass)) else { return };
    let wide = matches!(view.into_inner().style, Style::Watercolour(_));
    let jobs: [_; MAPS] = [
        (&maps.lights, &maps.half_blurred, &maps.soft_lights, true),
        (&maps.soft_lights, &maps.half_wide, &maps.wide_lights, wide),
        (&maps.surfaces, &maps.half_blurred, &maps.soft_normals, true),
        (&maps.colors, &maps.half_colors, &maps.soft_colors, wide),
    ];
    for (index, (source, half, target, _)) in jobs.into_iter().enumerate().filter(|(_, (.., wanted))| *wanted) {
        blurs.draw(&mut ctx, index, [0, 0], [source, half, target]);
    }
    pass.ran("canopy_style_blur", if wide { "light, depth, normals, colours" } else { "light, depth, normals" });
}

/// Blurs dabs, and the layers of the identifiers.
pub fn shapes_pass(_view: ViewQuery<&DrawnStyle, With<CanopyCamera>>, pass: StylePass, mut ctx: RenderContext) {
    let (Some(maps), Some(blurs)) = (pass.maps(), Blurs::new(&pass)) else { return };
    if let Some(dabs) = &maps.dabs {
        blurs.draw(&mut ctx, MAPS, [2, 2], [dabs, &maps.half_shapes, &maps.soft_dabs]);
    }
    for (index, slice) in maps.shape_slices.iter().enumerate() {
        blurs.draw(&mut ctx, MAPS + 1 + index, [1, 2], [&maps.identities, &maps.half_shapes, slice]);
    }
    if maps.key.layers > 0 {
        pass.ran("canopy_style_layers", format!("{} layers, four a map", maps.key.layers));
    }
}
