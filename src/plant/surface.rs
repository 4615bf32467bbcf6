//! A plant's material at a point of its surface, as the GPU would sample it: textures repeat, filtering is bilinear.

use std::sync::{Arc, LazyLock};

use glam::{Vec2, Vec3};
use image::{GrayImage, ImageBuffer, Pixel, RgbaImage};

use super::{PartKind, PlantPart};
use crate::math::srgb_to_linear;

/// Linear values of the 256 sRGB codes.
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|code| srgb_to_linear(code as f32 / 255.0)));

/// The four texels around a texture coordinate, upper row first, and its position between them, 0..1.
struct Footprint {
    texels: [usize; 4],
    /// Column and row of the first.
    first: (usize, usize),
    right: f32,
    down: f32,
}

/// One part's material, ready to be sampled.
pub(crate) struct Surface {
    /// Base colour texture; `None` also where the image holds no texel.
    texture: Option<Arc<RgbaImage>>,
    factor: Vec3,
    /// What comes through, where a texture says so.
    transmission: Option<Arc<RgbaImage>>,
    /// The alpha test; `None` for opaque parts.
    test: Option<AlphaTest>,
}

/// The alpha test of a part.
struct AlphaTest {
    /// Threshold, 0..255.
    threshold: f32,
    /// The alphas of all texels. Packed: this is read in the innermost loop of the rasteriser, and caches are small.
    alphas: Vec<u8>,
    /// What the blends have in common that start in each block of [`BLOCK`]² texels, row by row. Most need no alphas,
    /// and these few bytes stay in the nearest cache.
    blocks: Vec<Common>,
    blocks_across: usize,
}

/// Texels along the side of a block.
const BLOCK: usize = 4;

/// What the alphas of neighbouring texels have in common.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Common {
    /// All reach the threshold, and so does every blend of them.
    Covered,
    /// None does.
    Empty,
    /// Some do.
    Mixed,
}

impl AlphaTest {
    fn new(image: &RgbaImage, cutoff: f32) -> Self {
        let threshold = 255.0 * cutoff;
        let alphas: Vec<u8> = image.as_raw().chunks_exact(4).map(|texel| texel[3]).collect();
        let (width, height) = (image.width() as usize, image.height() as usize);
        let (across, down) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
        let common = |block: usize| {
            let (x, y) = (block % across * BLOCK, block / across * BLOCK);
            // A blend also takes the next texels to the right and below, around the edge.
            let texel = |i: usize| (y + i / (BLOCK + 1)) % height * width + (x + i % (BLOCK + 1)) % width;
            let reaches = |i: usize| f32::from(alphas[texel(i)]) >= threshold;
            match (0..(BLOCK + 1).pow(2)).filter(|i| reaches(*i)).count() {
                0 => Common::Empty,
                all if all == (BLOCK + 1).pow(2) => Common::Covered,
                _ => Common::Mixed,
            }
        };
        let blocks = (0..across * down).map(common).collect();
        Self { threshold, alphas, blocks, blocks_across: across }
    }
}

impl Surface {
    /// The material of `part`.
    pub fn new(part: &PlantPart) -> Self {
        let texture = filled(&part.material.base_color_texture);
        let test = texture
            .as_ref()
            .filter(|_| part.kind == PartKind::Foliage)
            .map(|image| AlphaTest::new(image, part.material.alpha_cutoff));
        let transmission = filled(&part.material.leaf_textures.transmission);
        Self { texture, factor: part.material.base_color, transmission, test }
    }

    /// Whether there is an alpha test that may fail.
    pub fn is_tested(&self) -> bool {
        self.test.is_some()
    }

    /// Whether the surface is there at `uv`: the alpha test.
    pub fn passes(&self, uv: Vec2) -> bool {
        let (Some(image), Some(test)) = (&self.texture, &self.test) else { return true };
        let Footprint { texels: [a, b, c, d], first: (x, y), right, down } = footprint(image.dimensions(), uv);
        match test.blocks[y / BLOCK * test.blocks_across + x / BLOCK] {
            Common::Covered => return true,
            Common::Empty => return false,
            Common::Mixed => {}
        }
        let alpha = |texel: usize| f32::from(test.alphas[texel]);
        let upper = alpha(a) + right * (alpha(b) - alpha(a));
        let lower = alpha(c) + right * (alpha(d) - alpha(c));
        upper + down * (lower - upper) >= test.threshold
    }

