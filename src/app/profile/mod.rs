//! Run time against error: what `canopy profile` does.
//!
//! Every round draws all views with all settings, in turn from the first to the last and from the last to the first, so that
//! what warms up or slows down meanwhile meets all of them alike. A frame's time ends when the device has finished it. Errors
//! are counted from a reference, view by view. What was measured is written after every round, so that an interrupted profile
//! can be resumed.

mod baseline;
mod contestant;
mod csv;
mod error;
mod machine;
mod page;
mod record;
mod reference;
mod report_files;
mod settings;
mod stages;
mod summary;
mod sweep;
mod table;
mod timing;
mod unmeasured;
mod views;

use std::{
    path::PathBuf,
    sync::Arc,
    time::{Instant, SystemTime},
};

use chrono::{DateTime, Utc};

pub use self::{
    baseline::{BaselineRow, against, cautions, check_baseline},
    contestant::Peer,
    error::{LEAST_ROUNDS_FOR_RATIO, ProfileError},
    record::{
        FrameTime, LevelCount, Machine, Memory, Method, PROFILE_VERSION, PictureRecord, PointRecord, PointSummary,
        ProfileReport, Round, ViewRecord,
    },
    reference::ReferenceKind,
    report_files::{ReportFiles, read_report},
    settings::{AUTOMATIC, SettingError, SettingInfo, levels_to_ron, list as settings_of, set as set_setting},
    sweep::{Combination, Sweep, check_names},
    views::Views,
};

use self::{
    contestant::{Contestant, Contestants, Stock},
    reference::{Asked, Reference},
    report_files::{discard_earlier, json, relative, set_aside, write},
    stages::Stages,
    sweep::{Point, points},
    unmeasured::{point_records, view_record},
    views::ProfileView,
};
use super::{
    AppError, Part, Renderer, adapter,
    compare::{read_image, save_map},
    fingerprint::{fingerprint, source_fingerprint},
};
use crate::{
    files,
    measure::{ComparisonSettings, PIXELS_PER_DEGREE, Picture, change, compare},
    progress::Progress,
    scene::{Overrides, Scene, SceneSource},
};
use bevy::render::renderer::RenderDevice;

/// What to profile, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileOptions {
    /// The scene.
    pub scene: SceneSource,
    /// Folder of the report.
    pub out: PathBuf,
    /// Settings to sweep; none: the scene as written alone.
    pub sweeps: Vec<Sweep>,
    /// How several sweeps go together.
    pub combination: Combination,
    /// Measure this part of the settings alone, and the scene as written.
    pub part: Option<Part>,
    /// Whether the scene as written is measured a second time, as a check of what differences are worth.
    pub control: bool,
    /// Another renderer to compare with.
    pub against: Option<Peer>,
    /// Where to look from, and when.
    pub views: Views,
    /// Width and height of a frame in pixels.
    pub size: (u32, u32),
    /// Rounds; 0: frames are not timed.
    pub rounds: u32,
    /// Frames before those that count, each time that settings change.
    pub warm_up: u32,
    /// What errors are counted from.
    pub reference: ReferenceKind,
    /// Views whose images the page shows.
    pub shown: u32,
    /// Whether to keep what an earlier, interrupted run of the same profile has measured.
    pub resume: bool,
    /// Values that replace those of the scene.
    pub overrides: Overrides,
    /// Part of the name of the graphics adapter to use.
    pub adapter: Option<String>,
    /// The command line, for the report.
    pub command: String,
}

/// The scene of a profile with its overrides; its settings are those of `--list-settings`.
///
/// # Errors
/// [`AppError::Scene`].
pub fn profiled_scene(source: &SceneSource, overrides: &Overrides) -> Result<Scene, AppError> {
    Ok(overrides.applied(source.read()?))
}

/// Profiles a scene and writes the report.
///
/// # Errors
/// [`AppError`]; what was measured before it is in the report, and a complete report that was in the folder is in the folder `earlier`
/// there, unless it was this one that is gone on with. [`AppError::Interrupted`] soon after `progress`
/// [is cancelled](Progress::is_cancelled).
pub fn profile(
    options: &ProfileOptions,
    progress: &mut dyn Progress,
) -> Result<(ProfileReport, ReportFiles), AppError> {
    let scene = profiled_scene(&options.scene, &options.overrides)?;
    let source = source_fingerprint(&scene, &options.overrides);
    profile_of(scene, source, options, progress)
}

