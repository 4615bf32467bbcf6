//! How the camera flies: from the user's input to a position and a direction. Pure, and exact in time: the distance
//! flown in a second does not depend on the number of frames in it.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DQuat, DVec2, DVec3};

use crate::scene::Viewpoint;

/// Minimum metres between the camera and the ground below it: the eye height of a standing person.
pub const EYE_HEIGHT: f64 = 1.7;
/// Slowest and fastest flight in metres per second, before hurry.
pub const SPEEDS: std::ops::RangeInclusive<f64> = 0.2..=2000.0;
/// Speed at the start in metres per second.
const FIRST_SPEED: f64 = 15.0;
/// Factor on the speed while Shift is held.
const HURRY: f64 = 5.0;
/// Factor on the speed of one notch of the wheel.
const NOTCH: f64 = 1.25;
/// Seconds in which the difference between the velocity and the wanted one falls to 1/e.
const INERTIA: f64 = 0.12;
/// Longest step in seconds: after a longer pause (a stalled driver, a suspended computer) the camera must not be far
/// away.
const LONGEST_STEP: f64 = 1.0;
/// Metres from the terrain's centre within which scenes may place things; the flight ends there too.
const MAX_DISTANCE: f64 = 1e7;
/// Lowest and highest flight in metres above the datum.
const HEIGHTS: (f64, f64) = (-2e4, 1e5);

/// The user's input during a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Controls {
    /// Wanted travel in the camera's frame, each -1 to 1: x to its right, y up to the zenith, z forward.
    pub travel: DVec3,
    /// Whether to hurry: five times the speed.
    pub hurry: bool,
    /// Rotation of the view within the step in radians: x to the right, y upward.
    pub rotation: DVec2,
    /// Notches of the wheel; positive is faster.
    pub notches: f64,
}

impl Controls {
    /// Whether the user wants to travel.
    pub fn travels(&self) -> bool {
        self.travel != DVec3::ZERO
    }
}

/// The camera in flight, in scene-local coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pilot {
    /// Metres: x east, y above the datum of the heights, z south of the terrain's centre.
    pub position: DVec3,
    /// Metres per second.
    pub velocity: DVec3,
    /// Rotation about +Y in radians, counter-clockwise seen from above, 0 to 2 pi; 0 looks north.
    pub yaw: f64,
    /// Radians above the horizon, -pi/2 to pi/2.
    pub pitch: f64,
    /// Metres per second of unhurried flight.
    pub speed: f64,
}

impl Pilot {
    /// A camera that rests at `view`.
    pub fn at(view: &Viewpoint) -> Self {
        Self { position: view.position, velocity: DVec3::ZERO, yaw: view.yaw, pitch: view.pitch, speed: FIRST_SPEED }
    }

    /// Takes the position and direction of `view` and stops there; the speed that the user chose stays.
    pub fn rest_at(&mut self, view: &Viewpoint) {
        *self = Self { speed: self.speed, ..Self::at(view) };
    }

    /// The camera with a vertical field of view in radians.
    pub fn viewpoint(&self, field_of_view: f64) -> Viewpoint {
        Viewpoint { position: self.position, yaw: self.yaw, pitch: self.pitch, field_of_view }
    }

    /// Compass bearing of the view in degrees, 0 to 360.
    pub fn bearing(&self) -> f64 {
        (-self.yaw.to_degrees()).rem_euclid(360.0)
    }

    /// Flies for `seconds`, at most one second per call.
    ///
    /// The velocity follows the wanted one like a body in a viscous medium, `v' = (w - v) / inertia`. Position
    /// and velocity are the exact solution over the step, so the size of the steps does not matter.
    pub fn fly(&mut self, controls: &Controls, seconds: f64) {
        let seconds = if seconds.is_finite() { seconds.clamp(0.0, LONGEST_STEP) } else { 0.0 };
        if controls.rotation.is_finite() {
            self.yaw = (self.yaw - controls.rotation.x).rem_euclid(TAU);
            self.pitch = (self.pitch + controls.rotation.y).clamp(-FRAC_PI_2, FRAC_PI_2);
        }
        if controls.notches.is_finite() {
            self.speed = (self.speed * NOTCH.powf(controls.notches)).clamp(*SPEEDS.start(), *SPEEDS.end());
        }
        let wanted = self.wanted(controls);
        let kept = (-seconds / INERTIA).exp();
        let lag = self.velocity - wanted;
        let position = self.position + wanted * seconds + lag * (INERTIA * (1.0 - kept));
        if position.is_finite() {
            let (low, high) = HEIGHTS;
            self.position = position
                .clamp(DVec3::new(-MAX_DISTANCE, low, -MAX_DISTANCE), DVec3::new(MAX_DISTANCE, high, MAX_DISTANCE));
            self.velocity = wanted + lag * kept;
        } else {
            self.velocity = DVec3::ZERO;
        }
    }

    fn wanted(&self, controls: &Controls) -> DVec3 {
        if !controls.travel.is_finite() {
            return DVec3::ZERO;
        }
        let around = DQuat::from_rotation_y(self.yaw);
        let forward = around * DQuat::from_rotation_x(self.pitch) * DVec3::NEG_Z;
        let travel = around * DVec3::X * controls.travel.x + DVec3::Y * controls.travel.y + forward * controls.travel.z;
        let hurry = if controls.hurry { HURRY } else { 1.0 };
        travel.clamp_length_max(1.0) * self.speed * hurry
    }

