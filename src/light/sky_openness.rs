//! How much of the sky's light arrives where relief hides a part of the sky.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::Vec3;

use super::LightState;

/// Bands of elevation, and parts of a direction's sector, in which the sky is summed up.
const BANDS: usize = 45;
const PARTS: usize = 4;

/// Sums of the sky's light by direction and elevation, weighted as level ground does, or a closed canopy, whose crowns hide the low sky from
/// each other. The relief in front of it has the radiance of level ground.
#[derive(Clone, Debug)]
pub struct SkyOpenness {
    /// For each direction: what relief takes away up to each band's lower end, and up to the zenith.
    hidden: Vec<[Vec3; BANDS + 1]>,
    total: Vec3,
}

impl SkyOpenness {
    /// The sums of `light` for `directions`, evenly spaced, the first of which is north, the second east of it.
    pub fn new(light: &LightState, directions: usize) -> Self {
        let surroundings = light.surroundings();
        let directions = directions.max(1);
        let (height, width) = (FRAC_PI_2 / BANDS as f32, TAU / (directions * PARTS) as f32);
        let mut total = Vec3::ZERO;
        let hidden = (0..directions)
            .map(|direction| {
                let mut sums = [Vec3::ZERO; BANDS + 1];
                for band in 0..BANDS {
                    let (sin, cos) = ((band as f32 + 0.5) * height).sin_cos();
                    let weight = sin * cos * height * width;
                    sums[band + 1] = sums[band];
                    for part in 0..PARTS {
                        let within = (part as f32 + 0.5) / PARTS as f32 - 0.5;
                        let (east, north) = (TAU * (direction as f32 + within) / directions as f32).sin_cos();
                        let sky = surroundings.radiance(Vec3::new(cos * east, sin, -cos * north));
                        total += sky * weight;
                        sums[band + 1] += (sky - surroundings.ground) * weight;
                    }
                }
                sums
            })
            .collect();
        Self { hidden, total }
    }

    /// The fraction of the sky's light, per channel, that arrives behind a horizon of these tangents, one a direction; 0..=1. 1 under a black sky.
    pub fn behind(&self, horizon: &[f32]) -> Vec3 {
        let lost: Vec3 = self.hidden.iter().zip(horizon).map(|(sums, tangent)| hidden_to(sums, tangent.atan())).sum();
        let open = |lost: f32, total: f32| if total > 0.0 { (1.0 - lost / total).clamp(0.0, 1.0) } else { 1.0 };
        Vec3::from_array(std::array::from_fn(|channel| open(lost[channel], self.total[channel])))
    }
}

/// What is hidden up to an elevation in radians.
fn hidden_to(sums: &[Vec3; BANDS + 1], elevation: f32) -> Vec3 {
    let at = (elevation / FRAC_PI_2).clamp(0.0, 1.0) * BANDS as f32;
    let band = (at as usize).min(BANDS - 1);
    sums[band].lerp(sums[band + 1], at - band as f32)
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;
    use crate::light::{Atmosphere, AtmosphereParams, LightSettings, SunPosition};

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

    #[test]
    fn an_open_place_has_all_light_and_a_pit_that_of_the_ground() {
        let light = light(40.0);
        let sky = SkyOpenness::new(&light, 16);
        assert_eq!(sky.behind(&[0.0; 16]), Vec3::ONE);
        let pit = sky.behind(&[1e9; 16]);
        let even = light.ground_radiance * PI;
        for channel in 0..3 {
            assert!((pit[channel] * sky.total[channel] / even[channel] - 1.0).abs() < 0.01, "{pit}");
        }
    }

    #[test]
    fn a_ridge_towards_a_low_sun_hides_more_than_one_behind_the_viewer() {
        let sky = SkyOpenness::new(&light(8.0), 16);
        let ridge = |direction: usize| {
            let mut horizon = [0.0; 16];
            (0..5).for_each(|near| horizon[(direction + 14 + near) % 16] = 0.5);
            sky.behind(&horizon)
        };
        let (east, west) = (ridge(4), ridge(12));
        assert!(east.x + 0.05 < west.x && west.x < 1.0, "{east} and {west}");
    }

    #[test]
    fn nothing_is_undefined() {
        for elevation in [-30.0, -3.0, 0.0, 90.0] {
            let sky = SkyOpenness::new(&light(elevation), 16);
            for tangent in [0.0, 1e-20, 1.0, 1e30, f32::INFINITY] {
                let open = sky.behind(&[tangent; 16]);
                assert!(open.is_finite() && open.min_element() >= 0.0 && open.max_element() <= 1.0, "{open}");
            }
        }
    }
}
