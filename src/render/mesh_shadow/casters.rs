//! Chooses the trees that cast into each of Bevy's cascades.

use bevy::{
    ecs::{
        entity::Entity,
        resource::Resource,
        system::{Query, Res, ResMut},
    },
    pbr::{LightEntity, ViewLightEntities},
    platform::collections::HashMap,
    render::{
        render_resource::{BindGroup, BindGroupEntries, BindingResource, Buffer, BufferBinding},
        view::ExtractedView,
    },
};
use glam::{DVec3, Mat4, Vec3, Vec4Swizzles};

use crate::{
    cull::{Frustum, Volume},
    render::{
        bindings::{caster_layout, uniforms::CascadeViewUniform},
        cull::{CullJobs, ListMaker},
        extract::ExtractedScene,
        forest::{GpuForests, ListSlot, ListTarget, ListWork, PageTrees, PreparedPage, forest_view},
        gpu::{self, Gpu, UNIFORM_STRIDE},
        report::FrameReport,
        view::PreparedFrame,
    },
};

/// Maximum number of cascades per frame: four lights with four each.
const MAX_VIEWS: usize = 16;

/// The trees of one forest that are drawn into one map.
pub struct CastForest {
    /// Which forest.
    pub entity: Entity,
    /// Its trees, with group 1, whose dynamic offset is 0.
    pub pages: Vec<PreparedPage>,
}

/// One of Bevy's maps and its casters.
pub struct CastView {
    /// The light's view.
    pub entity: Entity,
    /// Casters, by forest.
    pub forests: Vec<CastForest>,
}

/// Buffers of one forest in one map.
struct CastBuffers {
    uniform: Buffer,
    lists: Vec<ListSlot>,
}

/// The maps of this frame.
#[derive(Resource, Default)]
pub struct MeshShadows {
    /// Maps with casters, in the order of the dynamic offsets of group 0.
    pub views: Vec<CastView>,
    /// Group 0 of the casters.
    pub bind_group: Option<BindGroup>,
    uniforms: Option<Buffer>,
    buffers: HashMap<(usize, Entity), CastBuffers>,
}

/// Gathers the casters of each map.
pub fn prepare_mesh_shadows(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    cameras: Query<&ViewLightEntities>,
    lights: Query<(&LightEntity, &ExtractedView)>,
    gpu: Gpu,
    mut jobs: ResMut<CullJobs>,
    report: Res<FrameReport>,
    mut shadows: ResMut<MeshShadows>,
) {
    let shadows = &mut *shadows;
    shadows.views.clear();
    shadows.bind_group = None;
    shadows.buffers.retain(|(_, entity), _| forests.get(*entity).is_some());
    let Some(view) = &frame.view else { return };
    let why_none = if !scene.mesh_shadows {
        Some("no directional light has shadow maps")
    } else if forests.have_no_trees() {
        Some("the world has no forest")
    } else {
        None
    };
    if let Some(why) = why_none {
        report.skipped("mesh_shadow", why);
        return;
    }
    let Ok(of_camera) = cameras.get(view.entity) else { return };
    // Positions are relative to the camera, in f64 until then.
    let anchor = view.camera;
    let to_anchor = Mat4::from_translation((anchor - scene.origin).as_vec3());
    let uniforms = shadows
        .uniforms
        .get_or_insert_with(|| gpu::uniform_slots(&gpu.device, "canopy_mesh_shadow_views", MAX_VIEWS as u64));
    // Bevy's maps are drawn anew in every frame, so their lists are made on the processor, where they can be short.
    let mut work = ListWork { maker: ListMaker::PROCESSOR, gpu: &gpu, jobs: &mut jobs, report: &report };
    let mut trees = 0;
    for entity in of_camera.lights.iter().copied() {
        let Ok((LightEntity::Directional { .. }, light)) = lights.get(entity) else { continue };
        let Some(clip_from_world) = light.clip_from_world else { continue };
        let slot = shadows.views.len();
        if slot == MAX_VIEWS {
            break;
        }
        let clip_from_anchor = clip_from_world * to_anchor;
        let direction = light.world_from_view.rotation() * Vec3::Z;
        if !clip_from_anchor.is_finite() || !direction.is_normalized() {
            continue;
        }
        let uniform = CascadeViewUniform {
            clip_from_anchor: clip_from_anchor.to_cols_array_2d(),
            direction: direction.to_array(),
            padding: 0.0,
        };
        gpu.queue.write_buffer(uniforms, slot as u64 * UNIFORM_STRIDE, bytemuck::bytes_of(&uniform));
        let width = 2.0 / clip_from_anchor.transpose().x_axis.xyz().length().max(1e-6);
        let texel = f64::from(width) / f64::from(light.viewport.z.max(1));
        let frustum = Frustum::new(&clip_from_anchor);
        let mut cast = CastView { entity, forests: Vec::new() };
        for (entity, forest) in forests.iter() {
            let casting = forest.casting_distances(0.0..scene.shadow.proxy_distance, texel, view);
            let buffers = shadows.buffers.entry((slot, entity)).or_insert_with(|| CastBuffers {
                uniform: gpu::uniform_slots(&gpu.device, "canopy_mesh_shadow_forest", 1),
                lists: Vec::new(),
            });
            let uniform = forest_view(forest, anchor, None);
            gpu.write(&buffers.uniform, 0, bytemuck::bytes_of(&uniform));
            buffers.lists.resize_with(forest.page_count(), ListSlot::default);
            let (anchor, direction) = (anchor - forest.forest.origin, DVec3::from(direction));
            let mut pages = Vec::with_capacity(buffers.lists.len());
            for (page, slot) in buffers.lists.iter_mut().enumerate() {
                let Some(drawn) = forest.drawn(page) else { continue };
                let volume = Volume::light_view(&drawn, anchor, &frustum, direction, &casting);
                pages.push(slot.prepare(&mut work, forest, page, ListTarget::ShadowMap, &volume, &buffers.uniform));
            }
            let listed = |page: &PreparedPage| match &page.trees {
                PageTrees::Listed(lists) => lists.visible.len(),
                PageTrees::Indirect { .. } => 0,
            };
            trees += pages.iter().map(listed).sum::<usize>();
            cast.forests.push(CastForest { entity, pages });
        }
        shadows.views.push(cast);
    }
    shadows.bind_group = Some(gpu.bind_group(
        "canopy_mesh_shadow_view",
        &caster_layout(),
        &BindGroupEntries::single(BindingResource::Buffer(BufferBinding {
            buffer: uniforms,
            offset: 0,
            size: std::num::NonZeroU64::new(size_of::<CascadeViewUniform>() as u64),
        })),
    ));
    report.ran("mesh_shadow", format!("{trees} trees in {} maps", shadows.views.len()));
}
