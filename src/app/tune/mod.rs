//! The settings with the least error within a time, or the least time within an error: what `canopy tune` does.
//!
//! A search by coordinates. The scene as written is measured beside all neighbours, which differ from it in one setting by
//! one rung of that setting's ladder; the best of them is the next centre, and so on until no neighbour is better. Each step
//! measures its candidates in turn with its centre, so that they can be compared on a machine that is not quiet.
//!
//! Limits: no single rung improves what is found, but two at once might. What a bake changes is left out unless a ladder names
//! it, since every value would have to be baked.

mod ladder;

use std::path::PathBuf;

use self::ladder::{ladders, neighbours};
use super::{
    AppError, Combination, ProfileError, ProfileOptions, ProfileReport, ReferenceKind, Sweep,
    profile::{LEAST_ROUNDS_FOR_RATIO, check_names, levels_to_ron, profile_of},
    profiled_scene, set_setting, settings_of,
};
use crate::{
    files,
    progress::Progress,
    scene::{Overrides, Scene, SceneSource},
};

/// Steps of a search; a ladder has fewer rungs.
const MOST_STEPS: usize = 40;
/// What a mean FLIP must fall by so that it counts: images are the same on each run, but not on each driver.
const LEAST_GAIN: f64 = 1e-4;

/// What a search is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// The least error with 95 of 100 frames within these milliseconds.
    Budget(f64),
    /// The least time with a mean FLIP of at most this.
    Error(f64),
}

/// What to search, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct TuneOptions {
    /// The goal.
    pub goal: Goal,
    /// What is measured, and how; its sweeps are the ladders, from cheap to dear, and none stands for the built-in ones.
    pub profile: ProfileOptions,
}

/// One candidate of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Measured {
    /// What 95 % of the frame times do not exceed, in milliseconds.
    time: f64,
    /// Median frame time beside that of the centre, and the ends of its 95 % interval.
    ratio: Option<(f64, f64, f64)>,
    /// Mean FLIP.
    error: f64,
}

/// The result of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuned {
    /// The scene with the settings that were found.
    pub scene: Scene,
    /// What 95 % of its frame times do not exceed, in milliseconds.
    pub time: f64,
    /// Its mean FLIP.
    pub error: f64,
    /// How it was found, one line a step.
    pub steps: Vec<String>,
    /// The file with the settings.
    pub file: PathBuf,
}

/// Searches the settings of a scene.
///
/// # Errors
/// [`ProfileError::FewRounds`] and [`ProfileError::NoReference`] before anything is measured. Those of [`profile`](super::profile());
/// [`ProfileError::NoAnswer`] if no settings reach the goal, with how near it came.
pub fn tune(options: &TuneOptions, progress: &mut dyn Progress) -> Result<Tuned, AppError> {
    check(&options.profile)?;
    let mut centre = profiled_scene(&options.profile.scene, &options.profile.overrides)?;
    let ladders = ladders(&options.profile.sweeps, &centre)?;
    let out = &options.profile.out;
    let file = out.join("quality.ron");
    files::check_writable(&file).map_err(|source| AppError::Write { path: file.clone(), source })?;
    let mut steps = Vec::new();
    for step in 0..MOST_STEPS {
        let sweeps = neighbours(&ladders, &centre);
        progress.note(&format!(
            "step {}: {} neighbours",
            step + 1,
            sweeps.iter().map(|sweep| sweep.values.len()).sum::<usize>()
        ));
        let report = measure_step(&centre, step_options(options, &centre, sweeps, step), step, progress)?;
        let candidates = candidates(&report)?;
        let now = candidates[0].1;
        let best = best(&candidates, options.goal);
        let label = report.points[candidates[best].0].label.clone();
        let chosen = candidates[best].1;
        let what = if best == 0 { "no neighbour is better".to_owned() } else { label };
        steps.push(format!(
            "{:>3}: {:.2} ms, FLIP {:.4}; {what} ({:.2} ms, FLIP {:.4})",
            step + 1,
            now.time,
            now.error,
            chosen.time,
            chosen.error
        ));
        if best == 0 {
            let reached = reaches(now, options.goal);
            if !reached {
                return Err(ProfileError::NoAnswer(no_answer(options.goal, now, &candidates)).into());
            }
            let tuned = Tuned { scene: centre, time: now.time, error: now.error, steps, file };
            let text = tuned.block(options, &report);
            files::write_whole(&tuned.file, |writer| writer.write_all(text.as_bytes()))
                .map_err(|source| AppError::Write { path: tuned.file.clone(), source })?;
            return Ok(tuned);
        }
        for (name, value) in &report.points[candidates[best].0].settings {
            set_setting(&mut centre, name, value).map_err(ProfileError::from)?;
        }
    }
    Err(ProfileError::NoAnswer(format!("the search did not end within {MOST_STEPS} steps; give ladders with --sweep"))
        .into())
}

