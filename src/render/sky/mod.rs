//! The sky pass: the radiance table of [`light::atmosphere`](crate::light::atmosphere), sun, moon and stars, behind
//! everything else.
//!
//! From [Hillaire 2020], evaluated on the CPU ([`SkyView`]), so that the visible sky, the fog, the light on ground and
//! trees and the ground truth share one model. Cost: an upload of 150 KB when the light changed, one look-up a sky
//! pixel.

use bevy::{
    app::{App, Plugin},
    core_pipeline::{
        Core3d, Core3dSystems,
        core_3d::{CORE_3D_DEPTH_FORMAT, main_opaque_pass_3d, main_transparent_pass_3d},
    },
    ecs::{
        query::With,
        resource::Resource,
        schedule::IntoScheduleConfigs,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    platform::collections::HashMap,
    render::{
        GpuResourceAppExt, Render, RenderApp, RenderSystems,
        camera::ExtractedCamera,
        diagnostic::RecordDiagnostics,
        render_resource::{
            CachedRenderPipelineId, ColorTargetState, ColorWrites, CompareFunction, DepthBiasState, DepthStencilState,
            FragmentState, MultisampleState, PipelineCache, RenderPassDescriptor, RenderPipelineDescriptor,
            StencilState, StoreOp, Texture, TextureFormat, TextureView, VertexState,
        },
        renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery},
        view::{ViewDepthTexture, ViewTarget},
    },
};

use super::{
    components::{CanopyCamera, Daylight},
    extract::ExtractedScene,
    frame::{FrameBindGroup, FrameLayout, PreparedFrame},
    gpu,
    report::FrameReport,
    shaders::{CanopyShaders, ShaderFile},
};
use crate::light::atmosphere::SkyView;

/// The sky's radiance on the GPU.
#[derive(Resource)]
pub struct SkyTexture {
    /// For sampling.
    pub view: TextureView,
    texture: Texture,
    shows: Option<(Daylight, f32)>,
}

impl FromWorld for SkyTexture {
    fn from_world(world: &mut World) -> Self {
        let size = (SkyView::WIDTH as u32, SkyView::HEIGHT as u32);
        let (texture, view) = gpu::table(world.resource::<RenderDevice>(), "canopy_sky", size);
        Self { texture, view, shows: None }
    }
}

#[derive(Resource, Default)]
struct SkyPipelines {
    pipelines: HashMap<(TextureFormat, u32), CachedRenderPipelineId>,
    current: Option<CachedRenderPipelineId>,
}

/// Draws the sky.
pub struct SkyPassPlugin;

impl Plugin for SkyPassPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_gpu_resource::<SkyTexture>()
            .init_gpu_resource::<SkyPipelines>()
            .add_systems(
                Render,
                (upload_sky, prepare_pipeline)
                    .in_set(RenderSystems::PrepareResources)
                    .after(super::frame::prepare_frame),
            )
            .add_systems(
                Core3d,
                sky_pass
                    .after(main_opaque_pass_3d)
                    .after(super::terrain::terrain_pass)
                    .before(main_transparent_pass_3d)
                    .in_set(Core3dSystems::MainPass),
            );
    }
}

fn upload_sky(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    queue: Res<RenderQueue>,
    report: Res<FrameReport>,
    mut sky: ResMut<SkyTexture>,
) {
    let (Some(view), Some(daylight)) = (&frame.view, &scene.daylight) else { return };
    let known = sky
        .shows
        .as_ref()
        .is_some_and(|(light, exposure)| std::sync::Arc::ptr_eq(&light.0, &daylight.0) && *exposure == view.exposure);
    if known {
        report.skipped("sky radiance", "the sun rests");
        return;
    }
    let texels = daylight.0.sky_view.to_rgba16f(view.exposure);
    let (width, height) = (SkyView::WIDTH as u32, SkyView::HEIGHT as u32);
    gpu::write_level(&queue, &sky.texture, 0, 0, width, height, 8, bytemuck::cast_slice(&texels));
    sky.shows = Some((daylight.clone(), view.exposure));
    report.ran("sky radiance", "uploaded for a new light");
}

fn prepare_pipeline(
    frame: Res<PreparedFrame>,
    layout: Res<FrameLayout>,
    shaders: Res<CanopyShaders>,
    cache: Res<PipelineCache>,
    report: Res<FrameReport>,
    mut pipelines: ResMut<SkyPipelines>,
) {
    if frame.view.is_some() {
        report.ran("sky", "behind everything");
    }
    pipelines.current = frame.view.as_ref().map(|view| {
        *pipelines.pipelines.entry((view.format, view.samples)).or_insert_with(|| {
            cache.queue_render_pipeline(RenderPipelineDescriptor {
                label: Some("canopy_sky".into()),
                layout: vec![layout.0.clone()],
                vertex: VertexState {
                    shader: shaders.get(ShaderFile::SkyPass),
                    entry_point: Some("vertex".into()),
                    ..Default::default()
                },
                depth_stencil: Some(DepthStencilState {
                    format: CORE_3D_DEPTH_FORMAT,
                    depth_write_enabled: Some(false),
                    depth_compare: Some(CompareFunction::GreaterEqual),
                    stencil: StencilState::default(),
                    bias: DepthBiasState::default(),
                }),
                multisample: MultisampleState { count: view.samples, ..Default::default() },
                fragment: Some(FragmentState {
                    shader: shaders.get(ShaderFile::SkyPass),
                    entry_point: Some("fragment".into()),
                    targets: vec![Some(ColorTargetState {
                        format: view.format,
                        blend: None,
                        write_mask: ColorWrites::ALL,
                    })],
                    ..Default::default()
                }),
                ..Default::default()
            })
        })
    });
}

/// Fills what nothing else covers.
fn sky_pass(
    view: ViewQuery<(&ViewTarget, &ViewDepthTexture, &ExtractedCamera), With<CanopyCamera>>,
    frame: Res<FrameBindGroup>,
    pipelines: Res<SkyPipelines>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let frame = frame.of(view.entity());
    let (target, depth, camera) = view.into_inner();
    let (Some(frame), Some(pipeline)) = (frame, pipelines.current.and_then(|id| cache.get_render_pipeline(id))) else {
        return;
    };
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("canopy_sky"),
        color_attachments: &[Some(target.get_color_attachment())],
        depth_stencil_attachment: Some(depth.get_attachment(StoreOp::Store)),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let span = diagnostics.pass_span(&mut pass, "canopy_sky");
    if let Some(viewport) = &camera.viewport {
        pass.set_camera_viewport(viewport);
    }
    pass.set_render_pipeline(pipeline);
    pass.set_bind_group(0, frame, &[]);
    pass.draw(0..3, 0..1);
    span.end(&mut pass);
}
