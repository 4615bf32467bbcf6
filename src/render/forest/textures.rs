//! The textures of full models, each filtered for its use and uploaded once.

use std::sync::Arc;

use bevy::{
    platform::collections::HashMap,
    render::{
        render_resource::{TextureFormat, TextureView},
        renderer::{RenderDevice, RenderQueue},
    },
};

use crate::{
    math::MipChain,
    plant::{
        PartKind, PlantMaterial,
        texture::{color_mips, leaf_mips, normal_mips},
    },
    render::gpu,
};

/// What a texture is used for: each use filters it differently.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum TextureUse {
    Wood,
    /// With the bits of the alpha test's threshold.
    Foliage(u32),
    Normal,
}

/// Textures that several parts share are uploaded once.
#[derive(Default)]
pub struct TextureCache {
    views: HashMap<(usize, TextureUse), TextureView>,
    /// Bound if a material has no normal map, and never sampled.
    no_normals: Option<TextureView>,
}

impl TextureCache {
    /// The base colour of a part of `kind`; white without a texture.
    pub fn color(
        &mut self,
        material: &PlantMaterial,
        kind: PartKind,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> TextureView {
        let format = TextureFormat::Rgba8UnormSrgb;
        let Some(image) = &material.base_color_texture else {
            return gpu::texture(device, queue, "canopy_white", format, &plain([255; 4]), 1);
        };
        let foliage = kind == PartKind::Foliage;
        let usage = if foliage { TextureUse::Foliage(material.alpha_cutoff.to_bits()) } else { TextureUse::Wood };
        self.views
            .entry((Arc::as_ptr(image) as usize, usage))
            .or_insert_with(|| {
                let chain = if foliage { leaf_mips(image, material.alpha_cutoff) } else { color_mips(image) };
                let smallest = if foliage { gpu::SMALLEST_TESTED_MIP } else { 1 };
                gpu::texture(device, queue, "canopy_base_color", format, &chain, smallest)
            })
            .clone()
    }

    /// The normal map. Without one: a texel that no pipeline samples, shared by all materials.
    pub fn normal(&mut self, material: &PlantMaterial, device: &RenderDevice, queue: &RenderQueue) -> TextureView {
        let format = TextureFormat::Rgba8Unorm;
        let Some(image) = &material.normal_texture else {
            let flat = || gpu::texture(device, queue, "canopy_flat", format, &plain([128, 128, 255, 255]), 1);
            return self.no_normals.get_or_insert_with(flat).clone();
        };
        self.views
            .entry((Arc::as_ptr(image) as usize, TextureUse::Normal))
            .or_insert_with(|| gpu::texture(device, queue, "canopy_normal", format, &normal_mips(image), 1))
            .clone()
    }
}

fn plain(texel: [u8; 4]) -> MipChain {
    MipChain { width: 1, height: 1, levels: vec![texel.to_vec()] }
}
