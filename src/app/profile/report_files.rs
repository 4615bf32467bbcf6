//! The files of a report: how they are read and written, and what becomes of those of an earlier one.
//!
//! A profile whose folder has the complete report of another one moves it into the folder `earlier` there, before it writes anything of
//! its own, and deletes it when it is complete itself. So a profile that fails or is interrupted destroys nothing.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use serde::Deserialize;

use super::{
    error::ProfileError,
    record::{PROFILE_VERSION, ProfileReport},
};
use crate::{app::AppError, files};

/// Folder of the complete report that a profile replaces, until it is complete itself.
const EARLIER: &str = "earlier";
/// Folders of a report's images. Those of references stay where they are: they tell themselves what they are of.
const FOLDERS: [&str; 2] = ["images", "errors"];

/// The files of a report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReportFiles {
    /// All figures: docs/reports.md documents them.
    pub json: PathBuf,
    /// One row a frame, with the columns of PresentMon.
    pub frames: PathBuf,
    /// One row a combination of settings.
    pub points: PathBuf,
    /// The page for people.
    pub page: PathBuf,
}

impl ReportFiles {
    pub(super) fn in_folder(folder: &Path) -> Self {
        Self {
            json: folder.join("report.json"),
            frames: folder.join("frames.csv"),
            points: folder.join("points.csv"),
            page: folder.join("report.html"),
        }
    }

    /// The files.
    pub fn all(&self) -> [&Path; 4] {
        [&self.page, &self.json, &self.frames, &self.points]
    }
}

/// Reads a report.
///
/// # Errors
/// [`ProfileError::Report`].
pub fn read_report(path: &Path) -> Result<ProfileReport, ProfileError> {
    let failed = |why: String| ProfileError::Report { path: path.to_owned(), why };
    let bytes = files::read_ordinary(path).map_err(|error| failed(error.to_string()))?;
    let report: ProfileReport =
        serde_json::from_slice(&bytes).map_err(|error| failed(format!("this is not a profile's report: {error}")))?;
    if report.schema != "canopy-profile" || report.version != PROFILE_VERSION {
        let (schema, version) = (report.schema, report.version);
        return Err(failed(format!(
            "this is {schema} version {version}; this program reads canopy-profile version {PROFILE_VERSION}"
        )));
    }
    Ok(report)
}

/// Moves a complete report in `folder`, of any version, out of the way. Returns the folder that has it now, if there was one. What is not
/// complete is left to be overwritten, and so does not replace a complete one that was moved before.
///
/// # Errors
/// [`AppError::Write`].
pub(super) fn set_aside(folder: &Path) -> Result<Option<PathBuf>, AppError> {
    #[derive(Deserialize)]
    struct Known {
        complete: bool,
    }
    let report = ReportFiles::in_folder(folder);
    let known = files::read_ordinary(&report.json).ok().and_then(|bytes| serde_json::from_slice::<Known>(&bytes).ok());
    if !known.is_some_and(|known| known.complete) {
        return Ok(None);
    }
    let earlier = folder.join(EARLIER);
    let failed = |source: io::Error| AppError::Write { path: earlier.clone(), source };
    remove(&earlier).map_err(failed)?;
    fs::create_dir_all(&earlier).map_err(failed)?;
    let own = report.all().map(Path::to_owned).into_iter().chain(FOLDERS.map(|name| folder.join(name)));
    for path in own.filter(|path| path.exists()) {
        fs::rename(&path, earlier.join(path.file_name().unwrap_or_default())).map_err(failed)?;
    }
    Ok(Some(earlier))
}

/// Deletes what [`set_aside`] has kept of `folder`.
///
/// # Errors
/// [`AppError::Write`].
pub(super) fn discard_earlier(folder: &Path) -> Result<(), AppError> {
    let earlier = folder.join(EARLIER);
    remove(&earlier).map_err(|source| AppError::Write { path: earlier, source })
}

/// Deletes the files and folders of a report in `earlier`, and the folder if nothing else lies in it.
fn remove(earlier: &Path) -> io::Result<()> {
    let gone = |result: io::Result<()>| match result {
        Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::DirectoryNotEmpty) => Ok(()),
        result => result,
    };
    for file in ReportFiles::in_folder(earlier).all() {
        gone(fs::remove_file(file))?;
    }
    for name in FOLDERS {
        gone(fs::remove_dir_all(earlier.join(name)))?;
    }
    gone(fs::remove_dir(earlier))
}

/// The figures as JSON.
///
/// # Errors
/// [`AppError::Render`].
pub(super) fn json(report: &ProfileReport) -> Result<Vec<u8>, AppError> {
    serde_json::to_vec_pretty(report)
        .map_err(|error| AppError::Render(format!("the report cannot be written: {error}")))
}

/// Writes a file of a report.
///
/// # Errors
/// [`AppError::Write`].
pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), AppError> {
    files::write_whole(path, |writer| writer.write_all(bytes))
        .map_err(|source| AppError::Write { path: path.to_owned(), source })
}

/// `file` as it is named from `folder`; one that does not lie in it by its whole path.
pub(super) fn relative(file: &Path, folder: &Path) -> String {
    let elsewhere = || std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    file.strip_prefix(folder).map_or_else(|_| elsewhere(), Path::to_owned).display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A profile that failed once left an empty report where a complete one had been.
    #[test]
    fn a_complete_report_is_kept_until_another_one_is_complete() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let at = |name: &str| folder.path().join(name);
        let put = |complete: bool, begun: &str| -> Result<(), AppError> {
            let report = ProfileReport { complete, begun: begun.to_owned(), ..ProfileReport::default() };
            write(&at("report.json"), &json(&report)?)
        };
        let begun = |name: &str| -> Result<String, Box<dyn std::error::Error>> {
            let report: ProfileReport = serde_json::from_slice(&fs::read(at(name))?)?;
            Ok(report.begun)
        };
        assert_eq!(set_aside(folder.path())?, None);
        put(true, "first")?;
        write(&at("images/000/0000.png"), b"image")?;
        write(&at("reference-full/0000.png"), b"image")?;
        assert_eq!(set_aside(folder.path())?, Some(at("earlier")));
        assert!(at("earlier/images/000/0000.png").is_file() && at("reference-full/0000.png").is_file());
        assert!(!at("report.json").exists() && !at("images").exists());
        // One that did not end does not push the complete one out.
        put(false, "second")?;
        assert_eq!(set_aside(folder.path())?, None);
        assert_eq!((begun("earlier/report.json")?, begun("report.json")?), ("first".to_owned(), "second".to_owned()));
        put(true, "third")?;
        set_aside(folder.path())?;
        assert_eq!(begun("earlier/report.json")?, "third");
        discard_earlier(folder.path())?;
        discard_earlier(folder.path())?;
        assert!(!at("earlier").exists());
        Ok(())
    }
}
