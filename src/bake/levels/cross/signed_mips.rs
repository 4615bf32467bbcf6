//! Mips of four signed values a texel. The shaders read them by `signed_texel` in `shaders/common/signed_texel.wgsl`.

use glam::Vec4;

use crate::math::MipChain;

/// Mips as bytes, of which 128 stands for 0 and 255 for `scale`; a texture of `resolution`² texels (a power of two) on top. Each
/// value is a sum with its weight, the coverage. Means are weighted with it, from level to level in floating point; a texel
/// of air has the value of the coarser level, and `empty` where there is no plant at all.
pub(super) fn signed_mips(values: Vec<(Vec4, f32)>, resolution: usize, scale: f32, empty: Vec4) -> MipChain {
    let mut levels = vec![values];
    let mut size = resolution;
    while size > 1 {
        let half = size / 2;
        let finer = levels.last().map_or(&[][..], Vec::as_slice);
        let halved = (0..half * half).map(|at| {
            let corner = 2 * (at / half) * size + 2 * (at % half);
            [corner, corner + 1, corner + size, corner + size + 1]
                .iter()
                .fold((Vec4::ZERO, 0.0), |(sum, weight), &i| (sum + finer[i].0, weight + finer[i].1))
        });
        let halved = halved.collect();
        levels.push(halved);
        size = half;
    }
    let mut above = vec![empty];
    let mut coded: Vec<Vec<u8>> = Vec::with_capacity(levels.len());
    for (depth, level) in levels.into_iter().rev().enumerate() {
        let (size, coarser) = (1usize << depth, (1usize << depth) / 2);
        let mean = |(at, (sum, weight)): (usize, &(Vec4, f32))| {
            let parent = (at / size / 2) * coarser + at % size / 2;
            if *weight > 0.0 { *sum / *weight } else { above[parent.min(above.len() - 1)] }
        };
        let means: Vec<Vec4> = level.iter().enumerate().map(mean).collect();
        coded.push(means.iter().flat_map(|mean| mean.to_array().map(|value| code(value, scale))).collect());
        above = means;
    }
    coded.reverse();
    MipChain { width: resolution as u32, height: resolution as u32, levels: coded }
}

/// A value as a byte, at least 1; 128, which is 0, where it is not a number.
pub(super) fn code(value: f32, scale: f32) -> u8 {
    128u8.wrapping_add_signed(((value / scale).clamp(-1.0, 1.0) * 127.0).round() as i8)
}
