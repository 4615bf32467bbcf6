//! Brings a few words back from the device, without waiting for it.

use std::sync::{
    Arc,
    atomic::{AtomicU8, Ordering},
};

use bevy::render::render_resource::{Buffer, BufferDescriptor, BufferUsages, MapMode};

use crate::render::gpu::Gpu;

/// Nothing is under way.
const IDLE: u8 = 0;
/// A copy was asked for in this frame.
const COPYING: u8 = 1;
/// The device was asked for the copy.
const MAPPING: u8 = 2;
/// The copy can be read.
const READY: u8 = 3;
/// The device refused.
const FAILED: u8 = 4;

/// A buffer that is copied to and then read.
#[derive(Clone)]
pub struct Readback {
    buffer: Buffer,
    state: Arc<AtomicU8>,
}

impl Readback {
    /// A buffer of so many words.
    pub fn new(gpu: &Gpu, words: usize) -> Self {
        let buffer = gpu.buffer(&BufferDescriptor {
            label: Some("canopy_list_counts"),
            size: 4 * words.max(1) as u64,
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        Self { buffer, state: Arc::new(AtomicU8::new(IDLE)) }
    }

    /// The buffer to copy to, unless an earlier copy is still under way.
    pub fn begin(&self) -> Option<&Buffer> {
        let begun = self.state.compare_exchange(IDLE, COPYING, Ordering::AcqRel, Ordering::Acquire);
        begun.is_ok().then_some(&self.buffer)
    }

    /// Asks the device for the copy, after the frame that makes it was submitted.
    pub fn map(&self) {
        if self.state.compare_exchange(COPYING, MAPPING, Ordering::AcqRel, Ordering::Acquire).is_err() {
            return;
        }
        let state = self.state.clone();
        self.buffer.slice(..).map_async(MapMode::Read, move |outcome| {
            state.store(if outcome.is_ok() { READY } else { FAILED }, Ordering::Release);
        });
    }

    /// The words, once they are here. Each copy is returned once.
    pub fn take(&self) -> Option<Vec<u32>> {
        let state = self.state.load(Ordering::Acquire);
        if state == FAILED {
            self.state.store(IDLE, Ordering::Release);
        }
        if state != READY {
            return None;
        }
        let words = bytemuck::pod_collect_to_vec(&self.buffer.slice(..).get_mapped_range());
        self.buffer.unmap();
        self.state.store(IDLE, Ordering::Release);
        Some(words)
    }
}
