//! Radiance of the sky: one model, evaluated on the CPU, for the shader, the light and the fog.
//!
//! S. Hillaire 2020, "A Scalable and Production Ready Sky and Atmosphere Rendering Technique", Computer Graphics Forum
//! 39(4). Single scattering is integrated along the view ray in spherical geometry. All higher orders come from a table
//! that assumes isotropic scattering, and that the neighbourhood of a point is lit as the point itself (section 5.5).
//!
//! It differs from the paper, because it runs only when the sun has moved, on the CPU:
//! - The multiple-scattering table has 64 x 32 texels, dense at the horizon, computed from 256 directions per texel.
//!   This table and the transmittance table interpolate logarithms. The paper's linear tables of 32 x 32 blur twilight
//!   over 4 degrees.
//! - The sun is a disc for the shadow of the Earth, too, so that radiance is continuous everywhere.
//! - Below the horizon, the ground, lit by sun and sky, shows through a haze that starts with the radiance of the
//!   horizon.
//!
//! # Known errors
//! The assumption of isotropic and local scattering is weak where illumination changes over a mean free path, in
//! twilight. Compared with published horizontal illuminances of clear skies (the tests of this room), the model is
//! within 6 % for a sun above 30 degrees, and too bright by 20 % at 10 degrees, 30 % at 0, 50 % at -6 and 15 % at -12.
//! Below -15 degrees nearly all light is that of the night sky. Rays in the air are not refracted; the position of the
//! sun includes refraction. Polarisation is ignored (up to 10 % of Rayleigh radiance).

mod ground;
mod multiple;
mod params;
mod sky_view;
mod transmittance;

use std::f32::consts::PI;

use glam::Vec3;

use self::ground::GroundTable;
use self::multiple::MultipleScatteringLut;
pub use self::params::AtmosphereParams;
pub use self::sky_view::SkyView;
use self::transmittance::{Level, TransmittanceLut};
use super::error::LightError;
use super::sun::{SUN_ANGULAR_RADIUS, disc_fraction};

/// Steps along a view ray, quadratically spaced. The error of a clear sky's radiance against 800 steps is below 0.5 %
/// by day and below 7 % at dusk (worst with the sun 8 degrees below the horizon, where few steps straddle the Earth's
/// shadow). Half as many steps take half the time and have about three times the error.
const VIEW_STEPS: usize = 40;

/// Angle below the horizon, radians, over which the haze decreases to 1/e.
const HAZE_ANGLE: f32 = 0.035;

/// Lowest height of an observer, metres. The observer is clamped between it and the top of the atmosphere.
const LOWEST_OBSERVER_M: f64 = 1.0;

/// An atmosphere with its tables. Building it takes about a quarter of a second; evaluating it needs no state.
#[derive(Debug, Clone)]
pub struct Atmosphere {
    params: AtmosphereParams,
    transmittance: TransmittanceLut,
    multiple: MultipleScatteringLut,
    ground: GroundTable,
}

/// A segment of a view ray: everything that does not depend on the direction of the light.
#[derive(Debug, Clone, Copy)]
struct Segment {
    /// Distance from the observer to the segment's middle, metres.
    t: f64,
    /// Distance from the planet's centre.
    level: Level,
    /// Rayleigh and aerosol scattering of the segment times the transmittance to the observer.
    rayleigh: Vec3,
    mie: Vec3,
}

impl Atmosphere {
    /// Builds the tables.
    ///
    /// # Errors
    /// [`LightError::OutOfRange`] for parameters outside their ranges.
    pub fn new(params: AtmosphereParams) -> Result<Self, LightError> {
        params.validate()?;
        let transmittance = TransmittanceLut::new(&params);
        let mut atmosphere =
            Self { params, transmittance, multiple: MultipleScatteringLut::dark(), ground: GroundTable::dark() };
        atmosphere.multiple = MultipleScatteringLut::new(&atmosphere);
        atmosphere.ground = GroundTable::new(&atmosphere);
        Ok(atmosphere)
    }

    /// The parameters from which it was built.
    pub fn params(&self) -> &AtmosphereParams {
        &self.params
    }

    /// Radiance in nits that arrives from the unit direction `view` at an observer `observer_height_m` above the sea
    /// (clamped between 1 m and the top of the atmosphere), with the sun in the unit direction `sun`, without the sun's
    /// disc. Never negative, never NaN. A direction that is not finite counts as +Y.
    pub fn radiance(&self, view: Vec3, sun: Vec3, observer_height_m: f64) -> Vec3 {
        self.radiance_with_steps(view, sun, observer_height_m, VIEW_STEPS)
    }

