//! Films of parts of the samples, traced on several machines, as one image: what `canopy merge` does.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use super::{error::AppError, film_notes::FilmNotes, plan::PlanError, reference::save};
use crate::{
    files,
    progress::Progress,
    reference::{KeptFilm, ReferenceError},
};

/// What to merge.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MergeOptions {
    /// Films, or folders of films: those of one name are parts of one image.
    pub parts: Vec<PathBuf>,
    /// The image: `.exr`, `.png` or `.film`; for folders a folder.
    pub out: PathBuf,
    /// Whether images in a folder are OpenEXR instead of PNG.
    pub exr: bool,
    /// Whether samples may be missing at the end.
    pub incomplete: bool,
}

/// Why films cannot be merged.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// There is nothing to merge.
    #[error("{}: there are no films (.film) in this folder; `canopy reference --part 1/4` writes them", .0.display())]
    NoFilms(PathBuf),
    /// A file that is not there.
    #[error("{}: there is no such file or folder", .0.display())]
    NotThere(PathBuf),
    /// Files and folders.
    #[error("{} is a folder and {} is none; merge films, or folders of films", folder.display(), file.display())]
    Mixed {
        /// A folder.
        folder: PathBuf,
        /// A file.
        file: PathBuf,
    },
    /// A film that another command kept.
    #[error("{}: this film does not say how it is to be shown; merge those that `canopy reference --part` writes", .0.display())]
    NoNotes(PathBuf),
    /// Films of different images.
    #[error("{} and {} are not parts of one image: scene, light, camera, size or settings differ", .0.display(), .1.display())]
    Different(PathBuf, PathBuf),
    /// Samples twice.
    #[error("{} and {} both have sample {sample}; leave one of them out", first.display(), second.display())]
    Twice {
        /// A film.
        first: PathBuf,
        /// The other one.
        second: PathBuf,
        /// Number of the first sample that both have.
        sample: u32,
    },
    /// Samples that no film has.
    #[error("{}: samples {from} to {to} of {total} are missing; add the film that has them{}", out.display(), if *between { "" } else { ", or use --incomplete" })]
    Missing {
        /// The image.
        out: PathBuf,
        /// Number of the first, counted from 1.
        from: u32,
        /// Number of the last.
        to: u32,
        /// Samples of the whole.
        total: u32,
        /// Whether others follow.
        between: bool,
    },
    /// A file where a folder is needed.
    #[error("`{}` is the name of an image; folders are merged into a folder, as PNG or with --exr", .0.display())]
    Folder(PathBuf),
}

/// What an image can be written as.
const IMAGES: &[&str] = &["exr", "png", "film"];

/// Merges the films of `options`; returns the images.
///
/// # Errors
/// [`AppError::Merge`], [`AppError::Plan`], [`AppError::Reference`], [`AppError::Write`]; existing images stay as they are.
pub fn merge(options: &MergeOptions, progress: &mut dyn Progress) -> Result<Vec<PathBuf>, AppError> {
    let images = images(options)?;
    for image in images.keys().take(1) {
        files::check_writable(image).map_err(|source| AppError::Write { path: image.clone(), source })?;
    }
    progress.begin("Images", images.len() as u64);
    let mut done = Vec::new();
    for (image, parts) in images {
        if progress.is_cancelled() {
            return Err(AppError::Interrupted(format!("{} images are finished", done.len())));
        }
        merge_one(&parts, &image, options.incomplete)?;
        done.push(image);
        progress.advance(1);
    }
    progress.end();
    Ok(done)
}

/// The parts of each image.
fn images(options: &MergeOptions) -> Result<BTreeMap<PathBuf, Vec<PathBuf>>, AppError> {
    if let Some(missing) = options.parts.iter().find(|path| !path.exists()) {
        return Err(MergeError::NotThere(missing.clone()).into());
    }
    let (folders, single): (Vec<&PathBuf>, Vec<&PathBuf>) = options.parts.iter().partition(|path| path.is_dir());
    if let (Some(folder), Some(file)) = (folders.first(), single.first()) {
        return Err(MergeError::Mixed { folder: (*folder).clone(), file: (*file).clone() }.into());
    }
    if folders.is_empty() {
        let endings = if options.exr { &["exr"] } else { IMAGES };
        return match files::ends_in(&options.out, endings) {
            true => Ok(BTreeMap::from([(options.out.clone(), options.parts.clone())])),
            false => Err(PlanError::ending(options.out.clone(), endings).into()),
        };
    }
    if files::ends_in(&options.out, IMAGES) {
        return Err(MergeError::Folder(options.out.clone()).into());
    }
    let mut images: BTreeMap<PathBuf, Vec<PathBuf>> = BTreeMap::new();
    for folder in folders {
        let read = |source| ReferenceError::Read { path: folder.clone(), source };
        let mut films = films_in(folder).map_err(read)?;
        if films.is_empty() {
            return Err(MergeError::NoFilms(folder.clone()).into());
        }
        films.sort();
        for film in films {
            let name = Path::new(film.file_stem().unwrap_or_default()).with_added_extension(if options.exr {
                "exr"
            } else {
                "png"
            });
            images.entry(options.out.join(name)).or_default().push(film);
        }
    }
    Ok(images)
}

fn films_in(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut films = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        films.extend(Some(entry?.path()).filter(|path| files::ends_in(path, &["film"])));
    }
    Ok(films)
}

fn merge_one(parts: &[PathBuf], image: &Path, incomplete: bool) -> Result<(), AppError> {
    let mut films = Vec::with_capacity(parts.len());
    for part in parts {
        let kept = KeptFilm::load(part)?.ok_or_else(|| MergeError::NotThere(part.clone()))?;
        let notes = FilmNotes::from_bytes(&kept.notes).ok_or_else(|| MergeError::NoNotes(part.clone()))?;
        films.push((part, kept, notes));
    }
    films.sort_by_key(|(_, kept, _)| (kept.film.first(), kept.film.samples()));
    let mut films = films.into_iter();
    let Some((first, KeptFilm { mut film, fingerprint, .. }, notes)) = films.next() else {
        return Err(MergeError::NoFilms(image.to_owned()).into());
    };
    let missing = |from: u32, to: u32, between: bool| MergeError::Missing {
        out: image.to_owned(),
        from: from + 1,
        to,
        total: notes.total,
        between,
    };
    if film.first() > 0 {
        return Err(missing(0, film.first(), true).into());
    }
    let mut before = first;
    for (part, next, own) in films {
        if next.fingerprint != fingerprint || own != notes {
            return Err(MergeError::Different(first.clone(), part.clone()).into());
        }
        let (end, start) = (film.samples(), next.film.first());
        if start < end {
            return Err(MergeError::Twice { first: before.clone(), second: part.clone(), sample: start + 1 }.into());
        }
        if start > end {
            return Err(missing(end, start, true).into());
        }
        film.append(&next.film)?;
        before = part;
    }
    if film.samples() < notes.total && !incomplete {
        return Err(missing(film.samples(), notes.total, false).into());
    }
    save(&film, image, &fingerprint, &notes)
}
