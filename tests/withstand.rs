//! What the program must withstand: broken input is refused with one message and exit code 1, and leaves nothing
//! behind; input that lacks something is drawn, with a warning that says what.

use std::{
    path::{Path, PathBuf},
    process::{Command, Output},
};

use tempfile::TempDir;
use tiff::{
    encoder::{TiffEncoder, colortype},
    tags::Tag,
};

use crate::support::{
    data::data,
    glb::TreeFile,
    gpu::gpu,
    program::{canopy, command, listing, said},
    stage::{BROADLEAF, PLACE, quality},
};

/// A folder with a scene and its files.
struct Case {
    folder: TempDir,
    scene: PathBuf,
}

impl Case {
    #[track_caller]
    fn new(scene: &str, files: &[(&str, &[u8])]) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (name, bytes) in files {
            std::fs::write(folder.path().join(name), bytes).expect("a temporary file");
        }
        let path = folder.path().join("scene.ron");
        std::fs::write(&path, scene).expect("a temporary file");
        Self { folder, scene: path }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn render(&self, out: &Path, more: &[&str]) -> Command {
        let mut command = command(&["render"]);
        command.arg(&self.scene).arg("--out").arg(out).args(["--quiet"]);
        if !more.contains(&"--size") {
            command.args(["--size", "96x54"]);
        }
        command.args(more);
        command
    }
}

/// That the program ended with 1 and one message with all of `says` in it, without a panic.
#[track_caller]
fn assert_refused(output: &Output, says: &[&str]) {
    let message = said(output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("error: ") && !message.contains("panicked"), "{message}");
    assert_eq!(message.matches("error: ").count(), 1, "more than one message: {message}");
    for word in says {
        assert!(message.contains(word), "no `{word}` in: {message}");
    }
}

/// Renders a scene that must be refused, and looks at what is left.
#[track_caller]
fn refused(scene: &str, files: &[(&str, &[u8])], says: &[&str]) {
    let case = Case::new(scene, files);
    let before = listing(case.folder.path());
    let output = case.render(&case.path("pictures/a.png"), &[]).output().expect("the program");
    assert_refused(&output, says);
    assert_eq!(listing(case.folder.path()), before, "something was left behind");
}

fn with_plant(file: &str) -> String {
    format!(
        "(terrain: Flat(size: 100), species: [(name: \"x\", plant: Gltf(files: [\"{file}\"]), height: (5, 9))], trees: \
         Scattered(stems_per_hectare: 50), {PLACE})"
    )
}

fn with_terrain(file: &str) -> String {
    format!("(terrain: File(path: \"{file}\"), {PLACE})")
}

fn with_inventory(file: &str) -> String {
    format!(
        "(terrain: Flat(size: 100), species: [{BROADLEAF}], trees: Inventory(path: \"{file}\"), {PLACE}, {})",
        quality(1)
    )
}

#[test]
fn broken_plants_are_refused() {
    let whole = TreeFile::default().bytes();
    let broken: [(&str, Vec<u8>, &[&str]); 7] = [
        ("empty", Vec::new(), &["plant.glb", "export"]),
        ("cut in the header", whole[..10].to_vec(), &["plant.glb"]),
        ("cut in the middle", whole[..whole.len() / 2].to_vec(), &["plant.glb"]),
        ("no plant", b"hello, world; this is a letter and no tree at all".to_vec(), &["plant.glb"]),
        (
            "an index out of range",
            TreeFile { index_offset: 40, ..TreeFile::default() }.bytes(),
            &["plant.glb", "/meshes/0/primitives/0/indices"],
        ),
        ("NaN", TreeFile { first_coordinate: f32::NAN, ..TreeFile::default() }.bytes(), &["plant.glb", "/accessors/0"]),
        (
            "infinity",
            TreeFile { first_coordinate: f32::INFINITY, ..TreeFile::default() }.bytes(),
            &["plant.glb", "/accessors/0"],
        ),
    ];
    for (what, bytes, says) in &broken {
        println!("{what}");
        refused(&with_plant("plant.glb"), &[("plant.glb", bytes)], says);
        let case = Case::new("()", &[("plant.glb", bytes)]);
        assert_refused(&canopy(&["info".as_ref(), case.path("plant.glb").as_os_str()]).expect("the program"), says);
    }
    refused(&with_plant("absent.glb"), &[], &["absent.glb", "check the path"]);
}

