//! The components and resources that a Bevy program needs to draw a forest.

use std::sync::Arc;

use bevy::{
    app::{App, Plugin, PostUpdate},
    camera::{Camera3d, Exposure, Hdr, visibility::Visibility},
    core_pipeline::tonemapping::Tonemapping,
    ecs::{
        component::Component,
        lifecycle::HookContext,
        query::{With, Without},
        reflect::ReflectComponent,
        resource::Resource,
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
    lod::{FadeBand, Levels, error_curve::nominal_focal_length, level_distance::NOMINAL_HEIGHT},
    math::Range,
    scatter::{CoverMap, PackedStand},
    terrain::{Drape, Terrain},
};

use super::camera_style::follow_palettes;
pub use super::camera_style::{CanopyStyle, DrawnStyle};
pub use crate::bake::{levels::texture::Compression, lighting::SunLight};

/// The tone curve for which Canopy's light is made: from the camera's exposed radiance to display values.
pub const TONEMAPPING: Tonemapping = Tonemapping::BlenderFilmic;

/// A camera that draws Canopy's sky, ground and forests. One camera at a time; a second one is rejected with a message.
///
/// Its exposure follows the current light. Its [`Tonemapping`] is [`TONEMAPPING`] unless the program inserts another.
/// It requires a [`Camera3d`]; an explicit one in the same bundle brings Bevy's own default tone curve.
#[derive(Component, Clone, Copy, Debug, Default, ExtractComponent, Reflect)]
#[reflect(Component, Default)]
#[require(Camera3d, Hdr, Exposure, Tonemapping = TONEMAPPING, ViewOptions, CameraOpenness)]
#[component(on_add = set_tone_curve)]
pub struct CanopyCamera;

/// A `Camera3d` in the same bundle brings Bevy's default curve, which takes precedence over [`CanopyCamera`]'s.
fn set_tone_curve(mut world: DeferredWorld, context: HookContext) {
    if let Some(mut curve) = world.get_mut::<Tonemapping>(context.entity)
        && *curve == Tonemapping::default()
    {
        *curve = TONEMAPPING;
    }
}

/// The scene position, in f64 metres, of the Bevy world's origin.
///
/// Bevy's transforms are f32. A program whose camera travels far moves this origin with the camera, so that Bevy's
/// coordinates stay small ([`FloatingOrigin`](crate::components::FloatingOrigin) does it). Canopy's own positions are
/// f64 up to the camera and never jitter.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Reflect)]
#[reflect(Resource, Default)]
pub struct CanopyOrigin(pub DVec3);

impl CanopyOrigin {
    /// Step in metres to which [`near`](Self::near) rounds: within it, f32 has steps of at most 0.06 mm.
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
/// Its global translation, in the scene's frame (not moved by [`CanopyOrigin`]), is added to `origin`; it is drawn if
/// its inherited visibility and its render layers let the camera see it. Rotation and scale have no effect.
///
/// Reflection does not show the shared lists: nothing in them can be edited one by one, since they belong together and
/// were packed for the device. A program replaces them as a whole.
#[derive(Component, Clone, Debug, Reflect)]
#[reflect(Component, Debug, from_reflect = false)]
#[require(Transform, Visibility)]
pub struct Forest {
    /// The trees and their positions.
    #[reflect(ignore, clone)]
    pub stand: Arc<PackedStand>,
    /// The plants, indexed by the trees' variant; at most 1,024.
    #[reflect(ignore, clone)]
    pub plants: Arc<Vec<BakedPlant>>,
    /// How the sun lights each plant; the default beyond the end of the list.
    #[reflect(ignore, clone)]
    pub suns: Arc<[SunLight]>,
    /// Scene position in metres of the stand's own origin.
    pub origin: DVec3,
    /// The representations of the trees, from near to far.
    pub levels: Levels,
    /// Metres beyond which trees are not drawn.
    pub view_distance: f32,
}

/// The ground under everything. Only one is drawn at a time: the first visible one.
///
/// As for a [`Forest`], its global translation, inherited visibility and render layers take effect.
///
/// Reflection does not show the shared maps, which a program replaces as a whole.
#[derive(Component, Clone, Debug, Reflect)]
#[reflect(Component, Debug, from_reflect = false)]
#[require(Transform, Visibility)]
pub struct Ground {
    /// Heights; scene metres, origin at the terrain's centre.
    #[reflect(ignore, clone)]
    pub terrain: Arc<Terrain>,
    /// A photograph over it, if there is one.
    #[reflect(ignore, clone)]
    pub drape: Option<GroundDrape>,
    /// Canopy cover, if a forest stands on it.
    #[reflect(ignore, clone)]
    pub cover: Option<Arc<CoverMap>>,
    /// Metres beyond the terrain's data on which trees stand too, thinning out in the outer half; 0: none. Farther out the
    /// ground has the colour of crowns, as many as the data has.
    pub surroundings: f64,
    /// Where the trees on it are drawn together, as a surface over the ground. The forests' own
    /// [levels](crate::lod::Levels::to_size) end there. `None`: nowhere.
    pub forest_surface: Option<ForestSurface>,
    /// Maximum distance in pixels between the drawn and the true surface, 0.25 to 32. Lower: more triangles.
    pub error_pixels: f64,
    /// Distance in metres to which the ground is drawn, its mirrored surroundings included.
    pub view_distance: f64,
}

/// The surface of a forest, as a [`Ground`] shows it where trees are too small to be drawn one by one.
#[derive(Clone, Copy, Debug, PartialEq, Reflect)]
pub struct ForestSurface {
    /// Distances over which it takes the place of the trees, for trees of
    /// [`NOMINAL_HEIGHT`] in an image with 1080 rows.
    pub fade: FadeBand,
    /// Mean height of the trees, metres.
    pub tree_height: f32,
}

impl ForestSurface {
    /// Its distances for the forest's trees and a focal length in pixels.
    pub(crate) fn in_view(&self, focal_pixels: f32) -> FadeBand {
        let size = self.tree_height / NOMINAL_HEIGHT;
        let factor = size * focal_pixels / nominal_focal_length();
        let fade = self.fade.scaled(factor);
        FadeBand::new(fade.start, fade.end - fade.start)
    }
}

/// A photograph over a [`Ground`]: part of it, or beside a [`Terrain3d`](crate::components::Terrain3d) on the same entity.
///
/// Reflection does not show its texels.
#[derive(Component, Clone, Debug, Reflect)]
#[reflect(Component, Debug, from_reflect = false)]
pub struct GroundDrape {
    /// The photograph, as [`read_drape`](crate::terrain::read_drape) brings it to the terrain's frame.
    #[reflect(ignore, clone)]
    pub drape: Arc<Drape>,
    /// Factor from its values (linear, 1 is white) to the reflectance of the ground, 0.05 to 4.
    pub brightness: f32,
}

impl PartialEq for GroundDrape {
    /// Two are equal if they share the same photograph.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.drape, &other.drape) && self.brightness == other.brightness
    }
}

/// The current light. Replace it whenever the sun moves; while it stays the same [`Arc`], nothing is computed again. Two
/// are equal if they are the same `Arc`.
#[derive(Resource, Clone, Debug)]
pub struct Daylight(pub Arc<LightState>);

impl PartialEq for Daylight {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// When the renderer computes what follows from a new [`Daylight`]: the terrain's shadow and the light inside stands. A
/// [`Sun`](crate::components::Sun) sets it by its [`SunRefresh`](crate::components::SunRefresh); a program that computes
/// its own light sets it itself.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Resource, Default)]
pub enum LightUpdates {
    /// In the frame that draws the new light, which waits for it: about 30 ms. For images and tests.
    Blocking,
    /// Beside the frames, which draw the last result meanwhile. It lags behind the light by at most half a degree of the
    /// sun's or the moon's way, which is the width of their discs: two minutes of a clock, 25 steps of the default
    /// [`SunRefresh`](crate::components::SunRefresh). A frame whose light is farther away, because an hour was skipped
    /// or the moon took over from the sun, waits. So does one with another terrain.
    #[default]
    Background,
}

impl LightUpdates {
    /// Whether what was computed for `old` may still be drawn under `new` (directions to the light, unit vectors): they
    /// differ by at most half a degree.
    pub fn is_near(old: Vec3, new: Vec3) -> bool {
        // The chord is as long as the angle to a millionth, and exact where the cosine is not.
        old.distance_squared(new) <= 0.5f32.to_radians().powi(2)
    }
}

/// When a [`Forest`] that is new, or has other trees or shapes than before, is brought onto the device.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Resource, Default)]
pub enum ForestUpdates {
    /// In the frame that first draws it, which waits. For images and tests.
    Blocking,
    /// Over several frames, none of which does much more than its neighbours. Each writes some 8 MB of plants and trees.
    /// Then the pipelines are made, one a frame where Bevy makes them in the frame. The forest is drawn once all of it is
    /// there; until then one that it replaces stays. Its shadow comes last: one cascade after the other
    /// from the finest, each drawn over four frames.
    #[default]
    Spread,
}

/// Which devices get the textures of crossed billboards and billboard clouds block-compressed. A scene that is shown
/// sets it. A change counts for forests that are new or have other trees or shapes than before.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Resource, Default)]
pub struct TextureCompression(pub Compression);

/// Settings of the shadow maps of sun and moon, on the entity of the [`Sun`](crate::components::Sun), which requires
/// it.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Default)]
pub struct SunShadowSettings {
    /// Texels along a side of each map, 256 to 8192. Twice the size halves the texel and quadruples the fill cost.
    #[reflect(@Range::doubled(256..=8192), @"Texels along a side of each map. Twice the size: sharper, four times the fill cost.")]
    pub map_size: u32,
    /// Number of cascades, 1 to 4; 0 switches the maps off (the terrain's own shadow stays).
    #[reflect(@Range::steps(0..=4, 1.0, 1.0), @"Number of maps; 0 leaves only the terrain's own shadow.")]
    pub cascades: usize,
    /// Radius in metres around the camera that the finest cascade covers.
    #[reflect(@Range::factor(1.0..=1e5).unit("m"), @"Radius around the camera that the finest map covers.")]
    pub finest_radius: f64,
    /// Radius in metres around the camera that the widest cascade covers. Beyond it the canopy cover darkens the
    /// ground.
    #[reflect(@Range::factor(1.0..=1e5).unit("m"), @"Radius around the camera that the widest map covers; beyond it the canopy cover darkens the ground.")]
    pub distance: f64,
    /// Radius in metres around the camera within which plants cast as shadow proxies instead of billboards.
    #[reflect(@Range::factor(0.0..=1e5).unit("m"), @"Radius around the camera within which plants cast as shadow proxies instead of billboards.")]
    pub proxy_distance: f64,
    /// Half width in metres of the soft edge of shadows on the ground, 0.05 to 20 [Luft 2006, fig. 6 b]: the mean of comparisons over
    /// a disc [Reeves et al. 1987], whose size does not depend on the map's texels. 0: an edge of three texels, at less cost.
    #[reflect(@Range::steps(0.0..=20.0, 0.05, 0.5).unit("m"), @"Half width of the soft edge of shadows on the ground; 0: an edge of three texels.")]
    pub softness: f64,
}

impl SunShadowSettings {
    /// The softness as the shader has it: within its range, or 0.
    pub(crate) fn soft_edge(&self) -> f32 {
        if self.softness > 0.0 { self.softness.clamp(0.05, 20.0) as f32 } else { 0.0 }
    }
}

impl Default for SunShadowSettings {
    /// The settings of a scene with the default quality.
    fn default() -> Self {
        Self { map_size: 2048, cascades: 4, finest_radius: 30.0, distance: 800.0, proxy_distance: 80.0, softness: 0.0 }
    }
}

/// Who makes the lists of trees that a frame draws. The image is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
pub enum TreeListMaker {
    /// The graphics device where it can, except for software drivers: on these the lists compete with the image for the
    /// same processor.
    #[default]
    Automatic,
    /// The processor. It looks at clusters of up to 64 trees, and uploads four bytes for each drawn tree and map.
    Processor,
    /// The graphics device, software drivers included; where it cannot, the processor. The processor's work does not
    /// grow with the number of trees.
    Device,
}

/// How the lists of drawn trees are made.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Eq, Reflect)]
#[reflect(Resource, Default)]
pub struct TreeLists {
    /// Who makes them.
    pub maker: TreeListMaker,
    /// The most trees in one buffer. A forest of more trees is split into several, each with its own lists and draw calls;
    /// so is one that is larger than the device's largest storage buffer.
    pub trees_per_buffer: usize,
}

impl Default for TreeLists {
    fn default() -> Self {
        Self { maker: TreeListMaker::default(), trees_per_buffer: usize::MAX }
    }
}

/// How a camera's trees are drawn.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq, ExtractComponent, Reflect)]
#[reflect(Component, Default)]
pub struct ViewOptions {
    /// Whether trees are tinted by their level of detail, each level in its own colour.
    #[reflect(@"Each level of detail in its own colour.")]
    pub tint_levels: bool,
    /// Whether the depth of crosses is drawn before their light, so that each pixel is shaded once: the same image, in less
    /// time where crosses hide each other. Nothing changes with several samples a pixel, where it would take longer.
    #[reflect(@"Depth of crosses before their light, without MSAA: the same image, in less time.")]
    pub depth_first: bool,
}

impl Default for ViewOptions {
    fn default() -> Self {
        Self { tint_levels: false, depth_first: true }
    }
}

/// How open the place of a camera is: the fraction of the light on open ground that reaches it between the trees, 0..1. Canopy sets it
/// together with the exposure.
#[derive(Component, Clone, Copy, Debug, PartialEq, ExtractComponent, Reflect)]
#[reflect(Component, Default)]
pub struct CameraOpenness(pub f32);

impl Default for CameraOpenness {
    fn default() -> Self {
        Self(1.0)
    }
}

/// The filter of cameras that Canopy's photographic passes draw: those without a style.
pub type Photographed = (With<CanopyCamera>, Without<DrawnStyle>);

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
            ExtractComponentPlugin::<CameraOpenness>::default(),
            ExtractComponentPlugin::<CanopyStyle>::default(),
        ))
        .register_type::<(CanopyCamera, CanopyOrigin, SunShadowSettings, ViewOptions, CastsCanopyShadow)>()
        .register_type::<CameraOpenness>()
        .register_type::<(Forest, Ground, GroundDrape, TreeLists, CanopyStyle)>()
        .register_type::<(LightUpdates, ForestUpdates, TextureCompression)>()
        .init_resource::<CanopyOrigin>()
        .init_resource::<LightUpdates>()
        .init_resource::<ForestUpdates>()
        .init_resource::<TextureCompression>()
        .init_resource::<TreeLists>()
        .add_systems(PostUpdate, follow_palettes);
    }
}

#[cfg(test)]
mod tests {
    use bevy::ecs::world::World;

    use super::*;

    #[test]
    fn light_is_near_within_half_a_degree() {
        let at = |degrees: f32| Vec3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0);
        assert!(LightUpdates::is_near(at(30.0), at(30.0)) && LightUpdates::is_near(at(30.0), at(30.49)));
        assert!(!LightUpdates::is_near(at(30.0), at(30.51)) && !LightUpdates::is_near(at(30.0), -at(30.0)));
        assert!(!LightUpdates::is_near(Vec3::NAN, at(30.0)));
    }

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
