//! What a forest writes to the device: at once, or a bounded share of it in each frame.
//!
//! An upload creates its buffers and textures empty, and notes how they are filled. Each note shares the plants and trees
//! by `Arc` and copies nothing before its turn.

use std::{collections::VecDeque, sync::Arc};

use bevy::render::{
    render_resource::{
        BindGroup, Buffer, BufferDescriptor, BufferUsages, COPY_BUFFER_ALIGNMENT, Texture, TextureFormat, TextureView,
        TextureViewDescriptor, TextureViewDimension,
    },
    renderer::RenderQueue,
};
use bytemuck::Pod;
use glam::Vec3;

use super::transfer::TransferLight;
use crate::{
    bake::lighting::BakedLighting,
    math::MipView,
    render::{
        components::SunLight,
        gpu::{self, Gpu},
    },
};

/// Bytes that a frame writes for forests that arrive over several frames, up to the write that exceeds them: two
/// milliseconds on a software driver, less on a device.
pub const BYTES_PER_FRAME: u64 = 8 << 20;
/// Bytes of the largest write, where a single row of a texture is not larger.
const LARGEST_WRITE: usize = 4 << 20;
/// Size of a buffer without data: empty ones cannot be bound.
const SMALLEST_BUFFER: u64 = 64;

/// Writes that wait for their frame.
#[derive(Default)]
pub struct DeviceWrites {
    waiting: VecDeque<DeviceWrite>,
    done: u64,
    total: u64,
}

struct DeviceWrite {
    bytes: u64,
    write: Box<dyn FnOnce(&RenderQueue) + Send + Sync>,
}

impl DeviceWrites {
    /// Adds a write of so many bytes after those that wait already.
    pub fn add(&mut self, bytes: u64, write: impl FnOnce(&RenderQueue) + Send + Sync + 'static) {
        self.total += bytes;
        self.waiting.push_back(DeviceWrite { bytes, write: Box::new(write) });
    }

    /// Carries out the first writes while `budget` lasts, and takes their bytes from it.
    pub fn run(&mut self, queue: &RenderQueue, budget: &mut u64) {
        while *budget > 0
            && let Some(next) = self.waiting.pop_front()
        {
            (next.write)(queue);
            self.done += next.bytes;
            *budget = budget.saturating_sub(next.bytes);
        }
    }

    /// Whether nothing waits.
    pub fn are_done(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Bytes that are written, and bytes of all writes.
    pub fn progress(&self) -> (u64, u64) {
        (self.done, self.total)
    }
}

/// The texture arrays of a forest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TextureArrays {
    /// Whether textures that have blocks are uploaded in blocks.
    pub wanted: bool,
    /// Arrays that are in blocks.
    pub in_blocks: usize,
    /// All arrays.
    pub all: usize,
}

impl TextureArrays {
    /// Counts an array.
    pub fn add(&mut self, in_blocks: bool) {
        self.in_blocks += usize::from(in_blocks);
        self.all += 1;
    }
}

/// The resources that an upload writes to. What it makes by its own methods is filled over several frames if the program
/// lets forests arrive so ([`ForestUpdates`](crate::render::components::ForestUpdates)), and a forest is drawn once all of
/// it is there. What a renderer writes to the device itself is written at once.
pub struct ForestUpload<'a, 'w> {
    /// The device.
    pub gpu: &'a Gpu<'w>,
    /// The light for radiance transfer, which records what plants need of it.
    pub transfer: &'a mut TransferLight,
    /// What is still to be written.
    pub writes: &'a mut DeviceWrites,
    /// What becomes of the textures of levels.
    pub textures: TextureArrays,
}

impl ForestUpload<'_, '_> {
    /// A buffer for the `count` values that `values` returns when it is their turn.
    pub fn buffer<T: Pod>(
        &mut self,
        label: &str,
        usage: BufferUsages,
        count: usize,
        values: impl FnOnce() -> Vec<T> + Send + Sync + 'static,
    ) -> Buffer {
        let size = (count * size_of::<T>()) as u64;
        let buffer = self.empty_buffer(label, usage, size);
        if size > 0 {
            let target = buffer.clone();
            self.writes.add(size, move |queue| {
                let mut bytes: Vec<u8> = bytemuck::cast_slice(&values()).to_vec();
                bytes.resize(target.size() as usize, 0);
                queue.write_buffer(&target, 0, &bytes);
            });
        }
        buffer
    }

