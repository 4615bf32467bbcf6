//! Bakes the lighting of the leaves in the background: a preview at once, then at full quality, then the textures of
//! the crossed billboards.
//!
//! Two threads wait for requests, one per priority. The preview thread bakes previews with a fraction of the
//! generators, one plant after the other. The full thread starts when the previews are done and no key was pressed for
//! a moment. The latest request of a species wins: the remaining work of an older one is dropped, and of its running
//! bakes only a preview is still shown. So a preview never waits for an outdated full bake.
//!
//! The full thread has a rayon pool of all cores but one, the preview thread a pool of one thread. On two cores or more
//! they never use more than there are, and leave one to the frame, except when a preview starts while an outdated full
//! bake is still ending.

use std::{
    collections::BTreeMap,
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    thread,
    time::{Duration, Instant},
};

use crate::{
    assets::threads::spare_cores,
    bake::{
        levels::cross::{Cross, CrossSettings, bake_cross},
        lighting::{
            BakedLighting, ExpressiveLighting,
            implicit::{ImplicitParameters, ImplicitSettings, NoSurface, bake_implicit, implicit_parameters},
        },
    },
    plant::Plant,
};

/// Fraction of the generators that a preview uses.
pub const PREVIEW_SHARE: f32 = 0.1;
/// Time without a key press before a full bake starts.
const QUIET_TIME: Duration = Duration::from_millis(250);

/// A request to bake the lighting of a species.
#[derive(Clone, Debug)]
pub struct BakeRequest {
    /// Index of the species.
    pub species: usize,
    /// Its individuals.
    pub plants: Vec<Arc<Plant>>,
    /// Settings of the lighting.
    pub settings: ImplicitSettings,
    /// Settings of the crossed billboards; `None` requests only the automatic values of the first individual.
    pub cross: Option<CrossSettings>,
}

/// A finished bake.
#[derive(Clone, Debug)]
pub struct BakeResult {
    /// Index of the species.
    pub species: usize,
    /// Index of the individual within the species.
    pub individual: usize,
    /// Time of the request; `None` for a preview of a request that was replaced meanwhile. While a key is held, all
    /// previews may be of that kind.
    pub requested: Option<Instant>,
    /// The result itself.
    pub content: Content,
}

/// The result of a bake of one individual.
#[derive(Clone, Debug)]
pub enum Content {
    /// The parameters that a bake would use.
    Values(ImplicitParameters),
    /// The lighting.
    Light {
        /// Whether it is a preview or at full quality.
        preview: bool,
        /// The lighting.
        lighting: Arc<BakedLighting>,
        /// The parameters of the bake.
        values: ImplicitParameters,
        /// Why the leaves keep their own normals, if they do.
        no_surface: Option<NoSurface>,
    },
    /// Crossed billboards with the lighting at full quality.
    Cross(Arc<Cross>),
}

/// Progress of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Previews or values are being computed.
    Preview,
    /// Number of individuals baked at full quality, and of all individuals.
    Full(usize, usize),
    /// Number of individuals whose billboards are baked, and of all individuals.
    Crosses(usize, usize),
}

struct Job {
    number: u64,
    requested: Instant,
    request: BakeRequest,
    previewed: usize,
    lit: Vec<Arc<BakedLighting>>,
    crossed: usize,
}

/// The thread that bakes a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Priority {
    Preview,
    Full,
}

/// A part of a request that is baked in one go.
struct Task {
    species: usize,
    number: u64,
    requested: Instant,
    individual: usize,
    plant: Arc<Plant>,
    work: Work,
}

enum Work {
    Values(ImplicitSettings),
    Light { settings: ImplicitSettings, preview: bool },
    Cross { lighting: Arc<BakedLighting>, settings: CrossSettings },
}

impl Task {
    fn run(&self) -> Content {
        match &self.work {
            Work::Values(settings) => Content::Values(implicit_parameters(&self.plant, settings)),
            Work::Light { settings, preview } => {
                let mut settings = *settings;
                // Neither the normals nor the panel need the mesh of the surface.
                settings.surface = false;
                if *preview {
                    settings.generator_share = PREVIEW_SHARE;
                }
                let baked = bake_implicit(&self.plant, &settings);
                let (values, no_surface) = (baked.report.parameters, baked.report.no_surface);
                let lighting = ExpressiveLighting::new(baked.normals, baked.ambient, no_surface, &settings);
                let lighting = Arc::new(BakedLighting::Expressive(lighting));
                Content::Light { preview: *preview, lighting, values, no_surface }
            }
            Work::Cross { lighting, settings } => Content::Cross(Arc::new(bake_cross(&self.plant, lighting, settings))),
        }
    }
}

