//! A film on disk, to go on with later.
//!
//! ```text
//! magic 8 | fingerprint 32 | width u32 | height u32 | first sample u32 | samples u32 | bytes of notes u32
//! | sums 24 a pixel | squares 8 a pixel | notes | BLAKE3 32
//! ```
//!
//! Little-endian. The fingerprint is that of everything the pixels depend on ([`super::PathTracer::fingerprint`]), the
//! hash at the end that of all bytes before it. Notes are the writer's own, such as how the film is to be shown. The file appears whole or not at all: it is written under another name,
//! then renamed.

use std::io::ErrorKind;
use std::path::Path;

use glam::DVec3;

use super::error::ReferenceError;
use super::film::Film;
use crate::files;

const MAGIC: &[u8; 8] = b"CANOPYR2";
const HEADER: usize = 8 + 32 + 20;
const PIXEL: usize = 32;
const HASH: usize = 32;

/// A film as it was kept.
#[derive(Clone, Debug, PartialEq)]
pub struct KeptFilm {
    /// The film.
    pub film: Film,
    /// What it shows.
    pub fingerprint: [u8; 32],
    /// The writer's notes.
    pub notes: Vec<u8>,
}

/// Writes bytes to `path` so that they appear whole or not at all.
pub(super) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), ReferenceError> {
    let failed = |source| ReferenceError::Write { path: path.to_owned(), source };
    files::write_whole(path, |writer| writer.write_all(bytes)).map_err(failed)
}

impl Film {
    /// Writes the film to `path`, under the fingerprint of what it shows.
    ///
    /// # Errors
    /// [`ReferenceError::Write`].
    pub fn save_checkpoint(&self, path: &Path, fingerprint: &[u8; 32]) -> Result<(), ReferenceError> {
        self.keep(path, fingerprint, &[])
    }

    /// The same with notes.
    ///
    /// # Errors
    /// [`ReferenceError::Write`].
    pub fn keep(&self, path: &Path, fingerprint: &[u8; 32], notes: &[u8]) -> Result<(), ReferenceError> {
        let (width, height) = self.size();
        let mut bytes = Vec::with_capacity(HEADER + self.sums.len() * PIXEL + notes.len() + HASH);
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(fingerprint);
        for number in [width, height, self.first(), self.samples(), notes.len() as u32] {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
        for value in self.sums.iter().flat_map(|sum| sum.to_array()).chain(self.squares.iter().copied()) {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
        bytes.extend_from_slice(notes);
        let hash = blake3::hash(&bytes);
        bytes.extend_from_slice(hash.as_bytes());
        write_whole(path, &bytes)
    }

    /// Reads a film that [`Self::save_checkpoint`] wrote under the same fingerprint; `None` where there is no file.
    ///
    /// # Errors
    /// [`ReferenceError::Read`], [`ReferenceError::Checkpoint`] for a file that is damaged, [`ReferenceError::Stale`]
    /// for one of another fingerprint.
    pub fn load_checkpoint(path: &Path, fingerprint: &[u8; 32]) -> Result<Option<Self>, ReferenceError> {
        match KeptFilm::load(path)? {
            None => Ok(None),
            Some(kept) if kept.fingerprint == *fingerprint => Ok(Some(kept.film)),
            Some(_) => Err(ReferenceError::Stale { path: path.to_owned() }),
        }
    }
}

impl KeptFilm {
    /// Reads a film, whatever it shows; `None` where there is no file.
    ///
    /// # Errors
    /// [`ReferenceError::Read`], [`ReferenceError::Checkpoint`] for a file that is damaged.
    pub fn load(path: &Path) -> Result<Option<Self>, ReferenceError> {
        let bytes = match files::read_ordinary(path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(ReferenceError::Read { path: path.to_owned(), source }),
        };
        let damaged = |what| ReferenceError::Checkpoint { path: path.to_owned(), what };
        if !bytes.starts_with(MAGIC) {
            return Err(damaged("this is not a checkpoint of a reference render, or it has another version"));
        }
        let Some((content, hash)) = bytes.split_last_chunk::<HASH>() else { return Err(damaged("it is truncated")) };
        if blake3::hash(content).as_bytes() != hash {
            return Err(damaged("it is truncated or damaged"));
        }
        let Some((header, values)) = content.split_first_chunk::<HEADER>() else {
            return Err(damaged("it is truncated"));
        };
        let number = |at: usize| u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
        let [width, height, first, samples, notes] = [40, 44, 48, 52, 56].map(number);
        let pixels = u64::from(width) * u64::from(height);
        let expected = pixels.saturating_mul(PIXEL as u64).saturating_add(notes.into());
        if values.len() as u64 != expected || first.checked_add(samples).is_none() {
            return Err(damaged("its length does not fit its size"));
        }
        let (values, notes) = values.split_at(values.len() - notes as usize);
        let (values, _) = values.as_chunks::<8>();
        let values: Vec<f64> = values.iter().map(|value| f64::from_le_bytes(*value)).collect();
        if values.iter().any(|value| !value.is_finite()) {
            return Err(damaged("it holds values that are not numbers"));
        }
        let (sums, squares) = values.split_at(3 * pixels as usize);
        let sums = sums.chunks_exact(3).map(DVec3::from_slice).collect();
        let mut fingerprint = [0; 32];
        fingerprint.copy_from_slice(&header[8..40]);
        let film = Film::from_parts((width, height), first, samples, sums, squares.to_vec());
        Ok(Some(Self { film, fingerprint, notes: notes.to_vec() }))
    }
}
