//! Noise of the ground's colour: the twin of `shaders/terrain/ground_noise.wgsl`, for the ground truth and for tests.
//!
//! Gradient noise [Perlin 1985; the fade of Perlin 2002] over a hashed lattice: it has no period that anybody could
//! see (2³² cells: 270 km at the finest octave, 4 million km at the widest). Octave `i` has cells of `1024 / 2^i`
//! metres. The lattices of neighbouring octaves are rotated by the angle of a 3-4-5 triangle, so that a block of 5,120 m
//! is a whole number of cells of every octave, whichever way it is rotated: the device counts cells from the camera's
//! block with 32-bit integers, and positions in f32 from the block's middle, and gets the cells that f64 has here.
//!
//! Each octave is faded out where it would be finer than a pixel ([`visible_part`]); a step of the noise becomes wider
//! by the variance that is missing ([`noise_step`]), so that far ground has the mean colour of near ground.

use glam::{DVec2, Vec2};

use crate::math::{hash::mix32, smoothstep};

/// Side in metres of the blocks that the device counts positions from: a whole number of cells of every octave.
pub const NOISE_BLOCK: f64 = 5120.0;

/// Standard deviation of a gradient noise whose gradients are uniform in the square ±1 and which is faded by the quintic.
pub const OCTAVE_DEVIATION: f32 = 0.1761;
/// Weight of an octave relative to the one before.
pub const WEIGHT_RATIO: f32 = 0.85;
/// The octave in whose cells leaves and blades lie: of 6.25 cm.
pub const LEAF_OCTAVE: i32 = 14;
/// Their seed; those of the octaves are their numbers.
pub const LEAF_SEED: u32 = 99;

/// Where a point lies in the lattice of an octave.
struct LatticePoint {
    cell: [u32; 2],
    /// In the cell, 0..1.
    within: Vec2,
}

impl LatticePoint {
    fn new(xz: DVec2, octave: i32) -> Self {
        let (sine, cosine) = match octave % 3 {
            0 => (0.0, 1.0),
            1 => (0.8, 0.6),
            _ => (-0.8, 0.6),
        };
        let rotated = DVec2::new(cosine * xz.x - sine * xz.y, sine * xz.x + cosine * xz.y);
        let shift = f64::from(octave) * DVec2::new(0.37, 0.71);
        let position = rotated * (f64::from(octave).exp2() / 1024.0) + shift;
        let corner = position.floor();
        let within = (position - corner).as_vec2();
        let within = if within.is_finite() { within } else { Vec2::ZERO };
        Self { cell: [corner.x, corner.y].map(|c| c as i64 as u32), within }
    }
}

fn hash_row(z: u32, seed: u32) -> u32 {
    mix32(z.wrapping_add(seed.wrapping_mul(0x632b_e5ab)))
}

fn hash_cell(x: u32, row: u32) -> u32 {
    mix32(x.wrapping_mul(0x9e37_79b1).wrapping_add(row))
}

/// `unpack4x8snorm` of WGSL.
fn unpack_snorm(bits: u32) -> [f32; 4] {
    bits.to_le_bytes().map(|byte| (f32::from(byte as i8) / 127.0).max(-1.0))
}

/// Two independent noises of standard deviation 1 in one octave, 0 to 24, at a position in metres (x east, y south).
pub fn noise_octave(xz: DVec2, octave: i32) -> Vec2 {
    let LatticePoint { cell: [x, z], within: f } = LatticePoint::new(xz, octave);
    let corner = |dx: u32, dz: u32| {
        let row = hash_row(z.wrapping_add(dz), octave as u32);
        let [ax, ay, bx, by] = unpack_snorm(hash_cell(x.wrapping_add(dx), row));
        let offset = f - Vec2::new(dx as f32, dz as f32);
        Vec2::new(ax, bx) * offset.x + Vec2::new(ay, by) * offset.y
    };
    let fade = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let near = corner(0, 0).lerp(corner(1, 0), fade.x);
    let far = corner(0, 1).lerp(corner(1, 1), fade.x);
    near.lerp(far, fade.y) / OCTAVE_DEVIATION
}

