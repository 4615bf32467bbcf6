//! A texture with its mip levels.

use serde::{Deserialize, Serialize};

/// An RGBA8 texture with its mip levels, ready for upload.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MipChain {
    /// Width of level 0 in texels.
    pub width: u32,
    /// Height of level 0 in texels.
    pub height: u32,
    /// The levels from full size down to 1x1. Level `n` holds [`MipChain::level_size`]`(n)` texels of 4 bytes,
    /// row by row from the top.
    #[serde(with = "super::byte_lists")]
    pub levels: Vec<Vec<u8>>,
}

impl MipChain {
    /// Width and height of `level` in texels: `size >> level`, at least 1 (0 only where level 0 is 0).
    pub fn level_size(&self, level: usize) -> (u32, u32) {
        let shrink = |size: u32| if size == 0 { 0 } else { size.checked_shr(level as u32).unwrap_or(0).max(1) };
        (shrink(self.width), shrink(self.height))
    }

    /// Whether every level has as many bytes as its size requires.
    pub fn is_whole(&self) -> bool {
        self.levels.iter().enumerate().all(|(index, level)| {
            let (width, height) = self.level_size(index);
            level.len() as u64 == u64::from(width) * u64::from(height) * 4
        })
    }

    /// All levels, for an upload.
    pub fn view(&self) -> MipView<'_> {
        let levels = self.levels.iter().map(Vec::as_slice).collect();
        MipView { width: self.width, height: self.height, levels }
    }

    /// All levels in one allocation, full size first, as a GPU upload expects them.
    pub fn concat(&self) -> Vec<u8> {
        self.levels.concat()
    }

    /// The fraction, 0..1, of the texels of `level` whose alpha is at least `threshold` (0..1).
    ///
    /// It is 0 for a level that does not exist or has no texels.
    pub fn coverage(&self, level: usize, threshold: f32) -> f32 {
        let Some(texels) = self.levels.get(level).filter(|texels| !texels.is_empty()) else {
            return 0.0;
        };
        let passing = texels.chunks_exact(4).filter(|texel| f32::from(texel[3]) / 255.0 >= threshold).count();
        passing as f32 / (texels.len() / 4) as f32
    }
}

/// A texture with its mip levels, borrowed: RGBA8, or in blocks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MipView<'a> {
    /// Width of level 0 in texels.
    pub width: u32,
    /// Height of level 0 in texels.
    pub height: u32,
    /// The levels as in a [`MipChain`], or their blocks row by row.
    pub levels: Vec<&'a [u8]>,
}
