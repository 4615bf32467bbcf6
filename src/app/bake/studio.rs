//! One tree alone before a plain background: images of its levels of detail, from any side and in any size.
//!
//! The camera stands so far away that the tree has hardly any perspective, and only its field of view changes with the
//! size of the image. So a level at any size and the full model at many pixels for each of its own show exactly the same
//! view, in the same light and with the same shadow maps.

use std::sync::Arc;

use bevy::{
    asset::Assets,
    camera::visibility::NoFrustumCulling,
    color::Color,
    core_pipeline::tonemapping::Tonemapping,
    ecs::{entity::Entity, query::With},
    light::NotShadowCaster,
    mesh::{Mesh, Mesh3d},
    pbr::{MeshMaterial3d, StandardMaterial},
    prelude::{Rectangle, Transform},
};
use glam::{DVec3, Vec3};

use crate::{
    app::{AppError, RenderedImage, Renderer},
    bake::BakedPlant,
    components::Sun,
    lod::{Levels, Representation},
    measure::Cutout,
    render::components::{CanopyCamera, Forest, SunShadowSettings},
    scatter::{PackedStand, Stand, Tree, packed::DEFAULT_CELL_SIZE},
    scene::{Pose, Viewpoint},
};

/// A direction from which a tree is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// From the south, looking north.
    South,
    /// From the west.
    West,
    /// From the north.
    North,
    /// From the east.
    East,
    /// From straight above, the north at the top.
    Above,
}

impl Side {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::South, Self::West, Self::North, Self::East, Self::Above];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::South => "south",
            Self::West => "west",
            Self::North => "north",
            Self::East => "east",
            Self::Above => "above",
        }
    }

    /// Direction to the camera, compass bearing and pitch of its view in degrees.
    fn view(self) -> (DVec3, f64, f64) {
        match self {
            Self::South => (DVec3::Z, 0.0, 0.0),
            Self::West => (DVec3::NEG_X, 90.0, 0.0),
            Self::North => (DVec3::NEG_Z, 180.0, 0.0),
            Self::East => (DVec3::X, 270.0, 0.0),
            Self::Above => (DVec3::Y, 0.0, -90.0),
        }
    }
}

/// Distance of the camera in heights of the tree.
const DISTANCE: f64 = 8.0;
/// Width of the image in sizes of the tree, at a zoom of 1.
const MARGIN: f64 = 1.08;

/// A renderer with one tree.
pub struct Studio {
    renderer: Renderer,
    plant: BakedPlant,
    /// Of the tree, radians.
    yaw: f32,
    forest: Option<Entity>,
    backdrop: Entity,
    colors: [bevy::asset::Handle<StandardMaterial>; 2],
    /// Pixels along a side of the square images.
    size: u32,
    /// Middle of the tree, metres.
    center: DVec3,
    /// The larger of its height and width, metres.
    extent: f64,
    /// Whether an image was drawn.
    warm: bool,
}

impl Studio {
    /// A studio for `plant`, with square images of `size` pixels, on the adapter whose name contains `adapter`, with
    /// `msaa` samples a pixel.
    ///
    /// # Errors
    /// Those of [`Renderer::new`].
    pub fn new(plant: BakedPlant, size: u32, adapter: Option<&str>, msaa: u32) -> Result<Self, AppError> {
        let mut renderer = Renderer::new((size, size), adapter, msaa)?;
        let (center, extent) = plant.plant.bounds().map_or((DVec3::ZERO, 1.0), |bounds| {
            (bounds.center().as_dvec3(), f64::from(bounds.size().max_element()).max(0.01))
        });
        let world = renderer.app().world_mut();
        // The images are compared as they are, without a tone curve.
        let cameras: Vec<Entity> = world.query_filtered::<Entity, With<CanopyCamera>>().iter(world).collect();
        for camera in cameras {
            world.entity_mut(camera).insert(Tonemapping::None);
        }
        let mesh = world.resource_mut::<Assets<Mesh>>().add(Rectangle::new(1.0, 1.0));
        let colors = [Color::BLACK, Color::WHITE].map(|color| {
            let material = StandardMaterial { base_color: color, unlit: true, ..StandardMaterial::default() };
            world.resource_mut::<Assets<StandardMaterial>>().add(material)
        });
        let backdrop = world
            .spawn((
                Mesh3d(mesh),
                MeshMaterial3d(colors[0].clone()),
                NotShadowCaster,
                NoFrustumCulling,
                Transform::default(),
            ))
            .id();
        renderer.set_shadow(SunShadowSettings::default());
        Ok(Self { renderer, plant, yaw: 0.0, forest: None, backdrop, colors, size, center, extent, warm: false })
    }