/// Whether candidates can be told from each other at all.
fn check(profile: &ProfileOptions) -> Result<(), ProfileError> {
    let (rounds, least) = (profile.rounds, LEAST_ROUNDS_FOR_RATIO);
    if rounds < least {
        return Err(ProfileError::FewRounds { rounds, purpose: "to tell which settings are faster", least });
    }
    if profile.reference == ReferenceKind::None { Err(ProfileError::NoReference) } else { Ok(()) }
}

/// Measures a step, or goes on with it where `options` say so. The first one decides whether an interrupted search is this one; a later
/// one of other settings is left of a search before, and replaced.
fn measure_step(
    centre: &Scene,
    options: ProfileOptions,
    step: usize,
    progress: &mut dyn Progress,
) -> Result<ProfileReport, AppError> {
    let mut measure = |options: &ProfileOptions| profile_of(centre.clone(), String::new(), options, progress);
    let (report, _) = match measure(&options) {
        Err(AppError::Profile(ProfileError::Another(_))) if step > 0 => {
            measure(&ProfileOptions { resume: false, ..options })?
        }
        outcome => outcome?,
    };
    Ok(report)
}

fn no_answer(goal: Goal, now: Measured, candidates: &[(usize, Measured)]) -> String {
    // Neighbours that seem faster, with an interval that says nothing.
    let unsure =
        candidates.iter().filter(|(_, one)| one.ratio.is_some_and(|(value, _, high)| value < 1.0 && high >= 1.0));
    let unsure = match (goal, unsure.count()) {
        (Goal::Budget(_), count @ 1..) => {
            format!("; {count} neighbours may be faster, but their times spread too much to say so: give more --rounds")
        }
        _ => String::new(),
    };
    match goal {
        Goal::Budget(budget) => format!(
            "no settings were found that draw 95 of 100 frames within {budget} ms here; the last ones take {:.2} ms{unsure}",
            now.time
        ),
        Goal::Error(error) => {
            format!("no settings were found with a mean FLIP of at most {error}; the last ones have {:.4}", now.error)
        }
    }
}

/// The profile of one step. The reference is that of the scene as written.
fn step_options(options: &TuneOptions, centre: &Scene, sweeps: Vec<Sweep>, step: usize) -> ProfileOptions {
    let folder = |step: usize| options.profile.out.join(format!("step-{:02}", step + 1));
    let reference = match &options.profile.reference {
        made @ (ReferenceKind::Full { .. } | ReferenceKind::Traced { .. }) if step > 0 => {
            ReferenceKind::Folder(folder(0).join(made.folder_name()))
        }
        other => other.clone(),
    };
    ProfileOptions {
        scene: SceneSource::from(centre.clone()),
        out: folder(step),
        sweeps,
        combination: Combination::Each,
        reference,
        overrides: Overrides::default(),
        ..options.profile.clone()
    }
}

