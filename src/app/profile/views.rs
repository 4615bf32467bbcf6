//! Where a profile looks from, and when.

use chrono::{DateTime, Utc};

use crate::{
    app::PlanError,
    scene::{LocalTime, Path, Pose, Scene, Viewpoint},
};

/// Frames that are drawn on the way to each view of a flight, and the seconds between them.
const LEAD: u32 = 2;
const LEAD_STEP: f64 = 1.0 / 60.0;

/// Which views a profile has.
#[derive(Clone, Debug, PartialEq)]
pub enum Views {
    /// Along the scene's path; a scene without one stands at its start.
    Flight {
        /// Number of frames, at least 1.
        frames: u32,
        /// Frames per second; `None` spreads the frames over the path.
        fps: Option<f64>,
        /// Seconds on the path of the first frame; `None`: its beginning.
        from: Option<f64>,
        /// Date and time; `None`: the scene's.
        at: Option<LocalTime>,
    },
    /// Each of these cameras at each of these times (none: the scene's own).
    Stills {
        /// At least one.
        cameras: Vec<Pose>,
        /// Dates and times.
        times: Vec<LocalTime>,
    },
}

/// One view.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileView {
    /// Its number with leading zeros, which names its files.
    pub name: String,
    /// Seconds on the path.
    pub seconds: Option<f64>,
    /// The camera as written.
    pub pose: Pose,
    /// The camera over the ground.
    pub view: Viewpoint,
    /// The cameras of the frames before it, so that what is kept from frame to frame is kept as in a flight: shadow maps would
    /// all be stale after a jump along the path.
    pub lead: Vec<Viewpoint>,
    /// Date and time.
    pub instant: DateTime<Utc>,
}

impl Views {
    /// The views of `scene`, whose ground has its heights in metres at local `(x, z)`.
    ///
    /// # Errors
    /// [`PlanError`]: no path, a time off the path, nothing to see.
    pub fn of(&self, scene: &Scene, ground: &dyn Fn(f64, f64) -> f64) -> Result<Vec<ProfileView>, PlanError> {
        let path = Path::new(&scene.camera.path);
        let found: Vec<(Option<f64>, Pose, LocalTime)> = match self {
            Self::Flight { frames: 0, .. } => return Err(PlanError::Nothing),
            Self::Flight { frames, fps, from, at } => {
                let at = at.unwrap_or(scene.place.time);
                match &path {
                    None if from.is_some() => return Err(PlanError::NoPath(scene.name.clone())),
                    None => vec![(None, scene.camera.start, at); *frames as usize],
                    Some(path) => {
                        let first = from.unwrap_or(path.start());
                        if !(path.start()..=path.end()).contains(&first) {
                            return Err(PlanError::OffPath { seconds: first, start: path.start(), end: path.end() });
                        }
                        let step = match fps {
                            Some(fps) => 1.0 / fps,
                            None => (path.end() - first) / f64::from(frames.saturating_sub(1).max(1)),
                        };
                        let frame = |number: u32| {
                            let seconds = (first + f64::from(number) * step).min(path.end());
                            (Some(seconds), path.at(seconds), at)
                        };
                        (0..*frames).map(frame).collect()
                    }
                }
            }
            Self::Stills { cameras, times } => {
                let times = if times.is_empty() { vec![scene.place.time] } else { times.clone() };
                times.iter().flat_map(|time| cameras.iter().map(|camera| (None, *camera, *time))).collect()
            }
        };
        if found.is_empty() {
            return Err(PlanError::Nothing);
        }
        let view = |(number, (seconds, pose, at)): (usize, (Option<f64>, Pose, LocalTime))| {
            let over_ground = |pose: Pose| {
                let (x, _, z) = pose.position;
                pose.viewpoint(ground(x, z), scene.camera.field_of_view)
            };
            let before = |(path, seconds): (&Path, f64)| {
                let earlier = |number: u32| (seconds - f64::from(number) * LEAD_STEP).max(path.start());
                (1..=LEAD).rev().map(|number| over_ground(path.at(earlier(number)))).collect()
            };
            ProfileView {
                name: format!("{number:04}"),
                seconds,
                pose,
                view: over_ground(pose),
                lead: path.as_ref().zip(seconds).map(before).unwrap_or_default(),
                instant: at.utc(),
            }
        };
        Ok(found.into_iter().enumerate().map(view).collect())
    }

    /// Whether neighbouring views follow each other in time, so that their change says something.
    pub fn is_flight(&self) -> bool {
        matches!(self, Self::Flight { .. })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_of_a_flight_are_reached_in_flight_and_stills_at_once() -> Result<(), Box<dyn std::error::Error>> {
        let text = "(terrain: Flat(), place: (latitude: 47, longitude: 9, time: \"2026-06-21T12:00+02:00\"), camera: (path: [(seconds: \
                    0, position: (0, 10, 0), yaw: 0, pitch: 0), (seconds: 10, position: (600, 10, 0), yaw: 0, pitch: 0)]))";
        let scene = Scene::parse(text, "test.ron".as_ref())?;
        let flight = Views::Flight { frames: 3, fps: None, from: None, at: None };
        let views = flight.of(&scene, &|_, _| 0.0)?;
        let east = |view: &Viewpoint| view.position.x;
        let places: Vec<f64> = views.iter().map(|view| east(&view.view)).collect();
        assert!(places.iter().zip([0.0, 300.0, 600.0]).all(|(place, expected)| (place - expected).abs() < 1e-6));
        // The camera has its speed of the middle of the path when it passes there.
        let lead: Vec<f64> = views[1].lead.iter().map(|view| places[1] - east(view)).collect();
        assert!(lead.len() == 2 && lead[0] > lead[1] && lead[1] > 0.5 && lead[0] < 4.0, "{lead:?}");
        assert!(views[0].lead.iter().all(|view| east(view) == 0.0), "nothing is before the path");
        let still = Views::Stills { cameras: vec![scene.camera.start], times: Vec::new() };
        assert!(still.of(&scene, &|_, _| 0.0)?.iter().all(|view| view.lead.is_empty()));
        Ok(())
    }
}
