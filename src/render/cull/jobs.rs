//! The lists that the device makes in a frame.

use bevy::{
    ecs::resource::Resource,
    render::render_resource::{BindGroup, Buffer},
};

use super::readback::Readback;

/// A list to make in this frame.
pub struct CullJob {
    /// Group 0.
    pub bind_group: BindGroup,
    /// Number of clusters.
    pub clusters: u32,
    /// The copy of its counts; `None` while an earlier one is on its way.
    pub copy: Option<CountCopy>,
}

/// A copy of the counts of a list, for the processor.
pub struct CountCopy {
    /// The results of the list.
    pub results: Buffer,
    /// How many bytes of them.
    pub bytes: u64,
    /// Where to.
    pub target: Buffer,
    /// Who reads it.
    pub readback: Readback,
}

/// The lists to make in this frame.
#[derive(Resource, Default)]
pub struct CullJobs(pub Vec<CullJob>);
