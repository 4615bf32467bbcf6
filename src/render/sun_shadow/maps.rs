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
            BindGroup, Buffer, Extent3d, Texture, TextureDescriptor, TextureDimension, TextureUsages, TextureView,
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

/// A forest that casts: its entity, its generation, its origin, and the distances at which each level casts.
pub type ForestKey = (Entity, u64, DVec3, Vec<Range<f64>>);

/// Everything that a cascade's map depends on. Equal keys have equal maps.
#[derive(Clone, Debug, PartialEq)]
pub struct CascadeKey {
    /// Position of the cascade.
    pub place: CascadeBox,
    /// The forests that cast.
    pub forests: Vec<ForestKey>,
    /// State of the ordinary meshes that cast.
    pub meshes: u64,
}

impl CascadeKey {
    /// The state of a map that takes up no new forest yet, if `self` has one that `drawn` has not; `drawn` is what the
    /// map holds. A forest that was replaced where it stands keeps the shadow of the one before, as long as nothing else
    /// has changed.
    pub fn without_new_forests(&self, drawn: Option<&Self>) -> Option<Self> {
        let known = |entity| drawn?.forests.iter().find(|known| known.0 == entity);
        let kept = Self {
            forests: self.forests.iter().filter_map(|forest| known(forest.0)).cloned().collect(),
            ..self.clone()
        };
        let replaced = |(old, new): (&ForestKey, &ForestKey)| (old.0, old.2) == (new.0, new.2);
        let same_places = kept.forests.iter().all(|old| self.forests.iter().any(|new| replaced((old, new))));
        if drawn == Some(&kept) && same_places && kept != *self {
            return Some(kept);
        }
        let older = Self {
            forests: self.forests.iter().filter(|forest| known(forest.0).is_some()).cloned().collect(),
            ..self.clone()
        };
        (older != *self).then_some(older)
    }
}

/// The state that a layer was drawn for.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnCascade {
    /// What the map depends on.
    pub key: CascadeKey,
    /// Camera and view for which the casters were chosen; `None` if all casters were drawn.
    pub seen_by: Option<(DVec3, Mat4)>,
    /// Whether trees are missing, as a list was too short for them.
    pub incomplete: bool,
}

/// What is drawn into one cascade of one forest.
pub struct CascadeForest {
    /// Which forest.
    pub entity: Entity,
    /// Its trees, with group 1, whose dynamic offset is that of the cascade.
    pub pages: Vec<PreparedPage>,
}

/// A map that takes up new forests: drawn beside the cascade's own, a share of its casters in each frame, and copied over
/// it when it is complete.
pub struct FreshMap {
    /// Which layer it is for.
    pub index: usize,
    /// The state that it is drawn for.
    pub content: DrawnCascade,
    /// Shares that are drawn, of [`MAP_SHARES`](crate::render::forest::MAP_SHARES).
    pub shares: u32,
    /// The map.
    pub texture: Texture,
    /// Its view, for drawing.
    pub view: TextureView,
}

/// A cascade that must be drawn in this frame.
pub struct CascadeWork {
    /// Which layer.
    pub index: usize,
    /// The state that the map is drawn for.
    pub content: DrawnCascade,
    /// Whether only the next share of it is drawn, into the [`FreshMap`].
    pub fresh: bool,
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
    /// All layers.
    pub texture: Texture,
    /// All layers, for sampling.
    pub view: TextureView,
    /// One view per layer, for drawing.
    pub layers: Vec<TextureView>,
    /// Cascades of this frame, finest first.
    pub cascades: Vec<CascadeBox>,
    /// The state of each layer.
    pub drawn: Vec<Option<DrawnCascade>>,
    /// The map that is drawn over several frames, if there is one.
    pub fresh: Option<FreshMap>,
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
        let (texture, view, layers) = create_maps(device, 1, 1);
        Self {
            texture,
            view,
            layers,
            cascades: Vec::new(),
            drawn: Vec::new(),
            fresh: None,
            work: Vec::new(),
            cascade_bind_group: None,
            map_size: 1,
            cascade_uniforms: gpu::uniform_slots(device, "canopy_cascades", MAX_CASCADES as u64),
            casters: HashMap::default(),
        }
    }
}

