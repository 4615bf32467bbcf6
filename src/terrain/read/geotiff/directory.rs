//! The directories of a TIFF [Adobe 1992, TIFF 6.0, section 2; BigTIFF], looked at before they are read.
//!
//! The crate that reads them reserves memory for as many values as a tag counts. Seven kilobytes can count a billion, so
//! every count is held against the length of the file first.

use std::io::{Read, Seek, SeekFrom};

use super::super::{Input, Source};
use super::FETCH;
use crate::terrain::TerrainError;

/// Entries of a directory; real ones have a few dozen.
const MOST_ENTRIES: u64 = 4096;
/// Directories of a file that are looked at: the raster, its overviews and their masks.
const MOST_IMAGES: usize = 64;

/// Bytes of one value of a type; the largest for a type that is not known.
fn size_of_type(kind: u16) -> u64 {
    match kind {
        1 | 2 | 6 | 7 => 1,
        3 | 8 => 2,
        4 | 9 | 11 | 13 => 4,
        _ => 8,
    }
}

/// The next `bytes` bytes (at most 8) as a number.
fn number(input: &mut Input, bytes: usize, little: bool) -> std::io::Result<u64> {
    let mut buffer = [0; 8];
    let used = &mut buffer[..bytes];
    input.read_exact(used)?;
    if little {
        used.reverse();
    }
    Ok(used.iter().fold(0, |value, byte| value << 8 | u64::from(*byte)))
}

/// An entry of a directory: a tag with its values.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub tag: u16,
    pub kind: u16,
    pub count: u64,
    /// Position of the entry in the file.
    pub at: u64,
    /// The values themselves, or where they are, as a number of the size of an offset.
    field: u64,
}

/// The directories of a file.
#[derive(Debug)]
pub(super) struct Directory {
    pub little: bool,
    pub big: bool,
    /// The images in the order of the file; the first is the raster.
    pub images: Vec<Vec<Entry>>,
}

impl Directory {
    /// Reads the directories of a file.
    ///
    /// # Errors
    /// [`TerrainError::Malformed`] if the first counts more values than the file has bytes for; [`TerrainError::Io`] if the
    /// file cannot be opened.
    pub fn read(source: &Source) -> Result<Self, TerrainError> {
        let mut input = source.open()?;
        let broken = |problem: String| source.malformed("TIFF directory", problem, FETCH);
        let mut directory = Self { little: true, big: false, images: Vec::new() };
        let start = directory.start(&mut input).map_err(|error| broken(error.to_string()))?;
        let (mut next, mut seen) = (start, Vec::new());
        while next != 0 && !seen.contains(&next) && seen.len() < MOST_IMAGES {
            seen.push(next);
            match directory.image(&mut input, next, source.length) {
                Ok(Ok((image, after))) => {
                    directory.images.push(image);
                    next = after;
                }
                Ok(Err(problem)) if directory.images.is_empty() => return Err(broken(problem)),
                Err(error) if directory.images.is_empty() => return Err(broken(error.to_string())),
                // What follows the raster may be damaged: it is done without.
                Ok(Err(_)) | Err(_) => break,
            }
        }
        Ok(directory)
    }

    fn start(&mut self, input: &mut Input) -> std::io::Result<u64> {
        let mut start = [0; 4];
        input.read_exact(&mut start)?;
        self.little = start[0] == b'I';
        self.big = start[2..] == *b"+\0" || start[2..] == *b"\0+";
        if self.big {
            // The size of an offset, always 8, and a zero.
            number(input, 4, self.little)?;
        }
        number(input, self.width(), self.little)
    }

    /// Bytes of an offset.
    fn width(&self) -> usize {
        if self.big { 8 } else { 4 }
    }

