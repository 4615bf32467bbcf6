//! The textures of baked levels on the device: block-compressed where it reads blocks, else as texels.

use std::sync::Arc;

use bevy::render::{
    render_resource::{Texture, TextureFormat, TextureView, WgpuFeatures},
    renderer::RenderDevice,
};
use wgpu::DeviceType;

use super::upload::ForestUpload;
use crate::{
    bake::{
        BakedPlant,
        levels::texture::{BlockEncoding, Compression, LevelTexture},
    },
    render::gpu,
};

/// Why a device gets texels; `None` if it gets blocks.
pub fn why_texels(compression: Compression, device: &RenderDevice, device_type: DeviceType) -> Option<&'static str> {
    match compression {
        Compression::Never => Some("the program asks for it"),
        Compression::Automatic if device_type == DeviceType::Cpu => {
            Some("this device is a software driver, which unpacks a block for each texel that it reads")
        }
        _ if !device.features().contains(WgpuFeatures::TEXTURE_COMPRESSION_BC) => {
            Some("this device does not read BC blocks")
        }
        Compression::Automatic | Compression::WherePossible => None,
    }
}

/// What the texels of a level's textures are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TexelKind {
    /// sRGB-encoded colours, and alpha.
    Color,
    /// Four linear values.
    Linear,
    /// Four linear values that have nothing to do with each other. In blocks, a texture takes two layers of two values.
    Pairs,
}

impl TexelKind {
    fn encoding(self) -> BlockEncoding {
        match self {
            Self::Color | Self::Linear => BlockEncoding::Whole,
            Self::Pairs => BlockEncoding::Pairs,
        }
    }

    fn format(self, in_blocks: bool) -> TextureFormat {
        match (self, in_blocks) {
            (Self::Color, false) => TextureFormat::Rgba8UnormSrgb,
            (Self::Color, true) => TextureFormat::Bc7RgbaUnormSrgb,
            (Self::Linear | Self::Pairs, false) => TextureFormat::Rgba8Unorm,
            (Self::Linear, true) => TextureFormat::Bc7RgbaUnorm,
            (Self::Pairs, true) => TextureFormat::Bc5RgUnorm,
        }
    }
}

/// Finds a texture by its index in those of the plants.
pub type FindTexture = for<'a> fn(&'a [BakedPlant], usize) -> Option<&'a LevelTexture>;

/// An array of `count` textures that `find` takes from the plants. All have the size of the first. They are texels if one of
/// them has no blocks, or if the device has too few layers for their blocks.
pub fn upload_textures(
    upload: &mut ForestUpload,
    label: &str,
    kind: TexelKind,
    count: usize,
    plants: &Arc<Vec<BakedPlant>>,
    find: FindTexture,
) -> (Texture, TextureView) {
    let (smallest, sets) = (gpu::SMALLEST_TESTED_MIP, kind.encoding().sets());
    let has_blocks = |texture: &LevelTexture| {
        let levels = gpu::levels_down_to(&texture.texels.view(), smallest);
        texture.blocks.len() == sets && texture.blocks.iter().all(|mips| mips.0.len() >= levels)
    };
    let in_blocks = upload.in_blocks
        && sets * count <= upload.gpu.device.limits().max_texture_array_layers as usize
        && (0..count).filter_map(|index| find(plants, index)).all(has_blocks);
    let format = kind.format(in_blocks);
    if in_blocks {
        let owner = (Arc::clone(plants), find, sets);
        upload.texture_array(label, format, sets * count, smallest, &owner, |(plants, find, sets), layer| {
            find(plants, layer / sets)?.block_view(layer % sets)
        })
    } else {
        let owner = (Arc::clone(plants), find);
        upload.texture_array(label, format, count, smallest, &owner, |(plants, find), index| {
            find(plants, index).map(|texture| texture.texels.view())
        })
    }
}

/// Writes `texture` over that of an `index` in an array of the same kind and size.
pub fn rewrite(upload: &ForestUpload, array: &Texture, index: u32, texture: &LevelTexture) {
    if !array.format().is_compressed() {
        gpu::write_layer(&upload.gpu.queue, array, index, &texture.texels.view());
        return;
    }
    let sets = texture.blocks.len() as u32;
    for (set, layer) in (0..).zip(index * sets..(index + 1) * sets) {
        if let Some(mips) = texture.block_view(set) {
            gpu::write_layer(&upload.gpu.queue, array, layer, &mips);
        }
    }
}
