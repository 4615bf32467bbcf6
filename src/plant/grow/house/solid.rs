//! Opaque bodies: tubes, turned bodies, boxes.

use std::f32::consts::TAU;

use glam::{Quat, Vec2, Vec3};

use crate::plant::PlantMesh;

/// Adds a tube along `points`, each with a radius in metres; its end is closed with a point. Texture coordinates are in
/// metres.
pub(super) fn tube(mesh: &mut PlantMesh, points: &[(Vec3, f32)], sides: usize) {
    let sides = sides.max(3);
    if points.len() < 2 {
        return;
    }
    let first = mesh.positions.len();
    let mut around = Vec3::ZERO;
    let mut length = 0.0;
    for (i, &(center, radius)) in points.iter().enumerate() {
        let (before, after) = (points[i.saturating_sub(1)].0, points[(i + 1).min(points.len() - 1)].0);
        let along = (after - before).normalize_or(Vec3::Y);
        around = (around - along * around.dot(along)).normalize_or(along.any_orthonormal_vector());
        length += center.distance(before);
        for side in 0..=sides {
            let turn = side as f32 / sides as f32;
            let radial = Quat::from_axis_angle(along, TAU * turn) * around;
            mesh.positions.push(center + radial * radius);
            mesh.normals.push(radial);
            mesh.uvs.push(Vec2::new(turn * TAU * points[0].1, length));
        }
    }
    let stride = sides + 1;
    for ring in 0..points.len() - 1 {
        for side in 0..sides {
            let at = |r: usize, s: usize| (first + (ring + r) * stride + side + s) as u32;
            mesh.triangles.push([at(0, 0), at(0, 1), at(1, 1)]);
            mesh.triangles.push([at(0, 0), at(1, 1), at(1, 0)]);
        }
    }
    let (end, before) = (points[points.len() - 1], points[points.len() - 2]);
    let along = (end.0 - before.0).normalize_or(Vec3::Y);
    let tip = mesh.positions.len() as u32;
    mesh.positions.push(end.0 + along * (0.7 * end.1));
    mesh.normals.push(along);
    mesh.uvs.push(Vec2::new(0.0, length + end.1));
    let last = (first + (points.len() - 1) * stride) as u32;
    for side in 0..sides as u32 {
        mesh.triangles.push([last + side, last + side + 1, tip]);
    }
}

/// Adds a body of revolution about the upright axis through `foot`: `profile` has radius and height of its outline, from
/// the bottom outside, over the rim, to the inside. Texture coordinates are in metres.
pub(super) fn turned(mesh: &mut PlantMesh, foot: Vec3, profile: &[Vec2], sides: usize) {
    let sides = sides.max(3);
    let widest = profile.iter().fold(0.0f32, |most, point| most.max(point.x));
    let mut length = 0.0;
    // Each piece of the profile has its own rings, so that its edges stay sharp where they are.
    for (piece, pair) in profile.windows(2).enumerate() {
        let edge = pair[1] - pair[0];
        if edge.length_squared() < 1e-12 {
            continue;
        }
        let own = Vec2::new(edge.y, -edge.x).normalize_or(Vec2::X);
        let beside = |other: Option<Vec2>| {
            let other = other.map_or(own, |edge| Vec2::new(edge.y, -edge.x).normalize_or(own));
            // Edges blunter than 40 degrees are rounded.
            if other.dot(own) > 0.766 { (own + other).normalize_or(own) } else { own }
        };
        let normals = [
            beside(piece.checked_sub(1).map(|before| profile[before + 1] - profile[before])),
            beside(profile.get(piece + 2).map(|&after| after - profile[piece + 1])),
        ];
        let first = mesh.positions.len() as u32;
        for (point, normal) in pair.iter().zip(normals) {
            for side in 0..=sides {
                let turn = side as f32 / sides as f32;
                let (sin, cos) = (TAU * turn).sin_cos();
                mesh.positions.push(foot + Vec3::new(point.x * cos, point.y, point.x * sin));
                mesh.normals.push(Vec3::new(normal.x * cos, normal.y, normal.x * sin).normalize_or(Vec3::Y));
                let along = length + if point == &pair[0] { 0.0 } else { edge.length() };
                mesh.uvs.push(Vec2::new(turn * TAU * widest, -along));
            }
        }
        length += edge.length();
        let stride = sides as u32 + 1;
        for side in 0..sides as u32 {
            let (a, b) = (first + side, first + stride + side);
            mesh.triangles.push([a, b, b + 1]);
            mesh.triangles.push([a, b + 1, a + 1]);
        }
    }
}

/// Adds a box with the half extents `half` about `center`, rotated by `turn`. Texture coordinates are in metres, u along
/// the longer horizontal side.
pub(super) fn block(mesh: &mut PlantMesh, center: Vec3, half: Vec3, turn: Quat) {
    for (normal, u, v) in [
        (Vec3::X, Vec3::NEG_Z, Vec3::Y),
        (Vec3::NEG_X, Vec3::Z, Vec3::Y),
        (Vec3::Y, Vec3::X, Vec3::NEG_Z),
        (Vec3::NEG_Y, Vec3::X, Vec3::Z),
        (Vec3::Z, Vec3::X, Vec3::Y),
        (Vec3::NEG_Z, Vec3::NEG_X, Vec3::Y),
    ] {
        let first = mesh.positions.len() as u32;
        for (s, t) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let local = (normal + u * s + v * t) * half;
            mesh.positions.push(center + turn * local);
            mesh.normals.push((turn * normal).normalize_or(Vec3::Y));
            let flat = Vec2::new(u.dot(local), -v.dot(local));
            mesh.uvs.push(flat + Vec2::new(center.x + center.z, 0.7 * center.y));
        }
        mesh.triangles.push([first, first + 1, first + 2]);
        mesh.triangles.push([first, first + 2, first + 3]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles face as their normals do.
    fn check(mesh: &PlantMesh) {
        assert!(mesh.is_whole() && !mesh.triangles.is_empty());
        for corners in &mesh.triangles {
            let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
            let normal: Vec3 = corners.iter().map(|&corner| mesh.normals[corner as usize]).sum();
            let flat = (b - a).cross(c - a);
            assert!(flat.length() < 1e-9 || flat.dot(normal) > 0.0, "{corners:?}");
        }
        assert!(mesh.normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-4));
    }

    #[test]
    fn bodies_face_outwards() {
        let mut mesh = PlantMesh::default();
        tube(&mut mesh, &[(Vec3::ZERO, 0.02), (Vec3::Y * 0.3, 0.02), (Vec3::new(0.2, 0.5, 0.0), 0.01)], 8);
        check(&mesh);
        let mut mesh = PlantMesh::default();
        block(&mut mesh, Vec3::Y, Vec3::new(1.0, 2.0, 3.0), Quat::from_rotation_y(0.3));
        check(&mesh);
        let mut mesh = PlantMesh::default();
        turned(
            &mut mesh,
            Vec3::ZERO,
            &[Vec2::new(0.1, 0.0), Vec2::new(0.13, 0.2), Vec2::new(0.11, 0.2), Vec2::new(0.11, 0.1)],
            24,
        );
        check(&mesh);
    }
}
