//! The sun: location, instant and air as one entity, and the light that follows from them.

use std::sync::Arc;

use bevy::{
    app::{App, Plugin, PostUpdate, PreUpdate},
    camera::visibility::VisibilitySystems,
    ecs::{
        change_detection::DetectChangesMut,
        component::Component,
        entity::Entity,
        reflect::ReflectComponent,
        resource::Resource,
        schedule::{IntoScheduleConfigs, common_conditions::any_with_component},
        system::{Commands, Query, Res, ResMut},
    },
    log::error_once,
    prelude::ReflectDefault,
    reflect::Reflect,
    tasks::{AsyncComputeTaskPool, Task, block_on, poll_once},
    time::Time,
    transform::TransformSystems,
};
use chrono::{DateTime, TimeDelta, Utc};

use super::{
    daylight::{FollowsDaylight, light_meshes},
    exposure::{StandCache, expose_cameras},
    sets::CanopySystems,
};
use crate::{
    light::{
        ExposureSettings, LightError, LightSettings, LightState,
        atmosphere::{Atmosphere, AtmosphereParams},
        check_range,
        moon::{MoonSetting, celestial_rotation},
        sun::{Observer, SunPosition},
    },
    math::Range,
    render::components::{Daylight, LightUpdates, SunShadowSettings},
    scene::LocalTime,
};

/// Why a [`Sun`] is not possible.
#[derive(Debug, thiserror::Error)]
pub enum SunError {
    /// The location is not on earth.
    #[error(transparent)]
    Place(#[from] LightError),
    /// The time cannot be read; the text says why, and how to write one.
    #[error("{0}")]
    Time(String),
}

/// When the light is computed again for a [`Sun`] that has changed, and what follows from the light ([`LightUpdates`]).
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Default)]
pub enum SunRefresh {
    /// In the same frame, which waits for it: about 25 ms, more if the air has changed, and 30 ms for what follows. For
    /// images and tests.
    Immediate,
    /// In the background. While the clock runs, a new light is started when the drawn one lags by this many seconds of
    /// the clock. When the clock stops, the light catches up.
    Background {
        /// Seconds, 0 or more. Within the default of 5 the sun moves by 0.02 degrees, and the shadow of a 20 m tree by
        /// about 7 mm.
        #[reflect(@Range::factor(0.0..=3600.0).unit("s"), @"Seconds of the clock by which the drawn light may lag while the clock runs.")]
        lag: f32,
    },
}

impl Default for SunRefresh {
    fn default() -> Self {
        Self::Background { lag: 5.0 }
    }
}

/// The sun and, at night, the moon over a location on earth at an instant: they light everything. Only one entity of a
/// world may have it; a second one is rejected with a message.
///
/// The light is computed in the background as often as [`SunRefresh`] says, however often the instant changes. Bevy's
/// [`DirectionalLight`](bevy::light::DirectionalLight) on the same entity follows it, so that ordinary meshes are lit
/// like the forest. A program that computes its own light inserts a [`Daylight`] and spawns no `Sun`.
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Default)]
#[require(SunRefresh, SunShadowSettings, FollowsDaylight)]
pub struct Sun {
    /// Location on earth.
    pub observer: Observer,
    /// Universal Time. Reflection does not show it: the type is chrono's, which knows nothing of reflection.
    #[reflect(ignore)]
    pub instant: DateTime<Utc>,
    /// Seconds of the clock per second of the app's virtual time; 0: it is stopped.
    pub rate: f64,
    /// The moon of the night.
    #[reflect(@"The moon of the night.")]
    pub moon: MoonSetting,
    /// Meteorological visibility at sea level in kilometres, 2 to 250. Lower is hazier.
    #[reflect(@Range::factor(2.0..=250.0).unit("km"), @"Meteorological visibility at sea level. Lower is hazier.")]
    pub visibility_km: f64,
    /// Exposure compensation in stops, -10 to 10; positive is brighter. A forest is darker than the middle grey that
    /// the exposure curve is made for; the default is 0.9.
    #[reflect(@Range::steps(-10.0..=10.0, 0.5, 0.1).unit("EV"), @"Exposure compensation in stops; positive is brighter.")]
    pub compensation_ev: f32,
    /// EV at ISO 100 that is kept whatever the light, -10 to 25; `None`: the exposure follows the light at the camera.
    #[reflect(ignore)]
    pub fixed_ev100: Option<f32>,
}

