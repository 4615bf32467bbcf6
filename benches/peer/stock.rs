//! The field as a Bevy user would build it today: [`canopy::app::stock`].

use anyhow::Context;
use bevy::render::settings::WgpuSettings;
use canopy::{
    app::stock::{StockGround, StockRenderer, StockScene},
    light::LightState,
    scene::Viewpoint,
};
use image::RgbImage;

use super::field::{Field, GROUND_REACH};

/// A Bevy app with the field in it.
pub struct Stock(StockRenderer);

impl Stock {
    /// Stock Bevy's side of `field`.
    pub fn new(field: &Field) -> anyhow::Result<Self> {
        let look = &field.look;
        let fade = (!look.is_full()).then(|| field.band_in_space());
        let scene = StockScene {
            trees: if look.trees { &field.stand.trees } else { &[] },
            grid: &field.stand.grid,
            plants: std::slice::from_ref(field.plant.as_ref()),
            fades: &[fade],
            ground: if look.ground { StockGround::Flat } else { StockGround::None },
            reach: GROUND_REACH,
            far: 2.0 * GROUND_REACH,
            size: look.size,
            samples: 1,
            cascades: look.cascades,
            shadow_map_size: look.shadow_size,
            shadow_distance: look.shadow_distance,
        };
        let mut stock = Self(StockRenderer::new(&scene, WgpuSettings::default(), |_| ()));
        stock.light(&field.light(&field.sky(0, false))?);
        stock.place(&field.view(0));
        // Meshes, textures and shaders reach the device, as ours does in its first update.
        stock.frame()?;
        Ok(stock)
    }

    /// Places the camera.
    pub fn place(&mut self, view: &Viewpoint) {
        self.0.set_view(view);
    }

    /// Turns the sun and sets its and the sky's strength.
    pub fn light(&mut self, light: &LightState) {
        self.0.set_light(light, light.ev100);
    }

    /// Draws a frame and waits for the device.
    pub fn frame(&mut self) -> anyhow::Result<()> {
        self.0.update()?;
        Ok(())
    }

    /// Waits until the device has finished everything.
    pub fn wait(&self) -> anyhow::Result<()> {
        Ok(self.0.wait()?)
    }

    /// The last frame.
    pub fn read(&self) -> anyhow::Result<RgbImage> {
        let picture = self.0.read()?;
        RgbImage::from_raw(picture.width, picture.height, picture.pixels).context("an image of another size")
    }
}
