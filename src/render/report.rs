//! What the last frame ran and what it skipped, and why: for the overlay and for `--explain`.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use bevy::ecs::resource::Resource;

/// What became of a pass in the last frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PassOutcome {
    /// It ran; the text says on what.
    Ran(String),
    /// It was not run; the text says why.
    Skipped(String),
}

/// Outcomes by pass, shared between the main and the render world.
#[derive(Resource, Clone, Debug, Default)]
pub struct FrameReport(Arc<Mutex<BTreeMap<String, PassOutcome>>>);

impl FrameReport {
    /// Records that `pass` ran.
    pub fn ran(&self, pass: impl Into<String>, on: impl Into<String>) {
        self.record(pass.into(), PassOutcome::Ran(on.into()));
    }

    /// Records that `pass` was skipped.
    pub fn skipped(&self, pass: impl Into<String>, why: impl Into<String>) {
        self.record(pass.into(), PassOutcome::Skipped(why.into()));
    }

    fn record(&self, pass: String, outcome: PassOutcome) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(pass, outcome);
    }

    /// All outcomes, by the passes' names.
    pub fn outcomes(&self) -> Vec<(String, PassOutcome)> {
        let outcomes = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        outcomes.iter().map(|(pass, outcome)| (pass.clone(), outcome.clone())).collect()
    }
}
