//! The GPU passes: one folder and one plugin per pass. Shared code is next to the folders.
//!
//! The steps of a frame:
//!
//! ```text
//! extract ── view (camera in f64) ── cull (lists of trees) ── bindings (group 0)
//!              │
//!              ├─ cull         lists of trees, where the device makes them, before all cameras
//!              ├─ sun_shadow   only the cascades that changed        before Core3dSystems::MainPass
//!              ├─ mesh_shadow  trees in Bevy's own shadow maps       after Bevy's casters
//!              ├─ (Bevy's own opaque meshes)
//!              ├─ forest       full models, crosses                  MainPass, after main_opaque_pass_3d
//!              ├─ terrain      tiles                                 after forest
//!              ├─ sky          the rest of the image                 before main_transparent_pass_3d
//!              └─ style        instead of these, for a styled camera  MainPass, and after tone mapping
//! ```
//!
//! The public system [`sets`] define the order. A pass that produces something for other passes writes it into
//! [`bindings::SharedTextures`]. No pass refers to the systems of another.

pub mod bindings;
pub mod camera_style;
pub mod components;
pub mod cull;
pub mod diagnostics;
pub mod exposure;
pub mod extract;
mod follow;
pub mod forest;
pub mod frame_work;
pub mod gpu;
mod light_table;
pub mod mesh_shadow;
pub mod readback;
pub mod report;
pub mod sets;
pub mod shader_constants;
pub mod shaders;
pub mod sky;
pub mod stand_light;
pub mod style;
pub mod sun_shadow;
pub mod terrain;
pub mod view;

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, io::embedded::EmbeddedAssetRegistry},
    core_pipeline::CorePipelinePlugin,
    ecs::schedule::IntoScheduleConfigs,
    log::error,
    render::{ExtractSchedule, Render, RenderApp, RenderSystems},
};

/// All passes. May be added before or after Bevy's own plugins. If one of those is missing, it logs an error and draws
/// nothing.
pub struct CanopyRenderPlugin;

impl Plugin for CanopyRenderPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<report::FrameReport>();
    }

    // All other plugins are built by now, in whatever order they were added.
    fn finish(&self, app: &mut App) {
        app.add_plugins(components::ComponentsPlugin);
        let has_pipeline = app.is_plugin_added::<CorePipelinePlugin>();
        let report = app.world().resource::<report::FrameReport>().clone();
        let assets = app.world().get_resource::<EmbeddedAssetRegistry>().zip(app.world().get_resource::<AssetServer>());
        let shaders = assets.map(|(registry, server)| shaders::CanopyShaders::load(registry, server));
        let (Some(shaders), Some(render_app), true) = (shaders, app.get_sub_app_mut(RenderApp), has_pipeline) else {
            error!(
                "Canopy draws nothing: the app needs AssetPlugin, RenderPlugin (with a graphics device) and \
                 CorePipelinePlugin; Bevy's DefaultPlugins have them."
            );
            return;
        };
        sets::configure(render_app);
        render_app
            .insert_resource(report)
            .insert_resource(shaders.clone())
            .init_resource::<extract::ExtractedScene>()
            .add_systems(ExtractSchedule, extract::extract_scene)
            .add_systems(Render, report::finish_report.in_set(RenderSystems::Cleanup));
        app.insert_resource(shaders).add_plugins((
            view::ViewPlugin,
            bindings::BindingsPlugin,
            stand_light::StandLightPlugin,
            cull::CullPlugin,
            sky::SkyPassPlugin,
            sun_shadow::SunShadowPassPlugin,
            mesh_shadow::MeshShadowPlugin,
            terrain::TerrainPassPlugin,
            forest::ForestPassPlugin,
            style::StylePassPlugin,
        ));
    }
}
