//! A forest in a Bevy program: `cargo run --release --example minimal`.

use bevy::prelude::*;
use canopy::prelude::*;

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, CanopyPlugins, CanopyScenePlugin::new("assets/scenes/inventory.ron")))
        .add_systems(Update, (tell, look))
        .run();
}

fn tell(progress: Res<SceneProgress>, mut window: Single<&mut Window>) {
    if progress.is_changed() {
        window.title = match progress.state {
            SceneState::Building => format!("{}: {} of {}", progress.step, progress.done, progress.total),
            state => format!("{state:?}"),
        };
    }
}

fn look(mut commands: Commands, mut ready: MessageReader<SceneReady>) {
    for SceneReady { stage, .. } in ready.read() {
        let height = stage.terrain.height(0.0, 120.0) as f32 + 20.0;
        commands.spawn((CanopyCamera, Transform::from_xyz(0.0, height, 120.0)));
    }
}
