//! Bark and leaf clusters, painted by rule.
//!
//! Textures are the same in every run, are painted when first asked for (a tenth to some tenths of a second each) and
//! are then shared by all plants of the process. Colours are albedos of real bark and leaves: linear reflectance of
//! leaves about 0.04 to 0.15 in green (Gates et al. 1965, "Spectral properties of plants", Applied Optics 4).

mod bark;
mod canvas;
mod lattice;
mod leaves;
mod needles;

use std::sync::{Arc, OnceLock};

use image::RgbaImage;

use super::parameters::{BarkKind, LeafShape};
use crate::math::compute_once;

/// The two textures of a bark. Both repeat without seams in both directions.
#[derive(Clone, Debug)]
pub struct BarkTextures {
    /// Albedo, sRGB, 512 by 1024, opaque.
    pub color: Arc<RgbaImage>,
    /// Tangent-space normals (+Y up, OpenGL convention), 512 by 1024.
    pub normal: Arc<RgbaImage>,
}

/// The textures of a bark: painted when first needed, then shared.
pub fn bark(kind: BarkKind) -> BarkTextures {
    static PAINTED: [OnceLock<BarkTextures>; 2] = [const { OnceLock::new() }; 2];
    let slot = match kind {
        BarkKind::Fissured => 0,
        BarkKind::Scaly => 1,
    };
    compute_once(&PAINTED[slot], || bark::paint(kind)).clone()
}

/// The texture of a leaf cluster, 1024 by 1024, its twig entering in the middle of the lower edge: sRGB albedo with
/// straight alpha, antialiased, nothing within some pixels of the edges. Transparent texels carry the colours of
/// leaves nearby, so that filtering shows no rims. Painted once, then shared.
pub fn cluster(shape: LeafShape) -> Arc<RgbaImage> {
    static PAINTED: [OnceLock<Arc<RgbaImage>>; 3] = [const { OnceLock::new() }; 3];
    let slot = match shape {
        LeafShape::Ovate => 0,
        LeafShape::Lobed => 1,
        LeafShape::Needles => 2,
    };
    PAINTED[slot]
        .get_or_init(|| {
            Arc::new(match shape {
                LeafShape::Ovate | LeafShape::Lobed => leaves::paint(shape),
                LeafShape::Needles => needles::paint(),
            })
        })
        .clone()
}

/// Fraction of the cluster's texture that is leaf (alpha at least one half), 0 to 1. Times `count * scale² * aspect`
/// it is the leaf area of a tree.
pub fn coverage(shape: LeafShape) -> f32 {
    let texture = cluster(shape);
    let opaque = texture.pixels().filter(|pixel| pixel[3] >= 128).count();
    opaque as f32 / (texture.width() * texture.height()) as f32
}
