//! Two forests in one world: `cargo run --release --example two_forests`.
//!
//! A dense stand of conifers in the west, broadleaves with clearings in the east, on a plane that the program creates.

use bevy::{math::DVec2, prelude::*};
use canopy::{
    prelude::*,
    scatter::{Area, ClearingNoise},
};

fn main() {
    App::new().add_plugins((DefaultPlugins, CanopyPlugins, plugin)).add_systems(Startup, camera).run();
}

/// Both forests and their light.
pub fn plugin(app: &mut App) {
    app.add_systems(Startup, setup);
}

fn setup(mut commands: Commands, assets: Res<AssetServer>, mut maps: ResMut<Assets<TerrainMap>>) -> Result {
    commands.spawn(Sun::default());
    let ground = commands.spawn(Terrain3d(maps.add(TerrainMap::flat(400.0)?))).id();
    let half = |center: f64| Area::centered(DVec2::new(center, 0.0), DVec2::new(160.0, 300.0));
    commands.spawn((
        Name::new("conifers"),
        Forest3d::scatter(400.0).on(ground).of(assets.load(PlantAsset::CONIFER), 1.0).area(half(-90.0)),
    ));
    commands.spawn((
        Name::new("broadleaves"),
        Forest3d::scatter(150.0)
            .on(ground)
            .of(assets.load(PlantAsset::BROADLEAF), 1.0)
            .area(half(90.0))
            .clearings(ClearingNoise { wavelength_m: 90.0, cover: 0.3, ..ClearingNoise::default() })
            .seed(2),
    ));
    Ok(())
}

fn camera(mut commands: Commands) {
    commands.spawn((CanopyCamera, Transform::from_xyz(0.0, 40.0, 200.0).looking_at(Vec3::ZERO, Vec3::Y)));
}
