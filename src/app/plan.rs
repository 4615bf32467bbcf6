//! Turns a request into the frames to draw: file names, cameras, instants. A pure function of the request and the
//! scene.

use std::ffi::OsStr;
use std::path::{Path as FilePath, PathBuf};

use chrono::{DateTime, Utc};

use super::request::{Clock, Output, Part, RenderOptions, Selection, View};
use crate::files::ends_in;
use crate::scene::{LocalTime, Path, Pose, Scene, Viewpoint};

/// Default frames per second of a flight.
const DEFAULT_FPS: f64 = 25.0;
/// A day of film; more frames than that are a typing error.
const MOST_FRAMES: u32 = 10_000_000;

/// One image to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// The PNG to write.
    pub file: PathBuf,
    /// The camera, in scene-local coordinates.
    pub view: Viewpoint,
    /// Date and time, Universal Time.
    pub instant: DateTime<Utc>,
}

/// The images of a request, in order.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderPlan {
    /// At least one.
    pub frames: Vec<Frame>,
}

/// Why a request cannot be planned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The request follows a path that the scene does not have.
    #[error("the scene `{0}` has no camera path to fly along; add `camera: (path: [...])` to it, or use --camera")]
    NoPath(String),
    /// The request starts off the path.
    #[error("{seconds} s is not on the scene's camera path, which goes from {start} s to {end} s; choose a time on it")]
    OffPath {
        /// The requested time.
        seconds: f64,
        /// The path's first time.
        start: f64,
        /// The path's last time.
        end: f64,
    },
    /// No image was requested.
    #[error("no image was requested; name at least one file, or one frame")]
    Nothing,
    /// Too many frames.
    #[error("{0} frames are too many; request at most {MOST_FRAMES}")]
    TooMany(u32),
    /// A frame that the sequence does not have.
    #[error("frame {number} is not one of the {frames} frames of the sequence, which are 0 to {}", frames.saturating_sub(1))]
    NoFrame {
        /// The frame.
        number: u32,
        /// Number of frames.
        frames: u32,
    },
    /// A piece that is none.
    #[error("there is no piece {number} of {of}; the pieces are 1/{of} to {of}/{of}")]
    NoChunk {
        /// Its number.
        number: u32,
        /// Number of pieces.
        of: u32,
    },
    /// More parts than samples.
    #[error("{samples} samples a pixel cannot be divided into {of} parts; trace at most {samples} parts")]
    TooManyParts {
        /// Number of parts.
        of: u32,
        /// Samples per pixel.
        samples: u32,
    },
    /// Some of a single image.
    #[error("only frames of a sequence can be chosen; add --frames, or leave out --frames-only and --chunk")]
    NoSequence,
    /// A frame rate that is not positive.
    #[error("{0} is not a frame rate (expected a number of frames per second above 0, such as 25)")]
    BadRate(f64),
    /// An image's name does not end in `.png`.
    #[error("`{}` does not end in .png, the format of all images; call it {}", .0.display(), .0.with_extension("png").display())]
    NoPng(PathBuf),
    /// A file of another kind.
    #[error("`{}` is not a valid name for this image; it must end in {endings}", file.display())]
    Ending {
        /// The file.
        file: PathBuf,
        /// What it can end in.
        endings: String,
    },
    /// Two images of a request would overwrite each other.
    #[error("`{}` is named twice; give each image its own file", .0.display())]
    SameFile(PathBuf),
}

impl PlanError {
    /// The error of a file that ends in none of `endings`, which have no dot.
    pub(super) fn ending(file: PathBuf, endings: &[&str]) -> Self {
        let mut endings: Vec<String> = endings.iter().map(|ending| format!(".{ending}")).collect();
        let last = endings.pop().unwrap_or_default();
        let endings = if endings.is_empty() { last } else { format!("{} or {last}", endings.join(", ")) };
        Self::Ending { file, endings }
    }
}

/// Endings of the images of a render.
const PNG: &[&str] = &["png"];

/// What a plan follows from, besides the scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlanRequest<'a> {
    /// The images.
    pub output: &'a Output,
    /// Where the camera is.
    pub view: View,
    /// Which frames of a sequence.
    pub selection: &'a Selection,
    /// What files may end in. The first is that of the files in a folder.
    pub endings: &'static [&'static str],
}

