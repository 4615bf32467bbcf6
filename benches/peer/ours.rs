//! The field as Canopy draws it.

use std::sync::Arc;

use anyhow::Context;
use bevy::{app::Plugin, render::diagnostic::RenderDiagnosticsPlugin};
use canopy::{
    app::Renderer,
    bake::{BakedLevel, BakedPlant},
    components::Sun,
    lod::{FadeBand, Levels, level_distance::NOMINAL_HEIGHT},
    render::components::{Forest, Ground, SunShadowSettings, TreeLists, ViewOptions},
    scene::Viewpoint,
};
use glam::DVec3;
use image::RgbImage;

use super::field::{Field, GROUND_REACH};

/// Farther than any tree, metres.
const EVERYWHERE: f32 = 1e6;

/// Canopy's renderer with the field in it.
pub struct Ours(Renderer);

impl Ours {
    /// Canopy's side of `field`.
    pub fn new(field: &Field) -> anyhow::Result<Self> {
        let look = &field.look;
        let mut renderer = Renderer::new(look.size, None, look.samples)?;
        let world = renderer.app().world_mut();
        let mut cameras = world.query::<&mut ViewOptions>();
        cameras.iter_mut(world).for_each(|mut options| options.depth_first = look.depth_first);
        if look.ground {
            world.spawn(Ground {
                drape: None,
                terrain: field.terrain.clone(),
                cover: Some(field.cover.clone()),
                surroundings: 0.0,
                forest_surface: None,
                error_pixels: 1.0,
                view_distance: GROUND_REACH,
            });
        }
        // Canopy's distances are those of trees 20 m high.
        let by_size = NOMINAL_HEIGHT / field.plant.plant.height();
        let mut shadow = SunShadowSettings {
            map_size: look.shadow_size,
            cascades: look.cascades,
            distance: look.shadow_distance,
            proxy_distance: f64::from(by_size * look.near),
            ..SunShadowSettings::default()
        };
        let (plant, fade) = if look.is_full() {
            // The truth casts with its full models too.
            shadow.proxy_distance = f64::from(EVERYWHERE);
            (full_casters(&field.plant), FadeBand::new(EVERYWHERE, 1.0))
        } else {
            ((*field.plant).clone(), {
                let band = field.band_in_space();
                FadeBand::new(by_size * band.start, by_size * (band.end - band.start))
            })
        };
        if look.trees {
            world.spawn(Forest {
                stand: field.stand.clone(),
                plants: Arc::new(vec![plant]),
                suns: Arc::default(),
                origin: DVec3::ZERO,
                levels: Levels::model_and_cross(fade),
                view_distance: EVERYWHERE,
            });
        }
        renderer.set_shadow(shadow);
        Ok(Self(renderer))
    }

    /// Places the camera.
    pub fn place(&mut self, view: &Viewpoint) {
        self.0.set_view(view);
    }

    /// Sets who makes the lists of trees.
    pub fn make_lists(&mut self, lists: TreeLists) {
        self.0.app().insert_resource(lists);
    }

    /// Lets Bevy write timestamps and count shader calls of all passes.
    pub fn measure(&mut self) {
        // An app that has been built takes no plugins any more; this one only adds systems.
        let app = self.0.app();
        RenderDiagnosticsPlugin.build(app);
        RenderDiagnosticsPlugin.finish(app);
    }

    /// Sets the time; the light follows within the frame.
    pub fn light(&mut self, sun: &Sun) {
        self.0.set_sun(sun.clone());
    }

    /// Draws a frame and waits for the device.
    pub fn frame(&mut self) -> anyhow::Result<()> {
        Ok(self.0.update()?)
    }

    /// The last frame.
    pub fn read(&self) -> anyhow::Result<RgbImage> {
        let picture = self.0.read()?;
        RgbImage::from_raw(picture.width, picture.height, picture.pixels).context("an image of another size")
    }
}

fn full_casters(plant: &BakedPlant) -> BakedPlant {
    let shadow_proxy = plant.plant.parts.iter().map(|part| part.mesh.clone()).collect();
    plant.clone().with_level(BakedLevel::ShadowProxy(Arc::new(shadow_proxy)))
}