#[test]
#[ignore = "needs the data folder CANOPY_DATA"]
fn the_broken_files_of_the_validator_are_answered() {
    let mut refused = 0;
    for path in listing(&data("gltf-broken")) {
        if !path.extension().is_some_and(|extension| extension == "gltf" || extension == "glb") {
            continue;
        }
        // Most hold no triangle at all, so that each has a reason to be refused; a sound one would be described.
        if let Err(error) = canopy::app::info(&path) {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            assert!(error.to_string().contains(&name), "{error}");
            refused += 1;
        }
    }
    assert!(refused > 60, "{refused} refused");
}

/// A GeoTIFF of nine samples with these keys.
fn geotiff(keys: &[[u16; 4]]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut write = || -> tiff::TiffResult<()> {
        let mut encoder = TiffEncoder::new(&mut bytes)?;
        let mut image = encoder.new_image::<colortype::GrayI16>(3, 3)?;
        image.encoder().write_tag(Tag::ModelPixelScaleTag, &[10.0, 10.0, 0.0][..])?;
        image.encoder().write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, 500_000.0, 4_000_000.0, 0.0][..])?;
        let mut directory = vec![1, 1, 0, keys.len() as u16];
        directory.extend(keys.iter().flatten());
        image.encoder().write_tag(Tag::GeoKeyDirectoryTag, &directory[..])?;
        image.write_data(&[1, 2, 3, 4, 5, 6, 7, 8, 9])
    };
    write().expect("a GeoTIFF");
    bytes.into_inner()
}

#[test]
fn broken_terrains_are_refused() {
    let grid = |columns: usize, rows: usize, values: &str| {
        format!("ncols {columns}\nnrows {rows}\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -9999\n{values}\n")
            .into_bytes()
    };
    let broken: [(&str, &str, Vec<u8>, &[&str]); 8] = [
        ("one row", "dem.asc", grid(3, 1, "1 2 3"), &["1 rows", "at least 2"]),
        ("only no-data", "dem.asc", grid(2, 2, "-9999 -9999\n-9999 -9999"), &["dem.asc", "without data"]),
        ("a huge header", "dem.asc", grid(16_000, 16_000, "1 2 3"), &["dem.asc"]),
        ("text", "dem.asc", grid(2, 2, "1 two\n3 4"), &["dem.asc", "line 7"]),
        (
            "an unknown coordinate system",
            "dem.tif",
            geotiff(&[[1024, 0, 1, 3]]),
            &["dem.tif", "unknown coordinate system"],
        ),
        ("a cut GeoTIFF", "dem.tif", geotiff(&[[1024, 0, 1, 1], [3072, 0, 1, 32617]])[..60].to_vec(), &["dem.tif"]),
        ("empty", "dem.tif", Vec::new(), &["dem.tif"]),
        ("a letter", "dem.hgt", b"Dear Sir or Madam".to_vec(), &["dem.hgt", "GeoTIFF"]),
    ];
    for (what, name, bytes, says) in &broken {
        println!("{what}");
        refused(&with_terrain(name), &[(name, bytes)], says);
        let case = Case::new("()", &[(name, bytes)]);
        assert_refused(&canopy(&["info".as_ref(), case.path(name).as_os_str()]).expect("the program"), says);
    }
    refused(&with_terrain("absent.tif"), &[], &["absent.tif"]);
}

#[test]
fn text_in_number_columns_is_refused_with_the_first_five() {
    let mut table = "x,y,dbh\n".to_owned();
    for row in 0..9 {
        table.push_str(&format!(
            "{row},{},{}\n",
            row * 2,
            if row % 2 == 0 { "thick".to_owned() } else { "30".to_owned() }
        ));
    }
    table.push_str("east,3,20\nwest,north,\n");
    let says = ["stand.csv", "line 2", "line 4", "line 6", "line 8", "line 10", "thick", "`dbh`"];
    refused(&with_inventory("stand.csv"), &[("stand.csv", table.as_bytes())], &says);
    let case = Case::new("()", &[("stand.csv", table.as_bytes())]);
    let output = canopy(&["info".as_ref(), case.path("stand.csv").as_os_str()]).expect("the program");
    assert_refused(&output, &says);
    assert!(!said(&output).contains("line 11"), "only the first five: {}", said(&output));

    refused(&with_inventory("stand.csv"), &[("stand.csv", b"name,age\noak,90\n")], &["stand.csv", "position columns"]);
    refused(&with_inventory("absent.csv"), &[], &["absent.csv"]);
}

/// A scene that can be drawn.
fn plain() -> String {
    format!("(terrain: Flat(size: 100), {PLACE}, {})", quality(1))
}

