//! One folder a GPU pass, each a plugin; what they share stands beside them.
//!
//! The way of a frame:
//!
//! ```text
//! extract ── view (camera in f64) ── cull (lists of trees) ── bindings (group 0)
//!              │
//!              ├─ sun_shadow   only the cascades that changed        before Core3dSystems::MainPass
//!              ├─ (Bevy's own opaque meshes)
//!              ├─ forest       full models, crosses                  MainPass, after main_opaque_pass_3d
//!              ├─ terrain      tiles                                 after forest
//!              └─ sky          what is left                          before main_transparent_pass_3d
//! ```
//!
//! The order is that of the public system [`sets`]. What one pass has for the others it writes into
//! [`bindings::SharedTextures`]; no pass names another one's systems.

pub mod bindings;
pub mod components;
pub mod daylight;
pub mod extract;
pub mod forest;
pub mod gpu;
pub mod readback;
pub mod report;
pub mod sets;
pub mod shaders;
pub mod sky;
pub mod stand_light;
pub mod sun_shadow;
pub mod terrain;
pub mod view;

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
            sets::configure(render_app);
            render_app
                .insert_resource(report)
                .init_resource::<extract::ExtractedScene>()
                .add_systems(ExtractSchedule, extract::extract_scene)
                .add_systems(Render, report::finish_report.in_set(RenderSystems::Cleanup));
        }
        app.add_plugins((
            view::ViewPlugin,
            bindings::BindingsPlugin,
            stand_light::StandLightPlugin,
            sky::SkyPassPlugin,
            sun_shadow::SunShadowPassPlugin,
            terrain::TerrainPassPlugin,
            forest::ForestPassPlugin,
        ));
    }
}
