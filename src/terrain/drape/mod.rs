//! A drape: a photograph over the ground, such as an orthophoto, in the terrain's own metres.
//!
//! [`read_drape`] brings a photograph, or several tiles of one, from their coordinates to the local frame of a terrain. The
//! texels of a [`Drape`] are colours times opacity, so that filtering does not mix the colour of transparent texels in.
//!
//! Where the photograph covers the whole of a mirrored terrain it is mirrored with it. Otherwise it gives way to the ground's own
//! colour at its border, over a strip of up to 20 m.

mod join;

use glam::{DVec2, Vec3, Vec4};
use rayon::prelude::*;

pub use join::{read_drape, read_drape_bytes};

use crate::math::{
    MipChain,
    color::{LINEAR_OF_CODE, srgb8, unorm8},
    smoothstep,
};

/// The most texels along a side of a drape: 256 MiB and their mip levels.
pub const MOST_SIDE: u32 = 8192;
/// Texels that a pattern must be wide, at the least, for the photograph to have it. The detail of narrower ones is that of the
/// ground's own colour: the ratio of this colour to its mean over so many texels.
pub const DETAIL_TEXELS: f32 = 2.0;
/// The least that this ratio may be.
pub const LEAST_DETAIL: f32 = 0.4;
/// The most that it may be.
pub const MOST_DETAIL: f32 = 2.5;
/// Metres over which a photograph gives way to the ground at its border, at most.
const WIDEST_EDGE: f64 = 20.0;

/// A photograph over the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Drape {
    min: DVec2,
    extent: DVec2,
    mirrored: bool,
    mips: MipChain,
}

impl Drape {
    /// A drape of `columns` × `rows` texels over the rectangle from `min` (metres, x east, z south) that measures `extent` metres.
    /// The texels go row by row from the north: sRGB and opacity, colours multiplied by it (in linear light). `mirrored`: whether
    /// it is mirrored at its borders.
    ///
    /// `None` for another number of texels, none of them, or a rectangle without a finite area.
    pub fn new(min: DVec2, extent: DVec2, columns: u32, rows: u32, texels: Vec<u8>, mirrored: bool) -> Option<Self> {
        let whole = texels.len() as u64 == 4 * u64::from(columns) * u64::from(rows) && !texels.is_empty();
        let placed = min.is_finite() && extent.is_finite() && extent.min_element() > 0.0;
        (whole && placed).then(|| Self { min, extent, mirrored, mips: mips(columns, rows, texels) })
    }

    /// The north-western corner, metres (x east, z south).
    pub fn min(&self) -> DVec2 {
        self.min
    }

    /// Width and depth in metres.
    pub fn extent(&self) -> DVec2 {
        self.extent
    }

    /// Whether it is mirrored at its borders, as its terrain is.
    pub fn is_mirrored(&self) -> bool {
        self.mirrored
    }

    /// Columns and rows.
    pub fn size(&self) -> (u32, u32) {
        (self.mips.width, self.mips.height)
    }

    /// Metres of a texel along its longer side.
    pub fn texel(&self) -> f64 {
        (self.extent / DVec2::new(f64::from(self.mips.width), f64::from(self.mips.height))).max_element()
    }

    /// Metres over which it gives way to the ground at its border; 0 where it is mirrored.
    pub fn edge(&self) -> f64 {
        if self.mirrored { 0.0 } else { WIDEST_EDGE.min(0.1 * self.extent.min_element()) }
    }

    /// The texels with their mip levels.
    pub fn mips(&self) -> &MipChain {
        &self.mips
    }

    /// Linear colour times coverage (x, y, z) and coverage 0..1 (w) at a position in metres (x east, z south), bilinear.
    pub fn sample(&self, xz: DVec2) -> Vec4 {
        let mut uv = (xz - self.min) / self.extent;
        if !uv.is_finite() {
            return Vec4::ZERO;
        }
        if self.mirrored {
            // A triangle wave: 0 to 1 and back.
            uv = (uv - 2.0 * (0.5 * uv).round()).abs();
        } else if uv.min_element() < 0.0 || uv.max_element() > 1.0 {
            return Vec4::ZERO;
        }
        let size = DVec2::new(f64::from(self.mips.width), f64::from(self.mips.height));
        let at = uv * size - 0.5;
        let corner = at.floor();
        let f = (at - corner).as_vec2();
        let texel = |dx: f64, dy: f64| {
            let place = (corner + DVec2::new(dx, dy)).clamp(DVec2::ZERO, size - 1.0);
            let index = place.y as usize * self.mips.width as usize + place.x as usize;
            let bytes = self.mips.levels.first().and_then(|texels| texels.get(4 * index..4 * index + 4));
            bytes.map_or(Vec4::ZERO, linear)
        };
        let north = texel(0.0, 0.0).lerp(texel(1.0, 0.0), f.x);
        let south = texel(0.0, 1.0).lerp(texel(1.0, 1.0), f.x);
        north.lerp(south, f.y) * self.inside(uv)
    }

    /// How much the photograph covers at a position in its rectangle, 0..1: less at its border.
    fn inside(&self, uv: DVec2) -> f32 {
        if self.mirrored {
            return 1.0;
        }
        let metres = uv.min(1.0 - uv) * self.extent;
        smoothstep(0.0, self.edge().max(1e-6) as f32, metres.min_element() as f32)
    }

