//! Small helpers over wgpu: buffers that grow, textures with ready-made mip chains.

use bevy::{
    core_pipeline::core_3d::CORE_3D_DEPTH_FORMAT,
    ecs::system::{Res, SystemParam},
    render::{
        render_resource::{
            BindGroup, BindGroupEntry, BindGroupLayoutDescriptor, Buffer, BufferDescriptor, BufferInitDescriptor,
            BufferUsages, CompareFunction, DepthBiasState, DepthStencilState, Extent3d, Origin3d, PipelineCache,
            StencilState, TexelCopyBufferLayout, TexelCopyTextureInfo, Texture, TextureAspect, TextureDescriptor,
            TextureDimension, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor, TextureViewDimension,
        },
        renderer::{RenderDevice, RenderQueue},
    },
};
use bytemuck::Pod;

use super::frame_work::FrameWork;
use crate::math::MipView;

/// The device, its queue and the pipeline cache: what an upload needs.
#[derive(SystemParam)]
pub struct Gpu<'w> {
    /// The device.
    pub device: Res<'w, RenderDevice>,
    /// Its queue.
    pub queue: Res<'w, RenderQueue>,
    /// The cache of layouts and pipelines.
    pub pipelines: Res<'w, PipelineCache>,
    /// Counts what is done through the functions here.
    pub work: Res<'w, FrameWork>,
}

impl Gpu<'_> {
    /// A new buffer.
    pub fn buffer(&self, descriptor: &BufferDescriptor) -> Buffer {
        FrameWork::add(&self.work.allocations, 1);
        self.device.create_buffer(descriptor)
    }

    /// A buffer with `data`; never empty, as empty buffers cannot be bound.
    pub fn filled_buffer<T: Pod>(&self, label: &str, usage: BufferUsages, data: &[T]) -> Buffer {
        FrameWork::add(&self.work.allocations, 1);
        FrameWork::add(&self.work.uploaded_bytes, size_of_val(data) as u64);
        buffer_with(&self.device, label, usage, data)
    }

    /// Writes `bytes` into `buffer` from `offset` on.
    pub fn write(&self, buffer: &Buffer, offset: u64, bytes: &[u8]) {
        FrameWork::add(&self.work.uploaded_bytes, bytes.len() as u64);
        self.queue.write_buffer(buffer, offset, bytes);
    }

    /// A bind group of `layout`.
    pub fn bind_group(&self, label: &str, layout: &BindGroupLayoutDescriptor, entries: &[BindGroupEntry]) -> BindGroup {
        FrameWork::add(&self.work.allocations, 1);
        self.device.create_bind_group(label, &self.pipelines.get_bind_group_layout(layout), entries)
    }
}

/// Bytes between dynamic offsets of uniform buffers that every device allows.
pub const UNIFORM_STRIDE: u64 = 256;

/// A buffer with `data`; never empty, as empty buffers cannot be bound.
pub fn buffer_with<T: Pod>(device: &RenderDevice, label: &str, usage: BufferUsages, data: &[T]) -> Buffer {
    let bytes: &[u8] = bytemuck::cast_slice(data);
    let filled = if bytes.is_empty() { &[0; 64] } else { bytes };
    device.create_buffer_with_data(&BufferInitDescriptor { label: Some(label), usage, contents: filled })
}

