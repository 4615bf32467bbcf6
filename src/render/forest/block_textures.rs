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
        Compression::Never => Some("`texture_compression` is `Never`"),
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
    let in_blocks = upload.textures.wanted
        && sets * count <= upload.gpu.device.limits().max_texture_array_layers as usize
        // An empty array is a single texel, which is no block.
        && find(plants, 0).is_some()
        && (0..count).filter_map(|index| find(plants, index)).all(has_blocks);
    upload.textures.add(in_blocks);
    let sets = if in_blocks { sets } else { 1 };
    let owner = (Arc::clone(plants), find, sets, in_blocks);
    let format = kind.format(in_blocks);
    upload.texture_array(label, format, sets * count, smallest, &owner, |(plants, find, sets, in_blocks), layer| {
        let texture = find(plants, layer / sets)?;
        if *in_blocks { texture.block_view(layer % sets) } else { Some(texture.texels.view()) }
    })
}

/// Writes `texture` over that of an `index` in an array of the same kind and shape.
pub fn rewrite(upload: &ForestUpload, array: &Texture, kind: TexelKind, index: u32, texture: &LevelTexture) {
    if !array.format().is_compressed() {
        gpu::write_layer(&upload.gpu.queue, array, index, &texture.texels.view());
        return;
    }
    let sets = kind.encoding().sets() as u32;
    for (set, layer) in (0..).zip(index * sets..(index + 1) * sets) {
        if let Some(mips) = texture.block_view(set) {
            gpu::write_layer(&upload.gpu.queue, array, layer, &mips);
        }
    }
}
