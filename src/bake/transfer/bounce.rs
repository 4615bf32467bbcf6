//! Light from leaf to leaf: each bounce passes the coefficients on along the rays that met something.
//!
//! [Sloan, Kautz & Snyder 2002, 5; Franzke 2005, 4.2.3, note 4]: what a surface sends out is a vector of coefficients
//! like its incoming light, so a bounce is a weighted sum of vectors. They are interpolated over the triangle that was
//! met; the colours are those of the texture where it was met.

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
    /// Barycentric weights of the second and third corner, in 65535ths.
    u: u16,
    v: u16,
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
        let code = |weight: f32| (weight.clamp(0.0, 1.0) * 65_535.0 + 0.5) as u16;
        Self {
            part: hit.part,
            triangle: hit.triangle,
            u: code(hit.u),
            v: code(hit.v),
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
pub(super) fn bounce(scene: &Scene, direct: Sides, links: &Links, bounces: u8) -> Sides {
    let count = scene.settings.coefficients();
    let channels = scene.settings.channels.count();
    let corners = scene.points.corners(scene.tracer.plant());
    let mut sides = direct.clone();
    for _ in 0..bounces {
        let pass = |side: usize| -> Vec<f32> {
            let mut out = direct[side].clone();
            out.par_chunks_mut(count).enumerate().for_each(|(slot, sums)| {
                let (from, to) = (links.starts[2 * slot + side], links.starts[2 * slot + side + 1]);
                for link in &links.list[from as usize..to as usize] {
                    let (u, v) = (f32::from(link.u) / 65_535.0, f32::from(link.v) / 65_535.0);
                    let shares = [(1.0 - u - v).max(0.0), u, v].map(|share| share * link.weight);
                    for ((slot, flipped), share) in
                        corners[link.part as usize][link.triangle as usize].into_iter().zip(shares)
                    {
                        if slot == NO_SLOT {
                            continue;
                        }
                        let met = usize::from(link.front == flipped);
                        let range = slot as usize * count..(slot as usize + 1) * count;
                        add(sums, &sides[met][range.clone()], link.near.map(|w| w * share), channels);
                        if link.far != [0.0; 3] {
                            add(sums, &sides[1 - met][range], link.far.map(|w| w * share), channels);
                        }
                    }
                }
            });
            out
        };
        sides = [pass(0), pass(1)];
    }
    sides
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
