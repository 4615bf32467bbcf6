//! Builds a scene in the background.

use std::sync::{
    Mutex, PoisonError,
    mpsc::{Receiver, Sender, channel},
};

use bevy::ecs::component::Component;

use super::{CanopyScene, progress::BuildEvent};
use crate::{
    assets::{
        Stage, StageError,
        background::{self, Background, Wanted},
    },
    progress::Progress,
};

/// A scene that is being built. Dropping it cancels the build without waiting: the build ends after its current plants.
#[derive(Component)]
pub struct Job {
    /// Events that were not read yet. The mutex only makes the receiver `Sync`; nobody locks it.
    events: Mutex<Receiver<BuildEvent>>,
    work: Background<Result<Stage, StageError>>,
}

impl Job {
    /// Starts to build the scene of `request`, for a device that holds at most `most_trees` trees.
    pub fn start(request: &CanopyScene, most_trees: Option<usize>) -> Self {
        let request = request.clone();
        Self::run(move |progress| build(&request, most_trees, progress))
    }

    fn run(work: impl FnOnce(&mut Reporter) -> Result<Stage, StageError> + Send + 'static) -> Self {
        let (sender, events) = channel();
        let work = background::start(move |wanted| work(&mut Reporter { events: sender, wanted }));
        Self { events: Mutex::new(events), work }
    }

    /// The events since the last call.
    pub fn events(&mut self) -> Vec<BuildEvent> {
        self.events.get_mut().unwrap_or_else(PoisonError::into_inner).try_iter().collect()
    }

    /// The result of the build, once; `None` while the build goes on, and after the result was taken. All events of a
    /// finished build can be read.
    ///
    /// # Errors
    /// Those of [`Stage::build`]; [`StageError::Background`] if the build panicked, or if the system cannot create
    /// threads.
    pub fn finished(&self) -> Option<Result<Stage, StageError>> {
        let result = self.work.finished()?;
        Some(result.unwrap_or_else(|error| Err(error.into())))
    }
}

fn build(request: &CanopyScene, most_trees: Option<usize>, progress: &mut Reporter) -> Result<Stage, StageError> {
    Stage::build_within(&request.overrides.applied(request.source.read()?), most_trees, progress)
}

/// Reports the progress of the build to its [`Job`].
struct Reporter<'a> {
    events: Sender<BuildEvent>,
    wanted: &'a Wanted<'a>,
}

impl Reporter<'_> {
    fn report(&self, event: BuildEvent) {
        // The send fails only when the job was dropped: nobody needs the event then.
        let _ = self.events.send(event);
    }
}

impl Progress for Reporter<'_> {
    fn begin(&mut self, what: &str, steps: u64) {
        self.report(BuildEvent::Begin(what.to_owned(), steps));
    }

    fn advance(&mut self, steps: u64) {
        self.report(BuildEvent::Advance(steps));
    }

    fn end(&mut self) {
        self.report(BuildEvent::End);
    }

    fn warn(&mut self, message: &str) {
        self.report(BuildEvent::Warning(message.to_owned()));
    }

    fn note(&mut self, message: &str) {
        self.report(BuildEvent::Note(message.to_owned()));
    }

    fn is_cancelled(&self) -> bool {
        !self.wanted.is_wanted()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{GroundFlat, GrownPlants, Lighting, Quality, ScatteredTrees, Scene, Species};

    /// A scene of many plants.
    fn many() -> CanopyScene {
        let plant = GrownPlants { individuals: 16, triangles: 5000, ..GrownPlants::default() };
        CanopyScene::new(Scene {
            species: vec![Species { lighting: Some(Lighting::Local), ..Species::new("a", plant) }],
            trees: ScatteredTrees { stems_per_hectare: 100.0, ..ScatteredTrees::default() }.into(),
            quality: Quality { cross_resolution: 64, ..Quality::default() },
            ..Scene::new(GroundFlat { size: 100.0 })
        })
    }

    #[test]
    fn a_build_is_cancelled_when_its_job_is_dropped() -> Result<(), Box<dyn std::error::Error>> {
        let (sender, outcome) = channel();
        let job = Job::run(move |progress| {
            sender.send(build(&many(), None, progress).map(drop)).ok();
            Err(StageError::Cancelled)
        });
        let at_plants = |event: &BuildEvent| matches!(event, BuildEvent::Begin(step, _) if step == "Plants");
        let events = job.events.lock().map_err(|_| "a panic")?;
        assert!(events.iter().any(|event| at_plants(&event)), "the build ended before its plants");
        drop(events);
        drop(job);
        let outcome = outcome.recv()?;
        assert!(matches!(outcome, Err(StageError::Cancelled)), "{:?}", outcome.err());
        Ok(())
    }

    #[test]
    fn dropping_a_job_does_not_wait_for_its_work() -> Result<(), Box<dyn std::error::Error>> {
        let (begun, at_work) = channel();
        let (release, released) = channel::<()>();
        let (sender, cancelled) = channel();
        let job = Job::run(move |progress| {
            begun.send(()).ok();
            released.recv().ok();
            sender.send(progress.is_cancelled()).ok();
            Err(StageError::Cancelled)
        });
        at_work.recv()?;
        drop(job);
        // The receiver still exists, so the work still runs.
        release.send(())?;
        assert!(cancelled.recv()?);
        Ok(())
    }

    #[test]
    fn a_panic_becomes_an_error_of_the_build() {
        let mut job = Job::run(|progress| {
            progress.warn("w");
            panic!("index out of bounds")
        });
        let error = loop {
            match job.finished() {
                Some(outcome) => break outcome.err().map(|error| error.to_string()),
                None => std::thread::yield_now(),
            }
        };
        let message = "the scene could not be built: an error in the program: index out of bounds";
        assert_eq!(error.as_deref(), Some(message));
        assert_eq!(job.events(), [BuildEvent::Warning("w".to_owned())]);
        assert!(job.finished().is_none());
    }
}
