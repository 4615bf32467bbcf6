//! The containers of glTF: GLB chunks, JSON, data URIs, external files.
//!
//! [glTF 2.0 specification, section 4 "GLB File Format Specification"]. The GLB reader of the `gltf` crate is not used,
//! because it subtracts the size of the header from an unchecked length.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use gltf::json;

use super::ExternalFiles;
use super::error::{EXPORT_AGAIN, Fault, PlantError, WarningKind, Warnings};
use super::meshopt::{self, Filter, Mode};

/// Where external files come from.
pub(super) enum Beside<'a> {
    /// In the folder of the file.
    Folder(&'a Path),
    /// In memory, by the paths that [`external_files`] lists.
    Memory(&'a ExternalFiles),
}

/// A parsed file: the JSON part and access to its bytes.
pub(super) struct Document<'a> {
    pub root: json::Root,
    /// The extras of each material.
    pub extras: Vec<Option<json::Value>>,
    beside: Beside<'a>,
    blob: Option<Vec<u8>>,
    /// The buffers that were read so far.
    buffers: Vec<Option<Vec<u8>>>,
    /// The compressed buffer views that were decoded so far.
    decoded: BTreeMap<usize, Vec<u8>>,
}

/// The extension of compressed buffer views.
pub(super) const MESHOPT: &str = "EXT_meshopt_compression";

/// Most bytes of a decoded buffer view.
const MOST_DECODED: usize = 1 << 30;

/// Parses `bytes`, the content of the file `path`. The content tells .gltf and .glb apart.
pub(super) fn open<'a>(
    bytes: &[u8],
    path: &Path,
    beside: Beside<'a>,
    warnings: &mut Warnings,
) -> Result<Document<'a>, PlantError> {
    let (text, blob) = split(bytes, path, warnings)?;
    let root = parse(text, path)?;
    let (buffers, extras) = (vec![None; root.buffers.len()], material_extras(text));
    Ok(Document { root, extras, beside, blob: blob.map(<[u8]>::to_vec), buffers, decoded: BTreeMap::new() })
}

/// The JSON text of a file, and the binary chunk of GLB.
fn split<'a>(
    bytes: &'a [u8],
    path: &Path,
    warnings: &mut Warnings,
) -> Result<(&'a [u8], Option<&'a [u8]>), PlantError> {
    let (text, blob) = if looks_binary(bytes, path) { split_glb(bytes, path, warnings)? } else { (bytes, None) };
    Ok((text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text), blob))
}

/// The extras of each material. `json::Root` leaves them out: the feature that keeps them keeps those of everything.
fn material_extras(text: &[u8]) -> Vec<Option<json::Value>> {
    #[derive(serde::Deserialize)]
    struct Extras {
        extras: Option<json::Value>,
    }
    #[derive(serde::Deserialize)]
    struct Materials {
        #[serde(default)]
        materials: Vec<Extras>,
    }
    let read = json::deserialize::from_slice::<Materials>(text);
    read.map_or_else(|_| Vec::new(), |read| read.materials.into_iter().map(|material| material.extras).collect())
}

/// The external files that the `bytes` of `path` name for buffers and images, each once: relative paths with forward
/// slashes, as written.
pub(super) fn external_files(bytes: &[u8], path: &Path) -> Result<Vec<String>, PlantError> {
    let (text, _) = split(bytes, path, &mut Warnings::default())?;
    let root = parse(text, path)?;
    let buffers = root.buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
    let images =
        root.images.iter().filter(|image| image.buffer_view.is_none()).filter_map(|image| image.uri.as_deref());
    let mut files: Vec<String> = buffers.chain(images).filter_map(|uri| relative_path(uri).ok()).collect();
    files.sort();
    files.dedup();
    Ok(files)
}

/// Whether a file is GLB, by its magic number. A .glb file without it is damaged GLB rather than JSON.
fn looks_binary(bytes: &[u8], path: &Path) -> bool {
    bytes.starts_with(b"glTF") || path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("glb"))
}

/// The little-endian word at `at`; `None` beyond the end.
fn word(bytes: &[u8], at: usize) -> Option<usize> {
    let word: [u8; 4] = bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
    usize::try_from(u32::from_le_bytes(word)).ok()
}

