//! Ordinary Bevy meshes in a forest, which cast and receive shadows: `cargo run --release --example meshes`.

use bevy::prelude::*;
use canopy::prelude::*;

fn main() {
    App::new().add_plugins((DefaultPlugins, CanopyPlugins, plugin)).add_observer(look).run();
}

/// The scene, its sun and the meshes.
pub fn plugin(app: &mut App) {
    app.add_systems(Startup, set_up);
}

fn set_up(mut commands: Commands) {
    // Its DirectionalLight lights the meshes like the forest; `shadow_maps_enabled` is Bevy's own switch.
    commands.spawn((Sun::default(), DirectionalLight { shadow_maps_enabled: true, ..DirectionalLight::default() }));
    commands.spawn(CanopyScene::new("assets/scenes/one_tree.ron")).observe(place);
}

fn place(
    ready: On<SceneReady>,
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let ground = |x: f64, z: f64| ready.stage.terrain.height(x, z) as f32;
    let cube = meshes.add(Cuboid::from_length(2.0));
    let clay = materials.add(StandardMaterial { base_color: Color::srgb(0.6, 0.3, 0.2), ..default() });
    for (x, z) in [(-6.0, 8.0), (5.0, 9.0)] {
        commands.spawn((
            Mesh3d(cube.clone()),
            MeshMaterial3d(clay.clone()),
            Transform::from_xyz(x, ground(x.into(), z.into()) + 1.0, z),
            // Casts shadows onto trees and ground; the light's own shadow maps hold what trees cast onto it.
            CastsCanopyShadow,
        ));
    }
}

fn look(ready: On<SceneReady>, mut commands: Commands) {
    let eye = Vec3::new(0.0, ready.stage.terrain.height(0.0, 26.0) as f32 + 3.0, 26.0);
    commands.spawn((CanopyCamera, Transform::from_translation(eye).looking_at(Vec3::Y * 4.0, Vec3::Y)));
}
