//! The state of a flight and what changes it: commands, held keys, time.

use std::sync::Arc;

use chrono::TimeDelta;

use super::{
    clock::SceneClock,
    controls::Command,
    motion::{Controls, Pilot},
    tour::Tour,
};
use crate::{
    app::{AppError, FlyOptions, View},
    assets::Stage,
    scene::{LocalTime, Pose, Viewpoint},
};

use bevy::ecs::resource::Resource;

/// Seconds for which a message stays.
const MESSAGE_SECONDS: f64 = 6.0;

/// A flight through a stage.
#[derive(Resource)]
pub struct Session {
    /// The scene of the flight.
    pub stage: Arc<Stage>,
    /// The camera.
    pub pilot: Pilot,
    /// The scripted flight, if the scene has a path.
    pub tour: Option<Tour>,
    /// Whether the camera follows the path.
    pub touring: bool,
    /// The clock.
    pub clock: SceneClock,
    /// Whether clock and scripted flight are paused.
    pub paused: bool,
    /// Whether the camera may go below the ground.
    pub underground: bool,
    /// Whether the small overlay is shown.
    pub overlay: bool,
    /// Whether the help is shown.
    pub help: bool,
    /// Whether this frame is saved as an image, so no overlay may be drawn.
    pub capturing: bool,
    message: Option<(String, f64)>,
    start: Start,
}

/// Position and time at the start of a flight.
#[derive(Clone, Debug)]
struct Start {
    pose: Pose,
    tour: Option<Tour>,
    touring: bool,
    time: LocalTime,
}

impl Session {
    /// The flight through `stage` that `options` ask for.
    ///
    /// # Errors
    /// [`AppError::Plan`] for a start on a path that the scene does not have.
    pub fn new(stage: Arc<Stage>, options: &FlyOptions) -> Result<Self, AppError> {
        let tour = Tour::new(&stage.scene, options.view)?;
        let touring = matches!(options.view, View::Along(_));
        let pose = match options.view {
            View::Pose(pose) => pose,
            View::Scene | View::Along(_) => stage.scene.camera.start,
        };
        let time = options.at.unwrap_or(stage.scene.place.time);
        let start = Start { pose, tour, touring, time };
        let mut session = Self {
            pilot: Pilot::at(&viewpoint(&stage, pose)),
            tour: start.tour.clone(),
            touring,
            clock: SceneClock::new(time, options.clock),
            paused: false,
            underground: options.underground,
            overlay: true,
            help: false,
            capturing: false,
            message: None,
            start,
            stage,
        };
        session.fly(&Controls::default(), 0.0);
        session.show_message("press H for all keys".to_owned());
        Ok(session)
    }

    /// Continues in `stage`, the changed scene: the camera and the clock stay, and so does the time on a path that still
    /// has it. [`Command::Home`] leads to the start of the new scene.
    pub fn enter(&mut self, stage: Arc<Stage>) {
        let tour = |view| Tour::new(&stage.scene, view).ok().flatten();
        let along = self.tour.as_ref().and_then(|old| tour(View::Along(old.seconds())));
        let fresh = tour(View::Scene);
        self.tour = along.or_else(|| fresh.clone());
        self.touring &= self.tour.is_some();
        let pose = stage.scene.camera.start;
        self.start = Start { pose, tour: fresh, touring: false, time: stage.scene.place.time };
        self.stage = stage;
        self.show_message("the scene was loaded again".to_owned());
    }

    /// The camera, ready to draw with.
    pub fn view(&self) -> Viewpoint {
        self.pilot.viewpoint(self.stage.scene.camera.field_of_view.to_radians())
    }

    /// Metres of the camera above the ground below it.
    pub fn above_ground(&self) -> f64 {
        self.pilot.position.y - self.stage.terrain.height(self.pilot.position.x, self.pilot.position.z)
    }

    /// Shows a message for some seconds.
    pub fn show_message(&mut self, message: String) {
        self.message = Some((message, MESSAGE_SECONDS));
    }

    /// The message to show, if any.
    pub fn message(&self) -> Option<&str> {
        self.message.as_ref().map(|(message, _)| message.as_str())
    }

    /// Flies and lets time pass for `seconds`.
    pub fn fly(&mut self, controls: &Controls, seconds: f64) {
        if let Some((_, left)) = &mut self.message {
            *left -= seconds;
            if *left <= 0.0 {
                self.message = None;
            }
        }
        let elapsed = if self.paused { 0.0 } else { seconds };
        self.clock.advance(elapsed);
        if self.touring && controls.travels() {
            self.touring = false;
        }
        match self.tour.as_mut().filter(|_| self.touring) {
            Some(tour) => {
                tour.advance(elapsed);
                let pose = tour.pose();
                self.pilot.rest_at(&viewpoint(&self.stage, pose));
                self.pilot.fly(&Controls { notches: controls.notches, ..Controls::default() }, seconds);
            }
            None => self.pilot.fly(controls, seconds),
        }
        if !self.underground {
            self.pilot.stay_above(self.stage.terrain.height(self.pilot.position.x, self.pilot.position.z));
        }
    }

