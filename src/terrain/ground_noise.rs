//! Tileable noise for the ground's colour: the renderer uploads it once, the ground truth reads it here.

use image::RgbaImage;
use noise::{Fbm, MultiFractal, NoiseFn, Perlin};
use rayon::prelude::*;

/// Texels along a side of [`noise_image`].
pub const NOISE_SIDE: u32 = 256;
/// Octaves and lowest frequency (waves around the tile) of the channels: smooth, fine, patchy, ridged.
const CHANNELS: [(usize, f64); 4] = [(4, 2.0), (4, 8.0), (3, 4.0), (4, 3.0)];

/// Four kinds of noise, each 0..1 around 0.5, that repeat without a seam.
pub fn noise_image() -> RgbaImage {
    let fields = CHANNELS.map(|(octaves, _)| Fbm::<Perlin>::new(octaves as u32 + 7).set_octaves(octaves));
    let rows: Vec<Vec<u8>> = (0..NOISE_SIDE)
        .into_par_iter()
        .map(|y| {
            let mut row = Vec::with_capacity(4 * NOISE_SIDE as usize);
            for x in 0..NOISE_SIDE {
                for (channel, field) in fields.iter().enumerate() {
                    row.push(texel(field, channel, x, y));
                }
            }
            row
        })
        .collect();
    RgbaImage::from_raw(NOISE_SIDE, NOISE_SIDE, rows.concat()).unwrap_or_else(|| RgbaImage::new(NOISE_SIDE, NOISE_SIDE))
}

fn texel(field: &Fbm<Perlin>, channel: usize, x: u32, y: u32) -> u8 {
    // Both coordinates run around a circle: the tile closes on itself.
    let angle = |value: u32| std::f64::consts::TAU * f64::from(value) / f64::from(NOISE_SIDE);
    let radius = CHANNELS[channel].1 / std::f64::consts::TAU;
    let (u, v) = (angle(x), angle(y));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_tiles_and_is_centred() {
        let image = noise_image();
        for c in 0..4 {
            let mean =
                image.pixels().map(|p| f64::from(p.0[c])).sum::<f64>() / f64::from(NOISE_SIDE * NOISE_SIDE) / 255.0;
            assert!((0.3..0.8).contains(&mean), "channel {c}: {mean}");
            // The seam is no steeper than the steepest step inside.
            let step = |x0: u32, x1: u32, y: u32| {
                i32::from(image.get_pixel(x0, y).0[c]).abs_diff(i32::from(image.get_pixel(x1, y).0[c]))
            };
            let inside = (0..NOISE_SIDE)
                .flat_map(|y| (1..NOISE_SIDE).map(move |x| (x, y)))
                .map(|(x, y)| step(x - 1, x, y))
                .max();
            let seam = (0..NOISE_SIDE).map(|y| step(NOISE_SIDE - 1, 0, y)).max();
            assert!(seam <= inside, "channel {c}");
        }
    }
}
