//! Per frame: which trees the view draws, their buffers, and the pipelines.

use bevy::{
    core_pipeline::core_3d::CORE_3D_DEPTH_FORMAT,
    ecs::{
        entity::Entity,
        resource::Resource,
        system::{Res, ResMut},
    },
    platform::collections::HashMap,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindingResource, Buffer, BufferBinding,
            CachedRenderPipelineId, ColorTargetState, ColorWrites, CompareFunction, DepthBiasState, DepthStencilState,
            Face, FragmentState, MultisampleState, PipelineCache, PrimitiveState, RenderPipelineDescriptor,
            StencilState, TextureFormat, VertexState,
        },
        renderer::{RenderDevice, RenderQueue},
    },
    shader::ShaderDefVal,
};
use glam::{DVec3, IVec2};

use super::{
    crosses::CrossLight,
    layouts::ForestLayouts,
    parts::{PartLight, PartSurface},
    resources::{GpuForest, GpuForests},
    uniforms::ForestViewUniform,
    vertex::PlantVertex,
};
use crate::{
    plant::PartKind,
    render::{
        components::SunLight,
        cull::{DrawLists, cull_view},
        frame::{FrameLayout, PreparedFrame},
        gpu::{self, GrowingBuffer},
        report::FrameReport,
        shaders::{CanopyShaders, ShaderFile},
    },
};

/// What a view draws of one forest.
pub struct PreparedForest {
    /// Ranges of trees.
    pub lists: DrawLists,
    /// Group 1.
    pub bind_group: BindGroup,
    visible: GrowingBuffer,
    uniform: Buffer,
}

/// What the view draws of every forest.
#[derive(Resource, Default)]
pub struct PreparedForests(HashMap<Entity, PreparedForest>);

impl PreparedForests {
    /// What the view draws of the forest `entity`.
    pub fn get(&self, entity: Entity) -> Option<&PreparedForest> {
        self.0.get(&entity)
    }
}

/// Counts of the last prepared frame, for overlays and reports.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ForestStatistics {
    /// Trees drawn as full models.
    pub models: usize,
    /// Trees drawn as crossed billboards.
    pub crosses: usize,
    /// Triangles of both.
    pub triangles: usize,
}

/// The uniform of a view or cascade whose positions are relative to `anchor` (scene metres).
pub fn forest_view(forest: &GpuForest, anchor: DVec3) -> ForestViewUniform {
    let local = anchor - forest.forest.origin;
    let size = forest.forest.stand.cell_size;
    let cell = (local / size).floor();
    ForestViewUniform {
        anchor_cell: IVec2::new(cell.x as i32, cell.z as i32).to_array(),
        anchor_offset: [(local.x - cell.x * size) as f32, (local.z - cell.z * size) as f32],
        anchor_y: local.y as f32,
        cell_size: size as f32,
        fade_start: forest.forest.fade.start,
        fade_end: forest.forest.fade.end,
    }
}

/// Group 1 over a uniform buffer with dynamic offsets and a list of visible trees.
pub fn instance_bind_group(
    device: &RenderDevice,
    pipelines: &PipelineCache,
    layouts: &ForestLayouts,
    forest: &GpuForest,
    uniform: &Buffer,
    visible: &Buffer,
) -> BindGroup {
    device.create_bind_group(
        "canopy_instances",
        &pipelines.get_bind_group_layout(&layouts.instances),
        &BindGroupEntries::sequential((
            BindingResource::Buffer(BufferBinding {
                buffer: uniform,
                offset: 0,
                size: std::num::NonZeroU64::new(size_of::<ForestViewUniform>() as u64),
            }),
            forest.trees.as_entire_binding(),
            visible.as_entire_binding(),
            forest.variants.as_entire_binding(),
        )),
    )
}

