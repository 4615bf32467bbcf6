//! Collecting values that are out of range, with their positions in the text of the scene file.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::Path;

use super::error::{Problem, SceneError};
use super::locate::{Outline, Position};

/// Gathers the problems of one scene.
pub(super) struct Check<'a> {
    /// The scene file's text and its outline; `None` for a scene that was built in code.
    text: Option<(&'a str, Option<Outline<'a>>)>,
    /// With the byte offset of each value in the text.
    problems: Vec<(usize, Problem)>,
}

impl<'a> Check<'a> {
    /// Checks a scene that was read from `text`: problems have positions.
    pub(super) fn of_text(text: &'a str) -> Self {
        Self { text: Some((text, Outline::of(text))), problems: Vec::new() }
    }

    /// Checks a scene that was built in code: problems have no positions.
    pub(super) fn of_values() -> Self {
        Self { text: None, problems: Vec::new() }
    }

    /// Notes what is wrong with the value at `field`.
    pub(super) fn problem(&mut self, field: &str, message: impl Into<String>, remedy: impl Into<String>) {
        let outline = self.text.as_ref().and_then(|(_, outline)| outline.as_ref());
        let offset = outline.map_or(0, |outline| outline.offset(field));
        let problem =
            Problem { position: None, field: field.to_owned(), message: message.into(), remedy: remedy.into() };
        self.problems.push((offset, problem));
    }

    /// A number that must be finite and in `range`; whether it is.
    pub(super) fn number<T>(&mut self, field: &str, value: T, range: RangeInclusive<T>, unit: &str) -> bool
    where
        T: Copy + PartialOrd + Display + Into<f64>,
    {
        let fine = range.contains(&value);
        if !fine {
            let (low, high) = range.into_inner();
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            let message = if value.into().is_finite() {
                format!("is {value}{unit}, which is out of range")
            } else {
                format!("is {value}, which is not a finite number")
            };
            self.problem(field, message, format!("write a value from {low} to {high}{unit}"));
        }
        fine
    }

    /// A whole number that must be in `range`.
    pub(super) fn count(&mut self, field: &str, value: u32, range: RangeInclusive<u32>) {
        if !range.contains(&value) {
            let (low, high) = range.into_inner();
            self.problem(field, format!("is {value}"), format!("write a whole number from {low} to {high}"));
        }
    }

    /// A range `(low, high)` whose ends must be in `limits` and in order (equal ends are a range of one value).
    pub(super) fn ordered(&mut self, field: &str, value: (f64, f64), limits: RangeInclusive<f64>, unit: &str) {
        let low = self.number(&format!("{field}[0]"), value.0, limits.clone(), unit);
        let high = self.number(&format!("{field}[1]"), value.1, limits, unit);
        if low && high && value.0 > value.1 {
            self.problem(
                field,
                format!("is ({}, {}) {unit}: the lower end lies above the upper one", value.0, value.1),
                format!("write ({}, {})", value.1, value.0),
            );
        }
    }

    /// As [`Self::ordered`], for limits between which there must be room: the ends must differ.
    pub(super) fn interval(&mut self, field: &str, value: (f64, f64), limits: RangeInclusive<f64>, unit: &str) {
        self.ordered(field, value, limits, unit);
        if value.0 == value.1 {
            self.problem(
                field,
                format!("is ({}, {}) {unit}: nothing lies between", value.0, value.1),
                "write the lower end, then the higher one",
            );
        }
    }

    /// A point of which every coordinate must be finite and within `limits`.
    pub(super) fn point(&mut self, field: &str, value: (f64, f64, f64), limits: [RangeInclusive<f64>; 3]) {
        let [x, y, z] = limits;
        self.number(&format!("{field}[0]"), value.0, x, "m");
        self.number(&format!("{field}[1]"), value.1, y, "m");
        self.number(&format!("{field}[2]"), value.2, z, "m");
    }

    /// A text that must not be empty.
    pub(super) fn text(&mut self, field: &str, value: &str, remedy: &str) {
        if value.trim().is_empty() {
            self.problem(field, "is empty", remedy);
        }
    }

    /// A path that must not be empty.
    pub(super) fn path(&mut self, field: &str, value: &Path) {
        if value.as_os_str().is_empty() {
            self.problem(field, "is empty", "name a file, relative to the scene file");
        }
    }

    /// The error that lists the problems in the file's order, if there are any.
    pub(super) fn finish(mut self, scene: String) -> Result<(), SceneError> {
        if self.problems.is_empty() {
            return Ok(());
        }
        self.problems.sort_by_key(|(offset, _)| *offset);
        let (offsets, mut problems): (Vec<usize>, Vec<Problem>) = self.problems.into_iter().unzip();
        if let Some((text, _)) = self.text {
            // All at once: a text is not searched again for each of its mistakes.
            let positions = Position::of_offsets(text.char_indices(), &offsets);
            problems.iter_mut().zip(positions).for_each(|(problem, position)| problem.position = Some(position));
        }
        Err(SceneError::Invalid { scene, problems })
    }
}
