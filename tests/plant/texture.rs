//! Plant textures: coverage, fading, halos.

use canopy::math::{MipChain, linear_to_srgb, resample::resize_to, srgb_to_linear};
use canopy::plant::texture::{
    AlphaFade, alpha_tested_mips, color_mips, dilate_colors, fade_alpha, leaf_mips, normal_mips,
};
use glam::{Vec2, Vec3};
use image::{Rgba, RgbaImage};
use proptest::prelude::*;

/// A texture of leaves: round ones of several sizes with antialiased edges, green on magenta.
pub(super) fn leaves(size: u32, seed: u32) -> RgbaImage {
    let noise = |i: u32, salt: u32| {
        let mut h = (i * 7 + salt).wrapping_mul(0x9E37_79B1) ^ seed.wrapping_mul(0x85EB_CA6B);
        h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        (h >> 8) as f32 / (1u32 << 24) as f32
    };
    let discs: Vec<(Vec2, f32)> = (0..14)
        .map(|i| (Vec2::new(noise(i, 1), noise(i, 2)) * size as f32, size as f32 * (0.03 + 0.09 * noise(i, 3))))
        .collect();
    RgbaImage::from_fn(size, size, |x, y| {
        let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
        let depth = discs.iter().map(|(centre, radius)| radius - at.distance(*centre)).fold(f32::MIN, f32::max);
        let alpha = ((depth + 0.5).clamp(0.0, 1.0) * 255.0).round() as u8;
        if alpha == 0 { Rgba([255, 0, 255, 0]) } else { Rgba([40, 120, 20, alpha]) }
    })
}

/// The background of a cut-out once tinted distant trees: filtering took it in at every leaf's edge.
#[test]
fn the_background_of_a_leaf_texture_never_shows() {
    let chain = leaf_mips(&leaves(256, 1), 0.5);
    assert!(has_all_levels(&chain));
    for (level, bytes) in chain.levels.iter().enumerate() {
        let magenta = bytes.chunks_exact(4).find(|texel| texel[0] > 45 || texel[2] > 25);
        assert_eq!(magenta, None, "level {level}");
    }
}

fn has_all_levels(chain: &MipChain) -> bool {
    let sizes_fit = chain.levels.iter().enumerate().all(|(level, bytes)| {
        let (width, height) = chain.level_size(level);
        bytes.len() == 4 * width as usize * height as usize
    });
    sizes_fit && chain.level_size(chain.levels.len() - 1) == (1, 1)
}

#[test]
fn mips_of_a_fading_texture_draw_the_same_area_at_every_threshold() {
    for (seed, fade) in (0..4).flat_map(|seed| [AlphaFade::PerLeaf, AlphaFade::CenterOut].map(|fade| (seed, fade))) {
        let chain = alpha_tested_mips(&fade_alpha(&leaves(256, seed), 0.5, fade));
        assert!(has_all_levels(&chain));
        for level in (1..chain.levels.len()).filter(|&level| chain.level_size(level).0 >= 8) {
            for threshold in [0.5, 0.6, 0.7, 0.8, 0.9, 0.95] {
                let (drawn, wanted) = (chain.drawn_coverage(level, threshold), chain.drawn_coverage(0, threshold));
                assert!(
                    (drawn - wanted).abs() < 0.02,
                    "seed {seed} {fade:?} level {level} at {threshold}: {drawn}, not {wanted}"
                );
            }
        }
    }
}

#[test]
fn mips_of_a_cut_out_keep_its_area_at_the_cutoff_where_plain_mips_lose_it() {
    // Thin needles: an averaged alpha drops below the cutoff at once.
    let needles = RgbaImage::from_fn(256, 256, |x, _| Rgba([30, 90, 30, if x % 8 < 2 { 255 } else { 0 }]));
    let (kept, plain) = (alpha_tested_mips(&needles), color_mips(&needles));
    for level in 1..=4 {
        assert!((kept.drawn_coverage(level, 0.5) - 0.25).abs() < 0.02, "level {level}");
    }
    assert_eq!(plain.coverage(4, 0.5), 0.0);
}

