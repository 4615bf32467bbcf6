//! A smooth flight through the keys of a camera path.
//!
//! Every coordinate is a cubic Hermite curve in time, so that the camera's velocity has no jumps. East and south take
//! the tangents of [Catmull and Rom 1974] for keys that need not be evenly spaced in time (the slope of the parabola
//! through a key and its neighbours; for even spacing exactly Catmull–Rom). Height above the ground and pitch take the
//! monotone tangents of [Fritsch and Butland 1984] instead: those never overshoot, so a camera whose keys are above
//! the ground stays above it, and a pitch never passes the zenith.

use super::camera::{PathKey, Pose};

/// Coordinates of a pose: x, y, z, yaw, pitch.
const COORDINATES: usize = 5;
/// Those that must not overshoot their keys.
const MONOTONE: [bool; COORDINATES] = [false, true, false, false, true];

/// A camera path, evaluated in f64.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    knots: Vec<Knot>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Knot {
    seconds: f64,
    value: [f64; COORDINATES],
    /// Change per second.
    tangent: [f64; COORDINATES],
}

impl Path {
    /// The path through `keys`, whose times must be finite and grow. `None` for fewer than two keys, or keys out of
    /// order, not finite, or too close in time for a finite speed (a [`super::Scene`] that was read never has those).
    pub fn new(keys: &[PathKey]) -> Option<Self> {
        let in_order = keys.windows(2).all(|pair| matches!(pair, [a, b] if a.seconds < b.seconds));
        let mut knots: Vec<Knot> = keys.iter().map(Knot::at_rest).collect();
        let finite = knots.iter().all(|knot| knot.seconds.is_finite() && knot.value.iter().all(|v| v.is_finite()));
        if keys.len() < 2 || !in_order || !finite {
            return None;
        }
        unwrap_yaw(&mut knots);
        for coordinate in 0..COORDINATES {
            let tangents = tangents(&knots, coordinate);
            for (knot, tangent) in knots.iter_mut().zip(tangents) {
                knot.tangent[coordinate] = tangent;
            }
        }
        // Keys may be so close in time that the speed between them is no number.
        knots.iter().all(|knot| knot.tangent.iter().all(|slope| slope.is_finite())).then_some(Self { knots })
    }

    /// The time of the first key in seconds.
    pub fn start(&self) -> f64 {
        self.knots.first().map_or(0.0, |knot| knot.seconds)
    }

    /// The time of the last key in seconds.
    pub fn end(&self) -> f64 {
        self.knots.last().map_or(0.0, |knot| knot.seconds)
    }

    /// The pose at a time; before the first key and after the last the camera does not move.
    pub fn at(&self, seconds: f64) -> Pose {
        let seconds = if seconds.is_nan() { self.start() } else { seconds.clamp(self.start(), self.end()) };
        let behind = self.knots.partition_point(|knot| knot.seconds <= seconds);
        let index = behind.clamp(1, self.knots.len().saturating_sub(1).max(1));
        let value = match self.knots.get(index - 1..=index) {
            Some([a, b]) => std::array::from_fn(|coordinate| hermite(a, b, coordinate, seconds)),
            _ => [0.0; COORDINATES],
        };
        let [x, y, z, yaw, pitch] = value;
        Pose { position: (x, y, z), yaw, pitch }
    }
}

impl Knot {
    fn at_rest(key: &PathKey) -> Self {
        let (x, y, z) = key.position;
        Self { seconds: key.seconds, value: [x, y, z, key.yaw, key.pitch], tangent: [0.0; COORDINATES] }
    }
}

/// Adds full rotations so that neighbouring keys differ by at most half a rotation.
fn unwrap_yaw(knots: &mut [Knot]) {
    let mut before: Option<f64> = None;
    for knot in knots {
        let yaw = match before {
            Some(before) => before + (knot.value[3] - before + 180.0).rem_euclid(360.0) - 180.0,
            None => knot.value[3],
        };
        knot.value[3] = yaw;
        before = Some(yaw);
    }
}

fn tangents(knots: &[Knot], coordinate: usize) -> Vec<f64> {
    let steps: Vec<(f64, f64)> = knots
        .windows(2)
        .map(|pair| match pair {
            [a, b] => {
                let duration = b.seconds - a.seconds;
                (duration, (b.value[coordinate] - a.value[coordinate]) / duration)
            }
            _ => (1.0, 0.0),
        })
        .collect();
    (0..knots.len())
        .map(|knot| match (knot.checked_sub(1).and_then(|left| steps.get(left)), steps.get(knot)) {
            (Some(left), Some(right)) if MONOTONE[coordinate] => monotone_tangent(*left, *right),
            (Some(&(h0, d0)), Some(&(h1, d1))) => (h1 * d0 + h0 * d1) / (h0 + h1),
            (Some(&(_, slope)), None) | (None, Some(&(_, slope))) => slope,
            (None, None) => 0.0,
        })
        .collect()
}

/// [Fritsch and Butland 1984]: a weighted harmonic mean of the slopes on both sides, level at a local extremum.
fn monotone_tangent((h0, d0): (f64, f64), (h1, d1): (f64, f64)) -> f64 {
    if d0 * d1 <= 0.0 {
        return 0.0;
    }
    let (w0, w1) = (2.0 * h1 + h0, h1 + 2.0 * h0);
    (w0 + w1) / (w0 / d0 + w1 / d1)
}

