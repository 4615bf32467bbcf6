//! The camera of a scene: where it starts, and the path that it can fly.

use glam::{DQuat, DVec3};
use serde::Deserialize;

use super::check::Check;

/// The camera.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Camera {
    /// The start. Default: 20 m above the terrain's centre, looking north.
    pub start: Pose,
    /// The scripted flight, at least two keys in the order of time, or none. Default: none.
    pub path: Vec<PathKey>,
    /// Vertical field of view in degrees, 1 to 170. Default 50.
    pub field_of_view: f64,
    /// Exposure value at ISO 100 that is kept everywhere and at all hours, -10 to 25: 14 is a sunny day, 10 the inside of a
    /// wood. Default: it follows the light at the camera.
    pub exposure: Option<f64>,
}

impl Default for Camera {
    fn default() -> Self {
        Self { start: Pose::default(), path: Vec::new(), field_of_view: 50.0, exposure: None }
    }
}

/// A position and a direction, as users write them.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Pose {
    /// `(x, y, z)` in metres: x east and z **south** of the terrain's centre (north is negative), each -10000000 to
    /// 10000000; y above the **ground** at that position, 0 to 100000. Default (0, 20, 0).
    pub position: (f64, f64, f64),
    /// Compass bearing of the view in degrees, clockwise from north: 0 north, 90 east. -36000 to 36000. Default 0.
    pub yaw: f64,
    /// Degrees above the horizon, -90 (straight down) to 90. Default 0.
    pub pitch: f64,
}

impl Default for Pose {
    fn default() -> Self {
        Self { position: (0.0, 20.0, 0.0), yaw: 0.0, pitch: 0.0 }
    }
}

/// One key of a path. Between keys the camera moves smoothly, see [`super::Path`].
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathKey {
    /// When, in seconds, 0 to 86400; each key later than the one before. Required.
    pub seconds: f64,
    /// As [`Pose::position`]: y is the height above the ground. Required.
    pub position: (f64, f64, f64),
    /// As [`Pose::yaw`]. The camera rotates the shorter way from key to key. Required.
    pub yaw: f64,
    /// As [`Pose::pitch`]. Required.
    pub pitch: f64,
}

impl PathKey {
    /// Position and direction of the key.
    pub fn pose(&self) -> Pose {
        Pose { position: self.position, yaw: self.yaw, pitch: self.pitch }
    }
}

/// A camera in scene-local coordinates, ready to draw with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Metres: x east, y above the datum of the heights, z south of the terrain's centre.
    pub position: DVec3,
    /// Rotation about +Y in radians, counter-clockwise seen from above; 0 looks to −Z (north).
    pub yaw: f64,
    /// Radians above the horizon.
    pub pitch: f64,
    /// Vertical field of view in radians.
    pub field_of_view: f64,
}

impl Viewpoint {
    /// The rotation that takes the camera's frame (looking along −Z, Y up) to the scene's.
    pub fn rotation(&self) -> DQuat {
        DQuat::from_rotation_y(self.yaw) * DQuat::from_rotation_x(self.pitch)
    }

    /// Unit direction of view.
    pub fn forward(&self) -> DVec3 {
        self.rotation() * DVec3::NEG_Z
    }
}

impl Pose {
    /// The camera of this pose over `ground` (the terrain's height at [`Pose::position`], in metres), with a vertical
    /// field of view in degrees.
    pub fn viewpoint(&self, ground: f64, field_of_view: f64) -> Viewpoint {
        let (x, y, z) = self.position;
        Viewpoint {
            position: DVec3::new(x, ground + y, z),
            // Compass bearings grow clockwise; a right-handed rotation about +Y is counter-clockwise.
            yaw: (-self.yaw).rem_euclid(360.0).to_radians(),
            pitch: self.pitch.to_radians(),
            field_of_view: field_of_view.to_radians(),
        }
    }

    fn check(&self, at: &str, check: &mut Check) {
        check.point(&format!("{at}.position"), self.position, [-1e7..=1e7, 0.0..=1e5, -1e7..=1e7]);
        check.number(&format!("{at}.yaw"), self.yaw, -36_000.0..=36_000.0, "degrees");
        check.number(&format!("{at}.pitch"), self.pitch, -90.0..=90.0, "degrees");
    }
}

/// Least time between two keys of a path in seconds: a millisecond, less what decimals lose.
const LEAST_STEP: f64 = 0.000_999_9;

impl Camera {
    pub(super) fn check(&self, check: &mut Check) {
        self.start.check("camera.start", check);
        check.number("camera.field_of_view", self.field_of_view, 1.0..=170.0, "degrees");
        if let Some(exposure) = self.exposure {
            check.number("camera.exposure", exposure, -10.0..=25.0, "EV");
        }
        if self.path.len() == 1 {
            check.problem("camera.path", "has one key", "a path needs two keys or more; or leave `path` out");
        }
        for (number, key) in self.path.iter().enumerate() {
            let at = format!("camera.path[{number}]");
            key.pose().check(&at, check);
            let finite = check.number(&format!("{at}.seconds"), key.seconds, 0.0..=86_400.0, "s");
            let before = number.checked_sub(1).and_then(|before| self.path.get(before));
            let close =
                |before: &&PathKey| finite && before.seconds < key.seconds && key.seconds - before.seconds < LEAST_STEP;
            if let Some(before) = before.filter(close) {
                check.problem(
                    &format!("{at}.seconds"),
                    format!(
                        "is {} s, less than a millisecond after the key before it ({} s)",
                        key.seconds, before.seconds
                    ),
                    "leave more time between the keys, or remove one",
                );
            }
            if let Some(before) = before.filter(|before| finite && before.seconds >= key.seconds) {
                check.problem(
                    &format!("{at}.seconds"),
                    format!("is {} s, not after the key before it ({} s)", key.seconds, before.seconds),
                    "order the keys by time, no two at the same",
                );
            }
        }
    }
}
