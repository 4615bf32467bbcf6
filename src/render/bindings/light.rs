//! The light of the moment, as the shaders read it.

use glam::{Mat3, Vec3};

use super::uniforms::LightUniform;
use crate::light::{LightState, sh::cosine_coefficient, sun::SUN_ANGULAR_RADIUS};

/// The largest value that is handed to a half-float target.
const BRIGHTEST: f32 = 6.0e4;

/// Packs `light`, premultiplied by `exposure` (radiance to display values).
pub fn light_uniform(light: &LightState, exposure: f32) -> LightUniform {
    let with = |v: Vec3, w: f32| v.min(Vec3::splat(f32::MAX)).extend(w).to_array();
    let sun_radius = SUN_ANGULAR_RADIUS as f32;
    let sun_radiance = light.sun_illuminance / (std::f32::consts::PI * sun_radius.sin().powi(2)) * exposure;
    let mut sky = [[0.0; 4]; 9];
    for (index, (slot, coefficient)) in sky.iter_mut().zip(&light.sky_sh).enumerate() {
        let band = index.isqrt();
        // Irradiance over pi: what a white Lambertian surface sends back.
        *slot = with(*coefficient * (cosine_coefficient(band) / std::f32::consts::PI * exposure), 0.0);
    }
    let moon = light.night.moon;
    let moon_direction = moon.map_or(Vec3::NEG_Y, |moon| moon.direction);
    let moon_cosine = moon.map_or(2.0, |moon| moon.angular_radius.cos());
    let moon_radiance = moon.map_or(Vec3::ZERO, |moon| moon.radiance * exposure);
    let axis = light.sky_view.axis;
    let rotation = light.night.star_rotation;
    LightUniform {
        key_direction: with(light.key_direction, light.key_direction.y),
        key_illuminance: with(light.key_illuminance * exposure, 0.0),
        sun_direction: with(light.sun_direction, sun_radius.cos()),
        sun_radiance: with(sun_radiance.min(Vec3::splat(BRIGHTEST)), 0.0),
        moon_direction: with(moon_direction, moon_cosine),
        moon_radiance: with(moon_radiance.min(Vec3::splat(BRIGHTEST)), 0.0),
        sky,
        fog: with(light.fog.extinction, 1.0 / light.fog.scale_height_m.max(1.0)),
        sky_frame: [axis.x, axis.y, exposure, light.scotopic.strength],
        night: with(light.scotopic.tint, light.scotopic.amount),
        star_frame: star_frame(rotation),
        stars: [light.night.stars.cells as f32, light.night.stars.seed as f32, light.night.stars.density(), 0.0],
    }
}

fn star_frame(rotation: Mat3) -> [[f32; 4]; 3] {
    [rotation.x_axis, rotation.y_axis, rotation.z_axis].map(|axis| axis.extend(0.0).to_array())
}
