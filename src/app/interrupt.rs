//! Interrupts: Ctrl-C and the request to terminate.
//!
//! The first signal only sets a flag. Long work asks for it ([`received`]) and stops between two images or samples, so
//! that it can save its state and say how to go on. A second signal ends the program at once; since files appear whole
//! or not at all, that loses only unfinished work.

use std::{
    io,
    sync::{
        Arc, OnceLock,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
};

use signal_hook::{
    consts::{SIGINT, SIGTERM},
    flag,
};

use super::error::AppError;
use crate::assets::StageError;

/// A signal that asks the program to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interrupt {
    /// Ctrl-C in the terminal: SIGINT.
    CtrlC,
    /// The system or another program: SIGTERM.
    Terminate,
}

impl Interrupt {
    const ALL: [Self; 2] = [Self::CtrlC, Self::Terminate];

    fn signal(self) -> i32 {
        match self {
            Self::CtrlC => SIGINT,
            Self::Terminate => SIGTERM,
        }
    }

    /// The exit code of a program that was stopped by this signal: 130 or 143, 128 more than the signal's number.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::CtrlC => 130,
            Self::Terminate => 143,
        }
    }
}

/// Number of the signal that arrived, 0 before it. Set by [`listen`].
static RECEIVED: OnceLock<Arc<AtomicUsize>> = OnceLock::new();

/// Listens to interrupts from now on, instead of being ended by them. A second interrupt ends the program at once.
///
/// # Errors
/// Those of the system, which allows programs their own handlers of these signals.
pub fn listen() -> io::Result<()> {
    let received = Arc::<AtomicUsize>::default();
    if RECEIVED.set(received.clone()).is_err() {
        return Ok(());
    }
    let stopping = Arc::<AtomicBool>::default();
    for interrupt in Interrupt::ALL {
        // In this order: the first signal must not see its own flag.
        flag::register_conditional_shutdown(
            interrupt.signal(),
            i32::from(interrupt.exit_code()),
            Arc::clone(&stopping),
        )?;
        flag::register(interrupt.signal(), Arc::clone(&stopping))?;
        flag::register_usize(interrupt.signal(), Arc::clone(&received), usize::from(interrupt.exit_code()))?;
    }
    Ok(())
}

/// The interrupt that has arrived since [`listen`], if any.
pub fn received() -> Option<Interrupt> {
    let code = RECEIVED.get()?.load(Ordering::Relaxed);
    Interrupt::ALL.into_iter().find(|interrupt| usize::from(interrupt.exit_code()) == code)
}

/// The error of a scene's build: a cancelled build was interrupted by the user, before there was any result.
pub(super) fn building(error: StageError) -> AppError {
    match error {
        StageError::Cancelled => AppError::Interrupted(
            "the scene was still being built, nothing has been rendered; run the command again (baked plants are kept)"
                .to_owned(),
        ),
        error => error.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exit_codes_are_those_of_a_shell() {
        for interrupt in Interrupt::ALL {
            assert_eq!(i32::from(interrupt.exit_code()), 128 + interrupt.signal());
        }
    }

    #[test]
    fn a_cancelled_build_is_an_interrupt_and_any_other_error_is_itself() {
        assert!(matches!(building(StageError::Cancelled), AppError::Interrupted(_)));
        let other = building(StageError::Background("why".to_owned()));
        assert!(matches!(other, AppError::Stage(StageError::Background(_))));
    }
}
