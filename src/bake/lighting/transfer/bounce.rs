//! Multiple scattering: each bounce carries the coefficients along the rays that hit something.
//!
//! [Sloan, Kautz & Snyder 2002, 5; Franzke 2005, 4.2.3, note 4]: what a surface sends out is a vector of coefficients
//! like its incoming light, so a bounce is a weighted sum of vectors. The coefficients are those of the middle of the
//! triangle that was hit; the colours are those of the texture at the hit.

use rayon::prelude::*;

use super::points::NO_SLOT;
use super::scene::{Links, Scene, Sides};

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
                for link in links.of(slot, side) {
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
