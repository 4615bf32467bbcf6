//! The ground truth of a scene: what `canopy reference` does.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;

use super::{
    Frame, LightGroup, Output, PlanError, ReferenceOptions, RenderOptions, RenderPlan, Selection, Still, camera::NEAR,
    error::AppError, interrupt, notes::notes, rendered_image::RenderedImage, tone::tone_table,
};
use crate::{
    assets::Stage,
    files,
    light::{Atmosphere, AtmosphereParams, LightState, exposure_from_ev100},
    progress::Progress,
    reference::{
        Camera, DisplayTransform, Film, Fog, Ground, GroundColor, GroundShape, Instance, Light, PathTracer,
        ReferenceScene, Shot, Soil, TraceSettings,
    },
    render::exposure::{CameraExposure, StandTotals},
};

/// Interval at which the film is saved during the trace.
const KEEP_EVERY: Duration = Duration::from_secs(30);

/// Traces the image of `options`, as OpenEXR or PNG by the ending of its name; returns the file.
///
/// The film is saved every 30 s and when the work is interrupted, in a file next to the image that ends in
/// `.checkpoint`. With `resume` a film of the
/// same scene, light and camera continues from there, and the file stays when the image is done, so that more samples
/// can be added. Without it the trace starts from the beginning, and the file is deleted at the end.
///
/// # Errors
/// [`AppError`]; an existing image stays as it is. [`AppError::Interrupted`] soon after a signal, and after the current
/// sample when `progress` [is cancelled](Progress::is_cancelled).
pub fn reference(options: &ReferenceOptions, progress: &mut dyn Progress) -> Result<PathBuf, AppError> {
    let written = options.overrides.applied(options.scene.read()?);
    RenderPlan::check(&as_still(options), &written)?;
    files::check_writable(&options.out).map_err(|source| AppError::Write { path: options.out.clone(), source })?;
    let stage = Stage::build(&written, progress).map_err(interrupt::building)?;
    let frame = frame(options, &stage)?;
    let sun = stage.sun(frame.instant);
    let atmosphere = Atmosphere::new(AtmosphereParams::with_visibility_km(sun.visibility_km))?;
    let light = Arc::new(sun.light(&atmosphere)?);

    progress.begin("Building ray tracing structures", 0);
    let scene = scene(&stage)?.with_leaves(options.leaf);
    progress.end();
    let settings = TraceSettings { bounces: options.bounces.unwrap_or(u32::MAX), ..TraceSettings::default() };
    let all = Light::of(&light, None);
    let chosen = match options.light {
        LightGroup::All => all,
        LightGroup::Sun => all.without_environment(),
        LightGroup::Sky => all.without_key(),
    };
    let tracer = PathTracer::new(&scene, &chosen, settings)?;
    let shot = Shot {
        camera: Camera { view: frame.view, size: options.size, near: NEAR.into() },
        fog: options.fog.then(|| Fog::new(&light, frame.view.position.y)),
    };
    let kept = options.out.with_extension("checkpoint");
    let fingerprint = tracer.fingerprint(&shot);
    let mut film = match options.resume.then(|| Film::load_checkpoint(&kept, &fingerprint)).transpose()?.flatten() {
        Some(film) => film,
        None => Film::new(&shot)?,
    };

    progress.begin("Samples", options.samples.into());
    progress.advance(film.samples().min(options.samples).into());
    let (started, earlier) = (Instant::now(), film.samples());
    let (mut last, mut failure) = (started, None);
    let stop = || interrupt::received().is_some();
    tracer.render_unless(&shot, &mut film, options.samples, &stop, &mut |film: &Film| {
        progress.advance(1);
        if film.samples() == earlier + 1 {
            progress.note(&format!("first sample per pixel: {:.2} s", started.elapsed().as_secs_f64()));
        }
        if last.elapsed() >= KEEP_EVERY {
            last = Instant::now();
            if let Err(error) = film.save_checkpoint(&kept, &fingerprint) {
                failure = Some(error);
                return ControlFlow::Break(());
            }
        }
        if progress.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    progress.end();
    if let Some(error) = failure {
        return Err(error.into());
    }
    if film.samples() < options.samples {
        if film.samples() > 0 {
            film.save_checkpoint(&kept, &fingerprint)?;
        }
        return Err(interrupted(film.samples(), options, &kept));
    }
    if options.resume {
        film.save_checkpoint(&kept, &fingerprint)?;
    }
    save(&film, options, &stage, &frame, &light)?;
    if !options.resume && kept.exists() {
        std::fs::remove_file(&kept).map_err(|source| AppError::Write { path: kept, source })?;
    }
    if let Some(error) = film.relative_error() {
        progress.note(&format!("{} samples, standard error of the luminance {:.2} %", film.samples(), 100.0 * error));
    }
    Ok(options.out.clone())
}

/// The error of a trace that the user interrupted after `samples` samples, which are kept in `checkpoint`.
fn interrupted(samples: u32, options: &ReferenceOptions, checkpoint: &Path) -> AppError {
    let total = options.samples;
    AppError::Interrupted(match samples {
        0 => format!("none of {total} samples is finished; run the command again"),
        _ => format!(
            "{samples} of {total} samples are finished and saved in {}; run the same command with --resume to continue",
            checkpoint.display()
        ),
    })
}

/// Camera and instant, the same as `canopy render` has for a still.
fn frame(options: &ReferenceOptions, stage: &Stage) -> Result<Frame, AppError> {
    let plan = RenderPlan::new(&as_still(options), &stage.scene, &|x, z| stage.terrain.height(x, z))?;
    plan.frames.into_iter().next().ok_or(AppError::Plan(PlanError::Nothing))
}

fn as_still(options: &ReferenceOptions) -> RenderOptions {
    RenderOptions {
        scene: options.scene.clone(),
        output: Output::Stills(vec![Still { out: options.out.with_extension("png"), at: options.at }]),
        view: options.view,
        size: options.size,
        selection: Selection::All,
        resume: false,
        overrides: options.overrides.clone(),
        adapter: None,
        quiet: options.quiet,
        explain: false,
    }
}

fn scene(stage: &Stage) -> Result<ReferenceScene, AppError> {
    let plants: Vec<_> = stage.plants.iter().map(|baked| baked.plant.clone()).collect();
    let ground = Ground {
        shape: GroundShape::Terrain(stage.terrain.clone()),
        color: GroundColor::Soil(Soil::new(&stage.terrain, stage.cover.clone(), stage.surroundings).into()),
        max_distance: stage.scene.quality.view_distance,
    };
    Ok(ReferenceScene::new(&plants, &Instance::of_stand(&stage.stand, DVec3::ZERO), Some(ground))?)
}

fn save(
    film: &Film,
    options: &ReferenceOptions,
    stage: &Stage,
    frame: &Frame,
    light: &Arc<LightState>,
) -> Result<(), AppError> {
    if is_exr(&options.out) {
        return Ok(film.save_exr(&options.out)?);
    }
    let table = tone_table()?;
    let (width, height) = film.size();
    // The renderer's exposure at the camera.
    let totals = StandTotals::of(&stage.stand, &stage.plants);
    let exposure = CameraExposure::new(light.clone(), totals).at(&stage.ground(), frame.view.position);
    let transform =
        DisplayTransform { exposure: exposure_from_ev100(exposure.ev100), ..DisplayTransform::of(light, Some(&table)) };
    let pixels = film.display(&transform);
    let mut notes = notes(stage, &frame.view, frame.instant);
    notes.push(("Samples", film.samples().to_string()));
    RenderedImage { width, height, pixels }.save(&options.out, &notes)
}

fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"))
}