    /// All that it looks like, as bytes for a fingerprint.
    pub(crate) fn feed(&self, hasher: &mut blake3::Hasher) {
        hasher.update(bytemuck::bytes_of(&self.min));
        hasher.update(bytemuck::bytes_of(&self.extent));
        hasher.update(&[u8::from(self.mirrored)]);
        self.mips.levels.first().map(|texels| hasher.update(texels));
    }
}

/// The linear colour and the opacity of four bytes.
fn linear(bytes: &[u8]) -> Vec4 {
    let [r, g, b, a] = [0, 1, 2, 3].map(|channel| bytes.get(channel).copied().unwrap_or(0));
    let [r, g, b] = [r, g, b].map(|code| LINEAR_OF_CODE[usize::from(code)]);
    Vec4::new(r, g, b, f32::from(a) / 255.0)
}

/// The code of a colour (times opacity) and opacity.
fn encode(color: Vec3, opacity: f32) -> [u8; 4] {
    [srgb8(color.x), srgb8(color.y), srgb8(color.z), unorm8(opacity)]
}

/// The mip levels of texels: means of 2 × 2 in linear light.
fn mips(columns: u32, rows: u32, texels: Vec<u8>) -> MipChain {
    let mut chain = MipChain { width: columns, height: rows, levels: vec![texels] };
    for level in 1..=columns.max(rows).ilog2() as usize {
        let ((wide, high), (columns, rows)) = (chain.level_size(level - 1), chain.level_size(level));
        let above = &chain.levels[level - 1];
        let mut texels = vec![0; 4 * columns as usize * rows as usize];
        texels.par_chunks_exact_mut(4 * columns as usize).enumerate().for_each(|(y, row)| {
            for (x, texel) in row.chunks_exact_mut(4).enumerate() {
                let at = |dx: usize, dy: usize| {
                    let (x, y) = ((2 * x + dx).min(wide as usize - 1), (2 * y + dy).min(high as usize - 1));
                    linear(&above[4 * (y * wide as usize + x)..])
                };
                let mean = 0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1));
                texel.copy_from_slice(&encode(mean.truncate(), mean.w));
            }
        });
        chain.levels.push(texels);
    }
    chain
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Red, green / blue, white, of 10 m each.
    fn four(mirrored: bool) -> Drape {
        let texels = vec![255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 255];
        Drape::new(DVec2::new(-10.0, -10.0), DVec2::splat(20.0), 2, 2, texels, mirrored).unwrap()
    }

    #[test]
    fn middles_of_texels_have_their_colours_and_between_them_it_is_a_mixture() {
        let drape = four(true);
        assert_eq!(drape.texel(), 10.0);
        for (x, z, expected) in [
            (-5.0, -5.0, Vec3::X),
            (5.0, -5.0, Vec3::Y),
            (-5.0, 5.0, Vec3::Z),
            (5.0, 5.0, Vec3::ONE),
            (0.0, 0.0, Vec3::splat(0.5)),
        ] {
            let found = drape.sample(DVec2::new(x, z));
            assert!(found.abs_diff_eq(expected.extend(1.0), 1e-6), "{x} {z}: {found}");
        }
    }

    #[test]
    fn a_mirrored_drape_goes_on_and_another_ends_softly() {
        let drape = four(true);
        for (inside, outside) in [(-5.0, -15.0), (5.0, 15.0), (-5.0, 35.0), (-5.0, 25.0)] {
            let (a, b) = (drape.sample(DVec2::new(inside, 3.0)), drape.sample(DVec2::new(outside, 3.0)));
            assert!(a.abs_diff_eq(b, 1e-6), "{inside} {outside}: {a} {b}");
        }
        let drape = four(false);
        assert_eq!(drape.edge(), 2.0);
        let cover = |x: f64| drape.sample(DVec2::new(x, 0.0)).w;
        assert_eq!((cover(-10.1), cover(10.1), cover(0.0), cover(8.0)), (0.0, 0.0, 1.0, 1.0));
        assert!((cover(9.0) - 0.5).abs() < 1e-5 && cover(9.9) < 0.02);
    }

    #[test]
    fn levels_keep_the_mean_light() {
        let drape = four(true);
        assert_eq!(drape.mips().levels.len(), 2);
        // Half of the light of each channel is code 188.
        assert_eq!(drape.mips().levels[1], [188, 188, 188, 255]);
        let odd = Drape::new(DVec2::ZERO, DVec2::ONE, 5, 3, vec![100; 60], false).unwrap();
        assert!(odd.mips().is_whole() && odd.mips().levels.len() == 3);
        assert!(odd.mips().levels[2].iter().all(|byte| *byte == 100));
    }

    #[test]
    fn strange_places_and_sizes_give_nothing() {
        for strange in [f64::NAN, f64::INFINITY, 1e300] {
            assert!(four(true).sample(DVec2::splat(strange)).is_finite());
            assert_eq!(four(false).sample(DVec2::splat(strange)), Vec4::ZERO);
        }
        assert!(Drape::new(DVec2::ZERO, DVec2::ONE, 0, 0, Vec::new(), false).is_none());
        assert!(Drape::new(DVec2::ZERO, DVec2::ONE, 2, 2, vec![0; 15], false).is_none());
        assert!(Drape::new(DVec2::ZERO, DVec2::new(0.0, 1.0), 1, 1, vec![0; 4], false).is_none());
    }
}
