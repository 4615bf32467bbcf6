//! The rooms of `src` use each other as the table of ARCHITECTURE.md says, and nobody else.
//!
//! Read from the source text, so it holds for code behind any cargo feature; the table is read from the page, so that page
//! and test cannot disagree.

mod circles;
mod imports;
mod table;

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use circles::{Graph, circles};
use imports::{Import, imports, module_of};
use table::Table;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The files of `src`, by their path in it with forward slashes, with their text.
fn sources() -> BTreeMap<String, String> {
    let folder = root().join("src");
    let mut found = BTreeMap::new();
    let mut open: Vec<PathBuf> = vec![folder.clone()];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            let parts = path.strip_prefix(&folder).unwrap().iter().map(|part| part.to_str().unwrap());
            let name = parts.collect::<Vec<_>>().join("/");
            found.insert(name, fs::read_to_string(&path).unwrap());
        }
    }
    found
}

fn architecture() -> Table {
    Table::parse(&fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap()).unwrap()
}

/// The modules that the files define.
fn modules<'a>(files: impl Iterator<Item = &'a String>) -> BTreeSet<Vec<String>> {
    files.map(|file| module_of(file)).filter(|module| !module.is_empty()).collect()
}

/// Everything that the files name of each other.
fn all_imports(sources: &BTreeMap<String, String>) -> Vec<Import> {
    let modules = modules(sources.keys());
    sources.iter().flat_map(|(file, text)| imports(file, text, &modules)).collect()
}

/// The room of a file: the folder of `src` that it is in, or its own name.
fn room_of(file: &str) -> &str {
    file.split('/').next().unwrap_or(file).trim_end_matches(".rs")
}

/// Each import that the table does not allow, as a message with file and line. `rooms` are the top-level modules: what else
/// the crate's root offers, its facade, is nobody's room.
fn offences(table: &Table, rooms: &BTreeSet<String>, imports: &[Import]) -> Vec<String> {
    let mut messages = Vec::new();
    for import in imports {
        let room = room_of(&import.file);
        let other = match import.path.first() {
            Some(first) if rooms.contains(first) => first.as_str(),
            _ => "lib",
        };
        // A file's own paths without a room lead to the root that it belongs to.
        if room == "main" && other == "lib" || table.allows(room, other) {
            continue;
        }
        let (file, line, path) = (&import.file, import.line, import.path.join("::"));
        messages.push(format!("src/{file}:{line}: `{room}` may not use `{other}` ({path}), says ARCHITECTURE.md"));
    }
    messages
}

fn rooms_of(sources: &BTreeMap<String, String>) -> BTreeSet<String> {
    sources.keys().map(|file| room_of(file).to_owned()).collect()
}

#[test]
fn rooms_use_what_the_table_allows_and_nothing_else() {
    let sources = sources();
    let offences = offences(&architecture(), &rooms_of(&sources), &all_imports(&sources));
    assert!(offences.is_empty(), "{}", offences.join("\n"));
}

#[test]
fn the_table_has_every_room_and_no_other() {
    let table = architecture();
    let rooms = rooms_of(&sources());
    assert_eq!(table.rooms().collect::<Vec<_>>(), rooms.iter().map(String::as_str).collect::<Vec<_>>());
}

#[test]
fn the_table_itself_has_no_circles() {
    assert_eq!(circles(&architecture().graph()), Vec::<Vec<String>>::new());
}

