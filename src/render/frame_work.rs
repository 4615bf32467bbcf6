//! What the processor did for the forests of a frame.

use std::sync::atomic::{AtomicU64, Ordering};

use bevy::ecs::resource::Resource;

/// What the processor had to do for the forests of the frames so far: it must not grow with the number of trees.
#[derive(Resource, Debug, Default)]
pub struct FrameWork {
    /// Bytes written to the device.
    pub uploaded_bytes: AtomicU64,
    /// Dispatches and draw calls recorded.
    pub commands: AtomicU64,
    /// Buffers and bind groups created.
    pub allocations: AtomicU64,
    /// Trees that were listed on the processor.
    pub listed_trees: AtomicU64,
}

impl FrameWork {
    /// Counts `amount` more.
    pub fn add(counter: &AtomicU64, amount: u64) {
        counter.fetch_add(amount, Ordering::Relaxed);
    }

    /// The counters in the order of the members, which begin at 0 again.
    pub fn take(&self) -> [u64; 4] {
        [&self.uploaded_bytes, &self.commands, &self.allocations, &self.listed_trees]
            .map(|counter| counter.swap(0, Ordering::Relaxed))
    }
}