/// Culls every forest for the view and uploads the lists.
pub fn prepare_view_lists(
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    layouts: Res<ForestLayouts>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    pipelines: Res<PipelineCache>,
    report: Res<FrameReport>,
    mut prepared: ResMut<PreparedForests>,
    mut statistics: ResMut<ForestStatistics>,
) {
    let order = &forests.order;
    prepared.0.retain(|entity, _| order.contains(entity));
    *statistics = ForestStatistics::default();
    let Some(view) = &frame.view else { return };
    for (entity, forest) in forests.iter() {
        let settings = &forest.forest;
        let camera = view.camera - settings.origin;
        let lists =
            cull_view(&settings.stand, &forest.sizes, camera, &view.frustum, settings.fade, settings.view_distance);
        statistics.models += lists.model_count();
        statistics.crosses += lists.cross_count();
        statistics.triangles += 6 * lists.cross_count();
        for (range, parts) in lists.models.iter().zip(&forest.parts) {
            let triangles: usize = parts.iter().map(|part| part.model.index_count as usize / 3).sum();
            statistics.triangles += range.len() * triangles;
        }
        let uniform = forest_view(forest, view.camera);
        // A forest that was replaced under the same entity has other buffers: group 1 is made again each frame.
        let (mut visible, buffer) = match prepared.0.remove(&entity) {
            Some(old) => (old.visible, old.uniform),
            None => (
                GrowingBuffer::new(&device, "canopy_visible_trees"),
                gpu::uniform_slots(&device, "canopy_forest_view", 1),
            ),
        };
        queue.write_buffer(&buffer, 0, bytemuck::bytes_of(&uniform));
        visible.write(&device, &queue, &lists.visible);
        let bind_group = instance_bind_group(&device, &pipelines, &layouts, forest, &buffer, visible.buffer());
        prepared.0.insert(entity, PreparedForest { lists, bind_group, visible, uniform: buffer });
    }
    if statistics.models + statistics.crosses == 0 {
        let why = if order.is_empty() { "the world has no forest" } else { "no tree is in view" };
        report.skipped("forest", why);
    } else {
        report.ran("forest", format!("{} full models, {} crosses", statistics.models, statistics.crosses));
    }
}

/// What a pipeline of the forest pass depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum PipelineKey {
    Model { surface: PartSurface, light: PartLight, format: TextureFormat, samples: u32 },
    Cross { light: CrossLight, format: TextureFormat, samples: u32 },
}

/// Pipelines of the forest pass, made on first use.
#[derive(Resource, Default)]
pub struct ForestPipelines {
    pipelines: HashMap<PipelineKey, CachedRenderPipelineId>,
    /// Pipelines of the prepared view.
    pub current: Option<CurrentPipelines>,
}

/// Pipelines of one view.
#[derive(Clone, Debug)]
pub struct CurrentPipelines {
    /// Of full models, for each surface and light that a part has.
    pub models: Vec<(PartSurface, PartLight, CachedRenderPipelineId)>,
    /// Crosses, by [`CrossLight::ALL`]; `None` for those that no forest has.
    pub crosses: [Option<CachedRenderPipelineId>; 3],
}

/// Requests the pipelines that the view needs.
pub fn prepare_pipelines(
    frame: Res<PreparedFrame>,
    frame_layout: Res<FrameLayout>,
    layouts: Res<ForestLayouts>,
    forests: Res<GpuForests>,
    shaders: Res<CanopyShaders>,
    cache: Res<PipelineCache>,
    mut pipelines: ResMut<ForestPipelines>,
) {
    let Some(view) = &frame.view else {
        pipelines.current = None;
        return;
    };
    let (format, samples) = (view.format, view.samples);
    let known = &mut pipelines.pipelines;
    let mut pipeline = |key| {
        *known
            .entry(key)
            .or_insert_with(|| cache.queue_render_pipeline(describe(key, &frame_layout.0, &layouts, &shaders)))
    };
    // All wood first: what it hides of the leaves is not shaded.
    let mut models = Vec::new();
    for (surface, light) in
        PartSurface::ALL.into_iter().flat_map(|surface| PartLight::ALL.map(|light| (surface, light)))
    {
        let mut parts = forests.iter().flat_map(|(_, forest)| forest.parts.iter().flatten());
        if parts.any(|part| part.surface() == surface && part.light == light) {
            models.push((surface, light, pipeline(PipelineKey::Model { surface, light, format, samples })));
        }
    }
    let crosses = CrossLight::ALL.map(|light| {
        let wanted = forests.iter().any(|(_, forest)| forest.cross_light == light);
        wanted.then(|| pipeline(PipelineKey::Cross { light, format, samples }))
    });
    pipelines.current = Some(CurrentPipelines { models, crosses });
}

