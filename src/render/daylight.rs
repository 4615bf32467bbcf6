//! From a place and an instant to the light of the moment: the main world's side of sun, sky and exposure.

use std::sync::Arc;

use bevy::{
    app::{App, Plugin, PreUpdate},
    camera::Exposure,
    color::LinearRgba,
    ecs::{
        change_detection::DetectChanges,
        component::Component,
        query::{Added, With},
        resource::Resource,
        schedule::IntoScheduleConfigs,
        system::{Commands, Query, Res, ResMut},
    },
    light::{DirectionalLight, GlobalAmbientLight},
    log::error_once,
    transform::components::Transform,
};
use chrono::{DateTime, Utc};
use glam::Vec3;

use super::components::{CanopyCamera, Daylight};
use crate::light::{
    ExposureSettings, LightError, LightSettings, LightState,
    atmosphere::{Atmosphere, AtmosphereParams},
    moon::{MoonSetting, celestial_rotation},
    sun::{Observer, SunPosition},
};
use crate::math::luminance;

/// Place, instant and air. Change it whenever the clock moves; the light is computed anew only then.
#[derive(Resource, Clone, Debug, PartialEq)]
pub struct SkySettings {
    /// Place on earth.
    pub observer: Observer,
    /// Universal Time.
    pub instant: DateTime<Utc>,
    /// Which moon the night has.
    pub moon: MoonSetting,
    /// Meteorological visibility at sea level in kilometres, 2 to 250. Lower is hazier.
    pub visibility_km: f64,
    /// Stops by which pictures are brighter than the exposure curve has them, -10 to 10. A forest is darker than the
    /// middle grey that the curve is made for; the default is 0.9.
    pub compensation_ev: f32,
}

impl Default for SkySettings {
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
            moon: MoonSetting::Full,
            visibility_km: 40.0,
            compensation_ev: 0.9,
        }
    }
}

impl SkySettings {
    /// The light of these settings; `atmosphere` has their visibility.
    ///
    /// # Errors
    /// [`LightError`] for an impossible place or instant.
    pub fn light(&self, atmosphere: &Atmosphere) -> Result<LightState, LightError> {
        let sun = SunPosition::at(self.instant, &self.observer)?;
        let moon = self.moon.moon(Some((self.instant, &self.observer)), &sun)?;
        let settings = LightSettings {
            observer_height_m: self.observer.height_m.clamp(-500.0, 9000.0),
            star_rotation: celestial_rotation(self.instant, &self.observer),
            exposure: ExposureSettings { compensation: self.compensation_ev, ..ExposureSettings::default() },
            ..LightSettings::default()
        };
        LightState::new(atmosphere, sun, moon, &settings)
    }
}

/// A Bevy directional light that follows the sun or the moon, so that ordinary meshes are lit like the forest.
#[derive(Component, Clone, Copy, Debug, Default)]
pub struct FollowsDaylight;

/// Keeps [`Daylight`], the cameras' exposure and the lights that follow in step with [`SkySettings`].
///
/// Insert a [`Daylight`] of your own and no [`SkySettings`] to light the scene otherwise.
pub struct DaylightPlugin;

/// The air, which is laborious to compute: kept while the visibility stays.
#[derive(Resource, Default)]
struct Air(Option<(f64, Arc<Atmosphere>)>);

impl Plugin for DaylightPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Air>().add_systems(PreUpdate, (compute_daylight, expose_cameras, light_meshes).chain());
    }
}

fn compute_daylight(mut commands: Commands, settings: Option<Res<SkySettings>>, mut air: ResMut<Air>) {
    let Some(settings) = settings.filter(|settings| settings.is_changed()) else { return };
    let atmosphere = match &air.0 {
        Some((visibility, atmosphere)) if *visibility == settings.visibility_km => atmosphere.clone(),
        _ => match Atmosphere::new(AtmosphereParams::with_visibility_km(settings.visibility_km)) {
            Ok(atmosphere) => {
                let atmosphere = Arc::new(atmosphere);
                air.0 = Some((settings.visibility_km, atmosphere.clone()));
                atmosphere
            }
            Err(error) => {
                error_once!("the sky cannot be computed: {error}");
                return;
            }
        },
    };
    match settings.light(&atmosphere) {
        Ok(light) => commands.insert_resource(Daylight(Arc::new(light))),
        Err(error) => error_once!("the light cannot be computed: {error}"),
    }
}

fn expose_cameras(
    mut commands: Commands,
    daylight: Option<Res<Daylight>>,
    cameras: Query<(bevy::ecs::entity::Entity, Option<&Exposure>), With<CanopyCamera>>,
) {
    let Some(daylight) = daylight else { return };
    for (camera, exposure) in &cameras {
        if exposure.is_none_or(|exposure| exposure.ev100 != daylight.0.ev100) {
            commands.entity(camera).insert(Exposure { ev100: daylight.0.ev100 });
        }
    }
}

fn light_meshes(
    daylight: Option<Res<Daylight>>,
    mut lights: Query<(&mut DirectionalLight, &mut Transform), With<FollowsDaylight>>,
    fresh: Query<(), Added<FollowsDaylight>>,
    mut ambient: Option<ResMut<GlobalAmbientLight>>,
) {
    let Some(daylight) = daylight.filter(|daylight| daylight.is_changed() || !fresh.is_empty()) else { return };
    if lights.is_empty() {
        return;
    }
    let light = &daylight.0;
    let illuminance = light.key_illuminance.max_element().max(0.0);
    let color = light.key_illuminance / illuminance.max(1e-12);
    for (mut directional, mut transform) in &mut lights {
        directional.illuminance = illuminance;
        directional.color = LinearRgba::rgb(color.x, color.y, color.z).into();
        *transform = Transform::default().looking_to(-light.key_direction, Vec3::Y);
    }
    if let Some(ambient) = ambient.as_mut() {
        let sky = light.sky_illuminance.max(Vec3::ZERO);
        let brightest = sky.max_element().max(1e-12);
        ambient.color = LinearRgba::rgb(sky.x / brightest, sky.y / brightest, sky.z / brightest).into();
        // Bevy's ambient is a radiance from everywhere: the sky's mean over both hemispheres.
        ambient.brightness = luminance(sky) / std::f32::consts::PI * 0.5;
    }
}
