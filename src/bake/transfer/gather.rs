//! The rays: from every point in every direction, what reaches it directly, and what it sees instead of the sky.

use glam::Vec3;
use rayon::prelude::*;

use super::bounce::{Link, Links, Scene};
use super::points::Point;
use super::rays::Directions;
use crate::light::atmosphere::luminance;
use crate::trace::Ray;

/// Points whose rays are traced together: for each direction in turn, so that rays that run beside each other follow
/// one another and find the tree's nodes in the cache.
const BATCH: usize = 64;

/// Light fainter than this is not followed through further leaves.
const FAINTEST: f32 = 1e-4;

/// Front and back, slot by slot.
pub(super) type Sides = [Vec<f32>; 2];

impl Scene<'_> {
    fn ray(&self, point: &Point, direction: Vec3) -> Ray {
        Ray { origin: point.position + direction * self.points.start, direction, t_max: f32::INFINITY }
    }

    /// A colour in as many channels as are baked.
    pub fn in_channels(&self, color: Vec3) -> [f32; 3] {
        if self.settings.channels.count() == 1 { [luminance(color), 0.0, 0.0] } else { color.to_array() }
    }
}

/// The side of `point` on which light from `direction` arrives, with the cosine; `None` where it does not count.
fn side(point: &Point, direction: Vec3) -> Option<(usize, f32)> {
    let cosine = point.normal.dot(direction);
    if cosine > 0.0 {
        Some((0, cosine))
    } else if cosine < 0.0 && point.two_sided {
        Some((1, -cosine))
    } else {
        None
    }
}

/// Light that goes straight on through up to `leaves` leaves.
pub(super) fn straight(scene: &Scene, directions: &Directions, leaves: u8) -> Sides {
    let count = scene.settings.coefficients();
    let channels = scene.settings.channels.count();
    let batch = |points: &[Point]| {
        let mut sides = [vec![0.0; points.len() * count], vec![0.0; points.len() * count]];
        for (index, direction) in directions.list.iter().enumerate() {
            let row = directions.row(index);
            for (local, point) in points.iter().enumerate() {
                let Some((side, cosine)) = side(point, direction.toward) else { continue };
                let through = throughput(scene, scene.ray(point, direction.toward), leaves);
                let sums = &mut sides[side][local * count..(local + 1) * count];
                for (sum, value) in sums.chunks_exact_mut(channels).zip(row) {
                    for (sum, through) in sum.iter_mut().zip(through) {
                        *sum += value * cosine * through;
                    }
                }
            }
        }
        sides
    };
    join(scene.points.list.par_chunks(BATCH).map(batch).collect())
}

/// The share of the light from the ray's far end that arrives at its origin.
fn throughput(scene: &Scene, mut ray: Ray, leaves: u8) -> [f32; 3] {
    let mut through = [1.0; 3];
    for met in 0..=leaves {
        let Some(hit) = scene.tracer.closest(&ray) else { return through };
        if met == leaves {
            break;
        }
        let surface = scene.tracer.point(&hit);
        let transmission = scene.in_channels(surface.transmission);
        through = std::array::from_fn(|channel| through[channel] * transmission[channel].clamp(0.0, 1.0));
        if through.iter().all(|t| *t < FAINTEST) {
            break;
        }
        ray.origin = surface.leave(ray.direction);
    }
    [0.0; 3]
}

/// Direct light, and the links along which reflected and transmitted light comes.
pub(super) fn diffuse(scene: &Scene, directions: &Directions) -> (Sides, Links) {
    let count = scene.settings.coefficients();
    let channels = scene.settings.channels.count();
    let batch = |points: &[Point]| {
        let mut sides = [vec![0.0; points.len() * count], vec![0.0; points.len() * count]];
        let mut links: Vec<(u16, Link)> = Vec::new();
        for (index, direction) in directions.list.iter().enumerate() {
            let row = directions.row(index);
            for (local, point) in points.iter().enumerate() {
                let Some((side, cosine)) = side(point, direction.toward) else { continue };
                let ray = scene.ray(point, direction.toward);
                let hidden = if direction.linked {
                    let hit = scene.tracer.closest(&ray);
                    if let Some(hit) = &hit {
                        let link = Link::new(scene, hit, cosine * directions.link_weight);
                        links.extend(link.map(|link| ((2 * local + side) as u16, link)));
                    }
                    hit.is_some()
                } else {
                    scene.tracer.occluded(&ray)
                };
                if hidden {
                    continue;
                }
                let sums = &mut sides[side][local * count..(local + 1) * count];
                for (sum, value) in sums.chunks_exact_mut(channels).zip(row) {
                    sum.iter_mut().for_each(|sum| *sum += value * cosine);
                }
            }
        }
        // Stable: within a point and side the links stay in the directions' order.
        links.sort_by_key(|(key, _)| *key);
        (sides, links)
    };
    let batches: Vec<(Sides, Vec<(u16, Link)>)> = scene.points.list.par_chunks(BATCH).map(batch).collect();
    let (sides, links): (Vec<Sides>, Vec<Vec<(u16, Link)>>) = batches.into_iter().unzip();
    (join(sides), Links::new(scene.points.list.len(), BATCH, links))
}

/// The batches' sums, one after the other.
fn join(batches: Vec<Sides>) -> Sides {
    let mut joined = [Vec::new(), Vec::new()];
    for batch in batches {
        for (all, part) in joined.iter_mut().zip(batch) {
            all.extend(part);
        }
    }
    joined
}
