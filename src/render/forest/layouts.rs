//! Bind group layouts and samplers of everything that draws trees.

use bevy::{
    ecs::{
        resource::Resource,
        world::{FromWorld, World},
    },
    render::{
        render_resource::{
            AddressMode, BindGroupLayoutDescriptor, BindGroupLayoutEntries, FilterMode, MipmapFilterMode, Sampler,
            SamplerBindingType, SamplerDescriptor, ShaderStages, TextureSampleType,
            binding_types::{
                sampler, storage_buffer_read_only_sized, texture_2d, texture_2d_array, uniform_buffer_sized,
            },
        },
        renderer::RenderDevice,
    },
};

use super::{
    transfer::TransferUniform,
    uniforms::{ForestViewUniform, PartUniform},
};

/// Bind group layouts of everything that draws trees.
#[derive(Resource)]
pub struct ForestLayouts {
    /// Group 1: instances.
    pub instances: BindGroupLayoutDescriptor,
    /// Group 2 of full models.
    pub part: BindGroupLayoutDescriptor,
    /// Group 2 of crosses.
    pub cross: BindGroupLayoutDescriptor,
    /// Group 3 of crosses of which some are lit by radiance transfer.
    pub cross_light: BindGroupLayoutDescriptor,
    /// Group 3: radiance transfer.
    pub transfer: BindGroupLayoutDescriptor,
    /// Of the pictures of full models, which repeat.
    pub(super) part_sampler: Sampler,
    /// Of the pictures of crosses, which do not.
    pub(super) cross_sampler: Sampler,
}

impl FromWorld for ForestLayouts {
    fn from_world(world: &mut World) -> Self {
        let device = world.resource::<RenderDevice>();
        let float = TextureSampleType::Float { filterable: true };
        let part_sampler = |address| {
            device.create_sampler(&SamplerDescriptor {
                label: Some("canopy_plant"),
                address_mode_u: address,
                address_mode_v: address,
                mag_filter: FilterMode::Linear,
                min_filter: FilterMode::Linear,
                mipmap_filter: MipmapFilterMode::Linear,
                ..Default::default()
            })
        };
        Self {
            instances: BindGroupLayoutDescriptor::new(
                "canopy_instances",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::VERTEX,
                    (
                        uniform_buffer_sized(true, std::num::NonZeroU64::new(size_of::<ForestViewUniform>() as u64)),
                        storage_buffer_read_only_sized(false, None),
                        storage_buffer_read_only_sized(false, None),
                        storage_buffer_read_only_sized(false, None).visibility(ShaderStages::VERTEX_FRAGMENT),
                    ),
                ),
            ),
            part: BindGroupLayoutDescriptor::new(
                "canopy_plant_part",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::FRAGMENT,
                    (
                        texture_2d(float),
                        texture_2d(float),
                        sampler(SamplerBindingType::Filtering),
                        uniform_buffer_sized(false, std::num::NonZeroU64::new(size_of::<PartUniform>() as u64)),
                    ),
                ),
            ),
            cross: BindGroupLayoutDescriptor::new(
                "canopy_cross",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::FRAGMENT,
                    (texture_2d_array(float), texture_2d_array(float), sampler(SamplerBindingType::Filtering)),
                ),
            ),
            cross_light: BindGroupLayoutDescriptor::new(
                "canopy_cross_light",
                &BindGroupLayoutEntries::single(ShaderStages::FRAGMENT, texture_2d_array(float)),
            ),
            transfer: BindGroupLayoutDescriptor::new(
                "canopy_transfer",
                &BindGroupLayoutEntries::sequential(
                    ShaderStages::VERTEX,
                    (
                        storage_buffer_read_only_sized(false, None),
                        storage_buffer_read_only_sized(false, None),
                        storage_buffer_read_only_sized(
                            false,
                            std::num::NonZeroU64::new(size_of::<TransferUniform>() as u64),
                        ),
                    ),
                ),
            ),
            part_sampler: part_sampler(AddressMode::Repeat),
            cross_sampler: part_sampler(AddressMode::ClampToEdge),
        }
    }
}
