//! Light from leaf to leaf: each bounce passes the coefficients on along the rays that met something.
//!
//! [Sloan, Kautz & Snyder 2002, 5; Franzke 2005, 4.2.3, note 4]: what a surface sends out is a vector of coefficients
//! like its incoming light, so a bounce is a weighted sum of vectors. They are those of the middle of the triangle that
//! was met; the colours are those of the texture where it was met.

use glam::Vec3;
use rayon::prelude::*;

use super::TransferSettings;
use super::gather::Sides;
use super::points::{NO_SLOT, Points};
use crate::plant::PartKind;
use crate::trace::{Hit, PlantTracer};

/// What a bake works on.
pub(super) struct Scene<'a> {
    pub tracer: &'a PlantTracer,
    pub points: &'a Points,
    pub settings: TransferSettings,
}

/// A ray that met a surface, which may send light back along it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Link {
    part: u32,
    triangle: u32,
    front: bool,
    /// What the link counts: the cosine at its point.
    weight: f32,
    /// What the side that was met passes on, by channel; zero for the inside of wood, which is dark.
    near: [f32; 3],
    /// What the other side passes through, by channel; zero for wood.
    far: [f32; 3],
}

impl Link {
    /// The link along a ray that met `hit`.
    pub fn new(scene: &Scene, hit: &Hit, weight: f32) -> Self {
        let surface = scene.tracer.point(hit);
        let near = if surface.kind == PartKind::Wood && !hit.front { Vec3::ZERO } else { surface.base_color };
        Self {
            part: hit.part,
            triangle: hit.triangle,
            front: hit.front,
            weight,
            near: scene.in_channels(near),
            far: scene.in_channels(surface.transmission),
        }
    }
}

/// All links, by slot and side.
pub(super) struct Links {
    list: Vec<Link>,
    /// Where the links of `2 * slot + side` start; one entry more than there are.
    starts: Vec<u32>,
}

impl Links {
    /// From the links of each line, each with `2 * slot + side`; those of one side stay in the order of the lines. Their
    /// weights are scaled to the share of even surroundings that is `hidden` from each side.
    pub fn new(by_line: Vec<Vec<(u32, Link)>>, hidden: &[Vec<f32>; 2]) -> Self {
        let keys = 2 * hidden[0].len();
        let mut starts = vec![0u32; keys + 1];
        for (of, _) in by_line.iter().flatten() {
            starts[*of as usize + 1] += 1;
        }
        for of in 0..keys {
            starts[of + 1] += starts[of];
        }
        let mut next = starts.clone();
        let mut list = vec![Link::default(); starts[keys] as usize];
        for (of, link) in by_line.into_iter().flatten() {
            list[next[of as usize] as usize] = link;
            next[of as usize] += 1;
        }
        for of in 0..keys {
            let links = &mut list[starts[of] as usize..starts[of + 1] as usize];
            let total: f32 = links.iter().map(|link| link.weight).sum();
            let scale = if total > 0.0 { hidden[of % 2][of / 2] / total } else { 0.0 };
            links.iter_mut().for_each(|link| link.weight *= scale);
        }
        Self { list, starts }
    }
}

/// Direct light and `bounces` bounces of it.
pub(super) fn bounce(scene: &Scene, direct: &Sides, links: &Links, bounces: u8) -> Sides {
    let count = scene.settings.coefficients();
    let channels = scene.settings.channels.count();
    let corners = scene.points.corners(scene.tracer.plant());
    let mut sides = direct.clone();
    for _ in 0..bounces {
        let met: Vec<Vec<f32>> = corners.par_iter().map(|corners| triangle_light(&sides, corners, count)).collect();
        let pass = |side: usize| -> Vec<f32> {
            let mut out = direct[side].clone();
            out.par_chunks_mut(count).enumerate().for_each(|(slot, sums)| {
                let (from, to) = (links.starts[2 * slot + side], links.starts[2 * slot + side + 1]);
                for link in &links.list[from as usize..to as usize] {
                    let both = &met[link.part as usize][2 * count * link.triangle as usize..][..2 * count];
                    let (front, back) = both.split_at(count);
                    let (near, far) = if link.front { (front, back) } else { (back, front) };
                    add(sums, near, link.near.map(|color| color * link.weight), channels);
                    if link.far != [0.0; 3] {
                        add(sums, far, link.far.map(|color| color * link.weight), channels);
                    }
                }
            });
            out
        };
        sides = [pass(0), pass(1)];
    }
    sides
}

/// What reaches front and back of each triangle: the mean of its corners.
fn triangle_light(sides: &Sides, corners: &[[(u32, bool); 3]], count: usize) -> Vec<f32> {
    let mut out = vec![0.0; corners.len() * 2 * count];
    for (both, corners) in out.chunks_exact_mut(2 * count).zip(corners) {
        for (slot, flipped) in corners.iter().filter(|(slot, _)| *slot != NO_SLOT) {
            let range = *slot as usize * count..(*slot as usize + 1) * count;
            for (face, sums) in both.chunks_exact_mut(count).enumerate() {
                let side = face ^ usize::from(*flipped);
                sums.iter_mut().zip(&sides[side][range.clone()]).for_each(|(sum, value)| *sum += value / 3.0);
            }
        }
    }
    out
}

/// Adds `values` times the weight of each channel.
#[inline]
fn add(sums: &mut [f32], values: &[f32], weights: [f32; 3], channels: usize) {
    if channels == 1 {
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += value * weights[0];
        }
    } else {
        for (sum, value) in sums.chunks_exact_mut(3).zip(values.chunks_exact(3)) {
            for channel in 0..3 {
                sum[channel] += value[channel] * weights[channel];
            }
        }
    }
}
