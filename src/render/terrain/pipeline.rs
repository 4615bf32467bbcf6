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
    layout::{terrain_defs, terrain_layout},
    tiles::GpuTerrain,
};

use crate::render::{
    bindings::frame_layout,
    gpu::opaque_depth,
    shaders::{CanopyShaders, ShaderFile},
    view::{PreparedFrame, ViewFormat},
};

/// What the pipeline of the ground depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct GroundLook {
    /// The camera's attachment.
    pub format: ViewFormat,
    /// Whether a photograph lies over it.
    pub draped: bool,
}

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
    type Key = GroundLook;

    fn specialize(&self, look: GroundLook) -> RenderPipelineDescriptor {
        RenderPipelineDescriptor {
            label: Some("canopy_terrain".into()),
            layout: vec![frame_layout(), terrain_layout(look.draped)],
            primitive: PrimitiveState { cull_mode: Some(Face::Back), ..Default::default() },
            ..look.format.pipeline(&self.shader, terrain_defs(look.draped), opaque_depth())
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
    terrain: Res<GpuTerrain>,
    cache: Res<PipelineCache>,
    mut pipelines: ResMut<SpecializedRenderPipelines<TerrainPipeline>>,
    mut current: ResMut<CurrentTerrainPipeline>,
) {
    let photographed = frame.view.as_ref().filter(|view| !view.styled);
    current.0 = photographed.map(|view| {
        let look = GroundLook { format: view.attachment, draped: terrain.is_draped() };
        pipelines.specialize(&cache, &pipeline, look)
    });
}
