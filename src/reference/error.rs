//! What can be wrong with a reference scene, its image or its checkpoint.

use std::path::PathBuf;

/// Why a reference image cannot be rendered.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// An instance that stands nowhere or has no size.
    #[error("instance {instance}: {what} is {value}; {remedy}")]
    Instance {
        /// Its index in the list.
        instance: usize,
        /// Which of its values.
        what: &'static str,
        /// The value.
        value: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// An instance of a plant that is not there.
    #[error("instance {instance} is of plant {plant}, but there are {count} plants")]
    UnknownPlant {
        /// Its index in the list.
        instance: usize,
        /// The plant that it names.
        plant: usize,
        /// Plants of the scene.
        count: usize,
    },
    /// More instances than can be counted.
    #[error("{count} trees are too many for a reference; {limit} are the most")]
    TooManyInstances {
        /// Instances.
        count: usize,
        /// Most there can be.
        limit: usize,
    },
    /// A vertex that the scene does not have.
    #[error("the scene has no vertex {vertex} in part {part} of instance {instance}")]
    UnknownVertex {
        /// Place of the instance.
        instance: usize,
        /// Part of its plant.
        part: usize,
        /// Vertex of the part.
        vertex: usize,
    },
    /// An image without pixels, or with too many.
    #[error("{width}x{height} is not a size of an image (expected WIDTHxHEIGHT with 1 to {limit} pixels in all)")]
    Size {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// The most pixels.
        limit: u64,
    },
    /// Samples that do not follow those of a film.
    #[error("samples from number {found} on do not follow those before number {expected}")]
    NotNext {
        /// The number that follows.
        expected: u32,
        /// The one given.
        found: u32,
    },
    /// A camera or a light with a value that is not a number, or outside its range.
    #[error("{what} is {value}; give {range}")]
    Value {
        /// Which value.
        what: &'static str,
        /// The value.
        value: f64,
        /// Range and unit.
        range: &'static str,
    },
    /// A table of a tone curve with another number of texels than its size says.
    #[error("a tone table of {size} texels a side has {texels} texels instead of its cube (a side is 2 to 256)")]
    ToneTable {
        /// Texels a side.
        size: usize,
        /// Texels given.
        texels: usize,
    },
    /// A file that cannot be read.
    #[error("{}: {source}; check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file that cannot be written.
    #[error("{}: {source}; choose a folder that can be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A checkpoint that is truncated, damaged or none at all.
    #[error("{}: {what}; delete it, or render without --resume", path.display())]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: &'static str,
    },
    /// A checkpoint of other samples of the same image.
    #[error(
        "{}: this checkpoint has samples that are not of this part; delete it, or render without --resume", path.display()
    )]
    OtherSamples {
        /// The file.
        path: PathBuf,
    },
    /// A checkpoint of another scene, camera, light or setting.
    #[error(
        "{}: this checkpoint belongs to another scene, camera, light or setting; delete it, or render without --resume",
        path.display()
    )]
    Stale {
        /// The file.
        path: PathBuf,
    },
}

impl ReferenceError {
    /// A value that is not within `range`.
    pub(super) fn value(what: &'static str, value: f64, range: &'static str) -> Self {
        Self::Value { what, value, range }
    }
}
