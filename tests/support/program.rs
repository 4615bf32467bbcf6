//! The program as a user calls it.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};

/// Calls `canopy`.
pub fn canopy<S: AsRef<std::ffi::OsStr>>(arguments: &[S]) -> std::io::Result<Output> {
    command(arguments).output()
}

/// `canopy` with arguments, ready to be given an environment.
pub fn command<S: AsRef<std::ffi::OsStr>>(arguments: &[S]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_canopy"));
    // Mesa's device selection layer prints its own warning if there is no Wayland display.
    command.env("NODEVICE_SELECT", "1");
    command.args(arguments).stdin(Stdio::null());
    command
}

/// What the program said on its error stream.
pub fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// All files and folders below `folder`.
pub fn listing(folder: &Path) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(&next).into_iter().flatten().flatten() {
            if entry.path().is_dir() {
                open.push(entry.path());
            }
            found.insert(entry.path());
        }
    }
    found
}
