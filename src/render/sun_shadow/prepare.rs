//! Per frame: where the cascades lie, which of them must be drawn again, and with what.

use bevy::{
    ecs::{
        entity::Entity,
        resource::Resource,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    platform::collections::HashMap,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, BindingResource, Buffer,
            BufferBinding, CachedRenderPipelineId, CompareFunction, DepthBiasState, DepthStencilState, Extent3d,
            FragmentState, PipelineCache, RenderPipelineDescriptor, ShaderStages, StencilState, TextureDescriptor,
            TextureDimension, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor, TextureViewDimension,
            VertexState, binding_types::uniform_buffer_sized,
        },
        renderer::{RenderDevice, RenderQueue},
    },
    shader::ShaderDefVal,
};
use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3, Mat4};

use super::{
    cascades::{CascadeBox, cascade_radii},
    meshes::MeshCasters,
};
use crate::{
    plant::PartKind,
    render::{
        components::SunShadowSettings,
        cull::{DrawLists, SeenShadows, VariantSize, cull_cascade},
        extract::ExtractedScene,
        forest::{ForestLayouts, GpuForests, PlantVertex, forest_view, instance_bind_group},
        frame::{
            PreparedFrame,
            uniforms::{CascadeUniform, MAX_CASCADES, ShadowUniform},
        },
        gpu::{self, GrowingBuffer, UNIFORM_STRIDE},
        report::FrameReport,
        shaders::{CanopyShaders, ShaderFile},
    },
};

/// Metres a texel from which on casters are billboards.
const PROXY_TEXEL: f64 = 0.2;

/// Format of the maps.
pub const SHADOW_FORMAT: TextureFormat = TextureFormat::Depth32Float;

/// `CascadeView` of `shaders/sun_shadow/caster.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CascadeViewUniform {
    /// Metres relative to the box's centre to the map's clip space.
    pub clip_from_anchor: [[f32; 4]; 4],
    /// Unit vector to the light.
    pub direction: [f32; 3],
    /// WGSL rounds the size up to 16 bytes.
    pub padding: f32,
}

/// Bind group layouts of casters.
#[derive(Resource)]
pub struct CasterLayouts {
    /// Group 0.
    pub cascade: BindGroupLayoutDescriptor,
}

impl FromWorld for CasterLayouts {
    fn from_world(_: &mut World) -> Self {
        Self {
            cascade: BindGroupLayoutDescriptor::new(
                "canopy_cascade",
                &BindGroupLayoutEntries::single(
                    ShaderStages::VERTEX,
                    uniform_buffer_sized(true, std::num::NonZeroU64::new(size_of::<CascadeViewUniform>() as u64)),
                ),
            ),
        }
    }
}

/// Everything that a cascade's picture depends on. Equal keys have equal maps.
#[derive(Clone, Debug, PartialEq)]
pub struct CascadeKey {
    place: CascadeBox,
    proxy_distance: f64,
    /// Generation and origin of each forest.
    forests: Vec<(Entity, u64, DVec3)>,
    /// State of the ordinary meshes that cast.
    meshes: u64,
}

/// What a layer shows.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnCascade {
    key: CascadeKey,
    /// Camera and view that the casters were chosen for; `None` if all of them are there.
    seen_by: Option<(DVec3, Mat4)>,
}

/// What is drawn into one cascade of one forest.
pub struct CascadeForest {
    /// Which forest.
    pub entity: Entity,
    /// Ranges of trees.
    pub lists: DrawLists,
    /// Group 1, with the dynamic offset of the cascade.
    pub bind_group: BindGroup,
}

/// A cascade that must be drawn in this frame.
pub struct CascadeWork {
    /// Which layer.
    pub index: usize,
    /// What the map will show.
    pub content: DrawnCascade,
    /// Casters.
    pub forests: Vec<CascadeForest>,
}

struct CasterBuffers {
    uniform: Buffer,
    visible: Vec<GrowingBuffer>,
}

