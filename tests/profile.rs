//! `canopy profile` as a user calls it, on a scene of a few trees.

use std::path::Path;

use canopy::app::{ProfileReport, read_report};

use crate::support::{
    gpu::gpu,
    program::{canopy, listing, said},
};

type Outcome = Result<(), Box<dyn std::error::Error>>;

/// A grove with a short path, in `folder`.
fn scene(folder: &Path) -> std::io::Result<String> {
    let file = folder.join("grove.ron");
    let text = "(name: \"grove\", terrain: Flat(size: 120), place: (latitude: 48, longitude: 9, time: \"2026-06-21T12:30+01:00\"), \
                species: [(name: \"broadleaf\", plant: Grown(form: Broadleaf, individuals: 1, triangles: 5000), height: (9, 12), \
                lighting: Local)], trees: Scattered(stems_per_hectare: 60, min_distance: 4, surroundings: 0), camera: (path: [(seconds: \
                0, position: (0, 6, 55), yaw: 0, pitch: -5), (seconds: 4, position: (0, 6, 20), yaw: 20, pitch: -5)]), quality: \
                (shadow_map_size: 256, cascades: 1, shadow_distance: 80, msaa: 1, cross_resolution: 64, view_distance: 500, \
                near_distance: 15, fade_band: 5))";
    std::fs::write(&file, text)?;
    Ok(file.display().to_string())
}

#[test]
fn a_profile_has_times_errors_a_front_and_a_page_and_can_be_gone_on_with() -> Outcome {
    let _gpu = gpu();
    let folder = tempfile::tempdir()?;
    let (scene, out) = (scene(folder.path())?, folder.path().join("report"));
    let out_name = out.display().to_string();
    let call = |rounds: &str, more: &[&str]| {
        let fixed = [
            "profile",
            &scene,
            "--out",
            &out_name,
            "--size",
            "96x54",
            "--frames",
            "3",
            "--warm-up",
            "1",
            "--supersample",
            "1",
        ];
        let sweep = ["--sweep", "quality.near_distance=15,60", "--rounds", rounds, "--pictures", "2"];
        canopy(&fixed.iter().chain(&sweep).chain(more).copied().collect::<Vec<_>>())
    };
    let first = call("2", &[])?;
    assert_eq!(first.status.code(), Some(0), "{}", said(&first));
    let text = String::from_utf8(first.stdout)?;
    assert!(text.contains("as written") && text.contains("near_distance=60") && text.contains("report.html"), "{text}");
    // Two rounds tell no ratio: it is not made up.
    assert!(text.contains("n/a"), "{text}");
    let early = read_report(&out.join("report.json"))?;
    check(&early, 2);

    let second = call("4", &["--resume"])?;
    assert_eq!(second.status.code(), Some(0), "{}", said(&second));
    let report = read_report(&out.join("report.json"))?;
    check(&report, 4);
    // What was measured before is kept as it was.
    for (before, now) in early.points.iter().zip(&report.points) {
        assert_eq!((&before.rounds[..], &before.pictures), (&now.rounds[..2], &now.pictures));
    }
    let ratio = report.points[1].summary.ratio.ok_or("a ratio")?;
    assert!(ratio.low <= ratio.value && ratio.value <= ratio.high && ratio.value > 0.0);
    let page = std::fs::read_to_string(out.join("report.html"))?;
    // Two references, and two images with their errors for each of two points.
    assert_eq!(page.matches("data:image/png;base64,").count(), 2 + 2 * 2 * 2);
    // Each folder of images is a sequence that `canopy compare` takes, with the figures of the report.
    let (images, references) = (out.join("images/000"), out.join("reference-full"));
    let compared = canopy(&["compare", &images.display().to_string(), &references.display().to_string(), "--json"])?;
    let compared: canopy::app::CompareReport = serde_json::from_slice(&compared.stdout)?;
    let found: Vec<_> = compared.frames.iter().map(|frame| Some(frame.comparison.clone())).collect();
    let told: Vec<_> = report.points[0].pictures.iter().map(|picture| picture.error.clone()).collect();
    assert_eq!(found, told);
    let frames = std::fs::read_to_string(out.join("frames.csv"))?;
    assert_eq!(frames.lines().count(), 1 + 2 * 4 * 3);
    assert_eq!(std::fs::read_to_string(out.join("points.csv"))?.lines().count(), 1 + 2);

    // Against itself nothing is slower; another profile is not gone on with.
    let baseline = out.join("report.json").display().to_string();
    let same = call("4", &["--resume", "--baseline", &baseline])?;
    assert_eq!(same.status.code(), Some(0), "{}", said(&same));
    assert!(String::from_utf8(same.stdout)?.contains("1.000"));
    // A report that lost a point by hand is none to go on with; it once ended in a panic.
    let json = out.join("report.json");
    let kept = std::fs::read(&json)?;
    let mut shorter: serde_json::Value = serde_json::from_slice(&kept)?;
    shorter["points"].as_array_mut().ok_or("no points")?.pop();
    std::fs::write(&json, serde_json::to_vec(&shorter)?)?;
    let edited = call("4", &["--resume"])?;
    assert_eq!(edited.status.code(), Some(1));
    assert!(said(&edited).contains("has a report of another profile"), "{}", said(&edited));
    std::fs::write(&json, kept)?;
    let other = call("4", &["--resume", "--seed", "5"])?;
    assert_eq!(other.status.code(), Some(1));
    assert!(said(&other).contains("has a report of another profile"), "{}", said(&other));
    Ok(())
}

