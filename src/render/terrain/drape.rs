//! The photograph over the ground on the device.

use std::sync::Arc;

use bevy::render::{
    render_resource::{
        AddressMode, BindGroupEntry, Buffer, BufferUsages, FilterMode, IntoBinding, MipmapFilterMode, Sampler,
        SamplerDescriptor, TextureFormat, TextureView,
    },
    renderer::{RenderDevice, RenderQueue},
};
use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::{
    math::MipView,
    render::{components::GroundDrape, gpu},
    terrain::Drape,
};

/// `Drape` of `shaders/terrain/terrain.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct DrapeUniform {
    /// North-western corner relative to the camera (x, z), metres.
    pub origin: [f32; 2],
    /// Inverse of width and depth, 1/m.
    pub inverse_size: [f32; 2],
    /// Metres over which it gives way to the ground at its border.
    pub edge: f32,
    /// Metres of a texel.
    pub texel: f32,
    /// Factor from its values to reflectance.
    pub brightness: f32,
    /// 1 where it is mirrored at its borders, else 0.
    pub mirrored: f32,
}

/// A photograph on the device.
pub struct GpuDrape {
    source: Arc<Drape>,
    texture: TextureView,
    sampler: Sampler,
    uniform: Buffer,
    /// Metres of a texel of its finest level here.
    texel: f32,
}

impl GpuDrape {
    /// Uploads a photograph: its finest level that the device can hold, and all below.
    pub fn new(device: &RenderDevice, queue: &RenderQueue, source: &Arc<Drape>) -> Self {
        let mips = source.mips();
        let most = device.limits().max_texture_dimension_2d;
        let fits = |level: &usize| {
            let (width, height) = mips.level_size(*level);
            width.max(height) <= most
        };
        let first = (0..mips.levels.len()).find(fits).unwrap_or(0);
        let (width, height) = mips.level_size(first);
        let levels = mips.levels[first..].iter().map(Vec::as_slice).collect();
        let texture = gpu::texture(
            device,
            queue,
            "canopy_drape",
            TextureFormat::Rgba8UnormSrgb,
            MipView { width, height, levels },
            1,
        );
        let address = if source.is_mirrored() { AddressMode::MirrorRepeat } else { AddressMode::ClampToEdge };
        let sampler = device.create_sampler(&SamplerDescriptor {
            label: Some("canopy_drape"),
            address_mode_u: address,
            address_mode_v: address,
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            mipmap_filter: MipmapFilterMode::Linear,
            ..Default::default()
        });
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let uniform = gpu::buffer_with(device, "canopy_drape", usage, &[DrapeUniform::default()]);
        let texel = (source.texel() * f64::from(1u32 << first)) as f32;
        Self { source: source.clone(), texture, sampler, uniform, texel }
    }

    /// Whether it is the photograph `drape`.
    pub fn is_of(&self, drape: &GroundDrape) -> bool {
        Arc::ptr_eq(&self.source, &drape.drape)
    }

    /// Places it for a camera at `camera` (metres from the terrain's own origin).
    pub fn place(&self, queue: &RenderQueue, camera: DVec3, brightness: f32) {
        let (min, extent) = (self.source.min(), self.source.extent());
        let uniform = DrapeUniform {
            origin: [(min.x - camera.x) as f32, (min.y - camera.z) as f32],
            inverse_size: [(1.0 / extent.x) as f32, (1.0 / extent.y) as f32],
            edge: self.source.edge() as f32,
            texel: self.texel,
            brightness: if brightness.is_finite() { brightness.clamp(0.0, 4.0) } else { 0.0 },
            mirrored: if self.source.is_mirrored() { 1.0 } else { 0.0 },
        };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
    }

    /// The entries of the terrain's group, from `first` on.
    pub fn entries(&self, first: u32) -> [BindGroupEntry<'_>; 3] {
        [
            BindGroupEntry { binding: first, resource: self.uniform.as_entire_binding() },
            BindGroupEntry { binding: first + 1, resource: self.texture.into_binding() },
            BindGroupEntry { binding: first + 2, resource: self.sampler.into_binding() },
        ]
    }
}
