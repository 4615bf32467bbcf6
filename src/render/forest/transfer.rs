//! Radiance transfer on the GPU: a part's coefficients, and the light per yaw.
//!
//! A packed tree has one of 256 yaws, so the light is rotated into all of them at once when it changes, exactly and at
//! any band. A vertex then needs only two dot products, four coefficients at a time. If no plant is lit by radiance
//! transfer, there is no buffer and no binding, and nothing is computed.
//!
//! A plant can receive the sun the same way [Franzke 2005, 4.3.3], unless it has [`SunLight::LeafShader`]: the sun's light is a second
//! set of 256 rows. It is neither computed nor uploaded while no plant needs it, and costs a vertex two more dot
//! products.

use std::{f32::consts::TAU, sync::Arc};

use bevy::{
    ecs::resource::Resource,
    render::render_resource::{
        BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer, BufferDescriptor,
        BufferUsages, ShaderStages, binding_types::storage_buffer_read_only_sized,
    },
};
use glam::Vec3;

use super::uniforms::{TransferUniform, WORDS};
use crate::{
    bake::lighting::transfer::{PackedPart, TransferSettings},
    light::{
        LightState,
        sh::{basis_into, rotate_y},
    },
    render::{
        components::SunLight,
        gpu::{Gpu, buffer_with},
    },
    scatter::packed::YAW_BITS,
};

/// Yaws of a packed tree.
pub const YAWS: usize = 1 << YAW_BITS;
/// Number of vectors per yaw: the first coefficient, then red, green and blue of each word.
pub const STRIDE: usize = 1 + 3 * WORDS;
/// Bytes of one light, rotated into all yaws.
pub const SET_BYTES: u64 = (YAWS * STRIDE * size_of::<[f32; 4]>()) as u64;

/// Layout of group 3: the rotated light, the part's coefficients, their layout.
pub fn transfer_layout() -> BindGroupLayoutDescriptor {
    BindGroupLayoutDescriptor::new(
        "canopy_transfer",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::VERTEX,
            (
                storage_buffer_read_only_sized(false, None),
                storage_buffer_read_only_sized(false, None),
                storage_buffer_read_only_sized(false, std::num::NonZeroU64::new(size_of::<TransferUniform>() as u64)),
            ),
        ),
    )
}

/// The current light, rotated into each yaw.
#[derive(Resource, Default)]
pub struct TransferLight {
    /// The rotated light; `None` until a plant needs it.
    pub buffer: Option<Buffer>,
    /// What plants need of it.
    pub wanted: Wanted,
    /// The light, exposure and needs for which the buffer was uploaded.
    pub uploaded: Option<(Arc<LightState>, f32, Wanted)>,
}

/// What plants need of the rotated light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Maximum number of bands.
    pub bands: usize,
    /// Whether the sun's light is needed too.
    pub sun: bool,
}

impl TransferLight {
    /// Group 3 of a part; `tint`: the colour of light scattered between leaves ([`indirect_light_color`]), `coefficients`:
    /// a buffer of the part's bytes.
    pub fn bind_group(
        &mut self,
        (settings, part): (&TransferSettings, &PackedPart),
        tint: Vec3,
        sun: SunLight,
        coefficients: &Buffer,
        gpu: &Gpu,
    ) -> BindGroup {
        self.wanted.bands = self.wanted.bands.max(settings.bands.into());
        self.wanted.sun |= sun != SunLight::LeafShader;
        let light = self.buffer.get_or_insert_with(|| {
            gpu.device.create_buffer(&BufferDescriptor {
                label: Some("canopy_rotated_light"),
                // Sky and sun.
                size: 2 * SET_BYTES,
                usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        let uniform = [TransferUniform::new(settings, part, tint)];
        let uniform = buffer_with(&gpu.device, "canopy_transfer_layout", BufferUsages::STORAGE, &uniform);
        gpu.bind_group(
            "canopy_transfer",
            &transfer_layout(),
            &BindGroupEntries::sequential((
                light.as_entire_binding(),
                coefficients.as_entire_binding(),
                uniform.as_entire_binding(),
            )),
        )
    }
}

/// Coefficients of light that comes from one direction (unit), `illuminance` lux on what faces it.
pub fn beam(direction: Vec3, illuminance: Vec3, bands: usize) -> Vec<Vec3> {
    let mut basis = vec![0.0; bands * bands];
    basis_into(direction, &mut basis);
    basis.into_iter().map(|value| illuminance * value).collect()
}

/// `light` rotated into the frame of a plant of each yaw, times `exposure`; zeros beyond its bands.
pub fn rotated(light: &[Vec3], exposure: f32) -> Vec<[f32; 4]> {
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
    fn a_plant_sees_the_light_rotated_the_other_way() {
        let sun = Vec3::new(0.6, 0.5, -0.4).normalize();
        let light: Vec<Vec3> = basis::<16>(sun).map(Vec3::splat).to_vec();
        let rotated = rotated(&light, 2.0);
        assert_eq!(rotated.len(), YAWS * STRIDE);
        for yaw in [0, 1, 64, 200] {
            let row = &rotated[yaw * STRIDE..][..STRIDE];
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
