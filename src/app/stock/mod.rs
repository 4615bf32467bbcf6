//! The same forest as a Bevy user would build it without Canopy: the peer in `canopy profile --against stock` and in the
//! benchmark `peer`.
//!
//! One entity a tree, level and material, with shared meshes and materials so that Bevy batches them; `StandardMaterial` with
//! `AlphaMode::Mask`; `VisibilityRange` with a cross-fade; a `DirectionalLight` with cascades; GPU preprocessing as it comes. A
//! cross is one mesh of its planes over one atlas of their images, since three meshes would be three entities a tree.
//!
//! It is kind to stock Bevy: wood has no normal map (it would need tangents), the sky is a clear colour, there is no fog, the
//! image is not HDR, and the ground is one plain material. Canopy draws all of these.

mod ground;
mod trees;

use std::{ops::Range, time::Instant};

use bevy::{
    app::App,
    camera::{Camera, Camera3d, ClearColorConfig, Exposure, PerspectiveProjection, Projection},
    color::{Color, LinearRgba},
    core_pipeline::tonemapping::Tonemapping,
    ecs::{entity::Entity, world::World},
    light::{CascadeShadowConfigBuilder, DirectionalLight, DirectionalLightShadowMap, GlobalAmbientLight},
    math::Vec3,
    prelude::Transform,
    render::{render_resource::PollType, renderer::RenderDevice, settings::WgpuSettings, view::Msaa},
};

use super::{
    AppError, RenderedImage, UpdateTime,
    windowless::{Target, app_without_window},
};
use crate::{
    bake::BakedPlant,
    light::LightState,
    math::luminance,
    scatter::{CellGrid, PackedTree},
    scene::Viewpoint,
    terrain::Terrain,
};

/// Metres that the finest cascade serves, as in Canopy's default.
const FINEST_CASCADE: f32 = 30.0;
/// Colour of the sky.
const SKY: Color = Color::srgb(0.62, 0.75, 0.9);

/// The ground.
#[derive(Clone, Copy)]
pub enum StockGround<'a> {
    /// None.
    None,
    /// A plane at height 0.
    Flat,
    /// A static mesh of a terrain.
    Terrain(&'a Terrain),
}

/// What stock Bevy draws.
pub struct StockScene<'a> {
    /// The trees.
    pub trees: &'a [PackedTree],
    /// Where their cells are.
    pub grid: &'a CellGrid,
    /// The plants, by variant.
    pub plants: &'a [BakedPlant],
    /// Distances in metres, from the camera to a tree's foot, over which the full model of each plant gives way to its crosses.
    /// `None`: it is drawn at any distance.
    pub fades: &'a [Option<Range<f32>>],
    /// The ground.
    pub ground: StockGround<'a>,
    /// Metres from the origin to the border of the ground.
    pub reach: f64,
    /// Metres that the camera sees.
    pub far: f64,
    /// Width and height of the image in pixels.
    pub size: (u32, u32),
    /// Samples per pixel, 1 or 4.
    pub samples: u32,
    /// Number of shadow cascades; 0 for no shadow.
    pub cascades: usize,
    /// Texels along a side of a shadow map.
    pub shadow_map_size: u32,
    /// Metres that the shadow reaches.
    pub shadow_distance: f64,
}

/// A Bevy app with such a scene, drawn frame by frame without a window.
pub struct StockRenderer {
    app: App,
    camera: Entity,
    sun: Entity,
    target: Target,
    far: f32,
}

