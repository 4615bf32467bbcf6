//! Times the frames of a renderer: CPU by clocks, device by timestamps, each frame waited for.

use std::{collections::BTreeMap, time::Instant};

use bevy::{
    app::{App, Last},
    diagnostic::{DiagnosticPath, DiagnosticsStore},
    ecs::{resource::Resource, system::ResMut, world::World},
};

use super::{contestant::Contestant, record::FrameTime, views::ProfileView};
use crate::{app::AppError, render::diagnostics::CanopyDiagnosticsPlugin};

/// When the main world was done with the frame.
#[derive(Resource, Default)]
struct MainWorldDone(Option<Instant>);

fn note_end(mut done: ResMut<MainWorldDone>) {
    done.0 = Some(Instant::now());
}

/// What a renderer needs so that it can be timed.
pub fn prepare(app: &mut App) {
    app.add_plugins(CanopyDiagnosticsPlugin).init_resource::<MainWorldDone>();
    app.add_systems(Last, note_end);
}

/// Updates from a frame to that in which its figures of the device are there: Bevy reads them back with the next frame, and
/// brings them to the main world with the one after that.
const LATENCY: usize = 2;
/// Updates after which settings that still wait for a pipeline are given up.
const PATIENCE: u32 = 200;

/// Figures of the device for one frame, by Bevy's path.
pub type DeviceFigures = BTreeMap<String, f64>;

/// Reads the device's figures from Bevy's diagnostics as they arrive.
#[derive(Default)]
pub struct DeviceReader {
    seen: BTreeMap<String, Instant>,
}

impl DeviceReader {
    /// What is new since the last call; several measurements of one frame under one name, as those of the cascades, are
    /// added.
    pub fn read(&mut self, world: &World) -> DeviceFigures {
        let Some(store) = world.get_resource::<DiagnosticsStore>() else { return DeviceFigures::new() };
        let mut figures = DeviceFigures::new();
        for diagnostic in store.iter() {
            let path: &DiagnosticPath = diagnostic.path();
            if !path.as_str().starts_with("render/") {
                continue;
            }
            let Some(latest) = diagnostic.measurement().map(|measurement| measurement.time) else { continue };
            if self.seen.get(path.as_str()) == Some(&latest) {
                continue;
            }
            let sum = diagnostic.measurements().filter(|one| one.time == latest).map(|one| one.value).sum();
            self.seen.insert(path.as_str().to_owned(), latest);
            figures.insert(path.as_str().to_owned(), sum);
        }
        figures
    }
}

/// Milliseconds of the passes on the device; the outermost spans only, so that nothing counts twice.
fn passes(figures: &DeviceFigures) -> BTreeMap<String, f64> {
    let pass = |(path, value): (&String, &f64)| {
        let name = path.strip_prefix("render/")?.strip_suffix("/elapsed_gpu")?;
        (!name.contains('/')).then(|| (name.strip_prefix("canopy_").unwrap_or(name).to_owned(), *value))
    };
    figures.iter().filter_map(pass).collect()
}

/// Calls of fragment shaders of the passes of the view, not of the shadow maps, whose names contain `prefix`; `None` where the device does
/// not count.
pub fn fragments(figures: &DeviceFigures, prefix: &str) -> Option<f64> {
    let of_view = |path: &String| {
        path.ends_with("/fragment_shader_invocations") && path.contains(prefix) && !path.contains("shadow")
    };
    let found: Vec<f64> = figures.iter().filter(|(path, _)| of_view(path)).map(|(_, value)| *value).collect();
    (!found.is_empty()).then(|| found.iter().sum())
}

/// Draws the first view until nothing waits for a pipeline, and `warm_up` frames more.
///
/// # Errors
/// [`AppError::Render`].
pub fn settle(contestant: &mut dyn Contestant, first: &ProfileView, warm_up: u32) -> Result<(), AppError> {
    contestant.set_view(&first.view, first.instant)?;
    let (mut steady, mut tried) = (0, 0);
    while steady <= warm_up && tried < PATIENCE + warm_up {
        steady = if contestant.update()?.updates == 1 { steady + 1 } else { 0 };
        tried += 1;
    }
    Ok(())
}

/// Draws all views once, each after the frames on the way to it, and returns their times. `stop` is asked before each frame; a round that it ends is `None`.
///
/// # Errors
/// [`AppError::Render`].
pub fn time_round(
    contestant: &mut dyn Contestant,
    views: &[ProfileView],
    warm_up: u32,
    since: Instant,
    stop: &dyn Fn() -> bool,
) -> Result<Option<Vec<FrameTime>>, AppError> {
    let Some(first) = views.first() else { return Ok(Some(Vec::new())) };
    settle(contestant, first, warm_up)?;
    let mut reader = DeviceReader::default();
    reader.read(contestant.world());
    let mut frames: Vec<FrameTime> = Vec::with_capacity(views.len());
    // Of all updates, and which of them are the views'.
    let (mut figures, mut updates): (Vec<DeviceFigures>, Vec<usize>) = (Vec::new(), Vec::new());
    let mut in_step = true;
    let milliseconds = |from: Instant, to: Instant| to.saturating_duration_since(from).as_secs_f64() * 1e3;
    for view in views {
        if stop() {
            return Ok(None);
        }
        for before in &view.lead {
            contestant.set_view(before, view.instant)?;
            in_step &= contestant.update()?.updates == 1;
            figures.push(reader.read(contestant.world()));
        }
        contestant.set_view(&view.view, view.instant)?;
        let mut time = contestant.update()?;
        if time.updates > 1 {
            // It waited for a pipeline, which is there now. The device's figures no longer fall on the frames they are of.
            time = contestant.update()?;
            in_step = false;
        }
        let main = contestant.world().get_resource::<MainWorldDone>().and_then(|done| done.0);
        updates.push(figures.len());
        figures.push(reader.read(contestant.world()));
        frames.push(FrameTime {
            start: milliseconds(since, time.began),
            frame: milliseconds(time.began, time.finished),
            cpu_main: main.map(|main| milliseconds(time.began, main)),
            cpu_render: main.map(|main| milliseconds(main.max(time.began), time.submitted)),
            gpu: None,
            passes: BTreeMap::new(),
        });
    }
    for _ in 0..LATENCY {
        contestant.update()?;
        figures.push(reader.read(contestant.world()));
    }
    for (frame, update) in frames.iter_mut().zip(updates).filter(|_| in_step) {
        let Some(figures) = figures.get(update + LATENCY) else { continue };
        frame.passes = passes(figures);
        frame.gpu = (!frame.passes.is_empty()).then(|| frame.passes.values().sum());
    }
    Ok(Some(frames))
}
