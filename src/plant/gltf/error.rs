//! Errors and warnings of an import.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};
use std::fmt;
use std::path::PathBuf;

/// Why a plant cannot be read. Every message names the file, the location in it, and a remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlantError {
    /// A file cannot be read.
    #[error("{path}: cannot be read: {source}; check the path and its permissions", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The reason that the system gives.
        source: std::io::Error,
    },
    /// The binary container (GLB) is damaged or is not glTF.
    #[error("{path}: byte {offset}: {what}; {remedy}", path = path.display())]
    Container {
        /// The file.
        path: PathBuf,
        /// Position of the damage, in bytes.
        offset: usize,
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The JSON part cannot be parsed, or lacks something that glTF requires.
    #[error("{path}: JSON line {line}, column {column}: {what}; export the file again or correct it in a text editor", path = path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Line within the JSON part, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong.
        what: String,
    },
    /// The file requires a version or an extension that is not supported.
    #[error("{path}: needs {what}, which is not supported; {remedy}", path = path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The version or extension.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// Geometry cannot be used.
    #[error("{path}: {location}: {what}; {remedy}", path = path.display())]
    Data {
        /// The file.
        path: PathBuf,
        /// JSON pointer to the faulty object, such as `/accessors/3`.
        location: String,
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// There is no triangle to draw.
    #[error(
        "{path}: contains no triangles to draw ({scanned}); export the tree as a mesh, in the default scene, with its triangles",
        path = path.display()
    )]
    Empty {
        /// The file.
        path: PathBuf,
        /// What was found instead.
        scanned: String,
    },
    /// An option of the caller is out of range.
    #[error("{path}: {what}", path = path.display())]
    Option {
        /// The file.
        path: PathBuf,
        /// The option, its value and its range.
        what: String,
    },
}

/// Kind of a [`Warning`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum WarningKind {
    /// Something in the file is valid, but is not used.
    Ignored,
    /// Something was wrong and has been corrected.
    Repaired,
    /// Something is missing, which changes how the plant looks.
    Missing,
}

/// Something that the user of a file should know, although the plant can be drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Kind of the warning.
    pub kind: WarningKind,
    /// JSON pointer to the object (`/materials/2`), or empty for the file as a whole.
    pub location: String,
    /// What is wrong, and, where it helps, what to do.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.kind {
            WarningKind::Ignored => "ignored",
            WarningKind::Repaired => "repaired",
            WarningKind::Missing => "missing",
        };
        match self.location.as_str() {
            "" => write!(f, "{kind}: {}", self.message),
            location => write!(f, "{kind}: {location}: {}", self.message),
        }
    }
}

/// Maximum number of different warnings of an import. Further ones are only counted.
const MOST_WARNINGS: usize = 200;

/// The warnings of an import. Warnings that differ only in location are combined, with the number of locations.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    kept: Vec<(Warning, HashSet<String>)>,
    by_message: HashMap<(WarningKind, String), usize>,
    surplus: usize,
}

impl Warnings {
    pub fn push(&mut self, kind: WarningKind, location: impl Into<String>, message: impl Into<String>) {
        let (location, message) = (location.into(), message.into());
        let next = self.kept.len();
        match self.by_message.entry((kind, message.clone())) {
            Entry::Occupied(known) => {
                let (warning, locations) = &mut self.kept[*known.get()];
                if warning.location != location {
                    locations.insert(location);
                }
            }
            Entry::Vacant(_) if next >= MOST_WARNINGS => self.surplus += 1,
            Entry::Vacant(vacant) => {
                vacant.insert(next);
                self.kept.push((Warning { kind, location, message }, HashSet::new()));
            }
        }
    }

    /// The warnings, in the order in which they occurred.
    pub fn finish(self) -> Vec<Warning> {
        let mut warnings: Vec<Warning> = self
            .kept
            .into_iter()
            .map(|(mut warning, locations)| {
                if !locations.is_empty() {
                    warning.message.push_str(&format!(" (likewise in {} other locations)", locations.len()));
                }
                warning
            })
            .collect();
        if self.surplus > 0 {
            let message = format!("{} further warnings", self.surplus);
            warnings.push(Warning { kind: WarningKind::Ignored, location: String::new(), message });
        }
        warnings
    }
}

/// A problem with an object of the file. The caller decides whether it is an error or a warning.
#[derive(Debug)]
pub(super) struct Fault {
    pub location: String,
    pub what: String,
    pub remedy: &'static str,
}

impl Fault {
    pub fn new(location: impl Into<String>, what: impl Into<String>, remedy: &'static str) -> Self {
        Self { location: location.into(), what: what.into(), remedy }
    }

    pub fn into_error(self, path: &std::path::Path) -> PlantError {
        PlantError::Data { path: path.to_path_buf(), location: self.location, what: self.what, remedy: self.remedy }
    }
}

/// The remedy for damage that only the program that wrote the file can repair.
pub(super) const EXPORT_AGAIN: &str = "the file is damaged: export or download it again";