impl<'a> From<&'a RenderOptions> for PlanRequest<'a> {
    fn from(options: &'a RenderOptions) -> Self {
        Self { output: &options.output, view: options.view, selection: &options.selection, endings: PNG }
    }
}

impl PlanRequest<'_> {
    /// Checks the request against `scene`, without planning the frames.
    ///
    /// # Errors
    /// Those of [`RenderPlan::new`].
    pub fn check(&self, scene: &Scene) -> Result<(), PlanError> {
        Flight::new(self.view, scene)?;
        match self.output {
            Output::Stills(_) if *self.selection != Selection::All => Err(PlanError::NoSequence),
            Output::Stills(stills) => {
                for (number, still) in stills.iter().enumerate() {
                    if !ends_in(&still.out, self.endings) {
                        let file = still.out.clone();
                        let is_render = self.endings == PNG;
                        return Err(if is_render {
                            PlanError::NoPng(file)
                        } else {
                            PlanError::ending(file, self.endings)
                        });
                    }
                    if stills.iter().take(number).any(|before| before.out == still.out) {
                        return Err(PlanError::SameFile(still.out.clone()));
                    }
                }
                if stills.is_empty() { Err(PlanError::Nothing) } else { Ok(()) }
            }
            Output::Sequence { frames, fps, .. } => {
                if *frames > MOST_FRAMES {
                    return Err(PlanError::TooMany(*frames));
                }
                if let Some(rate) = fps.filter(|rate| !(rate.is_finite() && *rate > 0.0)) {
                    return Err(PlanError::BadRate(rate));
                }
                numbers(self.selection, *frames)?;
                if *frames == 0 { Err(PlanError::Nothing) } else { Ok(()) }
            }
        }
    }

    /// At least one file of each folder that is written to.
    pub fn first_files(&self) -> Vec<PathBuf> {
        match self.output {
            Output::Stills(stills) => stills.iter().map(|still| still.out.clone()).collect(),
            Output::Sequence { out, frames, .. } => vec![numbered(out, 0, *frames, self.endings)],
        }
    }
}

impl RenderPlan {
    /// Checks `options` against `scene`, without planning the frames.
    ///
    /// # Errors
    /// Those of [`RenderPlan::new`].
    pub fn check(options: &RenderOptions, scene: &Scene) -> Result<(), PlanError> {
        PlanRequest::from(options).check(scene)
    }

    /// Plans `options` for `scene`. `ground` gives the terrain's height in metres at local `(x, z)`; heights in poses
    /// count from it.
    ///
    /// A sequence moves along the scene's path, `1 / fps` seconds per frame from [`View::Along`] (or the path's
    /// beginning) on, and rests at the path's end; its camera does not move at a [`View::Pose`], in a scene without
    /// a path, and in a time-lapse without `fps`.
    ///
    /// # Errors
    /// [`PlanError`]: a path that the scene lacks, a time off the path, no frames or too many, a rate that is not
    /// positive, or a file name that does not end in `.png`.
    pub fn new(options: &RenderOptions, scene: &Scene, ground: &dyn Fn(f64, f64) -> f64) -> Result<Self, PlanError> {
        Self::of(&options.into(), scene, ground)
    }

    /// The plan of `request`.
    ///
    /// # Errors
    /// [`PlanError`].
    pub(super) fn of(
        options: &PlanRequest,
        scene: &Scene,
        ground: &dyn Fn(f64, f64) -> f64,
    ) -> Result<Self, PlanError> {
        options.check(scene)?;
        let camera = Flight::new(options.view, scene)?;
        let viewpoint = |pose: Pose| {
            let (x, _, z) = pose.position;
            pose.viewpoint(ground(x, z), scene.camera.field_of_view)
        };
        let frames = match options.output {
            Output::Stills(stills) => {
                let view = viewpoint(camera.still());
                let instant = |at: Option<LocalTime>| at.unwrap_or(scene.place.time).utc();
                stills.iter().map(|still| Frame { file: still.out.clone(), view, instant: instant(still.at) }).collect()
            }
            Output::Sequence { out, frames, fps, clock } => {
                let step = match clock {
                    Clock::Lapse { .. } => fps.map(|rate| 1.0 / rate),
                    Clock::Standing(_) => Some(1.0 / fps.unwrap_or(DEFAULT_FPS)),
                };
                let frame = |number: u32| Frame {
                    file: numbered(out, number, *frames, options.endings),
                    view: viewpoint(step.map_or(camera.still(), |step| camera.moving(f64::from(number) * step))),
                    instant: instant(*clock, scene.place.time, number, *frames),
                };
                numbers(options.selection, *frames)?.into_iter().map(frame).collect::<Vec<_>>()
            }
        };
        Ok(Self { frames })
    }
}

