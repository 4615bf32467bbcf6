//! Errors of scene files, with file, line, column and remedy.

use std::fmt;
use std::path::PathBuf;

use ron::error::{Error as RonError, SpannedError};

use super::locate::{Outline, Position};
use crate::math::names::edit_distance;

/// Mistakes that a message lists; it counts the others.
const LISTED: usize = 20;

/// Why a scene file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file could not be opened or read.
    #[error("cannot read the scene file {}: {source}; check the name and that the file may be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The file is larger than any scene file.
    #[error(
        "{} is not a scene file: it has {bytes} bytes, and a scene file has at most {limit}; name a RON scene such as assets/scenes/demo.ron",
        path.display()
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size in bytes.
        bytes: u64,
        /// The largest size read, in bytes.
        limit: u64,
    },
    /// The text is not RON, or has a field, a variant or a type that scenes do not have.
    #[error("{}:{position}: {message}; {remedy}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        position: Position,
        /// What is wrong.
        message: String,
        /// What to do about it.
        remedy: String,
    },
    /// The scene is well formed, but values in it are out of range. The message lists the first 20.
    #[error("{}", problem_lines(scene, problems))]
    Invalid {
        /// The file, or [`Scene::label`](super::Scene::label) of a scene that was built in code.
        scene: String,
        /// What is out of range, in the file's order; never empty.
        problems: Vec<Problem>,
    },
}

/// One value of a scene that is out of range.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Where the value is in the file (or, for one that is missing, the structure that lacks it). `None` for a scene
    /// that was built in code.
    pub position: Option<Position>,
    /// The path of the field, such as `species[1].height`.
    pub field: String,
    /// What is wrong with it.
    pub message: String,
    /// What to do about it.
    pub remedy: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(position) = self.position {
            write!(f, "{position}: ")?;
        }
        write!(f, "`{}` {}; {}", self.field, self.message, self.remedy)
    }
}

fn problem_lines(scene: &str, problems: &[Problem]) -> String {
    // Editors and terminals recognise `file:line:column: ` as a link.
    let colon = |problem: &Problem| if problem.position.is_some() { ":" } else { ": " };
    let listed = problems.iter().take(LISTED).map(|problem| format!("{scene}{}{problem}", colon(problem)));
    let more = (problems.len() > LISTED)
        .then(|| format!("{scene}: {} mistakes, of which the first {LISTED} are listed", problems.len()));
    listed.chain(more).collect::<Vec<_>>().join("\n")
}

/// Turns RON's error into ours: known fields are listed, the nearest name is suggested, and the position is that of
/// the offending name or value, not of the parser's cursor.
pub(super) fn from_ron(error: SpannedError, text: &str, path: PathBuf) -> SceneError {
    let end = Position { line: error.span.end.line, column: error.span.end.col };
    let start = Position { line: error.span.start.line, column: error.span.start.col }.past_blanks(text);
    let outline = Outline::of(text);
    let (position, message, remedy) = match &error.code {
        RonError::NoSuchStructField { expected, found, outer } => (
            outline.as_ref().and_then(|outline| outline.last_field_before(found, end)).unwrap_or(start),
            format!("unknown field `{found}`{}", in_structure(outer)),
            suggestion(found, expected, "fields"),
        ),
        RonError::NoSuchEnumVariant { expected, found, outer } => (
            outline.as_ref().and_then(|outline| outline.last_tag_before(found, end)).unwrap_or(start),
            format!("unknown choice `{found}`{}", in_structure(outer)),
            suggestion(found, expected, "choices"),
        ),
        RonError::MissingStructField { field, outer } => (
            outline.as_ref().and_then(|outline| outline.group_around(end)).unwrap_or(start),
            format!("the field `{field}` is missing{}", in_structure(outer)),
            format!("add `{field}: ...` here"),
        ),
        RonError::DuplicateStructField { field, outer } => (
            outline.as_ref().and_then(|outline| outline.last_field_before(field, end)).unwrap_or(start),
            format!("the field `{field}` is given twice{}", in_structure(outer)),
            "remove one of the two".to_owned(),
        ),
        RonError::Message(message) => {
            // Our own messages (of times, say) carry their remedy behind the last semicolon.
            let (message, remedy) = message.rsplit_once("; ").unwrap_or((message, "write what is expected here"));
            let position = outline.as_ref().and_then(|outline| outline.last_leaf_before(end)).unwrap_or(start);
            (position, message.to_owned(), remedy.to_owned())
        }
        RonError::InvalidValueForType { expected, found } => (
            outline.as_ref().and_then(|outline| outline.last_leaf_before(end)).unwrap_or(start),
            format!("expected {expected} but found {found}"),
            format!("write {expected} here"),
        ),
        RonError::IntegerOutOfBounds => (
            outline.as_ref().and_then(|outline| outline.last_leaf_before(end)).unwrap_or(start),
            "this integer is too large or negative for its field".to_owned(),
            "write a smaller, non-negative integer".to_owned(),
        ),
        code => match outline.as_ref().and_then(|outline| outline.leaf_around(start)) {
            // RON reads the 5 of `5.5` and then expects a comma.
            Some((position, written)) if matches!(code, RonError::ExpectedComma) => (
                position,
                format!("expected a whole number but found {written}"),
                "write a whole number here".to_owned(),
            ),
            _ => (start, lower_first(&code.to_string()), remedy_for_syntax(code).to_owned()),
        },
    };
    let remedy = match &outline {
        Some(outline) if outline.is_within("Some", start) => {
            "remove `Some`: optional values are written without it".to_owned()
        }
        _ => remedy,
    };
    SceneError::Syntax { path, position, message, remedy }
}

