//! The ground as meshes of stock Bevy.

use bevy::{
    app::App,
    asset::Assets,
    math::{Vec2, Vec3, primitives::Plane3d},
    mesh::{Mesh, Mesh3d, Meshable},
    pbr::{MeshMaterial3d, StandardMaterial},
    prelude::Transform,
};

use super::{
    StockGround, StockScene, linear,
    trees::{add_material, build_mesh, matt},
};
use crate::terrain::Terrain;

/// The most quads along a side of the whole ground: two million triangles.
const MOST_QUADS: u32 = 1024;
/// Quads along a side of one mesh, which is culled by itself.
const MESH_QUADS: u32 = 64;

/// Spawns the ground of `scene`.
pub fn spawn(app: &mut App, scene: &StockScene) {
    let material = StandardMaterial { base_color: linear(Vec3::new(0.06, 0.05, 0.025)), ..matt() };
    match scene.ground {
        StockGround::None => {}
        StockGround::Flat => {
            let plane = Plane3d::new(Vec3::Y, Vec2::splat(scene.reach as f32)).mesh();
            let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(Mesh::from(plane));
            let material = add_material(app, material);
            app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material), Transform::default()));
        }
        StockGround::Terrain(terrain) => {
            let material = add_material(app, material);
            for mesh in meshes(terrain, scene.reach) {
                let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
                app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material.clone()), Transform::default()));
            }
        }
    }
}

/// Squares of a grid over `terrain`, up to `reach` metres from the origin: as fine as the data, or as [`MOST_QUADS`] allow.
fn meshes(terrain: &Terrain, reach: f64) -> Vec<Mesh> {
    let finest = terrain.field().spacing().min_element().max(1e-3);
    let pieces =
        (2.0 * reach / finest / f64::from(MESH_QUADS)).ceil().clamp(1.0, f64::from(MOST_QUADS / MESH_QUADS)) as u32;
    let step = 2.0 * reach / f64::from(pieces * MESH_QUADS);
    let across = || 0..pieces;
    across().flat_map(|row| across().map(move |column| piece(terrain, reach, step, column, row))).collect()
}

fn piece(terrain: &Terrain, reach: f64, step: f64, column: u32, row: u32) -> Mesh {
    let side = MESH_QUADS + 1;
    let at = |piece: u32, quad: u32| f64::from(piece * MESH_QUADS + quad) * step - reach;
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    for (j, i) in (0..side).flat_map(|j| (0..side).map(move |i| (j, i))) {
        let (x, z) = (at(column, i), at(row, j));
        positions.push(Vec3::new(x as f32, terrain.height(x, z) as f32, z as f32));
        normals.push(terrain.normal(x, z));
    }
    let uvs = positions.iter().map(|position| Vec2::new(position.x, position.z) / 8.0).collect();
    let quad = |(j, i): (u32, u32)| {
        let first = j * side + i;
        [first, first + side, first + 1, first + 1, first + side, first + side + 1]
    };
    let indices = (0..MESH_QUADS).flat_map(|j| (0..MESH_QUADS).map(move |i| (j, i))).flat_map(quad).collect();
    build_mesh(positions, normals, uvs, indices)
}

#[cfg(test)]
mod tests {
    use bevy::math::DVec2;

    use super::*;
    use crate::terrain::{HeightField, Surroundings};

    #[test]
    fn the_ground_reaches_its_border_faces_up_and_stays_within_the_most_triangles() {
        let field = HeightField::new(3, 3, DVec2::splat(5.0), (0..9).map(|height| height as f32).collect()).unwrap();
        let terrain = Terrain::new(field, None, Surroundings::Mirror);
        for (reach, count) in [(10.0, 1), (1000.0, 49), (1e6, 256)] {
            let found = meshes(&terrain, reach);
            assert_eq!(found.len(), count, "{reach} m");
            let mut border = 0.0f32;
            for mesh in &found {
                for triangle in mesh.triangles().unwrap() {
                    let [a, b, c] = triangle.vertices;
                    assert!((b - a).cross(c - a).y > 0.0, "{triangle:?}");
                    border = border.max(a.x.max(b.x).max(c.x));
                }
            }
            assert!((f64::from(border) - reach).abs() < 1e-4 * reach, "{border} m of {reach} m");
        }
    }
}
