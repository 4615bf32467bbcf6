//! Turns arguments into the requests of the library.

use std::path::{Path, PathBuf};

use canopy::{
    app::{
        BakeOptions, Clock, Combination, CompareOptions, ExportOptions, FlyOptions, Goal, LeafImages, LeafModel,
        LeafOptions, LightGroup, MergeOptions, Output, PIXELS_PER_DEGREE, Peer, ProfileOptions, ReferenceKind,
        ReferenceOptions, RenderOptions, Selection, Still, TuneOptions, View, Views,
    },
    scene::{LocalTime, Overrides, SceneSource},
};
use clap::CommandFactory;
use clap::error::ErrorKind;

use super::arguments::{
    Arguments, Bake, CameraArguments, Common, Compare, Export, Fly, Leaf, LeafChoice, LightChoice, Measured, Merge,
    PeerChoice, Profile, Reference, Render, SequenceArguments, StyleArguments, Tune,
};
use super::surveys;

/// The scene of `canopy fly` without an argument.
const DEMO: &str = "scenes/demo.ron";

fn overrides(common: &Common) -> Overrides {
    Overrides {
        seed: common.seed,
        msaa: common.msaa,
        exposure: common.exposure,
        strict: common.strict,
        year: common.single_year(),
        variant: common.single_variant().cloned(),
        lighting: common.lighting.clone(),
        ..Overrides::default()
    }
}

/// As [`overrides`], with a style.
fn styled(common: &Common, style: &StyleArguments) -> Overrides {
    let StyleArguments { style, palette, paper } = style.clone();
    Overrides { style, palette, paper, ..overrides(common) }
}

/// The options of a flight.
pub fn fly_options(fly: Fly, common: &Common) -> FlyOptions {
    FlyOptions {
        scene: fly.scene.unwrap_or_else(demo_scene).into(),
        size: fly.size,
        at: fly.at,
        view: view(&fly.view),
        clock: fly.clock.unwrap_or(0.0),
        underground: fly.underground,
        overrides: styled(common, &fly.style),
        adapter: common.adapter.clone(),
        quiet: common.quiet,
        explain: common.explain,
    }
}

/// The options of a render.
///
/// # Errors
/// A usage error if arguments that are each valid do not fit together.
pub fn render_options(render: Render, common: &Common) -> Result<RenderOptions, clap::Error> {
    let is_single = render.sequence.frames.is_none() && render.out.len() == render.at.len().max(1);
    if let Some(wrong) = render.out.iter().find(|file| is_single && !ends_in(file, "png")) {
        return Err(usage(format!("--out {}: images are PNG files; the name must end in .png", wrong.display())));
    }
    Ok(RenderOptions {
        view: view(&render.view),
        size: render.size,
        beside: surveys::beside(common),
        output: output(render.out, &render.at, &render.sequence)?,
        selection: selection(render.sequence),
        resume: render.resume,
        overrides: styled(common, &render.style),
        adapter: common.adapter.clone(),
        quiet: common.quiet,
        explain: common.explain,
        scene: render.scene.into(),
    })
}

/// The options of a ground truth render.
///
/// # Errors
/// A usage error for a file of another kind.
pub fn reference_options(reference: Reference, common: &Common) -> Result<ReferenceOptions, clap::Error> {
    let endings: &[&str] = if reference.part.is_some() { &["film"] } else { &["exr", "png", "film"] };
    let has = |endings: &[&str]| endings.iter().any(|ending| ends_in(&reference.out, ending));
    let is_folder = reference.sequence.frames.is_some() && !has(&["exr", "png", "film"]);
    if !has(endings) && !is_folder {
        let file = reference.out.display();
        return Err(usage(match reference.part {
            Some(_) => format!("--out {file}: a part of the samples is a film; the name must end in .film"),
            None => format!("--out {file}: a reference is an OpenEXR or PNG file; the name must end in .exr or .png"),
        }));
    }
    Ok(ReferenceOptions {
        view: view(&reference.view),
        scene: reference.scene.into(),
        output: output(vec![reference.out], reference.at.as_slice(), &reference.sequence)?,
        selection: selection(reference.sequence),
        size: reference.size,
        samples: reference.spp,
        part: reference.part,
        bounces: reference.bounces,
        light: match reference.light {
            LightChoice::All => LightGroup::All,
            LightChoice::Sun => LightGroup::Sun,
            LightChoice::Sky => LightGroup::Sky,
        },
        leaf: match reference.leaf {
            LeafChoice::Species => LeafModel::Species,
            LeafChoice::Standard => LeafModel::Standard,
            LeafChoice::Layers => LeafModel::Layers,
            LeafChoice::Published => LeafModel::Published,
        },
        fog: !reference.clear_air,
        resume: reference.resume,
        overrides: overrides(common),
        quiet: common.quiet,
    })
}

