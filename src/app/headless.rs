//! Renders images without a window: the frames of a plan, one after the other, each a function of its own arguments.

use std::{path::PathBuf, time::Instant};

use bevy::render::renderer::RenderDevice;

use super::{
    Frame, RenderOptions, RenderPlan, RenderReport, Renderer, adapter,
    beside::{Choice, Panels},
    error::{AppError, RESUME, of_file, outcome},
    plan::PlanRequest,
    rendered_image::RenderedImage,
};
use crate::{files, progress::Progress};

/// Renders the images of `options`.
///
/// # Errors
/// [`AppError`]; images that were finished before it stay, and no file is left half-written.
/// [`AppError::Interrupted`] soon after `progress` [is cancelled](Progress::is_cancelled): after the current image.
pub fn render(options: &RenderOptions, progress: &mut dyn Progress) -> Result<RenderReport, AppError> {
    // The scene's own errors come first, then the request's, then the device's: all are found before the long work, and
    // before anything is left behind.
    let scene = options.overrides.applied(options.scene.read()?);
    options.overrides.warnings(&scene).iter().for_each(|warning| progress.warn(warning));
    RenderPlan::check(options, &scene)?;
    let choice = Choice::new(&options.beside, &scene)?;
    check_writable(options)?;
    let settings = adapter::settings(options.adapter.as_deref())?;
    let most_trees = adapter::check_size(&settings, options.size)?;
    let mut panels = Panels::build(&scene, &choice, options.size, most_trees, progress)?;
    let ground = panels.first().terrain.clone();
    let plan = RenderPlan::new(options, &scene, &|x, z| ground.height(x, z))?;
    let mut report = RenderReport::default();
    let finished =
        |frame: &Frame| options.resume && RenderedImage::is_stored(&frame.file, panels.size(), &panels.notes(frame));
    let wanted: Vec<bool> = plan.frames.iter().map(|frame| !finished(frame)).collect();
    let kept = wanted.iter().filter(|wanted| !*wanted).count();
    if kept > 0 {
        progress.note(&format!("{kept} of {} images are finished already", plan.frames.len()));
    }
    if kept == plan.frames.len() {
        report.files = plan.frames.into_iter().map(|frame| frame.file).collect();
        return Ok(report);
    }
    let started = Instant::now();
    progress.begin("Renderer", 0);
    let mut renderer = Renderer::with_settings(settings, options.size, scene.quality.msaa, |_| ())?;
    for stage in panels.stages() {
        stage.check_device(renderer.world().resource::<RenderDevice>())?;
    }
    renderer.show(panels.first());
    progress.end();
    progress.note(&format!("renderer: {:.2} s", started.elapsed().as_secs_f64()));
    let mut failures: Vec<(PathBuf, AppError)> = Vec::new();
    progress.begin("Images", plan.frames.len() as u64);
    for (frame, wanted) in plan.frames.iter().zip(wanted) {
        if !wanted {
            report.files.push(frame.file.clone());
            progress.advance(1);
            continue;
        }
        if progress.is_cancelled() {
            return Err(interrupted(&report, plan.frames.len()));
        }
        let started = Instant::now();
        let mut explanation = Vec::new();
        let drawn = panels.draw(&mut renderer, frame, &mut explanation);
        let seconds = started.elapsed().as_secs_f64();
        if let Err(error) = drawn.and_then(|picture| picture.save(&frame.file, &panels.notes(frame))) {
            // The other frames do not depend on this one.
            progress.warn(&of_file(&frame.file, &error));
            failures.push((frame.file.clone(), error));
            progress.advance(1);
            continue;
        }
        progress.note(&format!(
            "{}: drawn in {seconds:.2} s, written in {:.2} s",
            frame.file.display(),
            started.elapsed().as_secs_f64() - seconds
        ));
        if options.explain {
            report.explanation.push(format!("{}:", frame.file.display()));
            report.explanation.append(&mut explanation);
        }
        report.files.push(frame.file.clone());
        progress.advance(1);
    }
    progress.end();
    outcome(failures, report.files.len(), RESUME)?;
    Ok(report)
}

/// Checks whether the images can be written.
fn check_writable(options: &RenderOptions) -> Result<(), AppError> {
    for file in PlanRequest::from(options).first_files() {
        files::check_writable(&file).map_err(|source| AppError::Write { path: file, source })?;
    }
    Ok(())
}

/// The error of a render that the user interrupted after the images of `report`, of `total`.
fn interrupted(report: &RenderReport, total: usize) -> AppError {
    let count = report.files.len();
    let so_far = match (report.files.first(), report.files.last()) {
        (Some(first), Some(last)) if count > 1 => {
            format!("{count} of {total} images are finished, {} to {}", first.display(), last.display())
        }
        (Some(only), _) => format!("1 of {total} images is finished, {}", only.display()),
        _ => format!("none of {total} images is finished"),
    };
    AppError::Interrupted(format!("{so_far}; run the same command with --resume to render the others"))
}
