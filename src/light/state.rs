//! All light of one instant, computed only when the sun has moved.

use glam::{Mat3, Vec3};

use super::atmosphere::{Atmosphere, SkyView};
use super::error::{LightError, check_range};
use super::exposure::{ExposureSettings, ScotopicTint, exposure_from_ev100};
use super::moon::{MOON_ANGULAR_RADIUS, Moon};
use super::night::{NightSky, StarField};
use super::sh::{self, Sh9Rgb};
use super::sun::{SUN_ANGULAR_RADIUS, SunPosition, direction_from};
use super::surroundings::{Surroundings, ground_radiance, sky_illuminance};
use crate::math::{luminance, smoothstep};

/// Sine of the sun's elevation (5 degrees) above which moonlight, less than 2e-4 of the daylight, is left out. Below,
/// it fades in.
const MOON_OUT: f32 = 0.087;

/// Steps along a view ray for moonlit air: half of those for sunlight, because an error of a few percent is invisible
/// at night.
const MOON_STEPS: usize = 20;

/// Settings of [`LightState::new`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightSettings {
    /// Height of the observer above the sea in metres, -500 to 9000.
    pub observer_height_m: f64,
    /// The exposure curve.
    pub exposure: ExposureSettings,
    /// The diffuse light of the night.
    pub night: NightSky,
    /// The stars.
    pub stars: StarField,
    /// Rotation from the world into the stars' frame ([`super::moon::celestial_rotation`]).
    pub star_rotation: Mat3,
}

impl Default for LightSettings {
    fn default() -> Self {
        Self {
            observer_height_m: 0.0,
            exposure: ExposureSettings::default(),
            night: NightSky::default(),
            stars: StarField::default(),
            star_rotation: Mat3::IDENTITY,
        }
    }
}

/// The key light: the body that casts the shadows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyLight {
    /// The sun: while any of its disc is above the horizon, and when there is no moon.
    Sun,
    /// The moon.
    Moon,
}

/// Air between the camera and what it sees.
///
/// Optical depth of a straight path of the length `s` metres from the height `h0` to `h1` above the sea:
/// `extinction * s * H * (exp(-h0 / H) - exp(-h1 / H)) / (h1 - h0)` with `H` = `scale_height_m` (for `h1` near `h0`:
/// `extinction * s * exp(-h0 / H)`); the visible colour is `surface * T + inscatter * (1 - T)`, `T = exp(-depth)`. The
/// inscattered colour in the direction `d` is that of the sky texture at `d` with `d.y` raised to 0 when it is below
/// ([`LightState::fog_radiance`]): then terrain that is wholly fogged at the horizon has the horizon's colour exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FogParams {
    /// Extinction at sea level, 1/m per channel.
    pub extinction: Vec3,
    /// Height in metres over which it falls to 1/e. One exponential replaces those of air and aerosol. It is fitted so
    /// that the depth of the lowest 1,500 m is exact in green; up to 2,500 m the error stays below 5 %.
    pub scale_height_m: f32,
}

/// Data for drawing the night, besides the sky texture, which already contains its diffuse light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NightTerms {
    /// The moon's disc, when there is a moon above the horizon.
    pub moon: Option<MoonDisc>,
    /// The stars.
    pub stars: StarField,
    /// Rotation from the world into the stars' frame.
    pub star_rotation: Mat3,
}

/// The moon's disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MoonDisc {
    /// Unit vector to its centre.
    pub direction: Vec3,
    /// Angular radius in radians.
    pub angular_radius: f32,
    /// Radiance of the lit part as seen through the air, nits per channel.
    pub radiance: Vec3,
    /// Angle sun-moon-earth in radians: 0 full, pi new.
    pub phase_angle: f32,
}

