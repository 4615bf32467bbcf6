//! The ground truth of a scene: what `canopy reference` does.

use std::{
    ops::{ControlFlow, Range},
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, Instant},
};

use glam::DVec3;

use super::{
    Frame, LeafModel, LightGroup, Part, ReferenceOptions, RenderPlan,
    camera::NEAR,
    error::{AppError, RESUME, of_file, outcome},
    film_notes::FilmNotes,
    interrupt,
    notes::notes,
    plan::{PlanError, PlanRequest},
    rendered_image::RenderedImage,
};
use crate::{
    assets::Stage,
    files,
    light::{Atmosphere, AtmosphereParams, LightState, exposure_from_ev100},
    progress::Progress,
    reference::{
        Camera, Film, Fog, Ground, GroundColor, GroundShape, Instance, KeptFilm, Light, PathTracer, ReferenceError,
        ReferenceScene, Shot, Soil, TraceSettings,
    },
    render::{
        components::GroundDrape,
        exposure::{CameraExposure, StandTotals},
    },
    scene::Scene,
};

/// Interval at which the film is saved during the trace.
const KEEP_EVERY: Duration = Duration::from_secs(30);
/// What a reference can be written as. Files in a folder are the first.
const IMAGES: &[&str] = &["png", "exr", "film"];
/// What a part of the samples can be written as.
const FILMS: &[&str] = &["film"];

/// Traces the images of `options`; returns the files.
///
/// The film is saved every 30 s and when the work is interrupted, in a file next to the image that ends in
/// `.checkpoint`. With `resume` a film of the same scene, light and camera continues from there, and the file stays when the
/// image is done, so that more samples can be added; a PNG or a film that is finished without one is kept. Without it the trace
/// starts from the beginning, and the file is deleted at the end.
///
/// # Errors
/// [`AppError`]; existing images stay as they are. [`AppError::SomeFailed`] where some of several images failed.
/// [`AppError::Interrupted`] soon after a signal, and after the current sample when `progress`
/// [is cancelled](Progress::is_cancelled).
pub fn reference(options: &ReferenceOptions, progress: &mut dyn Progress) -> Result<Vec<PathBuf>, AppError> {
    let written = options.overrides.applied(options.scene.read()?);
    let request = PlanRequest {
        output: &options.output,
        view: options.view,
        selection: &options.selection,
        endings: if options.part.is_some() { FILMS } else { IMAGES },
    };
    request.check(&written)?;
    options.part.map_or(Ok(()), Part::check)?;
    if let Some(part) = options.part.filter(|part| part.of > options.samples) {
        return Err(PlanError::TooManyParts { of: part.of, samples: options.samples }.into());
    }
    for file in request.first_files() {
        files::check_writable(&file).map_err(|source| AppError::Write { path: file, source })?;
    }
    let truth = Truth::build(&written, Model::of(options), progress)?;
    let plan = RenderPlan::of(&request, &truth.stage.scene, &|x, z| truth.stage.terrain.height(x, z))?;
    let samples = options.part.map_or(0..options.samples, |part| part.range(options.samples));
    let (count, mut files, mut failures) = (plan.frames.len(), Vec::new(), Vec::new());
    for (number, frame) in plan.frames.iter().enumerate() {
        if count > 1 {
            progress.note(&format!("image {} of {count}: {}", number + 1, frame.file.display()));
        }
        let shot = TraceJob {
            frame,
            size: options.size,
            samples: samples.clone(),
            total: options.samples,
            resume: options.resume,
        };
        match truth.trace(&shot, progress) {
            Ok(()) => files.push(frame.file.clone()),
            Err(AppError::Interrupted(what)) if count > 1 => {
                return Err(AppError::Interrupted(format!("{} of {count} images are finished; {what}", files.len())));
            }
            Err(error) if count == 1 || matches!(error, AppError::Interrupted(_)) => return Err(error),
            // The other images do not depend on this one.
            Err(error) => {
                progress.warn(&of_file(&frame.file, &error));
                failures.push((frame.file.clone(), error));
            }
        }
    }
    outcome(failures, files.len(), RESUME)?;
    Ok(files)
}

