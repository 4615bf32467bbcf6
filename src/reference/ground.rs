//! Rays against the ground: the smooth surface itself, not the triangles that are drawn of it.
//!
//! A ray's piece is skipped where it lies above the highest point of the ground under it ([`Terrain::height_bounds`]),
//! else halved, the near half first; pieces shorter than half a sample are searched for the crossing, which is then
//! bracketed to a fraction of a micrometre. A ray that dips into the ground and out again within an eighth of a sample
//! is the one thing that can be missed.

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};

use super::camera::WorldRay;
use crate::terrain::Terrain;

/// Metres below the ground that a ray may start without being buried: feet of trees and rounded points.
const TOLERANCE: f64 = 1e-3;
/// Metres that a ray which leaves the ground starts above it.
const LIFT: f64 = 1e-5;
/// Steps in which a short piece is searched for a crossing.
const STEPS: u32 = 4;

/// The shape of the ground.
#[derive(Clone, Debug)]
pub enum GroundShape {
    /// A level plane at this height, metres above the datum.
    Plane(f64),
    /// A terrain; its local frame is the scene's.
    Terrain(Arc<Terrain>),
}

/// What a ray finds of the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Crossing {
    /// It comes from above, after this many metres.
    At(f64),
    /// It starts below.
    Buried,
}

impl GroundShape {
    /// Height in metres.
    pub fn height(&self, x: f64, z: f64) -> f64 {
        match self {
            Self::Plane(height) => *height,
            Self::Terrain(terrain) => terrain.height(x, z),
        }
    }

    /// Unit normal, upwards.
    pub fn normal(&self, x: f64, z: f64) -> Vec3 {
        match self {
            Self::Plane(_) => Vec3::Y,
            Self::Terrain(terrain) => terrain.normal(x, z),
        }
    }

    /// Where a ray that leaves the ground at `position` begins.
    pub(crate) fn lifted(&self, position: DVec3) -> DVec3 {
        DVec3::new(position.x, self.height(position.x, position.z) + LIFT, position.z)
    }

    /// Where `ray` enters the ground, up to `max_distance` metres away.
    pub(crate) fn crossing(&self, ray: &WorldRay, max_distance: f64) -> Option<Crossing> {
        let end = ray.t_max.min(max_distance);
        let above = ray.origin.y - self.height(ray.origin.x, ray.origin.z);
        if above < -TOLERANCE {
            return Some(Crossing::Buried);
        }
        match self {
            Self::Plane(_) => {
                let t = above.max(0.0) / -ray.direction.y;
                (ray.direction.y < 0.0 && t <= end).then_some(Crossing::At(t))
            }
            Self::Terrain(terrain) => descent(terrain, ray, end).map(Crossing::At),
        }
    }
}

fn descent(terrain: &Terrain, ray: &WorldRay, end: f64) -> Option<f64> {
    let (lowest, highest) = terrain.min_max_height();
    let (lowest, highest) = (f64::from(lowest) - 1.0, f64::from(highest) + 1.0);
    // The piece of the ray at heights that the ground has.
    let rise = ray.direction.y;
    let (mut start, mut end) = (0.0, end);
    if rise < 0.0 {
        start = ((highest - ray.origin.y) / rise).max(0.0);
        end = end.min((lowest - ray.origin.y) / rise);
    } else if ray.origin.y > highest {
        return None;
    } else if rise > 0.0 {
        end = end.min((highest - ray.origin.y) / rise);
    }
    if start.is_nan() || end.is_nan() || start > end {
        return None;
    }
    let above = |t: f64| {
        let point = ray.at(t);
        point.y - terrain.height(point.x, point.z)
    };
    let level = ray.direction.x.hypot(ray.direction.z);
    let short = 0.5 * terrain.field().spacing().min_element();
    let mut pieces = vec![(start, end)];
    while let Some((near, far)) = pieces.pop() {
        let (a, b) = (ray.at(near), ray.at(far));
        let (low, high) =
            terrain.height_bounds(DVec2::new(a.x.min(b.x), a.z.min(b.z)), DVec2::new(a.x.max(b.x), a.z.max(b.z)));
        if a.y.min(b.y) > f64::from(high) + TOLERANCE {
            continue;
        }
        let middle = 0.5 * (near + far);
        if (far - near) * level > short && high - low > 1e-4 && middle > near && middle < far {
            pieces.extend([(middle, far), (near, middle)]);
            continue;
        }
        let mut before = (near, above(near));
        for step in 1..=STEPS {
            let t = near + (far - near) * f64::from(step) / f64::from(STEPS);
            let here = (t, above(t));
            if before.1 >= -TOLERANCE && here.1 < 0.0 {
                return Some(bracketed(&above, before, here));
            }
            before = here;
        }
    }
    None
}

