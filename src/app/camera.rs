//! A viewpoint in f64 as Bevy's f32 camera: the world's origin moves along.

use bevy::{
    camera::{PerspectiveProjection, Projection},
    core_pipeline::tonemapping::Tonemapping,
    prelude::Transform,
};

use crate::{render::components::CanopyOrigin, scene::Viewpoint};

/// Metres to which the Bevy world's origin is rounded near the camera.
const ORIGIN_STEP: f64 = 1024.0;
/// Metres to the near plane.
pub const NEAR: f32 = 0.1;
/// From the camera's exposed radiance to what a screen shows.
pub const TONEMAPPING: Tonemapping = Tonemapping::BlenderFilmic;

/// The origin of the Bevy world near the camera, and the camera's transform relative to it.
pub fn place(view: &Viewpoint) -> (CanopyOrigin, Transform) {
    let origin = (view.position / ORIGIN_STEP).round() * ORIGIN_STEP;
    let transform = Transform {
        translation: (view.position - origin).as_vec3(),
        rotation: view.rotation().as_quat(),
        ..Transform::default()
    };
    (CanopyOrigin(origin), transform)
}

/// The projection of a camera with a vertical field of view in radians.
pub fn projection(field_of_view: f64) -> Projection {
    Projection::Perspective(PerspectiveProjection {
        fov: field_of_view as f32,
        near: NEAR,
        ..PerspectiveProjection::default()
    })
}
