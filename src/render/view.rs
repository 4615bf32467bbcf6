//! The view of a frame: its camera in f64, its frustum and its exposure.
//!
//! Positions on the GPU are relative to the camera: the view matrix here has no translation, and every pass subtracts
//! the camera's f64 position on the CPU. A scene a million metres from the origin is drawn as precisely as one at the
//! origin.

use bevy::{
    app::{App, Plugin},
    asset::Handle,
    core_pipeline::prepass::{DeferredPrepass, MotionVectorPrepass},
    ecs::{
        entity::Entity,
        query::{Has, With},
        resource::Resource,
        schedule::IntoScheduleConfigs,
        system::{Query, Res, ResMut},
    },
    log::{error_once, warn_once},
    render::{
        Render, RenderApp,
        camera::ExtractedCamera,
        render_resource::{
            ColorTargetState, ColorWrites, DepthStencilState, FragmentState, MultisampleState,
            RenderPipelineDescriptor, TextureFormat, VertexState,
        },
        view::{ExtractedView, Msaa},
    },
    shader::{Shader, ShaderDefVal},
};
use glam::{DVec3, Mat4, Vec2};

use super::{
    components::{CameraOpenness, CanopyCamera, DrawnStyle, ViewOptions},
    extract::ExtractedScene,
    sets::CanopyRenderSystems,
};
use crate::{
    cull::Frustum,
    lod::{Levels, level_distance::NOMINAL_FIELD_OF_VIEW},
    style::Deviations,
};

/// The camera's colour attachment, on which the pipelines of all passes depend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ViewFormat {
    /// Format of a texel.
    pub color: TextureFormat,
    /// Samples per pixel, 1 or 4.
    pub samples: u32,
}

impl ViewFormat {
    /// Some format, for what does not depend on it.
    pub const ANY: Self = Self { color: TextureFormat::Rgba16Float, samples: 1 };

    /// A pipeline that draws into the attachment with the entry points `vertex` and `fragment` of `shader`, under
    /// `defs`.
    pub fn pipeline(
        self,
        shader: &Handle<Shader>,
        defs: Vec<ShaderDefVal>,
        depth: DepthStencilState,
    ) -> RenderPipelineDescriptor {
        RenderPipelineDescriptor {
            vertex: VertexState {
                shader: shader.clone(),
                shader_defs: defs.clone(),
                entry_point: Some("vertex".into()),
                ..Default::default()
            },
            depth_stencil: Some(depth),
            multisample: MultisampleState { count: self.samples, ..Default::default() },
            fragment: Some(FragmentState {
                shader: shader.clone(),
                shader_defs: defs,
                entry_point: Some("fragment".into()),
                targets: vec![Some(ColorTargetState { format: self.color, blend: None, write_mask: ColorWrites::ALL })],
            }),
            ..Default::default()
        }
    }
}

/// The view of this frame, prepared for all passes.
pub struct PreparedView {
    /// Render-world entity of the camera.
    pub entity: Entity,
    /// Camera position in scene metres.
    pub camera: DVec3,
    /// Camera-relative metres to clip space.
    pub clip_from_relative: Mat4,
    /// Planes for culling, camera-relative.
    pub frustum: Frustum,
    /// The attachment that its pipelines draw into.
    pub attachment: ViewFormat,
    /// Focal length in pixels (vertical).
    pub focal_pixels: f32,
    /// Factor on the distances of levels of detail: its focal length over that of [`NOMINAL_FIELD_OF_VIEW`].
    pub zoom: f32,
    /// Factor from radiance to the attachment's values.
    pub exposure: f32,
    /// How open the camera's place is, 0..1 ([`CameraOpenness`]).
    pub openness: f32,
    /// Options of the camera.
    pub options: ViewOptions,
    /// Whether it is drawn in a style, without the photographic passes.
    pub styled: bool,
    /// How many pixels the Gaussians of its style make into one, at least 1. Trees give way to the surface of the forest as many times
    /// sooner.
    pub blur: f32,
}

