//! A TIFF as the crate that reads it wants it: some entries of its directories are replaced, and decoded data stand behind
//! its end.
//!
//! - The crate inverts samples whose photometric interpretation says that 0 is white, and refuses masks. Heights and masks
//!   are numbers, not shades: the interpretation is replaced by "0 is black".
//! - The crate does not read Zstandard (compression 50000) without a library in C. The strips or tiles are decoded here [RFC
//!   8878, crate `ruzstd`] and named as uncompressed ones.

use std::io::{Read, Seek, SeekFrom};

use super::super::{Input, Source};
use super::directory::Directory;
use super::{FETCH, MAX_CHUNK, MAX_EXPANSION};
use crate::terrain::{MAX_SAMPLES, TerrainError};

const COMPRESSION: u16 = 259;
const INTERPRETATION: u16 = 262;
const ZSTANDARD: u64 = 50_000;

/// The file with its replacements.
pub(super) struct Overlay<'a> {
    inner: Input<'a>,
    /// Bytes of the file.
    length: u64,
    position: u64,
    /// Replaced bytes: where, and by what.
    patches: Vec<(u64, Vec<u8>)>,
    /// Bytes behind the end of the file.
    tail: Vec<u8>,
}

impl<'a> Overlay<'a> {
    /// Prepares `images` of the file; `directory` are its directories.
    ///
    /// # Errors
    /// [`TerrainError::Unsupported`] for a compression that is not read, [`TerrainError::Malformed`] for damaged data.
    pub fn new(source: &Source<'a>, directory: &Directory, images: &[usize]) -> Result<Self, TerrainError> {
        let mut overlay =
            Self { inner: source.open()?, length: source.length, position: 0, patches: Vec::new(), tail: Vec::new() };
        for image in images {
            if let Some(entry) = directory.entry(*image, INTERPRETATION) {
                let kind = directory.value(&mut overlay.inner, *image, INTERPRETATION);
                if matches!(kind, Some(0 | 4)) {
                    overlay.patches.push((entry.at, directory.entry_of_short(INTERPRETATION, 1)));
                }
            }
            let compression = directory.value(&mut overlay.inner, *image, COMPRESSION).unwrap_or(1);
            let prepared = match compression {
                ZSTANDARD => overlay.unpack(source, directory, *image),
                _ => check_compression(source, compression),
            };
            // The heights are in the first image. A mask that cannot be read is reported where it is read.
            if *image == 0 {
                prepared?;
            }
        }
        overlay.inner.seek(SeekFrom::Start(0)).map_err(|error| source.malformed("start of file", error, FETCH))?;
        Ok(overlay)
    }

    /// Decodes the strips or tiles of an image that are compressed with Zstandard.
    fn unpack(&mut self, source: &Source, directory: &Directory, image: usize) -> Result<(), TerrainError> {
        let broken = |problem: String| source.malformed("Zstandard data", problem, FETCH);
        let (offsets_tag, sizes_tag) = if directory.entry(image, 324).is_some() { (324, 325) } else { (273, 279) };
        let mut offsets = directory.values(&mut self.inner, image, offsets_tag);
        let mut sizes = directory.values(&mut self.inner, image, sizes_tag);
        if offsets.len() != sizes.len() {
            return Err(broken(format!("{} places and {} sizes of strips or tiles", offsets.len(), sizes.len())));
        }
        for (offset, size) in offsets.iter_mut().zip(&mut sizes) {
            if *size == 0 {
                continue;
            }
            if *size > self.length {
                return Err(broken(format!("a strip or tile of {size} bytes")));
            }
            let mut packed = Vec::new();
            let read = self.inner.seek(SeekFrom::Start(*offset));
            read.and_then(|_| self.inner.by_ref().take(*size).read_to_end(&mut packed))
                .map_err(|error| broken(error.to_string()))?;
            let most = (*size).saturating_mul(MAX_EXPANSION).min(MAX_CHUNK as u64);
            let begin = self.tail.len();
            let decoder =
                ruzstd::decoding::StreamingDecoder::new(&packed[..]).map_err(|error| broken(error.to_string()))?;
            decoder.take(most).read_to_end(&mut self.tail).map_err(|error| broken(error.to_string()))?;
            if self.tail.len() > 8 * MAX_SAMPLES {
                return Err(source.unsupported(
                    "more compressed samples than are read at once",
                    "cut it: `gdalwarp -te <west> <south> <east> <north> IN OUT.tif`",
                ));
            }
            (*offset, *size) = (self.length + begin as u64, (self.tail.len() - begin) as u64);
        }
        self.replace(directory, image, offsets_tag, &offsets);
        self.replace(directory, image, sizes_tag, &sizes);
        if let Some(entry) = directory.entry(image, COMPRESSION) {
            self.patches.push((entry.at, directory.entry_of_short(COMPRESSION, 1)));
        }
        Ok(())
    }

