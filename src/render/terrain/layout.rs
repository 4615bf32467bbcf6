//! Bind group layout and shader definitions of the terrain pass.

use std::num::NonZeroU64;

use bevy::{
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntries, SamplerBindingType, ShaderStages, TextureSampleType,
        binding_types::{sampler, storage_buffer_read_only_sized, texture_2d, uniform_buffer_sized},
    },
    shader::ShaderDefVal,
};

use super::drape::DrapeUniform;

/// Shader definition of ground with a photograph over it.
pub const DRAPE: &str = "DRAPE";
/// Shader definition of ground with far forest as a surface over it.
pub const FOREST_SURFACE: &str = "FOREST_SURFACE";
/// Shader definition of ground whose shadows have soft edges.
const SOFT_SHADOW: &str = "SOFT_SHADOW";

/// Group 1: vertices, tiles; with a photograph over them also its place, its texture and how it is sampled.
pub fn terrain_layout(draped: bool) -> BindGroupLayoutDescriptor {
    let tiles = || (storage_buffer_read_only_sized(false, None), storage_buffer_read_only_sized(false, None));
    let stages = ShaderStages::VERTEX_FRAGMENT;
    if !draped {
        return BindGroupLayoutDescriptor::new("canopy_terrain", &BindGroupLayoutEntries::sequential(stages, tiles()));
    }
    let photograph = (
        uniform_buffer_sized(false, NonZeroU64::new(size_of::<DrapeUniform>() as u64)),
        texture_2d(TextureSampleType::Float { filterable: true }),
        sampler(SamplerBindingType::Filtering),
    );
    let ((vertices, tiles), (place, texture, sampler)) = (tiles(), photograph);
    let entries = BindGroupLayoutEntries::sequential(stages, (vertices, tiles, place, texture, sampler));
    BindGroupLayoutDescriptor::new("canopy_draped_terrain", &entries)
}

/// What the ground has beyond itself: what its layout and its shader definitions depend on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct GroundFeatures {
    /// A photograph lies over it.
    pub draped: bool,
    /// Far forest is drawn as a surface over it.
    pub forest_surface: bool,
    /// Shadows on it have soft edges; not in styles, which have their own.
    pub soft_shadow: bool,
}

impl GroundFeatures {
    /// The shader definitions.
    pub fn defs(self) -> Vec<ShaderDefVal> {
        let defs = [(DRAPE, self.draped), (FOREST_SURFACE, self.forest_surface), (SOFT_SHADOW, self.soft_shadow)];
        defs.into_iter().filter(|(_, wanted)| *wanted).map(|(name, _)| name.into()).collect()
    }
}
