//! The further textures of a cluster of leaves: back, transmission, thickness, absorption, bump.

use std::sync::{Arc, OnceLock};

use glam::Vec3;
use image::{GrayImage, Luma, Rgba, RgbaImage};

use super::{Layer, leaves, needles};
use crate::math::{compute_once, linear_to_srgb, luminance};
use crate::plant::grow::parameters::LeafShape;
use crate::plant::optics::mean_over_leaf;
use crate::plant::{LeafTextures, PlantMaterial};

/// Share of its luminance that the lower side reflects more than the upper one, without colour.
const PALER: f32 = 0.3;
/// Height of the relief in texels.
const RELIEF: f32 = 7.0;

/// What all individuals share.
struct Painted {
    back: RgbaImage,
    through: RgbaImage,
    thickness: Arc<GrayImage>,
    absorption: Arc<GrayImage>,
    normal: Option<Arc<RgbaImage>>,
}

/// Gives `material`, whose base colour is the cluster of `shape`, all further textures of the layered leaf model. The
/// transmission has the mean that the material has without a texture, so that no tree gets brighter or darker. The first
/// call for a shape takes a second, later ones 0.1 s and 8 MB.
pub fn paint_layers(material: &mut PlantMaterial, shape: LeafShape) {
    let painted = painted(shape);
    let [front, through] = mean_over_leaf(material, |color| [color, material.transmitted(color)]);
    let back = (front + PALER * luminance(front)).min(Vec3::ONE - through);
    material.leaf_textures = LeafTextures {
        back: Some(Arc::new(with_mean(&painted.back, back, material.alpha_cutoff))),
        transmission: Some(Arc::new(with_mean(&painted.through, through, material.alpha_cutoff))),
        thickness: Some(painted.thickness.clone()),
        absorption: Some(painted.absorption.clone()),
    };
    material.normal_texture.clone_from(&painted.normal);
}

fn painted(shape: LeafShape) -> &'static Painted {
    static PAINTED: [OnceLock<Painted>; 3] = [const { OnceLock::new() }; 3];
    let slot = match shape {
        LeafShape::Ovate => 0,
        LeafShape::Lobed => 1,
        LeafShape::Needles => 2,
    };
    compute_once(&PAINTED[slot], || {
        let paint = |layer| match shape {
            LeafShape::Ovate | LeafShape::Lobed => leaves::paint(shape, layer),
            LeafShape::Needles => needles::paint(layer),
        };
        let grey = |layer| {
            let image = paint(layer);
            Arc::new(GrayImage::from_fn(image.width(), image.height(), |x, y| Luma([image.get_pixel(x, y)[0]])))
        };
        // The strokes of needles are rounder than their texels show.
        let normal = (shape != LeafShape::Needles).then(|| Arc::new(normals(&paint(Layer::Relief))));
        Painted {
            back: paint(Layer::Back),
            through: paint(Layer::Through),
            thickness: grey(Layer::Thickness),
            absorption: grey(Layer::Absorption),
            normal,
        }
    })
}

/// The sRGB image of linear values that have the mean `mean` where their alpha passes.
fn with_mean(values: &RgbaImage, mean: Vec3, cutoff: f32) -> RgbaImage {
    let value = |texel: &Rgba<u8>| Vec3::new(f32::from(texel[0]), f32::from(texel[1]), f32::from(texel[2])) / 255.0;
    let (mut sum, mut count) = (Vec3::ZERO, 0.0f32);
    for texel in values.pixels().filter(|texel| f32::from(texel[3]) >= 255.0 * cutoff) {
        sum += value(texel);
        count += 1.0;
    }
    let factor = mean * count / sum.max(Vec3::splat(1e-6));
    // All codes of each channel at once.
    let codes: [[u8; 256]; 3] = std::array::from_fn(|channel| {
        std::array::from_fn(|code| {
            let linear = (factor[channel] * code as f32 / 255.0).clamp(0.0, 1.0);
            (linear_to_srgb(linear) * 255.0 + 0.5) as u8
        })
    });
    let mut image = values.clone();
    for texel in image.pixels_mut() {
        for channel in 0..3 {
            texel[channel] = codes[channel][usize::from(texel[channel])];
        }
    }
    image
}

/// Tangent-space normals (+Y up) of a relief.
fn normals(relief: &RgbaImage) -> RgbaImage {
    let (width, height) = relief.dimensions();
    let at = |x: u32, y: u32| f32::from(relief.get_pixel(x.min(width - 1), y.min(height - 1))[0]) / 255.0;
    RgbaImage::from_fn(width, height, |x, y| {
        let slope_x = at(x.saturating_sub(1), y) - at(x + 1, y);
        let slope_y = at(x, y + 1) - at(x, y.saturating_sub(1));
        let normal = Vec3::new(0.5 * RELIEF * slope_x, 0.5 * RELIEF * slope_y, 1.0).normalize_or(Vec3::Z);
        let [r, g, b] = (0.5 * normal + 0.5).to_array().map(|value| (value * 255.0 + 0.5) as u8);
        Rgba([r, g, b, 255])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::srgb_to_linear;
    use crate::plant::grow::textures::cluster;
    use crate::plant::{Gloss, LeafColors, LeafKind, PartKind, Plant, PlantMesh, PlantPart};

    fn colors(material: PlantMaterial) -> LeafColors {
        let mesh = PlantMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            uvs: vec![glam::Vec2::ZERO; 3],
            triangles: vec![[0, 1, 2]],
        };
        Plant { name: String::new(), parts: vec![PlantPart { kind: PartKind::Foliage, mesh, material }] }.leaf_colors()
    }

    #[test]
    fn layers_change_the_mean_light_of_no_tree() {
        for (shape, kind) in [
            (LeafShape::Ovate, LeafKind::Thin),
            (LeafShape::Lobed, LeafKind::Leathery),
            (LeafShape::Needles, LeafKind::Needle),
        ] {
            let plain = PlantMaterial {
                base_color: Vec3::new(0.62, 0.66, 0.72),
                base_color_texture: Some(cluster(shape)),
                transmission: kind.transmission(),
                gloss: Gloss::LEAF,
                ..PlantMaterial::default()
            };
            let mut layered = plain.clone();
            paint_layers(&mut layered, shape);
            assert_eq!(layered.base_color_texture, plain.base_color_texture);
            let (before, after) = (colors(plain), colors(layered.clone()));
            assert_eq!(before.reflected, after.reflected);
            // `leaf_colors` samples every 16th texel, and codes are steps.
            let change = (after.transmitted - before.transmitted).abs();
            assert!(change.max_element() < 0.004, "{shape:?}: {before:?} {after:?}");
            let size = |image: &RgbaImage| image.dimensions();
            let textures = layered.leaf_textures;
            let transmission = textures.transmission.unwrap();
            assert_eq!(size(&transmission), size(layered.base_color_texture.as_ref().unwrap()));
            // The mask is the same.
            let front = layered.base_color_texture.unwrap();
            let differs = front.pixels().zip(transmission.pixels()).filter(|(a, b)| a[3].abs_diff(b[3]) > 2).count();
            assert!(differs < 300, "{shape:?}: {differs}");
            assert_eq!(layered.normal_texture.is_some(), shape != LeafShape::Needles);
            assert!(srgb_to_linear(f32::from(transmission.get_pixel(512, 512)[2]) / 255.0) < 0.2);
        }
    }
}
