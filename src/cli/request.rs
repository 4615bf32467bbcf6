//! Turns arguments into the requests of the library.

use std::path::{Path, PathBuf};

use canopy::{
    app::{BakeOptions, Clock, FlyOptions, LightGroup, Output, ReferenceOptions, RenderOptions, Still, View},
    scene::{LocalTime, Overrides},
};
use clap::CommandFactory;
use clap::error::ErrorKind;

use super::arguments::{Arguments, Bake, CameraArguments, Common, Fly, LightChoice, Reference, Render};

/// The scene of `canopy fly` without an argument.
const DEMO: &str = "scenes/demo.ron";

fn overrides(common: &Common) -> Overrides {
    Overrides {
        seed: common.seed,
        msaa: common.msaa,
        exposure: common.exposure,
        strict: common.strict,
        year: common.year,
        variant: common.variant.clone(),
        lighting: common.lighting.clone(),
    }
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
        overrides: overrides(common),
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
    Ok(RenderOptions {
        view: view(&render.view),
        size: render.size,
        resume: render.resume,
        overrides: overrides(common),
        adapter: common.adapter.clone(),
        quiet: common.quiet,
        explain: common.explain,
        scene: render.scene.into(),
        output: output(render.out, &render.at, render.frames, render.fps, render.from.zip(render.to))?,
    })
}

/// The options of a ground truth render.
///
/// # Errors
/// A usage error for a file that ends neither in `.exr` nor in `.png`.
pub fn reference_options(reference: Reference, common: &Common) -> Result<ReferenceOptions, clap::Error> {
    if !ends_in(&reference.out, "exr") && !ends_in(&reference.out, "png") {
        let file = reference.out.display();
        return Err(usage(format!(
            "--out {file}: a reference is an OpenEXR or PNG file; the name must end in .exr or .png"
        )));
    }
    Ok(ReferenceOptions {
        view: view(&reference.view),
        scene: reference.scene.into(),
        out: reference.out,
        at: reference.at,
        size: reference.size,
        samples: reference.spp,
        bounces: reference.bounces,
        light: match reference.light {
            LightChoice::All => LightGroup::All,
            LightChoice::Sun => LightGroup::Sun,
            LightChoice::Sky => LightGroup::Sky,
        },
        fog: !reference.clear_air,
        resume: reference.resume,
        overrides: overrides(common),
        quiet: common.quiet,
    })
}

/// The options of a bake.
///
/// # Errors
/// A usage error for a file that does not end in `.png`.
pub fn bake_options(bake: Bake, common: &Common) -> Result<BakeOptions, clap::Error> {
    if !ends_in(&bake.out, "png") {
        let file = bake.out.display();
        return Err(usage(format!("--out {file}: a contact sheet is a PNG file; the name must end in .png")));
    }
    Ok(BakeOptions {
        plant: bake.plant,
        out: bake.out,
        planes: bake.planes,
        msaa: common.msaa,
        lighting: common.lighting.clone(),
        adapter: common.adapter.clone(),
        quiet: common.quiet,
    })
}

fn output(
    mut out: Vec<PathBuf>,
    at: &[LocalTime],
    frames: Option<u32>,
    fps: Option<f64>,
    span: Option<(LocalTime, LocalTime)>,
) -> Result<Output, clap::Error> {
    let Some(frames) = frames else {
        if out.len() != at.len().max(1) {
            return Err(usage(format!(
                "{} --out and {} --at: give one --out for each --at (or --frames for a sequence)",
                out.len(),
                at.len()
            )));
        }
        if let Some(wrong) = out.iter().find(|file| !ends_in(file, "png")) {
            return Err(usage(format!("--out {}: images are PNG files; the name must end in .png", wrong.display())));
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
            fps,
            clock: match span {
                Some((from, to)) => Clock::Lapse { from, to },
                None => Clock::Standing(at.first().copied()),
            },
        }),
        _ => Err(usage("a sequence (--frames) takes one --out".to_owned())),
    }
}

fn ends_in(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(ending))
}

fn usage(message: String) -> clap::Error {
    Arguments::command().error(ErrorKind::ArgumentConflict, message)
}

/// The usage error of a command line without a command.
pub fn no_command() -> clap::Error {
    Arguments::command()
        .error(ErrorKind::MissingSubcommand, "no command given (expected fly, render, reference, bake or info)")
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
            "--out a.png --lighting bright",
            "--out a.png --unknown",
        ] {
            assert_eq!(render(wrong).map(|_| ()).map_err(|error| error.exit_code()), Err(2), "{wrong}");
        }
    }
}