    /// [`Atmosphere::radiance`] with another number of steps along the ray, 1 to 10,000, to measure the error of the
    /// default (40).
    pub fn radiance_with_steps(&self, view: Vec3, sun: Vec3, observer_height_m: f64, steps: usize) -> Vec3 {
        let (view, sun) = (unit(view), unit(sun));
        let steps = steps.clamp(1, 10_000);
        let r = self.observer_radius(observer_height_m);
        let horizontal = Vec3::new(view.x, 0.0, view.z).normalize_or(Vec3::X);
        let upper = if view.y >= 0.0 { view } else { horizontal };
        let (segments, _) = self.march_sky(r, f64::from(upper.y), steps);
        let sky = self.in_scatter(&segments, r, upper, sun) * self.params.solar_illuminance;
        if view.y >= 0.0 {
            return sky;
        }
        let (segments, through) = self.march_ground(r, f64::from(view.y), steps);
        let ground = self.ground_seen(&segments, through, r, view, sun) * self.params.solar_illuminance;
        sky.lerp(ground, haze_weight(view.y.clamp(-1.0, 1.0).asin()))
    }

    /// Illuminance in lux, per channel, of the sun's disc on a surface at the observer that faces it: above-air
    /// illuminance times transmittance times the fraction of the disc above the horizontal. The transmittance is that
    /// of the middle of the visible part, so that the illuminance decreases smoothly to zero while the disc sets.
    pub fn sun_illuminance(&self, sun: Vec3, observer_height_m: f64) -> Vec3 {
        self.params.solar_illuminance * self.disc_transmittance(sun, observer_height_m)
    }

    /// Transmittance, 0 to 1 per channel, of air and horizon for the light of a disc as large as the sun (the moon's
    /// size differs by 3 %) in the unit direction `light`.
    pub fn disc_transmittance(&self, light: Vec3, observer_height_m: f64) -> Vec3 {
        let elevation = f64::from(unit(light).y).clamp(-1.0, 1.0).asin();
        let fraction = disc_fraction(elevation, SUN_ANGULAR_RADIUS);
        if fraction <= 0.0 {
            return Vec3::ZERO;
        }
        let middle = if elevation < SUN_ANGULAR_RADIUS {
            0.5 * ((elevation - SUN_ANGULAR_RADIUS).max(0.0) + elevation + SUN_ANGULAR_RADIUS)
        } else {
            elevation
        };
        self.transmittance.sample(&self.observer_level(observer_height_m), middle.sin()) * fraction as f32
    }

    /// Transmittance, 0 to 1 per channel, from the observer to space along the unit direction `view`. A direction below
    /// the horizontal has that of the horizontal.
    pub fn transmittance(&self, view: Vec3, observer_height_m: f64) -> Vec3 {
        self.transmittance.sample(&self.observer_level(observer_height_m), f64::from(unit(view).y).max(0.0))
    }

    /// Illuminance in lux, per channel, of horizontal ground at sea level by the sky alone (without the disc), from a
    /// table over the sun's elevation. Never negative; continuous.
    pub fn diffuse_illuminance(&self, sun: Vec3) -> Vec3 {
        self.ground.sample(f64::from(unit(sun).y)) * self.params.solar_illuminance
    }

    /// Illuminance in lux, per channel, of horizontal ground at sea level by sun and sky.
    pub fn horizontal_illuminance(&self, sun: Vec3) -> Vec3 {
        self.sun_illuminance(sun, 0.0) * unit(sun).y.max(0.0) + self.diffuse_illuminance(sun)
    }

    /// Extinction of the air at a height above the sea, 1/m per channel.
    pub fn extinction(&self, height_m: f64) -> Vec3 {
        self.params.medium(if height_m.is_finite() { height_m } else { 0.0 }).extinction
    }

    fn observer_radius(&self, height_m: f64) -> f64 {
        let h = if height_m.is_finite() { height_m } else { 0.0 };
        self.params.ground_radius_m + h.clamp(LOWEST_OBSERVER_M, self.params.top_height_m - 1.0)
    }

    fn observer_level(&self, height_m: f64) -> Level {
        self.transmittance.level(self.observer_radius(height_m))
    }

    /// Fraction of the sun's light, 0 to 1 per channel, that reaches a point where the cosine of the sun's zenith angle
    /// is `mu`. The edge of the Earth's shadow is as wide as the disc.
    fn sunlight(&self, level: &Level, mu: f64) -> Vec3 {
        let sin_horizon = level.sin_horizon;
        let mu_horizon = -(1.0 - sin_horizon * sin_horizon).max(0.0).sqrt();
        let x = 0.5 + 0.5 * (mu - mu_horizon) / (sin_horizon * SUN_ANGULAR_RADIUS);
        if x <= 0.0 {
            return Vec3::ZERO;
        }
        let x = x.min(1.0);
        self.transmittance.sample(level, mu) * (x * x * (3.0 - 2.0 * x)) as f32
    }

    /// Segments from radius `r` with zenith cosine `mu >= 0` to the top, and their total transmittance.
    fn march_sky(&self, r: f64, mu: f64, steps: usize) -> (Vec<Segment>, Vec3) {
        let top = self.params.top_radius();
        let length = -r * mu + (r * r * (mu * mu - 1.0) + top * top).max(0.0).sqrt();
        self.march(r, mu, length, steps)
    }