/// The shadow maps and what they show.
#[derive(Resource)]
pub struct ShadowMaps {
    /// All layers, for sampling.
    pub view: TextureView,
    /// One view a layer, for drawing.
    pub layers: Vec<TextureView>,
    /// Cascades of this frame, finest first.
    pub cascades: Vec<CascadeBox>,
    /// What each layer shows.
    pub drawn: Vec<Option<DrawnCascade>>,
    /// Cascades to draw in this frame.
    pub work: Vec<CascadeWork>,
    /// Group 0 of the casters.
    pub cascade_bind_group: Option<BindGroup>,
    map_size: u32,
    cascade_uniforms: Buffer,
    casters: HashMap<Entity, CasterBuffers>,
}

impl FromWorld for ShadowMaps {
    fn from_world(world: &mut World) -> Self {
        let device = world.resource::<RenderDevice>();
        // One texel serves while no shadow is asked for: nothing large is allocated for what a scene does not use.
        let (view, layers) = create_maps(device, 1, 1);
        Self {
            view,
            layers,
            cascades: Vec::new(),
            drawn: Vec::new(),
            work: Vec::new(),
            cascade_bind_group: None,
            map_size: 1,
            cascade_uniforms: gpu::uniform_slots(device, "canopy_cascades", MAX_CASCADES as u64),
            casters: HashMap::default(),
        }
    }
}

