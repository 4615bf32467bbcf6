//! Where a profile looks from, and when.

use chrono::{DateTime, Utc};

use crate::{
    app::PlanError,
    scene::{LocalTime, Path, Pose, Scene, Viewpoint},
};

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
                match path {
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
            let (x, _, z) = pose.position;
            ProfileView {
                name: format!("{number:04}"),
                seconds,
                pose,
                view: pose.viewpoint(ground(x, z), scene.camera.field_of_view),
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