    /// Segments from radius `r` with zenith cosine `mu < 0` to the ground. A ray that misses the curved ground ends at
    /// its nearest point to it, as on a plain.
    fn march_ground(&self, r: f64, mu: f64, steps: usize) -> (Vec<Segment>, Vec3) {
        let ground = self.params.ground_radius_m;
        let length = -r * mu - (r * r * (mu * mu - 1.0) + ground * ground).max(0.0).sqrt();
        self.march(r, mu, length, steps)
    }

    fn march(&self, r: f64, mu: f64, length: f64, steps: usize) -> (Vec<Segment>, Vec3) {
        let mut transmittance = Vec3::ONE;
        let mut segments = Vec::with_capacity(steps);
        for i in 0..steps {
            let at = |k: f64| length * (k / steps as f64).powi(2);
            let (near, far) = (at(i as f64), at((i + 1) as f64));
            let t = at(i as f64 + 0.5);
            let here = (r * r + t * t + 2.0 * r * t * mu).max(0.0).sqrt();
            let medium = self.params.medium(here - self.params.ground_radius_m);
            let through = (-medium.extinction * (far - near) as f32).exp();
            // Integral of the transmittance over the segment, exact for constant extinction (Hillaire 2015).
            let weight = Vec3::select(
                medium.extinction.cmpgt(Vec3::splat(1e-15)),
                (Vec3::ONE - through) / medium.extinction.max(Vec3::splat(1e-15)),
                Vec3::splat((far - near) as f32),
            );
            let weight = transmittance * weight;
            segments.push(Segment {
                t,
                level: self.transmittance.level(here),
                rayleigh: medium.rayleigh * weight,
                mie: medium.mie * weight,
            });
            transmittance *= through;
        }
        (segments, transmittance)
    }

    /// Radiance, per unit of above-air illuminance, that the segments of the ray from radius `r` towards `view` scatter
    /// to the observer.
    fn in_scatter(&self, segments: &[Segment], r: f64, view: Vec3, sun: Vec3) -> Vec3 {
        let cosine = f64::from(view.dot(sun)).clamp(-1.0, 1.0);
        let rayleigh_phase = rayleigh_phase(cosine as f32);
        let mie_phase = cornette_shanks_phase(cosine as f32, self.params.mie_anisotropy);
        let sun_y = f64::from(sun.y);
        let mut sum = Vec3::ZERO;
        for s in segments {
            let mu = ((r * sun_y + s.t * cosine) / s.level.r).clamp(-1.0, 1.0);
            sum += self.sunlight(&s.level, mu) * (s.rayleigh * rayleigh_phase + s.mie * mie_phase)
                + self.multiple.sample(&s.level, mu) * (s.rayleigh + s.mie);
        }
        sum
    }

    /// Radiance, per unit of above-air illuminance, of the lit ground behind `segments`, whose transmittance is
    /// `through`.
    fn ground_seen(&self, segments: &[Segment], through: Vec3, r: f64, view: Vec3, sun: Vec3) -> Vec3 {
        let direct = self.disc_transmittance(sun, 0.0) * sun.y.max(0.0);
        let ground = self.params.ground_albedo / PI * (direct + self.ground.sample(f64::from(sun.y)));
        self.in_scatter(segments, r, view, sun) + through * ground
    }
}

/// Weight of the ground, 0 to 1, in the radiance at `elevation < 0` radians. The rest is the haze of the horizon.
pub(crate) fn haze_weight(elevation: f32) -> f32 {
    1.0 - (elevation.min(0.0) / HAZE_ANGLE).exp()
}

/// The unit vector along `v`, or +Y if there is none.
pub(crate) fn unit(v: Vec3) -> Vec3 {
    v.normalize_or(Vec3::Y)
}

/// Rayleigh's phase function, 1/sr, at the cosine of the scattering angle (Hillaire 2020, section 4).
fn rayleigh_phase(cosine: f32) -> f32 {
    3.0 / (16.0 * PI) * (1.0 + cosine * cosine)
}

/// The phase function of Cornette & Shanks 1992 for aerosol of asymmetry `g`, 1/sr.
fn cornette_shanks_phase(cosine: f32, g: f32) -> f32 {
    let base = (1.0 + g * g - 2.0 * g * cosine).max(1e-6);
    3.0 / (8.0 * PI) * (1.0 - g * g) * (1.0 + cosine * cosine) / ((2.0 + g * g) * base * base.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::quadrature::gauss_legendre;

    #[test]
    fn phase_functions_are_normalised() {
        let rule = gauss_legendre(64);
        for g in [0.0, 0.5, 0.8] {
            let sum: f64 = rule.iter().map(|(x, w)| w * f64::from(cornette_shanks_phase(*x as f32, g))).sum();
            assert!((sum * std::f64::consts::TAU - 1.0).abs() < 1e-4, "g {g}: {sum}");
        }
        let sum: f64 = rule.iter().map(|(x, w)| w * f64::from(rayleigh_phase(*x as f32))).sum();
        assert!((sum * std::f64::consts::TAU - 1.0).abs() < 1e-5);
    }
}
