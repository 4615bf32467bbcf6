//! What a plant is drawn as, apart from its full model.
//!
//! | module | makes | after |
//! |---|---|---|
//! | [`cross`] | crossed billboards with colour, normal, k_a | [Franzke 2005, 4.3] |
//! | [`shadow_proxy`] | a lighter model with the same projected area | [Cook et al. 2007] |
//! | [`rasterize`] | which triangle each sample of a picture sees: what both need | |

pub mod cross;
pub mod rasterize;
pub mod shadow_proxy;
