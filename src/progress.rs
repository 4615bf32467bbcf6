//! Progress reports of long tasks.

/// Receives the progress of a long task. One stage at a time: a new stage ends the previous one.
pub trait Progress: Send {
    /// A stage of `steps` equal steps begins (0 if their number is unknown). `what` is its name for the user.
    fn begin(&mut self, what: &str, steps: u64);

    /// `steps` further steps of the stage are done.
    fn advance(&mut self, steps: u64);

    /// The stage is over.
    fn end(&mut self);

    /// A warning for the user that does not stop the work: a missing texture, holes in a terrain.
    fn warn(&mut self, message: &str);

    /// A note for interested users: what was loaded, from which cache, how long it took.
    fn note(&mut self, message: &str);

    /// Whether the result is no longer needed. Long work checks this regularly, and stops.
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// Ignores all reports.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&mut self, _what: &str, _steps: u64) {}

    fn advance(&mut self, _steps: u64) {}

    fn end(&mut self) {}

    fn warn(&mut self, _message: &str) {}

    fn note(&mut self, _message: &str) {}
}
