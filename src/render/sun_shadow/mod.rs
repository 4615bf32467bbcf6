//! The shadow of the key light (sun or moon): our own depth maps, kept while nothing changed.
//!
//! Up to four square cascades around the camera ([`cascades`](crate::cull::cascades)), from near to far. Near trees cast as shadow proxies,
//! far ones as one picture that faces the light's azimuth plus the level picture, so that a cross that the sun sees
//! edge-on keeps its shadow. Casters between the light and a cascade are clamped onto its near plane.
//!
//! Cost: nothing while the light, the box and the casters rest; else one depth pass a changed cascade. A rounded
//! light and a stepped box make the map a function of the moment, not of the frames before; the rounding moves no
//! shadow by more than half a texel.
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