#[test]
fn an_image_larger_than_the_device_limit_is_refused() {
    let _gpu = gpu();
    let case = Case::new(&plain(), &[]);
    let before = listing(case.folder.path());
    let output = case.render(&case.path("a.png"), &["--size", "1000000x64"]).output().expect("the program");
    assert_refused(&output, &["1000000x64", "limit", "--size"]);
    assert_eq!(listing(case.folder.path()), before);
}

#[test]
fn a_machine_without_a_driver_gets_a_message() {
    let case = Case::new(&plain(), &[]);
    let before = listing(case.folder.path());
    let driverless = |mut command: Command| {
        let absent = case.path("no-driver.json");
        command.env("VK_DRIVER_FILES", &absent).env("VK_ICD_FILENAMES", &absent).env("WGPU_BACKEND", "vulkan");
        command.output().expect("the program")
    };
    let says = ["no Vulkan driver", "install"];
    assert_refused(&driverless(case.render(&case.path("a.png"), &[])), &says);
    assert_refused(&driverless(command(&["--list-adapters"])), &says);
    assert_eq!(listing(case.folder.path()), before);
}

#[test]
fn an_adapter_that_is_not_there_is_named() {
    let _gpu = gpu();
    let case = Case::new(&plain(), &[]);
    let output = case.render(&case.path("a.png"), &["--adapter", "abacus"]).output().expect("the program");
    assert_refused(&output, &["abacus", "available:"]);
}

#[test]
fn a_folder_that_cannot_be_written_is_refused() {
    let case = Case::new(&plain(), &[("taken", b"a file")]);
    let before = listing(case.folder.path());
    // A path below a file is refused to everyone, whatever their rights.
    for out in ["taken/a.png", "taken/deeper/a.png"] {
        let output = case.render(&case.path(out), &[]).output().expect("the program");
        assert_refused(&output, &["taken", "--out"]);
        assert_eq!(listing(case.folder.path()), before);
    }
}

/// Renders a scene that must be drawn with warnings that have all of `says` in them.
#[track_caller]
fn drawn(scene: &str, files: &[(&str, &[u8])], says: &[&str]) {
    let case = Case::new(scene, files);
    let out = case.path("pictures/a.png");
    let output = case.render(&out, &[]).env("CANOPY_CACHE", case.path("cache")).output().expect("the program");
    let message = said(&output);
    assert_eq!(output.status.code(), Some(0), "{message}");
    assert!(!message.contains("panicked") && !message.contains("error: "), "{message}");
    for word in says {
        assert!(
            message.lines().any(|line| line.contains("warning: ") && line.contains(word)),
            "no `{word}`: {message}"
        );
    }
    let picture = image::open(&out).expect("an image").to_rgb8();
    assert_eq!(picture.dimensions(), (96, 54));
    assert!(picture.pixels().any(|pixel| pixel != picture.get_pixel(0, 0)), "the image has one colour");
    let left: Vec<_> = std::fs::read_dir(case.path("pictures")).expect("the folder").flatten().collect();
    assert_eq!(left.len(), 1, "something was left beside the image: {left:?}");
}

#[test]
fn plants_that_lack_something_are_drawn_with_a_warning() {
    let _gpu = gpu();
    let species = |name: &str| format!("(name: \"{name}\", plant: Gltf(files: [\"{name}.glb\"]), height: (6, 8))");
    let scene = format!(
        "(terrain: Flat(size: 60), species: [{}, {}, {}], trees: Scattered(stems_per_hectare: 200), camera: (start: \
         (position: (0, 3, 25))), {PLACE}, {})",
        species("bald"),
        species("floating"),
        species("pale"),
        quality(1)
    );
    let bald = TreeFile { leaves: false, ..TreeFile::default() }.bytes();
    let floating = TreeFile { wood: false, ..TreeFile::default() }.bytes();
    let pale = TreeFile { absent_texture: true, ..TreeFile::default() }.bytes();
    drawn(
        &scene,
        &[("bald.glb", &bald), ("floating.glb", &floating), ("pale.glb", &pale)],
        &["no foliage", "no wood", "absent.png"],
    );
}

#[test]
fn a_scene_without_a_place_for_any_tree_is_drawn_with_a_warning() {
    let _gpu = gpu();
    let scene = format!(
        "(terrain: Flat(size: 60), species: [{BROADLEAF}], trees: Scattered(elevation: (500, 600)), {PLACE}, {})",
        quality(1)
    );
    drawn(&scene, &[], &["no place for any tree"]);
}
