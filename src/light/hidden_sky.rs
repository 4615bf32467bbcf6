//! What light of the sky relief hides.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Vec3, Vec4};

use super::LightState;
use crate::math::color::luminance;

/// Bands of elevation, and parts of a direction's sector, in which the sky is summed up.
const BANDS: usize = 45;
const PARTS: usize = 4;

/// The light of the sky that is hidden at one place. What hides it has the radiance of level ground, or that of the sky where this is less.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HiddenLight {
    /// Its mean radiance over all directions, per channel, over [`HiddenSky::level_radiance`]. At least 0.
    pub radiance: Vec3,
    /// Mean direction of its luminance: the closer to one direction it comes from, the closer to 1 is its length.
    pub direction: Vec3,
    /// The fraction of the irradiance on level ground that is left, 0..=1.
    pub level_fraction: f32,
}

/// Sums of the sky's light by direction and elevation.
#[derive(Clone, Debug)]
pub struct HiddenSky {
    /// For each direction: what relief takes away up to each band's lower end, and up to the zenith.
    hidden: Vec<[Sums; BANDS + 1]>,
    level_radiance: f32,
}

/// Integrals over a part of the sky: of the radiance, and of the luminance times the direction.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    radiance: Vec3,
    directed: Vec3,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.radiance += other.radiance;
        self.directed += other.directed;
    }

    fn lerp(&self, other: &Self, t: f32) -> Self {
        Self { radiance: self.radiance.lerp(other.radiance, t), directed: self.directed.lerp(other.directed, t) }
    }
}

impl HiddenSky {
    /// The sums of `light` for `directions`, evenly spaced, the first of which is north, the second east of it.
    pub fn new(light: &LightState, directions: usize) -> Self {
        let surroundings = light.surroundings();
        let directions = directions.max(1);
        let (height, width) = (FRAC_PI_2 / BANDS as f32, TAU / (directions * PARTS) as f32);
        let hidden = (0..directions)
            .map(|direction| {
                let mut sums = [Sums::default(); BANDS + 1];
                for band in 0..BANDS {
                    let (sin, cos) = ((band as f32 + 0.5) * height).sin_cos();
                    let solid_angle = cos * height * width;
                    sums[band + 1] = sums[band];
                    for part in 0..PARTS {
                        let within = (part as f32 + 0.5) / PARTS as f32 - 0.5;
                        let (east, north) = (TAU * (direction as f32 + within) / directions as f32).sin_cos();
                        let towards = Vec3::new(cos * east, sin, -cos * north);
                        let lost = (surroundings.radiance(towards) - surroundings.ground).max(Vec3::ZERO) * solid_angle;
                        sums[band + 1].add(&Sums { radiance: lost, directed: towards * luminance(lost) });
                    }
                }
                sums
            })
            .collect();
        Self { hidden, level_radiance: luminance(light.sky_illuminance) / PI }
    }

    /// Luminance of white, level ground in the light of the whole sky, nits: the unit of [`HiddenLight::radiance`].
    pub fn level_radiance(&self) -> f32 {
        self.level_radiance
    }

    /// What is hidden behind a horizon of these tangents, one a direction. Everything is finite; nothing is hidden of a black sky.
    pub fn behind(&self, horizon: &[f32]) -> HiddenLight {
        let mut sums = Sums::default();
        for (by_band, tangent) in self.hidden.iter().zip(horizon) {
            sums.add(&hidden_to(by_band, tangent.atan()));
        }
        let lost = luminance(sums.radiance);
        if !(lost > 0.0 && self.level_radiance > 0.0) {
            return HiddenLight { level_fraction: 1.0, ..HiddenLight::default() };
        }
        HiddenLight {
            radiance: sums.radiance / (4.0 * PI * self.level_radiance),
            direction: sums.directed / lost,
            level_fraction: (1.0 - sums.directed.y / (PI * self.level_radiance)).clamp(0.0, 1.0),
        }
    }
}

impl HiddenLight {
    /// Two texels: the radiance with the fraction that is left on level ground, and the direction with the [`slope_factor`](super::slope_factor) of
    /// the place.
    pub fn texels(&self, slope_factor: f32) -> [Vec4; 2] {
        [self.radiance.extend(self.level_fraction), self.direction.extend(slope_factor)]
    }

    /// The irradiance over pi that is hidden from a surface with a unit normal, over [`HiddenSky::level_radiance`]: three bands of the
    /// spherical harmonics of a lobe of light around [`direction`](Self::direction). The twin of `hidden_from` in `stand.wgsl`.
    pub fn from_normal(&self, normal: Vec3) -> Vec3 {
        let along = normal.dot(self.direction);
        let length = self.direction.length();
        let lobe = 1.0 + 2.0 * along + 0.625 * length * (3.0 * along * along - length * length);
        self.radiance * lobe.max(0.0)
    }
}

