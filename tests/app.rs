//! The shipped scenes, built, and what `canopy info` says of files.

use std::path::{Path, PathBuf};

use canopy::{
    app::{AppError, info},
    assets::{Stage, StageError},
    bake::BakedPlant,
    plant::{LeafKind, PartKind},
    progress::Silent,
    scene::Scene,
};
use glam::Vec3;

use crate::support::{
    data::data,
    glb::TreeFile,
    stage::{Heard, built},
};

fn asset(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").join(name)
}

#[track_caller]
fn described(path: &Path) -> String {
    match info(path) {
        Ok(text) => text,
        Err(error) => panic!("{error}"),
    }
}

#[track_caller]
fn assert_says(text: &str, says: &[&str]) {
    for word in says {
        assert!(text.contains(word), "no `{word}` in:\n{text}");
    }
}

#[test]
fn the_demo_is_wooded_like_a_forest() {
    let mut heard = Heard::default();
    let stage = built(asset("scenes/demo.ron"), &mut heard);
    assert_eq!(heard.warnings, Vec::<String>::new());
    let trees = stage.stand.trees.len();
    assert!(trees >= 300_000, "{trees} trees");
    let extent = stage.terrain.extent();
    assert!((5_500.0..7_000.0).contains(&extent.x) && (5_500.0..7_000.0).contains(&extent.y), "{extent}");
    // Stems per hectare of the cells that lie on the terrain: at least 250 where trees stand, that is, in the cells
    // that are neither meadow nor its rim.
    let hectares = stage.stand.grid.size * stage.stand.grid.size * 1e-4;
    let mut density: Vec<f64> = stage.stand.cells.iter().map(|cell| f64::from(cell.count) / hectares).collect();
    density.sort_by(f64::total_cmp);
    assert!(density[density.len() / 2] >= 250.0, "the median is {}", density[density.len() / 2]);
    let noted = heard.notes.iter().find_map(|note| note.split_once(" stems per hectare"));
    let noted: f64 = noted.and_then(|(number, _)| number.parse().ok()).expect("a note of the density");
    assert!(noted >= 250.0, "{noted} stems per hectare of wooded ground");
    // Trunks reach into the ground: no foot stands above it.
    for tree in stage.stand.trees.iter().step_by(997) {
        let foot = tree.position(&stage.stand.grid);
        let ground = stage.terrain.height(foot.x, foot.z);
        assert!(foot.y <= ground + 0.02 && foot.y > ground - 3.0, "a foot at {foot}, the ground at {ground}");
    }
    assert!((36.0..37.0).contains(&stage.observer.latitude_deg), "{}", stage.observer.latitude_deg);
    assert!((-85.0..-84.0).contains(&stage.observer.longitude_deg), "{}", stage.observer.longitude_deg);
}

#[test]
fn the_inventory_stands_as_it_is_listed() {
    let mut heard = Heard::default();
    let stage = built(asset("scenes/inventory.ron"), &mut heard);
    assert_eq!(heard.warnings, Vec::<String>::new());
    assert_eq!(stage.stand.trees.len(), 600);
    let stand = stage.forest().expect("a forest");
    assert_eq!(stand.plants.len(), 8);
}

#[test]
fn info_says_what_the_shipped_files_hold() {
    let demo = described(&asset("scenes/demo.ron"));
    assert_says(
        &demo,
        &["Cumberland Mountains", "jacksboro_6km.tif", "broadleaf", "conifer", "stems per hectare", "36."],
    );
    let inventory = described(&asset("scenes/inventory.ron"));
    assert_says(&inventory, &["600 from the inventory", "beech", "spruce", "Fagus sylvatica", "noise of seed 5"]);
    let terrain = described(&asset("terrain/jacksboro_6km.tif"));
    assert_says(&terrain, &["a terrain", "longitude and latitude", "no data", "° N", "° W", "m above the datum"]);
    let table = described(&asset("inventories/mixed_stand.csv"));
    assert_says(
        &table,
        &["600 trees", "dbh_cm: diameter at breast height in centimetres", "Picea abies", "per hectare"],
    );
    for species in ["species/broadleaf.ron", "species/conifer.ron"] {
        assert_says(&described(&asset(species)), &["rules of a grown species", "height"]);
    }
}