/// What of the light is traced.
#[derive(Clone, Copy, Debug)]
pub(super) struct Model {
    /// Maximum number of bounces; `None` is unlimited.
    pub bounces: Option<u32>,
    /// The light sources.
    pub light: LightGroup,
    /// How leaves scatter.
    pub leaf: LeafModel,
    /// Whether there is the renderer's fog.
    pub fog: bool,
}

impl Model {
    /// All light, as the renderer has it.
    pub fn whole() -> Self {
        Self { bounces: None, light: LightGroup::All, leaf: LeafModel::default(), fog: true }
    }

    fn of(options: &ReferenceOptions) -> Self {
        Self { bounces: options.bounces, light: options.light, leaf: options.leaf, fog: options.fog }
    }
}

/// One image to trace.
#[derive(Clone, Debug)]
pub(super) struct TraceJob<'a> {
    /// File, camera and instant.
    pub frame: &'a Frame,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Numbers of the samples per pixel.
    pub samples: Range<u32>,
    /// Samples per pixel of all parts together.
    pub total: u32,
    /// Whether to go on from a checkpoint, and to leave one.
    pub resume: bool,
}

/// A scene that is ready to be traced, from any place and at any time.
pub(super) struct Truth {
    stage: Stage,
    scene: ReferenceScene,
    totals: StandTotals,
    model: Model,
}

impl Truth {
    /// Builds `written` for `model`.
    ///
    /// # Errors
    /// [`AppError::Stage`], [`AppError::Reference`], [`AppError::Interrupted`].
    pub fn build(written: &Scene, model: Model, progress: &mut dyn Progress) -> Result<Self, AppError> {
        let stage = Stage::build(written, progress).map_err(interrupt::building)?;
        progress.begin("Building ray tracing structures", 0);
        let totals = StandTotals::of(&stage.stand, &stage.plants);
        let scene = scene(&stage, totals)?.with_leaves(model.leaf);
        progress.end();
        Ok(Self { totals, stage, scene, model })
    }

