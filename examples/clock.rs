//! A day in two minutes: `cargo run --release --example clock`.
//!
//! The clock runs every frame; the light is computed in the background, as often as [`SunRefresh`] says.

use bevy::prelude::*;
use canopy::prelude::*;

fn main() {
    App::new().add_plugins((DefaultPlugins, CanopyPlugins, plugin)).add_observer(look).run();
}

/// The scene and its clock.
pub fn plugin(app: &mut App) {
    app.add_systems(Startup, set_up);
}

fn set_up(mut commands: Commands) -> Result {
    // The scene adds its own sun only if the world has none.
    let sun = Sun::at(48.0, 11.0, "2026-06-21T05:00+02:00")?.running(24.0 * 60.0 / 2.0);
    // A day in two minutes: the sun moves by three degrees a second, so a lag of half a minute of its clock is not
    // visible.
    commands.spawn((sun, SunRefresh::Background { lag: 30.0 }));
    commands.spawn(CanopyScene::new("assets/scenes/inventory.ron"));
    Ok(())
}

fn look(ready: On<SceneReady>, mut commands: Commands) {
    let height = ready.stage.terrain.height(0.0, 120.0) as f32 + 20.0;
    commands.spawn((CanopyCamera, Transform::from_xyz(0.0, height, 120.0)));
}