/// The same of a scene that has its overrides; those of `options` count no more. `source` is what tells it from others, if that is known.
pub(super) fn profile_of(
    scene: Scene,
    source: String,
    options: &ProfileOptions,
    progress: &mut dyn Progress,
) -> Result<(ProfileReport, ReportFiles), AppError> {
    options.part.map_or(Ok(()), Part::check)?;
    let mut points = points(&scene, &options.sweeps, options.combination)?;
    if let Some(part) = options.part {
        // Each part has the scene as written, which the others are compared with.
        let share = part.range(points.len() as u32 - 1);
        let wanted = |index: usize| index == 0 || share.contains(&(index as u32 - 1));
        points = points.into_iter().enumerate().filter(|(index, _)| wanted(*index)).map(|(_, point)| point).collect();
    }
    if options.control {
        points.insert(1, Point::again(&scene));
    }
    points.extend(options.against.map(|peer| Point::of_peer(&scene, peer)));
    // Views off the path and references that are missing are found before the long work; heights do not matter for that.
    let early = options.views.of(&scene, &|_, _| 0.0)?;
    if let ReferenceKind::Folder(given) = &options.reference {
        reference::given_files(given, &early, options.size)?;
    }
    let report_files = ReportFiles::in_folder(&options.out);
    for file in report_files.all() {
        files::check_writable(file).map_err(|source| AppError::Write { path: file.to_owned(), source })?;
    }
    let settings = adapter::settings(options.adapter.as_deref())?;
    let most_trees = adapter::check_size(&settings, options.size)?;
    let full = reference::full_scene(&scene);
    let drawn = points.iter().map(|point| &point.scene).chain([&full]);
    let mut stages = Stages::new(drawn, most_trees);
    let written = stages.stage(&scene, progress)?;
    let views = options.views.of(&scene, &|x, z| written.terrain.height(x, z))?;

    progress.begin("Renderer", 0);
    let renderer = Renderer::with_settings(settings.clone(), options.size, scene.quality.msaa, timing::prepare)?;
    written.check_device(renderer.world().resource::<RenderDevice>())?;
    progress.end();
    let stock = match options.against {
        None => None,
        Some(peer) => {
            progress.begin("Stock Bevy", 0);
            let stock = Stock::new(peer, Arc::new(written), &views, options.size, settings)?;
            progress.end();
            Some(stock)
        }
    };
    let mut contestants = Contestants { renderer, stages, stock };

    let mut work = Work::new(options, &scene, &points, &views, &contestants)?;
    work.report.scene_fingerprint = source;
    // Until there are references nothing is measured, and nothing written that a report needs.
    work.make_references(&mut contestants, &scene, progress)?;
    if !work.goes_on
        && let Some(earlier) = set_aside(&options.out)?
    {
        progress.note(&format!(
            "{} keeps the complete report that was there until this one is complete",
            earlier.display()
        ));
    }
    let outcome = work.run(&mut contestants, progress);
    work.report.complete = outcome.is_ok();
    summary::summarize(&mut work.report);
    // What was measured is kept, whatever went wrong. A report that cannot be written says why, unless something else did.
    let saved = work.save(&report_files);
    outcome?;
    saved?;
    discard_earlier(&options.out)?;
    Ok((work.report, report_files))
}

/// A profile under way.
struct Work<'a> {
    options: &'a ProfileOptions,
    points: &'a [Point],
    views: &'a [ProfileView],
    references: Vec<Option<Reference>>,
    fingerprint: String,
    report: ProfileReport,
    /// Whether the report is an earlier one that is gone on with.
    goes_on: bool,
}

