//! What tells a scene with its files from others, wherever they lie.

use std::path::{Path, PathBuf};

use crate::{
    scene::{Ground, GrownForm, Overrides, PlantSource, Scene, Trees},
    style::Palette,
};

/// 32 hexadecimal digits that follow from the scene's values, the content of the files that it names, and the version of the
/// program, but not from the names of files and folders. Files that these files name in turn (a glTF file's textures) have no
/// influence. A file that cannot be read counts as empty.
pub fn fingerprint(scene: &Scene) -> String {
    let mut bare = scene.clone();
    let mut hasher = blake3::Hasher::new();
    bare.file = None;
    take_files(&mut hasher, &mut bare);
    hasher.update(format!("{} {bare:?}", env!("CARGO_PKG_VERSION")).as_bytes());
    hasher.finalize().to_hex()[..32].to_owned()
}

/// 32 hexadecimal digits that follow from the content of the scene's file, of those that it names, and from what `overrides` replace in
/// it. Another version of the program, whose scenes may have more values, has the same.
pub fn source_fingerprint(scene: &Scene, overrides: &Overrides) -> String {
    let mut bare = scene.clone();
    let mut hasher = blake3::Hasher::new();
    let file = bare.file.take();
    if let Some(file) = &file {
        hash(&mut hasher, file);
    }
    take_files(&mut hasher, &mut bare);
    if file.is_none() {
        hasher.update(format!("{bare:?}").as_bytes());
    }
    hasher.update(format!("{overrides:?}").as_bytes());
    hasher.finalize().to_hex()[..32].to_owned()
}

/// Hashes the files that `scene` names, and takes their names out of it.
fn take_files(hasher: &mut blake3::Hasher, scene: &mut Scene) {
    for path in paths(scene) {
        hash(hasher, path);
        *path = PathBuf::new();
    }
    if let Some(palette) = scene.style.palette_mut().filter(|palette| Palette::is_file(palette)) {
        hash(hasher, Path::new(palette.as_str()));
        palette.clear();
    }
}

fn hash(hasher: &mut blake3::Hasher, path: &Path) {
    // A pipe, which might never end, is not read.
    if path.is_file()
        && let Ok(file) = std::fs::File::open(path)
    {
        let _ = hasher.update_reader(file);
    }
    hasher.update(b"\0");
}

/// The files that a scene names.
fn paths(scene: &mut Scene) -> Vec<&mut PathBuf> {
    let mut paths = Vec::new();
    match &mut scene.terrain {
        Ground::File(file) => {
            paths.push(&mut file.path);
            paths.extend(&mut file.tiles);
        }
        Ground::Image(image) => paths.push(&mut image.path),
        Ground::Noise(_) | Ground::Flat(_) => {}
    }
    if let Some(drape) = &mut scene.drape {
        paths.push(&mut drape.path);
        paths.extend(&mut drape.tiles);
    }
    if let Trees::Inventory(inventory) = &mut scene.trees {
        paths.push(&mut inventory.path);
    }
    for species in &mut scene.species {
        match &mut species.plant {
            PlantSource::Gltf(gltf) => paths.extend(gltf.files.iter_mut()),
            PlantSource::Grown(grown) => {
                if let GrownForm::File(path) = &mut grown.form {
                    paths.push(path);
                }
            }
        }
    }
    paths
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        scene::{GltfPlants, Species},
        style::{Style, Watercolour},
    };

    fn folder_of(folder: &Path, name: &str) -> PathBuf {
        folder.join(name).join("palette.ron")
    }

    #[test]
    fn a_scene_is_known_by_its_values_and_the_content_of_its_files() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        let folder_path = folder.path().to_owned();
        let scene = |name: &str| {
            let plant = GltfPlants::new([folder.path().join(name)]);
            Scene { species: vec![Species::new("oak", plant)], ..Scene::default() }
        };
        std::fs::write(folder.path().join("a.glb"), "one")?;
        std::fs::write(folder.path().join("b.glb"), "one")?;
        let first = fingerprint(&scene("a.glb"));
        assert!(first.len() == 32 && first == fingerprint(&scene("b.glb")));
        assert_ne!(first, fingerprint(&Scene { seed: 2, ..scene("a.glb") }));
        std::fs::write(folder.path().join("b.glb"), "two")?;
        assert_ne!(first, fingerprint(&scene("b.glb")));
        assert_ne!(first, fingerprint(&scene("none.glb")));

        // A report is compared with one of the same scene, which another folder or a rule of the program does not change.
        std::fs::write(folder.path().join("c.ron"), "scene")?;
        std::fs::write(folder.path().join("d.ron"), "scene")?;
        let read = |file: &str, seed: u64| Scene { file: Some(folder.path().join(file)), seed, ..scene("a.glb") };
        let none = Overrides::default();
        let first = source_fingerprint(&read("c.ron", 1), &none);
        assert_eq!(first, source_fingerprint(&read("d.ron", 1), &none));
        let seed = Overrides { seed: Some(2), ..Overrides::default() };
        assert_ne!(first, source_fingerprint(&read("c.ron", 2), &seed));
        std::fs::write(folder.path().join("a.glb"), "three")?;
        assert_ne!(first, source_fingerprint(&read("c.ron", 1), &none));

        // Once a palette counted by the place of its file, not by its pigments.
        let painted = |folder: &str| {
            let palette = folder_of(&folder_path, folder).to_string_lossy().into_owned();
            Scene { style: Style::Watercolour(Watercolour { palette, ..Watercolour::default() }), ..Scene::default() }
        };
        for (name, text) in [("x", "(one)"), ("y", "(one)"), ("z", "(two)")] {
            std::fs::create_dir(folder_path.join(name))?;
            std::fs::write(folder_of(&folder_path, name), text)?;
        }
        let first = fingerprint(&painted("x"));
        assert!(first == fingerprint(&painted("y")) && first != fingerprint(&painted("z")));
        Ok(())
    }
}