#[test]
fn texel_and_drawn_coverage_of_a_known_edge() {
    // Half black, half white: interpolated alpha crosses 0.5 in the middle, reaches 0.75 a quarter texel later.
    let half = RgbaImage::from_fn(4, 4, |x, _| Rgba([0, 0, 0, if x < 2 { 0 } else { 255 }]));
    let chain = color_mips(&half);
    assert_eq!(chain.coverage(0, 0.5), 0.5);
    assert!((chain.drawn_coverage(0, 0.5) - 0.5).abs() < 0.02);
    assert!((chain.drawn_coverage(0, 0.75) - 0.4375).abs() < 0.02);
    assert_eq!(chain.coverage(9, 0.5), 0.0);
    assert_eq!(chain.drawn_coverage(9, 0.5), 0.0);
}

#[test]
fn mips_average_in_linear_light_and_ignore_invisible_colours() {
    let board =
        RgbaImage::from_fn(
            2,
            2,
            |x, y| if (x + y) % 2 == 0 { Rgba([255, 255, 255, 255]) } else { Rgba([0, 0, 0, 255]) },
        );
    let grey = (linear_to_srgb(0.5) * 255.0).round() as u8;
    assert_eq!(color_mips(&board).levels[1], [grey, grey, grey, 255]);

    let edge = RgbaImage::from_fn(2, 2, |x, _| if x == 0 { Rgba([10, 200, 30, 255]) } else { Rgba([255, 0, 255, 0]) });
    assert_eq!(color_mips(&edge).levels[1], [10, 200, 30, 128], "the magenta of invisible texels must not show");
}

#[test]
fn no_magenta_bleeds_into_dilated_leaves() {
    let mut image = leaves(64, 3);
    let before = image.clone();
    dilate_colors(&mut image);
    for (texel, old) in image.pixels().zip(before.pixels()) {
        assert_eq!(texel.0[..3], [40, 120, 20]);
        assert_eq!(texel[3], old[3]);
    }
    let mut empty = RgbaImage::from_pixel(8, 8, Rgba([1, 2, 3, 0]));
    dilate_colors(&mut empty);
    assert_eq!(*empty.get_pixel(4, 4), Rgba([1, 2, 3, 0]));
}

#[test]
fn a_fading_leaf_shrinks_evenly_from_its_outline() {
    let size = 200;
    let disc =
        |x: f32, y: f32| ((80.5 - Vec2::new(x + 0.5 - 100.0, y + 0.5 - 100.0).length()).clamp(0.0, 1.0) * 255.0) as u8;
    let image = RgbaImage::from_fn(size, size, |x, y| Rgba([9, 9, 9, disc(x as f32, y as f32)]));
    let faded = fade_alpha(&image, 0.5, AlphaFade::PerLeaf);
    let chain = color_mips(&faded);
    let whole = std::f32::consts::PI * 80.0 * 80.0 / (200.0 * 200.0);
    for threshold in [0.5f32, 0.55, 0.6, 0.7, 0.8, 0.9, 0.95] {
        let wanted = whole * (1.0 - 2.0 * (threshold - 0.5));
        let drawn = chain.drawn_coverage(0, threshold);
        assert!((drawn - wanted).abs() < 0.01, "at {threshold}: {drawn}, not {wanted}");
        // What is left is a disc around the middle.
        let radius = (wanted * 40_000.0 / std::f32::consts::PI).sqrt();
        for (x, y, texel) in faded.enumerate_pixels() {
            let distance = Vec2::new(x as f32 + 0.5 - 100.0, y as f32 + 0.5 - 100.0).length();
            let shown = f32::from(texel[3]) / 255.0 >= threshold;
            assert!(!(shown && distance > radius + 1.5), "({x}, {y}) shows at {threshold}");
            assert!(shown || distance > radius - 1.5, "({x}, {y}) is hidden at {threshold}");
        }
    }
    assert_eq!(faded.get_pixel(0, 0)[3], 0);
    assert!(faded.get_pixel(100, 100)[3] >= 254);
}

