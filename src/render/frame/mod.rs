//! What all passes of a view share: the camera in f64, the exposure, and bind group 0.
//!
//! Positions on the GPU are relative to the camera: the view matrix here has no translation, and every pass subtracts
//! the camera's f64 position on the CPU. A scene a million metres from the origin draws as steadily as one at it.

mod light;
mod stand;
pub mod uniforms;

use bevy::{
    app::{App, Plugin},
    core_pipeline::prepass::{DeferredPrepass, MotionVectorPrepass},
    ecs::{
        entity::Entity,
        query::{Has, With},
        resource::Resource,
        schedule::IntoScheduleConfigs,
        system::{Query, Res, ResMut},
        world::{FromWorld, World},
    },
    log::{error_once, warn_once},
    render::{
        GpuResourceAppExt, Render, RenderApp, RenderSystems,
        camera::ExtractedCamera,
        render_resource::{
            AddressMode, BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            BufferUsages, CompareFunction, FilterMode, PipelineCache, Sampler, SamplerBindingType, SamplerDescriptor,
            ShaderStages, TextureFormat, TextureSampleType,
            binding_types::{sampler, texture_2d, uniform_buffer_sized},
        },
        renderer::{RenderDevice, RenderQueue},
        view::{ExtractedView, Msaa},
    },
};
use glam::{DVec3, Mat4, Vec2};

use super::{
    components::CanopyCamera, cull::Frustum, extract::ExtractedScene, gpu, sky::SkyTexture, sun_shadow::ShadowMaps,
    terrain::GroundMap,
};
use stand::{StandTexture, upload_stand_light};
use uniforms::{FrameUniform, LightUniform, NOISE_PERIOD, ShadowUniform};

/// Layout of bind group 0.
#[derive(Resource)]
pub struct FrameLayout(pub BindGroupLayoutDescriptor);

impl FromWorld for FrameLayout {
    fn from_world(_: &mut World) -> Self {
        let size = |bytes: usize| std::num::NonZeroU64::new(bytes as u64);
        let depth_array = bevy::render::render_resource::binding_types::texture_2d_array(TextureSampleType::Depth);
        Self(BindGroupLayoutDescriptor::new(
            "canopy_frame",
            &BindGroupLayoutEntries::sequential(
                ShaderStages::VERTEX_FRAGMENT,
                (
                    uniform_buffer_sized(false, size(size_of::<FrameUniform>())),
                    uniform_buffer_sized(false, size(size_of::<LightUniform>())),
                    uniform_buffer_sized(false, size(size_of::<ShadowUniform>())),
                    texture_2d(TextureSampleType::Float { filterable: true }),
                    sampler(SamplerBindingType::Filtering),
                    depth_array,
                    sampler(SamplerBindingType::Comparison),
                    texture_2d(TextureSampleType::Float { filterable: true }),
                    texture_2d(TextureSampleType::Float { filterable: true }),
                ),
            ),
        ))
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
    /// Colour format of the camera's attachment.
    pub format: TextureFormat,
    /// 1 or 4.
    pub samples: u32,
    /// Focal length in pixels (vertical).
    pub focal_pixels: f32,
    /// Factor from radiance to the attachment's values.
    pub exposure: f32,
}

/// The one view that Canopy draws, if a camera asks for it.
#[derive(Resource, Default)]
pub struct PreparedFrame {
    /// `None` while no camera has a [`CanopyCamera`].
    pub view: Option<PreparedView>,
}

/// Group 0 of this frame and the view that it belongs to; nothing while a part of it is missing.
#[derive(Resource, Default)]
pub struct FrameBindGroup(Option<(Entity, BindGroup)>);

impl FrameBindGroup {
    /// Group 0 for the view `entity`; `None` for every view but the one that Canopy draws.
    pub fn of(&self, entity: Entity) -> Option<&BindGroup> {
        self.0.as_ref().filter(|(view, _)| *view == entity).map(|(_, group)| group)
    }
}

#[derive(Resource)]
struct FrameBuffers {
    frame: Buffer,
    light: Buffer,
    shadow: Buffer,
    clamp_sampler: Sampler,
    shadow_sampler: Sampler,
}

impl FromWorld for FrameBuffers {
    fn from_world(world: &mut World) -> Self {
        let device = world.resource::<RenderDevice>();
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let clamp = |compare: Option<CompareFunction>| {
            device.create_sampler(&SamplerDescriptor {
                label: Some("canopy_frame"),
                address_mode_u: AddressMode::ClampToEdge,
                address_mode_v: AddressMode::ClampToEdge,
                mag_filter: FilterMode::Linear,
                min_filter: FilterMode::Linear,
                compare,
                ..Default::default()
            })
        };
        Self {
            frame: gpu::buffer_with(device, "canopy_frame", usage, &[FrameUniform::default()]),
            light: gpu::buffer_with(device, "canopy_light", usage, &[LightUniform::default()]),
            shadow: gpu::buffer_with(device, "canopy_shadow", usage, &[ShadowUniform::default()]),
            clamp_sampler: clamp(None),
            // Reversed depth: a point is lit where it is at least as near to the light as the map.
            shadow_sampler: clamp(Some(CompareFunction::GreaterEqual)),
        }
    }
}

/// Prepares the view's frame and bind group 0.
pub struct FramePlugin;

impl Plugin for FramePlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_gpu_resource::<FrameLayout>()
            .init_gpu_resource::<FrameBuffers>()
            .init_gpu_resource::<StandTexture>()
            .init_resource::<PreparedFrame>()
            .init_resource::<FrameBindGroup>()
            .add_systems(
                Render,
                (
                    prepare_frame.in_set(RenderSystems::PrepareResources),
                    upload_stand_light
                        .in_set(RenderSystems::PrepareResources)
                        .after(prepare_frame)
                        .after(super::forest::prepare_forests),
                    prepare_bind_group.in_set(RenderSystems::PrepareBindGroups),
                ),
            );
    }
}

