//! Pipelines of the terrain pass.

use bevy::{
    asset::Handle,
    ecs::{
        resource::Resource,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    render::render_resource::{
        CachedRenderPipelineId, Face, PipelineCache, PrimitiveState, RenderPipelineDescriptor,
        SpecializedRenderPipeline, SpecializedRenderPipelines,
    },
    shader::Shader,
};

use super::{
    layout::{GroundFeatures, terrain_layout},
    tiles::GpuTerrain,
};

use crate::render::{
    bindings::frame_layout,
    extract::ExtractedScene,
    gpu::opaque_depth,
    shaders::{CanopyShaders, ShaderFile},
    view::{PreparedFrame, ViewFormat},
};

/// The pipeline of the ground.
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
    type Key = (ViewFormat, GroundFeatures);

    fn specialize(&self, (format, features): Self::Key) -> RenderPipelineDescriptor {
        RenderPipelineDescriptor {
            label: Some("canopy_terrain".into()),
            layout: vec![frame_layout(), terrain_layout(features.draped)],
            primitive: PrimitiveState { cull_mode: Some(Face::Back), ..Default::default() },
            ..format.pipeline(&self.shader, features.defs(), opaque_depth())
        }
    }
}

/// The pipeline of the prepared view.
#[derive(Resource, Default)]
pub struct CurrentTerrainPipeline(pub Option<CachedRenderPipelineId>);

/// Requests the pipeline that the view needs.
pub fn prepare_pipeline(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    pipeline: Res<TerrainPipeline>,
    terrain: Res<GpuTerrain>,
    cache: Res<PipelineCache>,
    mut pipelines: ResMut<SpecializedRenderPipelines<TerrainPipeline>>,
    mut current: ResMut<CurrentTerrainPipeline>,
) {
    let photographed = frame.view.as_ref().filter(|view| !view.styled);
    let soft_shadow = scene.shadow.soft_edge() > 0.0 && scene.shadow.cascades > 0;
    let features = GroundFeatures { soft_shadow, ..terrain.features };
    current.0 = photographed.map(|view| pipelines.specialize(&cache, &pipeline, (view.attachment, features)));
}
