//! The four compute pipelines and their bind group.

use bevy::{
    ecs::resource::Resource,
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId, ComputePipeline,
        ComputePipelineDescriptor, PipelineCache, ShaderStages,
        binding_types::{storage_buffer_read_only_sized, storage_buffer_sized, uniform_buffer_sized},
    },
};

use super::list::ListRoom;
use crate::{
    cull::device_lists::SORT_THREADS,
    render::shaders::{CanopyShaders, ShaderFile},
};

/// Storage buffers of the compute stage.
pub const STORAGE_BUFFERS: u32 = 8;
/// Bytes that a workgroup shares: 16 counters and a sum for each thread, and one number more.
pub const WORKGROUP_BYTES: u32 = 4 * (17 * SORT_THREADS + 1);
/// Entry points of `shaders/cull/lists.wgsl`, in their order.
const STEPS: [&str; 4] = ["test_clusters", "sort_clusters", "write_trees", "group_trees"];

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

/// The pipelines, requested when lists are first made on the device.
#[derive(Resource, Default)]
pub struct ListPipelines(Vec<CachedComputePipelineId>);

impl ListPipelines {
    /// Requests the pipelines; whether all of them are ready.
    pub fn request(&mut self, shaders: &CanopyShaders, cache: &PipelineCache) -> bool {
        if self.0.is_empty() {
            let queue = |entry: &'static str| {
                cache.queue_compute_pipeline(ComputePipelineDescriptor {
                    label: Some(format!("canopy_{entry}").into()),
                    layout: vec![list_layout()],
                    shader: shaders.get(ShaderFile::CullLists),
                    entry_point: Some(entry.into()),
                    zero_initialize_workgroup_memory: false,
                    ..Default::default()
                })
            };
            self.0 = STEPS.into_iter().map(queue).collect();
        }
        self.0.iter().all(|id| cache.get_compute_pipeline(*id).is_some())
    }

    /// The pipelines in the order of their steps, if all are ready.
    pub fn ready<'a>(&self, cache: &'a PipelineCache) -> Option<Vec<&'a ComputePipeline>> {
        let pipelines: Option<Vec<_>> = self.0.iter().map(|id| cache.get_compute_pipeline(*id)).collect();
        pipelines.filter(|pipelines| pipelines.len() == STEPS.len())
    }
}
