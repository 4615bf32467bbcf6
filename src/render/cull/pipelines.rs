//! The four compute pipelines.

use bevy::{
    ecs::resource::Resource,
    render::render_resource::{CachedComputePipelineId, ComputePipeline, ComputePipelineDescriptor, PipelineCache},
};

use super::layout::list_layout;
use crate::{
    cull::device_lists::SORT_THREADS,
    render::shaders::{CanopyShaders, ShaderFile},
};

/// Bytes that a workgroup shares: 16 counters and a sum for each thread, and one number more.
pub const WORKGROUP_BYTES: u32 = 4 * (17 * SORT_THREADS + 1);
/// Entry points of `shaders/cull/lists.wgsl`, in their order.
const STEPS: [&str; 4] = ["test_clusters", "sort_clusters", "write_trees", "group_trees"];

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
