//! Lists of drawn trees, made on the device: which trees a view or a cascade draws, in which level, and the draw calls for
//! them.
//!
//! ```text
//! volume (some 600 bytes a view) ─┐
//! trees, clusters of a page ──────┴─> test_clusters   one thread a cluster: seen? whole or tree by tree? how many per level?
//!                                     sort_clusters   one workgroup: radix sort by 12-bit keys, prefix sums of the trees
//!                                     write_trees     one thread a seen cluster: indices of its trees to where they belong
//!                                     group_trees     one workgroup: near levels sorted by variant; ranges; draw calls
//!                                         └─> list, ranges, arguments of indirect draws
//! ```
//!
//! There are no atomics: every place in a list follows from prefix sums [Hillis and Steele 1986; Blelloch 1990] and stable
//! sorting, so that the lists are the same in every run, and equal to those of [`cull::select`](crate::cull::select)
//! element by element. What can be seen is decided in whole numbers on both sides ([`Volume`](crate::cull::Volume)).
//!
//! Cost: for one list, three words a cluster and level beside the list itself; four dispatches. The processor uploads a
//! volume for each list and records the dispatches, whatever the number of trees. Nothing is done for a volume that has
//! not changed.
//!
//! Limits: needs compute shaders, eight storage buffers in a stage and indirect draws with a first instance; where one is
//! missing the processor makes the lists, which [`FrameReport`](super::report::FrameReport) says ("tree lists"). The
//! numbers of trees come back a frame late or later.

mod draws;
mod jobs;
mod layout;
mod list;
mod maker;
mod pass;
mod pipelines;
mod readback;

use bevy::{
    app::{App, Plugin},
    core_pipeline::schedule::camera_driver,
    ecs::schedule::IntoScheduleConfigs,
    render::{GpuResourceAppExt, Render, RenderApp, RenderSystems, renderer::RenderGraph},
};

use super::{frame_work::FrameWork, sets::CanopyRenderSystems};
pub use draws::{DrawTable, TreeDraw, TreeDrawWords, TreeVertices};
pub use jobs::{CountCopy, CullJob, CullJobs};
pub use layout::ListRoom;
pub use list::{ListCounts, ListSources, TreeList};
pub use maker::{ListMaker, unavailable};
pub use readback::Readback;

/// Makes lists of trees on the device.
pub struct CullPlugin;

impl Plugin for CullPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_resource::<ListMaker>()
            .init_resource::<FrameWork>()
            .init_gpu_resource::<CullJobs>()
            .init_gpu_resource::<pipelines::ListPipelines>()
            .add_systems(
                Render,
                (maker::choose_maker.in_set(CanopyRenderSystems::View), pass::read_back.in_set(RenderSystems::Cleanup)),
            )
            .add_systems(RenderGraph, pass::make_lists.before(camera_driver));
    }
}