/// All of it was measured, and nothing is 0 that cannot be.
fn check(report: &ProfileReport, rounds: usize) {
    assert!(report.complete && report.points.len() == 2 && report.views.len() == 3);
    for (index, point) in report.points.iter().enumerate() {
        assert_eq!((point.rounds.len(), point.pictures.len()), (rounds, 3));
        let frames = point.rounds.iter().flat_map(|round| &round.frames);
        for frame in frames {
            assert!(frame.frame > 0.0 && frame.cpu_main.is_some_and(|time| time > 0.0), "{frame:?}");
            assert!(frame.cpu_render.is_some_and(|time| time > 0.0 && time <= frame.frame), "{frame:?}");
            // A device that has timestamps has them for every frame.
            assert!(!report.machine.gpu_times || frame.gpu.is_some_and(|time| time > 0.0), "{frame:?}");
        }
        let found = &point.summary;
        assert!(
            found.error.is_some_and(|error| (0.0..1.0).contains(&error)) && found.frame.is_some(),
            "{index} {found:?}"
        );
        assert!(point.pictures[0].change.is_none() && point.pictures[1].change.is_some());
        assert!(found.levels.iter().any(|level| level.name == "model" && level.trees > 0.0), "{:?}", found.levels);
        assert!(report.front.contains(&report.knee.unwrap()));
    }
    // Full models to 60 m are nearer to the reference of full models than to 15 m.
    let error = |index: usize| report.points[index].summary.error.unwrap();
    assert!(error(1) < error(0), "{} and {}", error(1), error(0));
}

#[test]
fn settings_are_listed_and_wrong_ones_cost_nothing() -> Outcome {
    let folder = tempfile::tempdir()?;
    let scene = scene(folder.path())?;
    let listed = canopy(&["profile", &scene, "--list-settings"])?;
    let text = String::from_utf8(listed.stdout)?;
    for line in ["quality.near_distance = 15 ", "lighting = local ", "quality.levels = "] {
        assert!(text.contains(line), "{line} is missing in:\n{text}");
    }
    let out = folder.path().join("report").display().to_string();
    let images = folder.path().join("images");
    std::fs::create_dir(&images)?;
    std::fs::write(images.join("0001.png"), "")?;
    let before = listing(folder.path());
    for (arguments, code, words) in [
        (vec!["--sweep", "quality.near_distanc=1"], 1, "did you mean `quality.near_distance`?"),
        (vec!["--sweep", "quality.msaa=3"], 1, "write 1 (off) or 4"),
        (vec!["--sweep", "quality.msaa="], 2, "is empty"),
        (vec!["--along", "9s"], 1, "is not on the scene's camera path"),
        (vec!["--reference", "truth"], 2, "expected full, traced, none or a folder"),
        (vec!["--baseline", "none.json"], 1, "none.json"),
        (vec!["--at", "2026-06-21T12:00Z", "--at", "2026-06-21T13:00Z"], 2, "a flight takes one --at"),
    ] {
        let output =
            canopy(&["profile", &scene, "--out", &out].into_iter().chain(arguments.clone()).collect::<Vec<_>>())?;
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", said(&output));
        assert!(said(&output).contains(words), "{arguments:?}: {}", said(&output));
        assert_eq!(listing(folder.path()), before, "{arguments:?}");
    }
    let given = images.display().to_string();
    let output =
        canopy(&["profile", &scene, "--out", &out, "--frames", "3", "--reference", &given, "--size", "32x18"])?;
    assert_eq!(output.status.code(), Some(1));
    assert!(said(&output).contains("lacks 2 of the 3 reference frames: 0000, 0002"), "{}", said(&output));
    assert_eq!(listing(folder.path()), before);
    Ok(())
}