/// A uniform buffer of `slots` entries at [`UNIFORM_STRIDE`].
pub fn uniform_slots(device: &RenderDevice, label: &str, slots: u64) -> Buffer {
    device.create_buffer(&BufferDescriptor {
        label: Some(label),
        size: UNIFORM_STRIDE * slots,
        usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// A storage buffer that is replaced by a larger one when a write does not fit.
#[derive(Debug)]
pub struct GrowingBuffer {
    label: &'static str,
    buffer: Buffer,
}

impl GrowingBuffer {
    /// A small buffer under `label`.
    pub fn new(device: &RenderDevice, label: &'static str) -> Self {
        Self { label, buffer: Self::create(device, label, 4096) }
    }

    fn create(device: &RenderDevice, label: &'static str, size: u64) -> Buffer {
        device.create_buffer(&BufferDescriptor {
            label: Some(label),
            size,
            usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// The buffer to bind. It is a new one after a [`write`](Self::write) that returned `true`.
    pub fn buffer(&self) -> &Buffer {
        &self.buffer
    }

    /// Reserves `size` bytes; `true` if the buffer is a new one (and empty).
    pub fn reserve(&mut self, device: &RenderDevice, size: u64) -> bool {
        let grow = size > self.buffer.size();
        if grow {
            self.buffer = Self::create(device, self.label, size.next_power_of_two());
        }
        grow
    }

    /// Writes `data` from the start; `true` if the buffer had to be replaced.
    pub fn write<T: Pod>(&mut self, device: &RenderDevice, queue: &RenderQueue, data: &[T]) -> bool {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let grown = self.reserve(device, bytes.len() as u64);
        if !bytes.is_empty() {
            queue.write_buffer(&self.buffer, 0, bytes);
        }
        grown
    }
}

/// A texture of `size` half-float texels that shaders sample; it is filled again for each new light.
pub fn table(device: &RenderDevice, label: &str, size: (u32, u32)) -> (Texture, TextureView) {
    let texture = device.create_texture(&TextureDescriptor {
        label: Some(label),
        size: Extent3d { width: size.0, height: size.1, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::Rgba16Float,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let view = texture.create_view(&TextureViewDescriptor::default());
    (texture, view)
}

/// Smallest mip of an alpha-tested texture, texels along a side. In a single texel the alpha test is all or nothing:
/// leaves that cover less than half of their texture would vanish in the distance.
pub const SMALLEST_TESTED_MIP: u32 = 8;

/// Number of levels of `mips` down to `smallest` texels along the shorter side (at least one).
pub fn levels_down_to(mips: &MipView, smallest: u32) -> usize {
    let side = mips.width.min(mips.height).max(1);
    let wanted = (side / smallest.max(1)).max(1).ilog2() as usize + 1;
    wanted.min(mips.levels.len().max(1))
}

/// An array of `layers` layers with room for mip chains of the size of `first`, down to `smallest` texels.
pub fn empty_texture_array(
    device: &RenderDevice,
    label: &str,
    format: TextureFormat,
    layers: usize,
    first: Option<&MipView>,
    smallest: u32,
) -> Texture {
    let (width, height, levels) =
        first.map_or((1, 1, 1), |mips| (mips.width.max(1), mips.height.max(1), levels_down_to(mips, smallest)));
    device.create_texture(&TextureDescriptor {
        label: Some(label),
        size: Extent3d { width, height, depth_or_array_layers: layers.max(1) as u32 },
        mip_level_count: levels as u32,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

/// Width and height of a texture's `level` in texels.
pub fn level_size(texture: &Texture, level: u32) -> (u32, u32) {
    ((texture.width() >> level).max(1), (texture.height() >> level).max(1))
}

/// How the bytes of a texture's level are arranged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelRows {
    /// Rows; of blocks, if the texture is compressed.
    pub count: u32,
    /// Bytes of a row.
    pub bytes: usize,
    /// Height of a row in texels: 1, or that of a block.
    pub texels: u32,
}

impl LevelRows {
    /// Those of `level` in `texture`.
    pub fn new(texture: &Texture, level: u32) -> Self {
        let ((width, height), format) = (level_size(texture, level), texture.format());
        let (across, down) = format.block_dimensions();
        let block = format.block_copy_size(None).unwrap_or(4);
        let bytes = width.div_ceil(across) as usize * block as usize;
        Self { count: height.div_ceil(down), bytes, texels: down }
    }

    /// Bytes of all rows.
    pub fn total(&self) -> usize {
        self.count as usize * self.bytes
    }
}

/// Writes all levels that `texture` has of `mips` into one of its layers; levels of another size are skipped.
pub fn write_layer(queue: &RenderQueue, texture: &Texture, layer: u32, mips: &MipView) {
    for (level, bytes) in (0..texture.mip_level_count()).zip(&mips.levels) {
        if bytes.len() == LevelRows::new(texture, level).total() {
            write_rows(queue, texture, layer, level, 0, bytes);
        }
    }
}

/// Writes whole [rows](LevelRows) of a level of `texture`, from the row `top` downwards.
pub fn write_rows(queue: &RenderQueue, texture: &Texture, layer: u32, level: u32, top: u32, bytes: &[u8]) {
    let rows = LevelRows::new(texture, level);
    let ((width, _), count) = (level_size(texture, level), (bytes.len() / rows.bytes.max(1)) as u32);
    queue.write_texture(
        TexelCopyTextureInfo {
            texture,
            mip_level: level,
            origin: Origin3d { x: 0, y: top * rows.texels, z: layer },
            aspect: TextureAspect::All,
        },
        bytes,
        TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(rows.bytes as u32), rows_per_image: Some(count) },
        Extent3d { width, height: count * rows.texels, depth_or_array_layers: 1 },
    );
}

/// A plain texture with one mip chain down to `smallest` texels.
pub fn texture(
    device: &RenderDevice,
    queue: &RenderQueue,
    label: &str,
    format: TextureFormat,
    mips: MipView,
    smallest: u32,
) -> TextureView {
    let texture = empty_texture_array(device, label, format, 1, Some(&mips), smallest);
    write_layer(queue, &texture, 0, &mips);
    texture.create_view(&TextureViewDescriptor { dimension: Some(TextureViewDimension::D2), ..Default::default() })
}

/// Writes one mip level of one layer; `texels` holds `width * height * texel_bytes` bytes.
pub fn write_level(
    queue: &RenderQueue,
    texture: &Texture,
    layer: u32,
    level: u32,
    width: u32,
    height: u32,
    texel_bytes: u32,
    texels: &[u8],
) {
    queue.write_texture(
        TexelCopyTextureInfo {
            texture,
            mip_level: level,
            origin: Origin3d { x: 0, y: 0, z: layer },
            aspect: TextureAspect::All,
        },
        texels,
        TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(width * texel_bytes), rows_per_image: Some(height) },
        Extent3d { width, height, depth_or_array_layers: 1 },
    );
}

/// Depth test and write of opaque passes on the camera's reversed depth.
pub fn opaque_depth() -> DepthStencilState {
    reversed_depth(CORE_3D_DEPTH_FORMAT)
}

/// Test and write of a reversed depth in `format`: nearer is greater.
pub fn reversed_depth(format: TextureFormat) -> DepthStencilState {
    DepthStencilState {
        format,
        depth_write_enabled: Some(true),
        depth_compare: Some(CompareFunction::GreaterEqual),
        stencil: StencilState::default(),
        bias: DepthBiasState::default(),
    }
}
