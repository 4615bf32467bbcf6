//! Sequences in pieces, as several machines render them.

use std::{collections::BTreeMap, path::Path};

use crate::support::{
    gpu::gpu,
    program::{canopy, said},
};

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn scene(trees: u32) -> String {
    format!(
        "(name: \"grove\", terrain: Noise(size: 100, amplitude: 4, wavelength: 60, seed: 3), place: (latitude: 48, longitude: 9, time: \
         \"2026-06-21T12:30+01:00\"), species: [(name: \"broadleaf\", plant: Grown(form: Broadleaf, individuals: 1, triangles: 5000), \
         height: (9, 12), lighting: Local)], trees: Scattered(stems_per_hectare: {trees}, min_distance: 4, surroundings: 0), camera: \
         (path: [(seconds: 0, position: (0, 6, 45), yaw: 0, pitch: -5), (seconds: 4, position: (0, 6, 20), yaw: 20, pitch: -5)]), \
         quality: (shadow_map_size: 256, cascades: 1, shadow_distance: 80, msaa: 1, cross_resolution: 64, view_distance: 500))"
    )
}

/// The bytes of all files in a folder.
fn bytes(folder: &Path) -> std::io::Result<BTreeMap<String, Vec<u8>>> {
    let entries = std::fs::read_dir(folder)?.collect::<Result<Vec<_>, _>>()?;
    let file =
        |entry: std::fs::DirEntry| Ok((entry.file_name().to_string_lossy().into_owned(), std::fs::read(entry.path())?));
    entries.into_iter().map(file).collect()
}

#[test]
fn pieces_have_the_bytes_of_the_whole_and_stale_frames_are_rendered_again() -> Outcome {
    let _gpu = gpu();
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("grove.ron");
    std::fs::write(&file, scene(40))?;
    let name = file.display().to_string();
    let render = |out: &str, more: &[&str]| {
        let out = folder.path().join(out).display().to_string();
        let fixed = ["render", &name, "--out", &out, "--frames", "4", "--fps", "1", "--size", "48x27"];
        canopy(&fixed.into_iter().chain(more.iter().copied()).collect::<Vec<_>>())
    };
    assert_eq!(render("whole", &[])?.status.code(), Some(0));
    for piece in ["1/3", "3/3", "2/3"] {
        let output = render("pieces", &["--chunk", piece])?;
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    }
    assert_eq!(bytes(&folder.path().join("pieces"))?, bytes(&folder.path().join("whole"))?);
    assert_eq!(render("some", &["--frames-only", "0,3"])?.status.code(), Some(0));
    assert_eq!(bytes(&folder.path().join("some"))?.into_keys().collect::<Vec<_>>(), ["0000.png", "0003.png"]);
    for (arguments, words) in [
        (["--chunk", "4/3"], "the pieces are 1/3 to 3/3"),
        (["--frames-only", "2-4"], "frame 4 is not one of the 4 frames"),
    ] {
        let output = render("none", &arguments)?;
        assert_eq!(output.status.code(), Some(1));
        assert!(said(&output).contains(words), "{}", said(&output));
    }

    let kept = render("whole", &["--skip-existing"])?;
    assert!(said(&kept).contains("4 of 4 images are finished already"), "{}", said(&kept));
    // Another number of trees: the same notes but for the fingerprint.
    std::fs::write(&file, scene(90))?;
    let stale = render("whole", &["--skip-existing", "--frames-only", "1"])?;
    assert!(!said(&stale).contains("finished already"), "{}", said(&stale));
    let (now, before) = (bytes(&folder.path().join("whole"))?, bytes(&folder.path().join("pieces"))?);
    assert!(now["0001.png"] != before["0001.png"] && now["0000.png"] == before["0000.png"]);
    Ok(())
}

#[test]
fn a_frame_that_fails_does_not_stop_the_others_and_ends_with_3() -> Outcome {
    let _gpu = gpu();
    let folder = tempfile::tempdir()?;
    let (file, out) = (folder.path().join("grove.ron"), folder.path().join("out"));
    std::fs::write(&file, scene(40))?;
    // Nothing can be written where a folder is.
    std::fs::create_dir_all(out.join("0001.png"))?;
    let (file, out_name) = (file.display().to_string(), out.display().to_string());
    let arguments = ["render", &file, "--out", &out_name, "--frames", "3", "--fps", "1", "--size", "48x27"];
    let output = canopy(&arguments)?;
    assert_eq!(output.status.code(), Some(3), "{}", said(&output));
    assert!(said(&output).contains("1 of 3 images failed") && said(&output).contains("0001.png"), "{}", said(&output));
    assert!(out.join("0000.png").is_file() && out.join("0002.png").is_file());
    std::fs::remove_dir(out.join("0001.png"))?;
    let resumed = canopy(&[&arguments[..], &["--resume"]].concat())?;
    assert_eq!(resumed.status.code(), Some(0), "{}", said(&resumed));
    assert!(said(&resumed).contains("2 of 3 images are finished already"), "{}", said(&resumed));
    Ok(())
}

