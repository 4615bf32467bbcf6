//! The library apart from the program: what a Bevy program takes with `default-features = false`.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    process::Command,
};

use crate::support::program::listing;

/// Crates that only the program needs.
const PROGRAM: [&str; 8] = ["anyhow", "bevy_egui", "bevy_winit", "clap", "egui", "indicatif", "rusqlite", "winit"];

/// Names of all crates that the package is built from with these arguments.
fn crates(arguments: &[&str]) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--locked", "--edges", "normal", "--prefix", "none", "--format", "{p}"])
        .args(["--manifest-path", concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")])
        .args(arguments)
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.lines().filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect()
}

#[test]
fn the_library_needs_none_of_the_programs_crates() {
    let library = crates(&["--no-default-features"]);
    assert!(library.contains("bevy") && library.contains("canopy"), "{library:?}");
    let found: Vec<&str> = PROGRAM.into_iter().filter(|name| library.contains(*name)).collect();
    assert_eq!(found, Vec::<&str>::new());
    // A control: the program has them all.
    let program = crates(&[]);
    let missing: Vec<&str> = PROGRAM.into_iter().filter(|name| !program.contains(*name)).collect();
    assert_eq!(missing, Vec::<&str>::new());
}

/// What of `words` the Rust files of `folder` mention, those below `but` aside.
fn mentions(folder: &Path, but: &[PathBuf], words: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    let files = listing(folder).into_iter().filter(|file| file.extension().is_some_and(|ending| ending == "rs"));
    for file in files.filter(|file| !but.iter().any(|but| file.starts_with(but))) {
        let text = std::fs::read_to_string(&file).expect("a source file");
        let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        for (word, line) in code.flat_map(|line| words.iter().map(move |word| (word, line))) {
            if line.contains(word) {
                found.push(format!("{}: {line}", file.display()));
            }
        }
    }
    found
}

#[test]
fn the_library_names_neither_the_program_nor_a_window() {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let program = ["app", "cli", "main.rs"].map(|name| sources.join(name));
    let words = ["clap::", "egui::", "indicatif::", "anyhow::", "winit::", "window::", "input::"];
    assert_eq!(mentions(&sources, &program, &words), Vec::<String>::new());
    // A control: the program names what it uses.
    let found = mentions(&sources, &[], &words).join("\n");
    for word in words {
        assert!(found.contains(word), "no `{word}` in the program");
    }
}