impl Default for Sun {
    /// The June noon of 2026 in the middle of Europe, with a full moon at night.
    fn default() -> Self {
        Self {
            observer: Observer {
                latitude_deg: 48.0,
                longitude_deg: 11.0,
                height_m: 500.0,
                pressure_mbar: 955.0,
                temperature_c: 12.0,
            },
            instant: DateTime::from_timestamp(1_782_040_500, 0).unwrap_or_default(),
            rate: 0.0,
            moon: MoonSetting::Full,
            visibility_km: 40.0,
            compensation_ev: 0.9,
            fixed_ev100: None,
        }
    }
}

impl Sun {
    /// The sun over a location (degrees, north and east positive) at a local time with its offset from UTC, such as
    /// `"2026-06-21T15:30-04:00"`, or in UTC, `"2026-06-21T19:30Z"`.
    ///
    /// # Errors
    /// [`SunError`] for a location or time that is out of range or cannot be read.
    pub fn at(latitude_deg: f64, longitude_deg: f64, time: &str) -> Result<Self, SunError> {
        let observer = Observer::new(latitude_deg, longitude_deg, 0.0)?;
        let instant = time.parse::<LocalTime>().map_err(|error| SunError::Time(error.to_string()))?.utc();
        Ok(Self { observer, instant, ..Self::default() })
    }

    /// The same with a clock that runs `rate` seconds per second.
    #[must_use]
    pub fn running(self, rate: f64) -> Self {
        Self { rate, ..self }
    }

    /// Whether `other` differs only in its instant.
    fn same_but_for_time(&self, other: &Self) -> bool {
        Self { instant: other.instant, rate: other.rate, ..self.clone() } == *other
    }

    /// Refuses what is outside of the ranges that the fields name.
    fn check(&self) -> Result<(), LightError> {
        self.observer.validate()?;
        check_range("visibility", self.visibility_km, "km", 2.0, 250.0, "40 km is a clear day")?;
        let stops = f64::from(self.compensation_ev);
        check_range("exposure compensation", stops, "EV", -10.0, 10.0, "positive is brighter")?;
        Ok(())
    }

    /// The light of these settings; `atmosphere` has their visibility.
    ///
    /// # Errors
    /// [`LightError`] for a value outside of its range, and an instant that is too far away.
    pub fn light(&self, atmosphere: &Atmosphere) -> Result<LightState, LightError> {
        self.check()?;
        let sun = SunPosition::at(self.instant, &self.observer)?;
        let moon = self.moon.moon(Some((self.instant, &self.observer)), &sun)?;
        let settings = LightSettings {
            observer_height_m: self.observer.height_m.clamp(-500.0, 9000.0),
            star_rotation: celestial_rotation(self.instant, &self.observer),
            exposure: ExposureSettings {
                compensation: self.compensation_ev,
                fixed_ev100: self.fixed_ev100,
                ..ExposureSettings::default()
            },
            ..LightSettings::default()
        };
        LightState::new(atmosphere, sun, moon, &settings)
    }
}

/// The sun whose light is drawn, which may lag behind the entity's ([`SunRefresh`]). Missing before the first light.
#[derive(Resource, Clone, Debug, PartialEq)]
pub struct DrawnSun(pub Sun);

/// Light that was computed: the air that it needed, and its state.
type Computed = Result<(Arc<Atmosphere>, LightState), LightError>;

/// The computed light, and the computation in progress.
#[derive(Resource, Default)]
struct LightWork {
    /// The atmosphere, which is expensive to compute, and its visibility in kilometres.
    air: Option<(f64, Arc<Atmosphere>)>,
    /// The sun whose light is drawn, or was found to be impossible.
    shown: Option<Sun>,
    /// The sun of the last frame.
    last: Option<Sun>,
    task: Option<(Sun, Task<Computed>)>,
}

impl LightWork {
    /// Whether the light of `sun` must be computed now.
    fn is_due(&self, sun: &Sun, refresh: SunRefresh) -> bool {
        let Some(shown) = &self.shown else { return true };
        if !shown.same_but_for_time(sun) {
            return true;
        }
        let lag = (sun.instant - shown.instant).abs();
        let moves = self.last.as_ref().is_some_and(|last| last.instant != sun.instant);
        match refresh {
            SunRefresh::Background { lag: allowed } if moves => {
                lag >= seconds(allowed.max(0.0).into()) && !lag.is_zero()
            }
            _ => !lag.is_zero(),
        }
    }