/// The JSON chunk and the BIN chunk of a GLB file.
fn split_glb<'a>(
    bytes: &'a [u8],
    path: &Path,
    warnings: &mut Warnings,
) -> Result<(&'a [u8], Option<&'a [u8]>), PlantError> {
    let damage = |offset: usize, what: String, remedy: &'static str| PlantError::Container {
        path: path.to_path_buf(),
        offset,
        what,
        remedy,
    };
    if !bytes.starts_with(b"glTF") {
        let what = if bytes.is_empty() { "the file is empty" } else { "the GLB magic number 'glTF' is missing" };
        return Err(damage(0, what.into(), "give a .glb or .gltf file; export or download it again"));
    }
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        return Err(damage(bytes.len(), "the GLB header of 12 bytes is cut off".into(), EXPORT_AGAIN));
    };
    if version != 2 {
        return Err(damage(4, format!("GLB version {version} instead of 2"), "convert the file to glTF 2.0"));
    }
    if length > bytes.len() {
        let what = format!("the header promises {length} bytes, the file has {}", bytes.len());
        return Err(damage(bytes.len(), what, EXPORT_AGAIN));
    }
    if length != bytes.len() {
        let message = format!("the header gives {length} bytes, the file has {}; the file's chunks count", bytes.len());
        warnings.push(WarningKind::Repaired, "", message);
    }

    let (mut json, mut blob, mut at) = (None, None, 12);
    while at < bytes.len() {
        let (Some(size), Some(kind)) = (word(bytes, at), bytes.get(at + 4..at + 8)) else {
            if json.is_some() {
                warnings.push(WarningKind::Ignored, "", format!("{} bytes after the last chunk", bytes.len() - at));
                break;
            }
            return Err(damage(at, "a chunk header of 8 bytes is cut off".into(), EXPORT_AGAIN));
        };
        let chunk = bytes.get(at + 8..).and_then(|rest| rest.get(..size));
        let Some(chunk) = chunk else {
            let what = format!("a chunk of {size} bytes does not fit into the {} that follow", bytes.len() - at - 8);
            return Err(damage(at, what, EXPORT_AGAIN));
        };
        match (kind, json, blob) {
            (b"JSON", None, _) => json = Some(chunk),
            (_, None, _) => return Err(damage(at, "the first chunk is not the JSON chunk".into(), EXPORT_AGAIN)),
            (b"BIN\0", _, None) => blob = Some(chunk),
            _ => warnings.push(WarningKind::Ignored, "", format!("a surplus GLB chunk at byte {at}")),
        }
        at += 8 + size;
    }
    match json {
        Some(json) => Ok((json, blob)),
        None => Err(damage(12, "there is no JSON chunk".into(), EXPORT_AGAIN)),
    }
}

/// Parses the JSON part. A second attempt corrects whole numbers written as 1.0 and scenes without a node list, which
/// glTF allows and the `gltf` crate does not.
fn parse(text: &[u8], path: &Path) -> Result<json::Root, PlantError> {
    let failed = |error: json::Error| PlantError::Json {
        path: path.to_path_buf(),
        line: error.line().max(1),
        column: error.column().max(1),
        what: without_position(&error.to_string()).to_owned(),
    };
    let root = json::deserialize::from_slice::<json::Root>(text).or_else(|error| {
        let mut value = json::deserialize::from_slice::<json::Value>(text).map_err(failed)?;
        normalize(&mut value);
        json::deserialize::from_value::<json::Root>(value).map_err(|_| failed(error))
    })?;
    let version = root.asset.min_version.as_deref().unwrap_or(&root.asset.version);
    if version.split('.').next() != Some("2") {
        return Err(PlantError::Unsupported {
            path: path.to_path_buf(),
            what: format!("glTF version {version}"),
            remedy: "convert the file to glTF 2.0",
        });
    }
    Ok(root)
}

/// The message of a JSON error without its own "at line ... column ...".
fn without_position(message: &str) -> &str {
    message.rsplit_once(" at line ").map_or(message, |(text, _)| text)
}

/// Turns integral floats into integers, and gives scenes a node list.
fn normalize(value: &mut json::Value) {
    if let Some(scenes) = value.get_mut("scenes").and_then(json::Value::as_array_mut) {
        for scene in scenes.iter_mut().filter_map(json::Value::as_object_mut) {
            scene.entry("nodes").or_insert_with(|| json::Value::Array(Vec::new()));
        }
    }
    integers(value);
}