    /// Carries out a command as far as it concerns the flight; the window does the rest.
    pub fn carry_out(&mut self, command: Command) {
        match command {
            Command::Leave
            | Command::Settings
            | Command::Reload
            | Command::Tint
            | Command::Year(_)
            | Command::Variant(_) => {}
            Command::SaveImage => self.capturing = true,
            Command::Tour if self.tour.is_none() => {
                self.show_message("this scene has no camera path; add `camera: (path: [...])` to its file".to_owned());
            }
            Command::Tour => self.touring = !self.touring,
            Command::Pause => self.paused = !self.paused,
            Command::Underground => self.underground = !self.underground,
            Command::Help => self.help = !self.help,
            Command::Overlay => self.overlay = !self.overlay,
            Command::Home => {
                let start = self.start.clone();
                self.pilot.rest_at(&viewpoint(&self.stage, start.pose));
                (self.tour, self.touring) = (start.tour, start.touring);
                self.clock.set(start.time);
            }
            Command::Minutes(minutes) => self.clock.step(TimeDelta::minutes(minutes)),
            Command::Days(days) => self.clock.step_days(days),
            Command::Months(months) => self.clock.step_months(months),
            Command::Faster => self.clock.faster(),
            Command::Slower => self.clock.slower(),
        }
    }
}

fn viewpoint(stage: &Stage, pose: Pose) -> Viewpoint {
    let (x, _, z) = pose.position;
    pose.viewpoint(stage.terrain.height(x, z), stage.scene.camera.field_of_view)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{
        progress::Silent,
        scene::{Overrides, Scene},
    };

    const SCENE: &str = "(
        terrain: Noise(size: 400, amplitude: 40, seed: 3),
        place: (latitude: 47.5, longitude: 9.2, time: \"2026-06-21T15:30+02:00\"),
        camera: (start: (position: (5, 30, 7), yaw: 90), path: [
            (seconds: 0, position: (-50, 20, 0), yaw: 0, pitch: 0),
            (seconds: 8, position: (50, 20, 0), yaw: 0, pitch: 0),
        ]),
    )";

    fn session(view: View, clock: f64) -> Result<Session, Box<dyn std::error::Error>> {
        let scene = Scene::parse(SCENE, "session.ron".as_ref())?;
        let options = FlyOptions {
            scene: scene.clone().into(),
            size: (64, 36),
            at: None,
            view,
            clock,
            underground: false,
            overrides: Overrides::default(),
            adapter: None,
            quiet: true,
            explain: false,
        };
        let stage = Arc::new(Stage::build(&scene, &mut Silent)?);
        Ok(Session::new(stage, &options)?)
    }

    fn down() -> Controls {
        Controls { travel: DVec3::NEG_Y, hurry: true, ..Controls::default() }
    }

    #[test]
    fn the_ground_holds_unless_asked() -> Result<(), Box<dyn std::error::Error>> {
        let mut session = session(View::Scene, 0.0)?;
        assert!((session.above_ground() - 30.0).abs() < 1e-9);
        for _ in 0..10 {
            session.fly(&down(), 0.5);
        }
        assert!((session.above_ground() - super::super::motion::EYE_HEIGHT).abs() < 1e-9);
        session.carry_out(Command::Underground);
        session.fly(&down(), 0.5);
        assert!(session.above_ground() < 0.0);
        session.carry_out(Command::Underground);
        session.fly(&Controls::default(), 0.01);
        assert!(session.above_ground() >= super::super::motion::EYE_HEIGHT - 1e-9);
        Ok(())
    }

    #[test]
    fn a_tour_pauses_and_any_travel_leaves_it() -> Result<(), Box<dyn std::error::Error>> {
        let mut session = session(View::Scene, 60.0)?;
        session.carry_out(Command::Tour);
        session.fly(&Controls::default(), 0.5);
        let there = session.pilot.position;
        assert!(session.touring && there.x > -50.0 && (session.above_ground() - 20.0).abs() < 1e-9);
        session.carry_out(Command::Pause);
        let time = session.clock.now();
        session.fly(&Controls::default(), 0.5);
        assert_eq!((session.pilot.position, session.clock.now()), (there, time));
        session.fly(&down(), 0.1);
        assert!(!session.touring && session.pilot.position.y < there.y);
        session.carry_out(Command::Home);
        assert_eq!((session.pilot.position.x, session.pilot.position.z), (5.0, 7.0));
        assert!((session.pilot.bearing() - 90.0).abs() < 1e-9);
        Ok(())
    }

    #[test]
    fn a_changed_scene_leaves_camera_and_clock() -> Result<(), Box<dyn std::error::Error>> {
        let mut session = session(View::Along(4.0), 60.0)?;
        session.fly(&Controls::default(), 1.0);
        let (there, time) = (session.pilot.position, session.clock.now());
        let mut scene = Scene::parse(SCENE, "session.ron".as_ref())?;
        scene.camera.start.position = (1.0, 30.0, 2.0);
        session.enter(Arc::new(Stage::build(&scene, &mut Silent)?));
        assert_eq!((session.pilot.position, session.clock.now()), (there, time));
        assert!(session.touring && session.tour.as_ref().is_some_and(|tour| tour.seconds() == 5.0));
        scene.camera.path.clear();
        session.enter(Arc::new(Stage::build(&scene, &mut Silent)?));
        session.fly(&Controls::default(), 1.0);
        assert!(!session.touring && session.tour.is_none() && session.pilot.position.abs_diff_eq(there, 1e-6));
        session.carry_out(Command::Home);
        assert_eq!((session.pilot.position.x, session.pilot.position.z), (1.0, 2.0));
        Ok(())
    }

    #[test]
    fn a_start_along_the_path_flies_at_once() -> Result<(), Box<dyn std::error::Error>> {
        let mut session = session(View::Along(4.0), 0.0)?;
        assert!(session.touring && session.pilot.position.x.abs() < 1e-6);
        session.fly(&Controls::default(), 1.0);
        assert!(session.pilot.position.x > 5.0);
        session.carry_out(Command::Home);
        session.fly(&Controls::default(), 0.0);
        assert!(session.touring && session.pilot.position.x.abs() < 1e-6);
        Ok(())
    }
}
