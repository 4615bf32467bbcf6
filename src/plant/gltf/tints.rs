//! Vertex colours: a plant's part has one colour, so a mesh is divided by them.
//!
//! glTF multiplies the colour of a vertex by that of the material [glTF 2.0 specification, section 3.9.2]. Where there is no
//! texture they are the picture: a trunk and a crown in one mesh. The triangles are then sorted into few colours, each a part
//! of its own. Over a texture their mean is used: they are mostly shades, or no colours at all but data for the wind.

use std::collections::BTreeMap;

use glam::Vec3;

use crate::plant::PlantMesh;

/// Steps of a channel into which colours are sorted: finely first, more coarsely if that gives too many parts.
const STEPS: [f32; 4] = [12.0, 6.0, 3.0, 1.0];
/// Most parts of one mesh.
const MOST_PARTS: usize = 8;
/// Largest difference from white that nobody sees.
const UNSEEN: f32 = 0.02;

/// A part of a mesh with the mean of its colours, linear.
pub(super) struct Tinted {
    pub mesh: PlantMesh,
    pub color: Vec3,
}

/// Divides a mesh by the colours of its vertices, one colour a vertex; `textured`: the mean over all is used.
pub(super) fn divide(mesh: PlantMesh, colors: &[Vec3], textured: bool) -> Vec<Tinted> {
    let sound = |color: Vec3| if color.is_finite() { color.clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::ONE };
    let of_triangle = |triangle: &[u32; 3]| {
        triangle
            .iter()
            .map(|corner| colors.get(*corner as usize).map_or(Vec3::ONE, |color| sound(*color)))
            .sum::<Vec3>()
            / 3.0
    };
    let mean = |triangles: &[[u32; 3]]| {
        let sum: glam::DVec3 = triangles.iter().map(|triangle| of_triangle(triangle).as_dvec3()).sum();
        (sum / triangles.len().max(1) as f64).as_vec3()
    };
    let all = mean(&mesh.triangles);
    if textured || (all - Vec3::ONE).abs().max_element() < UNSEEN {
        return vec![Tinted { color: all, mesh }];
    }
    let mut sorted: BTreeMap<[u8; 3], Vec<[u32; 3]>> = BTreeMap::new();
    for steps in STEPS {
        sorted.clear();
        for triangle in &mesh.triangles {
            // Square roots: steps of equal look.
            let key = of_triangle(triangle).to_array().map(|channel| (channel.sqrt() * steps).round() as u8);
            sorted.entry(key).or_default().push(*triangle);
        }
        if sorted.len() <= MOST_PARTS {
            break;
        }
    }
    sorted.into_values().map(|triangles| Tinted { color: mean(&triangles), mesh: only(&mesh, triangles) }).collect()
}

/// The part of a mesh that `triangles` use.
fn only(mesh: &PlantMesh, triangles: Vec<[u32; 3]>) -> PlantMesh {
    let mut part = PlantMesh::default();
    let mut numbers = vec![u32::MAX; mesh.positions.len()];
    for triangle in triangles {
        let corners = triangle.map(|corner| {
            let at = corner as usize;
            if numbers[at] == u32::MAX {
                numbers[at] = part.positions.len() as u32;
                part.positions.push(mesh.positions[at]);
                part.normals.push(mesh.normals[at]);
                part.uvs.push(mesh.uvs[at]);
            }
            numbers[at]
        });
        part.triangles.push(corners);
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_of_two_colours_becomes_two_parts() {
        let (brown, green) = (Vec3::new(0.2, 0.1, 0.05), Vec3::new(0.05, 0.3, 0.02));
        let mesh = PlantMesh {
            positions: (0..6).map(|n| Vec3::splat(n as f32)).collect(),
            normals: vec![Vec3::Y; 6],
            uvs: vec![glam::Vec2::ZERO; 6],
            triangles: vec![[0, 1, 2], [3, 4, 5]],
        };
        let colors = [brown, brown, brown, green, green, green];
        let parts = divide(mesh.clone(), &colors, false);
        assert_eq!(parts.len(), 2);
        assert!(parts.iter().all(|part| part.mesh.positions.len() == 3 && part.mesh.triangles.len() == 1));
        assert!(parts.iter().any(|part| (part.color - brown).length() < 1e-6));
        let whole = divide(mesh.clone(), &colors, true);
        assert!(whole.len() == 1 && (whole[0].color - 0.5 * (brown + green)).length() < 1e-6);
        assert_eq!(divide(mesh.clone(), &[Vec3::ONE; 6], false).len(), 1);
        // A gradient is sorted into few.
        let many: Vec<Vec3> = (0..6).map(|n| Vec3::splat(n as f32 / 6.0)).collect();
        assert!(divide(mesh, &many, false).len() <= MOST_PARTS);
    }
}