    /// Turns the tree that is shown next by `yaw` radians.
    pub fn turn(&mut self, yaw: f32) {
        self.yaw = yaw;
    }

    /// Shows the tree as one representation at all distances; with `None` it is gone.
    ///
    /// # Errors
    /// [`AppError::Stand`] for a plant that cannot stand.
    pub fn show(&mut self, representation: Option<Representation>) -> Result<(), AppError> {
        self.show_levels(representation.map(Levels::only))
    }

    /// Shows the tree as one of `levels`, by its size in the image; with `None` it is gone.
    ///
    /// # Errors
    /// [`AppError::Stand`] for a plant that cannot stand.
    pub fn show_levels(&mut self, levels: Option<Levels>) -> Result<(), AppError> {
        let world = self.renderer.app().world_mut();
        if let Some(forest) = self.forest.take() {
            world.despawn(forest);
        }
        if let Some(levels) = levels {
            let tree = Tree { position: DVec3::ZERO, yaw: self.yaw, scale: 1.0, variant: 0, tint: 0.0, index: 0 };
            let stand = PackedStand::new(&Stand { trees: vec![tree] }, DEFAULT_CELL_SIZE, &[self.plant.size()])?;
            let forest = Forest {
                stand: Arc::new(stand),
                plants: Arc::new(vec![self.plant.clone()]),
                suns: Arc::from([]),
                origin: DVec3::ZERO,
                levels,
                view_distance: 1e5,
            };
            self.forest = Some(world.spawn(forest).id());
        }
        Ok(())
    }

    /// The tree from `side` under `sun`. It is as large as the image at a `zoom` of 1, and half as large at 2.
    ///
    /// # Errors
    /// [`AppError::Render`].
    pub fn cutout(&mut self, side: Side, sun: &Sun, zoom: f64) -> Result<Cutout, AppError> {
        let view = self.viewpoint(side, zoom);
        self.renderer.set_view(&view);
        self.renderer.set_sun(sun.clone());
        let mut images = Vec::with_capacity(2);
        for color in self.colors.clone() {
            self.set_backdrop(&view, color);
            if !self.warm {
                // The backdrop's mesh and materials reach the device.
                self.renderer.update()?;
            }
            self.renderer.update()?;
            images.push(self.renderer.read()?);
        }
        self.warm = true;
        let [black, white]: [RenderedImage; 2] =
            images.try_into().map_err(|_| AppError::Render("an image is missing".to_owned()))?;
        Ok(Cutout::new(self.size as usize, &black.pixels, &white.pixels))
    }

    /// The renderer, to time its frames.
    pub fn renderer(&mut self) -> &mut Renderer {
        &mut self.renderer
    }

    fn viewpoint(&self, side: Side, zoom: f64) -> Viewpoint {
        let (toward, yaw, pitch) = side.view();
        let position = self.center + DISTANCE * self.extent * toward;
        let field_of_view = 2.0 * (0.5 * MARGIN * zoom / DISTANCE).atan().to_degrees();
        Pose { position: position.into(), yaw, pitch }.viewpoint(0.0, field_of_view)
    }

    /// Puts the backdrop behind the tree.
    fn set_backdrop(&mut self, view: &Viewpoint, color: bevy::asset::Handle<StandardMaterial>) {
        let behind = 2.0 * DISTANCE * self.extent;
        let position = view.position + behind * view.forward();
        let width = 2.2 * behind * (0.5 * view.field_of_view).tan();
        let world = self.renderer.app().world_mut();
        let origin = *world.resource::<crate::render::components::CanopyOrigin>();
        let transform = Transform {
            translation: origin.translation(position),
            rotation: view.rotation().as_quat(),
            scale: Vec3::splat(width as f32),
        };
        world.entity_mut(self.backdrop).insert((transform, MeshMaterial3d(color)));
    }
}
