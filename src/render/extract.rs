//! What the render world learns of the main world each frame: shared pointers and a few numbers, nothing copied.

use bevy::{
    asset::{AssetEvent, AssetId},
    ecs::{
        entity::Entity,
        message::MessageReader,
        query::With,
        resource::Resource,
        system::{Query, Res, ResMut},
    },
    math::Affine3A,
    mesh::{Mesh, Mesh3d},
    platform::collections::HashMap,
    render::Extract,
    transform::components::GlobalTransform,
};
use glam::DVec3;

use super::components::{CanopyOrigin, CastsCanopyShadow, Daylight, Forest, Ground, SunShadowSettings, ViewOptions};

/// The main world's side of a frame.
#[derive(Resource, Default)]
pub struct ExtractedScene {
    /// Scene position of the Bevy world's origin, metres.
    pub origin: DVec3,
    /// Forests by main-world entity, in the entities' order.
    pub forests: Vec<(Entity, Forest)>,
    /// The first ground, if any.
    pub ground: Option<(Entity, Ground)>,
    /// The light, if it has been set.
    pub daylight: Option<Daylight>,
    /// Meshes that cast onto Canopy's passes, with their place in the Bevy world.
    pub casters: Vec<(AssetId<Mesh>, Affine3A)>,
    /// How often each mesh was changed.
    pub mesh_revisions: HashMap<AssetId<Mesh>, u64>,
    /// Shadow settings.
    pub shadow: SunShadowSettings,
    /// View options.
    pub options: ViewOptions,
}

/// Fills [`ExtractedScene`].
pub fn extract_scene(
    mut scene: ResMut<ExtractedScene>,
    origin: Extract<Res<CanopyOrigin>>,
    forests: Extract<Query<(Entity, &Forest)>>,
    grounds: Extract<Query<(Entity, &Ground)>>,
    casters: Extract<Query<(Entity, &Mesh3d, &GlobalTransform), With<CastsCanopyShadow>>>,
    mut changes: Extract<MessageReader<AssetEvent<Mesh>>>,
    daylight: Extract<Option<Res<Daylight>>>,
    shadow: Extract<Res<SunShadowSettings>>,
    options: Extract<Res<ViewOptions>>,
) {
    scene.origin = origin.0;
    scene.forests.clear();
    scene.forests.extend(forests.iter().map(|(entity, forest)| (entity, forest.clone())));
    scene.forests.sort_by_key(|(entity, _)| *entity);
    scene.ground = grounds.iter().min_by_key(|(entity, _)| *entity).map(|(entity, ground)| (entity, ground.clone()));
    scene.daylight = daylight.as_ref().map(|light| Daylight(light.0.clone()));
    let mut meshes: Vec<_> = casters.iter().collect();
    meshes.sort_by_key(|(entity, ..)| *entity);
    for event in changes.read() {
        if let AssetEvent::Modified { id } = event {
            *scene.mesh_revisions.entry(*id).or_default() += 1;
        }
    }
    scene.casters.clear();
    scene.casters.extend(meshes.into_iter().map(|(_, mesh, place)| (mesh.0.id(), place.affine())));
    scene.shadow = **shadow;
    scene.options = **options;
}
