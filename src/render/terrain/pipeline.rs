//! Bind group layout and pipelines of the terrain pass.

use std::num::NonZeroU64;

use bevy::{
    asset::Handle,
    ecs::{
        resource::Resource,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedRenderPipelineId, Face, PipelineCache, PrimitiveState,
        RenderPipelineDescriptor, SamplerBindingType, ShaderStages, SpecializedRenderPipeline,
        SpecializedRenderPipelines, TextureSampleType,
        binding_types::{sampler, storage_buffer_read_only_sized, texture_2d, uniform_buffer_sized},
    },
    shader::{Shader, ShaderDefVal},
};

use super::{DrapeUniform, tiles::GpuTerrain};

use crate::render::{
    bindings::frame_layout,
    extract::ExtractedScene,
    gpu::opaque_depth,
    shaders::{CanopyShaders, ShaderFile},
    view::{PreparedFrame, ViewFormat},
};

/// Shader definition of ground with a photograph over it.
pub const DRAPE: &str = "DRAPE";
/// Shader definition of ground whose shadows have soft edges.
const SOFT_SHADOW: &str = "SOFT_SHADOW";

/// Group 1: vertices, tiles; with a photograph over them also its place, its texture and how it is sampled.
pub fn terrain_layout(draped: bool) -> BindGroupLayoutDescriptor {
    let tiles = || (storage_buffer_read_only_sized(false, None), storage_buffer_read_only_sized(false, None));
    let stages = ShaderStages::VERTEX_FRAGMENT;
    if !draped {
        return BindGroupLayoutDescriptor::new("canopy_terrain", &BindGroupLayoutEntries::sequential(stages, tiles()));
    }
    let photograph = (
        uniform_buffer_sized(false, NonZeroU64::new(size_of::<DrapeUniform>() as u64)),
        texture_2d(TextureSampleType::Float { filterable: true }),
        sampler(SamplerBindingType::Filtering),
    );
    let ((vertices, tiles), (place, texture, sampler)) = (tiles(), photograph);
    let entries = BindGroupLayoutEntries::sequential(stages, (vertices, tiles, place, texture, sampler));
    BindGroupLayoutDescriptor::new("canopy_draped_terrain", &entries)
}

/// The shader definitions of ground.
pub fn terrain_defs(draped: bool, soft_shadow: bool) -> Vec<ShaderDefVal> {
    let defs = [(DRAPE, draped), (SOFT_SHADOW, soft_shadow)];
    defs.into_iter().filter(|(_, wanted)| *wanted).map(|(name, _)| name.into()).collect()
}

/// What the pipeline of the ground depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct GroundLook {
    /// The camera's attachment.
    pub format: ViewFormat,
    /// Whether a photograph lies over it.
    pub draped: bool,
    /// Whether shadows on it have soft edges.
    pub soft_shadow: bool,
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
            ..look.format.pipeline(&self.shader, terrain_defs(look.draped, look.soft_shadow), opaque_depth())
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
    current.0 = photographed.map(|view| {
        let soft_shadow = scene.shadow.soft_edge() > 0.0 && scene.shadow.cascades > 0;
        let look = GroundLook { format: view.attachment, draped: terrain.is_draped(), soft_shadow };
        pipelines.specialize(&cache, &pipeline, look)
    });
}
