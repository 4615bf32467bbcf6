//! Files that appear whole or not at all.

use std::{
    fs,
    io::{self, BufWriter, ErrorKind, Write},
    path::{Path, PathBuf},
};

/// Symbolic links that are followed before they count as a circle, as in Linux.
const MOST_LINKS: usize = 40;

/// Writes the file that `path` leads to by `fill`: under a temporary name beside it, which is then renamed. A symbolic
/// link stays and what it leads to is written; a device or pipe is written as it is. Missing folders are created.
///
/// # Errors
/// Those of the system and of `fill`; then nothing new is left behind but folders.
pub(crate) fn write_whole(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let target = followed(path)?;
    match fs::metadata(&target) {
        Ok(found) if !found.is_file() && !found.is_dir() => {
            let mut writer = BufWriter::new(fs::OpenOptions::new().write(true).open(&target)?);
            fill(&mut writer)?;
            writer.flush()
        }
        _ => replace(&target, fill),
    }
}

/// Writes `path` like [`write_whole`], but whatever is there already is replaced, never written to.
///
/// # Errors
/// Those of [`write_whole`].
pub(crate) fn replace(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let folder = folder_of(path);
    fs::create_dir_all(folder)?;
    let file = temporary(folder)?;
    // The file itself, not by its temporary name, which would be in every error.
    let mut writer = BufWriter::new(file.as_file());
    fill(&mut writer)?;
    writer.flush()?;
    drop(writer);
    readable_by_all(file.as_file())?;
    file.persist(path).map_err(|error| error.error)?;
    Ok(())
}

/// Whether the name of `path` ends in one of `endings`, which have no dot, in letters of any case.
pub(crate) fn ends_in(path: &Path, endings: &[&str]) -> bool {
    path.extension().is_some_and(|own| endings.iter().any(|ending| own.eq_ignore_ascii_case(ending)))
}

/// Whether [`write_whole`] can create a file at `path`, as far as that is known beforehand. Nothing is left behind.
///
/// # Errors
/// Those that [`write_whole`] would have: the path is a folder, leads through a file, or may not be written to.
#[cfg(any(test, feature = "program"))]
pub(crate) fn check_writable(path: &Path) -> io::Result<()> {
    let target = followed(path)?;
    match fs::metadata(&target) {
        Ok(found) if found.is_dir() => return Err(ErrorKind::IsADirectory.into()),
        Ok(found) if !found.is_file() => return Ok(()),
        _ => {}
    }
    let mut folder = folder_of(&target);
    // The folders below the first one that exists will be created in it.
    while matches!(fs::metadata(folder), Err(error) if error.kind() == ErrorKind::NotFound) {
        folder = match folder.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
    }
    if !fs::metadata(folder)?.is_dir() {
        return Err(ErrorKind::NotADirectory.into());
    }
    temporary(folder).map(drop)
}

/// The bytes of an ordinary file. A pipe, which might never end, or not even begin, is not opened.
///
/// # Errors
/// Those of the system; [`ErrorKind::InvalidInput`] for anything that is not an ordinary file.
pub(crate) fn read_ordinary(path: &Path) -> io::Result<Vec<u8>> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::new(ErrorKind::InvalidInput, "this is not an ordinary file"));
    }
    fs::read(path)
}

/// What `path` leads to if it is a symbolic link, whether or not that exists yet.
fn followed(path: &Path) -> io::Result<PathBuf> {
    let mut target = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&target) {
            // A relative link counts from the folder that it lies in.
            Ok(next) => target = folder_of(&target).join(next),
            Err(_) => return Ok(target),
        }
    }
    Err(io::Error::other("the symbolic links lead in a circle"))
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

fn temporary(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    tempfile::Builder::new().prefix(".canopy-").suffix(".tmp").tempfile_in(folder).map_err(|error| {
        // The temporary name says nothing to anyone: the caller names the file.
        let text = error.to_string();
        match text.split_once(" at path ") {
            Some((reason, _)) => io::Error::new(error.kind(), reason.to_owned()),
            None => error,
        }
    })
}

/// A temporary file is its owner's alone; a result is like any other file.
#[cfg(unix)]
fn readable_by_all(file: &fs::File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn readable_by_all(_: &fs::File) -> io::Result<()> {
    Ok(())
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    type Outcome = Result<(), Box<dyn std::error::Error>>;

    fn write(path: &Path, text: &str) -> io::Result<()> {
        write_whole(path, |writer| writer.write_all(text.as_bytes()))
    }

    #[test]
    fn a_symbolic_link_is_followed_and_stays() -> Outcome {
        let folder = tempfile::tempdir()?;
        let (link, far) = (folder.path().join("link"), folder.path().join("deep/far"));
        symlink("deep/far", &link)?;
        // At first it leads to nothing yet.
        for text in ["one", "two"] {
            check_writable(&link)?;
            write(&link, text)?;
            assert_eq!(fs::read_to_string(&far)?, text);
            assert!(fs::symlink_metadata(&link)?.is_symlink());
        }
        let circle = folder.path().join("circle");
        symlink("circle", &circle)?;
        assert!(write(&circle, "x").is_err() && check_writable(&circle).is_err());
        Ok(())
    }

    #[test]
    fn a_device_is_written_and_stays() -> Outcome {
        let folder = tempfile::tempdir()?;
        let link = folder.path().join("nowhere");
        symlink("/dev/null", &link)?;
        check_writable(&link)?;
        write(&link, "text")?;
        assert!(!fs::metadata("/dev/null")?.is_file());
        Ok(())
    }

    #[test]
    fn what_cannot_be_written_is_known_beforehand_and_nothing_is_left() -> Outcome {
        let folder = tempfile::tempdir()?;
        let at = |name: &str| folder.path().join(name);
        fs::write(at("file"), "")?;
        fs::create_dir(at("folder"))?;
        for (name, kind) in [
            ("folder", ErrorKind::IsADirectory),
            ("file/a", ErrorKind::NotADirectory),
            ("file/deeper/a", ErrorKind::NotADirectory),
        ] {
            assert_eq!(check_writable(&at(name)).map_err(|error| error.kind()), Err(kind), "{name}");
            assert!(write(&at(name), "x").is_err(), "{name}");
        }
        check_writable(&at("new/deeper/a"))?;
        check_writable(&at("file"))?;
        assert_eq!(fs::read_dir(folder.path())?.count(), 2);
        Ok(())
    }

    #[test]
    fn a_write_that_fails_leaves_the_old_file_alone() -> Outcome {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("file");
        write(&path, "old")?;
        let full = write_whole(&path, |writer| {
            writer.write_all(b"half")?;
            Err(ErrorKind::StorageFull.into())
        });
        assert_eq!(full.map_err(|error| error.kind()), Err(ErrorKind::StorageFull));
        assert_eq!((fs::read_to_string(&path)?.as_str(), fs::read_dir(folder.path())?.count()), ("old", 1));
        // The system's reason alone: the file was once named twice, by its own name and by a temporary one.
        let no_folder = temporary(&folder.path().join("none")).map(drop).map_err(|error| error.to_string());
        assert!(no_folder.is_err_and(|text| !text.contains("none") && !text.contains(".canopy-")));
        // Nothing can be renamed to a folder.
        let folder_in_the_way = folder.path().join("taken");
        fs::create_dir(&folder_in_the_way)?;
        assert!(write(&folder_in_the_way, "new").is_err());
        assert_eq!(fs::read_dir(folder.path())?.count(), 2);
        Ok(())
    }
}
