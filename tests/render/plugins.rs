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
    components::{Forest3d, ForestPlugin, ScenePlugin, Sun, SunPlugin, Terrain3d},
    render::{forest::GpuForests, shaders::CanopyShaders},
};

use crate::support::gpu::{Gpu, gpu};

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

/// The messages of an app with these plugins after some frames.
fn messages_of(gpu: &Gpu, add: impl FnOnce(&mut App)) -> Vec<String> {
    let mut app = App::new();
    add(&mut app);
    app.finish();
    app.cleanup();
    for _ in 0..3 {
        app.update();
    }
    gpu.messages()
}

#[test]
fn beside_the_minimal_plugins_canopy_says_what_is_missing_in_either_order() {
    for first in [true, false] {
        let gpu = gpu();
        let messages = messages_of(&gpu, |app| {
            if first {
                app.add_plugins((CanopyPlugins, MinimalPlugins));
            } else {
                app.add_plugins((MinimalPlugins, CanopyPlugins));
            }
            // What a program spawns is there, and waits.
            app.world_mut().spawn(Sun::default());
            app.world_mut().spawn(Forest3d::scatter(10.0));
            app.world_mut().spawn(Terrain3d::default());
        });
        assert_eq!(messages.len(), 2, "{messages:?}");
        assert!(messages.iter().all(|message| message.contains("Canopy") && message.contains("DefaultPlugins")));
        for missing in ["AssetPlugin", "RenderPlugin", "CorePipelinePlugin"] {
            assert!(messages.iter().any(|message| message.contains(missing)), "{missing} is not named: {messages:?}");
        }
    }
}

#[test]
fn one_plugin_alone_names_those_that_it_needs() {
    let cases: [(fn(&mut App), &[&str]); 3] = [
        (|app| _ = app.add_plugins(ScenePlugin), &["CanopyRenderPlugin", "SunPlugin"]),
        (|app| _ = app.add_plugins((ScenePlugin, SunPlugin)), &["CanopyRenderPlugin"]),
        (|app| _ = app.add_plugins(ForestPlugin), &["CanopyRenderPlugin", "CanopyAssetPlugin"]),
    ];
    for (number, (add, missing)) in cases.into_iter().enumerate() {
        let gpu = gpu();
        let messages = messages_of(&gpu, |app| {
            app.add_plugins(MinimalPlugins);
            add(app);
        });
        assert_eq!(messages.len(), missing.len(), "{number}: {messages:?}");
        for name in missing {
            let named =
                |message: &String| message.contains(&format!("without `{name}`")) && message.contains("CanopyPlugins");
            assert!(messages.iter().any(named), "{number}: {name} is not named: {messages:?}");
        }
    }
}
