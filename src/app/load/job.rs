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

use super::{LoadScene, progress::Said};
use crate::{
    app::{error::AppError, stage::Stage, threads::spare_cores},
    scene::Progress,
};

/// What was said and nobody has heard yet.
type Line = Arc<Mutex<Vec<Said>>>;

/// A scene that is being built. Dropped, it is given up: the threads end after the plants that they are at, and nobody
/// waits for them.
pub struct Job {
    /// What is built.
    pub request: LoadScene,
    line: Line,
    thread: JoinHandle<Result<Stage, AppError>>,
}

impl Job {
    /// Begins.
    ///
    /// # Errors
    /// [`AppError::Background`] where the system has no thread for it.
    pub fn start(request: LoadScene) -> Result<Self, AppError> {
        let line = Line::default();
        let mut speaker = Speaker(line.clone());
        let LoadScene { path, overrides } = request.clone();
        let work = move || {
            let name = |index| format!("canopy bake {index}");
            let pool = rayon::ThreadPoolBuilder::new().num_threads(spare_cores()).thread_name(name).build();
            let pool = pool.map_err(|error| AppError::Background(format!("no threads for bakes: {error}")))?;
            pool.install(|| Stage::build(&path, &overrides, &mut speaker))
        };
        let thread = thread::Builder::new().name("canopy scene".to_owned()).spawn(work);
        let thread = thread.map_err(|error| AppError::Background(format!("no thread: {error}")))?;
        Ok(Self { request, line, thread })
    }

    /// Whether [`finish`](Self::finish) has not to wait.
    pub fn is_finished(&self) -> bool {
        self.thread.is_finished()
    }

    /// What was said since the last call.
    pub fn said(&self) -> Vec<Said> {
        mem::take(&mut *self.line.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// What came of it.
    ///
    /// # Errors
    /// Those of [`Stage::build`]; [`AppError::Background`] where the thread broke off.
    pub fn finish(self) -> Result<Stage, AppError> {
        self.thread.join().unwrap_or_else(|panic| Err(AppError::Background(broken_off(&*panic))))
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
    use std::path::PathBuf;

    use super::*;

    /// A scene of many plants.
    fn many(folder: &tempfile::TempDir) -> std::io::Result<PathBuf> {
        let path = folder.path().join("many.ron");
        let species =
            r#"(name: "a", lighting: Local, plant: Grown(form: Broadleaf, individuals: 16, triangles: 5000))"#;
        let place = "place: (latitude: 48, longitude: 9), quality: (cross_resolution: 64)";
        let trees = "trees: Scattered(stems_per_hectare: 100)";
        std::fs::write(&path, format!("(terrain: Flat(size: 100), species: [{species}], {trees}, {place})"))?;
        Ok(path)
    }

    #[test]
    fn a_scene_is_given_up_when_nobody_listens() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let Job { line, thread, .. } = Job::start(LoadScene::new(many(&folder)?))?;
        let at_plants = |line: &Line| {
            let said = line.lock().unwrap_or_else(PoisonError::into_inner);
            said.iter().any(|said| matches!(said, Said::Begin(step, _) if step == "Plants"))
        };
        while !at_plants(&line) && !thread.is_finished() {
            thread::yield_now();
        }
        drop(line);
        let outcome = thread.join().map_err(|_| "a panic")?;
        assert!(matches!(outcome, Err(AppError::Cancelled)), "{:?}", outcome.err());
        Ok(())
    }

    #[test]
    fn a_job_that_is_dropped_waits_for_nobody() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let job = Job::start(LoadScene::new(many(&folder)?))?;
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