#[test]
fn pieces_of_a_traced_sequence_and_parts_of_its_samples_have_the_bytes_of_the_whole() -> Outcome {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("grove.ron");
    std::fs::write(&file, scene(40))?;
    let name = file.display().to_string();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let trace = |out: &str, more: &[&str]| {
        let out = at(out);
        let fixed = ["reference", &name, "--out", &out, "--size", "32x18", "--spp", "6"];
        canopy(&fixed.into_iter().chain(more.iter().copied()).collect::<Vec<_>>())
    };
    let good = |output: std::process::Output| assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let sequence = ["--frames", "3", "--fps", "1"];
    good(trace("whole", &sequence)?);
    for piece in ["2/2", "1/2"] {
        good(trace("pieces", &[&sequence[..], &["--chunk", piece]].concat())?);
    }
    let whole = bytes(&folder.path().join("whole"))?;
    assert_eq!(whole.keys().collect::<Vec<_>>(), ["0000.png", "0001.png", "0002.png"]);
    assert!(whole["0000.png"] != whole["0002.png"], "the camera moves");
    assert_eq!(bytes(&folder.path().join("pieces"))?, whole);

    // What is finished is kept, once more.
    let kept = trace("whole", &[&sequence[..], &["--skip-existing"]].concat())?;
    assert_eq!(said(&kept).matches("finished already").count(), 3, "{}", said(&kept));
    assert_eq!(bytes(&folder.path().join("whole"))?, whole);
    let few = trace("few.film", &["--part", "1/16"])?;
    assert!(said(&few).contains("cannot be divided into 16 parts"), "{}", said(&few));

    // Unequal parts of the samples of all images; folders merge by name.
    for part in ["1", "2", "3", "4"] {
        good(trace(&format!("part-{part}"), &[&sequence[..], &["--part", &format!("{part}/4")]].concat())?);
    }
    let merged = at("merged");
    let parts = ["3", "1", "4", "2"].map(|part| at(&format!("part-{part}")));
    let merge = |parts: &[&str], more: &[&str]| canopy(&[&["merge"], parts, more].concat());
    let all = parts.each_ref().map(String::as_str);
    good(merge(&all, &["--out", &merged])?);
    assert_eq!(bytes(&folder.path().join("merged"))?, whole);

    // The same of single images in radiance.
    good(trace("whole.exr", &[])?);
    for part in ["1", "2"] {
        good(trace(&format!("half-{part}.film"), &["--part", &format!("{part}/2")])?);
    }
    let [first, second, exr] = ["half-1.film", "half-2.film", "half.exr"].map(at);
    good(merge(&[&first, &second], &["--out", &exr])?);
    assert_eq!(std::fs::read(&exr)?, std::fs::read(at("whole.exr"))?);

    // What does not fit together is refused with its place.
    let alone = at("part-1/0000.film");
    for (parts, more, words) in [
        (vec![&*first], vec!["--out", &*exr], "samples 4 to 6 of 6 are missing"),
        (vec![&*second], vec!["--out", &*exr], "samples 1 to 3 of 6 are missing"),
        (vec![&*first, &*first], vec!["--out", &*exr], "both have sample 1"),
        (vec![&*first, &*parts[0]], vec!["--out", &*exr], "is a folder and"),
        (vec![&*first, "nowhere.film"], vec!["--out", &*exr], "no such file or folder"),
        (vec![&*first, &*second], vec!["--out", "half.jpg"], "must end in .exr, .png or .film"),
        (vec![&*merged], vec!["--out", &*merged], "there are no films (.film) in this folder"),
        (vec![&*parts[0]], vec!["--out", &*exr], "folders are merged into a folder"),
        (vec![&*name], vec!["--out", &*exr], "not a checkpoint of a reference render"),
    ] {
        let output = merge(&parts, &more)?;
        assert_eq!(output.status.code(), Some(1), "{words}");
        assert!(said(&output).contains(words), "{}", said(&output));
    }
    let other = trace("other.film", &["--part", "2/2", "--seed", "5"])?;
    good(other);
    let different = merge(&[&first, &at("other.film")], &["--out", &exr])?;
    assert!(said(&different).contains("are not parts of one image"), "{}", said(&different));
    let early = at("early.png");
    good(merge(&[&alone], &["--out", &early, "--incomplete"])?);
    let wrong = trace("part.png", &["--part", "1/2"])?;
    assert_eq!(wrong.status.code(), Some(2));
    assert!(said(&wrong).contains("must end in .film"), "{}", said(&wrong));
    Ok(())
}
