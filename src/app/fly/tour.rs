//! The scripted flight: the scene's path, in a loop.

use crate::{
    app::{PlanError, View},
    scene::{Path, Pose, Scene},
};

/// A position on the scene's path that moves with time.
#[derive(Clone, Debug, PartialEq)]
pub struct Tour {
    path: Path,
    seconds: f64,
}

impl Tour {
    /// The tour of `scene`, starting where `view` says; `None` for a scene without a path.
    ///
    /// # Errors
    /// [`PlanError::NoPath`] and [`PlanError::OffPath`] for a [`View::Along`] that the scene's path does not have.
    pub fn new(scene: &Scene, view: View) -> Result<Option<Self>, PlanError> {
        let path = Path::new(&scene.camera.path);
        let View::Along(seconds) = view else {
            return Ok(path.map(|path| Self { seconds: path.start(), path }));
        };
        let path = path.ok_or_else(|| PlanError::NoPath(scene.name.clone()))?;
        if !(path.start()..=path.end()).contains(&seconds) {
            return Err(PlanError::OffPath { seconds, start: path.start(), end: path.end() });
        }
        Ok(Some(Self { path, seconds }))
    }

    /// Flies on for `seconds`; after the path's end it starts again.
    pub fn advance(&mut self, seconds: f64) {
        let (start, length) = (self.path.start(), self.path.end() - self.path.start());
        let next = self.seconds + seconds;
        if length > 0.0 && next.is_finite() {
            self.seconds = if next > self.path.end() { start + (next - start).rem_euclid(length) } else { next };
        }
    }

    /// Time on the path in seconds.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// The camera's pose now.
    pub fn pose(&self) -> Pose {
        self.path.at(self.seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(path: &str) -> Result<Scene, crate::scene::SceneError> {
        let text = format!("(terrain: Flat(size: 100), place: (latitude: 47, longitude: 9), camera: (path: [{path}]))");
        Scene::parse(&text, "tour.ron".as_ref())
    }

    const KEYS: &str = "(seconds: 2, position: (0, 5, 0), yaw: 0, pitch: 0), \
                        (seconds: 12, position: (50, 5, 0), yaw: 90, pitch: 0)";

    #[test]
    fn begins_again_behind_the_end() -> Result<(), Box<dyn std::error::Error>> {
        let mut tour = Tour::new(&scene(KEYS)?, View::Scene)?.ok_or("no tour")?;
        assert_eq!(tour.pose().position.0, 0.0);
        tour.advance(10.0);
        assert_eq!((tour.seconds(), tour.pose().position.0), (12.0, 50.0));
        tour.advance(3.0);
        assert!((tour.seconds() - 5.0).abs() < 1e-12);
        tour.advance(f64::NAN);
        assert!((tour.seconds() - 5.0).abs() < 1e-12);
        Ok(())
    }

    #[test]
    fn a_start_must_lie_on_the_path() -> Result<(), Box<dyn std::error::Error>> {
        let with_path = scene(KEYS)?;
        let along = Tour::new(&with_path, View::Along(4.0))?.ok_or("no tour")?;
        assert_eq!(along.seconds(), 4.0);
        assert!(matches!(Tour::new(&with_path, View::Along(1.0)), Err(PlanError::OffPath { .. })));
        let without = scene("")?;
        assert_eq!(Tour::new(&without, View::Scene)?, None);
        assert!(matches!(Tour::new(&without, View::Along(1.0)), Err(PlanError::NoPath(_))));
        Ok(())
    }
}
