//! Plant textures: mip chains that keep the coverage of the alpha test, colours without halos, and alpha that fades with
//! the threshold.
//!
//! A leaf texture is drawn with an alpha test. Three things go wrong when such a texture is treated as an
//! ordinary one, and each has its function here:
//!
//! - An averaged alpha passes the test less and less often from mip to mip, so distant trees go bald.
//!   [`alpha_tested_mips`] gives every mip level 0's distribution of alpha as it is drawn, so the test passes equally
//!   often *at every threshold*: a level of detail that fades by raising its threshold fades equally in every mip.
//! - The colour of texels that nobody sees bleeds into those that are seen. [`color_mips`] weighs colours by
//!   coverage, [`dilate_colors`] replaces the invisible colours by those of the nearest leaf.
//! - A threshold that rises through a cut-out does nothing at all, then everything at once. [`fade_alpha`]
//!   restructures alpha so that leaves shrink steadily ([`AlphaFade::PerLeaf`], ours), or the crown does, its centre last
//!   ([`AlphaFade::CenterOut`], the "blending texture" of [Franzke 2005, section 4.3.3]).
//!
//! The order for a leaf: `dilate_colors`, then `fade_alpha`, then `alpha_tested_mips`; [`leaf_mips`] does all three.
//!
//! All functions are deterministic whatever the number of threads, accept images of any size (an image without
//! texels gives a chain of one empty level) and treat the image border as an edge (no wrap-around).

mod coverage;
mod dilate;
mod distance;
mod fade;
mod mips;
mod resample;

pub use dilate::dilate_colors;
pub use distance::{NearestSites, nearest_sites};
pub use fade::{AlphaFade, fade_alpha};
pub use mips::{alpha_tested_mips, color_mips, leaf_mips, normal_mips};
pub use resample::{linear_to_srgb, resize_to, srgb_to_linear};

/// A texture with its mip levels, RGBA8, ready to be uploaded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MipChain {
    /// Width of level 0 in texels.
    pub width: u32,
    /// Height of level 0 in texels.
    pub height: u32,
    /// The levels, full size first, down to 1x1. Level `n` holds [`MipChain::level_size`]`(n)` texels of 4 bytes,
    /// row by row from the top.
    pub levels: Vec<Vec<u8>>,
}

impl MipChain {
    /// Width and height of `level` in texels: `size >> level`, at least 1 (0 only where level 0 is 0).
    pub fn level_size(&self, level: usize) -> (u32, u32) {
        let shrink = |size: u32| if size == 0 { 0 } else { size.checked_shr(level as u32).unwrap_or(0).max(1) };
        (shrink(self.width), shrink(self.height))
    }

    /// The levels one after the other in one allocation, full size first: what a GPU upload expects.
    pub fn concat(&self) -> Vec<u8> {
        self.levels.concat()
    }

    /// The fraction, 0..1, of the area of `level` whose alpha, interpolated bilinearly between texels, reaches
    /// `threshold` (0..1): what an alpha test draws when the level is sampled. Sampled on a fixed grid.
    ///
    /// 0 for a level that does not exist or has no texels.
    pub fn drawn_coverage(&self, level: usize, threshold: f32) -> f32 {
        let (width, height) = self.level_size(level);
        let alphas: Vec<u8> =
            self.levels.get(level).map_or_else(Vec::new, |bytes| bytes.chunks_exact(4).map(|texel| texel[3]).collect());
        coverage::Distribution::of_drawn(&alphas, width as usize, height as usize).at(threshold)
    }

    /// The fraction, 0..1, of the texels of `level` whose alpha is at least `threshold` (0..1).
    ///
    /// 0 for a level that does not exist or has no texels.
    pub fn coverage(&self, level: usize, threshold: f32) -> f32 {
        let Some(texels) = self.levels.get(level).filter(|texels| !texels.is_empty()) else {
            return 0.0;
        };
        let passing = texels.chunks_exact(4).filter(|texel| f32::from(texel[3]) / 255.0 >= threshold).count();
        passing as f32 / (texels.len() / 4) as f32
    }
}
