//! One folder a GPU pass, each a plugin; what they share stands beside them.
//!
//! The way of a frame:
//!
//! ```text
//! extract ── frame (camera in f64, group 0) ── cull (lists of trees)
//!              │
//!              ├─ sun_shadow   only the cascades that changed        before Core3dSystems::MainPass
//!              ├─ (Bevy's own opaque meshes)
//!              ├─ forest       full models, crosses                  MainPass, after main_opaque_pass_3d
//!              ├─ terrain      tiles                                 after forest
//!              └─ sky          what is left                          before main_transparent_pass_3d
//! ```

pub mod components;
pub mod cull;
pub mod daylight;
mod extract;
pub mod forest;
pub mod frame;
mod gpu;
pub mod readback;
pub mod report;
pub mod shader_constants;
pub mod shaders;
pub mod sky;
pub mod sun_shadow;
pub mod terrain;

use bevy::{
    app::{App, Plugin},
    ecs::schedule::IntoScheduleConfigs,
    render::{ExtractSchedule, Render, RenderApp, RenderSystems},
};

/// All passes.
pub struct CanopyRenderPlugin;

impl Plugin for CanopyRenderPlugin {
    fn build(&self, app: &mut App) {
        let shaders = shaders::CanopyShaders::load(app);
        shaders.share(app, |app| app.get_sub_app_mut(RenderApp));
        let report = report::FrameReport::default();
        app.insert_resource(report.clone()).add_plugins(components::ComponentsPlugin);
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app
                .insert_resource(report)
                .init_resource::<extract::ExtractedScene>()
                .add_systems(ExtractSchedule, extract::extract_scene)
                .add_systems(Render, report::finish_report.in_set(RenderSystems::Cleanup));
        }
        app.add_plugins((
            frame::FramePlugin,
            sky::SkyPassPlugin,
            sun_shadow::SunShadowPassPlugin,
            terrain::TerrainPassPlugin,
            forest::ForestPassPlugin,
        ));
    }
}
