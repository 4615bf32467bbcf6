//! What the full-screen passes read besides the maps: the style's values, ramps, layers and paper.

use std::ops::Range;

use bevy::{
    ecs::{
        query::With,
        resource::Resource,
        system::{Query, Res, ResMut},
        world::{FromWorld, World},
    },
    render::{
        render_resource::{
            AddressMode, Buffer, BufferUsages, FilterMode, Sampler, SamplerDescriptor, TextureFormat, TextureView,
        },
        renderer::RenderDevice,
    },
};
use glam::Vec4;
use half::f16;

use super::{
    targets::{MapKey, StyleTargets},
    uniforms::{BlurUniform, LayerUniform, StyleUniform},
};
use crate::{
    math::MipView,
    render::{
        components::{CanopyCamera, DrawnStyle},
        gpu::{self, Gpu, UNIFORM_STRIDE},
        report::FrameReport,
        view::PreparedFrame,
    },
    style::{
        Deviations, Palette, Paper, Ramp, Style,
        deviations::{IDENTITY_POINTS, LINES, MAP_POINTS, MOST_STAGES, Spacing, stages},
        layers,
    },
};

/// Colours of a ramp on the device.
const RAMP_STEPS: usize = 64;
/// Passes of the Gaussians: four maps, the dabs, and the slices of the layers, both directions of each stage.
pub const MOST_BLURS: u64 = 2 * (5 + 64) * MOST_STAGES as u64;

/// The values of the style that is drawn.
#[derive(Resource)]
pub struct StyleInputs {
    /// [`StyleUniform`].
    pub uniform: Buffer,
    /// [`BlurUniform`]s at [`UNIFORM_STRIDE`], two a stage.
    pub blurs: Buffer,
    /// The stages of each Gaussian: of four maps, of the dabs, of each slice of the layers.
    pub blur_stages: Vec<Range<u32>>,
    /// Clamps.
    pub linear: Sampler,
    /// Repeats.
    pub repeating: Sampler,
    /// Of the style that is drawn.
    pub drawn: Option<DrawnInputs>,
}

/// Those that follow from palette, paper and plants.
pub struct DrawnInputs {
    key: InputKey,
    /// Ramps, a row each.
    pub ramps: TextureView,
    /// [`LayerUniform`]s.
    pub layers: Buffer,
    /// Heights of the paper.
    pub paper: TextureView,
}

#[derive(Clone, PartialEq)]
struct InputKey {
    palette: Option<Palette>,
    paper: Paper,
    layers: u32,
    wetness: f32,
}

impl FromWorld for StyleInputs {
    fn from_world(world: &mut World) -> Self {
        let device = world.resource::<RenderDevice>();
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let sampler = |address| {
            device.create_sampler(&SamplerDescriptor {
                label: Some("canopy_style"),
                address_mode_u: address,
                address_mode_v: address,
                mag_filter: FilterMode::Linear,
                min_filter: FilterMode::Linear,
                ..Default::default()
            })
        };
        Self {
            uniform: gpu::buffer_with(device, "canopy_style", usage, &[StyleUniform::default()]),
            blurs: gpu::uniform_slots(device, "canopy_style_blurs", MOST_BLURS),
            blur_stages: Vec::new(),
            linear: sampler(AddressMode::ClampToEdge),
            repeating: sampler(AddressMode::Repeat),
            drawn: None,
        }
    }
}

