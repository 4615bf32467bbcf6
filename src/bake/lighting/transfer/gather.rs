//! Sends rays from every point in every direction: which light arrives directly, and what hides the sky.
//!
//! All rays of one direction are traced at once, together with those of the opposite direction
//! ([`crate::trace::ParallelTracer`]).

use std::ops::ControlFlow;

use glam::Vec3;
use rayon::prelude::*;

use super::points::Point;
use super::rays::Directions;
use super::scene::{Link, Links, Scene, Sides};
use crate::plant::PartKind;
use crate::trace::{LineCrossing, ParallelTracer};

/// Number of lines whose results are buffered before they are summed: 36 MB for 70,000 points in one channel.
const BLOCK: usize = 64;

/// For each side of `point` (front, back): which of the line's two rays arrives there (0 along the line, 1 against it),
/// and the absolute cosine. `None` for lines within the surface.
fn sides(point: &Point, line: Vec3) -> Option<([usize; 2], f32)> {
    let cosine = point.normal.dot(line);
    (cosine != 0.0).then_some((if cosine > 0.0 { [0, 1] } else { [1, 0] }, cosine.abs()))
}

/// What reaches every point, slot by slot.
pub(super) struct Gathered {
    /// Coefficients of front and back.
    pub sides: Sides,
    /// Fraction of uniform surroundings that is hidden from front and back, 0..=1.
    pub hidden: Sides,
}

/// Light that continues straight through up to `leaves` leaves; with 0, direct light only.
///
/// Scaled so that an unoccluded point in uniform surroundings gets exactly their radiance.
pub(super) fn straight(scene: &Scene, directions: &Directions, leaves: u8) -> Gathered {
    let count = scene.settings.coefficients();
    let channels = scene.settings.channels.count();
    let points = &scene.points.list;
    let lines = scene.lines();
    let mut sums: Vec<Sums> = vec![Sums::default(); points.len()];
    let mut coefficients = [vec![0.0; points.len() * count], vec![0.0; points.len() * count]];
    let order: Vec<usize> = (0..directions.lines.len()).collect();
    for block in order.chunks(BLOCK) {
        let through: Vec<Vec<f32>> =
            block.par_iter().map(|&line| throughput(scene, &lines, directions.lines[line], leaves)).collect();
        let [front, back] = &mut coefficients;
        let add = |(slot, ((front, back), sums)): (usize, ((&mut [f32], &mut [f32]), &mut Sums))| {
            for (&line, through) in block.iter().zip(&through) {
                let Some((rays, cosine)) = sides(&points[slot], directions.lines[line]) else { continue };
                sums.total += cosine;
                for (side, (ray, sides)) in rays.into_iter().zip([&mut *front, &mut *back]).enumerate() {
                    let at = (2 * slot + ray) * channels;
                    let through = &through[at..at + channels];
                    if through.iter().all(|share| *share == 0.0) {
                        continue;
                    }
                    sums.arrived[side] += cosine * through.iter().sum::<f32>() / channels as f32;
                    for (sides, value) in sides.chunks_exact_mut(channels).zip(directions.row(line, ray)) {
                        for (sum, through) in sides.iter_mut().zip(through) {
                            *sum += value * cosine * through;
                        }
                    }
                }
            }
        };
        let sides = front.par_chunks_mut(count).zip(back.par_chunks_mut(count));
        sides.zip(&mut sums).enumerate().for_each(add);
    }
    for (values, total) in coefficients.iter_mut().flat_map(|side| side.chunks_exact_mut(count).zip(&sums)) {
        let scale = if total.total > 0.0 { 1.0 / total.total } else { 0.0 };
        values.iter_mut().for_each(|value| *value *= scale);
    }
    let hidden = |side: usize| -> Vec<f32> {
        let share = |sums: &Sums| if sums.total > 0.0 { 1.0 - sums.arrived[side] / sums.total } else { 0.0 };
        sums.iter().map(|sums| share(sums).clamp(0.0, 1.0)).collect()
    };
    Gathered { sides: coefficients, hidden: [hidden(0), hidden(1)] }
}

