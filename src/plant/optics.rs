//! Mean optical properties of a plant's leaves, and the dimensions of its crown.

use glam::{Vec2, Vec3, Vec4};
use image::RgbaImage;

use super::{PartKind, Plant, PlantMaterial};
use crate::math::srgb_to_linear;

/// Fraction of a crown's extents that counts as its width, because single twigs stick out.
const CROWN_SHARE: f32 = 0.8;
/// Maximum number of texels that are sampled along each side of an image.
const SAMPLES: u32 = 64;

/// Fractions of the light that leaves reflect and transmit, per channel, mean over the area of all leaves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeafColors {
    /// Reflected, 0..=1.
    pub reflected: Vec3,
    /// Transmitted, 0..=1.
    pub transmitted: Vec3,
    /// Area of the leaves in square metres, one side, holes of the alpha test counted as leaf.
    pub area: f32,
}

impl Plant {
    /// The mean colours of the leaves; black with an area of 0 if there are none.
    pub fn leaf_colors(&self) -> LeafColors {
        let mut sum = LeafColors::default();
        for part in self.parts.iter().filter(|part| part.kind == PartKind::Foliage) {
            let areas = part.mesh.triangles.iter().map(|triangle| f64::from(part.mesh.area(*triangle)));
            let area = areas.sum::<f64>().min(1e12) as f32;
            let (reflected, transmitted) = mean(&part.material);
            sum.reflected += area * reflected;
            sum.transmitted += area * transmitted;
            sum.area += area;
        }
        if sum.area > 0.0 {
            LeafColors { reflected: sum.reflected / sum.area, transmitted: sum.transmitted / sum.area, ..sum }
        } else {
            LeafColors::default()
        }
    }

    /// Radius of the disc of ground that the plant covers, metres: it is smaller than one that contains every twig. 0
    /// without any surface.
    pub fn covered_radius(&self) -> f32 {
        let size = self.bounds().map_or(Vec3::ZERO, |bounds| bounds.size());
        CROWN_SHARE * 0.5 * size.x.max(size.z)
    }

    /// Width of the crown over the plant's height: the mean of its extents along x and z, of which a crown fills four
    /// fifths. 0 where there are no leaves or no height.
    pub fn crown_width(&self) -> f32 {
        let Some(crown) = self.bounds_of(|kind| kind == PartKind::Foliage) else { return 0.0 };
        let (size, height) = (crown.size(), self.height());
        if height > 0.0 { CROWN_SHARE * 0.5 * (size.x + size.z) / height } else { 0.0 }
    }

    /// Length of the crown over the plant's height, 0..=1: that of an equally dense crown whose leaves have the same
    /// mean height, weighted by area. 0 if there are no leaves or no height.
    pub fn crown_length(&self) -> f32 {
        let (mut sum, mut areas) = (0.0, 0.0);
        for mesh in self.parts.iter().filter(|part| part.kind == PartKind::Foliage).map(|part| &part.mesh) {
            for triangle in &mesh.triangles {
                let area = f64::from(mesh.area(*triangle));
                let height =
                    triangle.iter().filter_map(|&corner| mesh.positions.get(corner as usize)).map(|p| p.y).sum::<f32>();
                sum += area * f64::from(height / 3.0);
                areas += area;
            }
        }
        let height = f64::from(self.height());
        if areas > 0.0 && height > 0.0 { (2.0 * (1.0 - sum / areas / height)).clamp(0.0, 1.0) as f32 } else { 0.0 }
    }
}

/// Mean reflected and transmitted light over the texels that pass the alpha test.
fn mean(material: &PlantMaterial) -> (Vec3, Vec3) {
    let [reflected, derived] = mean_over_leaf(material, |color| [color, material.transmitted(color)]);
    let given = material.leaf_textures.transmission.as_ref().map(|image| mean_texel(image, material).truncate());
    (reflected, given.map_or(derived, |given| given.min(Vec3::ONE - reflected)))
}

/// Means of `values` of the base colour (0..1) over the texels that pass the alpha test; those of the plain base colour
/// where there is no texture or nothing passes.
pub(super) fn mean_over_leaf<const N: usize>(
    material: &PlantMaterial,
    values: impl Fn(Vec3) -> [Vec3; N],
) -> [Vec3; N] {
    let of = |color: Vec3| values(color.clamp(Vec3::ZERO, Vec3::ONE));
    let Some(image) = &material.base_color_texture else { return of(material.base_color) };
    let (mut sums, mut count) = ([Vec3::ZERO; N], 0.0);
    for place in grid(image) {
        let Some(texel) = texel(image, place) else { continue };
        if texel.w < material.alpha_cutoff {
            continue;
        }
        for (sum, value) in sums.iter_mut().zip(of(texel.truncate() * material.base_color)) {
            *sum += value;
        }
        count += 1.0;
    }
    if count > 0.0 { sums.map(|sum| sum / count) } else { of(material.base_color) }
}

