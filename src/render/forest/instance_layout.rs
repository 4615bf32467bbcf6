//! The layout of group 1 of everything that draws trees.

use bevy::render::render_resource::{
    BindGroupLayoutDescriptor, BindGroupLayoutEntries, ShaderStages,
    binding_types::{storage_buffer_read_only_sized, uniform_buffer_sized},
};

use super::uniforms::ForestViewUniform;

/// Layout of group 1: uniform with dynamic offset, trees, indices of the drawn ones, plants.
pub fn instance_layout() -> BindGroupLayoutDescriptor {
    BindGroupLayoutDescriptor::new(
        "canopy_instances",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::VERTEX,
            (
                uniform_buffer_sized(true, std::num::NonZeroU64::new(size_of::<ForestViewUniform>() as u64))
                    .visibility(ShaderStages::VERTEX_FRAGMENT),
                storage_buffer_read_only_sized(false, None),
                storage_buffer_read_only_sized(false, None),
                storage_buffer_read_only_sized(false, None).visibility(ShaderStages::VERTEX_FRAGMENT),
            ),
        ),
    )
}