    /// Linear base colour at `uv`: texture times factor. In alpha-tested parts the four texels are also weighted by
    /// their alpha, so that a colour behind the outline never bleeds in.
    pub fn color(&self, uv: Vec2) -> Vec3 {
        let Some(image) = &self.texture else { return self.factor };
        let alpha = |texel: usize| self.test.as_ref().map_or(1.0, |test| f32::from(test.alphas[texel]));
        blend(image, uv, alpha).map_or(self.factor, |(sum, total)| self.factor * sum / total)
    }

    /// Linear colour of what comes through at `uv`, 0..=1, where a texture says so.
    pub fn transmission(&self, uv: Vec2) -> Option<Vec3> {
        Some(color_of(self.transmission.as_deref()?, uv))
    }
}

/// An image, if it has texels.
pub(crate) fn filled<T: Pixel>(image: &Option<Arc<Image<T>>>) -> Option<Arc<Image<T>>> {
    image.clone().filter(|image| image.width() > 0 && image.height() > 0)
}

/// An image of pixels `T`.
pub(crate) type Image<T> = ImageBuffer<T, Vec<<T as Pixel>::Subpixel>>;

/// Linear colour of `image` at `uv`, its texels weighted by their alpha, so that colours beyond an outline do not bleed in. White
/// where all are transparent. The image must have texels.
pub(crate) fn color_of(image: &RgbaImage, uv: Vec2) -> Vec3 {
    blend(image, uv, |texel| f32::from(image.as_raw()[4 * texel + 3])).map_or(Vec3::ONE, |(sum, total)| sum / total)
}

/// Value of `image` at `uv`, 0..=1. The image must have texels.
pub(crate) fn value_of(image: &GrayImage, uv: Vec2) -> f32 {
    filtered(image.dimensions(), uv, |texel| f32::from(image.as_raw()[texel]) / 255.0)
}

/// The values of the four texels around `uv`, filtered bilinearly.
fn filtered(size: (u32, u32), uv: Vec2, value: impl Fn(usize) -> f32) -> f32 {
    let Footprint { texels: [a, b, c, d], right, down, .. } = footprint(size, uv);
    let (upper, lower) = (value(a) + right * (value(b) - value(a)), value(c) + right * (value(d) - value(c)));
    upper + down * (lower - upper)
}

/// Alpha of `image` at `uv`, 0..=1. The image must have texels.
pub(crate) fn alpha_of(image: &RgbaImage, uv: Vec2) -> f32 {
    filtered(image.dimensions(), uv, |texel| f32::from(image.as_raw()[4 * texel + 3]) / 255.0)
}

/// The first three channels of `image` at `uv` as they are, 0..=1. The image must have texels.
pub(crate) fn channels_of(image: &RgbaImage, uv: Vec2) -> Vec3 {
    let Footprint { texels: [a, b, c, d], right, down, .. } = footprint(image.dimensions(), uv);
    let texel = |at: usize| {
        let texel = &image.as_raw()[4 * at..];
        Vec3::new(f32::from(texel[0]), f32::from(texel[1]), f32::from(texel[2])) / 255.0
    };
    texel(a).lerp(texel(b), right).lerp(texel(c).lerp(texel(d), right), down)
}

/// The weighted sum of the linear colours of the four texels around `uv`, and the sum of the weights: those of bilinear filtering
/// times `weight_of`. `None` where all are 0.
fn blend(image: &RgbaImage, uv: Vec2, weight_of: impl Fn(usize) -> f32) -> Option<(Vec3, f32)> {
    let Footprint { texels, right, down, .. } = footprint(image.dimensions(), uv);
    let weights = [(1.0 - right) * (1.0 - down), right * (1.0 - down), (1.0 - right) * down, right * down];
    let (mut sum, mut total) = (Vec3::ZERO, 0.0);
    for (at, weight) in texels.into_iter().zip(weights) {
        let weight = weight * weight_of(at);
        let code = |channel: usize| LINEAR[usize::from(image.as_raw()[4 * at + channel])];
        sum += weight * Vec3::new(code(0), code(1), code(2));
        total += weight;
    }
    (total > 0.0).then_some((sum, total))
}