fn integers(value: &mut json::Value) {
    // Above 2^53 a float is no longer an exact count.
    const EXACT: f64 = 9_007_199_254_740_992.0;
    let whole = value.as_f64().filter(|v| value.is_f64() && v.fract() == 0.0 && (0.0..EXACT).contains(v));
    match (whole, &mut *value) {
        (Some(whole), _) => *value = json::Value::from(whole as u64),
        (None, json::Value::Array(items)) => items.iter_mut().for_each(integers),
        (None, json::Value::Object(fields)) => fields.iter_mut().for_each(|(_, field)| integers(field)),
        _ => {}
    }
}

impl Document<'_> {
    /// The bytes of buffer view `index`, decompressed.
    pub fn view(&mut self, index: usize) -> Result<&[u8], Fault> {
        let compressed =
            self.root.buffer_views.get(index).and_then(|view| view.extensions.as_ref()?.others.get(MESHOPT).cloned());
        let Some(extension) = compressed else { return self.plain_view(index) };
        if !self.decoded.contains_key(&index) {
            let bytes = self.decode(index, &extension)?;
            self.decoded.insert(index, bytes);
        }
        Ok(self.decoded.get(&index).map(Vec::as_slice).unwrap_or_default())
    }

    /// Decodes a compressed buffer view.
    fn decode(&mut self, index: usize, extension: &json::Value) -> Result<Vec<u8>, Fault> {
        let location = format!("/bufferViews/{index}/extensions/{MESHOPT}");
        let damaged = |what: &str| Fault::new(location.clone(), what, EXPORT_AGAIN);
        let number = |name: &str| {
            extension.get(name).and_then(json::Value::as_u64).and_then(|number| usize::try_from(number).ok())
        };
        let text = |name: &str| extension.get(name).and_then(json::Value::as_str);
        let mode = match text("mode") {
            Some("ATTRIBUTES") => Mode::Attributes,
            Some("TRIANGLES") => Mode::Triangles,
            Some("INDICES") => Mode::Indices,
            _ => return Err(damaged("has an unknown mode")),
        };
        let filter = match text("filter") {
            None | Some("NONE") => Filter::None,
            Some("OCTAHEDRAL") => Filter::Octahedral,
            Some("QUATERNION") => Filter::Quaternion,
            Some("EXPONENTIAL") => Filter::Exponential,
            _ => return Err(damaged("has an unknown filter")),
        };
        let (Some(buffer), Some(length), Some(stride), Some(count)) =
            (number("buffer"), number("byteLength"), number("byteStride"), number("count"))
        else {
            return Err(damaged("lacks buffer, byteLength, byteStride or count"));
        };
        let begin = number("byteOffset").unwrap_or(0);
        // A compressed byte stands for some hundred at most.
        let used: usize = self.decoded.values().map(Vec::len).sum();
        let most = length.saturating_mul(1024).min(MOST_DECODED.saturating_sub(used));
        if count.checked_mul(stride).is_none_or(|bytes| bytes > most) {
            return Err(damaged("claims more than its bytes can hold"));
        }
        let bytes = self.buffer(buffer)?;
        let data = begin.checked_add(length).and_then(|end| bytes.get(begin..end));
        let data = data.ok_or_else(|| damaged("leaves its buffer"))?;
        meshopt::decode(data, mode, filter, count, stride).ok_or_else(|| damaged("cannot be decoded"))
    }

    /// The bytes of buffer view `index` as they are.
    fn plain_view(&mut self, index: usize) -> Result<&[u8], Fault> {
        let location = format!("/bufferViews/{index}");
        let views = self.root.buffer_views.len();
        let Some(view) = self.root.buffer_views.get(index) else {
            return Err(Fault::new(location, format!("does not exist, there are {views}"), EXPORT_AGAIN));
        };
        let buffer = view.buffer.value();
        let (offset, length) = (view.byte_offset.map_or(0, |offset| offset.0), view.byte_length.0);
        let bytes = self.buffer(buffer)?;
        let range =
            usize::try_from(offset).ok().zip(offset.checked_add(length).and_then(|end| usize::try_from(end).ok()));
        range.and_then(|(begin, end)| bytes.get(begin..end)).ok_or_else(|| {
            let what = format!("bytes {offset} to +{length} leave buffer {buffer} of {} bytes", bytes.len());
            Fault::new(location, what, EXPORT_AGAIN)
        })
    }

    /// The bytes of buffer `index`, read on the first call.
    fn buffer(&mut self, index: usize) -> Result<&[u8], Fault> {
        let location = format!("/buffers/{index}");
        let Some(slot) = self.buffers.get_mut(index) else {
            return Err(Fault::new(
                location,
                format!("does not exist, there are {}", self.root.buffers.len()),
                EXPORT_AGAIN,
            ));
        };
        if slot.is_none() {
            let buffer = &self.root.buffers[index];
            let length = buffer.byte_length.0;
            let bytes = match (&buffer.uri, &self.blob) {
                (Some(uri), _) => read_uri(uri, &self.beside, &location, Some(length))?,
                (None, Some(blob)) if index == 0 => blob.clone(),
                (None, _) => {
                    let what = "has neither a uri nor the binary chunk of a GLB file";
                    return Err(Fault::new(location, what, "keep the .bin file and its uri, or export as .glb"));
                }
            };
            if (bytes.len() as u64) < length {
                let what = format!("has {} bytes instead of the {length} that byteLength promises", bytes.len());
                return Err(Fault::new(location, what, EXPORT_AGAIN));
            }
            *slot = Some(bytes);
        }
        Ok(slot.as_deref().unwrap_or_default())
    }

    /// The encoded bytes of image `index`.
    pub fn image(&mut self, index: usize) -> Result<Vec<u8>, Fault> {
        let location = format!("/images/{index}");
        let Some(image) = self.root.images.get(index) else {
            return Err(Fault::new(location, "does not exist", "save the texture as PNG or JPEG and export again"));
        };
        match (image.buffer_view.map(|view| view.value()), image.uri.clone()) {
            (Some(view), _) => self.view(view).map(<[u8]>::to_vec),
            (None, Some(uri)) => read_uri(&uri, &self.beside, &location, None),
            (None, None) => Err(Fault::new(location, "has neither a uri nor a bufferView", EXPORT_AGAIN)),
        }
    }
}

