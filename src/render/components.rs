//! What a Bevy program writes into its world to have a forest: a handful of components and resources.

use std::sync::Arc;

use bevy::{
    app::{App, Plugin},
    camera::{Camera3d, Exposure, Hdr, visibility::Visibility},
    core_pipeline::tonemapping::Tonemapping,
    ecs::{
        component::Component, lifecycle::HookContext, reflect::ReflectComponent, resource::Resource,
        world::DeferredWorld,
    },
    prelude::{ReflectDefault, ReflectResource},
    reflect::Reflect,
    render::extract_component::{ExtractComponent, ExtractComponentPlugin},
    transform::components::Transform,
};
use glam::{DVec3, Vec3};

use crate::{
    bake::BakedPlant,
    light::LightState,
    lod::Levels,
    scatter::{CoverMap, PackedStand},
    terrain::Terrain,
};

pub use crate::bake::lighting::SunLight;

/// From the camera's exposed radiance to what a screen shows: the tone curve for which Canopy's light is made.
pub const TONEMAPPING: Tonemapping = Tonemapping::BlenderFilmic;

/// A camera that sees Canopy's sky, ground and forests. One camera at a time; a second one is refused with a message.
///
/// Its exposure follows the light of the moment, its [`Tonemapping`] is [`TONEMAPPING`] unless the program gives another. It
/// brings its [`Camera3d`] along; one that stands before it in a bundle brings Bevy's own default tone curve.
#[derive(Component, Clone, Copy, Debug, Default, ExtractComponent, Reflect)]
#[reflect(Component, Default)]
#[require(Camera3d, Hdr, Exposure, Tonemapping = TONEMAPPING, ViewOptions)]
#[component(on_add = set_tone_curve)]
pub struct CanopyCamera;

/// A `Camera3d` in the same bundle brings Bevy's default curve, which goes before what [`CanopyCamera`] requires.
fn set_tone_curve(mut world: DeferredWorld, context: HookContext) {
    if let Some(mut curve) = world.get_mut::<Tonemapping>(context.entity)
        && *curve == Tonemapping::default()
    {
        *curve = TONEMAPPING;
    }
}

/// The scene position, in f64 metres, of the Bevy world's origin.
///
/// Bevy's transforms are f32. A program that roams far moves this origin along with the camera, so that what Bevy
/// sees stays small ([`FloatingOrigin`](crate::components::FloatingOrigin) does it); Canopy's own positions are f64 up to
/// the camera and never jitter.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Reflect)]
#[reflect(Resource, Default)]
pub struct CanopyOrigin(pub DVec3);

impl CanopyOrigin {
    /// Metres to which [`near`](Self::near) rounds: f32 has steps of 0.06 mm there.
    const STEP: f64 = 1024.0;

    /// An origin near `position` (scene metres).
    pub fn near(position: DVec3) -> Self {
        Self((position / Self::STEP).round() * Self::STEP)
    }

    /// The Bevy translation of `position` (scene metres).
    pub fn translation(&self, position: DVec3) -> Vec3 {
        (position - self.0).as_vec3()
    }
}

/// A forest: trees of one packed stand, each an instance of one of the baked plants.
///
/// Its global translation, in the scene's frame (not moved by [`CanopyOrigin`]), is added to `origin`; it is drawn where its
/// inherited visibility and its render layers let the camera see it. Rotation and scale have no effect.
#[derive(Component, Clone, Debug)]
#[require(Transform, Visibility)]
pub struct Forest {
    /// Where the trees stand.
    pub stand: Arc<PackedStand>,
    /// The plants, indexed by the trees' variant; at most 1,024.
    pub plants: Arc<Vec<BakedPlant>>,
    /// How the sun lights each plant; [`SunLight::LeafShader`] where the list ends.
    pub suns: Arc<[SunLight]>,
    /// Scene position in metres of the stand's own origin.
    pub origin: DVec3,
    /// The representations of the trees, from near to far.
    pub levels: Levels,
    /// Metres beyond which trees are not drawn.
    pub view_distance: f32,
}

/// The ground under everything. One at a time is drawn, the first that can be seen.
///
/// As for a [`Forest`], its global translation, inherited visibility and render layers take effect.
#[derive(Component, Clone, Debug)]
#[require(Transform, Visibility)]
pub struct Ground {
    /// Heights; scene metres, origin at the terrain's centre.
    pub terrain: Arc<Terrain>,
    /// Share of ground under crowns, where a forest stands on it.
    pub cover: Option<Arc<CoverMap>>,
    /// Greatest distance in pixels between the drawn and the true surface, 0.25 to 32. Lower: more triangles.
    pub error_pixels: f64,
    /// Metres to which the ground is drawn, over its mirrored surroundings too.
    pub view_distance: f64,
}

/// The light of the moment. Set it whenever the sun moves; while it stays the same [`Arc`], nothing is computed anew.
#[derive(Resource, Clone, Debug)]
pub struct Daylight(pub Arc<LightState>);

/// The shadow maps of the sun and the moon: beside a [`Sun`](crate::components::Sun), which has the defaults.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Default)]
pub struct SunShadowSettings {
    /// Texels along a side of each map, 256 to 8192. Twice the size halves the texel and quadruples the fill.
    pub map_size: u32,
    /// Number of cascades, 1 to 4; 0 switches the maps off (the terrain's own shadow stays).
    pub cascades: usize,
    /// Metres around the camera that the finest cascade serves.
    pub finest_radius: f64,
    /// Metres around the camera that the widest cascade serves; beyond it the ground is darkened by its canopy cover.
    pub distance: f64,
    /// Metres around the camera within which casters are the plants' shadow proxies instead of billboards.
    pub proxy_distance: f64,
}

impl Default for SunShadowSettings {
    /// As a scene with the default quality has them.
    fn default() -> Self {
        Self { map_size: 2048, cascades: 4, finest_radius: 30.0, distance: 800.0, proxy_distance: 80.0 }
    }
}

/// How a camera draws, for looking and for measuring.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, ExtractComponent, Reflect)]
#[reflect(Component, Default)]
pub struct ViewOptions {
    /// Tints trees by their level of detail, each level in a colour of its own.
    pub tint_levels: bool,
}

/// An ordinary Bevy mesh that casts its shadow onto Canopy's trees and ground.
#[derive(Component, Clone, Copy, Debug, Default, Reflect)]
#[reflect(Component, Default)]
pub struct CastsCanopyShadow;

/// Registers the components that the render world needs.
pub struct ComponentsPlugin;

impl Plugin for ComponentsPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins((
            ExtractComponentPlugin::<CanopyCamera>::default(),
            ExtractComponentPlugin::<ViewOptions>::default(),
        ))
        .register_type::<(CanopyCamera, CanopyOrigin, SunShadowSettings, ViewOptions, CastsCanopyShadow)>()
        .init_resource::<CanopyOrigin>();
    }
}

#[cfg(test)]
mod tests {
    use bevy::ecs::world::World;

    use super::*;

    #[test]
    fn a_camera_has_the_tone_curve_of_the_screenshots_unless_the_program_chose_one() {
        let mut world = World::new();
        let alone = world.spawn(CanopyCamera).id();
        let beside = world.spawn((Camera3d::default(), CanopyCamera)).id();
        let chosen = world.spawn((Camera3d::default(), CanopyCamera, Tonemapping::AgX)).id();
        let curves = [alone, beside, chosen].map(|camera| world.get::<Tonemapping>(camera).copied());
        assert_eq!(curves, [Some(TONEMAPPING), Some(TONEMAPPING), Some(Tonemapping::AgX)]);
    }
}