/// The zero between two places, the first above (or just below, where it is the zero itself), the second below: false
/// position with the Illinois rule (Dowell & Jarratt 1971).
fn bracketed(above: &impl Fn(f64) -> f64, mut a: (f64, f64), mut b: (f64, f64)) -> f64 {
    if a.1 <= 0.0 {
        return a.0;
    }
    for _ in 0..60 {
        let t = a.0 + (b.0 - a.0) * (a.1 / (a.1 - b.1)).clamp(0.0, 1.0);
        let here = (t, above(t));
        if here.1.abs() < 1e-8 || b.0 - a.0 < 1e-9 {
            return t;
        }
        // The end that stays counts half from the second time on.
        if here.1 > 0.0 {
            a = here;
            b.1 *= 0.5;
        } else {
            b = here;
            a.1 *= 0.5;
        }
    }
    a.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::sampler::PathSampler;
    use crate::terrain::{HeightField, Surroundings};

    fn hills() -> GroundShape {
        let height = |i: usize| {
            let (x, z) = ((i % 65) as f32, (i / 65) as f32);
            100.0 + 25.0 * (x * 0.31).sin() * (z * 0.23).cos() + 3.0 * (x * 1.3 + z).sin()
        };
        let field = HeightField::new(65, 65, DVec2::splat(10.0), (0..65 * 65).map(height).collect()).unwrap();
        GroundShape::Terrain(Arc::new(Terrain::new(field, None, Surroundings::Mirror)))
    }

    #[test]
    fn crossings_are_the_first_of_a_fine_march() {
        let hills = hills();
        let mut found = 0;
        for index in 0..400 {
            let mut sampler = PathSampler::new(1, 0, index);
            let (a, b) = (sampler.pair().as_dvec2(), sampler.pair().as_dvec2());
            let foot = DVec2::new(a.x - 0.5, a.y - 0.5) * 900.0;
            let origin = DVec3::new(foot.x, hills.height(foot.x, foot.y) + 1e-4 + 30.0 * b.x, foot.y);
            let direction = DVec3::new(b.y - 0.5, 0.4 * (a.x - 0.6), a.y - 0.5).normalize();
            let ray = WorldRay::new(origin, direction);
            let above = |t: f64| ray.at(t).y - hills.height(ray.at(t).x, ray.at(t).z);
            let marched = (1..60_000).map(|step| f64::from(step) * 0.05).find(|&t| above(t) < 0.0);
            let crossing = hills.crossing(&ray, 3000.0);
            match (marched, crossing) {
                (Some(t), Some(Crossing::At(found))) => {
                    assert!((t - found).abs() < 0.06, "ray {index}: {t} {found}");
                    assert!(above(found).abs() < 1e-6);
                }
                (None, None) => {}
                (marched, crossing) => panic!("ray {index}: {marched:?} {crossing:?}"),
            }
            found += u32::from(marched.is_some());
        }
        assert!((150..390).contains(&found), "{found}");
    }

    #[test]
    fn rays_that_leave_the_ground_do_not_hit_where_they_start() {
        let hills = hills();
        for index in 0..400 {
            let mut sampler = PathSampler::new(1, 0, index);
            let point = (sampler.pair().as_dvec2() - 0.5) * 900.0;
            let normal = hills.normal(point.x, point.y);
            let direction = crate::reference::bsdf::cosine_hemisphere(normal, sampler.pair());
            let origin = hills.lifted(DVec3::new(point.x, 0.0, point.y));
            if let Some(crossing) = hills.crossing(&WorldRay::new(origin, direction.as_dvec3()), 3000.0) {
                assert!(matches!(crossing, Crossing::At(t) if t > 0.1), "{crossing:?} {}", normal.dot(direction));
            }
        }
    }

    #[test]
    fn planes_steep_rays_and_buried_ones() {
        let plane = GroundShape::Plane(5.0);
        let down = WorldRay::new(DVec3::new(1e6, 7.0, -2e6), DVec3::NEG_Y);
        assert_eq!(plane.crossing(&down, 100.0), Some(Crossing::At(2.0)));
        assert_eq!(plane.crossing(&down, 1.0), None);
        assert_eq!(plane.crossing(&WorldRay::new(DVec3::ZERO, DVec3::Y), 100.0), Some(Crossing::Buried));
        let hills = hills();
        let high = DVec3::new(12.0, 5000.0, 30.0);
        let expected = 5000.0 - hills.height(12.0, 30.0);
        let Some(Crossing::At(t)) = hills.crossing(&WorldRay::new(high, DVec3::NEG_Y), 1e5) else {
            panic!("no ground")
        };
        assert!((t - expected).abs() < 1e-6);
        assert_eq!(hills.crossing(&WorldRay::new(high, DVec3::X), 1e5), None);
        assert_eq!(hills.crossing(&WorldRay { t_max: 100.0, ..WorldRay::new(high, DVec3::NEG_Y) }, 1e5), None);
    }
}