/// The bytes of `uri`, which is a data URI or a path relative to the file. At most `limit` bytes are read.
fn read_uri(uri: &str, beside: &Beside, location: &str, limit: Option<u64>) -> Result<Vec<u8>, Fault> {
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((kind, payload)) = data.split_once(',') else {
            return Err(Fault::new(location, "the data URI has no comma", EXPORT_AGAIN));
        };
        return if kind.ends_with(";base64") {
            decode_base64(payload)
                .ok_or_else(|| Fault::new(location, "the base64 of its data URI is damaged", EXPORT_AGAIN))
        } else {
            Ok(decode_percent(payload))
        };
    }
    let relative = relative_path(uri).map_err(|path| {
        let what = format!("the uri '{}' is not a path beside the file", shortened(&path));
        Fault::new(location, what, "copy the data beside the .gltf file and name it by a relative path")
    })?;
    let bytes = match beside {
        Beside::Folder(folder) => read_file(&find(folder, uri, &relative), limit),
        Beside::Memory(files) => match files.get(&relative) {
            Some(Ok(bytes)) => {
                let end = limit.and_then(|limit| usize::try_from(limit).ok()).unwrap_or(usize::MAX).min(bytes.len());
                Ok(bytes[..end].to_vec())
            }
            Some(Err(reason)) => Err(reason.clone()),
            None => Err("it was not given".to_owned()),
        },
    };
    bytes.map_err(|reason| {
        let what = format!("the file '{}' cannot be read: {reason}", shortened(&relative));
        Fault::new(location, what, "put the file beside the .gltf file, or export as .glb, which holds everything")
    })
}

/// The relative path that `uri` encodes; `Err` with the decoded text if it is not a path but, for instance, a data URI
/// or a web address.
fn relative_path(uri: &str) -> Result<String, String> {
    // Some programs of Windows write its separators.
    let path = String::from_utf8_lossy(&decode_percent(uri)).replace('\\', "/");
    let scheme = path.split_once(':').is_some_and(|(scheme, _)| scheme.len() > 1 && !scheme.contains(['/', '\\']));
    if scheme || Path::new(&path).has_root() { Err(path) } else { Ok(path) }
}

