//! How the program ends: 0 for success, 1 for an error, 2 for wrong usage, 3 if some of several images failed, 130 and 143 for
//! an interrupt.

use std::io::Write;
use std::process::ExitCode;

use canopy::app::{AppError, Interrupt, interrupt_received};

/// Some of several images failed, the others are finished.
const SOME_FAILED: u8 = 3;

/// The outcome of a command.
pub enum Outcome {
    /// It succeeded.
    Done,
    /// The arguments do not fit together.
    Usage(clap::Error),
    /// The user interrupted it; the text says what was finished.
    Interrupted(String),
    /// Something went wrong.
    Failed(anyhow::Error),
}

impl From<anyhow::Result<()>> for Outcome {
    fn from(result: anyhow::Result<()>) -> Self {
        match result {
            Ok(()) => Self::Done,
            Err(error) => match error.downcast_ref() {
                Some(AppError::Interrupted(what)) => Self::Interrupted(what.clone()),
                _ => Self::Failed(error),
            },
        }
    }
}

/// Prints the error, if any, and returns the exit code.
pub fn finish(outcome: Outcome) -> ExitCode {
    match outcome {
        Outcome::Done => ExitCode::SUCCESS,
        Outcome::Usage(error) => {
            // A closed terminal does not change the outcome.
            let _ = error.print();
            ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2))
        }
        Outcome::Interrupted(what) => {
            let interrupt = interrupt_received().unwrap_or(Interrupt::CtrlC);
            let word = match interrupt {
                Interrupt::CtrlC => "interrupted",
                Interrupt::Terminate => "terminated",
            };
            let _ = writeln!(std::io::stderr(), "{word}: {what}");
            ExitCode::from(interrupt.exit_code())
        }
        Outcome::Failed(error) => {
            let _ = writeln!(std::io::stderr(), "error: {error}");
            match error.downcast_ref() {
                Some(AppError::SomeFailed { .. }) => ExitCode::from(SOME_FAILED),
                _ => ExitCode::FAILURE,
            }
        }
    }
}

/// Prints lines on the standard output. A reader that closes early (`canopy info oak.glb | head -1`) is not an error.
///
/// # Errors
/// The output cannot be written for another reason, such as a full disk.
pub fn print_lines<T: std::fmt::Display>(lines: impl IntoIterator<Item = T>) -> anyhow::Result<()> {
    let mut output = std::io::stdout().lock();
    for line in lines {
        match writeln!(output, "{line}") {
            Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => return Ok(()),
            result => result?,
        }
    }
    match output.flush() {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}