/// The control: lines that break the table must be found, with file and line, wherever and however they are written.
#[test]
fn a_line_that_breaks_the_table_is_reported() {
    let offending = [
        ("math/made_up.rs", "//! A page.\n\nuse crate::light::sh;\n", 3, "light"),
        ("terrain/made_up.rs", "fn f() -> f32 {\n    crate::render::gpu::SIZE\n}\n", 2, "render"),
        ("trace/made_up.rs", "use crate::{\n    math::hash,\n    bake::{self, BakedPlant},\n};\n", 3, "bake"),
        ("light/mod.rs", "use super::app::fly;\n", 1, "app"),
        ("plant/grow/made_up.rs", "mod tests {\n    use super::super::super::super::bake::lighting;\n}\n", 2, "bake"),
        ("scatter/made_up.rs", "use crate::prelude::Forest;\n", 1, "lib"),
        ("render/made_up.rs", "use crate::app::Stage;\n", 1, "app"),
    ];
    let real = sources();
    for (file, text, line, other) in offending {
        let mut changed = real.clone();
        changed.insert(file.to_owned(), text.to_owned());
        let found = offences(&architecture(), &rooms_of(&changed), &all_imports(&changed));
        let place = format!("src/{file}:{line}: `{}` may not use `{other}`", room_of(file));
        assert!(found.iter().any(|message| message.starts_with(&place)), "{place} is not in {found:?}");
    }
}

/// Which file of `folder` names which other one: the file-level graph of a room.
fn files_graph(folder: &str, sources: &BTreeMap<String, String>) -> Graph {
    let inside = |file: &&String| file.starts_with(&format!("{folder}/"));
    let files: BTreeMap<Vec<String>, &String> = sources.keys().filter(inside).map(|f| (module_of(f), f)).collect();
    let mut graph: Graph = files.values().map(|file| ((*file).clone(), BTreeSet::new())).collect();
    for import in all_imports(sources) {
        // The longest beginning of the path that is a file's module.
        let target = (1..=import.path.len()).rev().find_map(|length| files.get(&import.path[..length]));
        if let (Some(target), Some(edges)) = (target, graph.get_mut(&import.file))
            && **target != import.file
        {
            edges.insert((*target).clone());
        }
    }
    graph
}

#[test]
fn circles_of_files_are_found() {
    let files = |made_up: &[(&str, &str)]| -> BTreeMap<String, String> {
        made_up.iter().map(|(file, text)| ((*file).to_owned(), (*text).to_owned())).collect()
    };
    let floors = [
        ("render/mod.rs", "mod frame;\nmod sky;\nuse frame::Frame;\nuse sky::Sky;"),
        ("render/frame.rs", "use crate::light::LightState;\nmod tests { use super::*; }"),
        ("render/sky.rs", "use super::frame::Frame;"),
        ("light/mod.rs", "use crate::render::sky::Sky;"),
    ];
    assert!(circles(&files_graph("render", &files(&floors))).is_empty());

    let mut circle = floors;
    circle[1].1 = "use crate::render::sky::Sky;";
    assert_eq!(circles(&files_graph("render", &files(&circle))), [["render/frame.rs", "render/sky.rs"]]);

    // A child that uses what its parent defines, while the parent uses the child.
    circle = floors;
    circle[2].1 = "use super::Layer;";
    assert_eq!(circles(&files_graph("render", &files(&circle))), [["render/mod.rs", "render/sky.rs"]]);
}

/// Places in the render room that name the filters of plant textures: those take up to seconds, so a frame may not wait
/// for them. The bake filters.
fn filters_in_render(sources: &BTreeMap<String, String>) -> Vec<String> {
    let is_filter = |import: &&Import| {
        room_of(&import.file) == "render" && import.path.starts_with(&["plant".to_owned(), "texture".to_owned()])
    };
    let place = |import: &Import| format!("src/{}:{}: {}", import.file, import.line, import.path.join("::"));
    all_imports(sources).iter().filter(is_filter).map(place).collect()
}

#[test]
fn the_render_room_filters_no_texture() {
    let mut sources = sources();
    assert_eq!(filters_in_render(&sources), Vec::<String>::new());
    // The control.
    let text = "use crate::plant::{\n    PartKind,\n    texture::{color_mips, leaf_mips},\n};\n";
    sources.insert("render/forest/made_up.rs".to_owned(), text.to_owned());
    let found = filters_in_render(&sources);
    assert!(found.iter().any(|place| place.starts_with("src/render/forest/made_up.rs:3")), "{found:?}");
}

#[test]
fn render_has_no_circles() {
    let circles = circles(&files_graph("render", &sources()));
    assert!(circles.is_empty(), "these files of the render room use each other in circles: {circles:#?}");
}
