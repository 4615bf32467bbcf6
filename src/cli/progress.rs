//! Progress on the terminal.

use std::time::Duration;

use canopy::{app::interrupt_received, progress::Progress};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A progress bar on the standard error output, one stage at a time. It disappears with its stage, and is never drawn
/// if that output is not a terminal or the user asked for quiet. Lines for the user stay.
pub struct Bars {
    bar: ProgressBar,
    quiet: bool,
}

impl Bars {
    /// Prints a warning above the bars.
    pub fn caution(&mut self, message: &str) {
        self.warn(message);
    }

    /// Progress for a user who may have asked for quiet.
    pub fn new(quiet: bool) -> Self {
        Self { bar: ProgressBar::hidden(), quiet }
    }
}

impl Progress for Bars {
    fn begin(&mut self, what: &str, steps: u64) {
        self.end();
        if self.quiet {
            return;
        }
        let (bar, template) = if steps == 0 {
            (ProgressBar::no_length(), "{spinner} {msg} [{elapsed}]")
        } else {
            (ProgressBar::new(steps), "{msg} {wide_bar} {pos}/{len} [{elapsed}, {eta} left]")
        };
        // indicatif draws nothing if the output is not a terminal.
        bar.set_draw_target(ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.set_message(what.to_owned());
        bar.enable_steady_tick(Duration::from_millis(200));
        self.bar = bar;
    }

    fn advance(&mut self, steps: u64) {
        self.bar.inc(steps);
    }

    fn end(&mut self) {
        self.bar.finish_and_clear();
        self.bar = ProgressBar::hidden();
    }

    fn warn(&mut self, message: &str) {
        self.bar.suspend(|| eprint_line(&format!("warning: {message}")));
    }

    fn note(&mut self, message: &str) {
        if !self.quiet {
            self.bar.suspend(|| eprint_line(message));
        }
    }

    fn is_cancelled(&self) -> bool {
        interrupt_received().is_some()
    }
}

impl Drop for Bars {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Prints a line on the standard error output. A closed output does not stop the program.
fn eprint_line(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{line}");
}