/// The light of one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct LightState {
    /// Unit vector to the sun's centre.
    pub sun_direction: Vec3,
    /// Illuminance of the sun's disc at the observer on a surface facing it, lux per channel.
    pub sun_illuminance: Vec3,
    /// Which body casts the shadows.
    pub key: KeyLight,
    /// Unit vector to the body that casts the shadows.
    pub key_direction: Vec3,
    /// Its illuminance at the observer on a surface facing it, lux per channel. It is zero where the key light
    /// changes from one body to the other, so it is continuous.
    pub key_illuminance: Vec3,
    /// Its angular radius in radians (for soft shadows).
    pub key_angular_radius: f32,
    /// Radiance of the surroundings without the key light's disc, in spherical harmonics ([`super::sh`]), nits: sky
    /// above, the ground's reflection below. Windowed so that no irradiance is negative.
    pub sky_sh: Sh9Rgb,
    /// Illuminance of the sky (without disc) on the horizontal ground, lux per channel, integrated from the sky
    /// texture.
    pub sky_illuminance: Vec3,
    /// Radiance of the level ground under sky and key light, nits per channel.
    pub ground_radiance: Vec3,
    /// The sky texture: sunlit air, moonlit air, night sky; without discs and single stars.
    pub sky_view: SkyView,
    /// The illuminance that exposure adapts to, lux; it depends only on the sun's elevation and on the moon.
    pub adaptation_illuminance: f32,
    /// Exposure value at ISO 100.
    pub ev100: f32,
    /// Factor from nits to display values that corresponds to `ev100`.
    pub exposure: f32,
    /// The exposure curve that `ev100` is of.
    pub exposure_settings: ExposureSettings,
    /// Blue shift of night vision.
    pub scotopic: ScotopicTint,
    /// Air between camera and scene.
    pub fog: FogParams,
    /// The night's discs and points.
    pub night: NightTerms,
}

impl LightState {
    /// Computes everything: about 25 ms of CPU time, 31 ms with moonlit air, distributed over all cores. Deterministic.
    ///
    /// # Errors
    /// [`LightError::OutOfRange`] for settings outside their ranges.
    pub fn new(
        atmosphere: &Atmosphere,
        sun: SunPosition,
        moon: Option<Moon>,
        settings: &LightSettings,
    ) -> Result<Self, LightError> {
        let height = settings.observer_height_m;
        check_range("observer height", height, "m", -500.0, 9000.0, "give metres above the sea")?;
        settings.exposure.validate()?;
        let params = atmosphere.params();
        let sun_direction = sun.direction();
        let sun_illuminance = atmosphere.sun_illuminance(sun_direction, height);

        let mut sky_view = atmosphere.sky_view(sun_direction, params.solar_illuminance, height);
        let moon_weight = 1.0 - smoothstep(0.0, MOON_OUT, sun_direction.y);
        let moonlit = moon
            .filter(|m| moon_weight > 0.0 && m.direction.y > -0.3)
            .map(|m| atmosphere.sky_view_with_steps(m.direction, m.illuminance * moon_weight, height, MOON_STEPS));
        // The night sky does not depend on the azimuth: one value a row.
        let rows: Vec<Vec3> = (0..SkyView::HEIGHT)
            .map(|row| {
                let (y, x) = SkyView::row_elevation(row as f32).sin_cos();
                settings.night.radiance(atmosphere, Vec3::new(x, y, 0.0), height)
            })
            .collect();
        for (texels, night) in sky_view.texels.chunks_mut(SkyView::WIDTH).zip(&rows) {
            for texel in texels {
                *texel = (Vec3::from(*texel) + *night).to_array();
            }
        }
        if let Some(moonlit) = moonlit {
            sky_view.add(|direction| moonlit.sample(direction));
        }

        // The moon takes over once the sun's disc has set; its light fades in over three degrees, so that it starts
        // from zero.
        let set = -(SUN_ANGULAR_RADIUS as f32);
        let risen = 1.0 - smoothstep((-3f32).to_radians().sin() + set, set, sun_direction.y);
        let (key, key_direction, key_illuminance, key_angular_radius) = match moon {
            Some(m) if sun_direction.y <= set => {
                let seen = m.illuminance * atmosphere.disc_transmittance(m.direction, height) * risen;
                (KeyLight::Moon, m.direction, seen, MOON_ANGULAR_RADIUS as f32)
            }
            _ => (KeyLight::Sun, sun_direction, sun_illuminance, SUN_ANGULAR_RADIUS as f32),
        };

        let sky_illuminance = sky_illuminance(&sky_view);
        let key_horizontal = key_illuminance * key_direction.y.max(0.0);
        let ground_radiance = ground_radiance(params.ground_albedo, sky_illuminance + key_horizontal);
        let mut sky_sh = [Vec3::ZERO; 9];
        sky_sh.copy_from_slice(&Surroundings { sky: &sky_view, ground: ground_radiance }.project(3));
        sh::window_nonnegative(&mut sky_sh);

        let adaptation_illuminance = adaptation(atmosphere, sun_direction, moon.as_ref(), &settings.night);
        let ev100 = settings.exposure.ev100(adaptation_illuminance);
        Ok(Self {
            sun_direction,
            sun_illuminance,
            key,
            key_direction,
            key_illuminance,
            key_angular_radius,
            sky_sh,
            sky_illuminance,
            ground_radiance,
            adaptation_illuminance,
            ev100,
            exposure: exposure_from_ev100(ev100),
            exposure_settings: settings.exposure,
            scotopic: ScotopicTint::for_illuminance(adaptation_illuminance, settings.exposure.scotopic_strength),
            fog: fog(atmosphere),
            night: NightTerms {
                moon: moon.filter(|m| m.direction.y > -(MOON_ANGULAR_RADIUS as f32)).map(|m| MoonDisc {
                    direction: m.direction,
                    angular_radius: MOON_ANGULAR_RADIUS as f32,
                    radiance: m.disc_radiance() * atmosphere.transmittance(m.direction, height),
                    phase_angle: m.phase_angle,
                }),
                stars: settings.stars,
                star_rotation: settings.star_rotation,
            },
            sky_view,
        })
    }