    /// A buffer for the values that `values` finds in `owner`, written in pieces.
    pub fn shared_buffer<O: Send + Sync + 'static, T: Pod>(
        &mut self,
        label: &str,
        usage: BufferUsages,
        owner: &Arc<O>,
        values: fn(&O) -> &[T],
    ) -> Buffer {
        let size = size_of_val(values(owner));
        let buffer = self.empty_buffer(label, usage, size as u64);
        for start in (0..size).step_by(LARGEST_WRITE) {
            let range = start..size.min(start + LARGEST_WRITE);
            let (target, owner) = (buffer.clone(), Arc::clone(owner));
            self.writes.add(range.len() as u64, move |queue| {
                if let Some(bytes) = bytemuck::cast_slice::<T, u8>(values(&owner)).get(range) {
                    queue.write_buffer(&target, start as u64, bytes);
                }
            });
        }
        buffer
    }

    /// A texture array of `layers` layers that `layer` finds in `owner`, with their mip chains in `format` down to `smallest`
    /// texels. All chains have the size of the first; levels of another size are skipped.
    pub fn texture_array<O: Clone + Send + Sync + 'static>(
        &mut self,
        label: &str,
        format: TextureFormat,
        layers: usize,
        smallest: u32,
        owner: &O,
        layer: for<'a> fn(&'a O, usize) -> Option<MipView<'a>>,
    ) -> (Texture, TextureView) {
        let first = layer(owner, 0);
        let texture = gpu::empty_texture_array(&self.gpu.device, label, format, layers, first.as_ref(), smallest);
        for index in 0..layers {
            let Some(mips) = layer(owner, index) else { continue };
            for (level, texels) in (0..texture.mip_level_count()).zip(mips.levels) {
                let rows = gpu::LevelRows::new(&texture, level);
                if texels.len() != rows.total() {
                    continue;
                }
                let share = (LARGEST_WRITE / rows.bytes).max(1);
                for top in (0..rows.count).step_by(share) {
                    let bytes = top as usize * rows.bytes..texels.len().min((top as usize + share) * rows.bytes);
                    let (target, owner) = (texture.clone(), owner.clone());
                    self.writes.add(bytes.len() as u64, move |queue| {
                        let mips = layer(&owner, index);
                        let texels = mips.as_ref().and_then(|mips| mips.levels.get(level as usize)?.get(bytes));
                        if let Some(texels) = texels {
                            gpu::write_rows(queue, &target, index as u32, level, top, texels);
                        }
                    });
                }
            }
        }
        let array = TextureViewDescriptor { dimension: Some(TextureViewDimension::D2Array), ..Default::default() };
        let view = texture.create_view(&array);
        (texture, view)
    }

    /// Group 3 of a part that is lit by radiance transfer; `None` for other parts. `tint`: the colour of light scattered
    /// between leaves.
    pub fn transfer_group(
        &mut self,
        lighting: &Arc<BakedLighting>,
        part: usize,
        tint: Vec3,
        sun: SunLight,
    ) -> Option<BindGroup> {
        let (settings, packed) = lighting.transfer(part)?;
        let owner = Arc::clone(lighting);
        let coefficients = self.buffer(
            "canopy_transfer",
            BufferUsages::STORAGE,
            packed.bytes.len() + packed.indirect_sun.len(),
            move || {
                let packed = owner.transfer(part).map(|(_, packed)| packed);
                packed.map_or_else(Vec::new, |part| [part.bytes.as_slice(), part.indirect_sun.as_slice()].concat())
            },
        );
        Some(self.transfer.bind_group((settings, packed), tint, sun, &coefficients, self.gpu))
    }

    fn empty_buffer(&self, label: &str, usage: BufferUsages, size: u64) -> Buffer {
        self.gpu.device.create_buffer(&BufferDescriptor {
            label: Some(label),
            size: if size == 0 { SMALLEST_BUFFER } else { size.next_multiple_of(COPY_BUFFER_ALIGNMENT) },
            usage: usage | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }
}
