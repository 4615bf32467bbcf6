//! Paints what pots, walls and paths are made of: albedo, sRGB, opaque; every texture tiles.

use glam::Vec3;
use image::{Rgba, RgbaImage};

use super::lattice::{cell, octaves};
use crate::math::{linear_to_srgb, smoothstep};

/// Width and height of the textures.
const SIZE: u32 = 512;

/// Materials of pots, walls and paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::plant::grow) enum Masonry {
    /// Fired clay with a bloom of lime.
    Terracotta,
    /// White glazed ware.
    Glaze,
    /// Potting soil.
    Soil,
    /// Lime plaster with stains.
    Plaster,
    /// Slabs of sandstone with joints; a slab is half of the texture.
    Paving,
    /// Weathered planks; a plank is a quarter of the texture high.
    Planks,
}

impl Masonry {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Terracotta, Self::Glaze, Self::Soil, Self::Plaster, Self::Paving, Self::Planks];

    /// Width of one repeat of the texture, metres.
    pub fn metres(self) -> f32 {
        match self {
            Self::Terracotta | Self::Glaze => 0.35,
            Self::Soil => 0.25,
            Self::Plaster => 1.6,
            Self::Paving => 1.1,
            Self::Planks => 0.5,
        }
    }

    /// Paints the texture.
    pub fn paint(self) -> RgbaImage {
        RgbaImage::from_fn(SIZE, SIZE, |x, y| {
            let (u, v) = ((x as f32 + 0.5) / SIZE as f32, (y as f32 + 0.5) / SIZE as f32);
            let [r, g, b] =
                self.at(u, v).to_array().map(|value| (linear_to_srgb(value.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8);
            Rgba([r, g, b, 255])
        })
    }

    /// Linear albedo.
    fn at(self, u: f32, v: f32) -> Vec3 {
        match self {
            Self::Terracotta => {
                let clay = Vec3::new(0.43, 0.165, 0.075) * (1.0 + 0.16 * octaves(u, v, [6, 6], 5, 1));
                let turning = 1.0 + 0.035 * octaves(u, v, [2, 64], 2, 2);
                let bloom = smoothstep(0.10, 0.65, octaves(u, v, [4, 4], 5, 3));
                (clay * turning).lerp(Vec3::new(0.60, 0.47, 0.36), 0.45 * bloom)
            }
            Self::Glaze => Vec3::new(0.72, 0.71, 0.66) * (1.0 + 0.025 * octaves(u, v, [3, 3], 4, 4)),
            Self::Soil => {
                let crumb = cell(22.0 * u, 22.0 * v, [22, 22], 1.0, 5);
                let shade = smoothstep(0.0, 0.35, crumb.border) * (0.55 + 0.75 * crumb.value);
                Vec3::new(0.050, 0.034, 0.023) * (0.35 + shade) * (1.0 + 0.4 * octaves(u, v, [40, 40], 2, 6))
            }
            Self::Plaster => {
                let even = octaves(u, v, [3, 3], 6, 7);
                let grain = octaves(u, v, [90, 90], 2, 8);
                let stain = smoothstep(0.0, 0.7, octaves(u, v, [5, 2], 4, 9));
                let wall = Vec3::new(0.50, 0.425, 0.32) * (1.0 + 0.07 * even + 0.05 * grain);
                wall.lerp(Vec3::new(0.30, 0.245, 0.18), 0.40 * stain)
            }
            Self::Paving => {
                // A running bond of two rows.
                let row = (2.0 * v) as i32;
                let across = (2.0 * u + 0.5 * (row % 2) as f32).rem_euclid(2.0);
                let (x, y) = (across.fract(), (2.0 * v).fract());
                let edge = x.min(1.0 - x).min(y).min(1.0 - y) + 0.006 * octaves(u, v, [24, 24], 3, 10);
                let slab = ((across as i32 + 2 * row) as f32 * 0.618).fract();
                let tone = Vec3::new(0.29, 0.245, 0.19).lerp(Vec3::new(0.235, 0.22, 0.195), slab);
                let face = tone
                    * (0.92 + 0.16 * slab + 0.12 * octaves(u, v, [5, 5], 5, 11))
                    * (1.0 + 0.08 * octaves(u, v, [120, 120], 1, 12));
                Vec3::new(0.11, 0.105, 0.075).lerp(face, smoothstep(0.008, 0.022, edge))
            }
            Self::Planks => {
                let row = (4.0 * v) as i32;
                let y = (4.0 * v).fract();
                let gap = smoothstep(0.0, 0.05, y.min(1.0 - y));
                let fibre = octaves(u, v, [3, 96], 3, 13) + 0.5 * octaves(u, v, [1, 24], 3, 14);
                let tone = 0.85 + 0.25 * (row as f32 * 0.618).fract();
                Vec3::new(0.30, 0.235, 0.165) * (tone * (1.0 + 0.22 * fibre) * (0.25 + 0.75 * gap))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textures_tile_and_have_the_albedo_of_stone() {
        for kind in Masonry::ALL {
            let image = kind.paint();
            let (mut step, mut seam, mut mean) = (0.0, 0.0, 0.0);
            for i in 0..SIZE {
                let at = |x: u32, y: u32| f32::from(image.get_pixel(x, y)[1]);
                step += (at(i, 200) - at((i + 1) % SIZE, 200)).abs();
                seam += (at(0, i) - at(SIZE - 1, i)).abs();
                mean += at(i, i) / 255.0 / SIZE as f32;
            }
            assert!(seam < 2.0 * step + 512.0, "{kind:?}: {seam} {step}");
            assert!((0.05..0.95).contains(&mean), "{kind:?}: {mean}");
        }
    }
}
