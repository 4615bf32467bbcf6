//! Bakes a species again in the background: a preview of all its plants at once, then everything at full quality when
//! no value has changed for a moment, then the textures of the crossed billboards.
//!
//! One plant at a time, on the library's [background threads](crate::assets::background). The latest request wins: what an
//! older one has still to do is dropped, and of what it is doing only a preview is still shown, so that a held key shows
//! something. A bake of one plant is not broken off, so on two cores a new preview may wait for the end of one.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use crate::{
    assets::background::{Background, BackgroundError, start},
    bake::{
        levels::cross::{Cross, CrossSettings, bake_cross},
        lighting::{
            BakedLighting, ExpressiveLighting, LightingSettings,
            implicit::{ImplicitParameters, bake_implicit, implicit_parameters},
        },
    },
    plant::Plant,
};

/// Fraction of the generators or rays that a preview uses, and its fewest rays.
const PREVIEW_SHARE: f32 = 0.1;
const PREVIEW_RAYS: u32 = 16;
/// Time without a change before a full bake starts.
const QUIET_TIME: Duration = Duration::from_millis(250);

/// A step of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The lighting, quick and rough.
    Preview,
    /// The lighting at full quality.
    Full,
    /// The crossed billboards.
    Crosses,
}

impl Step {
    /// All steps in their order.
    pub const ALL: [Self; 3] = [Self::Preview, Self::Full, Self::Crosses];

    /// Its name for the user.
    pub fn name(self) -> &'static str {
        match self {
            Self::Preview => "preview",
            Self::Full => "full quality",
            Self::Crosses => "billboards",
        }
    }
}

/// A finished bake of one plant.
#[derive(Clone, Debug)]
pub struct Baked {
    /// Its step.
    pub step: Step,
    /// Index of the plant.
    pub plant: usize,
    /// Time of the request; `None` if it was replaced meanwhile.
    pub requested: Option<Instant>,
    /// The result.
    pub content: Content,
}

/// The result of a bake.
#[derive(Clone, Debug)]
pub enum Content {
    /// The lighting, and the automatic values of an implicit surface.
    Light(Arc<BakedLighting>, Option<ImplicitParameters>),
    /// The crossed billboards.
    Cross(Arc<Cross>),
}

struct Request {
    settings: LightingSettings,
    /// The settings of the preview; `None` if it would be the full bake.
    preview: Option<LightingSettings>,
    requested: Instant,
    /// Number of bakes that are done, of all steps.
    done: usize,
    lit: Vec<Arc<BakedLighting>>,
}

struct Running {
    step: Step,
    plant: usize,
    /// Whether its request was not replaced.
    is_current: bool,
    work: Background<Content>,
}

/// The bakes of one species.
pub struct Rebake {
    plants: Vec<Arc<Plant>>,
    cross: CrossSettings,
    request: Option<Request>,
    running: Option<Running>,
}

impl Rebake {
    /// Nothing to do yet for `plants`.
    pub fn new(plants: Vec<Arc<Plant>>, cross: CrossSettings) -> Self {
        Self { plants, cross, request: None, running: None }
    }

    /// Bakes with `settings` from now on, instead of what was requested before.
    pub fn request(&mut self, settings: LightingSettings, now: Instant) {
        let settings = settings.sanitized();
        let preview = Some(preview(settings)).filter(|preview| *preview != settings);
        self.running = self.running.take().filter(|running| running.step == Step::Preview);
        if let Some(running) = &mut self.running {
            running.is_current = false;
        }
        self.request = Some(Request { settings, preview, requested: now, done: 0, lit: Vec::new() });
    }

    /// Drops everything that was requested.
    pub fn cancel(&mut self) {
        (self.request, self.running) = (None, None);
    }

    /// What is done next or now: the step, the number of its bakes that are done, and of all. `None`: nothing.
    pub fn progress(&self) -> Option<(Step, usize, usize)> {
        let (step, plant) = self.next()?;
        Some((step, plant, self.plants.len()))
    }