/// The options of an export.
///
/// # Errors
/// A usage error for a file that does not end in `.glb`.
pub fn export_options(export: Export, common: &Common) -> Result<ExportOptions, clap::Error> {
    if !ends_in(&export.out, "glb") {
        let file = export.out.display();
        return Err(usage(format!("--out {file}: a forest is exported as binary glTF; the name must end in .glb")));
    }
    Ok(ExportOptions {
        scene: export.scene.into(),
        out: export.out,
        nodes: export.nodes,
        without_ground: export.no_ground,
        within: export.within,
        overrides: overrides(common),
    })
}

/// The options of a merge.
pub fn merge_options(merge: Merge) -> MergeOptions {
    MergeOptions { parts: merge.parts, out: merge.out, exr: merge.exr, incomplete: merge.incomplete }
}

/// The scene whose plants are to be baked, with what replaces its values; `None` for the contact sheet of a plant.
pub fn baked_scene(bake: &Bake, common: &Common) -> Option<(SceneSource, Overrides)> {
    let is_scene = bake.out.is_none() && ends_in(&bake.plant, "ron");
    is_scene.then(|| (bake.plant.clone().into(), overrides(common)))
}

/// The options of a bake.
///
/// # Errors
/// A usage error for a file that does not end in `.png`.
pub fn bake_options(bake: Bake, common: &Common) -> Result<BakeOptions, clap::Error> {
    let Some(out) = bake.out else {
        return Err(usage("--out: name the PNG file for the contact sheet of a plant".to_owned()));
    };
    if !ends_in(&out, "png") {
        let file = out.display();
        return Err(usage(format!("--out {file}: a contact sheet is a PNG file; the name must end in .png")));
    }
    Ok(BakeOptions {
        plant: bake.plant,
        out,
        planes: bake.planes,
        msaa: common.msaa,
        lighting: common.lighting.clone(),
        adapter: common.adapter.clone(),
        quiet: common.quiet,
    })
}

/// The options of a leaf.
pub fn leaf_options(leaf: Leaf, common: &Common) -> LeafOptions {
    LeafOptions {
        file: leaf.file,
        out: leaf.out,
        material: leaf.material,
        given: LeafImages {
            back: leaf.back,
            transmission: leaf.transmission,
            thickness: leaf.thickness,
            absorption: leaf.absorption,
            bump: leaf.bump,
        },
        kind: leaf.kind,
        max_thickness: leaf.max_thickness.map(|millimetres| (1e-3 * millimetres) as f32),
        width: leaf.width as f32,
        published: leaf.published,
        high_pass: leaf.high_pass.map(|fraction| fraction as f32),
        samples: leaf.spp,
        quiet: common.quiet,
    }
}

/// The options of a comparison.
///
/// # Errors
/// A usage error for a map of single images that does not end in `.png`.
pub fn compare_options(compare: &Compare) -> Result<CompareOptions, clap::Error> {
    let is_sequence = compare.test.is_dir() || compare.test.to_string_lossy().contains('*');
    if let Some(map) = compare.map.as_ref().filter(|map| !is_sequence && !ends_in(map, "png")) {
        let file = map.display();
        return Err(usage(format!("--map {file}: a map of errors is a PNG file; the name must end in .png")));
    }
    Ok(CompareOptions {
        test: compare.test.clone(),
        reference: compare.reference.clone(),
        pixels_per_degree: compare.ppd.unwrap_or(PIXELS_PER_DEGREE),
        mask: compare.mask.clone(),
        half: compare.half.clone(),
        map: compare.map.clone(),
    })
}

