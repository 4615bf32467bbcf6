//! Radiance transfer on the GPU: a part's coefficients, and the light turned into every yaw that a tree can have.
//!
//! A packed tree has one of 256 yaws, so the light is turned for all of them at once when it has changed, exactly and at
//! any band, and a vertex does nothing but two dot products, four coefficients at a time. Without a plant that is lit by transfer there is no buffer,
//! no binding, and nothing is computed.
//!
//! A plant can take the sun the same way [Franzke 2005, 4.3.3], [`SunLight::Harmonics`]: its light is a second set of 256
//! rows, which is neither computed nor uploaded while no plant asks for it, and costs a vertex two more dot products.

use std::{f32::consts::TAU, sync::Arc};

use bevy::{
    ecs::{
        resource::Resource,
        system::{Res, ResMut},
    },
    render::{
        render_resource::{BindGroup, BindGroupEntries, Buffer, BufferDescriptor, BufferUsages, PipelineCache},
        renderer::{RenderDevice, RenderQueue},
    },
};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::{layouts::ForestLayouts, resources::GpuForests};
use crate::{
    bake::transfer::{PackedPart, TransferSettings, code_words, mean_words},
    light::{
        LightState,
        atmosphere::luminance,
        sh::{MAX_BANDS, basis_into, rotate_y},
    },
    plant::LeafColors,
    render::{components::SunLight, extract::ExtractedScene, frame::PreparedFrame, gpu, report::FrameReport},
    scatter::packed::YAW_BITS,
};

/// Yaws of a packed tree.
pub const YAWS: usize = 1 << YAW_BITS;
/// Words of four coefficients after the first, of all bands.
pub const WORDS: usize = (MAX_BANDS * MAX_BANDS - 1).div_ceil(4);
/// Vectors from one yaw's light to the next: the first coefficient, then red, green and blue of each word.
pub const STRIDE: usize = 1 + 3 * WORDS;
/// Bytes of one light in all yaws.
const SET_BYTES: u64 = (YAWS * STRIDE * size_of::<[f32; 4]>()) as u64;

/// `Transfer` of `shaders/forest/transfer.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TransferUniform {
    /// What 127 stands for in each coefficient after the first, relative to it, four a word of codes.
    pub scale: [[f32; 4]; WORDS],
    /// Words from one vertex to the next.
    pub vertex_words: u32,
    /// Words of a vertex's means, which stand first.
    pub mean_words: u32,
    /// Words of the codes of one side and channel.
    pub side_words: u32,
    /// Where the codes of the indirect key light begin, a word a vertex.
    pub indirect_sun_start: u32,
    /// Colour of the indirect key light, which leaves send each other.
    pub indirect_sun_color: [f32; 3],
    /// What 127 stands for in its codes.
    pub indirect_sun_scale: f32,
}

impl TransferUniform {
    fn new(settings: &TransferSettings, part: &PackedPart, tint: Vec3) -> Self {
        let mut scale = [0.0; 4 * WORDS];
        for (i, scale) in scale.iter_mut().enumerate() {
            *scale = part.scale.get((i + 1).isqrt()).copied().unwrap_or(0.0);
        }
        Self {
            scale: bytemuck::cast(scale),
            vertex_words: (part.vertex_bytes / 4) as u32,
            mean_words: mean_words(settings, part.sides) as u32,
            side_words: code_words(settings) as u32,
            indirect_sun_start: (part.bytes.len() / 4) as u32,
            indirect_sun_color: tint.to_array(),
            indirect_sun_scale: part.scattered_scale,
        }
    }
}

/// The light of the moment, turned.
#[derive(Resource, Default)]
pub struct TransferLight {
    buffer: Option<Buffer>,
    wanted: Wanted,
    /// What the buffer holds.
    known: Option<(Arc<LightState>, f32, Wanted)>,
}

/// What plants ask of the turned light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Wanted {
    /// The most bands.
    bands: usize,
    /// The sun's light too.
    sun: bool,
}

