//! Builds a scene in the background, on threads of its own.
//!
//! Bevy's task pools are not used: a bake would block their threads for seconds. Neither is rayon's global pool: the
//! frames' own work (the sky's tables, the tiles) would queue up behind the bake.

use std::{
    any::Any,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, Sender, channel},
    },
    thread::{self, JoinHandle},
};

use bevy::ecs::component::Component;

use super::{CanopyScene, progress::BuildEvent};
use crate::{
    assets::{Stage, StageError, threads::spare_cores},
    progress::Progress,
};

/// A scene that is being built. Dropping it cancels the build without waiting: the threads end after their current
/// plants.
#[derive(Component)]
pub struct Job {
    /// Events that were not read yet. The mutex only makes the receiver `Sync`; nobody locks it.
    events: Mutex<Receiver<BuildEvent>>,
    /// Set when the job is dropped.
    cancelled: Arc<AtomicBool>,
    /// `None` once its result was taken.
    thread: Option<JoinHandle<Result<Stage, StageError>>>,
}

impl Job {
    /// Starts to build the scene of `request`, for a device that holds at most `most_trees` trees.
    ///
    /// # Errors
    /// [`StageError::Background`] if the system cannot create a thread.
    pub fn start(request: &CanopyScene, most_trees: Option<usize>) -> Result<Self, StageError> {
        let (sender, events) = channel();
        let cancelled = Arc::<AtomicBool>::default();
        let mut reporter = Reporter { events: sender, cancelled: cancelled.clone() };
        let CanopyScene { source, overrides } = request.clone();
        let work = move || {
            let name = |index| format!("canopy bake {index}");
            let pool = rayon::ThreadPoolBuilder::new().num_threads(spare_cores()).thread_name(name).build();
            let pool =
                pool.map_err(|error| StageError::Background(format!("cannot create threads for bakes: {error}")))?;
            pool.install(|| Stage::build_within(&overrides.applied(source.read()?), most_trees, &mut reporter))
        };
        let thread = thread::Builder::new().name("canopy scene".to_owned()).spawn(work);
        let thread = thread.map_err(|error| StageError::Background(format!("cannot create a thread: {error}")))?;
        Ok(Self { events: Mutex::new(events), cancelled, thread: Some(thread) })
    }

    /// Whether [`finish`](Self::finish) returns at once.
    pub fn is_finished(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// The events since the last call.
    pub fn events(&mut self) -> Vec<BuildEvent> {
        self.events.get_mut().unwrap_or_else(PoisonError::into_inner).try_iter().collect()
    }

    /// The result of the build. Waits for the thread.
    ///
    /// # Errors
    /// Those of [`Stage::build`]; [`StageError::Background`] if the thread panicked; [`StageError::Cancelled`] if the
    /// result was taken before.
    pub fn finish(&mut self) -> Result<Stage, StageError> {
        let Some(thread) = self.thread.take() else { return Err(StageError::Cancelled) };
        thread.join().unwrap_or_else(|panic| Err(StageError::Background(panic_message(&*panic))))
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }
}

fn panic_message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    format!("an error in the program: {}", text.unwrap_or("(see above)"))
}

/// Reports the progress of the build to its [`Job`].
struct Reporter {
    events: Sender<BuildEvent>,
    cancelled: Arc<AtomicBool>,
}

impl Reporter {
    fn report(&self, event: BuildEvent) {
        // The send fails only when the job was dropped: nobody needs the event then.
        let _ = self.events.send(event);
    }
}

impl Progress for Reporter {
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
        self.cancelled.load(Ordering::Relaxed)
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
        let mut job = Job::start(&many(), None)?;
        let thread = job.thread.take().ok_or("no thread")?;
        let at_plants = |event: &BuildEvent| matches!(event, BuildEvent::Begin(step, _) if step == "Plants");
        while !job.events().iter().any(at_plants) && !thread.is_finished() {
            thread::yield_now();
        }
        drop(job);
        let outcome = thread.join().map_err(|_| "a panic")?;
        assert!(matches!(outcome, Err(StageError::Cancelled)), "{:?}", outcome.err());
        Ok(())
    }

    #[test]
    fn dropping_a_job_does_not_wait_for_its_thread() -> Result<(), Box<dyn std::error::Error>> {
        let (release, released) = channel::<()>();
        let thread = thread::spawn(move || {
            released.recv().ok();
            Err(StageError::Cancelled)
        });
        let (_, events) = channel();
        let cancelled = Arc::<AtomicBool>::default();
        drop(Job { events: Mutex::new(events), cancelled: cancelled.clone(), thread: Some(thread) });
        assert!(cancelled.load(Ordering::Relaxed));
        // The receiver still exists, so the thread still runs.
        release.send(())?;
        Ok(())
    }

    #[test]
    fn a_panic_becomes_a_message() {
        assert_eq!(panic_message(&"index out of bounds"), "an error in the program: index out of bounds");
        assert_eq!(panic_message(&String::from("x")), "an error in the program: x");
        assert_eq!(panic_message(&1), "an error in the program: (see above)");
    }
}