fn hermite(a: &Knot, b: &Knot, coordinate: usize, seconds: f64) -> f64 {
    let duration = b.seconds - a.seconds;
    let t = (seconds - a.seconds) / duration;
    let s = 1.0 - t;
    let (from, to) = (a.value[coordinate], b.value[coordinate]);
    let (leave, arrive) = (a.tangent[coordinate] * duration, b.tangent[coordinate] * duration);
    s * s * (1.0 + 2.0 * t) * from + t * t * (1.0 + 2.0 * s) * to + s * s * t * leave - s * t * t * arrive
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn key(seconds: f64, position: (f64, f64, f64), yaw: f64, pitch: f64) -> PathKey {
        PathKey { seconds, position, yaw, pitch }
    }

    fn path(keys: &[PathKey]) -> Path {
        Path::new(keys).unwrap_or(Path { knots: Vec::new() })
    }

    #[test]
    fn keys_without_time_between_them_are_no_path() {
        let keys = |step: f64| [key(0.0, (0.0, 5.0, 0.0), 0.0, 0.0), key(step, (40.0, 9.0, -7.0), 40.0, -10.0)];
        assert_eq!(Path::new(&keys(1e-308)), None);
        let pose = path(&keys(1e-3)).at(5e-4);
        assert!(
            [pose.position.0, pose.position.1, pose.position.2, pose.yaw, pose.pitch].iter().all(|v| v.is_finite())
        );
    }

    #[test]
    fn passes_through_its_keys_and_rests_outside() {
        let keys = [
            key(1.0, (0.0, 5.0, 0.0), 10.0, 0.0),
            key(3.0, (40.0, 9.0, -7.0), 40.0, -10.0),
            key(9.0, (90.0, 30.0, 12.0), 80.0, -30.0),
        ];
        let path = path(&keys);
        for key in &keys {
            let pose = path.at(key.seconds);
            assert!((pose.position.0 - key.position.0).abs() < 1e-9 && (pose.yaw - key.yaw).abs() < 1e-9);
        }
        assert_eq!(path.at(-5.0), keys[0].pose());
        assert_eq!(path.at(100.0), path.at(9.0));
        assert_eq!((path.start(), path.end()), (1.0, 9.0));
    }

    #[test]
    fn even_keys_give_the_catmull_rom_spline() {
        // Uniform Catmull-Rom at the middle of its second segment: (-p0 + 9 p1 + 9 p2 - p3) / 16.
        let xs = [3.0, -2.0, 11.0, 4.0];
        let keys: Vec<PathKey> = xs.iter().enumerate().map(|(i, x)| key(i as f64, (*x, 1.0, 0.0), 0.0, 0.0)).collect();
        let expected = (-xs[0] + 9.0 * xs[1] + 9.0 * xs[2] - xs[3]) / 16.0;
        assert!((path(&keys).at(1.5).position.0 - expected).abs() < 1e-12);
    }

    #[test]
    fn turns_the_shorter_way() {
        let turning = path(&[
            key(0.0, (0.0, 1.0, 0.0), 350.0, 0.0),
            key(1.0, (0.0, 1.0, 0.0), 10.0, 0.0),
            key(2.0, (0.0, 1.0, 0.0), 340.0, 0.0),
        ]);
        let middle = turning.at(0.5).yaw;
        assert!((350.0..370.0).contains(&middle), "{middle}");
        assert!((turning.at(2.0).yaw - 340.0).abs() < 1e-9);
    }

    #[test]
    fn too_few_or_unordered_keys_are_no_path() {
        let one = key(0.0, (0.0, 1.0, 0.0), 0.0, 0.0);
        assert_eq!(Path::new(&[one]), None);
        assert_eq!(Path::new(&[one, one]), None);
        assert_eq!(Path::new(&[one, key(1.0, (f64::NAN, 1.0, 0.0), 0.0, 0.0)]), None);
    }

    proptest! {
        #[test]
        fn velocity_has_no_jumps_and_height_never_overshoots(
            values in prop::collection::vec((0.1_f64..20.0, -500.0_f64..500.0, 0.0_f64..300.0, -90.0_f64..90.0), 2..8),
        ) {
            let mut seconds = 0.0;
            let keys: Vec<PathKey> = values.iter().map(|(step, x, y, pitch)| {
                seconds += step;
                key(seconds, (*x, *y, -*x), *x, *pitch)
            }).collect();
            let path = path(&keys);
            for pair in keys.windows(2) {
                for share in 0..=20 {
                    let pose = path.at(pair[0].seconds + (pair[1].seconds - pair[0].seconds) * f64::from(share) / 20.0);
                    let low = pair[0].position.1.min(pair[1].position.1);
                    let high = pair[0].position.1.max(pair[1].position.1);
                    prop_assert!(pose.position.1 >= low - 1e-9 && pose.position.1 <= high + 1e-9);
                    prop_assert!(pose.pitch.abs() <= 90.0 + 1e-9);
                }
            }
            for key in keys.iter().take(keys.len() - 1).skip(1) {
                let h = 1e-6;
                let left = (path.at(key.seconds).position.0 - path.at(key.seconds - h).position.0) / h;
                let right = (path.at(key.seconds + h).position.0 - path.at(key.seconds).position.0) / h;
                prop_assert!((left - right).abs() < 1.0, "{} {}", left, right);
            }
        }
    }
}
