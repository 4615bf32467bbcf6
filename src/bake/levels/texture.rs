//! Textures of baked levels: their texels, and the same block-compressed.
//!
//! A device that reads blocks holds a quarter or a half of the bytes, and reads correspondingly less per sample. The blocks are those of the [Khronos Data Format Specification 1.3], encoded once by the bake and kept in the cache.
//! Cost and error: `docs/measurements/texture-compression.md`.
//!
//! [Khronos Data Format Specification 1.3]: https://registry.khronos.org/DataFormat/specs/1.3/dataformat.1.3.html

use bevy::reflect::Reflect;
use dds::{
    ColorFormat, CompressionQuality, DecodeOptions, EncodeOptions, Format, ImageView, ImageViewMut, Size, decode,
    encode,
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::math::{MipChain, MipView};

/// Texels along a side of a block.
const BLOCK: u32 = 4;
/// Bytes of a block, in either encoding.
const BLOCK_BYTES: usize = 16;
/// Rows of texels that one task encodes.
const ROWS_PER_TASK: usize = 32;
/// The next higher quality takes four times as long for up to a sixth less error of a texel.
const QUALITY: CompressionQuality = CompressionQuality::Fast;

/// Which devices get textures in blocks: BC7 and BC5, a third of the memory of crosses and a quarter of that of clouds. From 103 plants of
/// five planes on, the light of the sun on crosses stays texels on most devices: its blocks take twice as many layers of a texture array.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Reflect)]
pub enum Compression {
    /// Those that read such blocks, except for software drivers: these unpack a block for each texel.
    #[default]
    Automatic,
    /// Those that read such blocks, software drivers included.
    WherePossible,
    /// None.
    Never,
}

/// How a texture is compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockEncoding {
    /// BC7: a quarter of the bytes. The four channels of a block share one or two lines in the space of colours, so this is for
    /// channels that change together.
    Whole,
    /// BC5 twice, red with green and blue with alpha: half of the bytes. Each channel has its own line, so this is for channels
    /// that have nothing to do with each other.
    Pairs,
}

impl BlockEncoding {
    /// Sets of blocks that a texture has.
    pub fn sets(self) -> usize {
        match self {
            Self::Whole => 1,
            Self::Pairs => 2,
        }
    }

    fn format(self) -> Format {
        match self {
            Self::Whole => Format::BC7_UNORM,
            Self::Pairs => Format::BC5_UNORM,
        }
    }
}

/// A texture of a baked level.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LevelTexture {
    /// RGBA8.
    pub texels: MipChain,
    /// The same in blocks: [as many sets](BlockEncoding::sets) as its encoding has, or none.
    pub blocks: Vec<BlockMips>,
}

/// Mips in blocks, which go row by row from the top: those from full size down to the last whose width and height are multiples of
/// four.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BlockMips(#[serde(with = "crate::math::byte_lists")] pub Vec<Vec<u8>>);

impl LevelTexture {
    /// The texture with its blocks. They depend on the texels alone, not on the number of threads.
    pub fn compressed(texels: MipChain, encoding: BlockEncoding) -> Self {
        let mips = |set: usize| {
            let mip = |level: usize| blocks(texels.levels.get(level)?, texels.level_size(level), encoding, set);
            BlockMips((0..whole_levels(&texels)).map_while(mip).collect())
        };
        let blocks = (0..encoding.sets()).map(mips).collect();
        Self { texels, blocks }
    }

    /// The texture without blocks.
    pub fn plain(texels: MipChain) -> Self {
        Self { texels, blocks: Vec::new() }
    }

    /// Width and height of the finest mip, mips as texels, and mips in each set of blocks.
    pub fn shape(&self) -> (u32, u32, usize, Vec<usize>) {
        let MipChain { width, height, ref levels } = self.texels;
        (width, height, levels.len(), self.blocks.iter().map(|mips| mips.0.len()).collect())
    }

    /// What a device reads from its blocks in place of the texels; `None` if they are not in this encoding. Mips without blocks are
    /// the texels themselves.
    pub fn decoded(&self, encoding: BlockEncoding) -> Option<MipChain> {
        if self.blocks.len() != encoding.sets() {
            return None;
        }
        let MipChain { width, height, ref levels } = self.texels;
        let decode = |(level, texels): (usize, &Vec<u8>)| {
            let sets: Option<Vec<&Vec<u8>>> = self.blocks.iter().map(|mips| mips.0.get(level)).collect();
            sets.map_or_else(|| Some(texels.clone()), |sets| decoded(&sets, self.texels.level_size(level), encoding))
        };
        let levels: Option<Vec<_>> = levels.iter().enumerate().map(decode).collect();
        Some(MipChain { width, height, levels: levels? })
    }

    /// Whether every mip has as many bytes as its size requires.
    pub fn is_whole(&self) -> bool {
        let fits = |(level, blocks): (usize, &Vec<u8>)| blocks.len() == block_bytes(self.texels.level_size(level));
        let levels = whole_levels(&self.texels);
        self.texels.is_whole()
            && self.blocks.len() <= BlockEncoding::Pairs.sets()
            && self.blocks.iter().all(|mips| mips.0.len() <= levels && mips.0.iter().enumerate().all(fits))
    }

