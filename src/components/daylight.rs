//! What follows the current light: the lights of ordinary meshes.

use bevy::{
    color::LinearRgba,
    ecs::{
        change_detection::DetectChanges,
        component::Component,
        query::{Added, With},
        reflect::ReflectComponent,
        system::{Query, Res, ResMut},
    },
    light::{DirectionalLight, GlobalAmbientLight},
    prelude::ReflectDefault,
    reflect::Reflect,
    transform::components::Transform,
};
use glam::Vec3;

use crate::{math::luminance, render::components::Daylight};

/// A Bevy directional light that follows the sun or the moon, so that ordinary meshes are lit like the forest. A
/// [`Sun`](super::Sun) requires it.
#[derive(Component, Clone, Copy, Debug, Default, Reflect)]
#[reflect(Component, Default)]
#[require(DirectionalLight)]
pub struct FollowsDaylight;

/// Points the lights that follow at the key light, with its illuminance and colour.
pub(super) fn light_meshes(
    daylight: Option<Res<Daylight>>,
    mut lights: Query<(&mut DirectionalLight, &mut Transform), With<FollowsDaylight>>,
    fresh: Query<(), Added<FollowsDaylight>>,
    mut ambient: Option<ResMut<GlobalAmbientLight>>,
) {
    let Some(daylight) = daylight.filter(|daylight| daylight.is_changed() || !fresh.is_empty()) else { return };
    if lights.is_empty() {
        return;
    }
    let light = &daylight.0;
    let illuminance = light.key_illuminance.max_element().max(0.0);
    let color = light.key_illuminance / illuminance.max(1e-12);
    for (mut directional, mut transform) in &mut lights {
        directional.illuminance = illuminance;
        directional.color = LinearRgba::rgb(color.x, color.y, color.z).into();
        *transform = Transform::default().looking_to(-light.key_direction, Vec3::Y);
    }
    if let Some(ambient) = ambient.as_mut() {
        let sky = light.sky_illuminance.max(Vec3::ZERO);
        let brightest = sky.max_element().max(1e-12);
        ambient.color = LinearRgba::rgb(sky.x / brightest, sky.y / brightest, sky.z / brightest).into();
        // Bevy's ambient light is a radiance from all directions: the mean of the sky over both hemispheres.
        ambient.brightness = luminance(sky) / std::f32::consts::PI * 0.5;
    }
}