impl StockRenderer {
    /// Spawns `scene` in an app to which `prepare` adds plugins.
    pub fn new(scene: &StockScene, settings: WgpuSettings, prepare: impl FnOnce(&mut App)) -> Self {
        let mut app = app_without_window(settings, prepare);
        app.insert_resource(DirectionalLightShadowMap { size: scene.shadow_map_size as usize });
        trees::spawn(&mut app, scene);
        ground::spawn(&mut app, scene);
        let cascades = CascadeShadowConfigBuilder {
            num_cascades: scene.cascades.max(1),
            minimum_distance: 0.1,
            maximum_distance: scene.shadow_distance as f32,
            first_cascade_far_bound: FINEST_CASCADE,
            ..CascadeShadowConfigBuilder::default()
        };
        let light = DirectionalLight { shadow_maps_enabled: scene.cascades > 0, ..DirectionalLight::default() };
        let sun = app.world_mut().spawn((light, cascades.build())).id();
        let target = Target::new(&mut app, scene.size);
        let camera = app
            .world_mut()
            .spawn((
                Camera3d::default(),
                Camera { clear_color: ClearColorConfig::Custom(SKY), ..Camera::default() },
                target.camera_target(),
                Msaa::from_samples(scene.samples),
                Tonemapping::TonyMcMapface,
            ))
            .id();
        Self { app, camera, sun, target, far: scene.far as f32 }
    }

    /// The app's world.
    pub fn world(&self) -> &World {
        self.app.world()
    }

    /// Places the camera.
    pub fn set_view(&mut self, view: &Viewpoint) {
        let transform = Transform {
            translation: view.position.as_vec3(),
            rotation: view.rotation().as_quat(),
            ..Transform::default()
        };
        let projection = Projection::Perspective(PerspectiveProjection {
            fov: view.field_of_view as f32,
            near: super::camera::NEAR,
            far: self.far,
            ..PerspectiveProjection::default()
        });
        self.app.world_mut().entity_mut(self.camera).insert((transform, projection));
    }

    /// Turns the sun, sets its and the sky's strength, and exposes for `ev100`.
    pub fn set_light(&mut self, light: &LightState, ev100: f32) {
        let world = self.app.world_mut();
        let illuminance = light.key_illuminance.max_element().max(0.0);
        let color = light.key_illuminance / illuminance.max(1e-12);
        if let Some(mut sun) = world.get_mut::<DirectionalLight>(self.sun) {
            sun.illuminance = illuminance;
            sun.color = linear(color);
        }
        if let Some(mut transform) = world.get_mut::<Transform>(self.sun) {
            *transform = Transform::default().looking_to(-light.key_direction, Vec3::Y);
        }
        let sky = light.sky_illuminance.max(Vec3::ZERO);
        world.insert_resource(GlobalAmbientLight {
            color: linear(sky / sky.max_element().max(1e-12)),
            brightness: luminance(sky) / std::f32::consts::PI * 0.5,
            ..GlobalAmbientLight::default()
        });
        world.entity_mut(self.camera).insert(Exposure { ev100 });
    }

    /// Draws a frame and waits until the device has finished it.
    ///
    /// # Errors
    /// [`AppError::Render`].
    pub fn update(&mut self) -> Result<UpdateTime, AppError> {
        let began = Instant::now();
        self.app.update();
        let submitted = Instant::now();
        self.wait()?;
        match self.app.should_exit() {
            Some(exit) if exit.is_error() => {
                Err(AppError::Render("the graphics device reported an error to stock Bevy".to_owned()))
            }
            _ => Ok(UpdateTime { began, submitted, finished: Instant::now(), updates: 1 }),
        }
    }

    /// Waits until the device has finished everything.
    ///
    /// # Errors
    /// [`AppError::Render`].
    pub fn wait(&self) -> Result<(), AppError> {
        let device = self.app.world().resource::<RenderDevice>();
        let waited = device.wgpu_device().poll(PollType::Wait { submission_index: None, timeout: None });
        waited.map(drop).map_err(|error| AppError::Render(format!("stock Bevy: {error}")))
    }

    /// Reads the last frame back.
    ///
    /// # Errors
    /// [`AppError::Render`].
    pub fn read(&self) -> Result<RenderedImage, AppError> {
        self.target.read(&self.app).map_err(|why| AppError::Render(format!("stock Bevy: {why}")))
    }
}

fn linear(color: Vec3) -> Color {
    LinearRgba::rgb(color.x, color.y, color.z).into()
}