#[test]
fn every_leaf_fades_at_its_own_size() {
    // A large and a small square: at 0.75 half of the area of each is gone, at 0.95 each still shows its middle.
    let square = |x: u32, y: u32, at: u32, size: u32| (at..at + size).contains(&x) && (at..at + size).contains(&y);
    let inside = |x, y| square(x, y, 4, 40) || square(x, y, 60, 9);
    let image = RgbaImage::from_fn(80, 80, |x, y| Rgba([0, 0, 0, if inside(x, y) { 255 } else { 0 }]));
    let faded = fade_alpha(&image, 0.5, AlphaFade::PerLeaf);
    let shown = |at: u32, size: u32, threshold: f32| {
        let texels = faded.enumerate_pixels().filter(|(x, y, _)| square(*x, *y, at, size));
        texels.filter(|(_, _, texel)| f32::from(texel[3]) / 255.0 >= threshold).count() as f32 / (size * size) as f32
    };
    for (at, size) in [(4, 40), (60, 9)] {
        assert_eq!(shown(at, size, 0.5), 1.0);
        assert!((shown(at, size, 0.75) - 0.5).abs() < 0.12, "{}", shown(at, size, 0.75));
        assert!(shown(at, size, 0.95) > 0.0);
    }
}

#[test]
fn the_published_fade_goes_from_the_outside_of_the_picture_to_its_centre() {
    // Squares in a chessboard: their distance from the centre decides, not their own outlines.
    let inside = |x: u32, y: u32| x % 10 < 8 && y % 10 < 8;
    let image = RgbaImage::from_fn(160, 100, |x, y| Rgba([7, 7, 7, if inside(x, y) { 255 } else { 0 }]));
    let faded = fade_alpha(&image, 0.5, AlphaFade::CenterOut);
    let (chain, whole) = (color_mips(&faded), f32::from(8u8 * 8) / 100.0);
    let distance = |x: u32, y: u32| Vec2::new(x as f32 + 0.5 - 80.0, y as f32 + 0.5 - 50.0).length();
    for threshold in [0.5f32, 0.6, 0.7, 0.8, 0.9, 0.95] {
        let shown = |texel: &Rgba<u8>| f32::from(texel[3]) / 255.0 >= threshold;
        let farthest_shown = faded.enumerate_pixels().filter(|(_, _, texel)| shown(texel));
        let farthest_shown = farthest_shown.map(|(x, y, _)| distance(x, y)).fold(0.0, f32::max);
        let hidden = faded.enumerate_pixels().filter(|(x, y, texel)| inside(*x, *y) && !shown(texel));
        let nearest_hidden = hidden.map(|(x, y, _)| distance(x, y)).fold(f32::MAX, f32::min);
        assert!(farthest_shown <= nearest_hidden + 1.0, "at {threshold}: {farthest_shown} {nearest_hidden}");
        // As many texels go at each step as by the other fade.
        let wanted = whole * (1.0 - 2.0 * (threshold - 0.5));
        let covered = chain.coverage(0, threshold);
        assert!((covered - wanted).abs() < 0.01, "at {threshold}: {covered}, not {wanted}");
    }
    assert!(faded.get_pixel(80, 50)[3] >= 253);
}

#[test]
fn a_pinhole_stays_a_hole_and_does_not_grow() {
    let image = RgbaImage::from_fn(100, 100, |x, y| {
        let leaf = (10..90).contains(&x) && (10..90).contains(&y) && (x, y) != (50, 50);
        Rgba([0, 0, 0, if leaf { 255 } else { 0 }])
    });
    let faded = fade_alpha(&image, 0.5, AlphaFade::PerLeaf);
    assert!(faded.get_pixel(50, 50)[3] < 128);
    assert!(faded.get_pixel(51, 50)[3] > 240);
}