/// The points that have a time and an error, by index; the centre is the first.
fn candidates(report: &ProfileReport) -> Result<Vec<(usize, Measured)>, AppError> {
    let measured = |(index, point): (usize, &super::PointRecord)| {
        let found = &point.summary;
        let ratio = found.ratio.map(|ratio| (ratio.value, ratio.low, ratio.high));
        Some((index, Measured { time: found.frame?.p95, ratio, error: found.error? }))
    };
    let candidates: Vec<_> = report.points.iter().enumerate().filter_map(measured).collect();
    match candidates.first() {
        Some((0, _)) => Ok(candidates),
        _ => Err(ProfileError::NoAnswer(
            "a search needs frame times and a reference: leave out --rounds 0 and --reference none".to_owned(),
        )
        .into()),
    }
}

fn reaches(measured: Measured, goal: Goal) -> bool {
    match goal {
        Goal::Budget(budget) => measured.time <= budget,
        Goal::Error(error) => measured.error <= error,
    }
}

/// The index of the best of `candidates`; 0, the centre, unless another one is surely better.
fn best(candidates: &[(usize, Measured)], goal: Goal) -> usize {
    let centre = candidates[0].1;
    let surely_faster = |one: &Measured| one.ratio.is_some_and(|(_, _, high)| high < 1.0);
    let ratio = |one: &Measured| one.ratio.map_or(1.0, |(value, ..)| value);
    let of_others = |wanted: &dyn Fn(&Measured) -> bool, rank: &dyn Fn(&Measured) -> f64| {
        let others = (1..candidates.len()).filter(|index| wanted(&candidates[*index].1));
        others.min_by(|a, b| rank(&candidates[*a].1).total_cmp(&rank(&candidates[*b].1))).unwrap_or(0)
    };
    let truer = |one: &Measured| one.error < centre.error - LEAST_GAIN;
    match (goal, reaches(centre, goal)) {
        // Within the goal: what is measured as better, and still within it.
        (Goal::Budget(_), true) => of_others(&|one| reaches(*one, goal) && truer(one), &|one| one.error),
        (Goal::Error(_), true) => of_others(&|one| reaches(*one, goal) && surely_faster(one), &ratio),
        // Outside: first into it, for the least loss of the other per gain.
        (Goal::Budget(_), false) => of_others(&surely_faster, &|one| {
            let loss = (one.error - centre.error).max(0.0) + LEAST_GAIN;
            loss / (1.0 - ratio(one)).max(1e-6)
        }),
        (Goal::Error(_), false) => of_others(&truer, &|one| {
            let loss = (ratio(one) - 1.0).max(0.0) + 0.01;
            loss / (centre.error - one.error)
        }),
    }
}

impl Tuned {
    /// The settings as a scene file has them, with how they were found.
    fn block(&self, options: &TuneOptions, report: &ProfileReport) -> String {
        let goal = match options.goal {
            Goal::Budget(budget) => format!("the least error with 95 of 100 frames within {budget} ms"),
            Goal::Error(error) => format!("the least time with a mean FLIP of at most {error}"),
        };
        let (width, height) = report.method.size;
        let mut lines = vec![
            format!("// Found by `{}`: {goal},", options.profile.command),
            format!(
                "// at {width}x{height} pixels on {}, {} views, against `{}`.",
                report.machine.adapter,
                report.views.len(),
                options.profile.reference.name()
            ),
            format!(
                "// It takes {:.2} ms (95 % of the frames take no longer) with a mean FLIP of {:.4}.",
                self.time, self.error
            ),
            "// Each step measured all neighbours by one rung of one setting, in turn with its centre:".to_owned(),
        ];
        lines.extend(self.steps.iter().map(|step| format!("// {step}")));
        lines.push("quality: (".to_owned());
        for setting in settings_of(&self.scene) {
            match setting.name.strip_prefix("quality.") {
                Some("levels") if self.scene.quality.levels.is_empty() => {}
                Some("levels") => lines.push(format!("    levels: {},", levels_to_ron(&self.scene.quality.levels))),
                // A scene file leaves out what is automatic.
                Some(_) if setting.value == super::profile::AUTOMATIC => {}
                Some(field) => lines.push(format!("    {field}: {},", setting.value)),
                None => {}
            }
        }
        lines.push("),".to_owned());
        for species in &self.scene.species {
            if let Some(lighting) = &species.lighting {
                lines.push(format!("// species {}: lighting: {}", species.name, lighting.to_ron()));
            }
        }
        lines.join("\n") + "\n"
    }

