//! `canopy compare` as a user calls it.

use std::path::Path;

use image::{Rgb, Rgb32FImage, RgbImage};

use crate::support::program::{canopy, listing, said};

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// Stripes with an even sky above them.
fn stripes(width: u32, shift: u32) -> RgbImage {
    RgbImage::from_fn(width, 48, |x, y| match (y < 16, (x + shift) / 6 % 2) {
        (true, _) => Rgb([120, 150, 220]),
        (_, 0) => Rgb([30, 70, 20]),
        _ => Rgb([140, 150, 90]),
    })
}

fn names<const N: usize>(folder: &Path, files: [&str; N]) -> [String; N] {
    files.map(|file| if file.starts_with('-') { file.to_owned() } else { folder.join(file).display().to_string() })
}

#[test]
fn two_images_have_figures_a_map_and_a_limit() -> Outcome {
    let folder = tempfile::tempdir()?;
    stripes(64, 0).save(folder.path().join("truth.png"))?;
    stripes(64, 2).save(folder.path().join("test.png"))?;
    let [test, truth, map] = names(folder.path(), ["test.png", "truth.png", "map.png"]);
    let output = canopy(&["compare", &test, &truth, "--map", &map])?;
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let text = String::from_utf8(output.stdout)?;
    for words in
        ["FLIP            mean 0.", "local contrast  ", "correlation ", "64x48 pixels, as a display shows it, 67.0"]
    {
        assert!(text.contains(words), "{words} is missing in:\n{text}");
    }
    let map = image::open(map)?.to_rgb8();
    // Black where both have the same sky, light where stripes differ.
    assert!(map.dimensions() == (64, 48) && map.get_pixel(30, 2).0 == [0, 0, 4], "{:?}", map.get_pixel(30, 2));
    assert!(map.get_pixel(30, 40).0.iter().any(|code| *code > 60));

    let same = canopy(&["compare", &truth, &truth, "--limit", "0", "--quiet"])?;
    assert!(same.status.code() == Some(0) && same.stdout.is_empty(), "{}", said(&same));
    let above = canopy(&["compare", &test, &truth, "--limit", "0.01"])?;
    assert_eq!(above.status.code(), Some(1));
    assert!(said(&above).contains("is above the limit of 0.01") && !above.stdout.is_empty(), "{}", said(&above));
    Ok(())
}

#[test]
fn json_has_its_version_and_the_same_figures() -> Outcome {
    let folder = tempfile::tempdir()?;
    let light = |shift: f32| {
        Rgb32FImage::from_fn(40, 24, |x, y| {
            Rgb([x as f32 * 90.0 + shift, y as f32 * 5.0, if x > 20 { 9000.0 } else { 3.0 }])
        })
    };
    light(0.0).save(folder.path().join("truth.exr"))?;
    light(400.0).save(folder.path().join("test.exr"))?;
    let [test, truth] = names(folder.path(), ["test.exr", "truth.exr"]);
    let output = canopy(&["compare", &test, &truth, "--json"])?;
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let report: canopy::app::CompareReport = serde_json::from_slice(&output.stdout)?;
    assert_eq!((report.schema.as_str(), report.version, report.light.as_str()), ("canopy-compare", 1, "scene"));
    let [frame] = report.frames.as_slice() else { return Err("one frame".into()) };
    assert!(frame.comparison.flip.mean > 0.0 && frame.change.is_none() && report.size == (40, 24));
    assert!((frame.comparison.greatest_error - 400.0).abs() < 0.01);
    // Blocks of 16 pixels leave two by one of them.
    assert!(frame.comparison.filtered_flip[2].is_some());
    Ok(())
}

#[test]
fn sequences_have_a_table_with_their_changes() -> Outcome {
    let folder = tempfile::tempdir()?;
    for name in ["test", "truth"] {
        std::fs::create_dir(folder.path().join(name))?;
    }
    for frame in 0..3 {
        let (test, truth) = (format!("test/{frame:04}.png"), format!("truth/f-{frame:04}.png"));
        stripes(64, if frame == 1 { 6 } else { 0 }).save(folder.path().join(test))?;
        stripes(64, 0).save(folder.path().join(truth))?;
    }
    let [test, truth, maps] = names(folder.path(), ["test", "truth/f-*.png", "maps"]);
    let output = canopy(&["compare", &test, &truth, "--map", &maps])?;
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let text = String::from_utf8(output.stdout)?;
    let rows: Vec<Vec<&str>> = text.lines().skip(4).map(|line| line.split_whitespace().collect()).collect();
    assert_eq!((rows[1][0], rows[3][0], rows[4][0]), ("0000", "0002", "mean"), "{text}");
    // Nothing is known of a change before the first frame; the reference stands still.
    assert_eq!((rows[1][7], rows[2][8], rows[2][7] == rows[2][9]), ("n/a", "0.0000", true), "{text}");
    assert_eq!(listing(&folder.path().join("maps")).len(), 3);

    std::fs::remove_file(folder.path().join("truth/f-0001.png"))?;
    let missing = canopy(&["compare", &test, &truth])?;
    assert_eq!(missing.status.code(), Some(1));
    assert!(
        said(&missing).contains("has 2 of the 3 frames of") && said(&missing).contains("missing: 0001"),
        "{}",
        said(&missing)
    );
    Ok(())
}

#[test]
fn what_cannot_be_compared_is_said_with_both_names_and_nothing_is_left_behind() -> Outcome {
    let folder = tempfile::tempdir()?;
    stripes(64, 0).save(folder.path().join("wide.png"))?;
    stripes(32, 0).save(folder.path().join("narrow.png"))?;
    Rgb32FImage::from_pixel(64, 48, Rgb([1.0; 3])).save(folder.path().join("scene.exr"))?;
    RgbImage::new(64, 48).save(folder.path().join("black.png"))?;
    std::fs::write(folder.path().join("text.png"), "no image")?;
    std::fs::create_dir(folder.path().join("empty"))?;
    let before = listing(folder.path());
    for (arguments, words) in [
        (vec!["wide.png", "narrow.png"], "the sizes differ: 64x48 and 32x48 pixels"),
        (
            vec!["wide.png", "scene.exr"],
            "scene.exr: one is as a display shows it (PNG, JPEG), the other is a scene's radiance",
        ),
        (vec!["wide.png", "text.png"], "images are PNG, JPEG or OpenEXR files"),
        (vec!["wide.png", "none.png"], "none.png"),
        (vec!["wide.png", "wide.png", "--mask", "narrow.png"], "narrow.png"),
        (vec!["wide.png", "wide.png", "--mask", "black.png"], "the mask leaves no pixel"),
        (vec!["empty", "wide.png"], "there are no images"),
        (vec!["*.png", "wide.png"], "is a sequence and"),
    ] {
        let paths = arguments.iter().map(|name| names(folder.path(), [name])[0].clone());
        let call: Vec<String> =
            ["compare".to_owned(), "--map".to_owned(), "maps/map.png".to_owned()].into_iter().chain(paths).collect();
        let call: Vec<String> =
            call.into_iter().map(|word| word.replace("maps/", &format!("{}/maps/", folder.path().display()))).collect();
        let output = canopy(&call)?;
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
        assert!(said(&output).contains(words), "{arguments:?}: {}", said(&output));
    }
    assert_eq!(listing(folder.path()), before);
    for wrong in [["--limit", "2"], ["--ppd", "0"], ["--map", "map.jpg"]] {
        let output = canopy(&["compare", "a.png", "b.png", wrong[0], wrong[1]])?;
        assert_eq!(output.status.code(), Some(2), "{wrong:?}");
    }
    Ok(())
}
