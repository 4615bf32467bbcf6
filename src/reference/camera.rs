//! The renderer's camera as rays.

use glam::{DVec3, Vec2};

use super::error::ReferenceError;
use crate::scene::Viewpoint;

/// A ray through the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldRay {
    /// Scene metres.
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
    /// Maximum distance, metres; may be infinite.
    pub t_max: f64,
}

impl WorldRay {
    /// A ray of infinite length.
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction, t_max: f64::INFINITY }
    }

    /// The position at `t` metres.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.direction
    }
}

/// A pinhole camera: the renderer's perspective projection of a [`Viewpoint`], and its near plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position and direction.
    pub view: Viewpoint,
    /// Width and height of the image in pixels.
    pub size: (u32, u32),
    /// Distance to the near plane, metres, 0 or more: nothing in front of it is visible.
    pub near: f64,
}

/// The most pixels of an image: more than any screen, and few enough that their sums fit into memory.
const MOST_PIXELS: u64 = 1 << 28;

impl Camera {
    /// Checks that the camera is valid.
    ///
    /// # Errors
    /// [`ReferenceError::Size`], [`ReferenceError::Value`].
    pub fn check(&self) -> Result<(), ReferenceError> {
        let (width, height) = self.size;
        let pixels = u64::from(width) * u64::from(height);
        if pixels == 0 || pixels > MOST_PIXELS {
            return Err(ReferenceError::Size { width, height, limit: MOST_PIXELS });
        }
        let Viewpoint { position, yaw, pitch, field_of_view } = self.view;
        if let Some(&wrong) = position.to_array().iter().find(|value| value.is_nan() || value.abs() > 1e9) {
            return Err(ReferenceError::value("a coordinate of the camera", wrong, "metres from -1e9 to 1e9"));
        }
        for (what, value) in [("the camera's yaw", yaw), ("the camera's pitch", pitch)] {
            if value.is_nan() || value.abs() > 1e6 {
                return Err(ReferenceError::value(what, value, "radians"));
            }
        }
        if !(1e-4..=3.1).contains(&field_of_view) {
            return Err(ReferenceError::value("the field of view", field_of_view, "radians from 1e-4 to 3.1"));
        }
        if !(0.0..=1e6).contains(&self.near) {
            return Err(ReferenceError::value("the distance of the near plane", self.near, "metres from 0 to 1e6"));
        }
        Ok(())
    }

    /// The ray through the point `inside` (0..1 each, from the upper left) of a pixel, from the near plane on.
    pub fn ray(&self, column: u32, row: u32, inside: Vec2) -> WorldRay {
        let (width, height) = (f64::from(self.size.0), f64::from(self.size.1));
        let tangent = (0.5 * self.view.field_of_view).tan();
        let x = (2.0 * (f64::from(column) + f64::from(inside.x)) / width - 1.0) * tangent * width / height;
        let y = (1.0 - 2.0 * (f64::from(row) + f64::from(inside.y)) / height) * tangent;
        let forward = DVec3::new(x, y, -1.0);
        let direction = (self.view.rotation() * forward).normalize();
        WorldRay::new(self.view.position + direction * (self.near * forward.length()), direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        let view = Viewpoint { position: DVec3::new(1.0, 2.0, 3.0), yaw: 0.5, pitch: -0.2, field_of_view: 1.0 };
        Camera { view, size: (200, 100), near: 0.0 }
    }

    #[test]
    fn the_middle_looks_forward_and_the_edges_are_half_the_field_away() {
        let camera = camera();
        let middle = camera.ray(100, 50, Vec2::ZERO);
        assert!(middle.direction.abs_diff_eq(camera.view.forward(), 1e-12));
        let top = camera.ray(100, 0, Vec2::ZERO);
        assert!((top.direction.dot(middle.direction).acos() - 0.5).abs() < 1e-9);
        assert!(top.direction.y > middle.direction.y);
        let right = camera.view.rotation() * DVec3::X;
        assert!(camera.ray(199, 50, Vec2::ZERO).direction.dot(right) > 0.0);
        let near = Camera { near: 0.5, ..camera };
        let start = near.ray(3, 7, Vec2::splat(0.5)).origin - near.view.position;
        assert!((start.dot(near.view.forward()) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn impossible_cameras_are_refused() {
        let good = camera();
        assert!(good.check().is_ok());
        assert!(Camera { size: (0, 3), ..good }.check().is_err());
        assert!(Camera { size: (u32::MAX, u32::MAX), ..good }.check().is_err());
        assert!(Camera { near: f64::NAN, ..good }.check().is_err());
        let bad = |view: Viewpoint| Camera { view, ..good }.check().is_err();
        assert!(bad(Viewpoint { position: DVec3::new(0.0, f64::NAN, 0.0), ..good.view }));
        assert!(bad(Viewpoint { pitch: f64::INFINITY, ..good.view }));
        assert!(bad(Viewpoint { field_of_view: 0.0, ..good.view }));
    }
}
