//! The directory of a TIFF [Adobe 1992, TIFF 6.0, section 2; BigTIFF], looked at before it is read.
//!
//! The crate that reads it reserves memory for as many values as a tag counts. Seven kilobytes can count a billion, so
//! every count is held against the length of the file first.

use std::io::{Read, Seek, SeekFrom};

use super::super::{Input, Source};
use super::FETCH;
use crate::terrain::TerrainError;

/// Entries of a directory; real ones have a few dozen.
const MOST_ENTRIES: u64 = 4096;

/// Bytes of one value of a type; the largest for a type that is not known.
fn size_of_type(kind: u64) -> u64 {
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

/// Refuses a file whose first directory counts more values than the file has bytes for.
///
/// # Errors
/// [`TerrainError::Malformed`]; [`TerrainError::Io`] if the file cannot be opened.
pub(super) fn check(source: &Source) -> Result<(), TerrainError> {
    let mut input = source.open()?;
    let problem = problem(&mut input, source.length);
    let problem = problem.map_err(|error| source.malformed("TIFF directory", error, FETCH))?;
    problem.map_or(Ok(()), |problem| Err(source.malformed("TIFF directory", problem, FETCH)))
}

/// What is wrong with the first directory of a file of `length` bytes, if anything is.
fn problem(input: &mut Input, length: u64) -> std::io::Result<Option<String>> {
    let mut start = [0; 4];
    input.read_exact(&mut start)?;
    let little = start[0] == b'I';
    let big = start[2..] == *b"+\0" || start[2..] == *b"\0+";
    let offset = if big {
        // The size of an offset, always 8, and a zero.
        number(input, 4, little)?;
        number(input, 8, little)?
    } else {
        number(input, 4, little)?
    };
    input.seek(SeekFrom::Start(offset))?;
    let (bytes_of_entries, bytes_of_count) = if big { (8, 8) } else { (2, 4) };
    let entries = number(input, bytes_of_entries, little)?;
    if entries > MOST_ENTRIES {
        return Ok(Some(format!("it has {entries} entries")));
    }
    for _ in 0..entries {
        let tag = number(input, 2, little)?;
        let kind = number(input, 2, little)?;
        let count = number(input, bytes_of_count, little)?;
        // The values themselves, or where they are.
        number(input, bytes_of_count, little)?;
        if count.saturating_mul(size_of_type(kind)) > length {
            return Ok(Some(format!("tag {tag} counts {count} values in a file of {length} bytes")));
        }
    }
    Ok(None)
}