/// Linear colour and alpha of `image`, in the mean over the places at which the base colour of `material` passes the
/// alpha test; over the whole image where it has no texture or nothing passes. `image` has the texture coordinates of
/// the base colour. White where it has no texels.
pub(super) fn mean_texel(image: &RgbaImage, material: &PlantMaterial) -> Vec4 {
    let mean = |passes: &dyn Fn(Vec2) -> bool, over: &RgbaImage| {
        let texels = grid(over).filter(|&place| passes(place)).filter_map(|place| texel(image, place));
        let (sum, count) = texels.fold((Vec4::ZERO, 0.0), |(sum, count), texel| (sum + texel, count + 1.0));
        (count > 0.0).then(|| sum / count)
    };
    let of_leaf = material
        .base_color_texture
        .as_deref()
        .and_then(|mask| mean(&|place| texel(mask, place).is_some_and(|texel| texel.w >= material.alpha_cutoff), mask));
    of_leaf.or_else(|| mean(&|_| true, image)).unwrap_or(Vec4::ONE)
}

/// Places in the unit square that sample `image` evenly, each in the middle of a texel of it or of a coarser lattice.
fn grid(image: &RgbaImage) -> impl Iterator<Item = Vec2> + use<> {
    let (columns, rows) = (image.width().min(SAMPLES), image.height().min(SAMPLES));
    (0..rows).flat_map(move |row| {
        (0..columns)
            .map(move |column| Vec2::new((column as f32 + 0.5) / columns as f32, (row as f32 + 0.5) / rows as f32))
    })
}

/// Linear colour and alpha of the texel at `place` in the unit square.
fn texel(image: &RgbaImage, place: Vec2) -> Option<Vec4> {
    let at = place * Vec2::new(image.width() as f32, image.height() as f32);
    let texel = image.get_pixel_checked(at.x as u32, at.y as u32)?;
    let [r, g, b, a] = texel.0.map(|code| f32::from(code) / 255.0);
    Some(Vec4::new(srgb_to_linear(r), srgb_to_linear(g), srgb_to_linear(b), a))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use image::{Rgba, RgbaImage};

    use super::*;
    use crate::plant::{Gloss, PlantMesh, PlantPart};

    fn square(side: f32) -> PlantMesh {
        PlantMesh {
            positions: vec![Vec3::ZERO, Vec3::X * side, Vec3::new(side, side, 0.0), Vec3::Y * side],
            normals: vec![Vec3::Z; 4],
            uvs: vec![Vec2::ZERO; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3], [0, 0, 1], [0, 1, 9]],
        }
    }

    fn leaf(side: f32, color: Vec3, image: Option<RgbaImage>) -> PlantPart {
        let material = PlantMaterial {
            base_color: color,
            base_color_texture: image.map(Arc::new),
            transmission: Vec3::splat(0.5),
            gloss: Gloss::MATT,
            ..PlantMaterial::default()
        };
        PlantPart { kind: PartKind::Foliage, mesh: square(side), material }
    }

    #[test]
    fn colours_are_weighted_by_area_and_holes_have_none() {
        let wood = PlantPart { kind: PartKind::Wood, ..leaf(9.0, Vec3::ONE, None) };
        let half =
            RgbaImage::from_fn(128, 2, |x, _| if x < 64 { Rgba([255, 0, 255, 255]) } else { Rgba([0, 255, 0, 9]) });
        let plant = |parts| Plant { name: "leaves".into(), parts };
        let colors = plant(vec![wood.clone(), leaf(1.0, Vec3::splat(0.4), None)]).leaf_colors();
        assert_eq!((colors.reflected, colors.area), (Vec3::splat(0.4), 1.0));
        assert!((colors.transmitted - 0.2).abs().max_element() < 1e-6);
        let colors = plant(vec![leaf(1.0, Vec3::ZERO, None), leaf(2.0, Vec3::ONE, Some(half))]).leaf_colors();
        assert!((colors.reflected - Vec3::new(0.8, 0.0, 0.8)).abs().max_element() < 1e-6, "{colors:?}");
        assert_eq!(plant(vec![wood]).leaf_colors(), LeafColors::default());
        assert_eq!(Plant::default().leaf_colors(), LeafColors::default());
    }

    #[test]
    fn a_crown_is_measured_by_its_leaves() {
        let mut crown = leaf(4.0, Vec3::ONE, None);
        crown.mesh.positions.iter_mut().for_each(|position| position.y += 6.0);
        let trunk = PlantPart { kind: PartKind::Wood, ..leaf(1.0, Vec3::ONE, None) };
        let tree = Plant { name: "tree".into(), parts: vec![trunk.clone(), crown] };
        // 4 m wide along x and flat along z, from 6 m to 10 m.
        assert!((tree.crown_width() - 0.8 * 0.5 * 4.0 / 10.0).abs() < 1e-6);
        assert!((tree.crown_length() - 0.4).abs() < 1e-6, "{}", tree.crown_length());
        let bare = Plant { name: "bare".into(), parts: vec![trunk] };
        assert_eq!((bare.crown_width(), bare.crown_length(), Plant::default().crown_length()), (0.0, 0.0, 0.0));
    }
}
