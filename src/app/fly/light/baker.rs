//! Bakes of the leaves' light beside the flight: a preview at once, then in full, then the pictures of the crosses.
//!
//! Two threads of their own wait for orders. The quick one makes previews, of a share of the generators, one plant after
//! the other. The thorough one begins when the previews are there and the keys have been at rest for a moment. The latest order of a
//! species wins: what an older one still had to do is dropped, and of a bake that was under way only a preview is still
//! shown. So a preview never waits for a bake in full that nobody wants any more.
//!
//! The thorough thread has a rayon pool of all cores but one, the quick one a pool of one thread: of two cores or more they
//! never ask for more than there are, and leave one to the frame unless a preview comes while a bake that was dropped ends.

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

/// Share of the generators that a preview goes by.
pub const PREVIEW_SHARE: f32 = 0.1;
/// How long keys rest before a bake in full begins.
const REST: Duration = Duration::from_millis(250);

/// What is wanted.
#[derive(Clone, Debug)]
pub struct Order {
    /// Number of the species.
    pub species: usize,
    /// Its individuals.
    pub plants: Vec<Arc<Plant>>,
    /// How they are lit.
    pub settings: ImplicitSettings,
    /// How their crosses are made; `None` only asks for the values that follow from the first individual.
    pub cross: Option<CrossSettings>,
}

/// What was baked.
#[derive(Clone, Debug)]
pub struct News {
    /// Number of the species.
    pub species: usize,
    /// Number of the individual among those of the species.
    pub individual: usize,
    /// When it was ordered; `None` for a preview of an order that was replaced meanwhile. While a key is held no other may
    /// come.
    pub ordered: Option<Instant>,
    /// What it is.
    pub content: Content,
}

/// What was baked of one individual.
#[derive(Clone, Debug)]
pub enum Content {
    /// The values that a bake would go by.
    Values(ImplicitParameters),
    /// The light.
    Light {
        /// Of a preview or in full.
        preview: bool,
        /// The light.
        lighting: Arc<BakedLighting>,
        /// The values that it goes by.
        values: ImplicitParameters,
        /// Why the leaves have their own normals after all.
        no_surface: Option<NoSurface>,
    },
    /// Crosses in the light that was baked in full.
    Cross(Arc<Cross>),
}

/// How far an order has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Previews or values are made.
    Preview,
    /// Individuals that are baked in full, of how many.
    Full(usize, usize),
    /// Individuals whose crosses are made, of how many.
    Crosses(usize, usize),
}

struct Job {
    number: u64,
    ordered: Instant,
    order: Order,
    previewed: usize,
    lit: Vec<Arc<BakedLighting>>,
    crossed: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Lane {
    Quick,
    Thorough,
}

/// A piece of an order that is carried out in one go.
struct Piece {
    species: usize,
    number: u64,
    ordered: Instant,
    individual: usize,
    plant: Arc<Plant>,
    work: Work,
}

enum Work {
    Values(ImplicitSettings),
    Light { settings: ImplicitSettings, preview: bool },
    Cross { lighting: Arc<BakedLighting>, settings: CrossSettings },
}

impl Piece {
    fn carry_out(&self) -> Content {
        match &self.work {
            Work::Values(settings) => Content::Values(implicit_parameters(&self.plant, settings)),
            Work::Light { settings, preview } => {
                let mut settings = *settings;
                // The normals do not ask for it, and nobody looks at it.
                settings.surface = false;
                if *preview {
                    settings.generator_share = PREVIEW_SHARE;
                }
                let baked = bake_implicit(&self.plant, &settings);
                let (values, no_surface) = (baked.report.parameters, baked.report.no_surface);
                let own_normal = settings.sanitized().own_normal;
                let lighting = ExpressiveLighting::new(baked.normals, baked.ambient, no_surface, own_normal);
                let lighting = Arc::new(BakedLighting::Expressive(lighting));
                Content::Light { preview: *preview, lighting, values, no_surface }
            }
            Work::Cross { lighting, settings } => Content::Cross(Arc::new(bake_cross(&self.plant, lighting, settings))),
        }
    }
}

impl Job {
    fn piece(&self, individual: usize, work: Work) -> Option<Piece> {
        let plant = self.order.plants.get(individual)?.clone();
        Some(Piece { species: self.order.species, number: self.number, ordered: self.ordered, individual, plant, work })
    }