#[test]
fn info_tells_what_would_be_ignored_and_why() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    let write = |name: &str, bytes: &[u8]| std::fs::write(path(name), bytes).expect("a temporary file");

    write("tree.glb", &TreeFile::default().bytes());
    assert_says(
        &described(&path("tree.glb")),
        &["336: 16 of wood, 320 of foliage", "high", "colour texture 64 x 64", "alpha test at 0.50"],
    );
    write("bald.glb", &TreeFile { leaves: false, ..TreeFile::default() }.bytes());
    assert_says(&described(&path("bald.glb")), &["16: 16 of wood, 0 of foliage", "no foliage"]);

    write("stand.csv", b"x,y,dbh,vigour\n1,2,30,good\n3,5,,poor\n");
    assert_says(
        &described(&path("stand.csv")),
        &[
            "2 trees",
            "vigour: ignored",
            "centimetres (assumed",
            "of 1 of 2: 30.0 to 30.0 cm",
            "height        unknown for all trees",
        ],
    );

    write(
        "holes.asc",
        b"ncols 3\nnrows 2\nxllcorner 10\nyllcorner 10\ncellsize 100\nNODATA_value -1\n5 -1 7\n8 9 11\n",
    );
    assert_says(&described(&path("holes.asc")), &["in 1 of 6 samples (16.67 %)", "3 x 2", "5.0 m to 11.0 m"]);

    let heights = image::ImageBuffer::<image::Luma<u16>, _>::from_fn(4, 3, |x, y| image::Luma([(x * 1000 + y) as u16]));
    heights.save(path("heights.png")).expect("an image");
    assert_says(
        &described(&path("heights.png")),
        &["4 x 3", "0 to 3002 of 65535", "neither a scale in metres", "Image("],
    );
    image::RgbImage::new(4, 4).save(path("photo.png")).expect("an image");
    assert!(info(&path("photo.png")).is_err_and(|error| error.to_string().contains("16-bit greyscale")));

    write("notes.txt", b"hello");
    assert!(matches!(info(&path("notes.txt")), Err(AppError::UnknownKind { .. })));
    write("broken.ron", b"(terrain: Flat(), place: (latitude: 95, longitude: 9))");
    assert!(info(&path("broken.ron")).is_err_and(|error| error.to_string().contains("place.latitude")));
    assert!(info(&path("absent.tif")).is_err_and(|error| error.to_string().contains("absent.tif")));
}

#[test]
#[ignore = "needs the data folder CANOPY_DATA"]
fn info_of_the_real_data() {
    for (file, says) in [
        ("trees/oak-medium.glb", &["of wood", "of foliage", "colour texture"][..]),
        ("trees/pine-medium.glb", &["of wood", "of foliage"]),
        ("dem/jacksboro.tif", &["longitude and latitude", "° N"]),
        ("dem/bci_50ha_elevation.asc", &["samples", "slopes"]),
        ("stands/longleaf_pine.csv", &["trees", "extent"]),
        ("stands/bci_50ha_trees.csv", &["trees", "species"]),
    ] {
        let text = described(&data(file));
        println!("{text}");
        assert_says(&text, says);
    }
}

/// A scene of `trees` (lines of a table) whose broadleaves are lit `light`.
fn lit_stand(folder: &Path, trees: &str, light: &str) -> Result<Stage, StageError> {
    let scene = format!(
        "(terrain: Flat(size: 200), place: (latitude: 48, longitude: 9), species: [\
         (name: \"tree\", plant: Grown(form: Broadleaf, individuals: 1, triangles: 5000, seed: 1), lighting: {light}), \
         (name: \"other\", plant: Grown(form: Conifer, individuals: 1, triangles: 5000, seed: 2), lighting: Local)], \
         trees: Inventory(path: \"trees.csv\"))"
    );
    std::fs::write(folder.join("trees.csv"), format!("x,y,height,species\n{trees}")).expect("a temporary file");
    Stage::build(&Scene::parse(&scene, &folder.join("scene.ron"))?, &mut Silent)
}

