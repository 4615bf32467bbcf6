//! The bind group of the compute pipelines.

use bevy::render::render_resource::{
    BindGroupLayoutDescriptor, BindGroupLayoutEntries, ShaderStages,
    binding_types::{storage_buffer_read_only_sized, storage_buffer_sized, uniform_buffer_sized},
};
use bytemuck::{Pod, Zeroable};

/// Storage buffers of the compute stage.
pub const STORAGE_BUFFERS: u32 = 8;

/// `ListRoom` of `shaders/cull/lists.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct ListRoom {
    /// Entries of the list.
    pub capacity: u32,
    /// Entries that can be sorted by variant.
    pub staging: u32,
    /// Number of groups of all levels.
    pub group_count: u32,
    /// Number of draw calls.
    pub draw_count: u32,
}

/// Layout of group 0: volume, trees, clusters, sizes, draw calls, work, list, results, room.
pub fn list_layout() -> BindGroupLayoutDescriptor {
    let read = || storage_buffer_read_only_sized(false, None);
    let write = || storage_buffer_sized(false, None);
    let room = std::num::NonZeroU64::new(size_of::<ListRoom>() as u64);
    BindGroupLayoutDescriptor::new(
        "canopy_tree_lists",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (read(), read(), read(), read(), read(), write(), write(), write(), uniform_buffer_sized(false, room)),
        ),
    )
}