/// The part of a pattern with this wavelength that a pixel of the width `footprint` can show (both in metres), 0..1: none
/// below one and a half pixels, all above four.
pub fn visible_part(wavelength: f32, footprint: f32) -> f32 {
    smoothstep(1.5, 4.0, wavelength / footprint.max(1e-6))
}

/// Some neighbouring octaves of noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseBand {
    /// Two independent noises, of mean 0 and standard deviation 1 where all octaves are visible.
    pub value: Vec2,
    /// The part of their variance that is too fine for the pixel, 0..1.
    pub lost: f32,
}

/// The octaves from `first` on, `count` of them (1 or more), for pixels of `footprint` metres; 0 shows all of them.
pub fn noise_band(xz: DVec2, first: i32, count: i32, footprint: f32) -> NoiseBand {
    let (mut sum, mut kept, mut weight) = (Vec2::ZERO, 0.0, 1.0f32);
    for octave in first..first + count {
        let visible = visible_part(1024.0 * (-octave as f32).exp2(), footprint);
        if visible <= 0.0 {
            break;
        }
        sum += weight * visible * noise_octave(xz, octave);
        kept += (weight * visible).powi(2);
        weight *= WEIGHT_RATIO;
    }
    let ratio = WEIGHT_RATIO * WEIGHT_RATIO;
    let all = (1.0 - ratio.powi(count)) / (1.0 - ratio);
    NoiseBand { value: sum / all.sqrt(), lost: (1.0 - kept / all).max(0.0) }
}

/// A smooth step of a noise at `center`. The wider it is, the more of the noise's variance, `lost`, is missing: so the
/// mean over many pixels stays the same.
pub fn noise_step(center: f32, half_width: f32, value: f32, lost: f32) -> f32 {
    let width = (half_width * half_width + 3.0 * lost).sqrt();
    smoothstep(center - width, center + width, value)
}