    /// Traces one image and writes it.
    ///
    /// # Errors
    /// Those of [`reference`].
    pub fn trace(&self, job: &TraceJob, progress: &mut dyn Progress) -> Result<(), AppError> {
        let TraceJob { frame, size, samples, total, resume } = job;
        let sun = self.stage.sun(frame.instant);
        let atmosphere = Atmosphere::new(AtmosphereParams::with_visibility_km(sun.visibility_km))?;
        let light = Arc::new(sun.light(&atmosphere)?);
        let all = Light::of(&light, None);
        let chosen = match self.model.light {
            LightGroup::All => all,
            LightGroup::Sun => all.without_environment(),
            LightGroup::Sky => all.without_key(),
        };
        let settings = TraceSettings { bounces: self.model.bounces.unwrap_or(u32::MAX), ..TraceSettings::default() };
        let tracer = PathTracer::new(&self.scene, &chosen, settings)?;
        let shot = Shot {
            camera: Camera { view: frame.view, size: *size, near: NEAR.into() },
            fog: self.model.fog.then(|| Fog::new(&light, frame.view.position.y)),
        };
        let kept = checkpoint_of(&frame.file);
        let fingerprint = tracer.fingerprint(&shot);
        let notes = self.notes(job, &light, &fingerprint);
        if *resume && !kept.exists() && is_finished(&frame.file, job, &fingerprint, &notes) {
            progress.note(&format!("{}: finished already", frame.file.display()));
            return Ok(());
        }
        let known = resume.then(|| Film::load_checkpoint(&kept, &fingerprint)).transpose()?.flatten();
        let wanted = samples.end - samples.start;
        let is_part = wanted < *total;
        let mut film = match known {
            Some(film) if film.first() == samples.start && !(is_part && film.samples() > wanted) => film,
            Some(_) => return Err(ReferenceError::OtherSamples { path: kept }.into()),
            None => Film::beginning_at(&shot, samples.start)?,
        };
        progress.begin("Samples", wanted.into());
        progress.advance(film.samples().min(wanted).into());
        let (started, earlier) = (Instant::now(), film.samples());
        let (mut last, mut failure) = (started, None);
        let stop = || interrupt::received().is_some();
        tracer.render_unless(&shot, &mut film, wanted, &stop, &mut |film: &Film| {
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
        if film.samples() < wanted {
            if film.samples() > 0 {
                film.save_checkpoint(&kept, &fingerprint)?;
            }
            return Err(interrupted(film.samples(), wanted, &kept));
        }
        if *resume {
            film.save_checkpoint(&kept, &fingerprint)?;
        }
        save(&film, &frame.file, &fingerprint, &notes)?;
        if !resume && kept.exists() {
            std::fs::remove_file(&kept).map_err(|source| AppError::Write { path: kept, source })?;
        }
        if let Some(error) = film.relative_error() {
            let samples = film.samples();
            progress.note(&format!("{samples} samples, standard error of the luminance {:.2} %", 100.0 * error));
        }
        Ok(())
    }

    /// What the film needs to become an image: the renderer's exposure at the camera, and the text of the file.
    fn notes(&self, job: &TraceJob, light: &Arc<LightState>, fingerprint: &[u8; 32]) -> FilmNotes {
        let TraceJob { frame, total, .. } = job;
        let there = CameraExposure::new(light.clone(), self.totals).at(&self.stage.ground(), frame.view.position);
        let mut text = notes(&self.stage, &frame.view, frame.instant);
        text.push(("Fingerprint", blake3::Hash::from_bytes(*fingerprint).to_hex().to_string()));
        FilmNotes {
            total: *total,
            exposure: exposure_from_ev100(there.ev100),
            night: light.scotopic,
            text: text.into_iter().map(|(keyword, value)| (keyword.to_owned(), value)).collect(),
        }
    }
}

/// The error of a trace that the user interrupted after `samples` of `total` samples, which are kept in `checkpoint`.
fn interrupted(samples: u32, total: u32, checkpoint: &Path) -> AppError {
    AppError::Interrupted(match samples {
        0 => format!("none of {total} samples is finished; run the command again"),
        _ => format!(
            "{samples} of {total} samples are finished and saved in {}; run the same command with --resume to continue",
            checkpoint.display()
        ),
    })
}

fn scene(stage: &Stage, totals: StandTotals) -> Result<ReferenceScene, AppError> {
    let plants: Vec<_> = stage.plants.iter().map(|baked| baked.plant.clone()).collect();
    let mut soil =
        Soil::new(&stage.terrain, stage.cover.clone(), stage.surroundings).with_crowns(totals.crown_albedo());
    if let Some(GroundDrape { drape, brightness }) = &stage.drape {
        soil = soil.with_drape(drape.clone(), *brightness);
    }
    let ground = Ground {
        shape: GroundShape::Terrain(stage.terrain.clone()),
        color: GroundColor::Soil(soil.into()),
        max_distance: stage.scene.quality.view_distance,
    };
    Ok(ReferenceScene::new(&plants, &Instance::of_stand(&stage.stand, DVec3::ZERO), Some(ground))?)
}

/// Writes `film` to `file`, as what its name ends in.
///
/// # Errors
/// [`AppError::Reference`], [`AppError::Write`].
pub(super) fn save(film: &Film, file: &Path, fingerprint: &[u8; 32], notes: &FilmNotes) -> Result<(), AppError> {
    if files::ends_in(file, &["exr"]) {
        return Ok(film.save_exr(file)?);
    }
    if files::ends_in(file, &["film"]) {
        return Ok(film.keep(file, fingerprint, &notes.to_bytes())?);
    }
    notes.image(film)?.save(file, &notes.text_of(film.samples()))
}

/// Whether `file` is the finished image of these samples. OpenEXR files do not say what they are of.
fn is_finished(file: &Path, job: &TraceJob, fingerprint: &[u8; 32], notes: &FilmNotes) -> bool {
    let Range { start, end } = job.samples;
    if files::ends_in(file, &["png"]) {
        return RenderedImage::is_stored(file, job.size, &notes.text_of(end - start));
    }
    let film = |kept: KeptFilm| {
        kept.fingerprint == *fingerprint && (kept.film.first(), kept.film.samples()) == (start, end - start)
    };
    files::ends_in(file, &["film"]) && KeptFilm::load(file).ok().flatten().is_some_and(film)
}

/// The file that has the state of a trace. That of a film is its own: another part has other samples.
fn checkpoint_of(file: &Path) -> PathBuf {
    if files::ends_in(file, &["film"]) {
        file.with_added_extension("checkpoint")
    } else {
        file.with_extension("checkpoint")
    }
}
