//! What a failed load says to a user.

use bevy::asset::AssetLoadError;

use super::StageError;

/// Why an asset could not be loaded: the file, the place in it and the remedy, without the stack that Bevy adds where
/// backtraces are on.
pub fn load_error(error: &AssetLoadError) -> String {
    let AssetLoadError::AssetLoaderError(failed) = error else { return error.to_string() };
    match failed.error().downcast_ref::<StageError>() {
        Some(reason) => format!("the asset {}: {reason}", failed.path()),
        None => error.to_string(),
    }
}