/// Fallen leaves, or blades of grass, of which each cell of [`LEAF_OCTAVE`] has one: the tone of the one on top, -1..1, or
/// 0 where there is none. `half_width` is a fraction of the cell; a leaf is 1.4 cells long.
pub fn scattered_leaves(xz: DVec2, half_width: f32, footprint: f32) -> f32 {
    let cell_size = 1024.0 * (-LEAF_OCTAVE as f32).exp2();
    let visible = visible_part(0.5 * cell_size, footprint);
    if visible <= 0.0 {
        return 0.0;
    }
    let LatticePoint { cell, within } = LatticePoint::new(xz, LEAF_OCTAVE);
    let softness = (footprint / cell_size).max(0.02);
    let first = within.to_array().map(|c| if c < 0.5 { -1i32 } else { 0 });
    let (mut tone, mut top) = (0.0, -2.0);
    for i in 0..4 {
        let neighbour = [first[0] + (i & 1), first[1] + (i >> 1)];
        let row = hash_row(cell[1].wrapping_add_signed(neighbour[1]), LEAF_SEED);
        let leaf = unpack_snorm(hash_cell(cell[0].wrapping_add_signed(neighbour[0]), row));
        let offset =
            within - Vec2::new(neighbour[0] as f32, neighbour[1] as f32) - 0.5 - 0.2 * Vec2::new(leaf[0], leaf[1]);
        let (sine, cosine) = (leaf[2], (1.0 - leaf[2] * leaf[2]).max(0.0).sqrt());
        let along = (offset.x * cosine + offset.y * sine) / 0.7;
        let across = (offset.y * cosine - offset.x * sine).abs();
        let edge = half_width * (1.0 - along * along);
        if along.abs() < 1.0 && leaf[3] > top {
            let covered = ((edge - across) / softness + 0.5).clamp(0.0, 1.0);
            tone += (leaf[3] - tone) * covered;
            if covered > 0.0 {
                top = leaf[3];
            }
        }
    }
    tone * visible
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise along a line, of the octaves that the ground has.
    fn line(origin: DVec2, direction: DVec2, step: f64, count: usize, band: (i32, i32)) -> Vec<f32> {
        (0..count).map(|i| noise_band(origin + direction * (step * i as f64), band.0, band.1, 0.0).value.x).collect()
    }

    fn correlation(a: &[f32], b: &[f32]) -> f64 {
        let mean = |v: &[f32]| v.iter().map(|x| f64::from(*x)).sum::<f64>() / v.len() as f64;
        let (ma, mb) = (mean(a), mean(b));
        let product = |u: &[f32], mu: f64, v: &[f32], mv: f64| {
            u.iter().zip(v).map(|(x, y)| (f64::from(*x) - mu) * (f64::from(*y) - mv)).sum::<f64>()
        };
        product(a, ma, b, mb) / (product(a, ma, a, ma) * product(b, mb, b, mb)).sqrt()
    }

    #[test]
    fn an_octave_has_mean_zero_and_the_stated_deviation_in_both_channels() {
        for octave in [0, 1, 5, 8, 14] {
            let cell = 1024.0 / f64::from(octave).exp2();
            let values: Vec<Vec2> = (0..40_000)
                .map(|i| noise_octave(DVec2::new(f64::from(i % 200), f64::from(i / 200)) * 0.73 * cell, octave))
                .collect();
            let mean = values.iter().copied().sum::<Vec2>() / values.len() as f32;
            let variance = values.iter().map(|v| (*v - mean) * (*v - mean)).sum::<Vec2>() / values.len() as f32;
            assert!(
                mean.abs().max_element() < 0.03 && (variance - 1.0).abs().max_element() < 0.05,
                "{mean} {variance}"
            );
            let both = values.iter().map(|v| v.x * v.y).sum::<f32>() / values.len() as f32;
            assert!(both.abs() < 0.03, "the channels depend on each other: {both}");
        }
    }

    /// The old noise repeated every 2 to 512 metres.
    #[test]
    fn nothing_repeats_within_kilometres() {
        for (band, step) in [((11, 4), 0.02), ((8, 3), 0.2), ((4, 4), 2.0), ((0, 4), 32.0)] {
            let here = line(DVec2::new(13.7, -41.3), DVec2::X, step, 2000, band);
            assert!(correlation(&here, &here) > 0.99, "a control");
            for direction in [DVec2::X, DVec2::Y, DVec2::new(0.6, 0.8)] {
                for shift in (0..13).map(|i| f64::from(1 << i)).chain([3.2, 12.8, 51.2, 640.0, 1280.0, 5120.0]) {
                    // Nearer than some waves the noise is like itself.
                    if shift < 24.0 * step {
                        continue;
                    }
                    let there = line(DVec2::new(13.7, -41.3) + direction * shift, DVec2::X, step, 2000, band);
                    let same = correlation(&here, &there);
                    assert!(same.abs() < 0.35, "band {band:?}: {same} after {shift} m along {direction}");
                }
            }
        }
    }

    /// A stripe is a direction along which the noise changes more slowly than across it.
    #[test]
    fn no_direction_is_smoother_than_another() {
        let band =
            |p: DVec2| [(0, 4), (4, 4), (8, 3), (11, 4)].map(|(first, count)| noise_band(p, first, count, 0.0).value.x);
        let steps = [32.0, 2.0, 0.25, 0.015];
        let mut change = [[0.0f64; 12]; 4];
        for i in 0..3000 {
            let origin = DVec2::new(f64::from(i) * 173.31, f64::from(i) * -97.77);
            for (turn, angle) in (0..12).map(|turn| (turn, f64::from(turn as u32) * std::f64::consts::PI / 12.0)) {
                for (which, step) in steps.iter().enumerate() {
                    let there = band(origin + DVec2::from_angle(angle) * *step)[which];
                    change[which][turn] += f64::from(there - band(origin)[which]).powi(2);
                }
            }
        }
        for (which, change) in change.iter().enumerate() {
            let (low, high) = change.iter().fold((f64::MAX, 0.0f64), |(low, high), c| (low.min(*c), high.max(*c)));
            assert!(high / low < 1.35, "band {which}: {change:?}");
        }
    }

    #[test]
    fn blocks_are_whole_cells_in_every_octave() {
        for octave in 0..=14 {
            for block in [[1i64, 0], [0, 1], [-3, 7], [200, -195]] {
                let offset = DVec2::new(block[0] as f64, block[1] as f64) * NOISE_BLOCK;
                let local = DVec2::new(17.31, -1203.77);
                let (far, near) = (LatticePoint::new(local + offset, octave), LatticePoint::new(local, octave));
                // As the shader counts them.
                let (sine, cosine) = [(0, 5), (4, 3), (-4, 3)][octave as usize % 3];
                let first = [cosine * block[0] - sine * block[1], sine * block[0] + cosine * block[1]];
                let cells = [0, 1].map(|axis| near.cell[axis].wrapping_add((first[axis] << octave) as u32));
                assert_eq!(far.cell, cells, "octave {octave}, block {block:?}");
                assert!(far.within.abs_diff_eq(near.within, 1e-3), "octave {octave}, block {block:?}");
            }
        }
    }

    #[test]
    fn what_is_too_fine_for_a_pixel_is_left_out_and_said() {
        let at = DVec2::new(3.3, 4.4);
        let all = noise_band(at, 8, 3, 0.0);
        assert!(all.lost < 1e-5 && all.value.is_finite());
        let none = noise_band(at, 8, 3, 10.0);
        assert_eq!((none.value, none.lost), (Vec2::ZERO, 1.0));
        let some = noise_band(at, 8, 3, 0.9);
        assert!((0.2..0.8).contains(&some.lost), "{}", some.lost);
        // The mean of a step stays.
        for center in [-0.5, 0.0, 0.8] {
            let values = (0..20_000).map(|i| noise_octave(DVec2::new(f64::from(i) * 3.7, f64::from(i) * 1.3), 9).x);
            let mean = values.map(|value| noise_step(center, 0.4, value, 0.0)).sum::<f32>() / 20_000.0;
            let blurred = noise_step(center, 0.4, 0.0, 1.0);
            assert!((mean - blurred).abs() < 0.05, "step at {center}: {mean} near, {blurred} far");
        }
    }

    #[test]
    fn leaves_lie_everywhere_and_are_on_top_of_each_other() {
        let covered = |half_width: f32| {
            let tones = (0..10_000).map(|i| {
                let at = DVec2::new(f64::from(i % 100), f64::from(i / 100)) * 0.0155;
                scattered_leaves(at, half_width, 0.0)
            });
            tones.filter(|tone| *tone != 0.0).count() as f32 / 10_000.0
        };
        let (leaves, blades) = (covered(0.34), covered(0.1));
        assert!((0.35..0.7).contains(&leaves) && (0.08..0.3).contains(&blades), "{leaves} {blades}");
        assert_eq!(scattered_leaves(DVec2::ONE, 0.34, 1.0), 0.0);
    }

    #[test]
    fn strange_positions_have_finite_noise() {
        for strange in [f64::NAN, f64::INFINITY, 1e300, -1e18] {
            for at in [DVec2::new(strange, 1.0), DVec2::splat(strange)] {
                assert!(noise_band(at, 0, 4, 0.0).value.is_finite() && scattered_leaves(at, 0.3, 0.0).is_finite());
            }
        }
    }
}
