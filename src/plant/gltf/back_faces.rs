//! Leaves whose back is a mesh of its own: the same triangles the other way round, with another material. A leaf is one
//! surface with two sides here, so the second mesh becomes the back of the first.

use std::collections::HashMap;

use super::error::{WarningKind, Warnings};
use super::material::Surface;
use crate::plant::{PartKind, PlantMesh};

/// Difference of texture coordinates that counts as none.
const SAME_TEXEL: f32 = 1e-4;

/// A triangle by the bits of its corners, the least one first; its winding counts.
type Key = [[u32; 3]; 3];

/// Makes each part of foliage the back of another part, if that has the same triangles the other way round, with the same
/// texture coordinates.
pub(super) fn join(parts: &mut Vec<(Surface, PlantMesh)>, warnings: &mut Warnings) {
    let is_leaf = |part: &(Surface, PlantMesh)| part.0.kind == PartKind::Foliage && !part.1.triangles.is_empty();
    if parts.iter().filter(|part| is_leaf(part)).count() < 2 {
        return;
    }
    let mut backs: Vec<Option<usize>> = vec![None; parts.len()];
    for front in 0..parts.len() {
        if !is_leaf(&parts[front]) || backs[front].is_some() {
            continue;
        }
        let same_size = |back: &usize| parts[*back].1.triangles.len() == parts[front].1.triangles.len();
        let candidates: Vec<usize> = (front + 1..parts.len())
            .filter(|back| is_leaf(&parts[*back]) && backs[*back].is_none())
            .filter(same_size)
            .collect();
        if candidates.is_empty() {
            continue;
        }
        let known: HashMap<Key, [glam::Vec2; 3]> =
            parts[front].1.triangles.iter().map(|triangle| key(&parts[front].1, *triangle)).collect();
        for back in candidates {
            let mesh = &parts[back].1;
            let is_back = mesh.triangles.iter().all(|&[a, b, c]| {
                let (turned, uvs) = key(mesh, [a, c, b]);
                let same = |front: &[glam::Vec2; 3]| {
                    front.iter().zip(uvs).all(|(front, back)| front.abs_diff_eq(back, SAME_TEXEL))
                };
                known.get(&turned).is_some_and(same)
            });
            if is_back {
                backs[back] = Some(front);
            }
        }
    }
    for back in (0..parts.len()).rev() {
        let Some(front) = backs[back] else { continue };
        let (surface, _) = parts.remove(back);
        let into = &mut parts[front].0;
        let message = format!("'{}' is the back of the leaves of '{}'", surface.name, into.name);
        warnings.push(WarningKind::Repaired, "/materials", message);
        if into.material.leaf_textures.back.is_none() {
            into.material.leaf_textures.back = surface.material.base_color_texture;
        }
    }
}

/// A triangle's key and its texture coordinates in the same order.
fn key(mesh: &PlantMesh, triangle: [u32; 3]) -> (Key, [glam::Vec2; 3]) {
    let corners = triangle.map(|corner| corner as usize);
    let bits = |corner: usize| {
        // Both zeros are the same place.
        mesh.positions.get(corner).map_or([u32::MAX; 3], |p| p.to_array().map(|c| (c + 0.0).to_bits()))
    };
    let mut pairs = corners.map(|corner| (bits(corner), mesh.uvs.get(corner).copied().unwrap_or_default()));
    let least = (0..3).min_by_key(|&i| pairs[i].0).unwrap_or(0);
    pairs.rotate_left(least);
    (pairs.map(|(bits, _)| bits), pairs.map(|(_, uv)| uv))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{Affine2, Vec2, Vec3};
    use image::RgbaImage;

    use super::*;
    use crate::plant::PlantMaterial;

    fn part(name: &str, triangles: Vec<[u32; 3]>, kind: PartKind) -> (Surface, PlantMesh) {
        let material = PlantMaterial {
            base_color_texture: Some(Arc::new(RgbaImage::new(2, name.len() as u32))),
            ..PlantMaterial::default()
        };
        let surface = Surface {
            name: name.to_owned(),
            kind,
            material,
            uv_set: 0,
            uv_transform: Affine2::IDENTITY,
            clamped: false,
        };
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE];
        let uvs = positions.iter().map(|p| p.truncate()).collect::<Vec<Vec2>>();
        (surface, PlantMesh { normals: vec![Vec3::Z; 4], positions, uvs, triangles })
    }

    #[test]
    fn reversed_triangles_with_another_material_are_the_back() {
        let front = part("front", vec![[0, 1, 2], [1, 3, 2]], PartKind::Foliage);
        let back = part("back", vec![[2, 3, 1], [1, 0, 2]], PartKind::Foliage);
        let mut parts = vec![front.clone(), back.clone()];
        let mut warnings = Warnings::default();
        join(&mut parts, &mut warnings);
        assert_eq!(parts.len(), 1);
        assert_eq!(parts[0].0.material.leaf_textures.back.as_ref().map(|image| image.height()), Some(4));
        assert_eq!(warnings.finish().len(), 1);
        // Not the back: the same side, a triangle that differs, other texture coordinates, wood.
        let mut shifted = back.clone();
        shifted.1.uvs[3] = Vec2::splat(0.5);
        for other in [
            part("same", vec![[0, 1, 2], [1, 3, 2]], PartKind::Foliage),
            part("part", vec![[2, 3, 1], [0, 1, 2]], PartKind::Foliage),
            part("wood", vec![[2, 3, 1], [1, 0, 2]], PartKind::Wood),
            shifted,
        ] {
            let mut parts = vec![front.clone(), other];
            join(&mut parts, &mut Warnings::default());
            assert_eq!(parts.len(), 2);
        }
    }
}