#[test]
fn normals_are_averaged_as_vectors() {
    let tilted =
        RgbaImage::from_fn(2, 1, |x, _| if x == 0 { Rgba([255, 128, 128, 255]) } else { Rgba([128, 128, 255, 255]) });
    let top = &normal_mips(&tilted).levels[1];
    let normal = Vec3::new(f32::from(top[0]), f32::from(top[1]), f32::from(top[2])) / 127.5 - 1.0;
    assert!((normal.length() - 1.0).abs() < 0.02);
    assert!((normal - Vec3::new(0.707, 0.0, 0.707)).length() < 0.02, "{normal}");
    let opposed = RgbaImage::from_fn(2, 1, |x, _| Rgba([if x == 0 { 255 } else { 0 }, 127, 127, 255]));
    assert!(normal_mips(&opposed).levels[1][2] > 250, "a mean without length is flat");
}

#[test]
fn textures_without_texels_are_no_trouble() {
    let none = RgbaImage::new(0, 5);
    for chain in [color_mips(&none), alpha_tested_mips(&none), normal_mips(&none)] {
        assert_eq!(chain.levels, [Vec::<u8>::new()]);
    }
    assert_eq!(fade_alpha(&none, 0.5, AlphaFade::PerLeaf).dimensions(), (0, 5));
    dilate_colors(&mut none.clone());
    assert_eq!(resize_to(&none, 2, 2), RgbaImage::new(2, 2));
}

#[test]
fn srgb_round_trip() {
    for byte in 0..=255u8 {
        let encoded = f32::from(byte) / 255.0;
        assert!((linear_to_srgb(srgb_to_linear(encoded)) - encoded).abs() < 1e-5);
    }
    assert_eq!(srgb_to_linear(f32::MAX), 1.0);
}

fn any_image() -> impl Strategy<Value = RgbaImage> {
    (1u32..24, 1u32..24).prop_flat_map(|(width, height)| {
        prop::collection::vec(any::<u8>(), 4 * (width * height) as usize)
            .prop_map(move |bytes| RgbaImage::from_raw(width, height, bytes).expect("as many bytes as texels need"))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_image_has_whole_mip_chains(image in any_image(), cutoff in 0.0f32..1.0) {
        for chain in [color_mips(&image), alpha_tested_mips(&image), normal_mips(&image)] {
            prop_assert!(has_all_levels(&chain));
        }
        for fade in [AlphaFade::PerLeaf, AlphaFade::CenterOut] {
            let faded = fade_alpha(&image, cutoff, fade);
            prop_assert!(has_all_levels(&alpha_tested_mips(&faded)));
            for (old, new) in image.pixels().zip(faded.pixels()) {
                prop_assert_eq!(&old.0[..3], &new.0[..3]);
                prop_assert_eq!(f32::from(old[3]) / 255.0 >= cutoff, new[3] >= 128);
            }
        }
    }

    #[test]
    fn a_plain_image_stays_plain(width in 1u32..20, height in 1u32..20, color in any::<[u8; 4]>(), to in 1u32..30) {
        let image = RgbaImage::from_pixel(width, height, Rgba(color));
        for level in color_mips(&image).levels {
            for texel in level.chunks_exact(4) {
                prop_assert!(texel.iter().zip(color).all(|(a, b)| a.abs_diff(b) <= 1));
            }
        }
        let resized = resize_to(&image, to, height);
        prop_assert_eq!(resized.dimensions(), (to, height));
        prop_assert!(resized.pixels().all(|texel| texel.0.iter().zip(color).all(|(a, b)| a.abs_diff(b) <= 1)));
    }
}
