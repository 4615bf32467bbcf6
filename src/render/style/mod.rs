//! The styles: watercolour [Luft 2006], lines and toon shading [Luft 2007, section 4], instead of the photographic picture.
//!
//! ```text
//! surfaces ───> illumination ──> blur ────────> particles ──> blur ──────> contours,    ──> picture, after
//! depth, layer, lighting map,    light, depth,  three         dabs, layers lines; noise     Bevy's tone
//! normal × k_a, soft shadow      normals        intensities   of the ID    for washes       mapping
//! albedo                                        of near trees image
//! ```
//!
//! A camera with a [`CanopyStyle`](super::components::CanopyStyle) draws the forest and the ground once, without light, into the maps; the photographic passes
//! of Canopy do not run for it. All that follows works on pixels, so that its cost does not depend on the number of trees.
//! A camera without a style has no pass, no texture and no binding of this folder.
//!
//! Limits: representations of a program's own are not drawn in a style unless their shader has the entry point that
//! [`LevelRenderer::styled`](super::forest::representation::LevelRenderer::styled) describes; Bevy's own meshes are not drawn
//! in it either.

mod blur;
mod contours;
mod full_screen;
mod illumination;
mod inputs;
mod layouts;
mod noise_map;
mod particles;
mod pass;
mod picture;
mod pipelines;
mod surfaces;
mod targets;
pub mod uniforms;

use bevy::{
    app::{App, Plugin},
    core_pipeline::{Core3d, Core3dSystems, tonemapping::tonemapping},
    ecs::schedule::IntoScheduleConfigs,
    render::{GpuResourceAppExt, Render, RenderApp},
};

use super::sets::{CanopyPasses, CanopyRenderSystems};

/// Draws cameras that have a [`CanopyStyle`](super::components::CanopyStyle).
pub struct StylePassPlugin;

impl Plugin for StylePassPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_gpu_resource::<pipelines::StylePipelines>()
            .init_gpu_resource::<inputs::StyleInputs>()
            .init_gpu_resource::<targets::StyleTargets>()
            .init_gpu_resource::<particles::StyleParticles>()
            .add_systems(
                Render,
                (
                    (targets::prepare_targets, inputs::prepare_inputs, particles::prepare_particles)
                        .chain()
                        .in_set(CanopyRenderSystems::Light),
                    pipelines::prepare_pipelines.in_set(CanopyRenderSystems::Pipelines),
                ),
            )
            .add_systems(
                Core3d,
                (
                    (
                        surfaces::surfaces_pass,
                        illumination::illumination_pass,
                        blur::maps_pass,
                        particles::particles_pass,
                        blur::shapes_pass,
                        contours::contours_pass,
                        noise_map::noise_map_pass,
                    )
                        .chain()
                        .in_set(CanopyPasses::Style),
                    picture::picture_pass.in_set(Core3dSystems::PostProcess).after(tonemapping),
                ),
            );
    }
}
