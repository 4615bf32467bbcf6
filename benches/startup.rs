//! Question: what does a user wait for between `canopy render` and the image on disk?
//!
//! The steps of the program on the demo scene, timed one by one in a process of their own for each turn, so that
//! nothing is warm but what is warm for a user too: the files in the page cache, the baked plants, the driver's shader
//! cache. The first turn warms these and is not reported.
//!
//! Then the same frame is drawn twice more, each time after one of another place and hour, so that shadow maps, tiles
//! and sky are made anew every time: once with all plants and trees uploaded again, once without. What the first frame
//! costs beyond the former are the pipelines; what the former costs beyond the latter is the upload.
//!
//! With `--appear`: how long are the frames around the one in which a forest of these plants appears?
//!
//! With `--change`: how long does a program wait for another scene?
//!
//! With `--trees`: what do time and memory cost as a forest grows?
//!
//! Run `cargo bench --bench startup -- --help` for the arguments; benches/README.md has results.

#[path = "startup/appear.rs"]
mod appear;
#[path = "startup/change.rs"]
mod change;
#[path = "startup/sizes.rs"]
mod sizes;

use std::{path::PathBuf, process::Command, time::Instant};

use anyhow::{Context, ensure};
use bevy::ecs::{
    entity::Entity,
    query::{Or, With},
};
use canopy::{
    app::{Output, RenderOptions, RenderPlan, Renderer, Still, View},
    assets::Stage,
    progress::Progress,
    render::components::{Forest, Ground},
    scene::{Overrides, Scene, Viewpoint},
};
use chrono::TimeDelta;
use clap::Parser;

/// The time to the first image, by its steps.
#[derive(Parser, Debug)]
#[command(name = "startup")]
struct Arguments {
    /// The scene.
    #[arg(long, default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scenes/demo.ron"))]
    scene: PathBuf,
    /// Image size in pixels.
    #[arg(long, default_value = "1280x720", value_parser = parse_size)]
    size: (u32, u32),
    /// Reported turns.
    #[arg(long, default_value_t = 3)]
    turns: usize,
    /// The other image's shift, metres.
    #[arg(long, default_value_t = 700.0)]
    shift: f64,
    /// Instead: times the frames around the appearance of a forest of the plants in these glTF files.
    #[arg(long, num_args = 1..)]
    appear: Vec<PathBuf>,
    /// Trees per hectare of that forest.
    #[arg(long, default_value_t = 100.0)]
    stems: f64,
    /// Draw that forest without shadow maps. They are drawn for what appears, and for nothing else.
    #[arg(long)]
    no_shadows: bool,
    /// Bring that forest onto the device in one frame, as for images.
    #[arg(long)]
    blocking: bool,
    /// Instead: times changes between the scene and another one, while frames run.
    #[arg(long)]
    change: bool,
    /// The other scene of `--change`.
    #[arg(long, default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scenes/inventory.ron"))]
    other: PathBuf,
    /// Instead: builds and draws forests of these numbers of trees.
    #[arg(long, num_args = 1..)]
    trees: Vec<u64>,
    /// One turn in this process: what the other processes of a run are.
    #[arg(long, hide = true)]
    turn: bool,
    /// Cargo says so to every benchmark; nothing depends on it.
    #[arg(long, hide = true)]
    bench: bool,
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let pair = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    pair.filter(|&(w, h): &(u32, u32)| w > 0 && h > 0).ok_or_else(|| format!("`{text}` is not like 1280x720"))
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    if arguments.turn {
        return match arguments.trees.first() {
            Some(trees) => sizes::turn(&arguments, *trees),
            None => turn(&arguments),
        };
    }
    if !arguments.trees.is_empty() {
        return sizes::run(&arguments);
    }
    if arguments.change {
        return change::run(&arguments);
    }
    if !arguments.appear.is_empty() {
        return appear::run(&arguments);
    }
    let mut turns = Vec::new();
    for warm in (0..=arguments.turns).map(|index| index > 0) {
        let started = Instant::now();
        let output = Command::new(std::env::current_exe()?).args(std::env::args_os().skip(1)).arg("--turn").output()?;
        let whole = started.elapsed().as_secs_f64();
        let text = String::from_utf8(output.stdout)?;
        ensure!(output.status.success(), "a turn failed: {}", String::from_utf8_lossy(&output.stderr));
        let mut steps = text.lines().map(parse_step).collect::<anyhow::Result<Vec<_>>>()?;
        // What comes after the image is not what a user waits for, so the process is charged up to there.
        let after = steps.iter().filter(|(name, _)| name.starts_with(AFTER)).map(|(_, time)| time).sum::<f64>();
        let inside: f64 = steps.iter().filter(|(name, _)| !name.starts_with(AFTER)).map(|(_, time)| time).sum();
        steps.insert(0, ("process: loading the program, and its end".to_owned(), (whole - after - inside).max(0.0)));
        if warm {
            turns.push(steps);
        }
    }
    print_table(&turns);
    Ok(())
}

