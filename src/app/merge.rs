//! Films of parts of the samples, traced on several machines, as one image: what `canopy merge` does.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use super::{
    error::{AppError, of_file, outcome},
    film_notes::FilmNotes,
    plan::PlanError,
    reference::save,
};
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
    /// A file that is no film.
    #[error("{}: {what}; give films (.film) alone, and trace a part whose film is damaged again with `canopy reference --part`", path.display())]
    NoFilm {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: &'static str,
    },
    /// A film that another command kept.
    #[error("{}: this film does not say how it is to be shown; merge those that `canopy reference --part` writes", .0.display())]
    NoNotes(PathBuf),
    /// Films of different images.
    #[error("{} and {} are not parts of one image: scene, light, camera, size or settings differ", .0.display(), .1.display())]
    Different(PathBuf, PathBuf),
    /// Films of different numbers of samples.
    #[error(
        "{} is a part of {} samples a pixel and {} one of {}; merge parts that were traced with the same --spp", first.display(), totals.0,
        second.display(), totals.1
    )]
    Totals {
        /// A film.
        first: PathBuf,
        /// The other one.
        second: PathBuf,
        /// Samples of the whole of each.
        totals: (u32, u32),
    },
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

/// What to do where some images of several cannot be merged.
const MEND: &str = "mend their films, and merge again";

/// Merges the films of `options`; returns the images. One that fails does not stop the others.
///
/// # Errors
/// [`AppError::Merge`], [`AppError::Plan`], [`AppError::Reference`], [`AppError::Write`]; existing images stay as they are.
/// [`AppError::SomeFailed`] where some of several images failed.
pub fn merge(options: &MergeOptions, progress: &mut dyn Progress) -> Result<Vec<PathBuf>, AppError> {
    let images = images(options)?;
    for image in images.keys().take(1) {
        files::check_writable(image).map_err(|source| AppError::Write { path: image.clone(), source })?;
    }
    progress.begin("Images", images.len() as u64);
    let (total, mut done, mut failures) = (images.len(), Vec::new(), Vec::new());
    for (image, parts) in images {
        if progress.is_cancelled() {
            return Err(AppError::Interrupted(format!("{} images are finished", done.len())));
        }
        match merge_one(&parts, &image, options.incomplete) {
            Ok(()) => done.push(image),
            Err(error) if total == 1 => return Err(error),
            Err(error) => {
                progress.warn(&of_file(&image, &error));
                failures.push((image, error));
            }
        }
        progress.advance(1);
    }
    progress.end();
    outcome(failures, done.len(), MEND)?;
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
        let kept = match KeptFilm::load(part) {
            // What is to be done about a checkpoint is of no use here: it would delete what is no film.
            Err(ReferenceError::Checkpoint { path, what }) => return Err(MergeError::NoFilm { path, what }.into()),
            kept => kept?.ok_or_else(|| MergeError::NotThere(part.clone()))?,
        };
        let notes = FilmNotes::from_bytes(&kept.notes).ok_or_else(|| MergeError::NoNotes(part.clone()))?;
        films.push((part, kept, notes));
    }
    films.sort_by_key(|(_, kept, _)| (kept.film.first(), kept.film.samples()));
    // Films of another image tell nothing of what is missing.
    if let Some(((first, kept, notes), others)) = films.split_first() {
        for (part, other, own) in others {
            if own.total != notes.total {
                let (first, second, totals) = ((*first).clone(), (*part).clone(), (notes.total, own.total));
                return Err(MergeError::Totals { first, second, totals }.into());
            }
            if other.fingerprint != kept.fingerprint || !own.is_of_same_image(notes) {
                return Err(MergeError::Different((*first).clone(), (*part).clone()).into());
            }
        }
    }
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
    for (part, next, _) in films {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        light::ScotopicTint,
        progress::Silent,
        reference::{Camera, Film, Shot},
        scene::Viewpoint,
    };

    type Outcome = Result<(), Box<dyn std::error::Error>>;

    /// Writes a film without samples that begins at sample `first` of `total`.
    fn film(path: &Path, first: u32, total: u32, scene: &str) -> Outcome {
        let view = Viewpoint { position: glam::DVec3::ZERO, yaw: 0.0, pitch: 0.0, field_of_view: 1.0 };
        let shot = Shot { camera: Camera { view, size: (2, 1), near: 0.1 }, fog: None };
        let text = vec![("Scene".to_owned(), scene.to_owned())];
        let notes = FilmNotes {
            total,
            exposure: 1.0,
            night: ScotopicTint { tint: glam::Vec3::ONE, amount: 0.0, strength: 0.0 },
            text,
        };
        std::fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
        Ok(Film::beginning_at(&shot, first)?.keep(path, &[7; 32], &notes.to_bytes())?)
    }

    fn merged(parts: &[&Path], out: &Path) -> Result<Vec<PathBuf>, AppError> {
        let parts = parts.iter().map(|part| (*part).to_owned()).collect();
        merge(&MergeOptions { parts, out: out.to_owned(), exr: true, incomplete: true }, &mut Silent)
    }

    /// A scene given by mistake was to be deleted, and films of other --spp were said to lack samples.
    #[test]
    fn what_is_no_film_of_the_image_is_told_with_its_remedy() -> Outcome {
        let folder = tempfile::tempdir()?;
        let at = |name: &str| folder.path().join(name);
        film(&at("a.film"), 0, 4, "wood.ron")?;
        film(&at("b.film"), 5, 8, "wood.ron")?;
        std::fs::write(at("wood.ron"), "(terrain: Flat())")?;
        let message = |parts: &[&Path]| merged(parts, &at("out.exr")).err().map(|error| error.to_string());
        let no_film = message(&[&at("a.film"), &at("wood.ron")]).unwrap_or_default();
        assert!(no_film.contains("wood.ron: this is not") && !no_film.contains("delete"), "{no_film}");
        assert!(no_film.contains("again with `canopy reference --part`"), "{no_film}");
        let other = message(&[&at("a.film"), &at("b.film")]).unwrap_or_default();
        assert!(other.contains("a part of 4 samples a pixel and") && other.ends_with("with the same --spp"), "{other}");
        // The same scene by another name.
        film(&at("c.film"), 0, 4, "copy.ron")?;
        assert_eq!(merged(&[&at("a.film"), &at("c.film")], &at("out.exr"))?, [at("out.exr")]);
        Ok(())
    }

    /// The first bad film of a sequence once ended it.
    #[test]
    fn images_that_cannot_be_merged_do_not_stop_the_others() -> Outcome {
        let folder = tempfile::tempdir()?;
        let at = |name: &str| folder.path().join(name);
        for name in ["parts/0000.film", "parts/0001.film", "parts/0002.film"] {
            film(&at(name), 0, 4, "wood.ron")?;
        }
        std::fs::write(at("parts/0001.film"), "half a film")?;
        let error = merged(&[&at("parts")], &at("out")).err().ok_or("it failed")?;
        assert!(matches!(error, AppError::SomeFailed { failed: 1, total: 3, .. }), "{error}");
        assert!(error.to_string().ends_with(MEND) && !error.to_string().contains("--resume"), "{error}");
        assert!(at("out/0000.exr").is_file() && !at("out/0001.exr").exists() && at("out/0002.exr").is_file());
        Ok(())
    }
}