/// Finds the camera, refuses what cannot be drawn right, and fixes the camera's f64 place.
pub fn prepare_frame(
    scene: Res<ExtractedScene>,
    cameras: Query<
        (Entity, &ExtractedView, &ExtractedCamera, &Msaa, Has<MotionVectorPrepass>, Has<DeferredPrepass>),
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
    let Some((entity, view, camera, msaa, motion_vectors, deferred)) = views.into_iter().next() else { return };
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
        format: view.target_format,
        samples: msaa.samples(),
        focal_pixels: 0.5 * size.y * view.clip_from_view.y_axis.y.abs(),
        exposure: camera.exposure,
    });
}

fn prepare_bind_group(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    layout: Res<FrameLayout>,
    buffers: Res<FrameBuffers>,
    sky: Res<SkyTexture>,
    shadows: Res<ShadowMaps>,
    ground: Res<GroundMap>,
    stand: Res<StandTexture>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    pipelines: Res<PipelineCache>,
    mut group: ResMut<FrameBindGroup>,
) {
    group.0 = None;
    let (Some(view), Some(daylight)) = (&frame.view, &scene.daylight) else { return };
    let modulo = |value: f64| value.rem_euclid(NOISE_PERIOD) as f32;
    let frame_uniform = FrameUniform {
        clip_from_relative: view.clip_from_relative.to_cols_array_2d(),
        relative_from_clip: view.clip_from_relative.inverse().to_cols_array_2d(),
        camera: [modulo(view.camera.x), view.camera.y as f32, modulo(view.camera.z)],
        focal_length_pixels: view.focal_pixels,
        level_tint: f32::from(scene.options.tint_levels),
        mean_cover: ground.mean_cover,
        padding: [0.0; 2],
    };
    let light_uniform = light::light_uniform(&daylight.0, view.exposure);
    let shadow_uniform = shadows.uniform(view.camera, ground.placement(view.camera));
    queue.write_buffer(&buffers.frame, 0, bytemuck::bytes_of(&frame_uniform));
    queue.write_buffer(&buffers.light, 0, bytemuck::bytes_of(&light_uniform));
    queue.write_buffer(&buffers.shadow, 0, bytemuck::bytes_of(&shadow_uniform));
    let made = device.create_bind_group(
        "canopy_frame",
        &pipelines.get_bind_group_layout(&layout.0),
        &BindGroupEntries::sequential((
            buffers.frame.as_entire_binding(),
            buffers.light.as_entire_binding(),
            buffers.shadow.as_entire_binding(),
            &sky.view,
            &buffers.clamp_sampler,
            &shadows.view,
            &buffers.shadow_sampler,
            &ground.view,
            &stand.view,
        )),
    );
    group.0 = Some((view.entity, made));
}
