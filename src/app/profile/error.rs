//! Why a scene cannot be profiled.

use std::path::PathBuf;

use super::settings::SettingError;

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
    /// It has become slower.
    #[error("{} of {total} settings are slower than in {} by more than {:.0} %: {}", slower.len(), baseline.display(), 100.0 * (limit - 1.0), slower.join("; "))]
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
    /// Nothing can be compared with a baseline.
    #[error("{}: none of its settings is in this profile, so nothing can be compared", .0.display())]
    NothingInCommon(PathBuf),
    /// No setting is good enough.
    #[error("{0}")]
    NoAnswer(String),
}