    /// The computation of the light of `sun`.
    fn computation(&self, sun: &Sun) -> impl FnOnce() -> Computed + Send + 'static {
        let known = self.air.clone().filter(|(visibility, _)| *visibility == sun.visibility_km);
        let sun = sun.clone();
        move || {
            // The air is expensive, so it comes after the check.
            sun.check()?;
            let air = match known {
                Some((_, air)) => air,
                None => Arc::new(Atmosphere::new(AtmosphereParams::with_visibility_km(sun.visibility_km))?),
            };
            let light = sun.light(&air)?;
            Ok((air, light))
        }
    }

    /// Applies the light of `sun`. An error is logged once, and the computation is not tried again.
    fn accept(&mut self, sun: Sun, computed: Computed, commands: &mut Commands) {
        match computed {
            Ok((air, light)) => {
                self.air = Some((sun.visibility_km, air));
                commands.insert_resource(Daylight(Arc::new(light)));
                commands.insert_resource(DrawnSun(sun.clone()));
            }
            Err(error) => error_once!("the light cannot be computed: {error}"),
        }
        self.shown = Some(sun);
    }
}

/// A duration, clamped to the longest possible one.
fn seconds(seconds: f64) -> TimeDelta {
    let nanoseconds = seconds * 1e9;
    if nanoseconds.is_finite() && nanoseconds.abs() < 9e18 {
        TimeDelta::nanoseconds(nanoseconds as i64)
    } else {
        TimeDelta::nanoseconds(if nanoseconds < 0.0 { i64::MIN } else { i64::MAX })
    }
}

/// Updates [`Daylight`], the cameras' exposure and the lights that follow the [`Sun`].
pub struct SunPlugin;

impl Plugin for SunPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<LightWork>()
            .init_resource::<StandCache>()
            .init_resource::<LightUpdates>()
            .register_type::<(Sun, SunRefresh, FollowsDaylight)>()
            .add_systems(PreUpdate, run_clocks.in_set(CanopySystems::Clock).run_if(any_with_component::<Sun>))
            .add_systems(
                PostUpdate,
                (
                    (update_light, light_meshes)
                        .chain()
                        .in_set(CanopySystems::Light)
                        .before(TransformSystems::Propagate),
                    expose_cameras
                        .after(CanopySystems::Light)
                        .after(CanopySystems::Origin)
                        .after(CanopySystems::Forests)
                        .after(TransformSystems::Propagate)
                        .after(VisibilitySystems::VisibilityPropagate),
                ),
            );
    }
}

/// Advances the running clocks.
fn run_clocks(time: Option<Res<Time>>, mut suns: Query<&mut Sun>) {
    let Some(time) = time else { return };
    for mut sun in &mut suns {
        if !sun.rate.is_finite() {
            error_once!("the clock of a Sun stands still: its rate is {}; give seconds per second", sun.rate);
            continue;
        }
        let step = seconds(sun.rate * time.delta_secs_f64());
        if !step.is_zero()
            && let Some(instant) = sun.instant.checked_add_signed(step)
        {
            sun.instant = instant;
        }
    }
}

