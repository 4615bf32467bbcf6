//! The shadow of the key light (sun or moon): our own depth maps, kept until something changes.
//!
//! Up to four square cascades around the camera ([`cascades`](crate::cull::cascades)), from near to far. Near trees
//! cast as shadow proxies. Far trees cast as one billboard that faces the light's azimuth and the horizontal one, so
//! that a cross that the sun sees edge-on keeps its shadow. Casters between the light and a cascade are clamped onto
//! its near plane.
//!
//! Cost: nothing while light, box and casters do not change; else one depth pass per changed cascade. The light's
//! direction is rounded and the box moves in steps, so a map depends on the current state only, not on earlier frames.
//! The rounding moves no shadow by more than half a texel.
//!
//! Limits: no translucent shadows; the terrain casts through [`GroundMap`](super::terrain::GroundMap), at its
//! resolution.

mod maps;
mod meshes;
mod pass;
mod redraw;

use bevy::{
    app::{App, Plugin},
    core_pipeline::Core3d,
    ecs::schedule::IntoScheduleConfigs,
    render::{GpuResourceAppExt, Render, RenderApp},
};

use super::sets::{CanopyPasses, CanopyRenderSystems};
pub use maps::ShadowMaps;
pub use redraw::collect_caster_counts;

/// Draws the sun's shadow maps.
pub struct SunShadowPassPlugin;

impl Plugin for SunShadowPassPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_gpu_resource::<ShadowMaps>()
            .init_gpu_resource::<meshes::MeshCasters>()
            .add_systems(
                Render,
                (meshes::prepare_mesh_casters, redraw::prepare_shadows, redraw::share_maps)
                    .chain()
                    .in_set(CanopyRenderSystems::Cull),
            )
            .add_systems(Core3d, pass::sun_shadow_pass.in_set(CanopyPasses::SunShadow));
    }
}
