//! Bind group 0, which all passes of a view share: frame, light, shadow, and the textures that passes read from each
//! other.
//!
//! This module imports no pass. A pass that produces something for others writes it into [`SharedTextures`] or
//! [`SharedPlacement`] while resources are prepared; until then the group binds a single texel there.

mod light;
pub mod uniforms;

use bevy::{
    app::{App, Plugin},
    ecs::{
        entity::Entity,
        resource::Resource,
        schedule::IntoScheduleConfigs,
        system::{Res, ResMut},
        world::{FromWorld, World},
    },
    render::{
        GpuResourceAppExt, Render, RenderApp, RenderSystems,
        render_resource::{
            AddressMode, BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            BufferUsages, CompareFunction, Extent3d, FilterMode, PipelineCache, Sampler, SamplerBindingType,
            SamplerDescriptor, ShaderStages, TextureDescriptor, TextureDimension, TextureFormat, TextureSampleType,
            TextureUsages, TextureView, TextureViewDescriptor, TextureViewDimension,
            binding_types::{sampler, texture_2d, texture_2d_array, uniform_buffer_sized},
        },
        renderer::{RenderDevice, RenderQueue},
    },
};
use glam::{DVec3, Vec3};

use super::{components::Ground, extract::ExtractedScene, gpu, view::PreparedFrame};
use crate::terrain::ground_noise::NOISE_BLOCK;
use uniforms::{
    CascadeUniform, CascadeViewUniform, FOREST_LAYERS, FrameUniform, LightUniform, MAX_CASCADES, ShadowUniform,
};

/// Mean height of the surface of a closed forest over that of its trees.
const SURFACE_HEIGHT: f32 = 0.75;
/// Format of the shadow maps.
pub const SHADOW_FORMAT: TextureFormat = TextureFormat::Depth32Float;

/// Layout of bind group 0.
pub fn frame_layout() -> BindGroupLayoutDescriptor {
    let size = |bytes: usize| std::num::NonZeroU64::new(bytes as u64);
    BindGroupLayoutDescriptor::new(
        "canopy_frame",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::VERTEX_FRAGMENT,
            (
                uniform_buffer_sized(false, size(size_of::<FrameUniform>())),
                uniform_buffer_sized(false, size(size_of::<LightUniform>())),
                uniform_buffer_sized(false, size(size_of::<ShadowUniform>())),
                texture_2d(TextureSampleType::Float { filterable: true }),
                sampler(SamplerBindingType::Filtering),
                texture_2d_array(TextureSampleType::Depth),
                sampler(SamplerBindingType::Comparison),
                texture_2d(TextureSampleType::Float { filterable: true }),
                texture_2d(TextureSampleType::Float { filterable: true }),
                texture_2d(TextureSampleType::Float { filterable: true }),
            ),
        ),
    )
}

/// Group 0 of the casters of a shadow map: the cascade, with a dynamic offset.
pub fn caster_layout() -> BindGroupLayoutDescriptor {
    BindGroupLayoutDescriptor::new(
        "canopy_cascade",
        &BindGroupLayoutEntries::single(
            ShaderStages::VERTEX,
            uniform_buffer_sized(true, std::num::NonZeroU64::new(size_of::<CascadeViewUniform>() as u64)),
        ),
    )
}

/// The textures of group 0, each written by the pass that computes it.
#[derive(Resource)]
pub struct SharedTextures {
    /// Radiance of the sky.
    pub sky: TextureView,
    /// Depth maps of the sun's shadow, one layer per cascade.
    pub shadow_maps: TextureView,
    /// Terrain shadow and canopy cover, seen from above.
    pub ground: TextureView,
    /// Light inside a stand.
    pub stand_light: TextureView,
    /// What relief hides of the sky's light, over the same area as `ground`.
    pub hidden_sky: TextureView,
}