fn create_maps(device: &RenderDevice, size: u32, count: usize) -> (Texture, TextureView, Vec<TextureView>) {
    let texture = create_texture(device, size, count);
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
    let layers = (0..count).map(layer).collect();
    (texture, all, layers)
}

fn create_texture(device: &RenderDevice, size: u32, count: usize) -> Texture {
    device.create_texture(&TextureDescriptor {
        label: Some("canopy_sun_shadow"),
        size: Extent3d { width: size, height: size, depth_or_array_layers: count.max(1) as u32 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: SHADOW_FORMAT,
        usage: TextureUsages::RENDER_ATTACHMENT
            | TextureUsages::TEXTURE_BINDING
            | TextureUsages::COPY_SRC
            | TextureUsages::COPY_DST,
        view_formats: &[],
    })
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
            (self.texture, self.view, self.layers) = create_maps(device, size, count);
            self.map_size = size;
            self.drawn = vec![None; count];
            self.fresh = None;
        }
        self.drawn.resize(self.layers.len(), None);
    }

    /// Begins a `FreshMap` of `content` for the layer `index`, or goes on with it.
    pub fn continue_fresh(&mut self, device: &RenderDevice, index: usize, content: &DrawnCascade) {
        let same = |fresh: &FreshMap| fresh.index == index && fresh.content == *content;
        if self.fresh.as_ref().is_some_and(same) {
            return;
        }
        let texture = create_texture(device, self.map_size, 1);
        let view = texture.create_view(&TextureViewDescriptor::default());
        self.fresh = Some(FreshMap { index, content: content.clone(), shares: 0, texture, view });
    }
}

#[cfg(test)]
mod tests {
    use bevy::ecs::world::World;

    use super::*;

    #[test]
    fn a_map_waits_with_new_forests_and_with_nothing_else() {
        let mut world = World::new();
        let [old, new] = [(); 2].map(|()| world.spawn_empty().id());
        let place = |x: f64| CascadeBox::new(DVec3::X * x, 30.0, 1024, DVec3::Y, 10.0);
        let forest = |entity, generation, x: f64| -> ForestKey { (entity, generation, DVec3::X * x, vec![0.0..80.0]) };
        let key = |x, forests: &[ForestKey]| CascadeKey { place: place(x), forests: forests.to_vec(), meshes: 7 };

        // What is the same needs no waiting; neither does what moved.
        let drawn = key(0.0, &[forest(old, 1, 0.0)]);
        assert_eq!(drawn.without_new_forests(Some(&drawn)), None);
        assert_eq!(key(500.0, &drawn.forests).without_new_forests(Some(&drawn)), None);
        assert_eq!(key(0.0, &[forest(old, 2, 9.0)]).without_new_forests(Some(&drawn)), None);
        // A new forest is left out, whatever the map holds.
        let both = |x| key(x, &[forest(old, 1, 0.0), forest(new, 2, 0.0)]);
        for x in [0.0, 500.0] {
            assert_eq!(both(x).without_new_forests(Some(&drawn)), Some(key(x, &drawn.forests)));
        }
        assert_eq!(both(0.0).without_new_forests(None), Some(key(0.0, &[])));
        let other = key(0.0, &[forest(new, 2, 0.0)]);
        assert_eq!(key(0.0, &[forest(old, 3, 0.0)]).without_new_forests(Some(&other)), Some(key(0.0, &[])));
        // One that was replaced keeps its shadow while the map stays where it is.
        assert_eq!(key(0.0, &[forest(old, 2, 0.0)]).without_new_forests(Some(&drawn)), Some(drawn.clone()));
        assert_eq!(key(500.0, &[forest(old, 2, 0.0)]).without_new_forests(Some(&drawn)), None);
    }
}