fn create_maps(device: &RenderDevice, size: u32, count: usize) -> (TextureView, Vec<TextureView>) {
    let texture = device.create_texture(&TextureDescriptor {
        label: Some("canopy_sun_shadow"),
        size: Extent3d { width: size, height: size, depth_or_array_layers: count.max(1) as u32 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: SHADOW_FORMAT,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    let layer = |index: usize| {
        texture.create_view(&TextureViewDescriptor {
            dimension: Some(TextureViewDimension::D2),
            base_array_layer: index as u32,
            array_layer_count: Some(1),
            ..Default::default()
        })
    };
    let all = texture
        .create_view(&TextureViewDescriptor { dimension: Some(TextureViewDimension::D2Array), ..Default::default() });
    (all, (0..count).map(layer).collect())
}

impl ShadowMaps {
    /// The uniform of the passes that read the maps, for a camera at `camera` (scene metres).
    pub fn uniform(&self, camera: DVec3, ground: [f32; 4]) -> ShadowUniform {
        let mut cascades = [CascadeUniform::default(); MAX_CASCADES];
        for (slot, cascade) in cascades.iter_mut().zip(&self.cascades) {
            *slot = CascadeUniform {
                map_from_relative: cascade.clip_from_camera(camera).to_cols_array_2d(),
                texel: cascade.texel as f32,
                radius: cascade.radius as f32,
                padding: [0.0; 2],
            };
        }
        ShadowUniform {
            cascades,
            ground,
            cascade_count: self.cascades.len() as i32,
            inverse_map_size: 1.0 / self.map_size as f32,
            padding: [0.0; 2],
        }
    }

    fn resize(&mut self, device: &RenderDevice, settings: &SunShadowSettings) {
        let limit = device.limits().max_texture_dimension_2d;
        let size = settings.map_size.max(16).min(limit.min(8192));
        let count = settings.cascades.min(MAX_CASCADES);
        if count > 0 && (size != self.map_size || count != self.layers.len()) {
            (self.view, self.layers) = create_maps(device, size, count);
            self.map_size = size;
            self.drawn = vec![None; count];
        }
        self.drawn.resize(self.layers.len(), None);
    }
}

/// Places the cascades and gathers the casters of those that changed.
pub fn prepare_shadows(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    meshes: Res<MeshCasters>,
    layouts: (Res<CasterLayouts>, Res<ForestLayouts>),
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    pipelines: Res<PipelineCache>,
    report: Res<FrameReport>,
    mut maps: ResMut<ShadowMaps>,
) {
    let maps = &mut *maps;
    let (caster_layouts, forest_layouts) = layouts;
    maps.work.clear();
    maps.cascades.clear();
    maps.casters.retain(|entity, _| forests.get(*entity).is_some());
    let (Some(view), Some(daylight)) = (&frame.view, &scene.daylight) else { return };
    let settings = scene.shadow;
    let light = &daylight.0;
    let direction = light.key_direction.as_dvec3();
    let why_none = if settings.cascades == 0 {
        Some("no cascades are asked for")
    } else if light.key_illuminance.max_element() <= 0.0 || direction.y <= 0.0 {
        Some("no light that casts a shadow is above the horizon")
    } else if forests.order.is_empty() && meshes.is_empty() {
        Some("nothing casts a shadow")
    } else {
        None
    };
    if let Some(why) = why_none {
        report.skipped("sun_shadow", why);
        return;
    }
    maps.resize(&device, &settings);
    let largest = |measure: fn(&VariantSize) -> f32| {
        forests.iter().flat_map(move |(_, f)| f.sizes.iter().map(move |size| measure(size) * f.max_scale))
    };
    let tallest = largest(|size| size.height).fold(10.0f32, f32::max);
    let widest = largest(|size| size.radius).fold(0.0f32, f32::max);
    let radii = cascade_radii(maps.layers.len(), settings.distance.max(1.0), settings.finest_radius.max(1.0));
    maps.cascades = radii
        .iter()
        .map(|&radius| CascadeBox::new(view.camera, radius, maps.map_size, direction, f64::from(tallest)))
        .collect();

    let content: Vec<_> = forests.iter().map(|(e, forest)| (e, forest.generation, forest.forest.origin)).collect();
    for (index, &place) in maps.cascades.iter().enumerate() {
        let key = CascadeKey {
            place,
            proxy_distance: settings.proxy_distance,
            forests: content.clone(),
            meshes: meshes.state(),
        };
        let name = format!("sun_shadow cascade {index}");
        let this_view = (view.camera, view.clip_from_relative);
        let drawn = maps.drawn[index].as_ref();
        let fits = |drawn: &DrawnCascade| drawn.key == key && drawn.seen_by.is_none_or(|seen_by| seen_by == this_view);
        if drawn.is_some_and(fits) {
            report.skipped(name, "light, box and casters rest");
            continue;
        }
        // Under a new light the map is drawn for this view only: while the light moves, it will not live to see another.
        // If it does, it is completed once and kept. What this view shows is the same either way, as the margin holds what
        // the shaders add to a place before they look it up: a few texels, half a crown for crosses.
        let same_light = drawn.is_some_and(|drawn| drawn.key.place.direction == key.place.direction);
        let margin = 6.0 * place.texel + 0.6 * f64::from(widest);
        let lowest = lowest_receiver(&scene, view.camera, place.radius) - margin;
        let seen = (!same_light).then_some(SeenShadows { camera: view.camera, frustum: &view.frustum, lowest, margin });
        let content = DrawnCascade { key, seen_by: seen.as_ref().map(|_| this_view) };
        let uniform = CascadeViewUniform {
            clip_from_anchor: place.clip_from_anchor().to_cols_array_2d(),
            direction: place.direction.as_vec3().to_array(),
            padding: 0.0,
        };
        queue.write_buffer(&maps.cascade_uniforms, index as u64 * UNIFORM_STRIDE, bytemuck::bytes_of(&uniform));
        // A coarse map could not show a proxy; and near the camera, a finer map has the trees' own shadows already.
        let served = index.checked_sub(1).map_or(0.0, |finer| 0.7 * maps.cascades[finer].radius);
        let proxies = if place.texel < PROXY_TEXEL { served..settings.proxy_distance } else { 0.0..0.0 };
        let mut work = CascadeWork { index, content, forests: Vec::new() };
        for (entity, forest) in forests.iter() {
            let lists = cull_cascade(
                &forest.forest.stand,
                &forest.sizes,
                forest.forest.origin,
                &place,
                proxies.clone(),
                seen.as_ref(),
            );
            let buffers = maps.casters.entry(entity).or_insert_with(|| CasterBuffers {
                uniform: gpu::uniform_slots(&device, "canopy_caster_views", MAX_CASCADES as u64),
                visible: (0..MAX_CASCADES).map(|_| GrowingBuffer::new(&device, "canopy_casters")).collect(),
            });
            let uniform = forest_view(forest, place.center);
            queue.write_buffer(&buffers.uniform, index as u64 * UNIFORM_STRIDE, bytemuck::bytes_of(&uniform));
            let visible = &mut buffers.visible[index];
            visible.write(&device, &queue, &lists.visible);
            let bind_group =
                instance_bind_group(&device, &pipelines, &forest_layouts, forest, &buffers.uniform, visible.buffer());
            work.forests.push(CascadeForest { entity, lists, bind_group });
        }
        let trees: usize = work.forests.iter().map(|forest| forest.lists.visible.len()).sum();
        report.ran(name, format!("{trees} trees within {:.0} m", place.radius));
        maps.work.push(work);
    }
    maps.cascade_bind_group = Some(device.create_bind_group(
        "canopy_cascade",
        &pipelines.get_bind_group_layout(&caster_layouts.cascade),
        &BindGroupEntries::single(BindingResource::Buffer(BufferBinding {
            buffer: &maps.cascade_uniforms,
            offset: 0,
            size: std::num::NonZeroU64::new(size_of::<CascadeViewUniform>() as u64),
        })),
    ));
}

/// Height in scene metres below which nothing within `radius` metres of the camera can be in shadow.
fn lowest_receiver(scene: &ExtractedScene, camera: DVec3, radius: f64) -> f64 {
    let middle = DVec2::new(camera.x, camera.z);
    let ground = scene
        .ground
        .as_ref()
        .map(|(_, ground)| f64::from(ground.terrain.height_bounds(middle - radius, middle + radius).0));
    ground.unwrap_or(f64::NEG_INFINITY).max(camera.y - radius)
}

/// Pipelines of the casters: wood, foliage, crosses.
#[derive(Resource)]
pub struct CasterPipelines(pub [CachedRenderPipelineId; 3]);

impl FromWorld for CasterPipelines {
    fn from_world(world: &mut World) -> Self {
        let cache = world.resource::<PipelineCache>();
        let shaders = world.resource::<CanopyShaders>();
        let cascade = &world.resource::<CasterLayouts>().cascade;
        let forest = world.resource::<ForestLayouts>();
        let describe = |kind: Option<PartKind>| {
            let foliage = kind != Some(PartKind::Wood);
            let file = if kind.is_some() { ShaderFile::SunShadowModel } else { ShaderFile::SunShadowCross };
            let group = if kind.is_some() { forest.part.clone() } else { forest.cross.clone() };
            let defs: Vec<ShaderDefVal> = if foliage { vec!["FOLIAGE".into()] } else { Vec::new() };
            RenderPipelineDescriptor {
                label: Some(format!("canopy_caster_{kind:?}").into()),
                layout: vec![cascade.clone(), forest.instances.clone(), group],
                vertex: VertexState {
                    shader: shaders.get(file),
                    shader_defs: defs.clone(),
                    entry_point: Some("vertex".into()),
                    buffers: if kind.is_some() { vec![PlantVertex::layout()] } else { Vec::new() },
                },
                depth_stencil: Some(caster_depth()),
                fragment: foliage.then(|| FragmentState {
                    shader: shaders.get(file),
                    shader_defs: defs,
                    entry_point: Some("fragment".into()),
                    targets: Vec::new(),
                }),
                ..Default::default()
            }
        };
        Self(
            [Some(PartKind::Wood), Some(PartKind::Foliage), None]
                .map(|kind| cache.queue_render_pipeline(describe(kind))),
        )
    }
}

/// Depth test and write of the maps.
pub fn caster_depth() -> DepthStencilState {
    DepthStencilState {
        format: SHADOW_FORMAT,
        depth_write_enabled: Some(true),
        depth_compare: Some(CompareFunction::GreaterEqual),
        stencil: StencilState::default(),
        bias: DepthBiasState::default(),
    }
}