impl Job {
    fn task(&self, individual: usize, work: Work) -> Option<Task> {
        let plant = self.request.plants.get(individual)?.clone();
        Some(Task {
            species: self.request.species,
            number: self.number,
            requested: self.requested,
            individual,
            plant,
            work,
        })
    }

    fn preview_task(&self) -> Option<Task> {
        let settings = self.request.settings;
        let preview = || Work::Light { settings, preview: true };
        let work = if self.request.cross.is_some() { preview() } else { Work::Values(settings) };
        self.task(self.previewed, work)
    }

    fn full_task(&self) -> Option<Task> {
        let settings = self.request.cross.filter(|_| self.preview_task().is_none())?;
        match self.lit.get(self.crossed) {
            Some(lighting) if self.lit.len() == self.request.plants.len() => {
                self.task(self.crossed, Work::Cross { lighting: lighting.clone(), settings })
            }
            _ => self.task(self.lit.len(), Work::Light { settings: self.request.settings, preview: false }),
        }
    }

    /// Records a finished task; returns whether nothing is left to do.
    fn record(&mut self, content: &Content) -> bool {
        match content {
            Content::Values(_) => return true,
            Content::Light { preview: true, .. } => self.previewed += 1,
            Content::Light { lighting, .. } => self.lit.push(lighting.clone()),
            Content::Cross(_) => self.crossed += 1,
        }
        self.crossed >= self.request.plants.len()
    }

    fn progress(&self) -> Progress {
        let all = self.request.plants.len();
        if self.preview_task().is_some() {
            Progress::Preview
        } else if self.lit.len() < all {
            Progress::Full(self.lit.len(), all)
        } else {
            Progress::Crosses(self.crossed, all)
        }
    }
}

#[derive(Default)]
struct State {
    jobs: BTreeMap<usize, Job>,
    requests: u64,
    results: Vec<BakeResult>,
    closed: bool,
    failure: Option<String>,
}

impl State {
    /// The next task for `priority`, or how long it may sleep before it checks again.
    fn next(&self, priority: Priority, now: Instant) -> Result<Task, Option<Duration>> {
        let mut jobs: Vec<&Job> = self.jobs.values().collect();
        jobs.sort_by_key(|job| std::cmp::Reverse(job.number));
        let mut wait = None;
        for job in jobs {
            let rest = QUIET_TIME.saturating_sub(now.saturating_duration_since(job.requested));
            match priority {
                Priority::Preview => match job.preview_task() {
                    Some(task) => return Ok(task),
                    None => continue,
                },
                Priority::Full => match job.full_task() {
                    Some(task) if rest.is_zero() => return Ok(task),
                    Some(_) => wait = Some(wait.unwrap_or(rest).min(rest)),
                    None => {}
                },
            }
        }
        Err(wait)
    }

    /// Stores the result of a task, unless its request was cancelled meanwhile or, except for a preview, replaced.
    fn finish(&mut self, task: &Task, content: Content) {
        let Some(job) = self.jobs.get_mut(&task.species) else { return };
        let current = job.number == task.number;
        if !current && !matches!(content, Content::Light { preview: true, .. }) {
            return;
        }
        if current && job.record(&content) {
            self.jobs.remove(&task.species);
        }
        let requested = current.then_some(task.requested);
        self.results.push(BakeResult { species: task.species, individual: task.individual, requested, content });
    }
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for a task; `None` when the baker was dropped.
    fn wait(&self, priority: Priority) -> Option<Task> {
        let mut state = self.state();
        loop {
            if state.closed {
                return None;
            }
            state = match state.next(priority, Instant::now()) {
                Ok(task) => return Some(task),
                Err(Some(rest)) => self.changed.wait_timeout(state, rest).unwrap_or_else(PoisonError::into_inner).0,
                Err(None) => self.changed.wait(state).unwrap_or_else(PoisonError::into_inner),
            };
        }
    }

