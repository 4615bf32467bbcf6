//! Ordinary Bevy meshes in the shadow maps: those with
//! [`CastsCanopyShadow`](crate::render::components::CastsCanopyShadow).

use std::hash::{DefaultHasher, Hash, Hasher};

use bevy::{
    asset::AssetId,
    ecs::{
        resource::Resource,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    log::warn_once,
    math::Affine3A,
    mesh::{Mesh, VertexBufferLayout},
    platform::collections::HashMap,
    render::{
        mesh::{RenderMesh, RenderMeshBufferInfo, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_phase::TrackedRenderPass,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, BindingResource,
            BufferBinding, BufferUsages, CachedRenderPipelineId, PipelineCache, PrimitiveState, PrimitiveTopology,
            RenderPipelineDescriptor, ShaderStages, VertexAttribute, VertexFormat, VertexState, VertexStepMode,
            binding_types::uniform_buffer_sized,
        },
        renderer::RenderDevice,
    },
};
use glam::{DVec3, Mat4};

use crate::render::{
    bindings::{SHADOW_FORMAT, caster_layout},
    extract::ExtractedScene,
    gpu::{self, UNIFORM_STRIDE, reversed_depth},
    shaders::{CanopyShaders, ShaderFile},
};

/// What a pipeline depends on: stride and topology.
type PipelineKey = (u64, PrimitiveTopology);

struct MeshCaster {
    mesh: AssetId<Mesh>,
    place: Affine3A,
    pipeline: CachedRenderPipelineId,
}

/// The meshes that cast in this frame.
#[derive(Resource)]
pub struct MeshCasters {
    layout: BindGroupLayoutDescriptor,
    pipelines: HashMap<PipelineKey, CachedRenderPipelineId>,
    casters: Vec<MeshCaster>,
    origin: DVec3,
    state: u64,
}

impl FromWorld for MeshCasters {
    fn from_world(_: &mut World) -> Self {
        Self {
            layout: BindGroupLayoutDescriptor::new(
                "canopy_mesh_caster",
                &BindGroupLayoutEntries::single(
                    ShaderStages::VERTEX,
                    uniform_buffer_sized(true, std::num::NonZeroU64::new(size_of::<Mat4>() as u64)),
                ),
            ),
            pipelines: HashMap::default(),
            casters: Vec::new(),
            origin: DVec3::ZERO,
            state: 0,
        }
    }
}

impl MeshCasters {
    /// Whether no ordinary mesh casts.
    pub fn is_empty(&self) -> bool {
        self.casters.is_empty()
    }

    /// Changes whenever a caster is added, moved or removed.
    pub fn state(&self) -> u64 {
        self.state
    }

    /// Transforms of all casters relative to `anchor` (scene metres), as group 1 with dynamic offsets.
    pub fn bind_group(&self, device: &RenderDevice, pipelines: &PipelineCache, anchor: DVec3) -> BindGroup {
        let mut bytes = vec![0u8; self.casters.len().max(1) * UNIFORM_STRIDE as usize];
        let shift = Mat4::from_translation((self.origin - anchor).as_vec3());
        for (slot, caster) in bytes.chunks_exact_mut(UNIFORM_STRIDE as usize).zip(&self.casters) {
            let place = (shift * Mat4::from(caster.place)).to_cols_array();
            slot[..size_of::<Mat4>()].copy_from_slice(bytemuck::cast_slice(&place));
        }
        let buffer = gpu::buffer_with(device, "canopy_mesh_casters", BufferUsages::UNIFORM, &bytes);
        device.create_bind_group(
            "canopy_mesh_casters",
            &pipelines.get_bind_group_layout(&self.layout),
            &BindGroupEntries::single(BindingResource::Buffer(BufferBinding {
                buffer: &buffer,
                offset: 0,
                size: std::num::NonZeroU64::new(size_of::<Mat4>() as u64),
            })),
        )
    }

    /// Draws all casters; group 0 is the cascade. `false` while one of them is not ready yet.
    pub fn draw<'a>(
        &'a self,
        pass: &mut TrackedRenderPass<'a>,
        group: &'a BindGroup,
        meshes: &'a RenderAssets<RenderMesh>,
        allocator: &'a MeshAllocator,
        cache: &'a PipelineCache,
    ) -> bool {
        let mut complete = true;
        for (index, caster) in self.casters.iter().enumerate() {
            let (Some(mesh), Some(vertices), Some(pipeline)) = (
                meshes.get(caster.mesh),
                allocator.mesh_vertex_slice(&caster.mesh),
                cache.get_render_pipeline(caster.pipeline),
            ) else {
                complete = false;
                continue;
            };
            pass.set_render_pipeline(pipeline);
            pass.set_bind_group(1, group, &[index as u32 * UNIFORM_STRIDE as u32]);
            pass.set_vertex_buffer(0, vertices.buffer.slice(..));
            match &mesh.buffer_info {
                RenderMeshBufferInfo::Indexed { count, index_format } => {
                    let Some(indices) = allocator.mesh_index_slice(&caster.mesh) else { continue };
                    pass.set_index_buffer(indices.buffer.slice(..), *index_format);
                    let range = indices.range.start..indices.range.start + count;
                    pass.draw_indexed(range, vertices.range.start as i32, 0..1);
                }
                RenderMeshBufferInfo::NonIndexed => pass.draw(vertices.range.clone(), 0..1),
            }
        }
        complete
    }
}

