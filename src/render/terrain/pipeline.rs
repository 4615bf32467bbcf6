//! Bind group layout and pipelines of the terrain pass.

use bevy::{
    asset::Handle,
    ecs::{
        resource::Resource,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedRenderPipelineId, Face, PipelineCache, PrimitiveState,
        RenderPipelineDescriptor, ShaderStages, SpecializedRenderPipeline, SpecializedRenderPipelines,
        binding_types::storage_buffer_read_only_sized,
    },
    shader::Shader,
};

use crate::render::{
    bindings::frame_layout,
    gpu::opaque_depth,
    shaders::{CanopyShaders, ShaderFile},
    view::{PreparedFrame, ViewFormat},
};

/// Group 1: vertices, tiles.
pub fn terrain_layout() -> BindGroupLayoutDescriptor {
    BindGroupLayoutDescriptor::new(
        "canopy_terrain",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::VERTEX_FRAGMENT,
            (storage_buffer_read_only_sized(false, None), storage_buffer_read_only_sized(false, None)),
        ),
    )
}

/// The pipeline of the ground, specialised by the camera's attachment.
#[derive(Resource)]
pub struct TerrainPipeline {
    shader: Handle<Shader>,
}

impl FromWorld for TerrainPipeline {
    fn from_world(world: &mut World) -> Self {
        Self { shader: world.resource::<CanopyShaders>().get(ShaderFile::Terrain) }
    }
}

impl SpecializedRenderPipeline for TerrainPipeline {
    type Key = ViewFormat;

    fn specialize(&self, key: ViewFormat) -> RenderPipelineDescriptor {
        RenderPipelineDescriptor {
            label: Some("canopy_terrain".into()),
            layout: vec![frame_layout(), terrain_layout()],
            primitive: PrimitiveState { cull_mode: Some(Face::Back), ..Default::default() },
            ..key.pipeline(&self.shader, Vec::new(), opaque_depth())
        }
    }
}

/// The pipeline of the prepared view.
#[derive(Resource, Default)]
pub struct CurrentTerrainPipeline(pub Option<CachedRenderPipelineId>);

/// Requests the pipeline that the view needs.
pub fn prepare_pipeline(
    frame: Res<PreparedFrame>,
    pipeline: Res<TerrainPipeline>,
    cache: Res<PipelineCache>,
    mut pipelines: ResMut<SpecializedRenderPipelines<TerrainPipeline>>,
    mut current: ResMut<CurrentTerrainPipeline>,
) {
    let photographed = frame.view.as_ref().filter(|view| !view.styled);
    current.0 = photographed.map(|view| pipelines.specialize(&cache, &pipeline, view.attachment));
}
