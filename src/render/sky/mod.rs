//! The sky pass: the radiance table of [`light::atmosphere`](crate::light::atmosphere), sun, moon and stars, behind
//! everything else.
//!
//! From [Hillaire 2020], evaluated on the CPU ([`SkyView`]), so that the visible sky, the fog, the light on ground and
//! trees and the ground truth share one model. Cost: an upload of 150 KB when the light changes, one look-up per sky
//! pixel.

use bevy::{
    app::{App, Plugin},
    asset::Handle,
    core_pipeline::Core3d,
    ecs::{
        resource::Resource,
        schedule::IntoScheduleConfigs,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    render::{
        GpuResourceAppExt, Render, RenderApp,
        camera::ExtractedCamera,
        diagnostic::RecordDiagnostics,
        render_resource::{
            CachedRenderPipelineId, DepthStencilState, PipelineCache, RenderPassDescriptor, RenderPipelineDescriptor,
            SpecializedRenderPipeline, SpecializedRenderPipelines, StoreOp,
        },
        renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery},
        view::{ViewDepthTexture, ViewTarget},
    },
    shader::Shader,
};

use super::{
    bindings::{FrameBindGroup, SharedTextures, frame_layout},
    components::{Daylight, Photographed},
    extract::ExtractedScene,
    gpu::opaque_depth,
    light_table::LightTable,
    report::FrameReport,
    sets::{CanopyPasses, CanopyRenderSystems},
    shaders::{CanopyShaders, ShaderFile},
    view::{PreparedFrame, ViewFormat},
};
use crate::light::atmosphere::SkyView;

/// The sky's radiance on the GPU.
#[derive(Resource)]
struct SkyTexture(LightTable<(Daylight, f32)>);

impl FromWorld for SkyTexture {
    fn from_world(world: &mut World) -> Self {
        let size = (SkyView::WIDTH as u32, SkyView::HEIGHT as u32);
        Self(LightTable::new(world.resource::<RenderDevice>(), "canopy_sky", size))
    }
}

/// The pipeline of the sky, specialised by the camera's attachment.
#[derive(Resource)]
struct SkyPipeline {
    shader: Handle<Shader>,
}

impl FromWorld for SkyPipeline {
    fn from_world(world: &mut World) -> Self {
        Self { shader: world.resource::<CanopyShaders>().get(ShaderFile::SkyPass) }
    }
}

impl SpecializedRenderPipeline for SkyPipeline {
    type Key = ViewFormat;

    fn specialize(&self, key: ViewFormat) -> RenderPipelineDescriptor {
        let depth = DepthStencilState { depth_write_enabled: Some(false), ..opaque_depth() };
        RenderPipelineDescriptor {
            label: Some("canopy_sky".into()),
            layout: vec![frame_layout()],
            ..key.pipeline(&self.shader, Vec::new(), depth)
        }
    }
}

/// The pipeline of the prepared view.
#[derive(Resource, Default)]
struct CurrentSkyPipeline(Option<CachedRenderPipelineId>);

/// Draws the sky.
pub struct SkyPassPlugin;

impl Plugin for SkyPassPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_gpu_resource::<SkyTexture>()
            .init_gpu_resource::<SkyPipeline>()
            .init_gpu_resource::<SpecializedRenderPipelines<SkyPipeline>>()
            .init_resource::<CurrentSkyPipeline>()
            .add_systems(
                Render,
                (
                    upload_sky.in_set(CanopyRenderSystems::Light),
                    prepare_pipeline.in_set(CanopyRenderSystems::Pipelines),
                ),
            )
            .add_systems(Core3d, sky_pass.in_set(CanopyPasses::Sky));
    }
}

fn upload_sky(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    queue: Res<RenderQueue>,
    report: Res<FrameReport>,
    mut sky: ResMut<SkyTexture>,
    mut shared: ResMut<SharedTextures>,
) {
    shared.sky = sky.0.view().clone();
    let (Some(view), Some(daylight)) = (&frame.view, &scene.daylight) else { return };
    let texels = || daylight.0.sky_view.to_rgba16f(view.exposure);
    if sky.0.update(&queue, (daylight.clone(), view.exposure), texels) {
        report.ran("sky radiance", "uploaded for a new light");
    } else {
        report.skipped("sky radiance", "the light has not changed");
    }
}

fn prepare_pipeline(
    frame: Res<PreparedFrame>,
    pipeline: Res<SkyPipeline>,
    cache: Res<PipelineCache>,
    report: Res<FrameReport>,
    mut pipelines: ResMut<SpecializedRenderPipelines<SkyPipeline>>,
    mut current: ResMut<CurrentSkyPipeline>,
) {
    let photographed = frame.view.as_ref().filter(|view| !view.styled);
    match (photographed, &frame.view) {
        (Some(_), _) => report.ran("sky", "behind everything"),
        (None, Some(_)) => report.skipped("sky", "the view has a style"),
        (None, None) => {}
    }
    current.0 = photographed.map(|view| pipelines.specialize(&cache, &pipeline, view.attachment));
}

/// Draws the sky where nothing else was drawn.
fn sky_pass(
    view: ViewQuery<(&ViewTarget, &ViewDepthTexture, &ExtractedCamera), Photographed>,
    frame: Res<FrameBindGroup>,
    pipeline: Res<CurrentSkyPipeline>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let frame = frame.of(view.entity());
    let (target, depth, camera) = view.into_inner();
    let (Some(frame), Some(pipeline)) = (frame, pipeline.0.and_then(|id| cache.get_render_pipeline(id))) else {
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
