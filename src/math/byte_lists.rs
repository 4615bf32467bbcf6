//! Lists of bytes for `serde`, each written and read as a whole. As a list of numbers, `serde` reads byte by byte, which takes
//! most of the time of loading a plant from the cache.

use serde::{Deserialize, Deserializer, Serializer};
use serde_bytes::{ByteBuf, Bytes};

/// Writes the lists; the same bytes as without this module, in formats that do not distinguish bytes from numbers.
///
/// # Errors
/// Those of the serializer.
pub fn serialize<S: Serializer>(lists: &[Vec<u8>], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(lists.iter().map(|list| Bytes::new(list)))
}

/// Reads what [`serialize`] wrote.
///
/// # Errors
/// Those of the deserializer.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Vec<u8>>, D::Error> {
    let lists = Vec::<ByteBuf>::deserialize(deserializer)?;
    Ok(lists.into_iter().map(ByteBuf::into_vec).collect())
}
