//! The program as a user calls it: exit codes, messages, and that nothing is left behind.

use std::path::Path;
use std::process::{Command, Output, Stdio};

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn canopy(arguments: &[&str]) -> std::io::Result<Output> {
    Command::new(env!("CARGO_BIN_EXE_canopy")).args(arguments).stdin(Stdio::null()).output()
}

fn code(output: &Output) -> Option<i32> {
    output.status.code()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn help_and_version_succeed_and_show_examples() -> Outcome {
    for arguments in [
        &["--help"][..],
        &["fly", "--help"],
        &["render", "--help"],
        &["bake", "--help"],
        &["compare", "--help"],
        &["profile", "--help"],
        &["tune", "--help"],
        &["info", "--help"],
    ] {
        let output = canopy(arguments)?;
        assert_eq!(code(&output), Some(0), "{arguments:?}");
        assert!(text(&output.stdout).contains("Examples:"), "{arguments:?}");
    }
    let fly = text(&canopy(&["fly", "--help"])?.stdout);
    for key in ["Up, Down", "Left, Right", "Backspace", "Delete", "Tab", "Enter"] {
        assert!(fly.contains(key), "the settings panel's key {key} is missing in:\n{fly}");
    }
    let version = canopy(&["--version"])?;
    assert_eq!(text(&version.stdout).trim(), format!("canopy {}", env!("CARGO_PKG_VERSION")));
    Ok(())
}

#[test]
fn wrong_arguments_exit_with_2() -> Outcome {
    for arguments in [
        &[][..],
        &["fell"],
        &["--quiet"],
        &["render", "s.ron"],
        &["render", "s.ron", "--out", "a.png", "--size", "0x0"],
        &["render", "s.ron", "--out", "a.png", "--size", "12"],
        &["render", "s.ron", "--out", "a.gif"],
        &["render", "s.ron", "--out", "a.png", "--at", "2026-06-21T15:30"],
        &["render", "s.ron", "--out", "a.png", "--camera", "0,0,0"],
        &["render", "s.ron", "--out", "a.png", "--camera", "0,5,0,0,0", "--along", "3s"],
        &["render", "s.ron", "--out", "a.png", "--out", "b.png"],
        &["render", "s.ron", "--out", "a", "--frames", "0"],
        &["render", "s.ron", "--out", "a", "--frames", "5", "--from", "2026-06-21T15:30Z"],
        &["render", "s.ron", "--out", "a", "--frames", "5", "--chunk", "1"],
        &["render", "s.ron", "--out", "a", "--frames", "5", "--chunk", "1/2", "--frames-only", "1"],
        &["render", "s.ron", "--out", "a", "--frames", "5", "--frames-only", "3-1"],
        &["render", "s.ron", "--out", "a.png", "--chunk", "1/2"],
        &["compare", "a.png"],
        &["tune", "s.ron"],
        &["tune", "s.ron", "--budget", "8s"],
        &["tune", "s.ron", "--budget", "8ms", "--error", "0.1"],
        &["fly", "--size", "x"],
        &["info"],
        &["bake", "oak.glb"],
        &["bake", "oak.glb", "--out", "a.jpg"],
        &["bake", "oak.glb", "--out", "a.png", "--planes", "0"],
    ] {
        let output = canopy(arguments)?;
        assert_eq!(code(&output), Some(2), "{arguments:?}: {}", text(&output.stderr));
        assert!(!output.stderr.is_empty(), "{arguments:?}");
    }
    Ok(())
}

#[test]
fn usage_errors_say_what_to_write() -> Outcome {
    let zone = canopy(&["render", "s.ron", "--out", "a.png", "--at", "2026-06-21T15:30"])?;
    assert!(text(&zone.stderr).contains("has no zone; write the offset from UTC"), "{}", text(&zone.stderr));
    let size = canopy(&["render", "s.ron", "--out", "a.png", "--size", "0x0"])?;
    assert!(text(&size.stderr).contains("as in 1280x720"), "{}", text(&size.stderr));
    Ok(())
}

#[test]
fn a_scene_that_cannot_be_used_exits_with_1_and_leaves_nothing_behind() -> Outcome {
    let folder = tempfile::tempdir()?;
    let scene = folder.path().join("broken.ron");
    std::fs::write(&scene, "(\n  terrain: Flat(),\n  place: (latitude: 100, longitude: 9),\n)")?;
    let out = folder.path().join("pictures/a.png");
    let (scene_name, out_name) = (scene.display().to_string(), out.display().to_string());
    let output = canopy(&["render", &scene_name, "--out", &out_name])?;
    assert_eq!(code(&output), Some(1));
    let message = text(&output.stderr);
    assert!(
        message.starts_with("error: ") && message.contains("broken.ron:3:21: `place.latitude` is 100"),
        "{message}"
    );
    assert!(!out.exists() && !folder.path().join("pictures").exists());

    let missing = canopy(&["render", "no-such-scene.ron", "--out", &out_name])?;
    assert_eq!(code(&missing), Some(1));
    assert!(text(&missing.stderr).contains("no-such-scene.ron"), "{}", text(&missing.stderr));
    Ok(())
}

#[test]
fn info_of_the_shipped_scenes_succeeds() -> Outcome {
    for scene in ["demo.ron", "inventory.ron"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes").join(scene);
        let output = canopy(&["info", &path.display().to_string()])?;
        assert_eq!(code(&output), Some(0), "{scene}: {}", text(&output.stderr));
        assert!(!output.stdout.is_empty());
    }
    let missing = canopy(&["info", "no-such-file.glb"])?;
    assert_eq!(code(&missing), Some(1));
    assert!(text(&missing.stderr).contains("no-such-file.glb"), "{}", text(&missing.stderr));
    Ok(())
}

#[test]
fn a_bake_names_the_file_that_it_cannot_use_and_leaves_nothing_behind() -> Outcome {
    let folder = tempfile::tempdir()?;
    let out = folder.path().join("sheets/a.png");
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/demo.ron");
    for (plant, message) in [("no-such-file.glb", "no-such-file.glb"), (&scene.display().to_string(), "is not a plant")]
    {
        let output = canopy(&["bake", plant, "--out", &out.display().to_string()])?;
        assert_eq!(code(&output), Some(1), "{plant}");
        assert!(text(&output.stderr).contains(message), "{}", text(&output.stderr));
    }
    assert!(!out.exists() && !folder.path().join("sheets").exists());
    Ok(())
}

#[test]
fn the_plants_of_a_scene_are_baked_without_a_sheet() -> Outcome {
    let folder = tempfile::tempdir()?;
    let scene = folder.path().join("s.ron");
    let written = "(terrain: Flat(size: 100), place: (latitude: 48, longitude: 9), species: [(name: \"x\", plant: Grown(individuals: 2, \
                triangles: 5000), height: (5, 9), lighting: Local)], trees: Scattered(stems_per_hectare: 9, surroundings: 0))";
    std::fs::write(&scene, written)?;
    let output = canopy(&["bake", &scene.display().to_string()])?;
    assert_eq!(code(&output), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("2 plants are in the cache"), "{}", text(&output.stdout));
    let missing = canopy(&["bake", "no-such-scene.ron"])?;
    assert_eq!(code(&missing), Some(1), "{}", text(&missing.stderr));
    Ok(())
}

#[test]
fn a_reader_that_leaves_early_is_no_error() -> Outcome {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/demo.ron");
    let mut program = Command::new(env!("CARGO_BIN_EXE_canopy"))
        .arg("info")
        .arg(scene)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    drop(program.stdout.take());
    let output = program.wait_with_output()?;
    assert_eq!(code(&output), Some(0), "{}", text(&output.stderr));
    assert!(!text(&output.stderr).contains("panicked"));
    Ok(())
}

/// What `canopy info` says of a scene that comes through a pipe, in a folder with the files that it names.
#[cfg(unix)]
#[test]
fn scenes_are_read_from_pipes_with_paths_from_the_working_directory() -> Outcome {
    use std::io::Write;

    let folder = tempfile::tempdir()?;
    std::fs::write(folder.path().join("trees.csv"), "x,y\n1,2\n3,4\n")?;
    let scene = "(terrain: Flat(size: 100), place: (latitude: 48, longitude: 9), species: [(name: \"x\", plant: Grown(form: \
                 Broadleaf, individuals: 1, triangles: 5000), height: (5, 9))], trees: Inventory(path: \"trees.csv\"))";
    let mut program = Command::new(env!("CARGO_BIN_EXE_canopy"))
        .args(["info", "/dev/stdin"])
        .current_dir(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    program.stdin.take().ok_or("no input")?.write_all(scene.as_bytes())?;
    let output = program.wait_with_output()?;
    assert_eq!(code(&output), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("2 from the inventory trees.csv"), "{}", text(&output.stdout));

    let mut broken = Command::new(env!("CARGO_BIN_EXE_canopy"))
        .args(["info", "/dev/stdin"])
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    broken.stdin.take().ok_or("no input")?.write_all(b"(terrain: Flt())")?;
    let output = broken.wait_with_output()?;
    assert_eq!(code(&output), Some(1));
    assert!(text(&output.stderr).contains("/dev/stdin:1:11: unknown choice"), "{}", text(&output.stderr));
    Ok(())
}