    /// Its mips for an upload in a set of its blocks; `None` if it has no such set.
    pub fn block_view(&self, set: usize) -> Option<MipView<'_>> {
        let MipChain { width, height, .. } = self.texels;
        let levels = self.blocks.get(set)?.0.iter().map(Vec::as_slice).collect();
        Some(MipView { width, height, levels })
    }

    /// Bytes of all mips, in blocks if it has any, or as texels.
    pub fn bytes(&self, in_blocks: bool) -> usize {
        let sum = |levels: &Vec<Vec<u8>>| -> usize { levels.iter().map(Vec::len).sum() };
        if in_blocks && !self.blocks.is_empty() {
            self.blocks.iter().map(|mips| sum(&mips.0)).sum()
        } else {
            sum(&self.texels.levels)
        }
    }
}

/// Bytes of a square texture of `edge` texels along a side, a power of two, with `levels` mips: its blocks in an encoding, or its
/// texels.
pub fn square_bytes(edge: u32, levels: u32, encoding: Option<BlockEncoding>) -> usize {
    let edges = (0..levels).filter_map(|level| edge.checked_shr(level));
    match encoding {
        Some(encoding) => {
            let whole = edges.filter(|edge| *edge >= BLOCK);
            encoding.sets() * whole.map(|edge| block_bytes((edge, edge))).sum::<usize>()
        }
        None => edges.map(|edge| 4 * edge as usize * edge as usize).sum(),
    }
}

/// Number of mips, from full size down, that blocks cover without a remainder.
fn whole_levels(texels: &MipChain) -> usize {
    let covered = |&level: &usize| {
        let (width, height) = texels.level_size(level);
        width > 0 && height > 0 && width.is_multiple_of(BLOCK) && height.is_multiple_of(BLOCK)
    };
    (0..texels.levels.len()).take_while(covered).count()
}

fn block_bytes((width, height): (u32, u32)) -> usize {
    (width / BLOCK) as usize * (height / BLOCK) as usize * BLOCK_BYTES
}

/// The blocks of a mip in a set of an encoding. Its sides are multiples of four; `None` if it has another number of bytes.
fn blocks(texels: &[u8], (width, height): (u32, u32), encoding: BlockEncoding, set: usize) -> Option<Vec<u8>> {
    let row = width as usize * 4;
    if texels.len() != row * height as usize {
        return None;
    }
    let mut options = EncodeOptions::default();
    options.quality = QUALITY;
    let of_rows = |rows: &[u8]| -> Option<Vec<u8>> {
        let size = Size::new(width, (rows.len() / row) as u32);
        let pair = |texel: &[u8; 4]| [texel[2 * set], texel[2 * set + 1], 0, 255];
        let chosen: Vec<u8> = match encoding {
            BlockEncoding::Whole => rows.to_vec(),
            BlockEncoding::Pairs => rows.as_chunks::<4>().0.iter().flat_map(pair).collect(),
        };
        let mut blocks = Vec::with_capacity(block_bytes((size.width, size.height)));
        let view = ImageView::new(&chosen, size, ColorFormat::RGBA_U8)?;
        encode(&mut blocks, view, encoding.format(), None, &options).ok()?;
        Some(blocks)
    };
    let bands: Option<Vec<_>> = texels.par_chunks(ROWS_PER_TASK * row).map(of_rows).collect();
    bands.map(|bands| bands.concat())
}

