//! A viewpoint in f64 as Bevy's f32 camera: the world's origin follows the camera.

use bevy::{
    camera::{PerspectiveProjection, Projection},
    prelude::Transform,
};

use crate::{render::components::CanopyOrigin, scene::Viewpoint};

/// Distance of the near plane in metres.
pub const NEAR: f32 = 0.1;

/// The origin of the Bevy world near the camera, and the camera's transform relative to it.
pub fn origin_and_transform(view: &Viewpoint) -> (CanopyOrigin, Transform) {
    let origin = CanopyOrigin::near(view.position);
    let transform = Transform {
        translation: origin.translation(view.position),
        rotation: view.rotation().as_quat(),
        ..Transform::default()
    };
    (origin, transform)
}

/// The projection of a camera with a vertical field of view in radians.
pub fn projection(field_of_view: f64) -> Projection {
    Projection::Perspective(PerspectiveProjection {
        fov: field_of_view as f32,
        near: NEAR,
        ..PerspectiveProjection::default()
    })
}