/// Cosines of one point.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Of all rays to a side: as many, at the same cosines, go to front and back.
    total: f32,
    /// Of those that were not hidden, by side.
    arrived: [f32; 2],
}

/// The share of the light from far away that arrives at each point along a line and against it, by channel; nothing at
/// the back of wood.
fn throughput(scene: &Scene, lines: &ParallelTracer, line: Vec3, leaves: u8) -> Vec<f32> {
    let channels = scene.settings.channels.count();
    let points = &scene.points.list;
    let mut through = vec![1.0; points.len() * 2 * channels];
    for (point, through) in points.iter().zip(through.chunks_exact_mut(2 * channels)) {
        if let (false, Some(([_, back], _))) = (point.two_sided, sides(point, line)) {
            through[back * channels..(back + 1) * channels].fill(0.0);
        }
    }
    let mut met = if leaves > 0 { vec![0u8; points.len() * 2] } else { Vec::new() };
    lines.crossings(line, |crossing| {
        let Some(ray) = ray_of(&crossing, scene.points.start) else { return ControlFlow::Continue(()) };
        let point = crossing.point as usize;
        let both = &mut through[2 * point * channels..2 * (point + 1) * channels];
        let shares = &mut both[ray * channels..(ray + 1) * channels];
        if shares.iter().all(|share| *share == 0.0) || !lines.covers(&crossing) {
            return ControlFlow::Continue(());
        }
        let surface = (leaves > 0).then(|| scene.tracer.point(&lines.hit(&crossing, ray == 1)));
        match surface.filter(|surface| surface.kind == PartKind::Foliage && met[2 * point + ray] < leaves) {
            Some(surface) => {
                met[2 * point + ray] += 1;
                for (share, passed) in shares.iter_mut().zip(scene.in_channels(surface.transmission)) {
                    *share *= passed.clamp(0.0, 1.0);
                }
            }
            None => shares.fill(0.0),
        }
        if both.iter().all(|share| *share == 0.0) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    through
}

/// Whether a crossing is met by the ray along the line (0) or against it (1); `None` at the point itself.
fn ray_of(crossing: &LineCrossing, start: f32) -> Option<usize> {
    (crossing.t.abs() > start).then_some(usize::from(crossing.t < 0.0))
}

/// The links along which reflected and transmitted light comes. The lines that are followed are few; where they show
/// another share of the plant than all lines do, that of all lines counts: `hidden`, of [`Gathered`].
pub(super) fn links(scene: &Scene, directions: &Directions, hidden: &Sides) -> Links {
    let lines = scene.lines();
    let points = &scene.points.list;
    let start = scene.points.start;
    let of_line = |&line: &Vec3| -> Vec<(u32, Link)> {
        let mut nearest: Vec<Option<LineCrossing>> = vec![None; 2 * points.len()];
        lines.crossings(line, |crossing| {
            let Some(ray) = ray_of(&crossing, start) else { return ControlFlow::Continue(()) };
            let nearest = &mut nearest[2 * crossing.point as usize + ray];
            if nearest.is_none_or(|other| crossing.t.abs() < other.t.abs()) && lines.covers(&crossing) {
                *nearest = Some(crossing);
            }
            ControlFlow::Continue(())
        });
        let mut links = Vec::new();
        for (slot, point) in points.iter().enumerate() {
            let Some((rays, cosine)) = sides(point, line) else { continue };
            for (side, ray) in rays.into_iter().enumerate().take(1 + usize::from(point.two_sided)) {
                let Some(crossing) = nearest[2 * slot + ray] else { continue };
                let link = Link::new(scene, &lines.hit(&crossing, ray == 1), cosine);
                links.push(((2 * slot + side) as u32, link));
            }
        }
        links
    };
    let by_line: Vec<Vec<(u32, Link)>> = directions.followed.par_iter().map(of_line).collect();
    Links::new(by_line, hidden)
}
