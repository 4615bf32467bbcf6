//! One filtered texture, as a pure function of an image and its use.

use std::sync::Arc;

use image::RgbaImage;

use crate::math::{MipChain, MipView};
use crate::plant::texture::{color_mips, leaf_mips, normal_mips};

/// What a texture is used for: each use filters it differently.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TextureUse {
    /// The base colour of wood ([`color_mips`]).
    Color,
    /// The base colour of foliage, with the threshold of its alpha test ([`leaf_mips`]).
    Leaf {
        /// The threshold, 0..1.
        cutoff: f32,
    },
    /// Tangent-space normals ([`normal_mips`]).
    Normals,
}

/// A texture that is ready to be uploaded: RGBA8 with all mip levels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilteredTexture {
    /// Level 0. Where filtering does not change it, this is the plant's own image, not a copy.
    base: Arc<RgbaImage>,
    /// Levels 1 and up.
    smaller: Vec<Vec<u8>>,
}

impl FilteredTexture {
    /// Filters `image` for `usage`. Deterministic, on all threads.
    pub fn new(image: &Arc<RgbaImage>, usage: TextureUse) -> Self {
        let chain = match usage {
            TextureUse::Color => color_mips(image),
            TextureUse::Leaf { cutoff } => leaf_mips(image, cutoff),
            TextureUse::Normals => normal_mips(image),
        };
        let mut levels = chain.levels;
        let first = if levels.is_empty() { Vec::new() } else { levels.remove(0) };
        let base = match RgbaImage::from_raw(chain.width, chain.height, first) {
            Some(base) if base != **image => Arc::new(base),
            _ => Arc::clone(image),
        };
        Self { base, smaller: levels }
    }

    /// A texture with these levels; `None` unless each has the bytes of its size, down to one texel. `base` is level 0.
    pub(in crate::bake) fn from_levels(base: Arc<RgbaImage>, smaller: Vec<Vec<u8>>) -> Option<Self> {
        let texture = Self { base, smaller };
        let sizes = smaller_sizes(texture.base.width(), texture.base.height());
        let fits = texture.smaller.iter().map(Vec::len).eq(sizes);
        fits.then_some(texture)
    }

    /// Level 0.
    pub fn base(&self) -> &Arc<RgbaImage> {
        &self.base
    }

    /// Levels 1 and up.
    pub(in crate::bake) fn smaller(&self) -> &[Vec<u8>] {
        &self.smaller
    }

    /// All levels, for an upload.
    pub fn mips(&self) -> MipView<'_> {
        let levels = std::iter::once(self.base.as_raw()).chain(&self.smaller).map(Vec::as_slice).collect();
        MipView { width: self.base.width(), height: self.base.height(), levels }
    }
}

/// Bytes of the levels 1 and up of an RGBA8 texture.
pub(in crate::bake) fn smaller_sizes(width: u32, height: u32) -> Vec<usize> {
    let size = MipChain { width, height, levels: Vec::new() };
    let levels = if width == 0 || height == 0 { 0 } else { width.max(height).ilog2() as usize };
    (1..=levels)
        .map(|level| {
            let (width, height) = size.level_size(level);
            width as usize * height as usize * 4
        })
        .collect()
}
