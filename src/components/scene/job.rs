//! A scene built beside the program, on threads of its own.
//!
//! Not on Bevy's task pools, whose threads a bake would hold for seconds, and not in rayon's global pool, in which the
//! frames' own work (the sky's tables, the tiles) would queue up behind it.

use std::{
    any::Any,
    mem,
    sync::{Arc, Mutex, PoisonError},
    thread::{self, JoinHandle},
};

use bevy::ecs::component::Component;

use super::{CanopyScene, progress::Said};
use crate::{
    assets::{Stage, StageError, threads::spare_cores},
    progress::Progress,
};

/// What was said and nobody has heard yet.
type Line = Arc<Mutex<Vec<Said>>>;

/// A scene that is being built. Dropped, it is given up: the threads end after the plants that they are at, and nobody
/// waits for them.
#[derive(Component)]
pub struct Job {
    line: Line,
    /// Until its end was taken.
    thread: Option<JoinHandle<Result<Stage, StageError>>>,
}

impl Job {
    /// Begins.
    ///
    /// # Errors
    /// [`StageError::Background`] where the system has no thread for it.
    pub fn start(request: &CanopyScene) -> Result<Self, StageError> {
        let line = Line::default();
        let mut speaker = Speaker(line.clone());
        let CanopyScene { source, overrides } = request.clone();
        let work = move || {
            let name = |index| format!("canopy bake {index}");
            let pool = rayon::ThreadPoolBuilder::new().num_threads(spare_cores()).thread_name(name).build();
            let pool = pool.map_err(|error| StageError::Background(format!("no threads for bakes: {error}")))?;
            pool.install(|| Stage::build(&overrides.applied(source.read()?), &mut speaker))
        };
        let thread = thread::Builder::new().name("canopy scene".to_owned()).spawn(work);
        let thread = thread.map_err(|error| StageError::Background(format!("no thread: {error}")))?;
        Ok(Self { line, thread: Some(thread) })
    }

    /// Whether [`finish`](Self::finish) has not to wait.
    pub fn is_finished(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// What was said since the last call.
    pub fn said(&self) -> Vec<Said> {
        mem::take(&mut *self.line.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// What came of it.
    ///
    /// # Errors
    /// Those of [`Stage::build`]; [`StageError::Background`] where the thread broke off.
    pub fn finish(&mut self) -> Result<Stage, StageError> {
        let Some(thread) = self.thread.take() else { return Err(StageError::Cancelled) };
        thread.join().unwrap_or_else(|panic| Err(StageError::Background(broken_off(&*panic))))
    }
}

fn broken_off(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    format!("an error in the program: {}", text.unwrap_or("(see above)"))
}

/// The builder's end of the line.
struct Speaker(Line);

impl Speaker {
    fn say(&self, said: Said) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(said);
    }
}

impl Progress for Speaker {
    fn begin(&mut self, what: &str, steps: u64) {
        self.say(Said::Begin(what.to_owned(), steps));
    }

    fn advance(&mut self, steps: u64) {
        self.say(Said::Advance(steps));
    }

    fn end(&mut self) {
        self.say(Said::End);
    }

    fn warn(&mut self, message: &str) {
        self.say(Said::Warning(message.to_owned()));
    }

    fn note(&mut self, message: &str) {
        self.say(Said::Note(message.to_owned()));
    }

    /// Nobody is at the other end any more.
    fn is_cancelled(&self) -> bool {
        Arc::strong_count(&self.0) == 1
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
    fn a_scene_is_given_up_when_nobody_listens() -> Result<(), Box<dyn std::error::Error>> {
        let Job { line, thread: Some(thread) } = Job::start(&many())? else {
            return Err("no thread".into());
        };
        let at_plants = |line: &Line| {
            let said = line.lock().unwrap_or_else(PoisonError::into_inner);
            said.iter().any(|said| matches!(said, Said::Begin(step, _) if step == "Plants"))
        };
        while !at_plants(&line) && !thread.is_finished() {
            thread::yield_now();
        }
        drop(line);
        let outcome = thread.join().map_err(|_| "a panic")?;
        assert!(matches!(outcome, Err(StageError::Cancelled)), "{:?}", outcome.err());
        Ok(())
    }

    #[test]
    fn a_job_that_is_dropped_waits_for_nobody() -> Result<(), Box<dyn std::error::Error>> {
        let job = Job::start(&many())?;
        // While the line is held its thread cannot end, for it has something to say first.
        let line = job.line.clone();
        let held = line.lock().unwrap_or_else(PoisonError::into_inner);
        drop(job);
        assert_eq!(Arc::strong_count(&line), 2, "the thread is still at it");
        drop(held);
        Ok(())
    }

    #[test]
    fn what_broke_off_says_why() {
        assert_eq!(broken_off(&"index out of bounds"), "an error in the program: index out of bounds");
        assert_eq!(broken_off(&String::from("x")), "an error in the program: x");
        assert_eq!(broken_off(&1), "an error in the program: (see above)");
    }
}
