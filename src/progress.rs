//! How far a long task has come: told to whoever waits for it.

/// Hears how far a long task has come. One stage at a time: a new one ends the one before.
pub trait Progress: Send {
    /// A stage of `steps` equal steps begins (0 where their number is unknown), called `what` for the user.
    fn begin(&mut self, what: &str, steps: u64);

    /// `steps` further steps of the stage are done.
    fn advance(&mut self, steps: u64);

    /// The stage is over.
    fn end(&mut self);

    /// Something that the user ought to know though the work goes on: a missing texture, holes in a terrain.
    fn warn(&mut self, message: &str);

    /// Something worth a line for who wants to know: what was loaded, from which cache, how long it took.
    fn note(&mut self, message: &str);

    /// Whether nobody waits for the result any more. Work that takes long looks now and then, and gives up.
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// Hears nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&mut self, _what: &str, _steps: u64) {}

    fn advance(&mut self, _steps: u64) {}

    fn end(&mut self) {}

    fn warn(&mut self, _message: &str) {}

    fn note(&mut self, _message: &str) {}
}