    /// EV100 for a camera in a stand that lets the fraction `share` of the light on open ground through
    /// ([`StandLight::share`](super::StandLight::share)).
    pub fn ev100_in_stand(&self, share: f32) -> f32 {
        self.exposure_settings.ev100_in_stand(self.adaptation_illuminance, share)
    }

    /// What lights a plant beside the key light's disc, in full: to be looked up, or projected at any band.
    pub fn surroundings(&self) -> Surroundings<'_> {
        Surroundings { sky: &self.sky_view, ground: self.ground_radiance }
    }

    /// The colour in nits, per channel, that fog has in the direction `view`: the sky's, and below the horizon the
    /// horizon's.
    pub fn fog_radiance(&self, view: Vec3) -> Vec3 {
        self.sky_view.sample(Vec3::new(view.x, view.y.max(0.0), view.z))
    }

    /// Illuminance of everything on the horizontal ground, lux per channel.
    pub fn horizontal_illuminance(&self) -> Vec3 {
        self.sky_illuminance + self.key_illuminance * self.key_direction.y.max(0.0)
    }
}

/// The horizontal illuminance, lux, that exposure adapts to. The real moon counts with what it gives; the moon
/// opposite the sun, which climbs while the sun sinks, always as at 25 degrees, so that exposure still only falls as
/// the sun sinks.
fn adaptation(atmosphere: &Atmosphere, sun: Vec3, moon: Option<&Moon>, night: &NightSky) -> f32 {
    let moonlight = match moon {
        Some(m) if m.opposite_sun => {
            let low = direction_from(0.0, 25f64.to_radians());
            luminance(m.illuminance * atmosphere.disc_transmittance(low, 0.0)) * low.y
        }
        Some(m) => luminance(m.illuminance * atmosphere.disc_transmittance(m.direction, 0.0)) * m.direction.y.max(0.0),
        None => 0.0,
    };
    luminance(atmosphere.horizontal_illuminance(sun) + night.horizontal_illuminance(atmosphere)) + moonlight
}

fn fog(atmosphere: &Atmosphere) -> FogParams {
    const FITTED_M: f32 = 1_500.0;
    let p = atmosphere.params();
    let depth = |extinction: f32, h: f32| extinction * h * (1.0 - (-FITTED_M / h).exp());
    let (air, aerosol) = (p.rayleigh_scattering.y, p.mie_scattering.y + p.mie_absorption.y);
    let want = depth(air, p.rayleigh_scale_height_m as f32) + depth(aerosol, p.mie_scale_height_m as f32);
    // The depth grows with the scale height, which lies between those of the two.
    let (mut low, mut high) = (100.0f32, 50_000.0f32);
    for _ in 0..40 {
        let mid = 0.5 * (low + high);
        if depth(air + aerosol, mid) < want {
            low = mid;
        } else {
            high = mid;
        }
    }
    FogParams { extinction: atmosphere.extinction(0.0), scale_height_m: 0.5 * (low + high) }
}
