//! Real data that is too large for the repository: the folder that `CANOPY_DATA` names.
//!
//! A test that reads it is marked `#[ignore = "needs the data folder CANOPY_DATA"]`, so that every run says how many did not
//! run. `./test` runs them where the folder is given; by hand: `cargo test --release -- --include-ignored`.

use std::path::PathBuf;

/// A file or folder of the data. A test that needs it fails where it is missing.
#[track_caller]
pub fn data(name: &str) -> PathBuf {
    let Some(folder) = std::env::var_os("CANOPY_DATA") else {
        panic!("CANOPY_DATA is not set: set it to the data folder, or leave out --include-ignored");
    };
    let path = PathBuf::from(folder).join(name);
    assert!(path.exists(), "{} does not exist: CANOPY_DATA names another folder, or one without it", path.display());
    path
}
