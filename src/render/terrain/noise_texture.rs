//! Tileable noise for the ground's colour ([`crate::terrain::ground_noise`]) on the GPU.

use bevy::render::{
    render_resource::{TextureFormat, TextureView},
    renderer::{RenderDevice, RenderQueue},
};

use crate::{
    math::MipChain,
    render::gpu,
    terrain::ground_noise::{NOISE_SIDE, noise_image},
};

/// Uploads [`noise_image`].
pub fn noise_texture(device: &RenderDevice, queue: &RenderQueue) -> TextureView {
    gpu::texture(device, queue, "canopy_ground_noise", TextureFormat::Rgba8Unorm, mip_chain(&noise_image()).view(), 1)
}

/// Box-filtered levels, all four channels alike: the values are numbers, not colours.
fn mip_chain(image: &image::RgbaImage) -> MipChain {
    let mut levels = vec![image.as_raw().clone()];
    let mut side = NOISE_SIDE as usize;
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
    MipChain { width: NOISE_SIDE, height: NOISE_SIDE, levels }
}