/// The numbers of the frames to render of a sequence of `frames`, in order.
fn numbers(selection: &Selection, frames: u32) -> Result<Vec<u32>, PlanError> {
    match selection {
        Selection::All => Ok((0..frames).collect()),
        Selection::Only(ranges) => {
            if let Some((_, last)) = ranges.iter().find(|(first, last)| first > last || *last >= frames) {
                return Err(PlanError::NoFrame { number: *last, frames });
            }
            let wanted = |number: &u32| ranges.iter().any(|(first, last)| (first..=last).contains(&number));
            Ok((0..frames).filter(wanted).collect())
        }
        Selection::Chunk { number, of } => {
            let part = Part { number: *number, of: *of };
            part.check()?;
            Ok(part.range(frames).collect())
        }
    }
}

impl Part {
    /// Whether it is one of the parts.
    ///
    /// # Errors
    /// [`PlanError::NoChunk`].
    pub fn check(self) -> Result<(), PlanError> {
        let Self { number, of } = self;
        if (1..=of).contains(&number) { Ok(()) } else { Err(PlanError::NoChunk { number, of }) }
    }
}

/// The camera of a request.
enum Flight {
    Standing(Pose),
    /// A path, the time of the first frame, and the pose of a still.
    Moving {
        path: Path,
        start: f64,
        still: Pose,
    },
}

impl Flight {
    fn new(view: View, scene: &Scene) -> Result<Self, PlanError> {
        let path = Path::new(&scene.camera.path);
        match (view, path) {
            (View::Pose(pose), _) => Ok(Self::Standing(pose)),
            (View::Scene, None) => Ok(Self::Standing(scene.camera.start)),
            (View::Scene, Some(path)) => Ok(Self::Moving { start: path.start(), still: scene.camera.start, path }),
            (View::Along(_), None) => Err(PlanError::NoPath(scene.name.clone())),
            (View::Along(seconds), Some(path)) => {
                if !(path.start()..=path.end()).contains(&seconds) {
                    return Err(PlanError::OffPath { seconds, start: path.start(), end: path.end() });
                }
                Ok(Self::Moving { start: seconds, still: path.at(seconds), path })
            }
        }
    }

    fn still(&self) -> Pose {
        match self {
            Self::Standing(pose) | Self::Moving { still: pose, .. } => *pose,
        }
    }

    fn moving(&self, seconds: f64) -> Pose {
        match self {
            Self::Standing(pose) => *pose,
            Self::Moving { path, start, .. } => path.at(start + seconds),
        }
    }
}

fn instant(clock: Clock, scene: LocalTime, number: u32, frames: u32) -> DateTime<Utc> {
    match clock {
        Clock::Standing(at) => at.unwrap_or(scene).utc(),
        Clock::Lapse { from, to } => {
            let last = frames.saturating_sub(1).max(1);
            from.toward(to, f64::from(number) / f64::from(last)).utc()
        }
    }
}