/// Uploads the style's values, and what follows from palette, paper and plants when those change.
pub fn prepare_inputs(
    views: Query<&DrawnStyle, With<CanopyCamera>>,
    frame: Res<PreparedFrame>,
    targets: Res<StyleTargets>,
    gpu: Gpu,
    report: Res<FrameReport>,
    mut inputs: ResMut<StyleInputs>,
) {
    let styled = frame.view.as_ref().and_then(|view| Some((view, views.get(view.entity).ok()?)));
    let (Some((view, drawn)), Some(maps)) = (styled, &targets.0) else {
        inputs.drawn = None;
        return;
    };
    let uniform = StyleUniform::new(drawn, view, maps.key.picture, maps.key.size);
    gpu.queue.write_buffer(&inputs.uniform, 0, bytemuck::bytes_of(&uniform));
    inputs.blur_stages = write_blurs(&gpu, &inputs.blurs, &Deviations::of(&drawn.style), &maps.key);

    let wetness = if let Style::Watercolour(w) = &drawn.style { w.wetness } else { 0.0 };
    let key = InputKey { palette: drawn.palette().cloned(), paper: drawn.paper(), layers: maps.key.layers, wetness };
    if inputs.drawn.as_ref().is_some_and(|known| known.key == key) {
        report.skipped("style palette and paper", "neither has changed");
        return;
    }
    report.ran("style palette and paper", "uploaded");
    let old_paper = inputs.drawn.take().filter(|known| known.key.paper == key.paper).map(|known| known.paper);
    let paper = old_paper.unwrap_or_else(|| upload_paper(&gpu, key.paper));
    let washes = washes(&key);
    let layers = gpu::buffer_with(&gpu.device, "canopy_style_layers", BufferUsages::STORAGE, &washes);
    inputs.drawn = Some(DrawnInputs { ramps: upload_ramps(&gpu, &key), layers, paper, key });
}

/// A Gaussian over a map.
struct Gaussian {
    /// Pixels of a picture of 720 lines.
    deviation: f32,
    /// The same of what it blurs.
    blurred: f32,
    /// Texels along a side that become one.
    divisor: u32,
    /// Whether two channels are a depth.
    depth: bool,
    /// First of four layers, for identifiers.
    first_layer: Option<u32>,
}

impl Gaussian {
    fn of(deviation: f32) -> Self {
        Self { deviation, blurred: 0.0, divisor: 1, depth: false, first_layer: None }
    }

    /// The passes: two for each stage.
    fn passes(&self, key: &MapKey) -> Vec<BlurUniform> {
        let unit = key.size.1 as f32 / LINES;
        let coarse = key.coarse(self.divisor);
        let ratio = [key.size.0 as f32 / coarse.0 as f32, key.size.1 as f32 / coarse.1 as f32];
        let points = if self.first_layer.is_some() { IDENTITY_POINTS } else { MAP_POINTS };
        let pass = |spacing: Spacing, step, scale| BlurUniform {
            step,
            scale,
            spacing: spacing.deviations,
            first_layer: self.first_layer.unwrap_or(0),
            splits_depth: self.depth.into(),
            padding: 0,
        };
        let stages = stages(self.deviation * unit, self.blurred * unit, points);
        let passes = stages.iter().enumerate().flat_map(|(stage, deviation)| {
            // The first pass leads to the size of the target, the others stay at it.
            let (points, scale) = if stage == 0 { (points, ratio) } else { (MAP_POINTS, [1.0; 2]) };
            let across = Spacing::of(if stage == 0 { *deviation } else { deviation / ratio[0] }, points);
            let along = Spacing::of(deviation / ratio[1], MAP_POINTS);
            [pass(across, [across.texels, 0.0], scale), pass(along, [0.0, along.texels], [1.0; 2])]
        });
        passes.collect()
    }
}

/// Writes the passes of all Gaussians, in the order in which `blur` draws them, and returns the stages of each.
fn write_blurs(gpu: &Gpu, buffer: &Buffer, deviations: &Deviations, key: &MapKey) -> Vec<Range<u32>> {
    let Deviations { shapes, lights, wide, normals, dabs } = *deviations;
    let maps = [
        Gaussian { depth: true, ..Gaussian::of(lights) },
        Gaussian { depth: true, blurred: lights, divisor: key.wide_divisor, ..Gaussian::of(wide) },
        Gaussian::of(normals),
        Gaussian { divisor: key.color_divisor, ..Gaussian::of(lights) },
        Gaussian::of(dabs),
    ];
    let slices =
        (0..key.layers.div_ceil(4)).map(|slice| Gaussian { first_layer: Some(4 * slice), ..Gaussian::of(shapes) });
    let mut passes = Vec::new();
    let stages = maps.into_iter().chain(slices).map(|gaussian| {
        let first = passes.len() as u32 / 2;
        passes.extend(gaussian.passes(key));
        first..passes.len() as u32 / 2
    });
    let stages = stages.collect();
    for (slot, pass) in (0..MOST_BLURS).zip(&passes) {
        gpu.queue.write_buffer(buffer, slot * UNIFORM_STRIDE, bytemuck::bytes_of(pass));
    }
    stages
}

