//! The textures of full models, each uploaded once. They are filtered by the bake ([`crate::bake::textures`]).

use std::sync::Arc;

use bevy::{
    platform::collections::HashMap,
    render::render_resource::{TextureFormat, TextureView, TextureViewDescriptor, TextureViewDimension},
};

use crate::{
    bake::textures::{FilteredTexture, PartTextures},
    math::{MipView, color::srgb8},
    plant::{LeafStrokes, PartKind, PlantMaterial},
    render::{
        forest::upload::ForestUpload,
        gpu::{self, Gpu},
    },
};

/// Textures that several parts share are uploaded once.
#[derive(Default)]
pub struct TextureCache {
    /// By address; one texture has one use.
    views: HashMap<*const FilteredTexture, TextureView>,
    /// Strokes by address.
    strokes: HashMap<*const LeafStrokes, TextureView>,
    /// Bound if a material has no normal map, and never sampled.
    no_normals: Option<TextureView>,
    /// Bound if a material has no strokes.
    no_strokes: Option<TextureView>,
}

impl TextureCache {
    /// The base colour of a part of `kind`; white without a texture.
    pub fn color(&mut self, textures: &PartTextures, kind: PartKind, upload: &mut ForestUpload) -> TextureView {
        let format = TextureFormat::Rgba8UnormSrgb;
        let Some(texture) = &textures.color else {
            return plain("canopy_white", format, [255; 4], upload.gpu);
        };
        let smallest = if kind == PartKind::Foliage { gpu::SMALLEST_TESTED_MIP } else { 1 };
        self.uploaded("canopy_base_color", format, texture, smallest, upload)
    }

    /// The back of leaves; the front without a texture of its own.
    pub fn back(&mut self, textures: &PartTextures, front: &TextureView, upload: &mut ForestUpload) -> TextureView {
        match &textures.back {
            Some(texture) => self.uploaded("canopy_leaf_back", TextureFormat::Rgba8UnormSrgb, texture, 1, upload),
            None => front.clone(),
        }
    }

    /// What comes through the leaves of `material`.
    pub fn transmission(
        &mut self,
        textures: &PartTextures,
        material: &PlantMaterial,
        upload: &mut ForestUpload,
    ) -> TextureView {
        let format = TextureFormat::Rgba8UnormSrgb;
        match &textures.transmission {
            Some(texture) => self.uploaded("canopy_leaf_transmission", format, texture, 1, upload),
            None => {
                let [r, g, b] = material.transmitted(material.base_color).to_array().map(srgb8);
                plain("canopy_leaf_transmission", format, [r, g, b, 255], upload.gpu)
            }
        }
    }

    /// The normal map. Without one: a texel that no pipeline samples, shared by all materials.
    pub fn normal(&mut self, textures: &PartTextures, upload: &mut ForestUpload) -> TextureView {
        let format = TextureFormat::Rgba8Unorm;
        match &textures.normals {
            Some(texture) => self.uploaded("canopy_normal", format, texture, 1, upload),
            None => {
                let flat = || plain("canopy_flat", format, [128, 128, 255, 255], upload.gpu);
                self.no_normals.get_or_insert_with(flat).clone()
            }
        }
    }

    /// Strokes on leaves. Without any: an empty texel that all materials share.
    pub fn strokes(&mut self, material: &PlantMaterial, upload: &mut ForestUpload) -> TextureView {
        let (format, gpu) = (TextureFormat::Rgba8Unorm, upload.gpu);
        match &material.strokes {
            Some(strokes) => {
                let new = || {
                    let mips = strokes.texture();
                    gpu::texture(&gpu.device, &gpu.queue, "canopy_leaf_strokes", format, mips.view(), 1)
                };
                self.strokes.entry(Arc::as_ptr(strokes)).or_insert_with(new).clone()
            }
            None => {
                let empty = || plain("canopy_no_strokes", format, [0, 0, 0, 255], gpu);
                self.no_strokes.get_or_insert_with(empty).clone()
            }
        }
    }

    fn uploaded(
        &mut self,
        label: &str,
        format: TextureFormat,
        texture: &Arc<FilteredTexture>,
        smallest: u32,
        upload: &mut ForestUpload,
    ) -> TextureView {
        let new = || {
            let (texture, _) =
                upload.texture_array(label, format, 1, smallest, texture, |texture, _| Some(texture.mips()));
            let plain = TextureViewDescriptor { dimension: Some(TextureViewDimension::D2), ..Default::default() };
            texture.create_view(&plain)
        };
        self.views.entry(Arc::as_ptr(texture)).or_insert_with(new).clone()
    }
}

fn plain(label: &str, format: TextureFormat, texel: [u8; 4], gpu: &Gpu) -> TextureView {
    let mips = MipView { width: 1, height: 1, levels: vec![&texel] };
    gpu::texture(&gpu.device, &gpu.queue, label, format, mips, 1)
}
