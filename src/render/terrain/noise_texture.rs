//! Tileable noise for the ground's colour, made once at start.

use bevy::render::{
    render_resource::{TextureFormat, TextureView},
    renderer::{RenderDevice, RenderQueue},
};
use image::RgbaImage;
use noise::{Fbm, MultiFractal, NoiseFn, Perlin};
use rayon::prelude::*;

use crate::{plant::texture::MipChain, render::gpu};

/// Texels along a side.
const SIDE: u32 = 256;
/// Octaves and lowest frequency (waves around the tile) of the channels: smooth, fine, patchy, ridged.
const CHANNELS: [(usize, f64); 4] = [(4, 2.0), (4, 8.0), (3, 4.0), (4, 3.0)];

/// Four kinds of noise, each 0..1 around 0.5, that repeat without a seam.
pub fn noise_image() -> RgbaImage {
    let fields = CHANNELS.map(|(octaves, _)| Fbm::<Perlin>::new(octaves as u32 + 7).set_octaves(octaves));
    let rows: Vec<Vec<u8>> = (0..SIDE)
        .into_par_iter()
        .map(|y| {
            let mut row = Vec::with_capacity(4 * SIDE as usize);
            for x in 0..SIDE {
                for (channel, field) in fields.iter().enumerate() {
                    row.push(texel(field, channel, x, y));
                }
            }
            row
        })
        .collect();
    RgbaImage::from_raw(SIDE, SIDE, rows.concat()).unwrap_or_else(|| RgbaImage::new(SIDE, SIDE))
}

fn texel(field: &Fbm<Perlin>, channel: usize, x: u32, y: u32) -> u8 {
    // Both coordinates run around a circle: the tile closes on itself.
    let turn = |value: u32| std::f64::consts::TAU * f64::from(value) / f64::from(SIDE);
    let radius = CHANNELS[channel].1 / std::f64::consts::TAU;
    let (u, v) = (turn(x), turn(y));
    let value = field.get([radius * u.cos(), radius * u.sin(), radius * v.cos(), radius * v.sin()]);
    let shaped = match channel {
        // Patches: a soft step.
        2 => 0.5 + 0.5 * (3.0 * value).tanh(),
        // Ridges: bright along the zero crossings.
        3 => 1.0 - (2.2 * value.abs()).min(1.0),
        _ => 0.5 + 0.9 * value,
    };
    (shaped.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Uploads [`noise_image`].
pub fn noise_texture(device: &RenderDevice, queue: &RenderQueue) -> TextureView {
    gpu::texture(device, queue, "canopy_ground_noise", TextureFormat::Rgba8Unorm, &mip_chain(&noise_image()), 1)
}

/// Box-filtered levels, all four channels alike: these are numbers, not colours.
fn mip_chain(image: &RgbaImage) -> MipChain {
    let mut levels = vec![image.as_raw().clone()];
    let mut side = SIDE as usize;
    while side > 1 {
        let half = side / 2;
        let next = {
            let finer = &levels[levels.len() - 1];
            let at = |x: usize, y: usize, c: usize| u32::from(finer[4 * (y * side + x) + c]);
            let texel = |i: usize| {
                let (x, y, c) = (2 * (i / 4 % half), 2 * (i / 4 / half), i % 4);
                ((at(x, y, c) + at(x + 1, y, c) + at(x, y + 1, c) + at(x + 1, y + 1, c) + 2) / 4) as u8
            };
            (0..4 * half * half).map(texel).collect()
        };
        levels.push(next);
        side = half;
    }
    MipChain { width: SIDE, height: SIDE, levels }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_tiles_and_is_centred() {
        let image = noise_image();
        for c in 0..4 {
            let mean = image.pixels().map(|p| f64::from(p.0[c])).sum::<f64>() / f64::from(SIDE * SIDE) / 255.0;
            assert!((0.3..0.8).contains(&mean), "channel {c}: {mean}");
            // The seam is no steeper than the steepest step inside.
            let step = |x0: u32, x1: u32, y: u32| {
                i32::from(image.get_pixel(x0, y).0[c]).abs_diff(i32::from(image.get_pixel(x1, y).0[c]))
            };
            let inside = (0..SIDE).flat_map(|y| (1..SIDE).map(move |x| (x, y))).map(|(x, y)| step(x - 1, x, y)).max();
            let seam = (0..SIDE).map(|y| step(SIDE - 1, 0, y)).max();
            assert!(seam <= inside, "channel {c}");
        }
    }
}
