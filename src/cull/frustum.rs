//! The view's frustum, relative to the camera.

use glam::{Mat4, Vec3, Vec4, Vec4Swizzles};

/// Planes of a frustum, relative to the camera: `normal · p + w >= 0` inside.
#[derive(Clone, Debug)]
pub struct Frustum {
    planes: Vec<Vec4>,
}

impl Frustum {
    /// The four side planes of `clip_from_relative`. They meet in the camera, so what lies behind it is outside of
    /// them.
    pub fn new(clip_from_relative: &Mat4) -> Self {
        let rows = clip_from_relative.transpose();
        let planes = [
            rows.w_axis + rows.x_axis,
            rows.w_axis - rows.x_axis,
            rows.w_axis + rows.y_axis,
            rows.w_axis - rows.y_axis,
        ];
        let normalised = |plane: Vec4| {
            let length = plane.xyz().length();
            (length > 1e-12).then(|| plane / length)
        };
        Self { planes: planes.into_iter().filter_map(normalised).collect() }
    }

    /// Its planes, with unit normals: `normal · p + w >= 0` inside.
    pub fn planes(&self) -> &[Vec4] {
        &self.planes
    }

    /// Whether the camera-relative axis-aligned box may be visible.
    pub fn sees_box(&self, min: Vec3, max: Vec3) -> bool {
        let (middle, half) = (0.5 * (min + max), 0.5 * (max - min));
        self.planes.iter().all(|plane| plane.xyz().dot(middle) + plane.w + plane.xyz().abs().dot(half) >= 0.0)
    }
}