/// The options of a profile.
///
/// # Errors
/// A usage error for several times of a flight, or a reference that is none.
pub fn profile_options(profile: &Profile, common: &Common) -> Result<ProfileOptions, clap::Error> {
    Ok(ProfileOptions {
        sweeps: profile.sweep.clone(),
        combination: if profile.each { Combination::Each } else { Combination::All },
        part: profile.chunk,
        control: profile.control,
        against: profile.against.map(|PeerChoice::Stock| Peer { most_trees: profile.peer_trees }),
        shown: profile.pictures,
        resume: profile.resume,
        ..measured(&profile.scene, &profile.out, &profile.measured, common)?
    })
}

/// The options of a search.
///
/// # Errors
/// Those of [`profile_options`].
pub fn tune_options(tune: &Tune, common: &Common) -> Result<TuneOptions, clap::Error> {
    let goal = match (tune.budget, tune.error) {
        (Some(budget), _) => Goal::Budget(budget),
        (None, Some(error)) => Goal::Error(error),
        (None, None) => return Err(usage("give a --budget or an --error".to_owned())),
    };
    let profile = measured(&tune.scene, &tune.out, &tune.measured, common)?;
    Ok(TuneOptions { goal, profile: ProfileOptions { sweeps: tune.sweep.clone(), resume: tune.resume, ..profile } })
}

/// What profiles and searches have in common.
fn measured(scene: &Path, out: &Path, measured: &Measured, common: &Common) -> Result<ProfileOptions, clap::Error> {
    let views = if measured.camera.is_empty() {
        if measured.at.len() > 1 {
            return Err(usage("a flight takes one --at; give a --camera for several times of day".to_owned()));
        }
        let (frames, fps, from) = (measured.frames, measured.fps, measured.along);
        Views::Flight { frames, fps, from, at: measured.at.first().copied() }
    } else {
        Views::Stills { cameras: measured.camera.clone(), times: measured.at.clone() }
    };
    let reference = match measured.reference.to_str() {
        Some("none") => ReferenceKind::None,
        Some("full") => ReferenceKind::Full { supersampling: measured.supersample },
        Some("traced") => ReferenceKind::Traced { samples: measured.spp },
        _ if measured.reference.is_dir() => ReferenceKind::Folder(measured.reference.clone()),
        _ => {
            let what = measured.reference.display();
            return Err(usage(format!("--reference {what}: expected full, traced, none or a folder with images")));
        }
    };
    Ok(ProfileOptions {
        scene: scene.to_owned().into(),
        out: out.to_owned(),
        sweeps: Vec::new(),
        combination: Combination::All,
        part: None,
        control: false,
        against: None,
        views,
        size: measured.size,
        rounds: measured.rounds,
        warm_up: measured.warm_up,
        reference,
        shown: 1,
        resume: false,
        overrides: overrides(common),
        adapter: common.adapter.clone(),
        command: command_line(),
    })
}

