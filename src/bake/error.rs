//! Errors of the bake cache.

use std::path::PathBuf;

/// Why a baked plant could not be cached. The bakes themselves cannot fail.
#[derive(Debug, thiserror::Error)]
pub enum BakeError {
    /// The cache folder does not exist and cannot be created.
    #[error(
        "cannot create the cache folder {}: {source}; set CANOPY_CACHE to a folder that can be written, or bake \
         without a cache",
        path.display()
    )]
    CacheFolder {
        /// The folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A baked plant could not be written into the cache.
    #[error(
        "cannot write {} into the cache: {source}; the result is good but will be computed again next time: free \
         space there or set CANOPY_CACHE to another folder",
        path.display()
    )]
    CacheWrite {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}
