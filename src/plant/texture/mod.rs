//! Plant textures: mip chains that keep the coverage of the alpha test, colours without halos, and alpha that fades
//! with the threshold.
//!
//! A leaf texture is drawn with an alpha test. Three things go wrong when such a texture is treated as an
//! ordinary one; each has a function here:
//!
//! - An averaged alpha passes the test less and less often from mip to mip, so distant trees go bald.
//!   [`alpha_tested_mips`] gives every mip level 0's distribution of alpha as it is drawn, so the test passes equally
//!   often *at every threshold*: a level of detail that fades by raising its threshold fades equally in every mip.
//! - The colour of invisible texels bleeds into visible ones. [`color_mips`] weights colours by coverage,
//!   [`dilate_colors`] replaces invisible colours by those of the nearest leaf.
//! - A threshold that rises through a cut-out does nothing at all, then everything at once. [`fade_alpha`]
//!   restructures alpha so that leaves shrink steadily ([`AlphaFade::PerLeaf`], ours), or the crown does, its centre
//!   last ([`AlphaFade::CenterOut`], the "blending texture" of [Franzke 2005, section 4.3.3]).
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

pub use dilate::dilate_colors;
pub use distance::{NearestSites, nearest_sites};
pub use fade::{AlphaFade, fade_alpha};
pub use mips::{alpha_tested_mips, color_mips, leaf_mips, linear_mips, normal_mips};