/// The texels of a mip from its sets of blocks.
fn decoded(sets: &[&Vec<u8>], (width, height): (u32, u32), encoding: BlockEncoding) -> Option<Vec<u8>> {
    let of_set = |blocks: &&Vec<u8>| -> Option<Vec<u8>> {
        let mut texels = vec![0; width as usize * height as usize * 4];
        let view = ImageViewMut::new(&mut texels, Size::new(width, height), ColorFormat::RGBA_U8)?;
        decode(&mut blocks.as_slice(), view, encoding.format(), &DecodeOptions::default()).ok()?;
        Some(texels)
    };
    let texels: Option<Vec<_>> = sets.iter().map(of_set).collect();
    let mut texels = texels?.into_iter();
    let first = texels.next()?;
    let Some(second) = texels.next() else { return Some(first) };
    let both = first.as_chunks::<4>().0.iter().zip(second.as_chunks::<4>().0);
    Some(both.flat_map(|(a, b)| [a[0], a[1], b[0], b[1]]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> MipChain {
        let mut levels = Vec::new();
        let (mut w, mut h) = (width, height);
        let half = |side: u32| side.min((side / 2).max(1));
        loop {
            levels.push((0..h).flat_map(|y| (0..w).map(move |x| (x, y))).flat_map(|(x, y)| texel(x, y)).collect());
            if w.max(h) <= 1 {
                return MipChain { width, height, levels };
            }
            (w, h) = (half(w), half(h));
        }
    }

    /// Root mean square over all channels, of 255.
    fn error(texels: MipChain, encoding: BlockEncoding) -> f64 {
        let texture = LevelTexture::compressed(texels, encoding);
        assert!(texture.is_whole());
        let (mut square, mut count) = (0.0, 0usize);
        let read = texture.decoded(encoding).unwrap();
        for (wanted, got) in texture.texels.levels.iter().zip(&read.levels).take(texture.blocks[0].0.len()) {
            square += wanted.iter().zip(got).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum::<f64>();
            count += got.len();
        }
        (square / count as f64).sqrt()
    }

    const ENCODINGS: [BlockEncoding; 2] = [BlockEncoding::Whole, BlockEncoding::Pairs];

    #[test]
    fn blocks_show_what_the_texels_show_in_fewer_bytes() {
        let smooth = |x: u32, y: u32| [(3 * x) as u8, (2 * y) as u8, (x + y) as u8, 255 - (x * y / 20) as u8];
        for (encoding, share) in [(BlockEncoding::Whole, 4), (BlockEncoding::Pairs, 2)] {
            let compressed = LevelTexture::compressed(texture(64, 64, smooth), encoding);
            assert_eq!(compressed.blocks[0].0.len(), 5, "64, 32, 16, 8 and 4 texels");
            assert_eq!(compressed.blocks[0].0[0].len() * encoding.sets() * share, compressed.texels.levels[0].len());
            assert_eq!(compressed.bytes(true), square_bytes(64, 7, Some(encoding)));
            assert_eq!(compressed.bytes(false), square_bytes(64, 7, None));
            let error = error(texture(64, 64, smooth), encoding);
            assert!(error < 1.5, "{encoding:?}: {error}");
        }
    }

    #[test]
    fn pairs_keep_channels_apart_that_share_nothing() {
        // Each channel is a slope in another direction, with steps of its own.
        let apart = |x: u32, y: u32| [40 * (x % 4) + 30, 40 * (y % 4) + 60, 50 * ((x + y) % 3), 60 * ((x + 2 * y) % 4)];
        let texels = || texture(32, 32, |x, y| apart(x, y).map(|value| value as u8));
        let [whole, pairs] = ENCODINGS.map(|encoding| error(texels(), encoding));
        assert!(pairs < 0.4 * whole && pairs < 8.0, "{pairs} in pairs, {whole} as a whole");
    }

    #[test]
    fn a_single_color_stays() {
        for encoding in ENCODINGS {
            for color in [[0, 0, 0, 0], [255; 4], [128; 4], [1, 254, 90, 128]] {
                let texture = LevelTexture::compressed(texture(8, 8, |_, _| color), encoding);
                let read = texture.decoded(encoding).unwrap();
                let off = read.levels[0].iter().zip(color.iter().cycle()).map(|(a, b)| a.abs_diff(*b)).max();
                assert!(off <= Some(1), "{encoding:?}, {color:?}: {off:?}");
            }
        }
    }

    #[test]
    fn sizes_that_blocks_do_not_cover_have_none() {
        for (width, height, levels) in [(0, 0, 0), (0, 4, 0), (1, 1, 0), (2, 8, 0), (6, 8, 0), (8, 4, 1), (12, 24, 1)] {
            let texels = texture(width, height, |x, y| [x as u8, y as u8, 9, 9]);
            let compressed = LevelTexture::compressed(texels, BlockEncoding::Pairs);
            assert_eq!(compressed.shape().3, [levels; 2], "{width} x {height}");
            assert!(compressed.is_whole());
        }
        let mut short = texture(8, 8, |_, _| [7; 4]);
        short.levels[1].pop();
        let short = LevelTexture::compressed(short, BlockEncoding::Whole);
        assert!(short.blocks[0].0.len() == 1 && !short.is_whole());
    }

    #[test]
    fn blocks_of_another_number_are_not_whole() {
        let compressed = LevelTexture::compressed(texture(8, 8, |_, _| [7; 4]), BlockEncoding::Whole);
        let with = |blocks: Vec<Vec<Vec<u8>>>| {
            let blocks = blocks.into_iter().map(BlockMips).collect();
            LevelTexture { blocks, ..compressed.clone() }.is_whole()
        };
        assert!(with(vec![vec![vec![0; 64], vec![0; 16]]]) && with(Vec::new()));
        assert!(!with(vec![vec![vec![0; 65], vec![0; 16]]]));
        assert!(!with(vec![vec![vec![0; 64], vec![0; 16], vec![0; 16]]]), "2 x 2 texels are no block");
        assert!(!with(vec![Vec::new(); 3]), "no encoding has three sets");
        assert!(compressed.decoded(BlockEncoding::Pairs).is_none(), "they are BC7");
        assert_eq!(LevelTexture::plain(compressed.texels.clone()).bytes(true), compressed.bytes(false));
    }

    #[test]
    fn the_number_of_threads_does_not_change_blocks() {
        let texels = texture(128, 128, |x, y| crate::math::hash::mix32(x / 3 + 977 * (y / 5)).to_le_bytes());
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| ENCODINGS.map(|encoding| LevelTexture::compressed(texels.clone(), encoding)))
        };
        assert!(on(1) == on(3));
    }
}
