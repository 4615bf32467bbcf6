//! The shadow maps on the device, and the state that each of them was drawn for.

use std::ops::Range;

use bevy::{
    ecs::{
        entity::Entity,
        resource::Resource,
        world::{FromWorld, World},
    },
    platform::collections::HashMap,
    render::{
        render_resource::{
            BindGroup, Buffer, Extent3d, TextureDescriptor, TextureDimension, TextureUsages, TextureView,
            TextureViewDescriptor, TextureViewDimension,
        },
        renderer::RenderDevice,
    },
};
use glam::{DVec3, Mat4};

use crate::{
    cull::cascades::CascadeBox,
    render::{
        bindings::{
            SHADOW_FORMAT,
            uniforms::{CascadeUniform, MAX_CASCADES},
        },
        components::SunShadowSettings,
        forest::{ListSlot, PreparedPage},
        gpu,
    },
};

/// Everything that a cascade's map depends on. Equal keys have equal maps.
#[derive(Clone, Debug, PartialEq)]
pub struct CascadeKey {
    /// Position of the cascade.
    pub place: CascadeBox,
    /// Per forest: its generation, its origin, and the distances at which each level casts.
    pub forests: Vec<(Entity, u64, DVec3, Vec<Range<f64>>)>,
    /// State of the ordinary meshes that cast.
    pub meshes: u64,
}

/// The state that a layer was drawn for.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnCascade {
    /// What the map depends on.
    pub key: CascadeKey,
    /// Camera and view for which the casters were chosen; `None` if all casters were drawn.
    pub seen_by: Option<(DVec3, Mat4)>,
}

/// What is drawn into one cascade of one forest.
pub struct CascadeForest {
    /// Which forest.
    pub entity: Entity,
    /// Its trees, with group 1, whose dynamic offset is that of the cascade.
    pub pages: Vec<PreparedPage>,
}

/// A cascade that must be drawn in this frame.
pub struct CascadeWork {
    /// Which layer.
    pub index: usize,
    /// The state that the map is drawn for.
    pub content: DrawnCascade,
    /// Casters.
    pub forests: Vec<CascadeForest>,
}

/// Group 1 of a forest's casters.
pub struct CasterBuffers {
    /// One entry per cascade.
    pub uniform: Buffer,
    /// The lists of the casting trees, by cascade and page.
    pub lists: [Vec<ListSlot>; MAX_CASCADES],
}

/// The shadow maps and their state.
#[derive(Resource)]
pub struct ShadowMaps {
    /// All layers, for sampling.
    pub view: TextureView,
    /// One view per layer, for drawing.
    pub layers: Vec<TextureView>,
    /// Cascades of this frame, finest first.
    pub cascades: Vec<CascadeBox>,
    /// The state of each layer.
    pub drawn: Vec<Option<DrawnCascade>>,
    /// Cascades to draw in this frame.
    pub work: Vec<CascadeWork>,
    /// Group 0 of the casters.
    pub cascade_bind_group: Option<BindGroup>,
    /// Texels along a side.
    pub map_size: u32,
    /// One [`CascadeViewUniform`](crate::render::bindings::uniforms::CascadeViewUniform) per cascade.
    pub cascade_uniforms: Buffer,
    /// Buffers of the forests that cast.
    pub casters: HashMap<Entity, CasterBuffers>,
}

impl FromWorld for ShadowMaps {
    fn from_world(world: &mut World) -> Self {
        let device = world.resource::<RenderDevice>();
        // One texel is enough while no shadow is requested: a scene allocates nothing large that it does not use.
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
    /// The cascades in the form that reading passes need, for a camera at `camera` (scene metres).
    pub fn uniforms(&self, camera: DVec3) -> [CascadeUniform; MAX_CASCADES] {
        let mut cascades = [CascadeUniform::default(); MAX_CASCADES];
        for (slot, cascade) in cascades.iter_mut().zip(&self.cascades) {
            *slot = CascadeUniform {
                map_from_relative: cascade.clip_from_camera(camera).to_cols_array_2d(),
                texel: cascade.texel as f32,
                radius: cascade.radius as f32,
                padding: [0.0; 2],
            };
        }
        cascades
    }

    /// Creates maps of the size and number in `settings`, within the limits of the device.
    pub fn resize(&mut self, device: &RenderDevice, settings: &SunShadowSettings) {
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
