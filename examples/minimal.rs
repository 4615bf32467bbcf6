//! A forest in a Bevy program: `cargo run --release --example minimal`.

use bevy::prelude::*;
use canopy::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let stage = Stage::build("assets/scenes/inventory.ron".as_ref(), &Overrides::default(), &mut Silent)?;
    App::new()
        .add_plugins((DefaultPlugins, CanopyPlugins))
        .insert_resource(stage.sky(stage.scene.place.time.utc()))
        .insert_resource(stage.shadow())
        .add_systems(Startup, move |mut commands: Commands| {
            commands.spawn(stage.ground());
            commands.spawn_batch(stage.forest());
            let height = stage.terrain.height(0.0, 120.0) as f32 + 20.0;
            commands.spawn((CanopyCamera, Transform::from_xyz(0.0, height, 120.0)));
        })
        .run();
    Ok(())
}
