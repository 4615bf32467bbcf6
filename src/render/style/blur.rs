//! Gaussians of the maps, along one axis after the other. Those of the layers abstract their shapes: what is smaller than the
//! Gaussian falls below the threshold of its wash and vanishes, with the distance too [Luft 2006, fig. 11].
//!
//! What is blurred much, and drawn without sharp edges (the light around, the colours), is blurred into coarser maps ([`divisor`](crate::style::deviations::divisor)).

use bevy::{
    ecs::{query::With, system::Res},
    render::{
        render_resource::{BindGroup, BindGroupEntries, BufferBinding, PipelineCache, RenderPipeline, TextureView},
        renderer::{RenderContext, RenderDevice, ViewQuery},
    },
};

use super::{
    full_screen,
    inputs::StyleInputs,
    layouts::{BLUR_SIZE, blur_layout},
    pipelines::StylePipelines,
    targets::StyleTargets,
};
use crate::{
    render::{
        components::{CanopyCamera, DrawnStyle},
        gpu::UNIFORM_STRIDE,
    },
    style::Style,
};

/// Number of blurred maps, whose jobs come first; then the dabs', then the layers'.
pub const MAPS: usize = 4;

/// The Gaussians of a view.
struct Blurs<'a> {
    inputs: &'a StyleInputs,
    cache: &'a PipelineCache,
    device: &'a RenderDevice,
    /// Of maps, of identifiers, of what they give.
    pipelines: [&'a RenderPipeline; 3],
}

impl<'a> Blurs<'a> {
    fn new(
        inputs: &'a StyleInputs,
        pipelines: &StylePipelines,
        cache: &'a PipelineCache,
        device: &'a RenderDevice,
    ) -> Option<Self> {
        let [of_map, of_identities, of_shapes] = pipelines.blurs()?.map(|id| cache.get_render_pipeline(id));
        Some(Self { inputs, cache, device, pipelines: [of_map?, of_identities?, of_shapes?] })
    }

    fn group(&self, identities: bool, source: &TextureView) -> BindGroup {
        let job = BufferBinding { buffer: &self.inputs.blurs, offset: 0, size: BLUR_SIZE };
        let layout = self.cache.get_bind_group_layout(&blur_layout(identities));
        if identities {
            self.device.create_bind_group("canopy_style_blur", &layout, &BindGroupEntries::sequential((job, source)))
        } else {
            let entries = BindGroupEntries::sequential((job, source, &self.inputs.linear));
            self.device.create_bind_group("canopy_style_blur", &layout, &entries)
        }
    }

    /// Both directions of job `job`, by way of `half`.
    fn both(&self, ctx: &mut RenderContext, job: usize, kinds: [usize; 2], views: [&TextureView; 3]) {
        let [source, half, target] = views;
        for (axis, (from, to)) in [(source, half), (half, target)].into_iter().enumerate() {
            let group = self.group(kinds[axis] == 1, from);
            let offset = [(2 * job + axis) as u32 * UNIFORM_STRIDE as u32];
            full_screen::draw(ctx, "canopy_style_blur", to, self.pipelines[kinds[axis]], &[(&group, &offset)]);
        }
    }
}

/// Blurs light, depth, normals and albedo.
pub fn maps_pass(
    view: ViewQuery<&DrawnStyle, With<CanopyCamera>>,
    targets: Res<StyleTargets>,
    inputs: Res<StyleInputs>,
    pipelines: Res<StylePipelines>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let (Some(maps), Some(blurs)) = (&targets.0, Blurs::new(&inputs, &pipelines, &cache, &device)) else { return };
    let wide = matches!(view.into_inner().style, Style::Watercolour(_));
    let jobs: [_; MAPS] = [
        (&maps.lights, &maps.half_blurred, &maps.soft_lights, true),
        (&maps.soft_lights, &maps.half_wide, &maps.wide_lights, wide),
        (&maps.surfaces, &maps.half_blurred, &maps.soft_normals, true),
        (&maps.colors, &maps.half_colors, &maps.soft_colors, wide),
    ];
    for (job, (source, half, target, _)) in jobs.into_iter().enumerate().filter(|(_, (.., wanted))| *wanted) {
        blurs.both(&mut ctx, job, [0, 0], [source, half, target]);
    }
}

/// Blurs dabs, and the layers of the identifiers.
pub fn shapes_pass(
    _view: ViewQuery<&DrawnStyle, With<CanopyCamera>>,
    targets: Res<StyleTargets>,
    inputs: Res<StyleInputs>,
    pipelines: Res<StylePipelines>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let (Some(maps), Some(blurs)) = (&targets.0, Blurs::new(&inputs, &pipelines, &cache, &device)) else { return };
    if let Some(dabs) = &maps.dabs {
        blurs.both(&mut ctx, MAPS, [2, 2], [dabs, &maps.half_shapes, &maps.soft_dabs]);
    }
    for (index, slice) in maps.shape_slices.iter().enumerate() {
        blurs.both(&mut ctx, MAPS + 1 + index, [1, 2], [&maps.identities, &maps.half_shapes, slice]);
    }
}
