//! The ground as meshes of stock Bevy.

use bevy::{
    app::App,
    asset::Assets,
    math::{DVec2, Vec2, Vec3, primitives::Plane3d},
    mesh::{Mesh, Mesh3d, Meshable},
    pbr::{MeshMaterial3d, StandardMaterial},
    prelude::Transform,
};

use super::{
    StockGround, StockScene, linear,
    trees::{add_material, build_mesh, matt},
};
use crate::app::ground_grid::{self, GridPiece};

/// Spawns the ground of `scene`.
pub fn spawn(app: &mut App, scene: &StockScene) {
    let material = add_material(app, StandardMaterial { base_color: linear(ground_grid::SOIL), ..matt() });
    let meshes = match scene.ground {
        StockGround::None => Vec::new(),
        StockGround::Flat => vec![Mesh::from(Plane3d::new(Vec3::Y, Vec2::splat(scene.reach as f32)).mesh())],
        StockGround::Terrain(terrain) => ground_grid::pieces(terrain, DVec2::splat(scene.reach)).map(mesh).collect(),
    };
    for mesh in meshes {
        let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
        app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material.clone()), Transform::default()));
    }
}

fn mesh(piece: GridPiece) -> Mesh {
    let uvs = piece.positions.iter().map(|position| Vec2::new(position.x, position.z) / 8.0).collect();
    build_mesh(piece.positions, piece.normals, uvs, piece.indices)
}