/// What is hidden up to an elevation in radians.
fn hidden_to(sums: &[Sums; BANDS + 1], elevation: f32) -> Sums {
    let at = (elevation / FRAC_PI_2).clamp(0.0, 1.0) * BANDS as f32;
    let band = (at as usize).min(BANDS - 1);
    sums[band].lerp(&sums[band + 1], at - band as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        light::{Atmosphere, AtmosphereParams, LightSettings, SunPosition},
        math::SphereQuadrature,
    };

    const DIRECTIONS: usize = 16;

    fn light(elevation: f64) -> LightState {
        let atmosphere = Atmosphere::new(AtmosphereParams::default()).unwrap();
        LightState::new(
            &atmosphere,
            SunPosition::from_degrees(90.0, elevation).unwrap(),
            None,
            &LightSettings::default(),
        )
        .unwrap()
    }

    /// A ridge around a direction.
    fn ridge(around: usize, tangent: f32) -> [f32; DIRECTIONS] {
        let mut horizon = [0.0; DIRECTIONS];
        (0..5).for_each(|near| horizon[(around + DIRECTIONS - 2 + near) % DIRECTIONS] = tangent);
        horizon
    }

    #[test]
    fn nothing_is_hidden_in_the_open_and_all_but_the_ground_s_light_in_a_pit() {
        let light = light(-2.0);
        let sky = HiddenSky::new(&light, DIRECTIONS);
        let open = HiddenLight { level_fraction: 1.0, ..HiddenLight::default() };
        assert_eq!(sky.behind(&[0.0; DIRECTIONS]), open);
        let pit = sky.behind(&[1e9; DIRECTIONS]);
        let left = luminance(light.ground_radiance) / sky.level_radiance();
        assert!((pit.level_fraction / left - 1.0).abs() < 0.02, "{pit:?} and {left}");
        let level = luminance(pit.from_normal(Vec3::Y)) * sky.level_radiance();
        let whole = luminance(light.sky_illuminance / PI - light.ground_radiance);
        // One lobe stands for the whole sky here.
        assert!((level / whole - 1.0).abs() < 0.2, "{level} and {whole}");
    }

    #[test]
    fn what_is_hidden_from_a_surface_is_close_to_its_integral() {
        let light = light(4.0);
        let sky = HiddenSky::new(&light, DIRECTIONS);
        let rule = SphereQuadrature::new(90, 180);
        for (around, tangent) in [(4, 0.3), (4, 0.8), (12, 0.5), (0, 1.2)] {
            let horizon = ridge(around, tangent);
            let hidden = sky.behind(&horizon);
            let surroundings = light.surroundings();
            let integral = |normal: Vec3| -> f32 {
                let lost = rule.upper().iter().filter_map(|&(towards, solid_angle)| {
                    let sector = (towards.x.atan2(-towards.z) / TAU * DIRECTIONS as f32).round() as i32;
                    let tangent = horizon[sector.rem_euclid(DIRECTIONS as i32) as usize];
                    let below = towards.y < tangent * towards.x.hypot(towards.z);
                    let lost = (surroundings.radiance(towards) - surroundings.ground).max(Vec3::ZERO);
                    below.then_some(luminance(lost) * towards.dot(normal).max(0.0) * solid_angle)
                });
                lost.sum::<f32>() / PI
            };
            let facing = Vec3::from(match around {
                4 => [1.0, 0.0, 0.0],
                12 => [-1.0, 0.0, 0.0],
                _ => [0.0, 0.0, -1.0],
            });
            let most = integral(facing);
            for normal in [facing, Vec3::Y, (facing + Vec3::Y).normalize(), -facing, facing.cross(Vec3::Y)] {
                let found = luminance(hidden.from_normal(normal)) * sky.level_radiance();
                assert!((found - integral(normal)).abs() < 0.12 * most, "{normal}: {found} and {}", integral(normal));
            }
        }
    }

    #[test]
    fn a_ridge_towards_a_low_sun_hides_more_than_one_behind_the_viewer() {
        let sky = HiddenSky::new(&light(8.0), DIRECTIONS);
        let [east, west] = [4, 12].map(|around| sky.behind(&ridge(around, 0.5)));
        assert!(
            east.radiance.x > 1.3 * west.radiance.x && east.level_fraction < west.level_fraction,
            "{east:?}, {west:?}"
        );
        assert!(east.direction.x > 0.7 && west.direction.x < -0.7 && east.direction.length() < 1.0);
    }

    #[test]
    fn nothing_is_undefined() {
        for elevation in [-30.0, -3.0, 0.0, 90.0] {
            let sky = HiddenSky::new(&light(elevation), DIRECTIONS);
            for tangent in [0.0, 1e-20, 1.0, 1e30, f32::INFINITY] {
                let hidden = sky.behind(&[tangent; DIRECTIONS]);
                assert!(hidden.radiance.is_finite() && hidden.radiance.min_element() >= 0.0, "{hidden:?}");
                assert!(
                    hidden.direction.length() <= 1.001 && (0.0..=1.0).contains(&hidden.level_fraction),
                    "{hidden:?}"
                );
            }
        }
    }
}