    fn work(&self, priority: Priority, threads: usize) {
        let name = |index| format!("canopy light {index}");
        let pool = match rayon::ThreadPoolBuilder::new().num_threads(threads).thread_name(name).build() {
            Ok(pool) => pool,
            Err(error) => {
                self.state().failure = Some(format!("cannot create threads for bakes: {error}"));
                self.changed.notify_all();
                return;
            }
        };
        while let Some(task) = self.wait(priority) {
            let content = pool.install(|| task.run());
            self.state().finish(&task, content);
            self.changed.notify_all();
        }
    }
}

/// The two threads and their requests. When it is dropped, they end after their current task.
#[derive(Default)]
pub struct Baker {
    shared: Arc<Shared>,
    started: bool,
}

impl Baker {
    /// Bakes `request`, which replaces an earlier request of its species. The first request starts the threads.
    pub fn request(&mut self, request: BakeRequest) {
        if request.plants.is_empty() {
            return;
        }
        if !std::mem::replace(&mut self.started, true) {
            self.start(Priority::Preview, 1);
            self.start(Priority::Full, spare_cores());
        }
        let mut state = self.shared.state();
        state.requests += 1;
        // A full bake with no more generators than a preview needs no preview.
        let slow = request.cross.is_none() || request.settings.sanitized().generator_share > PREVIEW_SHARE;
        let previewed = if slow { 0 } else { request.plants.len() };
        let (number, requested) = (state.requests, Instant::now());
        let job = Job { number, requested, previewed, lit: Vec::new(), crossed: 0, request };
        state.jobs.insert(job.request.species, job);
        drop(state);
        self.shared.changed.notify_all();
    }

    fn start(&self, priority: Priority, threads: usize) {
        let shared = self.shared.clone();
        let started = thread::Builder::new()
            .name(format!("canopy light {priority:?}"))
            .spawn(move || shared.work(priority, threads));
        if let Err(error) = started {
            self.shared.state().failure = Some(format!("cannot create a thread for bakes: {error}"));
        }
    }

    /// Cancels the request of a species, and drops its results that were not taken yet.
    pub fn cancel(&mut self, species: usize) {
        let mut state = self.shared.state();
        state.jobs.remove(&species);
        state.results.retain(|result| result.species != species);
    }

    /// The results since the last call, in order: none of cancelled requests, and only previews of replaced ones.
    pub fn results(&mut self) -> Vec<BakeResult> {
        std::mem::take(&mut self.shared.state().results)
    }

    /// Progress of the request of a species; `None` if nothing is left to do.
    pub fn progress(&self, species: usize) -> Option<Progress> {
        self.shared.state().jobs.get(&species).map(Job::progress)
    }

    /// Waits until there are results, or nothing is left to do.
    #[cfg(test)]
    pub(super) fn wait(&self) {
        let idle = |state: &mut State| state.results.is_empty() && !state.jobs.is_empty() && state.failure.is_none();
        drop(self.shared.changed.wait_while(self.shared.state(), idle));
    }

    /// Why nothing can be baked, if it cannot.
    pub fn failure(&self) -> Option<String> {
        self.shared.state().failure.clone()
    }
}

impl Drop for Baker {
    fn drop(&mut self) {
        self.shared.state().closed = true;
        self.shared.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        bake::lighting::LightingSettings,
        plant::grow::{GrowParameters, grow},
    };

    type Outcome = Result<(), Box<dyn std::error::Error>>;

    fn plants(count: u64) -> Result<Vec<Arc<Plant>>, crate::plant::grow::GrowError> {
        (0..count).map(|seed| grow(&GrowParameters::broadleaf(), seed, 5000).map(Arc::new)).collect()
    }

    fn request(plants: &[Arc<Plant>], settings: ImplicitSettings) -> BakeRequest {
        let cross = CrossSettings { resolution: 64, supersampling: 1, ..CrossSettings::default() };
        BakeRequest { species: 0, plants: plants.to_vec(), settings, cross: Some(cross) }
    }

    /// All results until the request of species 0 is done.
    fn all_results(baker: &mut Baker) -> Vec<BakeResult> {
        let mut results = Vec::new();
        while baker.progress(0).is_some() && baker.failure().is_none() {
            baker.wait();
            results.extend(baker.results());
        }
        results.extend(baker.results());
        results
    }

