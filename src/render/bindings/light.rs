//! The current light, as the shaders read it.

use glam::{Mat3, Vec3};

use super::uniforms::LightUniform;
use crate::{
    light::{LightState, sh::cosine_coefficient, sun::SUN_ANGULAR_RADIUS},
    math::color::luminance,
};

/// The largest value that is written to a half-float target.
const BRIGHTEST: f32 = 6.0e4;

/// Packs `light`, premultiplied by `exposure` (radiance to display values).
pub fn light_uniform(light: &LightState, exposure: f32) -> LightUniform {
    let finite = |v: Vec3| v.min(Vec3::splat(f32::MAX)).to_array();
    let sun_radius = SUN_ANGULAR_RADIUS as f32;
    let sun_radiance = light.sun_illuminance / (std::f32::consts::PI * sun_radius.sin().powi(2)) * exposure;
    let mut sky = [[0.0; 4]; 9];
    for (index, (slot, coefficient)) in sky.iter_mut().zip(&light.sky_sh).enumerate() {
        let band = index.isqrt();
        // Irradiance over pi: what a white Lambertian surface reflects.
        let irradiance = *coefficient * (cosine_coefficient(band) / std::f32::consts::PI * exposure);
        *slot = irradiance.min(Vec3::splat(f32::MAX)).extend(0.0).to_array();
    }
    let moon = light.night.moon;
    let moon_direction = moon.map_or(Vec3::NEG_Y, |moon| moon.direction);
    let moon_cosine = moon.map_or(2.0, |moon| moon.angular_radius.cos());
    let moon_radiance = moon.map_or(Vec3::ZERO, |moon| moon.radiance * exposure);
    let axis = light.sky_view.axis;
    let rotation = light.night.star_rotation;
    LightUniform {
        key_direction: finite(light.key_direction),
        exposure,
        key_illuminance: finite(light.key_illuminance * exposure),
        scotopic_strength: light.scotopic.strength,
        sun_direction: finite(light.sun_direction),
        sun_disc_cosine: sun_radius.cos(),
        sun_radiance: finite(sun_radiance.min(Vec3::splat(BRIGHTEST))),
        star_cells: light.night.stars.cells as f32,
        moon_direction: finite(moon_direction),
        moon_disc_cosine: moon_cosine,
        moon_radiance: finite(moon_radiance.min(Vec3::splat(BRIGHTEST))),
        star_density: light.night.stars.density(),
        sky,
        fog_extinction: finite(light.fog.extinction),
        fog_inverse_scale_height: 1.0 / light.fog.scale_height_m.max(1.0),
        scotopic_tint: finite(light.scotopic.tint),
        scotopic_amount: light.scotopic.amount,
        star_frame: star_frame(rotation),
        ground_radiance: finite(light.ground_radiance * exposure),
        star_seed: light.night.stars.seed,
        shaded_hue: finite(shaded_hue(light)),
        level_radiance: luminance(light.sky_illuminance) / std::f32::consts::PI * exposure,
        sky_axis: [axis.x, axis.y],
        end_padding: [0; 2],
    }
}

/// The fraction of the light on open ground that is left in shade, per channel, relative to that of its luminance; white without light.
fn shaded_hue(light: &LightState) -> Vec3 {
    let lit = light.sky_illuminance + light.key_illuminance * light.key_direction.y.max(0.0);
    let fraction = luminance(light.sky_illuminance) / luminance(lit);
    let hue = light.sky_illuminance / (lit * fraction);
    if hue.is_finite() { hue } else { Vec3::ONE }
}

fn star_frame(rotation: Mat3) -> [[f32; 4]; 3] {
    [rotation.x_axis, rotation.y_axis, rotation.z_axis].map(|axis| axis.extend(0.0).to_array())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{Atmosphere, AtmosphereParams, LightSettings, SunPosition};

    #[test]
    fn the_hue_of_shade_times_its_luminance_is_the_light_of_the_sky() {
        let air = Atmosphere::new(AtmosphereParams::default()).unwrap();
        for elevation in [60.0, 5.0, -0.2, -30.0] {
            let sun = SunPosition::from_degrees(200.0, elevation).unwrap();
            let mut light = LightState::new(&air, sun, None, &LightSettings::default()).unwrap();
            let lit = light.sky_illuminance + light.key_illuminance * light.key_direction.y.max(0.0);
            let shaded = lit * shaded_hue(&light) * (luminance(light.sky_illuminance) / luminance(lit));
            assert!((shaded / light.sky_illuminance - 1.0).abs().max_element() < 1e-5, "{shaded}");
            light.sky_illuminance = Vec3::ZERO;
            light.key_illuminance = Vec3::ZERO;
            assert_eq!(shaded_hue(&light), Vec3::ONE);
        }
    }
}
