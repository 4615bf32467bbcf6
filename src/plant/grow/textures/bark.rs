//! Bark: a height field, with colours by depth and normals from the slopes.

use std::sync::Arc;

use glam::Vec3;
use image::{Rgba, RgbaImage};
use rayon::prelude::*;

use super::BarkTextures;
use super::lattice::{cell, octaves};
use crate::math::smoothstep;
use crate::plant::grow::parameters::BarkKind;

/// Width of the textures.
const WIDTH: usize = 512;
/// Height of the textures.
const HEIGHT: usize = 1024;

/// Paints both textures.
pub(super) fn paint(kind: BarkKind) -> BarkTextures {
    let (place, relief): (fn(f32, f32) -> Place, f32) = match kind {
        BarkKind::Fissured => (fissured, 13.0),
        BarkKind::Scaly => (scaly, 6.5),
    };
    let field: Vec<Place> = (0..WIDTH * HEIGHT)
        .into_par_iter()
        .map(|i| place((i % WIDTH) as f32 / WIDTH as f32, (i / WIDTH) as f32 / HEIGHT as f32))
        .collect();
    let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let color = RgbaImage::from_fn(WIDTH as u32, HEIGHT as u32, |x, y| {
        let color = field[y as usize * WIDTH + x as usize].color;
        Rgba([byte(color.x), byte(color.y), byte(color.z), 255])
    });
    let normal = RgbaImage::from_fn(WIDTH as u32, HEIGHT as u32, |x, y| {
        let (x, y) = (x as usize, y as usize);
        let at = |dx: usize, dy: usize| field[(y + dy) % HEIGHT * WIDTH + (x + dx) % WIDTH].height;
        let right = at(1, 0) - at(WIDTH - 1, 0);
        let down = at(0, 1) - at(0, HEIGHT - 1);
        // +Y of the normal points up, while the rows of the texture run down.
        let normal = Vec3::new(-right * relief, down * relief, 1.0).normalize();
        Rgba([byte(0.5 + 0.5 * normal.x), byte(0.5 + 0.5 * normal.y), byte(0.5 + 0.5 * normal.z), 255])
    });
    BarkTextures { color: Arc::new(color), normal: Arc::new(normal) }
}

struct Place {
    /// Height, 0 (deepest) to 1 (highest).
    height: f32,
    /// sRGB albedo.
    color: Vec3,
}

/// Oak: ridges along the trunk, which divide and join, between deep fissures.
fn fissured(x: f32, y: f32) -> Place {
    let warp_x = 0.05 * octaves(x, y, [4, 6], 3, 1);
    let warp_y = 0.06 * octaves(x, y, [4, 5], 2, 11);
    let (u, v) = (x + warp_x, y + warp_y);
    // The tile is twice as high as wide, so cells are 2 * columns / rows times as high as wide.
    let coarse = cell(u * 10.0, v * 4.0, [10, 4], 5.0, 21);
    let fine = cell(u * 15.0 + 0.5, v * 14.0, [15, 14], 2.1, 31);
    let fibre = octaves(u, v, [36, 10], 4, 41);
    let grain = octaves(x, y, [64, 128], 3, 51);
    let ridge = smoothstep(0.01, 0.24, coarse.border + 0.06 * fibre);
    let crack = smoothstep(0.0, 0.14, fine.border + 0.05 * fibre);
    let top = 0.78 + 0.24 * (coarse.value - 0.5) + 0.20 * fibre + 0.10 * grain;
    let height = (ridge * (top - 0.30 * (1.0 - crack))).clamp(0.0, 1.0);

    let deep = Vec3::new(0.170, 0.138, 0.108);
    let high = Vec3::new(0.445, 0.395, 0.330);
    let lichen = Vec3::new(0.450, 0.462, 0.365);
    let mut color = deep.lerp(high, smoothstep(0.0, 0.85, height) * (0.92 + 0.16 * fibre));
    color *= 1.0 + 0.13 * grain + 0.16 * (fine.value - 0.5);
    let patch = octaves(x, y, [4, 7], 5, 61);
    color = color.lerp(lichen * (0.95 + 0.2 * grain), 0.5 * smoothstep(0.12, 0.5, patch) * height);
    Place { height, color }
}

/// Spruce: thin scales in greyish and reddish browns. Each is attached at its upper rim and lifted at its lower one.
fn scaly(x: f32, y: f32) -> Place {
    let warp_x = 0.030 * octaves(x, y, [10, 18], 4, 2);
    let warp_y = 0.018 * octaves(x, y, [12, 20], 4, 12);
    let (u, v) = (x + warp_x, y + warp_y);
    let scale = cell(u * 12.0, v * 17.0, [12, 17], 1.41, 22);
    let flake = cell(u * 27.0, v * 40.0, [27, 40], 1.35, 32);
    let grain = octaves(x, y, [48, 80], 4, 42);
    // A position below the point of its cell (rows run down) is at the free rim, where the scale casts a shadow. Above
    // the point, the scale merges with the one above it.
    let low = smoothstep(-0.15, 0.35, -scale.to_point[1]);
    let flake_low = smoothstep(-0.2, 0.4, -flake.to_point[1]);
    let gap = (1.0 - smoothstep(0.0, 0.15, scale.border + 0.03 * grain)) * (0.25 + 0.75 * low);
    let chip = (1.0 - smoothstep(0.0, 0.14, flake.border + 0.04 * grain)) * (0.15 + 0.85 * flake_low);
    let lift = 0.22 * (-scale.to_point[1]).clamp(-0.6, 0.6) + 0.10 * (-flake.to_point[1]).clamp(-0.6, 0.6);
    let body = 0.58 + lift + 0.24 * (scale.value - 0.5) + 0.12 * (flake.value - 0.5) + 0.12 * grain;
    let height = (body * (1.0 - 0.75 * gap) - 0.16 * chip).clamp(0.0, 1.0);

    let deep = Vec3::new(0.200, 0.160, 0.130);
    let grey = Vec3::new(0.420, 0.378, 0.332);
    let red = Vec3::new(0.400, 0.322, 0.262);
    let stain = octaves(x, y, [4, 6], 4, 52);
    let redness = smoothstep(0.2, 0.9, 0.45 * scale.value + 0.35 * flake.value + 0.45 * stain + 0.15);
    let mut color = grey.lerp(red, redness).lerp(deep, (0.85 * gap + 0.35 * chip).min(1.0));
    color *= 0.90 + 0.22 * (height - 0.4) + 0.16 * grain + 0.12 * (flake.value - 0.5) + 0.08 * stain;
    Place { height, color }
}