fn update_light(
    mut commands: Commands,
    suns: Query<(Entity, &Sun, &SunRefresh)>,
    daylight: Option<Res<Daylight>>,
    mut work: ResMut<LightWork>,
    mut updates: ResMut<LightUpdates>,
) {
    if suns.count() > 1 {
        error_once!("{} entities have a Sun, but there is one light: the first one counts", suns.count());
    }
    let sun = suns.iter().min_by_key(|(entity, ..)| *entity);
    if let Some((of, mut task)) = work.task.take() {
        match block_on(poll_once(&mut task)) {
            // The light of a despawned sun comes too late.
            Some(computed) if sun.is_some() => work.accept(of, computed, &mut commands),
            Some(_) => {}
            None => work.task = Some((of, task)),
        }
    }
    let Some((_, sun, refresh)) = sun else {
        work.shown = None;
        work.last = None;
        return;
    };
    updates.set_if_neq(match refresh {
        SunRefresh::Immediate => LightUpdates::Blocking,
        SunRefresh::Background { .. } => LightUpdates::Background,
    });
    if work.is_due(sun, *refresh) {
        let pool = AsyncComputeTaskPool::try_get();
        match (refresh, pool) {
            // Wait for the first light: without it nothing is drawn.
            (SunRefresh::Background { .. }, Some(pool)) if daylight.is_some() => {
                if work.task.is_none() {
                    let compute = work.computation(sun);
                    work.task = Some((sun.clone(), pool.spawn(async move { compute() })));
                }
            }
            _ => {
                work.task = None;
                let computed = work.computation(sun)();
                work.accept(sun.clone(), computed, &mut commands);
            }
        }
    }
    work.last = Some(sun.clone());
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(sun: &Sun) -> LightWork {
        LightWork { shown: Some(sun.clone()), last: Some(sun.clone()), ..LightWork::default() }
    }

    #[test]
    fn light_follows_steps_at_once_and_a_running_clock_in_steps() {
        let refresh = SunRefresh::default();
        let start = Sun::default();
        let mut work = shown(&start);
        assert!(!work.is_due(&start, refresh));
        let later = |seconds| Sun { instant: start.instant + TimeDelta::seconds(seconds), ..start.clone() };
        // The light follows a running clock when it lags by five seconds ...
        assert!(!work.is_due(&later(4), refresh) && work.is_due(&later(5), refresh));
        assert!(work.is_due(&later(1), SunRefresh::Immediate));
        // ... and as soon as the clock stops.
        work.last = Some(later(4));
        assert!(work.is_due(&later(4), refresh));
        // Anything else is followed at once.
        assert!(work.is_due(&Sun { visibility_km: 10.0, ..start.clone() }, refresh));
        // The rate of the clock has no visible effect.
        assert!(!work.is_due(&start.clone().running(60.0), refresh));
    }

    #[test]
    fn clocks_of_any_rate_stay_in_the_calendar() {
        for rate in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
            assert_eq!(seconds(rate).num_days().abs(), i64::MAX / 86_400_000_000_000, "{rate}");
        }
        assert_eq!(seconds(1.5), TimeDelta::milliseconds(1500));
    }

    #[test]
    fn impossible_suns_have_no_light() -> Result<(), LightError> {
        let atmosphere = Atmosphere::new(AtmosphereParams::default())?;
        let sun = Sun::default();
        assert!(sun.light(&atmosphere).is_ok());
        let at = |change: &dyn Fn(&mut Observer)| {
            let mut observer = sun.observer;
            change(&mut observer);
            Sun { observer, ..sun.clone() }
        };
        let late = DateTime::from_timestamp(253_370_764_800, 0).unwrap_or_default();
        assert_eq!(late.to_rfc3339(), "9999-01-01T00:00:00+00:00");
        let mut impossible = vec![
            Sun { instant: late, ..sun.clone() },
            Sun { instant: DateTime::<Utc>::MAX_UTC, ..sun.clone() },
            Sun { instant: DateTime::<Utc>::MIN_UTC, ..sun.clone() },
        ];
        for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e9, -1e9] {
            impossible.push(at(&|observer| observer.latitude_deg = wrong));
            impossible.push(at(&|observer| observer.longitude_deg = wrong));
            impossible.push(at(&|observer| observer.height_m = wrong));
            impossible.push(at(&|observer| observer.pressure_mbar = wrong));
            impossible.push(at(&|observer| observer.temperature_c = wrong));
            impossible.push(Sun { compensation_ev: wrong as f32, ..sun.clone() });
            impossible.push(Sun { visibility_km: wrong, ..sun.clone() });
        }
        for sun in impossible {
            assert!(sun.light(&atmosphere).is_err(), "{sun:?}");
        }
        Ok(())
    }

    #[test]
    fn a_clock_whose_rate_is_no_number_stands_still() {
        let mut app = App::new();
        app.insert_resource(Time::<()>::default()).add_systems(PreUpdate, run_clocks);
        let start = Sun::default();
        let suns = [f64::NAN, f64::INFINITY].map(|rate| app.world_mut().spawn(start.clone().running(rate)).id());
        app.world_mut().resource_mut::<Time>().advance_by(std::time::Duration::from_secs(1));
        app.update();
        for sun in suns {
            assert_eq!(app.world().get::<Sun>(sun).map(|sun| sun.instant), Some(start.instant));
        }
    }

    #[test]
    fn a_sun_is_placed_by_degrees_and_a_local_time() -> Result<(), SunError> {
        let sun = Sun::at(36.5, -84.2, "2026-06-21T15:30-04:00")?;
        assert_eq!(sun.instant.to_rfc3339(), "2026-06-21T19:30:00+00:00");
        assert!(matches!(Sun::at(91.0, 0.0, "2026-06-21T15:30Z"), Err(SunError::Place(_))));
        let message = Sun::at(0.0, 0.0, "noon").map_err(|error| error.to_string());
        assert!(message.is_err_and(|message| message.contains("noon")));
        Ok(())
    }
}
