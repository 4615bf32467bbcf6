//! Light from leaf to leaf: each bounce passes the coefficients on along the rays that met something.
//!
//! [Sloan, Kautz & Snyder 2002, 5; Franzke 2005, 4.2.3, note 4]: what a surface sends out is a vector of coefficients
//! like its incoming light, so a bounce is a weighted sum of vectors. They are interpolated over the triangle that was
//! met; the colours are those of the texture where it was met.

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

/// A ray that met a surface which can send light back along it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    part: u32,
    triangle: u32,
    /// Barycentric weights of the second and third corner, in 65535ths.
    u: u16,
    v: u16,
    front: bool,
    /// What the side that was met passes on, by channel: cosine, solid angle over pi, base colour.
    near: [f32; 3],
    /// What the other side passes through, by channel; zero for wood.
    far: [f32; 3],
}

impl Link {
    /// `None` for the inside of wood, which is dark.
    pub fn new(scene: &Scene, hit: &Hit, weight: f32) -> Option<Self> {
        let surface = scene.tracer.point(hit);
        if surface.kind == PartKind::Wood && !hit.front {
            return None;
        }
        let code = |weight: f32| (weight.clamp(0.0, 1.0) * 65_535.0 + 0.5) as u16;
        Some(Self {
            part: hit.part,
            triangle: hit.triangle,
            u: code(hit.u),
            v: code(hit.v),
            front: hit.front,
            near: scene.in_channels(surface.base_color).map(|c| c * weight),
            far: scene.in_channels(surface.transmission).map(|c| c * weight),
        })
    }
}

/// All links, by slot and side.
pub(super) struct Links {
    list: Vec<Link>,
    /// Where the links of `2 * slot + side` start; one entry more than there are.
    starts: Vec<u32>,
}

impl Links {
    /// From batches of `batch` slots, each sorted by `2 * place in the batch + side`.
    pub fn new(slots: usize, batch: usize, batches: Vec<Vec<(u16, Link)>>) -> Self {
        let mut list = Vec::with_capacity(batches.iter().map(Vec::len).sum());
        let mut starts = Vec::with_capacity(2 * slots + 1);
        for (index, links) in batches.iter().enumerate() {
            let keys = 2 * batch.min(slots - index * batch);
            let mut next = 0;
            for key in 0..keys {
                starts.push(list.len() as u32);
                while let Some((_, link)) = links.get(next).filter(|(of, _)| usize::from(*of) == key) {
                    list.push(*link);
                    next += 1;
                }
            }
        }
        starts.push(list.len() as u32);
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
                    let shares = [(1.0 - u - v).max(0.0), u, v];
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
