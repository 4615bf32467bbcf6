//! Canopy's plugins among Bevy's: in any order, and where some of them are missing.

use bevy::{
    app::PluginsState,
    prelude::*,
    render::{RenderApp, RenderPlugin, pipelined_rendering::PipelinedRenderingPlugin},
    window::ExitCondition,
    winit::WinitPlugin,
};
use canopy::{
    CanopyPlugins,
    render::{forest::GpuForests, shaders::CanopyShaders},
};

use crate::support::gpu::gpu;

#[test]
fn canopy_may_stand_before_bevys_own_plugins() {
    let gpu = gpu();
    let mut app = App::new();
    app.add_plugins(CanopyPlugins);
    app.add_plugins(
        DefaultPlugins
            .set(WindowPlugin {
                primary_window: None,
                exit_condition: ExitCondition::DontExit,
                ..WindowPlugin::default()
            })
            .set(RenderPlugin { synchronous_pipeline_compilation: true, ..RenderPlugin::default() })
            .disable::<WinitPlugin>()
            .disable::<PipelinedRenderingPlugin>(),
    );
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
    let server = app.world().resource::<AssetServer>().clone();
    let loaded = |app: &App| app.world().resource::<CanopyShaders>().loaded(&server);
    while loaded(&app) == Ok(false) {
        app.update();
    }
    assert_eq!(loaded(&app), Ok(true));
    assert!(app.sub_app(RenderApp).world().contains_resource::<GpuForests>(), "the passes are not there");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn without_a_renderer_canopy_says_what_is_missing() {
    let gpu = gpu();
    let mut app = App::new();
    app.add_plugins(CanopyPlugins);
    app.finish();
    app.cleanup();
    app.update();
    let messages = gpu.messages();
    // One message of the renderer, one of the assets.
    assert_eq!(messages.len(), 2, "{messages:?}");
    assert!(messages.iter().any(|message| message.contains("draws nothing")), "{messages:?}");
    assert!(messages.iter().any(|message| message.contains("assets cannot be loaded")), "{messages:?}");
    assert!(messages.iter().all(|message| message.contains("DefaultPlugins")), "{messages:?}");
}
