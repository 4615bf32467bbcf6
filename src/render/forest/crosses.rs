//! Crosses on the GPU: their pictures, and how the sky's light reaches them.

use bevy::render::{
    render_resource::{BindGroup, BindGroupEntries, PipelineCache, Texture, TextureFormat},
    renderer::{RenderDevice, RenderQueue},
};

use super::layouts::ForestLayouts;
use crate::{bake::BakedPlant, math::MipChain, render::gpu};

/// How the sky's light reaches the crosses of a forest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CrossLight {
    /// All by normal and k_a.
    Plain,
    /// Some by lighting pictures.
    Mixed,
    /// All by lighting pictures.
    Pictures,
}

impl CrossLight {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Plain, Self::Mixed, Self::Pictures];

    /// That of crosses of these plants.
    pub fn of(plants: &[BakedPlant]) -> Self {
        let lit = plants.iter().filter(|plant| !plant.cross.textures.light.is_empty()).count();
        match lit {
            0 => Self::Plain,
            all if all == plants.len() => Self::Pictures,
            _ => Self::Mixed,
        }
    }
}

/// The pictures of all crosses: the texture of their properties, and both kinds in a bind group.
pub fn upload_crosses(
    plants: &[BakedPlant],
    layouts: &ForestLayouts,
    device: &RenderDevice,
    queue: &RenderQueue,
    pipelines: &PipelineCache,
) -> (Texture, BindGroup) {
    let colors: Vec<&MipChain> = plants.iter().flat_map(|plant| &plant.cross.textures.color).collect();
    let properties: Vec<&MipChain> = plants.iter().flat_map(|plant| &plant.cross.textures.properties).collect();
    let upload = |label: &str, format: TextureFormat, layers: &[&MipChain]| {
        gpu::texture_array(device, queue, label, format, layers, gpu::SMALLEST_TESTED_MIP)
    };
    let (_, colors) = upload("canopy_cross_color", TextureFormat::Rgba8UnormSrgb, &colors);
    let (texture, properties) = upload("canopy_cross_properties", TextureFormat::Rgba8Unorm, &properties);
    let bind_group = device.create_bind_group(
        "canopy_cross",
        &pipelines.get_bind_group_layout(&layouts.cross),
        &BindGroupEntries::sequential((&colors, &properties, &layouts.cross_sampler)),
    );
    (texture, bind_group)
}

/// The lighting pictures, of those plants that have them.
pub fn upload_cross_light(
    plants: &[BakedPlant],
    layouts: &ForestLayouts,
    device: &RenderDevice,
    queue: &RenderQueue,
    pipelines: &PipelineCache,
) -> Option<BindGroup> {
    let layers: Vec<&MipChain> = plants.iter().flat_map(|plant| &plant.cross.textures.light).collect();
    if layers.is_empty() {
        return None;
    }
    let format = TextureFormat::Rgba8Snorm;
    let (_, view) = gpu::texture_array(device, queue, "canopy_cross_light", format, &layers, gpu::SMALLEST_TESTED_MIP);
    let layout = pipelines.get_bind_group_layout(&layouts.cross_light);
    Some(device.create_bind_group("canopy_cross_light", &layout, &BindGroupEntries::single(&view)))
}
