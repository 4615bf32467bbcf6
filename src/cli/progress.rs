//! Progress on the terminal.

use std::time::Duration;

use canopy::progress::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A progress bar on the standard error output, one stage at a time. It vanishes with its stage, and is never drawn
/// where that output is no terminal or the user asked for quiet; lines for the user stay.
pub struct Bars {
    bar: ProgressBar,
    quiet: bool,
}

impl Bars {
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
            (ProgressBar::new(steps), "{msg} {wide_bar} {pos}/{len} [{elapsed}, {eta} to go]")
        };
        // Of both outputs, indicatif draws on neither that is no terminal.
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
}

impl Drop for Bars {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// A line on the standard error output; one that nobody can read any more is no reason to stop.
fn eprint_line(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{line}");
}