/// How each layer is painted: the sky on wet paper, the rest on dry paper as far as the style says.
fn washes(key: &InputKey) -> Vec<LayerUniform> {
    let dry = 0.05 + 0.30 * key.wetness;
    let layer = |index: u32| match index as u8 {
        layers::SKY => LayerUniform { threshold: 0.32, softness: 0.22, edge: 0.25, foliage: 0.0 },
        layers::GROUND => LayerUniform { threshold: 0.40, softness: dry + 0.05, edge: 0.7, foliage: 0.0 },
        layers::WOOD => LayerUniform { threshold: 0.40, softness: dry, edge: 0.8, foliage: 0.0 },
        _ => LayerUniform { threshold: 0.44, softness: dry, edge: 1.0, foliage: 1.0 },
    };
    (0..key.layers.max(1)).map(layer).collect()
}

/// The ramps: layers, then the shadow, then dark, medium and bright dabs.
fn ramps(key: &InputKey) -> Vec<Vec<Vec4>> {
    let Some(palette) = &key.palette else { return vec![Ramp::default().table(RAMP_STEPS)] };
    let hued = |ramp: &Ramp| -> Vec<Vec4> {
        let light = |i: usize| i as f32 / (RAMP_STEPS - 1) as f32;
        (0..RAMP_STEPS).map(|i| ramp.with_hue(&palette.hue, light(i))).collect()
    };
    let layer = |index: u32| match index as u8 {
        layers::SKY => palette.sky.table(RAMP_STEPS),
        layers::GROUND => hued(&palette.ground),
        layers::WOOD => hued(&palette.wood),
        foliage => {
            let group = usize::from(foliage - layers::FIRST_FOLIAGE);
            hued(palette.foliage_of(group))
        }
    };
    let mut rows: Vec<_> = (0..key.layers.max(1)).map(layer).collect();
    rows.push(palette.shadow.table(RAMP_STEPS));
    rows.extend(palette.dabs.iter().map(|ramp| ramp.table(RAMP_STEPS)));
    rows
}

fn upload_ramps(gpu: &Gpu, key: &InputKey) -> TextureView {
    let rows = ramps(key);
    let size = (RAMP_STEPS as u32, rows.len() as u32);
    let (texture, view) = gpu::table(&gpu.device, "canopy_style_ramps", size);
    let texels: Vec<[f16; 4]> = rows.iter().flatten().map(|color| color.to_array().map(f16::from_f32)).collect();
    gpu::write_level(&gpu.queue, &texture, 0, 0, size.0, size.1, 8, bytemuck::cast_slice(&texels));
    view
}

fn upload_paper(gpu: &Gpu, paper: Paper) -> TextureView {
    let texels: Vec<u8> = paper.heights().into_iter().flat_map(|height| [height; 4]).collect();
    let side = Paper::SIDE as u32;
    let view = MipView { width: side, height: side, levels: vec![&texels] };
    gpu::texture(&gpu.device, &gpu.queue, "canopy_style_paper", TextureFormat::Rgba8Unorm, view, side)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(layers: u32) -> InputKey {
        InputKey { palette: Palette::named("natural").ok(), paper: Paper::Rough, layers, wetness: 0.3 }
    }

    #[test]
    fn every_layer_has_a_ramp_and_a_wash_and_more_than_64_have_too() {
        for layers in [0, 4, 5, 70, 255] {
            let key = key(layers);
            assert_eq!(washes(&key).len(), layers.max(1) as usize);
            let rows = ramps(&key);
            assert_eq!(rows.len(), layers.max(1) as usize + 4);
            assert!(rows.iter().all(|row| row.len() == RAMP_STEPS && row.iter().all(|color| color.is_finite())));
        }
        const { assert!(MOST_BLURS >= 2 * (5 + 256 / 4) * MOST_STAGES as u64) };
    }
}