#[test]
fn a_search_climbs_to_the_least_error_and_writes_what_a_scene_file_can_have() -> Outcome {
    let _gpu = gpu();
    let folder = tempfile::tempdir()?;
    let (scene, out) = (scene(folder.path())?, folder.path().join("tune"));
    let out_name = out.display().to_string();
    let fixed =
        ["tune", &scene, "--out", &out_name, "--size", "96x54", "--frames", "2", "--warm-up", "0", "--rounds", "4"];
    let more = ["--supersample", "1", "--sweep", "quality.near_distance=5,15,30,80"];
    let call = |goal: [&str; 2]| canopy(&fixed.iter().chain(&more).chain(&goal).copied().collect::<Vec<_>>());
    let output = call(["--budget", "100000ms"])?;
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let text = String::from_utf8(output.stdout)?;
    assert!(text.contains("no neighbour is better"), "{text}");
    let block = std::fs::read_to_string(out.join("quality.ron"))?;
    assert!(block.contains("near_distance: 80,") && block.contains("// Found by `canopy tune"), "{block}");
    let written = format!("(terrain: Flat(), place: (latitude: 48, longitude: 9),\n{block}\n)");
    let read = canopy::scene::Scene::parse(&written, "tuned.ron".as_ref())?;
    assert_eq!((read.quality.near_distance, read.quality.cross_resolution), (80.0, 64));

    let impossible = call(["--budget", "0.0001ms"])?;
    assert_eq!(impossible.status.code(), Some(1));
    assert!(
        said(&impossible).contains("no settings were found that draw 95 of 100 frames within 0.0001 ms"),
        "{}",
        said(&impossible)
    );
    Ok(())
}

#[test]
fn a_profile_compares_styles_stock_bevy_and_the_scene_with_itself() -> Outcome {
    let _gpu = gpu();
    let folder = tempfile::tempdir()?;
    let (scene, out) = (scene(folder.path())?, folder.path().join("report"));
    let out_name = out.display().to_string();
    let fixed = ["profile", &scene, "--out", &out_name, "--size", "96x54", "--frames", "2", "--warm-up", "1"];
    let what = ["--sweep", "style=photograph,watercolour", "--control", "--against", "stock", "--peer-trees", "40"];
    let how = ["--supersample", "1", "--rounds", "2", "--pictures", "2"];
    let output = canopy(&[&fixed[..], &what, &how].concat())?;
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let report = read_report(&out.join("report.json"))?;
    let labels: Vec<&str> = report.points.iter().map(|point| point.label.as_str()).collect();
    let [written, again, style, stock] = labels[..] else { return Err(format!("{labels:?}").into()) };
    assert_eq!([written, again, style], ["as written", "as written, again", "style=watercolour"]);
    assert!(stock.starts_with("stock Bevy, 40 of "), "{stock}");
    let pixels = |point: usize| -> Result<image::RgbImage, image::ImageError> {
        Ok(image::open(out.join(format!("images/{point:03}/0000.png")))?.to_rgb8())
    };
    let drawn = (0..4).map(pixels).collect::<Result<Vec<_>, _>>()?;
    assert!(drawn[0] == drawn[1], "the same scene has the same image");
    for point in &report.points {
        assert!(point.rounds.len() == 2 && point.summary.frame.is_some_and(|frame| frame.p50 > 0.0), "{}", point.label);
    }
    // A watercolour is no photograph with errors; stock Bevy's photograph is one.
    let errors: Vec<bool> = report.points.iter().map(|point| point.summary.error.is_some()).collect();
    assert_eq!(errors, [true, true, false, true]);
    // Stock Bevy draws trees before the sky: its image has dark and bright halves, and is not ours.
    let mean = |rows: std::ops::Range<u32>| {
        let sum: u32 = rows
            .clone()
            .flat_map(|y| (0..96).map(move |x| (x, y)))
            .map(|(x, y)| u32::from(drawn[3].get_pixel(x, y).0[1]))
            .sum();
        f64::from(sum) / f64::from(96 * rows.len() as u32)
    };
    assert!(mean(0..8) > 1.2 * mean(40..54) && drawn[3] != drawn[0], "{} and {}", mean(0..8), mean(40..54));
    let wrong = canopy(&["profile", &scene, "--sweep", "style=oil"])?;
    assert!(said(&wrong).contains("photograph, watercolour, lines, toon"), "{}", said(&wrong));
    Ok(())
}