/// The command line, with quotes where a shell needs them.
fn command_line() -> String {
    let plain =
        |word: &str| !word.is_empty() && word.chars().all(|c| c.is_ascii_alphanumeric() || "-_=.,:/+".contains(c));
    let quoted = |word: String| if plain(&word) { word } else { format!("'{}'", word.replace('\'', "'\\''")) };
    let words = std::env::args_os().skip(1).map(|word| quoted(word.to_string_lossy().into_owned()));
    std::iter::once("canopy".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

fn output(mut out: Vec<PathBuf>, at: &[LocalTime], sequence: &SequenceArguments) -> Result<Output, clap::Error> {
    let Some(frames) = sequence.frames else {
        if out.len() != at.len().max(1) {
            return Err(usage(format!(
                "{} --out and {} --at: give one --out for each --at (or --frames for a sequence)",
                out.len(),
                at.len()
            )));
        }
        let times = at.iter().copied().map(Some).chain(std::iter::repeat(None));
        return Ok(Output::Stills(out.into_iter().zip(times).map(|(out, at)| Still { out, at }).collect()));
    };
    if at.len() > 1 {
        return Err(usage("a sequence (--frames) takes one --at, or --from and --to".to_owned()));
    }
    match (out.pop(), out.is_empty()) {
        (Some(out), true) => Ok(Output::Sequence {
            out,
            frames,
            fps: sequence.fps,
            clock: match sequence.from.zip(sequence.to) {
                Some((from, to)) => Clock::Lapse { from, to },
                None => Clock::Standing(at.first().copied()),
            },
        }),
        _ => Err(usage("a sequence (--frames) takes one --out".to_owned())),
    }
}

fn selection(sequence: SequenceArguments) -> Selection {
    sequence.frames_only.or(sequence.chunk).unwrap_or_default()
}

fn ends_in(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(ending))
}

pub(super) fn usage(message: String) -> clap::Error {
    Arguments::command().error(ErrorKind::ArgumentConflict, message)
}

/// The usage error of a command line without a command.
pub fn no_command() -> clap::Error {
    Arguments::command().error(
        ErrorKind::MissingSubcommand,
        "no command given (expected fly, render, reference, bake, leaf, compare, profile, tune or info)",
    )
}

fn view(camera: &CameraArguments) -> View {
    match (camera.camera, camera.along) {
        (Some(pose), _) => View::Pose(pose),
        (None, Some(seconds)) => View::Along(seconds),
        (None, None) => View::Scene,
    }
}

/// The demo scene: in the folder `assets` of the working directory, next to the program, or where the program was
/// built.
fn demo_scene() -> PathBuf {
    let beside = std::env::current_exe().ok().and_then(|program| Some(program.parent()?.join("assets").join(DEMO)));
    let built = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").join(DEMO);
    let here = Path::new("assets").join(DEMO);
    [Some(here.clone()), beside, Some(built)].into_iter().flatten().find(|scene| scene.is_file()).unwrap_or(here)
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::super::arguments::Command;
    use super::*;

    fn render(arguments: &str) -> Result<RenderOptions, clap::Error> {
        let words = ["canopy", "render", "s.ron"].into_iter().chain(arguments.split_whitespace());
        let arguments = Arguments::try_parse_from(words)?;
        match arguments.command {
            Some(Command::Render(render)) => render_options(render, &arguments.common),
            _ => Err(usage("no render".to_owned())),
        }
    }

    #[test]
    fn the_definition_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn stills_pair_files_with_instants() -> Result<(), Box<dyn std::error::Error>> {
        let options = render("--at 2026-06-21T06:00Z --out a.png --at 2026-06-21T12:00Z --out b.PNG --quiet")?;
        let Output::Stills(stills) = options.output else { return Err("no stills".into()) };
        assert_eq!(stills[1], Still { out: "b.PNG".into(), at: Some("2026-06-21T12:00Z".parse()?) });
        assert!(
            options.quiet
                && options.size == (1280, 720)
                && options.view == View::Scene
                && options.overrides == Overrides::default()
        );
        assert_eq!(render("--out a.png --msaa 1")?.overrides.msaa, Some(1));
        Ok(())
    }

    #[test]
    fn sequences_and_lapses() -> Result<(), Box<dyn std::error::Error>> {
        let flight = render("--out f --frames 10 --fps 5 --along 12.5s")?;
        let clock = Clock::Standing(None);
        let expected = Output::Sequence { out: "f".into(), frames: 10, fps: Some(5.0), clock };
        assert_eq!((flight.output, flight.view), (expected, View::Along(12.5)));
        let lapse = render("--out d.png --frames 3 --from 2026-06-21T04:00Z --to 2026-06-21T20:00Z")?;
        assert!(matches!(lapse.output, Output::Sequence { clock: Clock::Lapse { .. }, fps: None, .. }));
        let west = render("--out a.png --camera -10,2,-30,270,-5")?;
        assert!(matches!(west.view, View::Pose(pose) if pose.position == (-10.0, 2.0, -30.0)));
        Ok(())
    }

    #[test]
    fn references_are_exr_or_png() -> Result<(), Box<dyn std::error::Error>> {
        let read = |arguments: &str| {
            let words = ["canopy", "reference", "s.ron"].into_iter().chain(arguments.split_whitespace());
            let arguments = Arguments::try_parse_from(words)?;
            match arguments.command {
                Some(Command::Reference(reference)) => reference_options(reference, &arguments.common),
                _ => Err(usage("no reference".to_owned())),
            }
        };
        let options = read("--out a.EXR --spp 7 --bounces 2 --resume --clear-air --size 64x32")?;
        assert!(options.samples == 7 && options.bounces == Some(2) && options.resume && !options.fog);
        assert!(read("--out a.png")?.fog);
        assert_eq!(read("--out a.png")?.light, LightGroup::All);
        assert_eq!(read("--out a.png --light sky")?.light, LightGroup::Sky);
        for wrong in ["", "--out a.jpg", "--out a.exr --spp 0", "--out a.exr --bounces -1"] {
            assert_eq!(read(wrong).map(|_| ()).map_err(|error| error.exit_code()), Err(2), "{wrong}");
        }
        Ok(())
    }

    /// The number of frames beside a camera was once ignored, and a search could not be gone on with.
    #[test]
    fn profiles_and_searches() -> Result<(), Box<dyn std::error::Error>> {
        let read = |line: &str| {
            let words = ["canopy"].into_iter().chain(line.split_whitespace());
            let arguments = Arguments::try_parse_from(words)?;
            match arguments.command {
                Some(Command::Profile(profile)) => profile_options(&profile, &arguments.common),
                Some(Command::Tune(tune)) => Ok(tune_options(&tune, &arguments.common)?.profile),
                _ => Err(usage("no profile".to_owned())),
            }
        };
        assert!(read("tune s.ron --budget 8ms --resume")?.resume && !read("tune s.ron --budget 8ms")?.resume);
        assert!(matches!(read("profile s.ron --camera 0,2,0,90,0")?.views, Views::Stills { .. }));
        assert!(matches!(read("profile s.ron --frames 5")?.views, Views::Flight { frames: 5, .. }));
        let both = read("profile s.ron --camera 0,2,0,90,0 --frames 5").map(|_| ());
        assert!(both.is_err_and(|error| error.exit_code() == 2 && error.to_string().contains("--frames")));
        // Which pieces there are is said where they are cut, as for frames.
        for line in ["profile s.ron --chunk 3/2", "profile s.ron --chunk 0/2"] {
            assert!(read(line).is_ok(), "{line}");
        }
        Ok(())
    }

    #[test]
    fn arguments_that_do_not_fit_are_usage_errors() {
        for wrong in [
            "",
            "--out a.png --size 0x0",
            "--out a.jpg",
            "--out a.png --out b.png",
            "--out a.png --at 2026-06-21T06:00Z --at 2026-06-21T07:00Z",
            "--out a.png --at 2026-06-21T06:00",
            "--out a.png --camera 1,2,3",
            "--out a.png --camera 0,1,0,0,0 --along 1s",
            "--out a --frames 0",
            "--out a --out b --frames 2",
            "--out a.png --fps 25",
            "--out a --frames 2 --fps 0",
            "--out a --frames 2 --from 2026-06-21T06:00Z",
            "--out a --frames 2 --at 2026-06-21T06:00Z --from 2026-06-21T06:00Z --to 2026-06-21T07:00Z",
            "--out a.png --seed -1",
            "--out a.png --msaa 2",
            "--out a.png --year 2000,",
            "--out a.png --year soon",
            "--out a.png --lighting bright",
            "--out a.png --unknown",
        ] {
            assert_eq!(render(wrong).map(|_| ()).map_err(|error| error.exit_code()), Err(2), "{wrong}");
        }
    }
}
