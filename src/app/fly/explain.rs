//! `--explain`: prints which passes the frames ran and skipped, on the standard output.

use std::{
    io::Write,
    time::{Duration, Instant},
};

use bevy::ecs::system::{Local, Res};

use super::session::Session;
use crate::render::report::{FrameReport, PassOutcome};

/// Minimum time between two reports.
const INTERVAL: Duration = Duration::from_secs(1);

/// A pass and its outcome, in one line.
fn line(pass: &str, outcome: &PassOutcome) -> String {
    match outcome {
        PassOutcome::Ran(on) => format!("{pass}: ran ({on})"),
        PassOutcome::Skipped(why) => format!("{pass}: skipped ({why})"),
    }
}

/// The last printed report and its time.
#[derive(Default)]
pub struct Printed(Option<(Instant, Vec<(String, PassOutcome)>)>);

/// Prints the report of the last frame if it differs from the last printed one, at most once per second.
pub fn explain(session: Res<Session>, report: Res<FrameReport>, mut printed: Local<Printed>) {
    if printed.0.as_ref().is_some_and(|(when, _)| when.elapsed() < INTERVAL) {
        return;
    }
    let outcomes = report.outcomes();
    if outcomes.is_empty() || printed.0.as_ref().is_some_and(|(_, before)| *before == outcomes) {
        return;
    }
    let mut text = format!("{}:\n", session.clock.now().format("%Y-%m-%d %H:%M:%S %:z"));
    for (pass, outcome) in &outcomes {
        text.push_str(&format!("  {}\n", line(pass, outcome)));
    }
    // A closed output does not stop the flight.
    let mut out = std::io::stdout();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    printed.0 = Some((Instant::now(), outcomes));
}
