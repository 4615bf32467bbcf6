//! Extracts the main world's data for the render world each frame: shared pointers and a few numbers, no copies.

use bevy::{
    asset::{AssetEvent, AssetId},
    camera::{
        Camera,
        visibility::{InheritedVisibility, RenderLayers},
    },
    ecs::{
        entity::Entity,
        message::MessageReader,
        query::With,
        resource::Resource,
        system::{Query, Res, ResMut},
    },
    light::DirectionalLight,
    log::{error_once, warn_once},
    math::Affine3A,
    mesh::{Mesh, Mesh3d},
    platform::collections::HashMap,
    render::Extract,
    transform::components::GlobalTransform,
};
use glam::{DVec3, Quat, Vec3};

use super::components::{
    CanopyCamera, CanopyOrigin, CastsCanopyShadow, Daylight, Forest, ForestUpdates, Ground, LightUpdates,
    SunShadowSettings, TextureCompression, TreeLists,
};

/// The data of the main world for a frame.
#[derive(Resource, Default)]
pub struct ExtractedScene {
    /// Scene position of the Bevy world's origin, metres.
    pub origin: DVec3,
    /// Forests by main-world entity, in the entities' order.
    pub forests: Vec<(Entity, Forest)>,
    /// The first ground that the camera can see, if any, and the scene position of its terrain's own origin.
    pub ground: Option<(Entity, Ground, DVec3)>,
    /// The light, if it has been set.
    pub daylight: Option<Daylight>,
    /// When what follows from the light is computed.
    pub light_updates: LightUpdates,
    /// When forests are brought onto the device.
    pub forest_updates: ForestUpdates,
    /// Meshes that cast onto Canopy's passes, with their transform in the Bevy world.
    pub casters: Vec<(AssetId<Mesh>, Affine3A)>,
    /// How often each mesh was changed.
    pub mesh_revisions: HashMap<AssetId<Mesh>, u64>,
    /// Whether a directional light of Bevy's has shadow maps, for ordinary meshes.
    pub mesh_shadows: bool,
    /// Shadow settings.
    pub shadow: SunShadowSettings,
    /// How the lists of trees are made.
    pub tree_lists: TreeLists,
    /// Whether textures of forests that are new are block-compressed.
    pub texture_compression: TextureCompression,
}

/// The components that decide where an entity is drawn, and whether.
type Placed = (&'static GlobalTransform, &'static InheritedVisibility, Option<&'static RenderLayers>);

/// Fills [`ExtractedScene`].
pub fn extract_scene(
    mut scene: ResMut<ExtractedScene>,
    origin: Extract<Res<CanopyOrigin>>,
    cameras: Extract<Query<(Entity, &Camera, Option<&RenderLayers>), With<CanopyCamera>>>,
    forests: Extract<Query<(Entity, &Forest, Placed)>>,
    grounds: Extract<Query<(Entity, &Ground, Placed)>>,
    casters: Extract<Query<(Entity, &Mesh3d, &GlobalTransform), With<CastsCanopyShadow>>>,
    mut changes: Extract<MessageReader<AssetEvent<Mesh>>>,
    (daylight, light_updates, forest_updates, tree_lists, compression): (
        Extract<Option<Res<Daylight>>>,
        Extract<Option<Res<LightUpdates>>>,
        Extract<Option<Res<ForestUpdates>>>,
        Extract<Option<Res<TreeLists>>>,
        Extract<Option<Res<TextureCompression>>>,
    ),
    shadows: Extract<Query<(Entity, &SunShadowSettings)>>,
    lights: Extract<Query<&DirectionalLight>>,
) {
    scene.origin = origin.0;
    // The camera that is drawn, in the same order as in `prepare_view`.
    let camera = cameras
        .iter()
        .filter(|(_, camera, _)| camera.is_active)
        .min_by_key(|(entity, camera, _)| (camera.order, *entity));
    let layers = camera.and_then(|(.., layers)| layers).cloned().unwrap_or_default();
    let seen = |(_, visibility, own): &(&GlobalTransform, &InheritedVisibility, Option<&RenderLayers>)| {
        visibility.get() && own.unwrap_or(&RenderLayers::default()).intersects(&layers)
    };
    scene.forests.clear();
    for (entity, forest, placed) in forests.iter().filter(|(.., placed)| seen(placed)) {
        let mut forest = Forest { origin: forest.origin + translation(placed.0), ..forest.clone() };
        forest.levels.sanitize();
        scene.forests.push((entity, forest));
    }
    scene.forests.sort_by_key(|(entity, _)| *entity);
    let visible = || grounds.iter().filter(|(.., placed)| seen(placed));
    if visible().count() > 1 {
        error_once!("{} grounds are visible, but only one is drawn: hide or despawn the others", visible().count());
    }
    let ground = visible().min_by_key(|(entity, ..)| *entity);
    scene.ground = ground.map(|(entity, ground, placed)| (entity, ground.clone(), translation(placed.0)));
    scene.daylight = daylight.as_deref().cloned();
    scene.tree_lists = tree_lists.as_deref().copied().unwrap_or_default();
    scene.texture_compression = compression.as_deref().copied().unwrap_or_default();
    scene.light_updates = light_updates.as_deref().copied().unwrap_or_default();
    scene.forest_updates = forest_updates.as_deref().copied().unwrap_or_default();
    let mut meshes: Vec<_> = casters.iter().collect();
    meshes.sort_by_key(|(entity, ..)| *entity);
    for event in changes.read() {
        if let AssetEvent::Modified { id } = event {
            *scene.mesh_revisions.entry(*id).or_default() += 1;
        }
    }
    scene.casters.clear();
    scene.casters.extend(meshes.into_iter().map(|(_, mesh, place)| (mesh.0.id(), place.affine())));
    scene.mesh_shadows = lights.iter().any(|light| light.shadow_maps_enabled);
    let shadow = shadows.iter().min_by_key(|(entity, _)| *entity);
    scene.shadow = shadow.map(|(_, settings)| *settings).unwrap_or_default();
}

/// The translation of a transform; zero if it is not finite.
fn translation(transform: &GlobalTransform) -> DVec3 {
    let (scale, rotation, translation) = transform.to_scale_rotation_translation();
    if !translation.is_finite() {
        warn_once!("the transform of a forest or a ground is not finite: it is ignored");
        return DVec3::ZERO;
    }
    if !scale.abs_diff_eq(Vec3::ONE, 1e-4) || rotation.angle_between(Quat::IDENTITY) > 1e-3 {
        warn_once!("a forest or a ground is rotated or scaled, which has no effect: only its translation counts");
    }
    translation.as_dvec3()
}
