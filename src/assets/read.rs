//! Reading through Bevy's asset sources.

use std::{
    io,
    path::{Component, Path, PathBuf},
};

use bevy::asset::{AssetPath, LoadContext, ReadAssetBytesError, io::Reader};

use super::StageError;

/// All bytes of the file `path` that is being loaded.
///
/// # Errors
/// [`StageError::Read`].
pub async fn all(reader: &mut dyn Reader, path: &Path) -> Result<Vec<u8>, StageError> {
    let mut bytes = Vec::new();
    let read = reader.read_to_end(&mut bytes).await;
    read.map_err(|source| StageError::Read { path: path.to_owned(), source })?;
    Ok(bytes)
}

/// The bytes of `path` in the asset source of the file that is being loaded, of which it becomes a dependency.
///
/// # Errors
/// The source's reason.
pub async fn beside(context: &mut LoadContext<'_>, path: &Path) -> io::Result<Vec<u8>> {
    let source = context.path().source().clone_owned();
    let address = AssetPath::from_path_buf(normalized(path)).with_source(source);
    context.read_asset_bytes(address).await.map_err(|error| match error {
        ReadAssetBytesError::Io { source, .. } => source,
        ReadAssetBytesError::AssetReaderError(bevy::asset::io::AssetReaderError::NotFound(_)) => {
            io::Error::new(io::ErrorKind::NotFound, "there is no such file")
        }
        other => io::Error::other(other.to_string()),
    })
}

/// `path` without `.` and `..` where that is possible: asset sources other than folders have no parent folders.
fn normalized(path: &Path) -> PathBuf {
    let mut parts = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if parts.file_name().is_some() => {
                parts.pop();
            }
            part => parts.push(part),
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parents_are_resolved() {
        for (path, expected) in [
            ("a/b.glb", "a/b.glb"),
            ("a/../b.glb", "b.glb"),
            ("./a/./b/../../c.bin", "c.bin"),
            ("../a.glb", "../a.glb"),
            ("../../a/../b.glb", "../../b.glb"),
        ] {
            assert_eq!(normalized(path.as_ref()), Path::new(expected));
        }
    }
}
