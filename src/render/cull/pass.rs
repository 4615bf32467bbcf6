//! Records the dispatches of a frame.

use bevy::{
    ecs::system::{Res, ResMut},
    render::{
        render_resource::{ComputePassDescriptor, PipelineCache},
        renderer::RenderContext,
    },
};

use super::{jobs::CullJobs, pipelines::ListPipelines};
use crate::{cull::device_lists::TEST_THREADS, render::frame_work::FrameWork};

/// Makes the lists, step by step, all lists in each step.
pub fn make_lists(
    jobs: Res<CullJobs>,
    pipelines: Res<ListPipelines>,
    cache: Res<PipelineCache>,
    work: Res<FrameWork>,
    mut ctx: RenderContext,
) {
    let Some(pipelines) = pipelines.ready(&cache).filter(|_| !jobs.0.is_empty()) else { return };
    let encoder = ctx.command_encoder();
    let mut pass =
        encoder.begin_compute_pass(&ComputePassDescriptor { label: Some("canopy_tree_lists"), timestamp_writes: None });
    for (step, pipeline) in pipelines.into_iter().enumerate() {
        pass.set_pipeline(pipeline);
        for job in &jobs.0 {
            pass.set_bind_group(0, &*job.bind_group, &[]);
            // Steps 0 and 2 have a thread for each cluster, 1 and 3 one workgroup.
            let groups = if step % 2 == 0 { job.clusters.div_ceil(TEST_THREADS) } else { 1 };
            pass.dispatch_workgroups(groups, 1, 1);
            FrameWork::add(&work.commands, 1);
        }
    }
    drop(pass);
    for copy in jobs.0.iter().filter_map(|job| job.copy.as_ref()) {
        encoder.copy_buffer_to_buffer(&copy.results, 0, &copy.target, 0, copy.bytes);
        FrameWork::add(&work.commands, 1);
    }
}

/// Asks for the copies of the frame that was submitted.
pub fn read_back(mut jobs: ResMut<CullJobs>) {
    for job in jobs.0.drain(..) {
        if let Some(copy) = job.copy {
            copy.readback.map();
        }
    }
}
