//! A forest in a Bevy program: `cargo run --release --example minimal`.

use bevy::prelude::*;
use canopy::prelude::*;

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, CanopyPlugins))
        .add_systems(Startup, set_up)
        .add_systems(Update, show_progress)
        .run();
}

fn set_up(mut commands: Commands) {
    commands.spawn(CanopyScene::new("assets/scenes/inventory.ron")).observe(look);
}

fn look(ready: On<SceneReady>, mut commands: Commands) {
    let height = ready.stage.terrain.height(0.0, 120.0) as f32 + 20.0;
    commands.spawn((CanopyCamera, Transform::from_xyz(0.0, height, 120.0)));
}

fn show_progress(progress: Single<&SceneProgress, Changed<SceneProgress>>, mut window: Single<&mut Window>) {
    window.title = match progress.state {
        SceneState::Building => format!("{}: {} of {}", progress.step, progress.done, progress.total),
        state => format!("{state:?}"),
    };
}
