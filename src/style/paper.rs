//! Papers, drawn by code: tileable height maps.

use std::f32::consts::TAU;

use crate::math::{color::unorm8, hash::unit_f32};

/// A paper for watercolour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Paper {
    /// Smooth, with the finest grain.
    HotPressed,
    /// The usual paper: rounded bumps.
    #[default]
    ColdPressed,
    /// Deep, coarse bumps.
    Rough,
    /// Fine parallel ribs from the mould's wires.
    Laid,
    /// The weave of a canvas.
    Canvas,
}

impl Paper {
    /// All papers.
    pub const ALL: [Self; 5] = [Self::HotPressed, Self::ColdPressed, Self::Rough, Self::Laid, Self::Canvas];

    /// Their names.
    pub const NAMES: &[&str] = &[
        Self::HotPressed.name(),
        Self::ColdPressed.name(),
        Self::Rough.name(),
        Self::Laid.name(),
        Self::Canvas.name(),
    ];

    /// Name in scene files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::HotPressed => "hot-pressed",
            Self::ColdPressed => "cold-pressed",
            Self::Rough => "rough",
            Self::Laid => "laid",
            Self::Canvas => "canvas",
        }
    }

    /// The paper of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|paper| paper.name() == name.trim())
    }

    /// Side of the height map in texels; it repeats.
    pub const SIDE: usize = 512;

    /// The height map, row by row: 0 valleys, 255 hills. Its mean is about a half, and it repeats without a seam.
    pub fn heights(self) -> Vec<u8> {
        let side = Self::SIDE;
        let mut heights: Vec<f32> = (0..side * side).map(|i| self.height(i % side, i / side)).collect();
        // To a mean of a half, and a deviation that is the paper's own.
        let count = heights.len() as f32;
        let mean = heights.iter().sum::<f32>() / count;
        let deviation = (heights.iter().map(|height| (height - mean).powi(2)).sum::<f32>() / count).sqrt().max(1e-6);
        let wanted = self.deviation();
        heights.iter_mut().for_each(|height| *height = 0.5 + (*height - mean) * wanted / deviation);
        heights.into_iter().map(unorm8).collect()
    }

    /// Standard deviation of the heights.
    const fn deviation(self) -> f32 {
        match self {
            Self::HotPressed => 0.07,
            Self::ColdPressed => 0.17,
            Self::Rough => 0.22,
            Self::Laid => 0.13,
            Self::Canvas => 0.18,
        }
    }

    fn height(self, column: usize, row: usize) -> f32 {
        let (x, y) = (column as f32 / Self::SIDE as f32, row as f32 / Self::SIDE as f32);
        // Warped, so that nothing is a lattice.
        let warp = |seed| 0.014 * (noise(x, y, 20, seed) - 0.5) + 0.006 * (noise(x, y, 64, seed + 2) - 0.5);
        let (u, v) = (x + warp(11), y + warp(21));
        let fibres = noise(u, v, 200, 3) - 0.5;
        match self {
            Self::HotPressed => 0.4 * tooth(u, v, 96, 1) + fibres,
            Self::ColdPressed => tooth(u, v, 56, 1) + 0.35 * bumps(u, v, 72, 2) + 0.35 * fibres,
            Self::Rough => tooth(u, v, 36, 1) + 0.6 * bumps(u, v, 48, 2) + 0.25 * fibres,
            Self::Laid => 0.5 * (TAU * 64.0 * v).sin() + 0.25 * (TAU * 6.0 * u).sin().max(0.8) + 0.8 * fibres,
            Self::Canvas => {
                let (across, along) = ((TAU * 48.0 * u).sin(), (TAU * 48.0 * v).sin());
                across * along + 0.5 * (across.abs() - along.abs()) + 0.5 * fibres
            }
        }
    }
}

/// The tooth of a felt: three octaves of noise from `cells` cells along each side, 0..1.
fn tooth(x: f32, y: f32, cells: usize, seed: u64) -> f32 {
    let octave = |factor: usize, weight: f32| weight * noise(x, y, factor * cells, seed + 100 * factor as u64);
    octave(1, 0.5) + octave(2, 0.32) + octave(4, 0.18)
}

/// Value noise of `cells` cells along each side, 0..1; it repeats.
fn noise(x: f32, y: f32, cells: usize, seed: u64) -> f32 {
    let (x, y) = (x * cells as f32, y * cells as f32);
    let (column, row) = (x.floor(), y.floor());
    let fade = |t: f32| t * t * (3.0 - 2.0 * t);
    let (fx, fy) = (fade(x - column), fade(y - row));
    let at = |dx: i64, dy: i64| {
        let wrap = |value: f32, step: i64| (value as i64 + step).rem_euclid(cells as i64) as u64;
        unit_f32(seed, wrap(column, dx) + wrap(row, dy) * cells as u64, 0u64)
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    mix(mix(at(0, 0), at(1, 0), fx), mix(at(0, 1), at(1, 1), fx), fy)
}

/// Rounded bumps on a jittered lattice of `cells` cells along each side, 0..1: 1 at a bump's top [Worley 1996].
fn bumps(x: f32, y: f32, cells: usize, seed: u64) -> f32 {
    let (x, y) = (x * cells as f32, y * cells as f32);
    let mut nearest = f32::INFINITY;
    for dy in -1..=1i64 {
        for dx in -1..=1i64 {
            let (column, row) = (x.floor() as i64 + dx, y.floor() as i64 + dy);
            let wrap = |value: i64| value.rem_euclid(cells as i64) as u64;
            let index = wrap(column) + wrap(row) * cells as u64;
            let point = [1u64, 2].map(|stream| unit_f32(seed, index, stream));
            let (ox, oy) = (column as f32 + point[0] - x, row as f32 + point[1] - y);
            nearest = nearest.min(ox * ox + oy * oy);
        }
    }
    (1.0 - nearest).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn papers_differ_repeat_without_a_seam_and_have_a_mean_of_a_half() {
        let mut all = Vec::new();
        for paper in Paper::ALL {
            assert_eq!(Paper::named(paper.name()), Some(paper));
            let heights = paper.heights();
            assert_eq!(heights.len(), Paper::SIDE * Paper::SIDE);
            let mean = heights.iter().map(|height| f32::from(*height)).sum::<f32>() / heights.len() as f32;
            assert!((mean - 127.5).abs() < 5.0, "{paper:?}: {mean}");
            // Steps across the seam are those inside.
            let step = |a: usize, b: usize| (f32::from(heights[a]) - f32::from(heights[b])).abs();
            let side = Paper::SIDE;
            let seam = (0..side).map(|row| step(row * side, row * side + side - 1)).sum::<f32>() / side as f32;
            let inside = (0..side).map(|row| step(row * side + 200, row * side + 201)).sum::<f32>() / side as f32;
            assert!(seam < 2.0 * inside + 1.0, "{paper:?}: {seam} across the seam, {inside} inside");
            all.push(heights);
        }
        for (i, paper) in all.iter().enumerate() {
            assert!(all.iter().skip(i + 1).all(|other| other != paper));
        }
        assert_eq!(Paper::named("cardboard"), None);
    }

    #[test]
    fn a_paper_is_the_same_each_time() {
        assert_eq!(Paper::ColdPressed.heights(), Paper::ColdPressed.heights());
    }
}
