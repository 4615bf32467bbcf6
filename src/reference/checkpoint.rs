//! A film on disk, to go on with later.
//!
//! ```text
//! magic 8 | fingerprint 32 | width u32 | height u32 | samples u32 | sums 24 a pixel | squares 8 a pixel | BLAKE3 32
//! ```
//!
//! Little-endian. The fingerprint is that of everything the pixels depend on ([`super::PathTracer::fingerprint`]), the
//! hash at the end that of all bytes before it. The file appears whole or not at all: it is written under another name,
//! then renamed.

use std::io::ErrorKind;
use std::path::Path;

use glam::DVec3;

use super::error::ReferenceError;
use super::film::Film;
use crate::files;

const MAGIC: &[u8; 8] = b"CANOPYR1";
const HEADER: usize = 8 + 32 + 12;
const PIXEL: usize = 32;
const HASH: usize = 32;

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
        let (width, height) = self.size();
        let mut bytes = Vec::with_capacity(HEADER + self.sums.len() * PIXEL + HASH);
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(fingerprint);
        for number in [width, height, self.samples()] {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
        for value in self.sums.iter().flat_map(|sum| sum.to_array()).chain(self.squares.iter().copied()) {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
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
        if &header[8..40] != fingerprint {
            return Err(ReferenceError::Stale { path: path.to_owned() });
        }
        let [width, height, samples] =
            [40, 44, 48].map(|at| u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]));
        let pixels = u64::from(width) * u64::from(height);
        if values.len() as u64 != pixels.saturating_mul(PIXEL as u64) {
            return Err(damaged("its length does not fit its size"));
        }
        let (values, _) = values.as_chunks::<8>();
        let values: Vec<f64> = values.iter().map(|value| f64::from_le_bytes(*value)).collect();
        if values.iter().any(|value| !value.is_finite()) {
            return Err(damaged("it holds values that are not numbers"));
        }
        let (sums, squares) = values.split_at(3 * pixels as usize);
        let sums = sums.chunks_exact(3).map(DVec3::from_slice).collect();
        Ok(Some(Self::from_parts((width, height), samples, sums, squares.to_vec())))
    }
}
