//! Which passes the last frame ran or skipped, and why: for the overlay and for `--explain`.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use bevy::ecs::{resource::Resource, system::Res};

/// The outcome of a pass in the last frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PassOutcome {
    /// It ran; the text says on what.
    Ran(String),
    /// It was not run; the text says why.
    Skipped(String),
}

type Outcomes = BTreeMap<String, PassOutcome>;

/// The current frame, and the last complete one.
#[derive(Debug, Default)]
struct Pages {
    open: Outcomes,
    last: Outcomes,
}

/// Outcomes by pass, shared between the main and the render world.
#[derive(Resource, Clone, Debug, Default)]
pub struct FrameReport(Arc<Mutex<Pages>>);

impl FrameReport {
    /// Records that `pass` ran.
    pub fn ran(&self, pass: impl Into<String>, on: impl Into<String>) {
        self.record(pass, PassOutcome::Ran(on.into()));
    }

    /// Records that `pass` was skipped.
    pub fn skipped(&self, pass: impl Into<String>, why: impl Into<String>) {
        self.record(pass, PassOutcome::Skipped(why.into()));
    }

    /// Records what became of `pass`.
    pub fn record(&self, pass: impl Into<String>, outcome: PassOutcome) {
        self.pages().open.insert(pass.into(), outcome);
    }

    /// Replaces what became of `pass` in the last complete frame, because the device has told more of it.
    pub fn amend(&self, pass: impl Into<String>, outcome: PassOutcome) {
        self.pages().last.insert(pass.into(), outcome);
    }

    /// All outcomes of the last complete frame, by pass name.
    pub fn outcomes(&self) -> Vec<(String, PassOutcome)> {
        self.pages().last.iter().map(|(pass, outcome)| (pass.clone(), outcome.clone())).collect()
    }

    /// Ends a frame: [`outcomes`](Self::outcomes) returns what was recorded.
    fn turn(&self) {
        let mut pages = self.pages();
        pages.last = std::mem::take(&mut pages.open);
    }

    fn pages(&self) -> MutexGuard<'_, Pages> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Ends the report of the frame.
pub fn finish_report(report: Res<FrameReport>) {
    report.turn();
}
