//! Procedural textures of bark and leaf clusters.
//!
//! The textures are the same in every run. They are painted when they are first needed, which takes a tenth to some
//! tenths of a second each, and then shared by all plants of the process. Colours are albedos of real bark and leaves.
//! The linear reflectance of leaves in green is about 0.04 to 0.15 (Gates et al. 1965, "Spectral properties of plants",
//! Applied Optics 4).

mod bark;
pub mod blade;
mod canvas;
pub(super) mod lattice;
mod layers;
mod leaves;
pub(super) mod masonry;
mod needles;

use std::sync::{Arc, OnceLock};

use glam::Vec3;
use image::RgbaImage;

pub use layers::paint_layers;

use super::parameters::{BarkKind, LeafShape};
use crate::math::compute_once;

/// The two textures of a bark. Both tile seamlessly in both directions.
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

/// The texture of a leaf cluster, 1024 by 1024: sRGB albedo with straight alpha, antialiased. The twig enters in the
/// middle of the lower edge. The last few pixels at the edges are transparent. Transparent texels have the colours of
/// nearby leaves, so that filtering shows no rims. Painted when first needed, then shared.
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
                LeafShape::Ovate | LeafShape::Lobed => leaves::paint(shape, Layer::Front),
                LeafShape::Needles => needles::paint(Layer::Front),
            })
        })
        .clone()
}

/// Fraction of the cluster's texture that is leaf (alpha of at least one half), 0 to 1. Multiplied by
/// `count * scale² * aspect`, it gives the leaf area of a tree.
pub fn coverage(shape: LeafShape) -> f32 {
    let texture = cluster(shape);
    let opaque = texture.pixels().filter(|pixel| pixel[3] >= 128).count();
    opaque as f32 / (texture.width() * texture.height()) as f32
}

/// One texture of a cluster of leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Layer {
    /// What the upper side reflects, sRGB.
    Front,
    /// What the lower side reflects over its mean: linear, half of it.
    Back,
    /// What comes through over its mean: linear, half of it.
    Through,
    /// Thickness.
    Thickness,
    /// Absorption.
    Absorption,
    /// Height of the upper side.
    Relief,
}

impl Layer {
    /// The value of a twig that has `color` on the front.
    fn twig(self, color: Vec3) -> Vec3 {
        match self {
            Self::Front => color,
            Self::Back => Vec3::new(0.62, 0.34, 0.55),
            Self::Through => Vec3::ZERO,
            Self::Thickness | Self::Absorption => Vec3::ONE,
            Self::Relief => Vec3::splat(0.5),
        }
    }
}