/// Finds the meshes that are ready, and requests their pipelines.
pub fn prepare_mesh_casters(
    scene: Res<ExtractedScene>,
    meshes: Res<RenderAssets<RenderMesh>>,
    shaders: Res<CanopyShaders>,
    cache: Res<PipelineCache>,
    mut casters: ResMut<MeshCasters>,
) {
    let casters = &mut *casters;
    casters.origin = scene.origin;
    casters.casters.clear();
    let mut state = DefaultHasher::new();
    for (mesh, place) in &scene.casters {
        let Some(ready) = meshes.get(*mesh) else { continue };
        let layout = ready.layout.0.layout();
        let position = ready.layout.0.attribute_ids().iter().position(|id| *id == Mesh::ATTRIBUTE_POSITION.id);
        let Some(offset) = position.and_then(|index| layout.attributes.get(index)).map(|a| a.offset) else { continue };
        let topology = ready.primitive_topology();
        if offset != 0 || !matches!(topology, PrimitiveTopology::TriangleList) {
            warn_once!(
                "a mesh with CastsCanopyShadow is not a triangle list, or its first attribute is not the position: it casts no shadow"
            );
            continue;
        }
        let pipeline = *casters.pipelines.entry((layout.array_stride, topology)).or_insert_with(|| {
            cache.queue_render_pipeline(RenderPipelineDescriptor {
                label: Some("canopy_caster_mesh".into()),
                layout: vec![caster_layout(), casters.layout.clone()],
                vertex: VertexState {
                    shader: shaders.get(ShaderFile::SunShadowMesh),
                    shader_defs: Vec::new(),
                    entry_point: Some("vertex".into()),
                    buffers: vec![VertexBufferLayout {
                        array_stride: layout.array_stride,
                        step_mode: VertexStepMode::Vertex,
                        attributes: vec![VertexAttribute {
                            format: VertexFormat::Float32x3,
                            offset: 0,
                            shader_location: 0,
                        }],
                    }],
                },
                primitive: PrimitiveState { topology, ..Default::default() },
                depth_stencil: Some(reversed_depth(SHADOW_FORMAT)),
                fragment: None,
                ..Default::default()
            })
        });
        mesh.hash(&mut state);
        scene.mesh_revisions.get(mesh).hash(&mut state);
        let in_scene = scene.origin + place.translation.as_dvec3();
        in_scene.to_array().map(f64::to_bits).hash(&mut state);
        place.matrix3.to_cols_array().map(f32::to_bits).hash(&mut state);
        casters.casters.push(MeshCaster { mesh: *mesh, place: *place, pipeline });
    }
    casters.casters.len().hash(&mut state);
    casters.state = state.finish();
}