impl<'a> Work<'a> {
    fn new(
        options: &'a ProfileOptions,
        scene: &Scene,
        points: &'a [Point],
        views: &'a [ProfileView],
        contestants: &Contestants,
    ) -> Result<Self, AppError> {
        let machine = machine::machine(&contestants.renderer);
        let mut hasher = blake3::Hasher::new();
        for point in points {
            hasher.update(fingerprint(&point.scene).as_bytes());
            hasher.update(format!("{:?} {:?}", point.settings, point.peer).as_bytes());
        }
        let method = (options.size, options.warm_up, &options.reference, &machine.adapter, &machine.driver);
        hasher.update(format!("{method:?} {views:?}").as_bytes());
        let whole = hasher.finalize().to_hex()[..32].to_owned();
        let mut fresh = ProfileReport {
            schema: "canopy-profile".to_owned(),
            version: PROFILE_VERSION,
            scene: scene.name.clone(),
            file: scene.label(),
            command: options.command.clone(),
            begun: DateTime::<Utc>::from(SystemTime::now()).to_rfc3339_opts(chrono::SecondsFormat::Secs, true),
            complete: false,
            fingerprint: whole.clone(),
            scene_fingerprint: String::new(),
            machine,
            method: Method {
                size: options.size,
                rounds: options.rounds,
                warm_up: options.warm_up,
                reference: options.reference.name(),
                reference_details: options.reference.details(),
                pixels_per_degree: PIXELS_PER_DEGREE,
                step_seconds: step(views),
            },
            views: views.iter().map(view_record).collect(),
            points: point_records(points),
            front: Vec::new(),
            knee: None,
        };
        for (record, _) in fresh.points.iter_mut().zip(points).filter(|(_, point)| point.peer.is_some()) {
            record.label = contestants.stock.as_ref().map_or(record.label.clone(), Stock::label);
        }
        let json = ReportFiles::in_folder(&options.out).json;
        let goes_on = options.resume && json.exists();
        let report = if goes_on {
            let mut earlier = read_report(&json)?;
            // A report that was edited may have fewer points and views than its settings say.
            let counts = (earlier.points.len(), earlier.views.len());
            if earlier.fingerprint != whole || counts != (points.len(), views.len()) {
                return Err(ProfileError::Another(options.out.clone()).into());
            }
            earlier.method.rounds = options.rounds;
            earlier
        } else {
            fresh
        };
        Ok(Self { options, points, views, references: Vec::new(), fingerprint: fingerprint(scene), report, goes_on })
    }

    fn make_references(
        &mut self,
        contestants: &mut Contestants,
        scene: &Scene,
        progress: &mut dyn Progress,
    ) -> Result<(), AppError> {
        let folder = self.options.out.join(self.options.reference.folder_name());
        let asked = Asked {
            folder: &folder,
            size: self.options.size,
            adapter: self.options.adapter.as_deref(),
            fingerprint: &self.fingerprint,
        };
        self.references =
            reference::make(&self.options.reference, scene, &mut contestants.stages, self.views, &asked, progress)?;
        for (view, reference) in self.report.views.iter_mut().zip(&self.references) {
            view.reference = reference.as_ref().map(|reference| relative(&reference.file, &self.options.out));
        }
        Ok(())
    }

    fn run(&mut self, contestants: &mut Contestants, progress: &mut dyn Progress) -> Result<(), AppError> {
        self.draw_all(contestants, progress)?;
        self.time_all(contestants, progress)
    }

    /// Draws every view with every combination of settings, and compares it.
    fn draw_all(&mut self, contestants: &mut Contestants, progress: &mut dyn Progress) -> Result<(), AppError> {
        let open: Vec<usize> = (0..self.points.len())
            .filter(|index| self.report.points[*index].pictures.len() < self.views.len())
            .collect();
        // Builds have progress of their own.
        for index in &open {
            contestants.stages.stage(&self.points[*index].scene, progress)?;
        }
        progress.begin("Images", (open.len() * self.views.len()) as u64);
        for index in open {
            let draw = |contestant: &mut dyn Contestant, progress: &mut dyn Progress| {
                self.draw_point(index, contestant, progress)
            };
            let (pictures, memory) = contestants.with(&self.points[index], progress, draw)?;
            self.report.points[index].pictures = pictures;
            self.report.points[index].memory = memory;
            self.save_data()?;
        }
        progress.end();
        Ok(())
    }