impl TransferLight {
    /// Group 3 of a part; `tint`: the colour of light that leaves send each other ([`scattered_tint`]).
    pub fn bind_group(
        &mut self,
        (settings, part): (&TransferSettings, &PackedPart),
        tint: Vec3,
        sun: SunLight,
        layouts: &ForestLayouts,
        device: &RenderDevice,
        pipelines: &PipelineCache,
    ) -> BindGroup {
        self.wanted.bands = self.wanted.bands.max(settings.bands.into());
        self.wanted.sun |= sun == SunLight::Harmonics;
        let light = self.buffer.get_or_insert_with(|| {
            device.create_buffer(&BufferDescriptor {
                label: Some("canopy_turned_light"),
                // Sky and sun.
                size: 2 * SET_BYTES,
                usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        let words = [part.bytes.as_slice(), part.scattered.as_slice()].concat();
        let coefficients = gpu::buffer_with(device, "canopy_transfer", BufferUsages::STORAGE, &words);
        let uniform = [TransferUniform::new(settings, part, tint)];
        let uniform = gpu::buffer_with(device, "canopy_transfer_layout", BufferUsages::STORAGE, &uniform);
        device.create_bind_group(
            "canopy_transfer",
            &pipelines.get_bind_group_layout(&layouts.transfer),
            &BindGroupEntries::sequential((
                light.as_entire_binding(),
                coefficients.as_entire_binding(),
                uniform.as_entire_binding(),
            )),
        )
    }
}

/// Turns the light where it, the exposure or what is asked of it has changed.
pub fn prepare_transfer_light(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    queue: Res<RenderQueue>,
    report: Res<FrameReport>,
    mut transfer: ResMut<TransferLight>,
) {
    let transfer = &mut *transfer;
    // Plants may have come into another light since.
    let lit =
        || forests.iter().flat_map(|(_, forest)| forest.parts.iter().flatten()).any(|part| part.transfer.is_some());
    let Some(buffer) = transfer.buffer.as_ref().filter(|_| lit()) else {
        report.skipped("transfer light", "no plant is lit by radiance transfer");
        return;
    };
    let (Some(view), Some(daylight)) = (&frame.view, &scene.daylight) else { return };
    let same = |(light, exposure, wanted): &(Arc<LightState>, f32, Wanted)| {
        Arc::ptr_eq(light, &daylight.0) && *exposure == view.exposure && *wanted == transfer.wanted
    };
    if transfer.known.as_ref().is_some_and(same) {
        report.skipped("transfer light", "the light rests");
        return;
    }
    let Wanted { bands, sun } = transfer.wanted;
    let sky = daylight.0.surroundings().project(bands);
    queue.write_buffer(buffer, 0, bytemuck::cast_slice(&turned(&sky, view.exposure)));
    if sun {
        let light = beam(daylight.0.key_direction, daylight.0.key_illuminance, bands);
        queue.write_buffer(buffer, SET_BYTES, bytemuck::cast_slice(&turned(&light, view.exposure)));
    }
    transfer.known = Some((daylight.0.clone(), view.exposure, transfer.wanted));
    let of = if sun { "sky and sun, " } else { "" };
    report.ran("transfer light", format!("{of}{bands} bands turned into {YAWS} yaws"));
}

/// The colour that light takes on from a leaf, by its luminance; white where leaves are black.
///
/// With one channel a transfer holds what comes over other leaves by the luminance of their colours. That of the sky is a
/// few percent of its light and stays without colour; that of the sun is most of what lights the shade inside a crown.
pub fn scattered_tint(leaves: &LeafColors) -> Vec3 {
    let color = leaves.reflected + leaves.transmitted;
    let light = luminance(color);
    if light > 1e-4 { color / light } else { Vec3::ONE }
}

/// Coefficients of light that comes from one direction (unit), `illuminance` lux on what faces it.
fn beam(direction: Vec3, illuminance: Vec3, bands: usize) -> Vec<Vec3> {
    let mut basis = vec![0.0; bands * bands];
    basis_into(direction, &mut basis);
    basis.into_iter().map(|value| illuminance * value).collect()
}

/// `light` as each yaw's plant sees it, times `exposure`; zeros beyond its bands.
fn turned(light: &[Vec3], exposure: f32) -> Vec<[f32; 4]> {
    let mut rows = Vec::with_capacity(YAWS * STRIDE);
    for yaw in 0..YAWS {
        let mut seen = light.to_vec();
        rotate_y(&mut seen, -(yaw as f32) * TAU / YAWS as f32);
        seen.resize(1 + 4 * WORDS, Vec3::ZERO);
        seen.iter_mut().for_each(|value| *value *= exposure);
        rows.push(seen[0].extend(0.0).to_array());
        for word in seen[1..].chunks_exact(4) {
            rows.extend((0..3).map(|channel| [0, 1, 2, 3].map(|i: usize| word[i][channel])));
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::light::sh::{basis, evaluate};

    #[test]
    fn a_beam_lights_what_faces_it() {
        let sun = Vec3::new(0.6, 0.5, -0.4).normalize();
        let light = beam(sun, Vec3::new(1.0, 2.0, 4.0), 6);
        assert_eq!(light.len(), 36);
        // The mean over the sphere is the illuminance over 4 pi, and nothing is brighter than the beam's own direction.
        let mean = light[0] * 0.282_094_79;
        assert!((mean * (2.0 * TAU) - Vec3::new(1.0, 2.0, 4.0)).abs().max_element() < 1e-4, "{mean}");
        let along = evaluate(&light, sun).x;
        assert!([Vec3::X, Vec3::Y, Vec3::NEG_Z, -sun].iter().all(|w| evaluate(&light, *w).x < 0.6 * along));
    }

    #[test]
    fn a_plant_sees_the_light_turned_the_other_way() {
        let sun = Vec3::new(0.6, 0.5, -0.4).normalize();
        let light: Vec<Vec3> = basis::<16>(sun).map(Vec3::splat).to_vec();
        let turned = turned(&light, 2.0);
        assert_eq!(turned.len(), YAWS * STRIDE);
        for yaw in [0, 1, 64, 200] {
            let row = &turned[yaw * STRIDE..][..STRIDE];
            let codes = row[1..].chunks_exact(3).flat_map(|word| word[0]);
            let row: Vec<f32> = std::iter::once(row[0][0]).chain(codes).collect();
            let in_plant = Vec3::new(0.1, 0.7, 0.7).normalize();
            let in_world = Quat::from_rotation_y(yaw as f32 * TAU / YAWS as f32) * in_plant;
            let expected = 2.0 * evaluate(&light, in_world).x;
            assert!((evaluate(&row[..16], in_plant) - expected).abs() < 1e-4, "{yaw}");
            assert!(row[16..].iter().all(|value| *value == 0.0));
        }
    }
}
