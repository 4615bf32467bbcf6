//! A forest built in code: `cargo run --release --example forest_in_code`.
//!
//! Plants and terrain are Bevy assets, the forest is a component. The first start bakes the plants, which takes a
//! minute; later starts load them from the cache.

use bevy::{math::DVec2, prelude::*};
use canopy::{prelude::*, scatter::Area};

fn main() {
    App::new().add_plugins((DefaultPlugins, CanopyPlugins, plugin)).add_systems(Startup, camera).run();
}

/// The forest and its light.
pub fn plugin(app: &mut App) {
    app.add_systems(Startup, setup);
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    commands.spawn(Sun::default());
    let broadleaf: Handle<PlantAsset> = assets.load(PlantAsset::BROADLEAF);
    let conifer: Handle<PlantAsset> = assets.load(PlantAsset::CONIFER);
    let ground = commands.spawn(Terrain3d(assets.load("terrain/jacksboro_6km.tif"))).id();
    commands
        .spawn(
            Forest3d::scatter(300.0)
                .on(ground)
                .of(broadleaf, 3.0)
                .of(conifer, 1.0)
                .min_distance(2.0)
                .area(Area::centered(DVec2::ZERO, DVec2::splat(300.0))),
        )
        .observe(|ready: On<ForestReady>| info!("{} trees", ready.trees))
        .observe(|failed: On<ForestFailed>| error!("no forest: {}", failed.error));
}

fn camera(mut commands: Commands) {
    // The valley is about 500 m above sea level; the camera is placed above its ground when the terrain is loaded.
    commands.spawn((CanopyCamera, Transform::from_xyz(0.0, 600.0, 220.0)));
    commands.add_observer(
        |ready: On<TerrainReady>,
         terrains: Query<&Terrain3d>,
         maps: Res<Assets<TerrainMap>>,
         mut camera: Single<&mut Transform, With<CanopyCamera>>| {
            let map = terrains.get(ready.entity).ok().and_then(|terrain| maps.get(&terrain.0));
            if let Some(map) = map {
                camera.translation.y = map.terrain.height(0.0, 220.0) as f32 + 40.0;
            }
        },
    );
}