    /// Replaces the values of a tag.
    fn replace(&mut self, directory: &Directory, image: usize, tag: u16, values: &[u64]) {
        let Some(entry) = directory.entry(image, tag) else { return };
        let field = match values {
            [value] => *value,
            values => {
                let place = self.length + self.tail.len() as u64;
                let width = if directory.big { 8 } else { 4 };
                for value in values {
                    self.tail.extend(directory.to_bytes(*value, width));
                }
                place
            }
        };
        self.patches.push((entry.at, directory.entry_of_offsets(tag, values.len() as u64, field)));
    }
}

/// Refuses a compression that is not read, with its name.
fn check_compression(source: &Source, compression: u64) -> Result<(), TerrainError> {
    let name = match compression {
        1 | 5 | 7 | 8 | 32_773 | 32_946 => return Ok(()),
        2..=4 => "fax",
        34_712 => "JPEG 2000",
        34_887 => "LERC",
        34_925 => "LZMA",
        50_001 => "WebP",
        50_002 => "JPEG XL",
        other => {
            return Err(source.unsupported(
                format!("its samples have compression {other}, which is not read here (the file may be sound)"),
                "write it anew: `gdal_translate -co COMPRESS=DEFLATE IN OUT.tif`",
            ));
        }
    };
    Err(source.unsupported(
        format!("its samples are compressed with {name}, which is not read here (the file may be sound)"),
        "write it anew: `gdal_translate -co COMPRESS=DEFLATE IN OUT.tif`",
    ))
}

impl Read for Overlay<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.position >= self.length {
            let at = usize::try_from(self.position - self.length).unwrap_or(usize::MAX);
            let rest = self.tail.get(at..).unwrap_or_default();
            let count = rest.len().min(buffer.len());
            buffer[..count].copy_from_slice(&rest[..count]);
            self.position += count as u64;
            return Ok(count);
        }
        let room = usize::try_from(self.length - self.position).unwrap_or(usize::MAX).min(buffer.len());
        let count = self.inner.read(&mut buffer[..room])?;
        let range = self.position..self.position + count as u64;
        for (start, bytes) in &self.patches {
            for (place, byte) in (*start..).zip(bytes) {
                if range.contains(&place) {
                    buffer[(place - range.start) as usize] = *byte;
                }
            }
        }
        self.position += count as u64;
        Ok(count)
    }
}

impl Seek for Overlay<'_> {
    fn seek(&mut self, target: SeekFrom) -> std::io::Result<u64> {
        let end = self.length + self.tail.len() as u64;
        let place = match target {
            SeekFrom::Start(place) => Some(place),
            SeekFrom::End(offset) => end.checked_add_signed(offset),
            SeekFrom::Current(offset) => self.position.checked_add_signed(offset),
        };
        let place = place.ok_or_else(|| std::io::Error::other("a place before the start of the file"))?;
        self.inner.seek(SeekFrom::Start(place.min(self.length)))?;
        self.position = place;
        Ok(place)
    }
}