    /// Lifts the camera to eye height above `ground`, the terrain's height below it, if it is lower.
    pub fn stay_above(&mut self, ground: f64) {
        let floor = ground + EYE_HEIGHT;
        if self.position.y < floor {
            self.position.y = floor;
            self.velocity.y = self.velocity.y.max(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pilot() -> Pilot {
        Pilot::at(&Viewpoint { position: DVec3::new(10.0, 50.0, -20.0), yaw: 0.0, pitch: 0.0, field_of_view: 1.0 })
    }

    fn travel(x: f64, y: f64, z: f64) -> Controls {
        Controls { travel: DVec3::new(x, y, z), ..Controls::default() }
    }

    #[test]
    fn forward_is_north_and_right_is_east() {
        let mut north = pilot();
        north.fly(&travel(0.0, 0.0, 1.0), 1.0);
        assert!(north.position.z < -30.0 && (north.position.x - 10.0).abs() < 1e-9);
        let mut east = pilot();
        east.fly(&travel(1.0, 0.0, 0.0), 1.0);
        assert!(east.position.x > 20.0 && (east.position.z + 20.0).abs() < 1e-9);
        assert_eq!(east.position.y, 50.0);
        // A quarter to the right, forward is east.
        let mut rotated = pilot();
        rotated.fly(&Controls { rotation: DVec2::new(FRAC_PI_2, 0.0), ..travel(0.0, 0.0, 1.0) }, 1.0);
        assert!(rotated.position.x > 20.0 && (rotated.bearing() - 90.0).abs() < 1e-9);
    }

    #[test]
    fn the_way_does_not_depend_on_the_frames() {
        let controls = Controls { hurry: true, ..travel(0.3, -0.4, 1.0) };
        let (mut once, mut often) = (pilot(), pilot());
        once.fly(&controls, 0.9);
        for _ in 0..90 {
            often.fly(&controls, 0.01);
        }
        assert!((once.position - often.position).length() < 1e-9, "{} {}", once.position, often.position);
        assert!((once.velocity - often.velocity).length() < 1e-9);
        // Released, both come to rest at one place.
        for (pilot, steps) in [(&mut once, 1), (&mut often, 50)] {
            for _ in 0..steps {
                pilot.fly(&Controls::default(), 1.0 / f64::from(steps));
            }
        }
        assert!((once.position - often.position).length() < 1e-9);
        assert!(once.velocity.length() < 0.1);
    }

    #[test]
    fn hurry_is_five_times_as_fast_and_diagonals_are_not_faster() {
        let distance = |controls: &Controls| {
            let mut pilot = pilot();
            pilot.fly(controls, 1.0);
            (pilot.position - DVec3::new(10.0, 50.0, -20.0)).length()
        };
        let plain = distance(&travel(0.0, 0.0, 1.0));
        assert!((distance(&Controls { hurry: true, ..travel(0.0, 0.0, 1.0) }) / plain - 5.0).abs() < 1e-9);
        assert!((distance(&travel(1.0, 1.0, 1.0)) - plain).abs() < 1e-9);
    }

    #[test]
    fn the_wheel_stays_within_the_speeds() {
        let mut pilot = pilot();
        pilot.fly(&Controls { notches: 1e6, ..Controls::default() }, 0.01);
        assert_eq!(pilot.speed, *SPEEDS.end());
        pilot.fly(&Controls { notches: -1e6, ..Controls::default() }, 0.01);
        assert_eq!(pilot.speed, *SPEEDS.start());
    }

    #[test]
    fn the_ground_stops_a_dive_but_not_a_glide() {
        let mut diving = pilot();
        diving.velocity = DVec3::new(3.0, -9.0, 0.0);
        diving.stay_above(60.0);
        assert_eq!(diving.position.y, 60.0 + EYE_HEIGHT);
        assert_eq!(diving.velocity, DVec3::new(3.0, 0.0, 0.0));
        let before = diving;
        diving.stay_above(40.0);
        assert_eq!(diving, before);
    }

    #[test]
    fn a_million_metres_out_a_millimetre_is_still_a_step() {
        let mut pilot = pilot();
        pilot.position = DVec3::new(1e6, 100.0, -1e6);
        pilot.speed = 0.2;
        pilot.velocity = DVec3::new(0.2, 0.0, 0.0);
        pilot.fly(&travel(1.0, 0.0, 0.0), 0.005);
        assert!((pilot.position.x - 1e6 - 0.001).abs() < 1e-8);
    }

    proptest! {
        #[test]
        fn nothing_leads_to_nowhere(
            rotation in any::<(f64, f64)>(), travel in any::<(f64, f64, f64)>(), notches in any::<f64>(),
            seconds in any::<f64>(), hurry in any::<bool>(),
        ) {
            let mut pilot = pilot();
            let controls = Controls {
                travel: DVec3::from(travel), hurry, rotation: DVec2::from(rotation), notches,
            };
            for _ in 0..3 {
                pilot.fly(&controls, seconds);
                prop_assert!(pilot.position.is_finite() && pilot.velocity.is_finite());
                prop_assert!((0.0..=TAU).contains(&pilot.yaw) && pilot.pitch.abs() <= FRAC_PI_2);
                prop_assert!(SPEEDS.contains(&pilot.speed));
            }
        }
    }
}
