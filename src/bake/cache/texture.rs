//! The files of filtered textures: their key, and the payload, which is the bytes of the mip levels one after the other,
//! full size first. Level 0 is left out where it is the plant's own image, which the reader has.

use std::sync::Arc;

use image::RgbaImage;

use super::codec;
use crate::bake::textures::filtered::{FilteredTexture, TextureUse, smaller_sizes};

/// Identifier of a filtered texture: a hash of its image and use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TextureKey([u8; 32]);

impl TextureKey {
    /// Hashes `image` and `usage`.
    pub fn new(image: &RgbaImage, usage: TextureUse) -> Self {
        let (kind, cutoff) = match usage {
            TextureUse::Color => (0u32, 0),
            TextureUse::Leaf { cutoff } => (1, cutoff.to_bits()),
            TextureUse::Normals => (2, 0),
        };
        let mut hasher = blake3::Hasher::new();
        // No plant's key begins with this.
        hasher.update(b"texture");
        for word in [codec::VERSION, kind, cutoff, image.width(), image.height()] {
            hasher.update(&word.to_le_bytes());
        }
        hasher.update(image.as_raw());
        Self(*hasher.finalize().as_bytes())
    }

    /// The key as 64 hexadecimal digits.
    pub fn to_hex(self) -> String {
        blake3::Hash::from_bytes(self.0).to_hex().to_string()
    }
}

/// The file of `texture`, which was filtered from `image`.
pub(super) fn encode(key: &TextureKey, texture: &FilteredTexture, image: &RgbaImage) -> Vec<u8> {
    let base = if **texture.base() == *image { &[] } else { texture.base().as_raw().as_slice() };
    let levels: Vec<&[u8]> = std::iter::once(base).chain(texture.smaller().iter().map(Vec::as_slice)).collect();
    codec::sealed(&levels.concat(), &key.0)
}

/// Reads a file that should hold the texture with `key`, the key of `image`. `None` if anything is wrong with it.
pub(super) fn decode(file: &[u8], key: &TextureKey, image: &Arc<RgbaImage>) -> Option<FilteredTexture> {
    let mut payload = codec::opened(file, &key.0)?;
    let sizes = smaller_sizes(image.width(), image.height());
    let base = match payload.len().checked_sub(sizes.iter().sum())? {
        0 => Arc::clone(image),
        own => {
            let (base, rest) = payload.split_at_checked(own)?;
            payload = rest;
            // `None` if these are not the bytes of an image of that size, or more.
            let whole = own == image.as_raw().len();
            Arc::new(RgbaImage::from_raw(image.width(), image.height(), base.to_vec()).filter(|_| whole)?)
        }
    };
    let mut smaller = Vec::with_capacity(sizes.len());
    for size in sizes {
        let (level, rest) = payload.split_at_checked(size)?;
        smaller.push(level.to_vec());
        payload = rest;
    }
    FilteredTexture::from_levels(base, smaller)
}

#[cfg(test)]
mod tests {
    use image::Rgba;

    use super::*;

    const USES: [TextureUse; 3] = [TextureUse::Color, TextureUse::Leaf { cutoff: 0.5 }, TextureUse::Normals];

    fn image(width: u32, height: u32) -> Arc<RgbaImage> {
        let alpha = |x: u32, y: u32| if (x / 3 + y / 2).is_multiple_of(2) { 255 } else { 40 };
        Arc::new(RgbaImage::from_fn(width, height, |x, y| Rgba([(7 * x) as u8, (31 * y) as u8, 90, alpha(x, y)])))
    }

    #[test]
    fn what_is_written_is_read() {
        for (width, height) in [(0, 0), (0, 3), (1, 1), (7, 3), (16, 32)] {
            let image = image(width, height);
            for usage in USES {
                let (key, texture) = (TextureKey::new(&image, usage), FilteredTexture::new(&image, usage));
                let file = encode(&key, &texture, &image);
                assert_eq!(decode(&file, &key, &image), Some(texture), "{width} x {height}, {usage:?}");
            }
        }
    }

    #[test]
    fn an_image_that_filtering_keeps_is_neither_written_nor_copied() {
        let image = image(16, 16);
        for usage in [TextureUse::Color, TextureUse::Normals] {
            let (key, texture) = (TextureKey::new(&image, usage), FilteredTexture::new(&image, usage));
            let file = encode(&key, &texture, &image);
            assert!(file.len() < image.as_raw().len());
            let read = decode(&file, &key, &image).unwrap();
            assert!(Arc::ptr_eq(texture.base(), &image) && Arc::ptr_eq(read.base(), &image));
        }
    }

    #[test]
    fn a_file_cut_or_changed_at_any_byte_counts_as_absent() {
        let image = image(4, 4);
        for usage in USES {
            let key = TextureKey::new(&image, usage);
            let file = encode(&key, &FilteredTexture::new(&image, usage), &image);
            for length in 0..file.len() {
                assert!(decode(&file[..length], &key, &image).is_none(), "cut at {length}");
            }
            for at in 0..file.len() {
                let mut changed = file.clone();
                changed[at] ^= 0x10;
                assert!(decode(&changed, &key, &image).is_none(), "changed at {at}");
            }
            // A payload of another length, with a good checksum.
            for length in (0..400).filter(|length| *length != 20 && *length != 84) {
                assert!(decode(&codec::sealed(&vec![0; length], &key.0), &key, &image).is_none(), "{length} bytes");
            }
        }
    }

    #[test]
    fn every_use_threshold_and_texel_has_its_own_key() {
        let (one, mut other) = (image(8, 4), RgbaImage::clone(&image(8, 4)));
        other.put_pixel(3, 3, Rgba([1, 2, 3, 4]));
        let turned = RgbaImage::from_raw(4, 8, one.as_raw().clone()).unwrap();
        let leaf = TextureUse::Leaf { cutoff: 0.5f32.next_up() };
        let mut keys: Vec<String> =
            USES.iter().chain([&leaf]).map(|usage| TextureKey::new(&one, *usage).to_hex()).collect();
        keys.extend([&other, &turned].map(|image| TextureKey::new(image, TextureUse::Color).to_hex()));
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), 6);
    }
}