    /// The entries of the directory at `offset` and the offset of the next one, or what is wrong with it.
    fn image(&self, input: &mut Input, offset: u64, length: u64) -> std::io::Result<Result<(Vec<Entry>, u64), String>> {
        input.seek(SeekFrom::Start(offset))?;
        let head = if self.big { 8 } else { 2 };
        let entries = number(input, head, self.little)?;
        if entries > MOST_ENTRIES {
            return Ok(Err(format!("it has {entries} entries")));
        }
        let mut image = Vec::new();
        for index in 0..entries {
            let tag = number(input, 2, self.little)? as u16;
            let kind = number(input, 2, self.little)? as u16;
            let count = number(input, self.width(), self.little)?;
            let field = number(input, self.width(), self.little)?;
            if count.saturating_mul(size_of_type(kind)) > length {
                return Ok(Err(format!("tag {tag} counts {count} values in a file of {length} bytes")));
            }
            let at = offset + head as u64 + index * (4 + 2 * self.width() as u64);
            image.push(Entry { tag, kind, count, at, field });
        }
        // A file may end behind its last directory.
        Ok(Ok((image, number(input, self.width(), self.little).unwrap_or(0))))
    }

    /// The entry of a tag of an image.
    pub fn entry(&self, image: usize, tag: u16) -> Option<&Entry> {
        self.images.get(image)?.iter().find(|entry| entry.tag == tag)
    }

    /// The whole numbers of a tag; empty if it is missing or of another type.
    pub fn values(&self, input: &mut Input, image: usize, tag: u16) -> Vec<u64> {
        let Some(entry) = self.entry(image, tag) else { return Vec::new() };
        let size = match entry.kind {
            1 | 3 | 4 | 13 | 16 => size_of_type(entry.kind) as usize,
            _ => return Vec::new(),
        };
        let width = self.width();
        if entry.count.saturating_mul(size as u64) <= width as u64 {
            let bytes = entry.field.to_be_bytes();
            let mut bytes = bytes[8 - width..].to_vec();
            if self.little {
                bytes.reverse();
            }
            return bytes.chunks_exact(size).take(entry.count as usize).map(|part| self.of_bytes(part)).collect();
        }
        let mut bytes = Vec::new();
        let wanted = entry.count.saturating_mul(size as u64);
        let read =
            input.seek(SeekFrom::Start(entry.field)).and_then(|_| input.by_ref().take(wanted).read_to_end(&mut bytes));
        if read.is_err() {
            return Vec::new();
        }
        bytes.chunks_exact(size).map(|part| self.of_bytes(part)).collect()
    }

    /// The first whole number of a tag.
    pub fn value(&self, input: &mut Input, image: usize, tag: u16) -> Option<u64> {
        self.values(input, image, tag).first().copied()
    }

    fn of_bytes(&self, bytes: &[u8]) -> u64 {
        let fold = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
        if self.little { bytes.iter().rev().fold(0, fold) } else { bytes.iter().fold(0, fold) }
    }

    /// The bytes of a number of `bytes` bytes (at most 8).
    pub fn to_bytes(&self, value: u64, bytes: usize) -> Vec<u8> {
        if self.little { value.to_le_bytes()[..bytes].to_vec() } else { value.to_be_bytes()[8 - bytes..].to_vec() }
    }

    /// The bytes of an entry with `count` values of 4 or 8 bytes, of which `field` is the only one or the place.
    pub fn entry_of_offsets(&self, tag: u16, count: u64, field: u64) -> Vec<u8> {
        let (kind, width) = if self.big { (16, 8) } else { (4, 4) };
        [
            self.to_bytes(u64::from(tag), 2),
            self.to_bytes(kind, 2),
            self.to_bytes(count, width),
            self.to_bytes(field, width),
        ]
        .concat()
    }

    /// The bytes of an entry with one value of 2 bytes.
    pub fn entry_of_short(&self, tag: u16, value: u16) -> Vec<u8> {
        let width = self.width();
        let mut bytes = [
            self.to_bytes(u64::from(tag), 2),
            self.to_bytes(3, 2),
            self.to_bytes(1, width),
            self.to_bytes(u64::from(value), 2),
        ]
        .concat();
        bytes.resize(4 + 2 * width, 0);
        bytes
    }
}