    #[test]
    fn previews_come_first_and_the_last_results_equal_the_scenes_own_bake() -> Outcome {
        let plants = plants(2)?;
        let settings = ImplicitSettings { radius: Some(1.5), ..ImplicitSettings::default() };
        let mut baker = Baker::default();
        baker.request(request(&plants, settings));
        let results = all_results(&mut baker);
        let kinds: Vec<_> = results
            .iter()
            .map(|result| {
                (
                    result.individual,
                    match &result.content {
                        Content::Values(_) => "values",
                        Content::Light { preview: true, .. } => "preview",
                        Content::Light { .. } => "full",
                        Content::Cross(_) => "cross",
                    },
                )
            })
            .collect();
        let expected = ["preview", "full", "cross"].map(|kind| [(0, kind), (1, kind)]).concat();
        assert_eq!(kinds, expected);
        for (individual, plant) in plants.iter().enumerate() {
            let expected = BakedLighting::bake(plant, &LightingSettings::Expressive(settings));
            let Content::Light { lighting, no_surface: None, .. } = &results[2 + individual].content else {
                return Err("no light".into());
            };
            assert!(**lighting == expected);
            let Content::Cross(cross) = &results[4 + individual].content else { return Err("no cross".into()) };
            assert!(**cross == bake_cross(plant, &expected, &request(&plants, settings).cross.unwrap_or_default()));
        }
        Ok(())
    }

    #[test]
    fn the_latest_request_wins() -> Outcome {
        let plants = plants(1)?;
        let mut baker = Baker::default();
        let radius = |step: u16| 1.0 + 0.1 * f32::from(step);
        for step in 0..20 {
            baker.request(request(
                &plants,
                ImplicitSettings { radius: Some(radius(step)), ..ImplicitSettings::default() },
            ));
        }
        let full: Vec<f32> = all_results(&mut baker)
            .iter()
            .filter_map(|result| match &result.content {
                Content::Light { preview: false, values, .. } => Some(values.radius),
                _ => None,
            })
            .collect();
        assert_eq!(full, [radius(19)]);
        baker.request(request(&plants, ImplicitSettings::default()));
        baker.cancel(0);
        assert!(all_results(&mut baker).is_empty());
        Ok(())
    }

    /// A held key replaces request after request, faster than one preview is baked.
    #[test]
    fn a_replaced_request_still_shows_its_preview_and_nothing_else() -> Outcome {
        let (plants, now) = (plants(1)?, Instant::now());
        let job = |number| Job {
            number,
            requested: now,
            request: request(&plants, ImplicitSettings::default()),
            previewed: 0,
            lit: Vec::new(),
            crossed: 0,
        };
        let mut state = State::default();
        state.jobs.insert(0, job(2));
        let old = job(1).preview_task().ok_or("nothing to do")?;
        let light = |preview| Content::Light {
            preview,
            lighting: Arc::new(BakedLighting::Local),
            values: implicit_parameters(&plants[0], &ImplicitSettings::default()),
            no_surface: None,
        };
        state.finish(&old, light(false));
        assert!(state.results.is_empty());
        state.finish(&old, light(true));
        assert!(state.results.len() == 1 && state.results[0].requested.is_none());
        assert_eq!(state.jobs[&0].progress(), Progress::Preview);
        // The full priority waits for the preview, then for the keys to be released.
        assert!(matches!(state.next(Priority::Full, now), Err(None)));
        let new = state.next(Priority::Preview, now).map_err(|_| "nothing to do")?;
        state.finish(&new, light(true));
        assert!(matches!(state.next(Priority::Full, now), Err(Some(rest)) if rest == QUIET_TIME));
        assert!(state.next(Priority::Full, now + QUIET_TIME).is_ok_and(|task| task.number == 2));
        state.jobs.clear();
        state.finish(&new, light(true));
        assert_eq!(state.results.len(), 2);
        Ok(())
    }

    #[test]
    fn values_come_without_a_bake_and_a_missing_surface_is_reported() -> Outcome {
        let plants = plants(1)?;
        let mut baker = Baker::default();
        baker.request(BakeRequest { cross: None, ..request(&plants, ImplicitSettings::default()) });
        let results = all_results(&mut baker);
        let [BakeResult { content: Content::Values(values), .. }] = results.as_slice() else {
            return Err("no values".into());
        };
        assert!(values.radius > 0.0 && values.threshold > 0.0 && values.core > 0.0);
        baker.request(request(&plants, ImplicitSettings { threshold: Some(1e6), ..ImplicitSettings::default() }));
        let reasons = all_results(&mut baker).into_iter().filter_map(|result| match result.content {
            Content::Light { no_surface, .. } => no_surface,
            _ => None,
        });
        assert!(reasons.count() == 2);
        Ok(())
    }
}