    fn draw_point(
        &self,
        index: usize,
        contestant: &mut dyn Contestant,
        progress: &mut dyn Progress,
    ) -> Result<(Vec<PictureRecord>, Memory), AppError> {
        let folder = self.options.out.join("images").join(format!("{index:03}"));
        let mut records: Vec<PictureRecord> = Vec::with_capacity(self.views.len());
        let mut before: Option<(Picture, Picture)> = None;
        let mut reader = timing::DeviceReader::default();
        let pixels = f64::from(self.options.size.0) * f64::from(self.options.size.1);
        for (number, view) in self.views.iter().enumerate() {
            if progress.is_cancelled() {
                return Err(self.interrupted());
            }
            for before in &view.lead {
                contestant.set_view(before, view.instant)?;
                contestant.update()?;
            }
            contestant.counts();
            contestant.set_view(&view.view, view.instant)?;
            let updates = contestant.update()?.updates;
            let image = contestant.read()?;
            let file = folder.join(format!("{}.png", view.name));
            image.save(&file, &[("Settings", self.points[index].label())])?;
            let mut record = contestant.counts();
            if updates > 1 {
                // It waited for a pipeline, and was drawn several times.
                (record.forest_calls, record.uploaded_bytes) = (None, None);
            }
            record.file = relative(&file, &self.options.out);
            let comparable = self.is_comparable(index);
            if let Some(Reference { file: reference, half }) = self.references[number].as_ref().filter(|_| comparable) {
                let test = Picture::from_srgb8(image.width as usize, image.height as usize, &image.pixels);
                let failed =
                    |source| super::CompareError::Measure { test: file.clone(), reference: reference.clone(), source };
                let test = test.map_err(failed)?;
                let truth = read_image(reference)?;
                let half = half.as_deref().map(read_image).transpose()?;
                let settings = ComparisonSettings { half: half.as_ref(), ..ComparisonSettings::default() };
                let compared = compare(&truth, &test, &settings).map_err(failed)?;
                if self.is_shown(number) {
                    let map =
                        self.options.out.join("errors").join(format!("{index:03}")).join(format!("{}.png", view.name));
                    save_map(&compared.map, truth.size(), &map)?;
                    record.map = Some(relative(&map, &self.options.out));
                }
                record.error = Some(compared.comparison);
                if let Some((earlier, earlier_truth)) = before.as_ref().filter(|_| self.options.views.is_flight()) {
                    record.change = Some(change([earlier, &test], [earlier_truth, &truth], &settings).map_err(failed)?);
                }
                before = Some((test, truth));
            }
            // The device's figures of this frame come two updates later; the view stays, so they are its own.
            contestant.update()?;
            contestant.update()?;
            let figures = reader.read(contestant.world());
            let fragments = timing::fragments(&figures, contestant.pass_prefix());
            record.fragments_per_pixel = fragments.map(|count| count / pixels);
            records.push(record);
            progress.advance(1);
        }
        Ok((records, contestant.memory()))
    }

    /// Whether the images of a point show the same as the reference: a watercolour is no photograph with errors.
    fn is_comparable(&self, index: usize) -> bool {
        let style = &self.points[index].scene.style;
        match self.options.reference {
            ReferenceKind::Full { .. } => *style == self.points[0].scene.style,
            ReferenceKind::Traced { .. } => !style.is_drawn(),
            ReferenceKind::None | ReferenceKind::Folder(_) => true,
        }
    }

    /// Times all rounds.
    fn time_all(&mut self, contestants: &mut Contestants, progress: &mut dyn Progress) -> Result<(), AppError> {
        let since = Instant::now();
        let rounds = self.options.rounds as usize;
        let missing: usize = self.report.points.iter().map(|point| rounds.saturating_sub(point.rounds.len())).sum();
        progress.begin("Rounds", missing as u64);
        for round in 0..rounds {
            let forward = round % 2 == 0;
            let mut order: Vec<usize> = (0..self.points.len()).collect();
            if !forward {
                order.reverse();
            }
            for index in order {
                if self.report.points[index].rounds.len() > round {
                    continue;
                }
                let time = |contestant: &mut dyn Contestant, progress: &mut dyn Progress| {
                    let stop = || progress.is_cancelled();
                    timing::time_round(contestant, self.views, self.options.warm_up, since, &stop)
                };
                let frames = contestants.with(&self.points[index], progress, time)?;
                let Some(frames) = frames else { return Err(self.interrupted()) };
                self.report.points[index].rounds.push(Round { forward, frames });
                progress.advance(1);
            }
            self.save_data()?;
        }
        progress.end();
        Ok(())
    }

    fn interrupted(&self) -> AppError {
        let rounds: usize = self.report.points.iter().map(|point| point.rounds.len()).sum();
        let total = self.points.len() * self.options.rounds as usize;
        AppError::Interrupted(format!(
            "{rounds} of {total} rounds of settings are timed; the report in {} has them, and the same command with --resume \
             goes on",
            self.options.out.display()
        ))
    }

    /// Whether the page shows the images of a view.
    fn is_shown(&self, view: usize) -> bool {
        page::shown(self.views.len(), self.options.shown as usize).contains(&view)
    }

    /// Writes the figures.
    fn save_data(&mut self) -> Result<(), AppError> {
        let path = ReportFiles::in_folder(&self.options.out).json;
        write(&path, &json(&self.report)?)
    }

    /// Writes all files.
    fn save(&mut self, files: &ReportFiles) -> Result<(), AppError> {
        write(&files.json, &json(&self.report)?)?;
        write(&files.frames, &csv::frames(&self.report))?;
        write(&files.points, &csv::points(&self.report))?;
        let page = page::page(&self.report, &self.options.out, self.options.shown as usize);
        write(&files.page, page?.as_bytes())
    }
}

fn step(views: &[ProfileView]) -> Option<f64> {
    match views {
        [first, second, ..] => Some(second.seconds? - first.seconds?),
        _ => None,
    }
}
