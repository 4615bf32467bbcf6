//! What a Bevy program writes into its world to have a forest: a handful of components and resources.

use std::sync::Arc;

use bevy::{
    app::{App, Plugin},
    camera::{Camera3d, Hdr},
    ecs::{component::Component, resource::Resource},
    render::extract_component::{ExtractComponent, ExtractComponentPlugin},
};
use glam::DVec3;

use crate::{
    bake::BakedPlant,
    light::LightState,
    lod::Levels,
    scatter::{CoverMap, PackedStand},
    terrain::Terrain,
};

pub use crate::bake::lighting::SunLight;

/// A camera that sees Canopy's sky, ground and forests. One camera at a time; a second one is refused with a message.
#[derive(Component, Clone, Copy, Debug, Default, ExtractComponent)]
#[require(Camera3d, Hdr)]
pub struct CanopyCamera;

/// The scene position, in f64 metres, of the Bevy world's origin.
///
/// Bevy's transforms are f32. A program that roams far moves this origin along with the camera, so that what Bevy
/// sees stays small; Canopy's own positions are f64 up to the camera and never jitter.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct CanopyOrigin(pub DVec3);

/// A forest: trees of one packed stand, each an instance of one of the baked plants.
#[derive(Component, Clone, Debug)]
pub struct Forest {
    /// Where the trees stand.
    pub stand: Arc<PackedStand>,
    /// The plants, indexed by the trees' variant; at most 64.
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

/// The ground under everything.
#[derive(Component, Clone, Debug)]
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

/// The sun's shadow.
#[derive(Resource, Clone, Copy, Debug, PartialEq)]
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

/// How a view is drawn, for looking and for measuring.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ViewOptions {
    /// Tints trees by their level of detail: full models green, crosses blue.
    pub tint_levels: bool,
}

/// An ordinary Bevy mesh that casts its shadow onto Canopy's trees and ground.
#[derive(Component, Clone, Copy, Debug, Default)]
pub struct CastsCanopyShadow;

/// Registers the components that the render world needs.
pub struct ComponentsPlugin;

impl Plugin for ComponentsPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins(ExtractComponentPlugin::<CanopyCamera>::default())
            .init_resource::<CanopyOrigin>()
            .init_resource::<SunShadowSettings>()
            .init_resource::<ViewOptions>();
    }
}
