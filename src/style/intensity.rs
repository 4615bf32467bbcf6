//! Intensity maps made from a colour texture [Luft 2006, 4.3]: its luminance quantised to three levels, one map each. What a
//! painter would trace by hand is found by k-means, so that the levels are those of the texture and not of its exposure.

use crate::math::{luminance, srgb_to_linear};
use glam::Vec3;

/// Levels of an intensity texture: dark, medium, bright, as in the maps of particles.
pub const LEVELS: usize = 3;

/// The two luminances (linear) that part dark from medium and medium from bright texels, by k-means over the `values`. Values
/// that are not finite do not count. Fewer than three different values give thresholds between which nothing lies.
pub fn thresholds(values: &[f32]) -> [f32; LEVELS - 1] {
    let mut sorted: Vec<f32> = values.iter().copied().filter(|value| value.is_finite()).collect();
    if sorted.is_empty() {
        return [0.0; LEVELS - 1];
    }
    sorted.sort_by(f32::total_cmp);
    // Begin at the thirds, move each mean to its values until none moves.
    let at = |share: f32| sorted[((sorted.len() - 1) as f32 * share) as usize];
    let mut means = [at(1.0 / 6.0), at(0.5), at(5.0 / 6.0)];
    for _ in 0..64 {
        let limits = [0.5 * (means[0] + means[1]), 0.5 * (means[1] + means[2])];
        let (mut sums, mut counts) = ([0.0f64; LEVELS], [0usize; LEVELS]);
        for value in &sorted {
            let level = level_of(*value, limits);
            sums[level] += f64::from(*value);
            counts[level] += 1;
        }
        let mut next = means;
        for (mean, (sum, count)) in next.iter_mut().zip(sums.into_iter().zip(counts)) {
            if count > 0 {
                *mean = (sum / count as f64) as f32;
            }
        }
        if next == means {
            break;
        }
        means = next;
    }
    [0.5 * (means[0] + means[1]), 0.5 * (means[1] + means[2])]
}

/// The level (0 dark, 1 medium, 2 bright) of a luminance.
pub fn level_of(luminance: f32, thresholds: [f32; LEVELS - 1]) -> usize {
    thresholds.iter().filter(|threshold| luminance > **threshold).count()
}

/// An intensity texture of an sRGB texture with alpha, 4 bytes a texel: one channel a level, the alpha as it is. Transparent
/// texels have no intensity and do not count.
pub fn intensity_texture(rgba: &[u8]) -> Vec<u8> {
    let light = |texel: &[u8]| {
        let linear = |byte: Option<&u8>| srgb_to_linear(f32::from(byte.copied().unwrap_or(0)) / 255.0);
        luminance(Vec3::new(linear(texel.first()), linear(texel.get(1)), linear(texel.get(2))))
    };
    let opaque = |texel: &&[u8]| texel.get(3).is_some_and(|alpha| *alpha >= 128);
    let values: Vec<f32> = rgba.chunks_exact(4).filter(opaque).map(light).collect();
    let limits = thresholds(&values);
    let mut texture = vec![0; rgba.len()];
    for (out, texel) in texture.chunks_exact_mut(4).zip(rgba.chunks_exact(4)) {
        if opaque(&texel) {
            out[level_of(light(texel), limits)] = 255;
        }
        out[3] = texel[3];
    }
    texture
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_tones_are_parted_between_them() {
        let values: Vec<f32> = (0..300).map(|i| [0.05, 0.2, 0.6][i % 3]).collect();
        let limits = thresholds(&values);
        assert!(limits[0] > 0.05 && limits[0] < 0.2 && limits[1] > 0.2 && limits[1] < 0.6, "{limits:?}");
        assert_eq!([0.05, 0.2, 0.6].map(|value| level_of(value, limits)), [0, 1, 2]);
        // The exposure does not matter.
        let brighter: Vec<f32> = values.iter().map(|value| 1.5 * value).collect();
        let scaled = thresholds(&brighter);
        assert!((scaled[0] - 1.5 * limits[0]).abs() < 1e-5);
    }

    #[test]
    fn nothing_and_one_tone_have_levels_too() {
        assert_eq!(thresholds(&[]), [0.0, 0.0]);
        let one = thresholds(&[0.3; 9]);
        assert_eq!(level_of(0.3, one), 0);
        assert_eq!(thresholds(&[f32::NAN]), [0.0, 0.0]);
    }

    #[test]
    fn each_opaque_texel_is_in_one_map_and_alpha_stays() {
        let rgba: Vec<u8> = (0..=255u8).flat_map(|v| [v, v, v, if v < 16 { 0 } else { 255 }]).collect();
        let texture = intensity_texture(&rgba);
        for (texel, source) in texture.chunks_exact(4).zip(rgba.chunks_exact(4)) {
            assert_eq!(texel[3], source[3]);
            let maps = texel[..3].iter().filter(|value| **value == 255).count();
            assert_eq!(maps, usize::from(source[3] >= 128));
        }
        let shares = (0..3).map(|map| texture.iter().skip(map).step_by(4).filter(|value| **value == 255).count());
        assert!(shares.clone().all(|count| count > 20), "{:?}", shares.collect::<Vec<_>>());
    }
}