fn describe(
    key: PipelineKey,
    frame: &BindGroupLayoutDescriptor,
    layouts: &ForestLayouts,
    shaders: &CanopyShaders,
) -> RenderPipelineDescriptor {
    let (label, file, group, buffers, format, samples, foliage, cull_mode) = match key {
        PipelineKey::Model { surface, format, samples, .. } => {
            let foliage = surface.kind == PartKind::Foliage;
            let cull = (!foliage).then_some(Face::Back);
            let group = layouts.part.clone();
            let label = if foliage { "canopy_foliage" } else { "canopy_wood" };
            (label, ShaderFile::ForestModel, group, vec![PlantVertex::layout()], format, samples, foliage, cull)
        }
        PipelineKey::Cross { format, samples, .. } => {
            ("canopy_crosses", ShaderFile::ForestCross, layouts.cross.clone(), vec![], format, samples, true, None)
        }
    };
    let mut defs: Vec<ShaderDefVal> = Vec::new();
    if foliage {
        defs.push("FOLIAGE".into());
    }
    if matches!(key, PipelineKey::Model { surface, .. } if surface.normal_map) {
        defs.push("NORMAL_MAP".into());
    }
    let mut layout = vec![frame.clone(), layouts.instances.clone(), group];
    match key {
        PipelineKey::Model { light: PartLight::Plain, .. } | PipelineKey::Cross { light: CrossLight::Plain, .. } => {}
        PipelineKey::Model { light: PartLight::Transfer { color, sun }, .. } => {
            defs.push("TRANSFER".into());
            layout.push(layouts.transfer.clone());
            if color {
                defs.push("TRANSFER_COLOR".into());
            }
            if sun == SunLight::Harmonics {
                defs.push("SUN_HARMONICS".into());
            }
        }
        PipelineKey::Cross { light, .. } => {
            defs.push("TRANSFER".into());
            layout.push(layouts.cross_light.clone());
            if light == CrossLight::Mixed {
                defs.push("PLAIN_TOO".into());
            }
        }
    }
    let to_coverage = samples > 1 && foliage;
    if to_coverage {
        defs.push("ALPHA_TO_COVERAGE".into());
    }
    RenderPipelineDescriptor {
        label: Some(label.into()),
        layout,
        vertex: VertexState {
            shader: shaders.get(file),
            shader_defs: defs.clone(),
            entry_point: Some("vertex".into()),
            buffers,
        },
        primitive: PrimitiveState { cull_mode, ..Default::default() },
        depth_stencil: Some(opaque_depth()),
        multisample: MultisampleState { count: samples, alpha_to_coverage_enabled: to_coverage, ..Default::default() },
        fragment: Some(FragmentState {
            shader: shaders.get(file),
            shader_defs: defs,
            entry_point: Some("fragment".into()),
            targets: vec![Some(ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL })],
        }),
        ..Default::default()
    }
}

/// Depth test and write of opaque passes on the camera's reversed depth.
pub fn opaque_depth() -> DepthStencilState {
    DepthStencilState {
        format: CORE_3D_DEPTH_FORMAT,
        depth_write_enabled: Some(true),
        depth_compare: Some(CompareFunction::GreaterEqual),
        stencil: StencilState::default(),
        bias: DepthBiasState::default(),
    }
}