    /// Takes a bake that is finished, and starts the next one.
    ///
    /// # Errors
    /// [`BackgroundError`]; the request is dropped.
    pub fn poll(&mut self, now: Instant) -> Result<Option<Baked>, BackgroundError> {
        let mut baked = None;
        if let Some(running) = &self.running {
            let Some(result) = running.work.finished() else { return Ok(None) };
            let (step, plant, is_current) = (running.step, running.plant, running.is_current);
            self.running = None;
            let content = result.inspect_err(|_| self.request = None)?;
            let request = self.request.as_mut().filter(|_| is_current);
            let requested = request.as_ref().map(|request| request.requested);
            if let Some(request) = request {
                request.done += 1;
                if let (Step::Full, Content::Light(lighting, _)) = (step, &content) {
                    request.lit.push(lighting.clone());
                }
            }
            baked = Some(Baked { step, plant, requested, content });
        }
        self.start(now);
        Ok(baked)
    }

    /// The next bake of the request.
    fn next(&self) -> Option<(Step, usize)> {
        let request = self.request.as_ref()?;
        let all = self.plants.len();
        let first = usize::from(request.preview.is_none());
        let step = Step::ALL.get(first + request.done.checked_div(all)?)?;
        Some((*step, request.done % all))
    }

    fn start(&mut self, now: Instant) {
        let Some((step, index)) = self.next() else {
            self.request = None;
            return;
        };
        let (Some(request), Some(plant)) = (&self.request, self.plants.get(index).cloned()) else { return };
        if step != Step::Preview && now.saturating_duration_since(request.requested) < QUIET_TIME {
            return;
        }
        let (settings, cross) = (request.settings, self.cross);
        let work = match step {
            Step::Preview => {
                let settings = request.preview.unwrap_or(settings);
                start(move |_| bake(&plant, &settings))
            }
            Step::Full => start(move |_| bake(&plant, &settings)),
            Step::Crosses => {
                let Some(lighting) = request.lit.get(index).cloned() else { return };
                start(move |_| Content::Cross(Arc::new(bake_cross(&plant, &lighting, &cross))))
            }
        };
        self.running = Some(Running { step, plant: index, is_current: true, work });
    }
}

/// Starts to compute the automatic values of `settings` for `plant`; `None` if they have none.
pub fn automatic_values(plant: Arc<Plant>, settings: &LightingSettings) -> Option<Background<ImplicitParameters>> {
    let LightingSettings::Expressive(settings) = *settings else { return None };
    Some(start(move |_| implicit_parameters(&plant, &settings)))
}

/// The settings of a preview.
fn preview(settings: LightingSettings) -> LightingSettings {
    let mut preview = settings;
    match &mut preview {
        LightingSettings::Local => {}
        LightingSettings::Expressive(settings) => {
            settings.generator_share = settings.generator_share.min(PREVIEW_SHARE);
        }
        LightingSettings::Transfer(settings) => {
            let rays = (settings.rays as f32 * PREVIEW_SHARE) as u32;
            settings.rays = rays.max(PREVIEW_RAYS).min(settings.rays);
        }
    }
    preview.sanitized()
}