fn in_structure(outer: &Option<String>) -> String {
    outer.as_ref().map_or(String::new(), |outer| format!(" in `{outer}`"))
}

fn lower_first(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or(String::new(), |first| first.to_lowercase().chain(characters).collect())
}

fn remedy_for_syntax(code: &RonError) -> &'static str {
    match code {
        RonError::ExpectedStructLike
        | RonError::ExpectedNamedStructLike(_)
        | RonError::ExpectedDifferentStructName { .. } => {
            "structures are written `(field: value, ...)`, ranges and points `(12, 24)`, choices `Name(field: value, ...)` \
             or `Name()`"
        }
        RonError::ExpectedDifferentLength { .. } => "ranges are written `(12, 24)`, points `(x, y, z)`",
        RonError::ExpectedIdentifier => "choices are written `Name(field: value, ...)`",
        RonError::InvalidIdentifier(_) | RonError::SuggestRawIdentifier(_) => "fields are written `name: value`",
        RonError::ExpectedComma
        | RonError::ExpectedArrayEnd
        | RonError::ExpectedStructLikeEnd
        | RonError::ExpectedMapEnd => "look for a missing comma or bracket just before this position",
        RonError::ExpectedString => "texts are written in double quotes",
        RonError::ExpectedArray => "lists are written `[first, second]`",
        RonError::ExpectedInteger => "write a whole number that is not negative",
        RonError::ExpectedFloat => "write a number such as 12 or 0.5",
        RonError::Eof => "a closing bracket is missing at the end",
        _ => "scene files are RON; compare with assets/scenes/demo.ron",
    }
}

fn suggestion(found: &str, known: &[&str], kind: &str) -> String {
    let list = known.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    match nearest(found, known) {
        Some(name) => format!("did you mean `{name}`? The known {kind} are {list}"),
        None if known.is_empty() => format!("remove it: no {kind} are known here"),
        None => format!("the known {kind} are {list}"),
    }
}

/// The name of `known` that `found` most likely means: the least edit distance (Damerau 1964, adjacent swaps count
/// once), at most a third of the longer name's length but always allowing one slip; letter case is ignored.
pub(crate) fn nearest<'a>(found: &str, known: &[&'a str]) -> Option<&'a str> {
    let found: Vec<char> = found.to_lowercase().chars().collect();
    known
        .iter()
        .filter_map(|name| {
            let letters: Vec<char> = name.to_lowercase().chars().collect();
            let limit = (letters.len().max(found.len()) / 3).max(1);
            // The distance is at least the difference in length, and costs far more.
            let possible = letters.len().abs_diff(found.len()) <= limit;
            possible.then(|| (edit_distance(&found, &letters), limit, *name))
        })
        .filter(|(distance, limit, _)| distance <= limit)
        .min_by_key(|(distance, _, _)| *distance)
        .map(|(_, _, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_name_forgives_slips_but_not_strangers() {
        let known = ["stems_per_hectare", "min_distance", "slope_limit", "area"];
        assert_eq!(nearest("stem_per_hectare", &known), Some("stems_per_hectare"));
        assert_eq!(nearest("slope_limti", &known), Some("slope_limit"));
        assert_eq!(nearest("Area", &known), Some("area"));
        assert_eq!(nearest("colour", &known), None);
    }

    #[test]
    fn edit_distance_is_a_metric_on_examples() {
        let letters = |text: &str| text.chars().collect::<Vec<_>>();
        assert_eq!(edit_distance(&letters(""), &letters("abc")), 3);
        assert_eq!(edit_distance(&letters("abcd"), &letters("abdc")), 1);
        assert_eq!(edit_distance(&letters("kitten"), &letters("sitting")), 3);
    }
}