/// Steps that come after the image is on disk.
const AFTER: &str = "(after)";
const FIRST_FRAME: &str = "first frame, with uploads and pipelines";
const ELSEWHERE: &str = "(after) frames of another place and hour";
const UPLOADED_AGAIN: &str = "(after) the first frame again, with uploads";
const DRAWN_AGAIN: &str = "(after) the first frame again, without";

fn parse_step(line: &str) -> anyhow::Result<(String, f64)> {
    let (seconds, name) = line.split_once('\t').context("a turn printed something else than its steps")?;
    Ok((name.to_owned(), seconds.parse()?))
}

/// Takes the time of the steps that a stage's notes do not tell apart.
struct Steps {
    last: Instant,
    open: Option<String>,
}

impl Steps {
    fn done(&mut self, name: &str) {
        println!("{:.6}\t{name}", self.last.elapsed().as_secs_f64());
        self.last = Instant::now();
    }
}

impl Progress for Steps {
    fn begin(&mut self, what: &str, _steps: u64) {
        self.done("loading: scene file and the rest");
        self.open = Some(what.to_owned());
    }

    fn advance(&mut self, _steps: u64) {}

    fn end(&mut self) {
        if let Some(what) = self.open.take() {
            self.done(&format!("loading: {}", what.to_lowercase()));
        }
    }

    fn warn(&mut self, _message: &str) {}

    fn note(&mut self, _message: &str) {}
}

fn turn(arguments: &Arguments) -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let mut steps = Steps { last: Instant::now(), open: None };
    let stage = Stage::build(&Scene::read(&arguments.scene)?, &mut steps)?;
    steps.done("loading: scene file and the rest");
    let mut renderer = Renderer::new(arguments.size, None, stage.scene.quality.msaa)?;
    steps.done("Bevy and the device");
    renderer.show(&stage);
    let view = first_view(arguments, &stage.scene, &stage)?;
    let instant = stage.scene.place.time.utc();
    renderer.set_instant(&stage, instant);
    renderer.set_view(&view);
    renderer.update()?;
    steps.done(FIRST_FRAME);
    let picture = renderer.read()?;
    steps.done("reading the image back");
    picture.save(&folder.path().join("picture.png"), &[])?;
    steps.done("writing the PNG");
    let elsewhere = Viewpoint { position: view.position - arguments.shift * view.forward().with_y(0.0), ..view };
    for step in [UPLOADED_AGAIN, DRAWN_AGAIN] {
        renderer.set_instant(&stage, instant + TimeDelta::minutes(90));
        renderer.set_view(&elsewhere);
        renderer.update()?;
        steps.done(ELSEWHERE);
        if step == UPLOADED_AGAIN {
            let world = renderer.app().world_mut();
            let shown: Vec<Entity> =
                world.query_filtered::<Entity, Or<(With<Forest>, With<Ground>)>>().iter(world).collect();
            shown.into_iter().for_each(|entity| _ = world.despawn(entity));
            renderer.show(&stage);
        }
        renderer.set_instant(&stage, instant);
        renderer.set_view(&view);
        renderer.update()?;
        steps.done(step);
    }
    Ok(())
}

fn first_view(arguments: &Arguments, scene: &Scene, stage: &Stage) -> anyhow::Result<Viewpoint> {
    let options = RenderOptions {
        scene: arguments.scene.as_path().into(),
        output: Output::Stills(vec![Still { out: "picture.png".into(), at: None }]),
        view: View::Scene,
        size: arguments.size,
        beside: canopy::app::Beside::default(),
        selection: canopy::app::Selection::All,
        resume: false,
        overrides: Overrides::default(),
        adapter: None,
        quiet: true,
        explain: false,
    };
    let plan = RenderPlan::new(&options, scene, &|x, z| stage.terrain.height(x, z))?;
    Ok(plan.frames.first().context("the scene has no image")?.view)
}

fn print_table(turns: &[Vec<(String, f64)>]) {
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in turns.iter().flatten() {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let median_of = |name: &str| {
        let mut times: Vec<f64> = turns
            .iter()
            .map(|steps| steps.iter().filter(|(step, _)| step == name).map(|(_, time)| time).sum())
            .collect();
        times.sort_by(f64::total_cmp);
        times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let whole: f64 = names.iter().filter(|name| !name.starts_with(AFTER)).map(|name| median_of(name)).sum();
    println!("| step | seconds, median of {} | share |\n|---|--:|--:|", turns.len());
    for name in &names {
        let time = median_of(name);
        if name.starts_with(AFTER) {
            println!("| {name} | {time:.2} | - |");
        } else {
            println!("| {name} | {time:.2} | {:.0} % |", 100.0 * time / whole);
        }
    }
    println!("| **to the picture on disk** | **{whole:.2}** | |");
    let pipelines = median_of(FIRST_FRAME) - median_of(UPLOADED_AGAIN);
    let uploads = median_of(UPLOADED_AGAIN) - median_of(DRAWN_AGAIN);
    println!("\nOf the first frame, {pipelines:.2} s are pipelines and {uploads:.2} s are uploads; both happen once.");
}
