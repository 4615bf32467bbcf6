//! The colour texture of a cross: base colour without halos, alpha that keeps the coverage and can fade.

use image::RgbaImage;
use rayon::prelude::*;

use super::Texel;
use crate::math::{
    MipChain,
    color::{srgb8, unorm8},
};
use crate::plant::texture::{AlphaFade, alpha_tested_mips, dilate_colors, fade_alpha};

/// Colour mips of a texture of `resolution`² texels. Alpha is the coverage, restructured by [`fade_alpha`] with the
/// cutoff for which the area inside the outline is the sum of the coverages: a thin crown is full of texels that are
/// covered in part, and a cutoff of one half would drop or fill them all.
pub(in crate::bake::levels) fn mips(texels: &[Texel], resolution: usize, fade: AlphaFade) -> MipChain {
    let mut image = outlined(texels, resolution, fade);
    if texels.iter().any(|texel| texel.coverage > 0.0) {
        dilate_colors(&mut image);
    }
    alpha_tested_mips(&image)
}

/// The texels, rows of `width`, as colours whose alpha covers what they cover.
pub(in crate::bake::levels) fn outlined(texels: &[Texel], width: usize, fade: AlphaFade) -> RgbaImage {
    let height = texels.len().checked_div(width).unwrap_or(0);
    let mut image = RgbaImage::new(width as u32, height as u32);
    for (out, texel) in image.pixels_mut().zip(texels) {
        if texel.coverage > 0.0 {
            let color = (texel.color / texel.coverage).to_array().map(srgb8);
            out.0 = [color[0], color[1], color[2], unorm8(texel.coverage).max(1)];
        }
    }
    let coverage: f64 = texels.iter().map(|texel| f64::from(texel.coverage)).sum::<f64>() / texels.len().max(1) as f64;
    if coverage > 0.0 { restructured(&image, coverage, fade) } else { image }
}

/// Restructures alpha so that it covers `coverage` (0..1) of the square.
///
/// The cutoff is found by bisection on the given alpha, whose outline [`fade_alpha`] keeps to a fraction of a texel.
/// What it does not keep, in thin twigs above all, is made good by aiming that much beside the mark.
fn restructured(image: &RgbaImage, coverage: f64, fade: AlphaFade) -> RgbaImage {
    const BISECTIONS: usize = 9;
    const CORRECTIONS: usize = 4;
    const GOOD_ENOUGH: f64 = 0.005;
    let alphas: Vec<u8> = image.pixels().map(|pixel| pixel.0[3]).collect();
    let width = image.width() as usize;
    let cutoff_of = |area: f64| {
        let (mut low, mut high) = (0.5 / 255.0, 1.0f32);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if area_above(&alphas, width, middle) > area { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    let mut best = (f64::INFINITY, image.clone());
    let mut aim = coverage;
    for _ in 0..CORRECTIONS {
        let candidate = fade_alpha(image, cutoff_of(aim), fade);
        let faded: Vec<u8> = candidate.pixels().map(|pixel| pixel.0[3]).collect();
        let ratio = area_above(&faded, width, 0.5) / coverage;
        if (ratio - 1.0).abs() < best.0 {
            best = ((ratio - 1.0).abs(), candidate);
        }
        if best.0 < GOOD_ENOUGH || ratio <= 0.0 {
            break;
        }
        aim /= ratio;
    }
    best.1
}

/// Share of the square in which bilinearly interpolated alpha (rows of `width` texels, borders continued) is at least
/// `threshold` (0..1), from 4 x 4 points a texel: what an alpha test shows at close range.
fn area_above(alphas: &[u8], width: usize, threshold: f32) -> f64 {
    const POINTS: usize = 4;
    let height = alphas.len().checked_div(width).unwrap_or(0);
    let threshold = 255.0 * threshold;
    let all = POINTS * POINTS;
    // Neighbour and its weight for each point in a texel, along one axis.
    let taps: [(usize, f32); POINTS] = std::array::from_fn(|point| {
        let offset = (point as f32 + 0.5) / POINTS as f32 - 0.5;
        (usize::from(offset > 0.0), offset.abs())
    });
    let inside: usize = (0..height)
        .into_par_iter()
        .map(|y| {
            let row = |y: usize| &alphas[y * width..][..width];
            let rows = [row(y.saturating_sub(1)), row(y), row((y + 1).min(height - 1))];
            let mut count = 0;
            for x in 0..width {
                let columns = [x.saturating_sub(1), x, (x + 1).min(width - 1)];
                let near = rows.map(|row| columns.map(|column| f32::from(row[column])));
                let values = || near.as_flattened().iter().copied();
                // Most texels are all inside or all outside.
                if values().all(|alpha| alpha >= threshold) {
                    count += all;
                } else if values().any(|alpha| alpha >= threshold) {
                    for (sy, wy) in taps {
                        let across: [f32; 3] = std::array::from_fn(|i| (1.0 - wy) * near[1][i] + wy * near[2 * sy][i]);
                        let passes =
                            |&&(sx, wx): &&(usize, f32)| (1.0 - wx) * across[1] + wx * across[2 * sx] >= threshold;
                        count += taps.iter().filter(passes).count();
                    }
                }
            }
            count
        })
        .sum();
    inside as f64 / (alphas.len() * all).max(1) as f64
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn the_area_is_that_of_the_outline() {
        let half: Vec<u8> = (0..64 * 64).map(|i| if i % 64 < 32 { 255 } else { 0 }).collect();
        assert!((area_above(&half, 64, 0.5) - 0.5).abs() < 1e-6);
        // The interpolated edge is one texel wide: at 7/8 it lies 3/8 of a texel further in.
        assert!((area_above(&half, 64, 0.875) - (32.0 - 0.375) / 64.0).abs() < 0.126 / 64.0);
        assert_eq!(area_above(&[], 0, 0.5), 0.0);
    }

    /// Noise of coverage around 0.3: a plain cutoff of one half would leave nearly nothing.
    #[test]
    fn coverage_is_kept_where_every_texel_is_covered_in_part() {
        let texels: Vec<Texel> = (0..128 * 128u32)
            .map(|i| {
                let coverage =
                    0.1 + 0.4 * (i.wrapping_mul(0x9e37_79b9).wrapping_add(i / 128 * 77_777) >> 16) as f32 / 65_536.0;
                Texel { coverage, color: coverage * Vec3::new(0.2, 0.6, 0.1), ..Default::default() }
            })
            .collect();
        let wanted = texels.iter().map(|t| f64::from(t.coverage)).sum::<f64>() / texels.len() as f64;
        for fade in [AlphaFade::PerLeaf, AlphaFade::CenterOut] {
            let chain = mips(&texels, 128, fade);
            let top = RgbaImage::from_raw(128, 128, chain.levels[0].clone()).unwrap();
            let alphas: Vec<u8> = top.pixels().map(|pixel| pixel.0[3]).collect();
            let got = area_above(&alphas, 128, 0.5);
            assert!((got / wanted - 1.0).abs() < 0.03, "{fade:?}: {got} for {wanted}");
            // One colour went in, one comes out, outside the outline too.
            assert!(top.pixels().all(|p| p.0[..3] == top.get_pixel(0, 0).0[..3]));
        }
    }

    #[test]
    fn nothing_stays_transparent() {
        let chain = mips(&vec![Texel::default(); 64 * 64], 64, AlphaFade::default());
        assert!(chain.levels.iter().flatten().all(|&byte| byte == 0));
        assert_eq!(chain.levels.len(), 7);
    }
}