/// The file that `uri`, decoded `relative`, means in `folder`: under that name, under the name without decoding (a percent
/// sign in a name), in another letter case, or, of a path that leads elsewhere, under its last name. The first name if
/// there is none.
fn find(folder: &Path, uri: &str, relative: &str) -> PathBuf {
    let written = uri.replace('\\', "/");
    let last = relative.rsplit('/').next().unwrap_or(relative);
    let names = [relative, written.as_str(), last];
    let exact = names.iter().map(|name| folder.join(name)).find(|path| path.is_file());
    let found = exact.or_else(|| names.iter().find_map(|name| in_any_case(folder, name)));
    found.unwrap_or_else(|| folder.join(relative))
}

/// A file of this relative path whose names differ only in letter case.
fn in_any_case(folder: &Path, relative: &str) -> Option<PathBuf> {
    let mut path = folder.to_owned();
    for name in relative.split('/').filter(|name| !name.is_empty() && *name != ".") {
        if name == ".." || path.join(name).exists() {
            path.push(name);
            continue;
        }
        let wanted = name.to_lowercase();
        let mut entries: Vec<_> = std::fs::read_dir(&path).ok()?.flatten().map(|entry| entry.file_name()).collect();
        entries.sort();
        path.push(entries.into_iter().find(|entry| entry.to_string_lossy().to_lowercase() == wanted)?);
    }
    path.is_file().then_some(path)
}

/// At most `limit` bytes of `file`, or the reason why it cannot be read.
fn read_file(file: &Path, limit: Option<u64>) -> Result<Vec<u8>, String> {
    if !std::fs::metadata(file).map_err(|error| error.to_string())?.is_file() {
        return Err("it is not a file".into());
    }
    let mut bytes = Vec::new();
    File::open(file)
        .and_then(|opened| opened.take(limit.unwrap_or(u64::MAX)).read_to_end(&mut bytes))
        .map_err(|error| error.to_string())?;
    Ok(bytes)
}

/// The first 80 characters of a text from a file, for messages.
fn shortened(text: &str) -> String {
    match text.char_indices().nth(80) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

/// Decodes percent escapes such as `%20` (RFC 3986, section 2.1). Anything else stays as it is.
fn decode_percent(text: &str) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let [first, tail @ ..] = rest {
        let digit = |byte: Option<&u8>| byte.and_then(|&byte| char::from(byte).to_digit(16));
        let escape = if *first == b'%' { digit(tail.first()).zip(digit(tail.get(1))) } else { None };
        if let Some((high, low)) = escape {
            bytes.push((high * 16 + low) as u8);
            rest = &tail[2..];
        } else {
            bytes.push(*first);
            rest = tail;
        }
    }
    bytes
}

/// Decodes base64 (RFC 4648, section 4), with or without padding; `None` if a character is invalid.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let digits = text.trim_end_matches('=').as_bytes();
    let mut bytes = Vec::with_capacity(digits.len() / 4 * 3 + 2);
    for group in digits.chunks(4) {
        let mut bits = 0u32;
        for &digit in group {
            let value = match digit {
                b'A'..=b'Z' => digit - b'A',
                b'a'..=b'z' => digit - b'a' + 26,
                b'0'..=b'9' => digit - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(value);
        }
        let count = match group.len() {
            4 => 3,
            3 => 2,
            2 => 1,
            _ => return None,
        };
        bits <<= 6 * (4 - group.len());
        bytes.extend_from_slice(&bits.to_be_bytes()[1..1 + count]);
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_rfc() {
        for (plain, encoded) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("fooba", "Zm9vYmE=")]
        {
            assert_eq!(decode_base64(encoded).as_deref(), Some(plain.as_bytes()));
        }
        assert_eq!(decode_base64("Zm9v!a=="), None);
        assert_eq!(decode_base64("Zm9vY"), None);
    }

    #[test]
    fn percent_escapes() {
        assert_eq!(decode_percent("a%20b%2"), b"a b%2");
        assert_eq!(decode_percent("%zz%"), b"%zz%");
    }
}
