//! An image without a window or a display: `cargo run --release --example headless` writes `headless.png`.
//!
//! The program drives the frames itself: each `App::update` draws one. An image that must be complete waits for its forest
//! and its light; nothing else differs from a program with a window.

use std::error::Error;

use bevy::{
    app::PluginsState,
    asset::RenderAssetUsages,
    camera::RenderTarget,
    prelude::*,
    render::{
        RenderApp, RenderPlugin,
        pipelined_rendering::PipelinedRenderingPlugin,
        render_asset::RenderAssets,
        render_resource::{Extent3d, TextureDimension, TextureFormat, TextureUsages},
        renderer::{RenderDevice, RenderQueue},
        texture::GpuImage,
    },
    window::ExitCondition,
    winit::WinitPlugin,
};
use canopy::{
    prelude::*,
    render::{readback::read_rgb, shaders::CanopyShaders},
};
use image::RgbImage;

fn main() -> Result<(), Box<dyn Error>> {
    draw("assets/scenes/inventory.ron", UVec2::new(640, 360))?.save("headless.png")?;
    println!("headless.png");
    Ok(())
}

/// Whether the scene is built, and why not.
#[derive(Resource, Default)]
struct Outcome(Option<Result<(), String>>);

/// An image of the scene in the file `scene`.
pub fn draw(scene: &str, size: UVec2) -> Result<RgbImage, Box<dyn Error>> {
    let mut app = App::new();
    app.add_plugins(
        DefaultPlugins
            .set(WindowPlugin {
                primary_window: None,
                exit_condition: ExitCondition::DontExit,
                ..WindowPlugin::default()
            })
            // A frame waits for its pipelines, and is drawn in the update that began it.
            .set(RenderPlugin { synchronous_pipeline_compilation: true, ..RenderPlugin::default() })
            .disable::<PipelinedRenderingPlugin>()
            // Where Bevy's feature `bevy_winit` is off there is nothing to disable.
            .disable::<WinitPlugin>(),
    );
    app.add_plugins(CanopyPlugins).insert_resource(ForestUpdates::Blocking).init_resource::<Outcome>();
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();

    let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
    let usage = RenderAssetUsages::default();
    let mut target = Image::new_uninit(extent, TextureDimension::D2, TextureFormat::Rgba8UnormSrgb, usage);
    target.texture_descriptor.usage |= TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC;
    let target = app.world_mut().resource_mut::<Assets<Image>>().add(target);

    let camera_target = target.clone();
    let look = move |ready: On<SceneReady>, suns: Query<Entity, With<Sun>>, mut commands: Commands| {
        suns.iter().for_each(|sun| _ = commands.entity(sun).insert(SunRefresh::Immediate));
        let height = ready.stage.terrain.height(0.0, 120.0) as f32 + 20.0;
        let target = RenderTarget::from(camera_target.clone());
        commands.spawn((CanopyCamera, target, Transform::from_xyz(0.0, height, 120.0)));
        commands.insert_resource(Outcome(Some(Ok(()))));
    };
    let fail = |failed: On<SceneFailed>, mut outcome: ResMut<Outcome>| outcome.0 = Some(Err(failed.to_string()));
    app.world_mut().spawn(CanopyScene::new(scene)).observe(look).observe(fail);

    // The scene is built beside the updates, the first time with its plants, which takes a minute.
    let shaders_are_loaded =
        |app: &App| app.world().resource::<CanopyShaders>().loaded(app.world().resource::<AssetServer>());
    while app.world().resource::<Outcome>().0.is_none() || !shaders_are_loaded(&app)? {
        app.update();
        std::thread::yield_now();
    }
    if let Some(Err(error)) = &app.world().resource::<Outcome>().0 {
        return Err(error.clone().into());
    }
    // One update brings what was spawned, the next one draws it.
    for _ in 0..3 {
        app.update();
    }
    let world = app.sub_app(RenderApp).world();
    let image = world.resource::<RenderAssets<GpuImage>>().get(&target).ok_or("nothing was drawn")?;
    let pixels = read_rgb(world.resource::<RenderDevice>(), world.resource::<RenderQueue>(), &image.texture)?;
    Ok(RgbImage::from_raw(size.x, size.y, pixels).ok_or("an image of another size")?)
}