    /// The result in lines for a terminal.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = self.steps.clone();
        lines.push(format!("{:.2} ms, mean FLIP {:.4}: {}", self.time, self.error, self.file.display()));
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(time: f64, ratio: f64, error: f64) -> (usize, Measured) {
        (0, Measured { time, ratio: Some((ratio, ratio - 0.01, ratio + 0.01)), error })
    }

    fn options(rounds: u32, reference: ReferenceKind) -> TuneOptions {
        let profile = ProfileOptions {
            scene: "nowhere.ron".into(),
            out: "nowhere".into(),
            sweeps: Vec::new(),
            combination: Combination::Each,
            part: None,
            control: false,
            against: None,
            views: crate::app::Views::Flight { frames: 1, fps: None, from: None, at: None },
            size: (64, 36),
            rounds,
            warm_up: 0,
            reference,
            shown: 1,
            resume: true,
            overrides: Overrides::default(),
            adapter: None,
            command: "canopy tune".to_owned(),
        };
        TuneOptions { goal: Goal::Budget(400.0), profile }
    }

    /// With 1 to 3 rounds no neighbour has a ratio, and the search once ended with "no settings were found" beside times within the
    /// budget.
    #[test]
    fn a_search_that_could_tell_nothing_is_refused_before_the_scene_is_read() {
        let refusal = |options: &TuneOptions| {
            tune(options, &mut crate::progress::Silent).err().map(|error| error.to_string()).unwrap_or_default()
        };
        for rounds in 0..4 {
            let message = refusal(&options(rounds, ReferenceKind::Full { supersampling: 1 }));
            let expected = format!("--rounds {rounds} are too few to tell which settings are faster; give at least 4");
            assert_eq!(message, expected);
        }
        assert!(refusal(&options(4, ReferenceKind::None)).contains("instead of none"));
        assert!(refusal(&options(4, ReferenceKind::Full { supersampling: 1 })).contains("nowhere.ron"));
    }

    /// "The same command with --resume goes on", it said, and there was no --resume.
    #[test]
    fn an_interrupted_search_goes_on_with_its_steps() {
        let search = options(4, ReferenceKind::Full { supersampling: 1 });
        for step in 0..2 {
            let own = step_options(&search, &Scene::default(), Vec::new(), step);
            assert!(own.resume && own.out.ends_with(format!("step-{:02}", step + 1)));
        }
    }

    #[test]
    fn within_the_goal_the_other_is_improved_and_outside_it_is_reached_first() {
        let centre = measured(10.0, 1.0, 0.2);
        let (faster, truer) = (measured(6.0, 0.6, 0.3), measured(14.0, 1.4, 0.1));
        let (much_worse, slightly) = (measured(7.0, 0.7, 0.9), measured(9.9, 0.995, 0.2));
        let of = |others: &[(usize, Measured)], goal| best(&[&[centre], others].concat(), goal);
        assert_eq!(of(&[faster, truer], Goal::Budget(20.0)), 2);
        assert_eq!(of(&[faster, truer], Goal::Budget(12.0)), 0);
        assert_eq!(of(&[much_worse, faster, truer], Goal::Budget(8.0)), 2);
        assert_eq!(of(&[faster, truer], Goal::Error(0.25)), 0);
        assert_eq!(of(&[faster, truer], Goal::Error(0.35)), 1);
        assert_eq!(of(&[faster, truer], Goal::Error(0.15)), 2);
        // What is not surely faster is not faster.
        assert_eq!(of(&[slightly], Goal::Error(0.35)), 0);
    }
}