impl PreparedView {
    /// `levels` at the distances that they have in this view.
    pub fn levels(&self, levels: &Levels) -> Levels {
        levels.in_view(self.zoom, self.focal_pixels).blurred(self.blur)
    }
}

/// The one view that Canopy draws, if there is one.
#[derive(Resource, Default)]
pub struct PreparedFrame {
    /// `None` while no camera has a [`CanopyCamera`].
    pub view: Option<PreparedView>,
}

/// Finds the view of each frame.
pub struct ViewPlugin;

impl Plugin for ViewPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app.init_resource::<PreparedFrame>().add_systems(Render, prepare_view.in_set(CanopyRenderSystems::View));
    }
}

/// Finds the camera, rejects what cannot be drawn correctly, and computes the camera's f64 position.
fn prepare_view(
    scene: Res<ExtractedScene>,
    cameras: Query<
        (
            Entity,
            &ExtractedView,
            &ExtractedCamera,
            &Msaa,
            Option<&ViewOptions>,
            Option<&CameraOpenness>,
            Has<MotionVectorPrepass>,
            Has<DeferredPrepass>,
            Option<&DrawnStyle>,
        ),
        With<CanopyCamera>,
    >,
    mut frame: ResMut<PreparedFrame>,
) {
    frame.view = None;
    let mut views: Vec<_> = cameras.iter().collect();
    views.sort_by_key(|(entity, _, camera, ..)| (camera.order, *entity));
    if views.len() > 1 {
        error_once!(
            "{} cameras have a CanopyCamera, but Canopy draws one view a frame: only the first is drawn. Remove the \
             component from the others.",
            views.len()
        );
    }
    let Some((entity, view, camera, msaa, options, openness, motion_vectors, deferred, style)) =
        views.into_iter().next()
    else {
        return;
    };
    if motion_vectors {
        error_once!(
            "a CanopyCamera asks for motion vectors (temporal anti-aliasing or motion blur), which Canopy's passes do \
             not write: nothing of Canopy is drawn. Use MSAA, or remove MotionVectorPrepass."
        );
        return;
    }
    if deferred {
        error_once!(
            "a CanopyCamera renders deferred, which Canopy's passes do not support: nothing of Canopy is drawn. \
             Remove DeferredPrepass."
        );
        return;
    }
    if view.clip_from_view.w_axis.w != 0.0 {
        error_once!(
            "a CanopyCamera is orthographic, but sky, fog and levels of detail are made for perspective: nothing of \
             Canopy is drawn. Give the camera a perspective projection."
        );
        return;
    }
    let (_, rotation, translation) = view.world_from_view.to_scale_rotation_translation();
    if !(translation.is_finite() && rotation.is_finite() && view.clip_from_view.is_finite()) {
        warn_once!("the camera's transform or projection is not finite: Canopy draws nothing until it is");
        return;
    }
    let clip_from_relative = view.clip_from_view * Mat4::from_quat(rotation.inverse());
    let size = Vec2::new(view.viewport.z as f32, view.viewport.w as f32).max(Vec2::ONE);
    frame.view = Some(PreparedView {
        entity,
        camera: scene.origin + translation.as_dvec3(),
        clip_from_relative,
        frustum: Frustum::new(&clip_from_relative),
        attachment: ViewFormat { color: view.target_format, samples: msaa.samples() },
        focal_pixels: 0.5 * size.y * view.clip_from_view.y_axis.y.abs(),
        zoom: view.clip_from_view.y_axis.y.abs() * (0.5 * NOMINAL_FIELD_OF_VIEW).tan(),
        exposure: camera.exposure,
        // What is not a number counts as the open.
        openness: match openness {
            Some(CameraOpenness(share)) if *share < 1.0 => share.max(0.0),
            _ => 1.0,
        },
        options: options.copied().unwrap_or_default(),
        styled: style.is_some(),
        blur: style.map_or(1.0, |drawn| Deviations::of(&drawn.style).blur(size.y)),
    });
}