fn footprint((width, height): (u32, u32), uv: Vec2) -> Footprint {
    // Along one axis: the two texel indices and the weight of the second.
    let axis = |coordinate: f32, size: u32| {
        let wrapped = coordinate - floor(coordinate);
        let at = if (0.0..=1.0).contains(&wrapped) { wrapped * size as f32 - 0.5 } else { 0.0 };
        let low = floor(at);
        let first = if low < 0.0 { size - 1 } else { (low as u32).min(size - 1) };
        let second = if first + 1 < size { first + 1 } else { 0 };
        (first as usize, second as usize, at - low)
    };
    let (x0, x1, right) = axis(uv.x, width);
    let (y0, y1, down) = axis(uv.y, height);
    let (upper, lower) = (y0 * width as usize, y1 * width as usize);
    Footprint { texels: [upper + x0, upper + x1, lower + x0, lower + x1], first: (x0, y0), right, down }
}

/// The largest integer not above `value`, which must be smaller than 2^31 by amount. `f32::floor` is a call into the
/// system's library on processors that are not known to have SSE 4.1, and this is the innermost loop.
fn floor(value: f32) -> f32 {
    let toward_zero = value as i32 as f32;
    if toward_zero > value { toward_zero - 1.0 } else { toward_zero }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use image::Rgba;

    use super::*;
    use crate::plant::{PlantMaterial, PlantMesh};

    fn part(kind: PartKind, image: RgbaImage) -> PlantPart {
        let material = PlantMaterial { base_color_texture: Some(Arc::new(image)), ..Default::default() };
        PlantPart { kind, mesh: PlantMesh::default(), material }
    }

    #[test]
    fn textures_repeat_and_hidden_colour_stays_hidden() {
        let image = RgbaImage::from_fn(2, 1, |x, _| if x == 0 { Rgba([255, 0, 0, 255]) } else { Rgba([0, 0, 255, 0]) });
        let leaf = part(PartKind::Foliage, image);
        let surface = Surface::new(&leaf);
        for turn in [-3.0, 0.0, 2.0] {
            assert!(surface.passes(Vec2::new(0.25 + turn, 0.5)));
            assert!(!surface.passes(Vec2::new(0.75 + turn, 0.5)));
        }
        assert_eq!(surface.color(Vec2::new(0.45, 0.5)), Vec3::X);
        for strange in [f32::NAN, f32::INFINITY, -1e20, 3e9] {
            assert!(surface.color(Vec2::splat(strange)).is_finite());
        }
    }

    #[test]
    fn blocks_answer_as_the_blend_does() {
        for (width, height) in [(1, 1), (3, 2), (13, 9), (32, 32)] {
            // Holes and patches of several texels, so that blocks of every kind occur.
            let alpha = |x: u32, y: u32| ((x / 5 * 7 + y / 6 * 13) % 3 * 60 + (x * 31 + y * 17) % 80) as u8;
            let image = RgbaImage::from_fn(width, height, |x, y| Rgba([0, 0, 0, alpha(x, y)]));
            let leaf = part(PartKind::Foliage, image.clone());
            let surface = Surface::new(&leaf);
            for i in 0..4000u32 {
                let uv = Vec2::new(i as f32 * 0.618_034, i as f32 * 0.381_966 * 0.07) - 3.0;
                let Footprint { texels: [a, b, c, d], right, down, .. } = footprint(image.dimensions(), uv);
                let alpha = |texel: usize| f32::from(image.as_raw()[4 * texel + 3]);
                let (upper, lower) =
                    (alpha(a) + right * (alpha(b) - alpha(a)), alpha(c) + right * (alpha(d) - alpha(c)));
                let covered = upper + down * (lower - upper) >= 255.0 * leaf.material.alpha_cutoff;
                assert_eq!(surface.passes(uv), covered, "{width} x {height}, {uv}");
            }
        }
    }

    #[test]
    fn wood_and_untextured_foliage_are_opaque() {
        let bark = part(PartKind::Wood, RgbaImage::new(1, 1));
        assert!(Surface::new(&bark).passes(Vec2::ZERO));
        let nothing = part(PartKind::Foliage, RgbaImage::new(0, 0));
        assert!(Surface::new(&nothing).passes(Vec2::ZERO));
    }
}