/// The name of frame `number` of `frames`: four digits, or as many as the last one needs.
fn numbered(out: &FilePath, number: u32, frames: u32, endings: &[&str]) -> PathBuf {
    let digits = frames.saturating_sub(1).to_string().len().max(4);
    match out.extension().filter(|_| ends_in(out, endings)) {
        Some(ending) => {
            let mut name = out.file_stem().unwrap_or(OsStr::new("")).to_owned();
            name.push(format!("-{number:0digits$}."));
            name.push(ending);
            out.with_file_name(name)
        }
        None => out.join(format!("{number:0digits$}.{}", endings.first().unwrap_or(&"png"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        app::{Beside, Still},
        scene::{Overrides, SceneError},
    };

    type Outcome = Result<(), Box<dyn std::error::Error>>;

    fn scene(path: &str) -> Result<Scene, SceneError> {
        let text = format!(
            "(terrain: Flat(), place: (latitude: 47, longitude: 9, time: \"2026-06-21T12:00+02:00\"), camera: (start: \
             (position: (1, 2, 3), yaw: 90, pitch: -10), field_of_view: 60, path: [{path}]))"
        );
        Scene::parse(&text, "test.ron".as_ref())
    }

    const PATH: &str = "(seconds: 0, position: (0, 10, 0), yaw: 0, pitch: 0), \
                        (seconds: 10, position: (100, 10, 0), yaw: 0, pitch: 0)";

    fn options(view: View, output: Output) -> RenderOptions {
        RenderOptions {
            scene: "test.ron".into(),
            output,
            view,
            size: (64, 36),
            beside: Beside::default(),
            selection: Selection::All,
            resume: false,
            overrides: Overrides::default(),
            adapter: None,
            quiet: true,
            explain: false,
        }
    }

    fn sequence(frames: u32, fps: Option<f64>, clock: Clock) -> Output {
        Output::Sequence { out: "out/flight".into(), frames, fps, clock }
    }

    fn hill(x: f64, z: f64) -> f64 {
        100.0 + 0.5 * x + z
    }

    #[test]
    fn a_still_stands_over_the_ground_and_looks_along_its_bearing() -> Outcome {
        let still = Still { out: "a.png".into(), at: None };
        let plan = RenderPlan::new(&options(View::Scene, Output::Stills(vec![still])), &scene(PATH)?, &hill)?;
        let frame = &plan.frames[0];
        assert_eq!(frame.view.position, glam::DVec3::new(1.0, 105.5, 3.0));
        let expected = glam::DVec3::new(10_f64.to_radians().cos(), -10_f64.to_radians().sin(), 0.0);
        assert!(frame.view.forward().abs_diff_eq(expected, 1e-12), "{}", frame.view.forward());
        assert!((frame.view.field_of_view - 60_f64.to_radians()).abs() < 1e-12);
        assert_eq!(frame.instant.to_rfc3339(), "2026-06-21T10:00:00+00:00");
        Ok(())
    }

    #[test]
    fn a_sequence_flies_along_the_path_and_rests_at_its_end() -> Outcome {
        let request = options(View::Along(8.0), sequence(5, Some(1.0), Clock::Standing(None)));
        let plan = RenderPlan::new(&request, &scene(PATH)?, &hill)?;
        let xs: Vec<f64> = plan.frames.iter().map(|frame| frame.view.position.x).collect();
        for (x, expected) in xs.iter().zip([80.0, 90.0, 100.0, 100.0, 100.0]) {
            assert!((x - expected).abs() < 1e-9, "{xs:?}");
        }
        assert_eq!(plan.frames[4].file, PathBuf::from("out/flight/0004.png"));
        assert!(plan.frames.iter().all(|frame| frame.view.position.y == hill(frame.view.position.x, 0.0) + 10.0));
        Ok(())
    }

    #[test]
    fn a_time_lapse_covers_its_span_from_a_standing_camera() -> Outcome {
        let clock = Clock::Lapse { from: "2026-06-21T04:00Z".parse()?, to: "2026-06-21T20:00Z".parse()? };
        let plan = RenderPlan::new(&options(View::Scene, sequence(5, None, clock)), &scene(PATH)?, &hill)?;
        let hours: Vec<String> = plan.frames.iter().map(|frame| frame.instant.format("%H:%M").to_string()).collect();
        assert_eq!(hours, ["04:00", "08:00", "12:00", "16:00", "20:00"]);
        assert!(plan.frames.iter().all(|frame| frame.view == plan.frames[0].view));
        let moving = RenderPlan::new(&options(View::Scene, sequence(5, Some(1.0), clock)), &scene(PATH)?, &hill)?;
        assert!(moving.frames[0].view != moving.frames[4].view);
        let single = RenderPlan::new(&options(View::Scene, sequence(1, None, clock)), &scene(PATH)?, &hill)?;
        assert_eq!(single.frames[0].instant.to_rfc3339(), "2026-06-21T04:00:00+00:00");
        Ok(())
    }

    #[test]
    fn pieces_are_the_whole_and_none_twice() -> Outcome {
        let scene = scene(PATH)?;
        let files = |selection: Selection, frames: u32| -> Result<Vec<PathBuf>, PlanError> {
            let output = sequence(frames, None, Clock::Standing(None));
            let plan = RenderPlan::new(&RenderOptions { selection, ..options(View::Scene, output) }, &scene, &hill)?;
            Ok(plan.frames.into_iter().map(|frame| frame.file).collect())
        };
        for frames in [1, 7, 20] {
            let piece = |number| files(Selection::Chunk { number, of: 3 }, frames);
            let pieces = [piece(1)?, piece(2)?, piece(3)?];
            assert_eq!(pieces.concat(), files(Selection::All, frames)?);
            assert!(pieces.iter().all(|piece| piece.len().abs_diff(frames as usize / 3) <= 1));
        }
        let names = ["out/flight/0002.png", "out/flight/0003.png", "out/flight/0006.png"].map(PathBuf::from);
        assert_eq!(files(Selection::Only(vec![(6, 6), (2, 3), (3, 3)]), 7)?, names);
        let message = |selection| files(selection, 7).map_or_else(|error| error.to_string(), |_| String::new());
        assert!(message(Selection::Only(vec![(5, 7)])).contains("frame 7 is not one of the 7 frames"));
        for number in [0, 4] {
            assert!(message(Selection::Chunk { number, of: 3 }).contains("the pieces are 1/3 to 3/3"));
        }
        let still = Output::Stills(vec![Still { out: "a.png".into(), at: None }]);
        let chosen = RenderOptions { selection: Selection::Chunk { number: 1, of: 1 }, ..options(View::Scene, still) };
        assert_eq!(RenderPlan::check(&chosen, &scene), Err(PlanError::NoSequence));
        Ok(())
    }

    #[test]
    fn numbers_are_padded_to_the_longest() {
        assert_eq!(numbered("out/a.png".as_ref(), 7, 20, PNG), PathBuf::from("out/a-0007.png"));
        assert_eq!(numbered("out/a".as_ref(), 7, 10_001, PNG), PathBuf::from("out/a/00007.png"));
        assert_eq!(numbered("out/v1.2".as_ref(), 7, 10_000, PNG), PathBuf::from("out/v1.2/0007.png"));
        assert_eq!(numbered("out/a.exr".as_ref(), 7, 20, &["png", "exr"]), PathBuf::from("out/a-0007.exr"));
        assert_eq!(numbered("out/a".as_ref(), 7, 20, &["film", "exr"]), PathBuf::from("out/a/0007.film"));
    }

    #[test]
    fn requests_that_cannot_be_planned_say_what_to_do() -> Outcome {
        let bare = scene("")?;
        let still = |out: &str| Output::Stills(vec![Still { out: out.into(), at: None }]);
        let error = |view, output, scene: &Scene| RenderPlan::new(&options(view, output), scene, &hill).err();
        assert_eq!(error(View::Along(1.0), still("a.png"), &bare), Some(PlanError::NoPath("test".into())));
        assert!(matches!(error(View::Along(11.0), still("a.png"), &scene(PATH)?), Some(PlanError::OffPath { .. })));
        assert!(matches!(error(View::Along(f64::NAN), still("a.png"), &scene(PATH)?), Some(PlanError::OffPath { .. })));
        assert_eq!(error(View::Scene, still("a.jpg"), &bare), Some(PlanError::NoPng("a.jpg".into())));
        let standing = Clock::Standing(None);
        assert_eq!(error(View::Scene, sequence(0, None, standing), &bare), Some(PlanError::Nothing));
        assert_eq!(error(View::Scene, sequence(2, Some(0.0), standing), &bare), Some(PlanError::BadRate(0.0)));
        assert_eq!(error(View::Scene, sequence(u32::MAX, None, standing), &bare), Some(PlanError::TooMany(u32::MAX)));
        let twice = Output::Stills(vec![Still { out: "a.png".into(), at: None }; 2]);
        assert_eq!(error(View::Scene, twice, &bare), Some(PlanError::SameFile("a.png".into())));
        let none = Part { number: 4, of: 3 }.check().err().map(|error| error.to_string());
        assert_eq!(none.as_deref(), Some("there is no piece 4 of 3; the pieces are 1/3 to 3/3"));
        assert!(Part { number: 0, of: 3 }.check().is_err() && Part { number: 3, of: 3 }.check().is_ok());
        let fault = PlanError::NoPng("a.jpg".into()).to_string();
        assert!(fault.ends_with("call it a.png"), "{fault}");
        for (endings, words) in
            [(&["film"][..], "end in .film"), (&["exr", "png", "film"], "end in .exr, .png or .film")]
        {
            let fault = PlanError::ending("a.jpg".into(), endings).to_string();
            assert!(fault.contains("`a.jpg`") && fault.ends_with(words), "{fault}");
        }
        Ok(())
    }
}
