//! What vertices truly send out: paths from each vertex, with the same number of bounces as the bake.

use canopy::bake::lighting::transfer::{Projection, direction_set};
use canopy::light::LightState;
use canopy::math::hash::mix64;
use canopy::math::luminance;
use canopy::plant::PartKind;
use canopy::trace::{PlantTracer, Ray, SurfacePoint};
use glam::Vec3;

use crate::vertices::Vertex;

/// Paths a vertex.
pub const PATHS: u32 = 16_384;

/// One path in so many asks at every surface whether the suns are seen.
const SUNS_EVERY: usize = 4;

/// Numbers of bands.
pub const BANDS: [usize; 5] = [2, 3, 4, 5, 6];

/// The two ways to coefficients.
pub const PROJECTIONS: [Projection; 2] = [Projection::Quadrature, Projection::Fit];

/// What one vertex truly gets.
pub struct Truth {
    /// Irradiance over pi of front and back under each sky.
    pub sky: Vec<[Vec3; 2]>,
    /// The same under each sun's disc, light from leaf to leaf included.
    pub sun: Vec<[Vec3; 2]>,
    /// Whether the vertex sees each sun.
    pub sees_sun: Vec<bool>,
    /// The transfer in colour, free of the bake's noise: by projection and place in [`BANDS`], front and back.
    pub transfer: [[[Vec<f32>; 2]; 5]; 2],
    /// Light of the first sky, front and back together: by number of bounces, 0 to 8.
    pub by_bounces: [f32; 9],
}

/// Numbers of a generator of its own.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix64(self.0) >> 40) as f32 / (1u32 << 24) as f32
    }

    /// Around the unit vector `normal`, in proportion to the cosine.
    fn cosine(&mut self, normal: Vec3) -> Vec3 {
        let (y, turn) = (1.0 - 2.0 * self.unit(), std::f32::consts::TAU * self.unit());
        let (s, (sin, cos)) = ((1.0 - y * y).max(0.0).sqrt(), turn.sin_cos());
        (normal + Vec3::new(s * cos, y, s * sin)).normalize_or(normal)
    }
}

/// Traces the paths of the vertex `v`; `seed` is its own.
pub fn truth(tracer: &PlantTracer, v: &Vertex, start: f32, bounces: usize, lights: &[LightState], seed: u64) -> Truth {
    let mut random = Random(seed << 32);
    let sun_rays = |origin: Vec3, light: &LightState| -> bool {
        !tracer.occluded(&Ray { origin, direction: light.sun_direction, t_max: f32::INFINITY })
    };
    let sees_sun: Vec<bool> =
        lights.iter().map(|light| sun_rays(v.position + light.sun_direction * start, light)).collect();
    let mut sun = vec![[Vec3::ZERO; 2]; lights.len()];
    for ((light, &seen), sides) in lights.iter().zip(&sees_sun).zip(&mut sun) {
        let cosine = v.normal.dot(light.sun_direction);
        if seen {
            sides[usize::from(cosine < 0.0)] = light.sun_illuminance * cosine.abs() / std::f32::consts::PI;
        }
    }
    let mut truth = Truth {
        sky: vec![[Vec3::ZERO; 2]; lights.len()],
        sun,
        sees_sun,
        transfer: std::array::from_fn(|_| BANDS.map(|n| [vec![0.0; 3 * n * n], vec![0.0; 3 * n * n]])),
        by_bounces: [0.0; 9],
    };
    for (path, direction) in direction_set(PATHS).into_iter().enumerate() {
        let cosine = v.normal.dot(direction);
        if cosine == 0.0 || (cosine < 0.0 && !v.two_sided) {
            continue;
        }
        let side = usize::from(cosine < 0.0);
        let mut through = Vec3::splat(cosine.abs() * 4.0 / PATHS as f32);
        let mut ray = Ray { origin: v.position + direction * start, direction, t_max: f32::INFINITY };
        for bounce in 0..truth.by_bounces.len() {
            let Some(hit) = tracer.closest(&ray) else {
                truth.by_bounces[bounce] += luminance(through * lights[0].surroundings().radiance(ray.direction));
                if bounce <= bounces {
                    truth.arrive(side, through, ray.direction, lights);
                }
                break;
            };
            let surface = tracer.point(&hit);
            if surface.kind == PartKind::Wood && !hit.front {
                break;
            }
            let outward = if hit.front { surface.shading_normal } else { -surface.shading_normal };
            if path % SUNS_EVERY == 0 && bounce < bounces {
                for (light, sides) in lights.iter().zip(&mut truth.sun) {
                    let sent = lit_by_sun(&surface, outward, light, |origin| sun_rays(origin, light));
                    sides[side] += through * sent * SUNS_EVERY as f32;
                }
            }
            let (near, far) = (luminance(surface.base_color), luminance(surface.transmission));
            if near + far <= 0.0 {
                break;
            }
            let reflected = random.unit() * (near + far) < near;
            through *= if reflected {
                surface.base_color * ((near + far) / near)
            } else {
                surface.transmission * ((near + far) / far)
            };
            ray.direction = random.cosine(if reflected { outward } else { -outward });
            ray.origin = surface.leave(ray.direction);
        }
    }
    truth
}

/// Radiance that a surface sends to the side `outward` (unit normal) under a sun that it sees or not.
fn lit_by_sun(surface: &SurfacePoint, outward: Vec3, light: &LightState, sees: impl Fn(Vec3) -> bool) -> Vec3 {
    let cosine = outward.dot(light.sun_direction);
    let color = if cosine > 0.0 { surface.base_color } else { surface.transmission };
    if color == Vec3::ZERO || light.sun_illuminance == Vec3::ZERO || !sees(surface.leave(light.sun_direction)) {
        return Vec3::ZERO;
    }
    color * light.sun_illuminance * cosine.abs() / std::f32::consts::PI
}

impl Truth {
    /// A path to the side `side` ends in the surroundings.
    fn arrive(&mut self, side: usize, through: Vec3, direction: Vec3, lights: &[LightState]) {
        for (light, sides) in lights.iter().zip(&mut self.sky) {
            sides[side] += through * light.surroundings().radiance(direction);
        }
        let mut row = [0.0; 36];
        for (projection, by_bands) in PROJECTIONS.iter().zip(&mut self.transfer) {
            for (n, sides) in BANDS.iter().zip(by_bands) {
                let row = &mut row[..n * n];
                projection.row(direction, row);
                for (sums, value) in sides[side].chunks_exact_mut(3).zip(row) {
                    (0..3).for_each(|channel| sums[channel] += through[channel] * *value);
                }
            }
        }
    }
}
