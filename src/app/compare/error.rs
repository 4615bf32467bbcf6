//! Why images cannot be compared.

use std::path::PathBuf;

use crate::measure::MeasureError;

/// Why images cannot be compared, or what a comparison found.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A file that is no image.
    #[error("{}: {why}; images are PNG, JPEG or OpenEXR files", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        why: String,
    },
    /// Pixels whose light is no number.
    #[error(
        "{}: {count} of {total} pixels are not finite (NaN or infinite), the first in column {column} of row {row}, counted from 0 at the \
         upper left; an image with such pixels cannot be judged, render it anew or replace them", path.display()
    )]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// Number of these pixels.
        count: usize,
        /// Number of all pixels.
        total: usize,
        /// Column of the first one.
        column: usize,
        /// Its row.
        row: usize,
    },
    /// A map that cannot be written.
    #[error("{}: {source}; choose a writable file with --map, or for sequences a folder", path.display())]
    Map {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Images that do not fit together.
    #[error("{} and {}: {source}", test.display(), reference.display())]
    Measure {
        /// The test.
        test: PathBuf,
        /// The reference, mask or half.
        reference: PathBuf,
        /// The reason.
        source: MeasureError,
    },
    /// A folder or pattern without images.
    #[error("{}: there are no images (.png, .exr, .jpg) there", .0.display())]
    NoImages(PathBuf),
    /// A pattern that is none.
    #[error("{}: a pattern has one `*`, in the name of the file, as in out/flight-*.png", .0.display())]
    Pattern(PathBuf),
    /// A sequence beside a single image.
    #[error("{} is a sequence and {} is a single image; give two images, or two folders or patterns", sequence.display(), single.display())]
    Kinds {
        /// The sequence.
        sequence: PathBuf,
        /// The image.
        single: PathBuf,
    },
    /// A sequence that lacks frames of the test.
    #[error(
        "{} has {} of the {total} frames of {}; missing: {}",
        reference.display(), total - missing.len(), test.display(), some(missing)
    )]
    Missing {
        /// The test.
        test: PathBuf,
        /// The sequence that lacks frames.
        reference: PathBuf,
        /// Names of the frames.
        missing: Vec<String>,
        /// Number of frames of the test.
        total: usize,
    },
    /// The error is above the limit.
    #[error("{name}: mean FLIP {found:.4} is above the limit of {limit}")]
    Limit {
        /// The image.
        name: String,
        /// Its mean FLIP.
        found: f64,
        /// The limit.
        limit: f64,
    },
}

/// The first names of a list, and how many more there are.
fn some(names: &[String]) -> String {
    const SHOWN: usize = 8;
    let shown = names.iter().take(SHOWN).map(String::as_str).collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(SHOWN) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}
