//! The order of Canopy's work in the render world, as public system sets. A program orders its own systems against
//! these sets. The passes do not refer to each other's systems.

use bevy::{
    app::SubApp,
    core_pipeline::{
        Core3d, Core3dSystems,
        core_3d::{main_opaque_pass_3d, main_transparent_pass_3d},
    },
    ecs::schedule::{IntoScheduleConfigs, SystemSet},
    render::{Render, RenderSystems},
};

/// What happens before a frame is drawn, within [`RenderSystems::PrepareResources`]: one set after the other, but `Cull` and
/// `Light` side by side.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CanopyRenderSystems {
    /// The view is found: its camera in f64, its frustum, its exposure.
    View,
    /// New or changed plants, trees and textures are uploaded.
    Upload,
    /// Trees, casters and terrain tiles are chosen.
    Cull,
    /// Tables of light are updated for the sun and the exposure.
    Light,
    /// Pipelines are requested.
    Pipelines,
}

/// What a view's frame draws, in this order, in the schedule [`Core3d`].
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CanopyPasses {
    /// Depth maps from the sun or the moon, before [`Core3dSystems::MainPass`].
    SunShadow,
    /// Trees, after Bevy's opaque meshes.
    Forest,
    /// The ground.
    Terrain,
    /// The sky, where nothing else was drawn, before Bevy's transparent meshes.
    Sky,
    /// The maps of a camera with a style, which has none of the others but the shadow.
    Style,
}

/// Orders the sets in the schedules of `render_app`.
pub(super) fn configure(render_app: &mut SubApp) {
    use CanopyRenderSystems::{Cull, Light, Pipelines, Upload, View};
    render_app
        .configure_sets(
            Render,
            (View, Upload, (Cull, Light), Pipelines).chain().in_set(RenderSystems::PrepareResources),
        )
        .configure_sets(Core3d, CanopyPasses::SunShadow.after(Core3dSystems::Prepass).before(Core3dSystems::MainPass))
        .configure_sets(
            Core3d,
            (CanopyPasses::Forest, CanopyPasses::Terrain, CanopyPasses::Sky, CanopyPasses::Style)
                .chain()
                .after(main_opaque_pass_3d)
                .before(main_transparent_pass_3d)
                .in_set(Core3dSystems::MainPass),
        );
}
