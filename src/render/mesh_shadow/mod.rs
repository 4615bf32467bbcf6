//! Trees in the shadow maps of Bevy's directional lights, so that ordinary meshes receive the shadow of the forest.
//!
//! Our own maps ([`sun_shadow`](super::sun_shadow)) are read by Canopy's shaders only; a `StandardMaterial` reads those
//! of its [`DirectionalLight`](bevy::light::DirectionalLight). Where such a light has `shadow_maps_enabled`, the
//! casters of each of its cascades are drawn into the map after Bevy's own. Nothing runs if no light has.
//!
//! Cost: Bevy clears its maps in every frame, so the casters are culled and drawn in every frame: one depth pass per
//! cascade. Limits: trees cast no shadow from point and spot lights; the terrain casts no shadow onto meshes.

mod casters;
mod draw;

use bevy::{
    app::{App, Plugin},
    core_pipeline::{Core3d, Core3dSystems},
    ecs::schedule::IntoScheduleConfigs,
    pbr::{LATE_SHADOW_PASS, per_view_shadow_pass},
    render::{GpuResourceAppExt, Render, RenderApp},
};

use super::sets::CanopyRenderSystems;

/// Draws trees into the shadow maps of Bevy's directional lights.
pub struct MeshShadowPlugin;

impl Plugin for MeshShadowPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_gpu_resource::<casters::MeshShadows>()
            .add_systems(Render, casters::prepare_mesh_shadows.in_set(CanopyRenderSystems::Cull))
            .add_systems(
                Core3d,
                draw::draw_mesh_shadows.after(per_view_shadow_pass::<LATE_SHADOW_PASS>).before(Core3dSystems::MainPass),
            );
    }
}