fn bake(plant: &Arc<Plant>, settings: &LightingSettings) -> Content {
    let LightingSettings::Expressive(settings) = settings else {
        return Content::Light(Arc::new(BakedLighting::bake(plant, settings)), None);
    };
    let mut settings = *settings;
    // Neither the normals nor the panel need the mesh of the surface.
    settings.surface = false;
    let baked = bake_implicit(plant, &settings);
    let lighting = ExpressiveLighting::new(baked.normals, baked.ambient, baked.report.no_surface, &settings);
    Content::Light(Arc::new(BakedLighting::Expressive(lighting)), Some(baked.report.parameters))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        bake::lighting::{implicit::ImplicitSettings, transfer::TransferSettings},
        plant::grow::{GrowParameters, grow},
    };

    type Outcome = Result<(), Box<dyn std::error::Error>>;

    fn rebake(count: u64) -> Result<Rebake, crate::plant::grow::GrowError> {
        let plants = (0..count).map(|seed| grow(&GrowParameters::broadleaf(), seed, 5000).map(Arc::new));
        let cross = CrossSettings { resolution: 64, supersampling: 1, ..CrossSettings::default() };
        Ok(Rebake::new(plants.collect::<Result<_, _>>()?, cross))
    }

    fn radius(radius: f32) -> LightingSettings {
        LightingSettings::Expressive(ImplicitSettings { radius: Some(radius), ..ImplicitSettings::default() })
    }

    /// Everything until nothing is left to do, with the keys at rest.
    fn all(rebake: &mut Rebake, now: Instant) -> Result<Vec<Baked>, BackgroundError> {
        let mut all = Vec::new();
        while rebake.progress().is_some() || rebake.running.is_some() {
            all.extend(rebake.poll(now + QUIET_TIME)?);
            std::thread::yield_now();
        }
        Ok(all)
    }

    fn steps(baked: &[Baked]) -> Vec<(Step, usize)> {
        baked.iter().map(|baked| (baked.step, baked.plant)).collect()
    }

    #[test]
    fn previews_come_first_and_the_last_results_equal_the_scenes_own_bake() -> Outcome {
        let transfer = LightingSettings::Transfer(TransferSettings { rays: 64, ..TransferSettings::default() });
        for settings in [radius(1.5), transfer] {
            let (mut rebake, now) = (rebake(2)?, Instant::now());
            rebake.request(settings, now);
            let baked = all(&mut rebake, now)?;
            assert_eq!(steps(&baked), Step::ALL.map(|step| [(step, 0), (step, 1)]).concat());
            assert!(baked.iter().all(|baked| baked.requested == Some(now)));
            for (index, plant) in rebake.plants.iter().enumerate() {
                let expected = BakedLighting::bake(plant, &settings);
                let Content::Light(lighting, values) = &baked[2 + index].content else { return Err("no light".into()) };
                assert!(**lighting == expected && values.is_some() == expected.is_realigned());
                let Content::Cross(cross) = &baked[4 + index].content else { return Err("no cross".into()) };
                assert!(**cross == bake_cross(plant, &expected, &rebake.cross));
            }
        }
        Ok(())
    }

    #[test]
    fn full_bakes_wait_for_rest_and_what_needs_no_preview_has_none() -> Outcome {
        let (mut rebake, now) = (rebake(1)?, Instant::now());
        rebake.request(radius(1.0), now);
        while rebake.progress() != Some((Step::Full, 0, 1)) {
            rebake.poll(now)?;
        }
        assert!(rebake.poll(now)?.is_none() && rebake.running.is_none());
        rebake.poll(now + QUIET_TIME)?;
        assert!(rebake.running.is_some());
        rebake.request(LightingSettings::Local, now);
        assert!(rebake.running.is_none());
        assert_eq!(steps(&all(&mut rebake, now)?), [(Step::Full, 0), (Step::Crosses, 0)]);
        Ok(())
    }

    /// A held key replaces request after request, faster than one preview is baked.
    #[test]
    fn a_replaced_request_still_shows_its_running_preview_and_nothing_else() -> Outcome {
        let (mut rebake, now) = (rebake(1)?, Instant::now());
        rebake.request(radius(1.0), now);
        rebake.poll(now)?;
        for step in 1..20u8 {
            rebake.request(radius(1.0 + 0.1 * f32::from(step)), now);
        }
        let baked = all(&mut rebake, now)?;
        let order = [Step::Preview, Step::Preview, Step::Full, Step::Crosses].map(|step| (step, 0));
        assert_eq!(steps(&baked), order);
        assert!(baked[0].requested.is_none() && baked[1].requested.is_some());
        assert!(matches!(baked[2].content, Content::Light(_, Some(values)) if values.radius == 1.0 + 0.1 * 19.0));
        rebake.request(radius(1.0), now);
        rebake.poll(now)?;
        rebake.cancel();
        assert!(all(&mut rebake, now)?.is_empty());
        Ok(())
    }

    #[test]
    fn values_come_without_a_bake() -> Outcome {
        let plant = rebake(1)?.plants[0].clone();
        let values = automatic_values(plant.clone(), &radius(1.5)).ok_or("no values")?;
        let values = bevy::tasks::block_on(values)?;
        assert!(values.radius == 1.5 && values.threshold > 0.0 && values.core > 0.0);
        assert!(automatic_values(plant, &LightingSettings::Local).is_none());
        Ok(())
    }
}