impl FromWorld for SharedTextures {
    fn from_world(world: &mut World) -> Self {
        let device = world.resource::<RenderDevice>();
        let texel = || gpu::table(device, "canopy_nothing", (1, 1)).1;
        let depth = device.create_texture(&TextureDescriptor {
            label: Some("canopy_no_shadow"),
            size: Extent3d { width: 1, height: 1, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: SHADOW_FORMAT,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let layers = TextureViewDescriptor { dimension: Some(TextureViewDimension::D2Array), ..Default::default() };
        Self {
            sky: texel(),
            shadow_maps: depth.create_view(&layers),
            ground: texel(),
            stand_light: texel(),
            hidden_sky: texel(),
        }
    }
}

/// Position of the shared textures in the view of this frame, each written by the pass that computes the texture.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub struct SharedPlacement {
    /// Cascades of the shadow maps, from the finest to the widest.
    pub cascades: [CascadeUniform; MAX_CASCADES],
    /// Number of cascades.
    pub cascade_count: usize,
    /// Texels along a side of a shadow map.
    pub shadow_map_size: u32,
    /// Camera-relative origin (x, z) and inverse size of the ground texture.
    pub ground: [f32; 4],
    /// Mean canopy cover where the terrain is known.
    pub mean_cover: f32,
    /// Albedo of crowns that are seen together, as a surface.
    pub crown_albedo: Vec3,
    /// For each of the first layers of foliage of the styles, the fraction of the forest's leaves in it and in those before it, 0..1.
    pub crown_layers: [f32; FOREST_LAYERS],
}

/// Group 0 of this frame and its view; empty while a part of it is missing.
#[derive(Resource, Default)]
pub struct FrameBindGroup(Option<(Entity, BindGroup)>);

impl FrameBindGroup {
    /// Group 0 for the view `entity`; `None` for every view but the one that Canopy draws.
    pub fn of(&self, entity: Entity) -> Option<&BindGroup> {
        self.0.as_ref().filter(|(view, _)| *view == entity).map(|(_, group)| group)
    }
}

#[derive(Resource)]
struct FrameBuffers {
    frame: Buffer,
    light: Buffer,
    shadow: Buffer,
    clamp_sampler: Sampler,
    shadow_sampler: Sampler,
}

impl FromWorld for FrameBuffers {
    fn from_world(world: &mut World) -> Self {
        let device = world.resource::<RenderDevice>();
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let clamp = |compare: Option<CompareFunction>| {
            device.create_sampler(&SamplerDescriptor {
                label: Some("canopy_frame"),
                address_mode_u: AddressMode::ClampToEdge,
                address_mode_v: AddressMode::ClampToEdge,
                mag_filter: FilterMode::Linear,
                min_filter: FilterMode::Linear,
                compare,
                ..Default::default()
            })
        };
        Self {
            frame: gpu::buffer_with(device, "canopy_frame", usage, &[FrameUniform::default()]),
            light: gpu::buffer_with(device, "canopy_light", usage, &[LightUniform::default()]),
            shadow: gpu::buffer_with(device, "canopy_shadow", usage, &[ShadowUniform::default()]),
            clamp_sampler: clamp(None),
            // Reversed depth: a point is lit if it is at least as near to the light as the map's depth.
            shadow_sampler: clamp(Some(CompareFunction::GreaterEqual)),
        }
    }
}

/// Creates group 0 of each frame.
pub struct BindingsPlugin;

impl Plugin for BindingsPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .init_gpu_resource::<FrameBuffers>()
            .init_gpu_resource::<SharedTextures>()
            .init_resource::<SharedPlacement>()
            .init_resource::<FrameBindGroup>()
            .add_systems(Render, prepare_bind_group.in_set(RenderSystems::PrepareBindGroups));
    }
}

/// The block of the ground's noise that a coordinate in metres lies in, modulo 2³², and the metres from its middle.
fn noise_position(value: f64) -> (i32, f32) {
    let block = (value / NOISE_BLOCK).round();
    (block as i64 as i32, (value - block * NOISE_BLOCK) as f32)
}

/// The values of [`FrameUniform::forest_surface`], for pixels as coarse as those of a style.
fn forest_surface(ground: Option<&Ground>, focal_pixels: f32) -> [f32; 4] {
    match ground.and_then(|ground| ground.forest_surface) {
        Some(surface) => {
            let fade = surface.in_view(focal_pixels);
            [fade.start, fade.end, SURFACE_HEIGHT * surface.tree_height, 0.0]
        }
        None => [f32::MAX, f32::MAX, 0.0, 0.0],
    }
}

fn prepare_bind_group(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    buffers: Res<FrameBuffers>,
    textures: Res<SharedTextures>,
    placement: Res<SharedPlacement>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    pipelines: Res<PipelineCache>,
    mut group: ResMut<FrameBindGroup>,
) {
    group.0 = None;
    let (Some(view), Some(daylight)) = (&frame.view, &scene.daylight) else { return };
    // The noise is the ground's, and moves with it.
    let on_ground = view.camera - scene.ground.as_ref().map_or(DVec3::ZERO, |(.., origin)| *origin);
    let [(block_x, x), (block_z, z)] = [on_ground.x, on_ground.z].map(noise_position);
    let frame_uniform = FrameUniform {
        clip_from_relative: view.clip_from_relative.to_cols_array_2d(),
        relative_from_clip: view.clip_from_relative.inverse().to_cols_array_2d(),
        camera: [x, view.camera.y as f32, z],
        focal_length_pixels: view.focal_pixels,
        mean_cover: placement.mean_cover,
        openness: view.openness,
        noise_block: [block_x, block_z],
        forest_surface: forest_surface(
            scene.ground.as_ref().map(|(_, ground, _)| ground),
            view.focal_pixels / view.blur,
        ),
        crown_albedo: placement.crown_albedo.to_array(),
        albedo_padding: 0.0,
        crown_layers: placement.crown_layers,
    };
    let light_uniform = light::light_uniform(&daylight.0, view.exposure);
    let shadow_uniform = ShadowUniform {
        cascades: placement.cascades,
        ground: placement.ground,
        cascade_count: placement.cascade_count as i32,
        inverse_map_size: 1.0 / placement.shadow_map_size.max(1) as f32,
        softness: scene.shadow.soft_edge(),
        padding: 0.0,
    };
    queue.write_buffer(&buffers.frame, 0, bytemuck::bytes_of(&frame_uniform));
    queue.write_buffer(&buffers.light, 0, bytemuck::bytes_of(&light_uniform));
    queue.write_buffer(&buffers.shadow, 0, bytemuck::bytes_of(&shadow_uniform));
    let made = device.create_bind_group(
        "canopy_frame",
        &pipelines.get_bind_group_layout(&frame_layout()),
        &BindGroupEntries::sequential((
            buffers.frame.as_entire_binding(),
            buffers.light.as_entire_binding(),
            buffers.shadow.as_entire_binding(),
            &textures.sky,
            &buffers.clamp_sampler,
            &textures.shadow_maps,
            &buffers.shadow_sampler,
            &textures.ground,
            &textures.stand_light,
            &textures.hidden_sky,
        )),
    );
    group.0 = Some((view.entity, made));
}
