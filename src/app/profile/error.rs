//! Why a scene cannot be profiled.

use std::path::{Path, PathBuf};

use super::settings::SettingError;

/// Rounds from which on a mean time has an interval.
pub const LEAST_ROUNDS_FOR_MEAN: u32 = 2;
/// Rounds from which on times of settings have ratios: two in each order.
pub const LEAST_ROUNDS_FOR_RATIO: u32 = 4;

/// What times above `limit` are, as a fraction of those in `baseline`.
fn beyond(limit: f64, baseline: &Path) -> String {
    let baseline = baseline.display();
    match limit {
        1.0.. => format!("are slower than in {baseline} by more than {:.0} %", 100.0 * (limit - 1.0)),
        _ => format!("take more than {limit} of the time in {baseline}"),
    }
}

/// Why a scene cannot be profiled, or what a profile found.
#[derive(Debug, thiserror::Error)]
pub enum ProfileError {
    /// A setting.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// Too many combinations.
    #[error("the sweeps have more than {most} combinations; sweep fewer values, or one setting at a time with --each")]
    TooManyPoints {
        /// The most.
        most: usize,
    },
    /// A setting in two sweeps, of which the later one would replace the values of the earlier one.
    #[error("`{0}` is swept twice; write all its values in one sweep, as in --sweep {0}=VALUE,VALUE")]
    SweptTwice(String),
    /// A report that cannot be read.
    #[error("{}: {why}", path.display())]
    Report {
        /// The file.
        path: PathBuf,
        /// The reason.
        why: String,
    },
    /// A report of something else is in the way.
    #[error(
        "{} has a report of another profile (other scene, settings, views or machine); choose another folder with --out, \
         or leave out --resume to replace it", .0.display()
    )]
    Another(PathBuf),
    /// A reference that lacks frames.
    #[error("{} lacks {} of the {total} reference frames: {}; names are those of the frames, 0000.png and so on", folder.display(), missing.len(), missing.join(", "))]
    Missing {
        /// The folder.
        folder: PathBuf,
        /// Names of the frames.
        missing: Vec<String>,
        /// Number of frames.
        total: usize,
    },
    /// An image of a reference of another size.
    #[error(
        "{} has {}x{} pixels, not {}x{}; give the --size of the reference, or a reference of that size", path.display(), found.0, found.1,
        wanted.0, wanted.1
    )]
    ReferenceSize {
        /// The image.
        path: PathBuf,
        /// Its width and height.
        found: (u32, u32),
        /// Those of the frames.
        wanted: (u32, u32),
    },
    /// It has become slower.
    #[error("{} of {total} settings {}: {}", slower.len(), beyond(*limit, baseline), slower.join("; "))]
    Slower {
        /// The report that it was compared with.
        baseline: PathBuf,
        /// The settings with their ratios.
        slower: Vec<String>,
        /// Number of settings that both have.
        total: usize,
        /// The ratio allowed.
        limit: f64,
    },
    /// A baseline of something else.
    #[error(
        "{} cannot be compared with this profile: {}; measure the baseline again with the same scene, --size and views",
        baseline.display(), differences.join("; ")
    )]
    Incomparable {
        /// The report.
        baseline: PathBuf,
        /// What differs.
        differences: Vec<String>,
    },
    /// Times that there are not.
    #[error(
        "{}: no times can be compared of {}; measure both reports with at least {LEAST_ROUNDS_FOR_MEAN} --rounds", baseline.display(),
        settings.join("; ")
    )]
    Untimed {
        /// The report that it was compared with.
        baseline: PathBuf,
        /// The settings that lack a time in either report.
        settings: Vec<String>,
    },
    /// Too few rounds.
    #[error("--rounds {rounds} are too few {purpose}; give at least {least}")]
    FewRounds {
        /// Rounds asked for.
        rounds: u32,
        /// What for.
        purpose: &'static str,
        /// The least that will do.
        least: u32,
    },
    /// Nothing can be compared with a baseline.
    #[error("{}: none of its settings is in this profile, so nothing can be compared", .0.display())]
    NothingInCommon(PathBuf),
    /// A search without a reference.
    #[error(
        "a search needs a reference to count errors from; give --reference full, traced or a folder instead of none"
    )]
    NoReference,
    /// No setting is good enough.
    #[error("{0}")]
    NoAnswer(String),
}