    fn quick(&self) -> Option<Piece> {
        let settings = self.order.settings;
        let preview = || Work::Light { settings, preview: true };
        let work = if self.order.cross.is_some() { preview() } else { Work::Values(settings) };
        self.piece(self.previewed, work)
    }

    fn thorough(&self) -> Option<Piece> {
        let settings = self.order.cross.filter(|_| self.quick().is_none())?;
        match self.lit.get(self.crossed) {
            Some(lighting) if self.lit.len() == self.order.plants.len() => {
                self.piece(self.crossed, Work::Cross { lighting: lighting.clone(), settings })
            }
            _ => self.piece(self.lit.len(), Work::Light { settings: self.order.settings, preview: false }),
        }
    }

    /// Notes what was carried out; whether nothing is left to do.
    fn note(&mut self, content: &Content) -> bool {
        match content {
            Content::Values(_) => return true,
            Content::Light { preview: true, .. } => self.previewed += 1,
            Content::Light { lighting, .. } => self.lit.push(lighting.clone()),
            Content::Cross(_) => self.crossed += 1,
        }
        self.crossed >= self.order.plants.len()
    }

    fn progress(&self) -> Progress {
        let all = self.order.plants.len();
        if self.quick().is_some() {
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
    orders: u64,
    news: Vec<News>,
    closed: bool,
    failure: Option<String>,
}

impl State {
    /// What `lane` should do now, or how long it may sleep before it looks again.
    fn next(&self, lane: Lane, now: Instant) -> Result<Piece, Option<Duration>> {
        let mut jobs: Vec<&Job> = self.jobs.values().collect();
        jobs.sort_by_key(|job| std::cmp::Reverse(job.number));
        let mut wait = None;
        for job in jobs {
            let rest = REST.saturating_sub(now.saturating_duration_since(job.ordered));
            match lane {
                Lane::Quick => match job.quick() {
                    Some(piece) => return Ok(piece),
                    None => continue,
                },
                Lane::Thorough => match job.thorough() {
                    Some(piece) if rest.is_zero() => return Ok(piece),
                    Some(_) => wait = Some(wait.unwrap_or(rest).min(rest)),
                    None => {}
                },
            }
        }
        Err(wait)
    }

    /// Takes up what came of a piece, unless its order was taken back or, but for a preview, replaced meanwhile.
    fn finish(&mut self, piece: &Piece, content: Content) {
        let Some(job) = self.jobs.get_mut(&piece.species) else { return };
        let current = job.number == piece.number;
        if !current && !matches!(content, Content::Light { preview: true, .. }) {
            return;
        }
        if current && job.note(&content) {
            self.jobs.remove(&piece.species);
        }
        let ordered = current.then_some(piece.ordered);
        self.news.push(News { species: piece.species, individual: piece.individual, ordered, content });
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

    /// Waits for something to do; `None` when nobody wants anything any more.
    fn wait(&self, lane: Lane) -> Option<Piece> {
        let mut state = self.state();
        loop {
            if state.closed {
                return None;
            }
            state = match state.next(lane, Instant::now()) {
                Ok(piece) => return Some(piece),
                Err(Some(rest)) => self.changed.wait_timeout(state, rest).unwrap_or_else(PoisonError::into_inner).0,
                Err(None) => self.changed.wait(state).unwrap_or_else(PoisonError::into_inner),
            };
        }
    }

    fn work(&self, lane: Lane, threads: usize) {
        let name = |index| format!("canopy light {index}");
        let pool = match rayon::ThreadPoolBuilder::new().num_threads(threads).thread_name(name).build() {
            Ok(pool) => pool,
            Err(error) => {
                self.state().failure = Some(format!("no threads for bakes: {error}"));
                self.changed.notify_all();
                return;
            }
        };
        while let Some(piece) = self.wait(lane) {
            let content = pool.install(|| piece.carry_out());
            self.state().finish(&piece, content);
            self.changed.notify_all();
        }
    }
}

/// The two threads and their orders. Dropped, they end after what they are at.
#[derive(Default)]
pub struct Baker {
    shared: Arc<Shared>,
    started: bool,
}

impl Baker {
    /// Bakes `order` instead of what was wanted of this species before. The first order starts the threads.
    pub fn order(&mut self, order: Order) {
        if order.plants.is_empty() {
            return;
        }
        if !std::mem::replace(&mut self.started, true) {
            self.start(Lane::Quick, 1);
            self.start(Lane::Thorough, spare_cores());
        }
        let mut state = self.shared.state();
        state.orders += 1;
        // A share that is no larger than a preview's needs none.
        let slow = order.cross.is_none() || order.settings.sanitized().generator_share > PREVIEW_SHARE;
        let previewed = if slow { 0 } else { order.plants.len() };
        let (number, ordered) = (state.orders, Instant::now());
        let job = Job { number, ordered, previewed, lit: Vec::new(), crossed: 0, order };
        state.jobs.insert(job.order.species, job);
        drop(state);
        self.shared.changed.notify_all();
    }

    fn start(&self, lane: Lane, threads: usize) {
        let shared = self.shared.clone();
        let started =
            thread::Builder::new().name(format!("canopy light {lane:?}")).spawn(move || shared.work(lane, threads));
        if let Err(error) = started {
            self.shared.state().failure = Some(format!("no thread for bakes: {error}"));
        }
    }

    /// Drops what was wanted of a species, and what came of it that nobody has taken yet.
    pub fn cancel(&mut self, species: usize) {
        let mut state = self.shared.state();
        state.jobs.remove(&species);
        state.news.retain(|news| news.species != species);
    }

    /// What was baked since the last call, in its order; nothing of orders that were taken back, and of those that were replaced
    /// only previews.
    pub fn news(&mut self) -> Vec<News> {
        std::mem::take(&mut self.shared.state().news)
    }

    /// How far the order of a species has come; `None` where nothing is to be done.
    pub fn progress(&self, species: usize) -> Option<Progress> {
        self.shared.state().jobs.get(&species).map(Job::progress)
    }

    /// Waits until there is news, or nothing left to do.
    #[cfg(test)]
    pub(super) fn wait(&self) {
        let idle = |state: &mut State| state.news.is_empty() && !state.jobs.is_empty() && state.failure.is_none();
        drop(self.shared.changed.wait_while(self.shared.state(), idle));
    }

    /// Why nothing can be baked, if so.
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

    fn order(plants: &[Arc<Plant>], settings: ImplicitSettings) -> Order {
        let cross = CrossSettings { resolution: 64, supersampling: 1, ..CrossSettings::default() };
        Order { species: 0, plants: plants.to_vec(), settings, cross: Some(cross) }
    }

    /// All news until the order of species 0 is carried out.
    fn all_news(baker: &mut Baker) -> Vec<News> {
        let mut news = Vec::new();
        while baker.progress(0).is_some() && baker.failure().is_none() {
            baker.wait();
            news.extend(baker.news());
        }
        news.extend(baker.news());
        news
    }

    #[test]
    fn previews_come_first_and_what_comes_last_is_the_scenes_own_bake() -> Outcome {
        let plants = plants(2)?;
        let settings = ImplicitSettings { radius: Some(1.5), ..ImplicitSettings::default() };
        let mut baker = Baker::default();
        baker.order(order(&plants, settings));
        let news = all_news(&mut baker);
        let kinds: Vec<_> = news
            .iter()
            .map(|news| {
                (
                    news.individual,
                    match &news.content {
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
            let truth = BakedLighting::bake(plant, &LightingSettings::Expressive(settings));
            let Content::Light { lighting, no_surface: None, .. } = &news[2 + individual].content else {
                return Err("no light".into());
            };
            assert!(**lighting == truth);
            let Content::Cross(cross) = &news[4 + individual].content else { return Err("no cross".into()) };
            assert!(**cross == bake_cross(plant, &truth, &order(&plants, settings).cross.unwrap_or_default()));
        }
        Ok(())
    }

    #[test]
    fn the_latest_order_wins() -> Outcome {
        let plants = plants(1)?;
        let mut baker = Baker::default();
        let radius = |turn: u16| 1.0 + 0.1 * f32::from(turn);
        for turn in 0..20 {
            baker.order(order(&plants, ImplicitSettings { radius: Some(radius(turn)), ..ImplicitSettings::default() }));
        }
        let full: Vec<f32> = all_news(&mut baker)
            .iter()
            .filter_map(|news| match &news.content {
                Content::Light { preview: false, values, .. } => Some(values.radius),
                _ => None,
            })
            .collect();
        assert_eq!(full, [radius(19)]);
        baker.order(order(&plants, ImplicitSettings::default()));
        baker.cancel(0);
        assert!(all_news(&mut baker).is_empty());
        Ok(())
    }

    /// A held key replaces order after order, faster than one preview is made.
    #[test]
    fn a_replaced_order_still_shows_its_preview_and_nothing_else() -> Outcome {
        let (plants, now) = (plants(1)?, Instant::now());
        let job = |number| Job {
            number,
            ordered: now,
            order: order(&plants, ImplicitSettings::default()),
            previewed: 0,
            lit: Vec::new(),
            crossed: 0,
        };
        let mut state = State::default();
        state.jobs.insert(0, job(2));
        let old = job(1).quick().ok_or("nothing to do")?;
        let light = |preview| Content::Light {
            preview,
            lighting: Arc::new(BakedLighting::Local),
            values: implicit_parameters(&plants[0], &ImplicitSettings::default()),
            no_surface: None,
        };
        state.finish(&old, light(false));
        assert!(state.news.is_empty());
        state.finish(&old, light(true));
        assert!(state.news.len() == 1 && state.news[0].ordered.is_none());
        assert_eq!(state.jobs[&0].progress(), Progress::Preview);
        // The thorough lane waits for the preview, then for the keys to rest.
        assert!(matches!(state.next(Lane::Thorough, now), Err(None)));
        let new = state.next(Lane::Quick, now).map_err(|_| "nothing to do")?;
        state.finish(&new, light(true));
        assert!(matches!(state.next(Lane::Thorough, now), Err(Some(rest)) if rest == REST));
        assert!(state.next(Lane::Thorough, now + REST).is_ok_and(|piece| piece.number == 2));
        state.jobs.clear();
        state.finish(&new, light(true));
        assert_eq!(state.news.len(), 2);
        Ok(())
    }

    #[test]
    fn values_come_without_a_bake_and_no_surface_is_told() -> Outcome {
        let plants = plants(1)?;
        let mut baker = Baker::default();
        baker.order(Order { cross: None, ..order(&plants, ImplicitSettings::default()) });
        let news = all_news(&mut baker);
        let [News { content: Content::Values(values), .. }] = news.as_slice() else { return Err("no values".into()) };
        assert!(values.radius > 0.0 && values.threshold > 0.0 && values.core > 0.0);
        baker.order(order(&plants, ImplicitSettings { threshold: Some(1e6), ..ImplicitSettings::default() }));
        let told = all_news(&mut baker).into_iter().filter_map(|news| match news.content {
            Content::Light { no_surface, .. } => no_surface,
            _ => None,
        });
        assert!(told.count() == 2);
        Ok(())
    }
}