#[test]
fn a_species_kind_of_leaf_reaches_its_plants() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let grown = |form: &str| format!("plant: Grown(form: {form}, individuals: 1, triangles: 5000, seed: 1)");
    let file = "plant: Gltf(files: [\"tree.glb\"])";
    let stated = "plant: Gltf(files: [\"stated.glb\"])";
    let plants = [
        (grown("Broadleaf"), ""),
        (grown("Conifer"), ""),
        (grown("Broadleaf"), "leaf: Leathery,"),
        (file.to_owned(), ""),
        (file.to_owned(), "leaf: Needle,"),
        (stated.to_owned(), "leaf: Needle,"),
    ];
    let species: Vec<String> = plants
        .iter()
        .enumerate()
        .map(|(index, (plant, leaf))| format!("(name: \"{index}\", {leaf} {plant}, lighting: Local)"))
        .collect();
    let scene = format!(
        "(terrain: Flat(size: 100), place: (latitude: 48, longitude: 9), species: [{}], \
         trees: Scattered(stems_per_hectare: 10), quality: (cross_resolution: 64))",
        species.join(",")
    );
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("a temporary file");
    write("scene.ron", scene.as_bytes());
    write("tree.glb", &TreeFile::default().bytes());
    let leaf_members = r#","extensions":{"KHR_materials_diffuse_transmission":{}}"#;
    write("stated.glb", &TreeFile { leaf_members, ..TreeFile::default() }.bytes());
    let stage = built(folder.path().join("scene.ron"), &mut Heard::default());
    let of = |plant: &BakedPlant| {
        let foliage = plant.plant.parts.iter().find(|part| part.kind == PartKind::Foliage).expect("foliage");
        foliage.material.transmission
    };
    let expected = [LeafKind::Thin, LeafKind::Needle, LeafKind::Leathery, LeafKind::Thin, LeafKind::Needle];
    let found: Vec<Vec3> = stage.plants.iter().map(of).collect();
    assert_eq!(found[..5], expected.map(LeafKind::transmission));
    assert_eq!(found[5], Vec3::ZERO, "what the file says goes before the kind of leaf");
}

#[test]
fn a_small_tree_is_darkened_by_its_tall_neighbour() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let build = |trees: &str, light: &str| match lit_stand(folder.path(), trees, light) {
        Ok(stage) => stage,
        Err(error) => panic!("{error}"),
    };
    let close = "0,0,24,tree\n3,1,14,tree\n-30,0,12,other\n";
    let far = "0,0,24,tree\n80,1,14,tree\n-30,0,12,other\n";
    let light = "Expressive(together: true, radius: 3)";
    // Mean k_a over the foliage of the tree at `place` of the table.
    let ambient = |stage: &Stage, place: f64| {
        let tree = stage.stand.trees.iter().find(|tree| (tree.position(&stage.stand.grid).x - place).abs() < 0.1);
        let plant = &stage.plants[usize::from(tree.expect("a tree there").variant())];
        let foliage = plant.plant.parts.iter().position(|part| part.kind == PartKind::Foliage).expect("foliage");
        let values = plant.lighting.ambient(foliage);
        values.iter().sum::<f32>() / values.len() as f32
    };
    let (close_stage, far_stage) = (build(close, light), build(far, light));
    assert_eq!(close_stage.plants.len(), 3, "one plant for each tree, and the conifer");
    let (near, alone) = (ambient(&close_stage, 3.0), ambient(&far_stage, 80.0));
    assert!(near < 0.95 * alone, "{near} beside its neighbour, {alone} alone");
    let together = close_stage.plants.iter().filter(|plant| plant.lighting.is_lit_together());
    assert_eq!(together.count(), 2, "neighbours are in k_a, and shall not count again");
    assert_eq!(build(close, "Expressive()").plants.len(), 2, "instances of two plants otherwise");

    let crowd: String = (0..1024).map(|row| format!("{},{},12,tree\n", row % 32 * 3, row / 32 * 3)).collect();
    let error = lit_stand(folder.path(), &crowd, light).err().expect("1023 is the most beside the conifer");
    assert_says(&error.to_string(), &["1024 trees", "1023", "together"]);
}
