//! FLIP against the authors' own program: `flip-evaluator` 1.7 from PyPI, run on the same pictures.

use glam::Vec3;

use super::*;

/// Crowns of noise before a sky, in whole numbers so that any language makes the same bytes.
fn bytes(seed: u32, shift: u32, noise: i32, gain: i32) -> Vec<u8> {
    let random = |x: u32, y: u32| {
        let mixed = x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663) ^ seed.wrapping_mul(83_492_791);
        let mixed = mixed.wrapping_mul(2_654_435_761);
        let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(2_246_822_519);
        ((mixed ^ (mixed >> 13)) & 255) as i32
    };
    let pixel = |index: u32| {
        let (x, y) = (index % 96 + shift, index / 96);
        let base = [[40, 90, 30], [150, 180, 210], [90, 60, 20]][((x / 9 + y / 7) % 3) as usize];
        base.map(|code| {
            ((code + ((random(x, y) * noise) >> 8) - (noise >> 1)) * gain).div_euclid(256).clamp(0, 255) as u8
        })
    };
    (0..96 * 64).flat_map(pixel).collect()
}

fn display(bytes: &[u8]) -> Picture {
    Picture::from_srgb8(96, 64, bytes).unwrap()
}

/// A scene whose radiance is a hundredth of the square of the codes.
fn scene(bytes: &[u8]) -> Picture {
    let light = |code: &u8| f32::from(*code) * f32::from(*code) * 0.01;
    let pixels = bytes.chunks_exact(3).map(|rgb| Vec3::new(light(&rgb[0]), light(&rgb[1]), light(&rgb[2])));
    Picture::new(96, 64, Light::Scene, pixels.collect()).unwrap()
}

#[test]
fn flip_is_that_of_its_authors_to_four_digits() {
    let reference = bytes(1, 0, 40, 256);
    assert_eq!(reference.iter().map(|code| u32::from(*code)).sum::<u32>(), 1_773_207, "another picture was made");
    // Mean and maximum at 67 and mean at 30 pixels per degree, then mean and maximum of HDR-FLIP.
    let cases = [
        ("same", reference.clone(), [0.0, 0.0, 0.0, 0.0, 0.0]),
        ("shifted", bytes(1, 2, 40, 256), [0.313057, 0.763175, 0.379851, 0.405743, 0.866409]),
        ("other noise", bytes(2, 0, 40, 256), [0.099309, 0.307871, 0.195831, 0.167385, 0.560366]),
        ("darker", bytes(1, 0, 40, 200), [0.441638, 0.587059, 0.433879, 0.457938, 0.613833]),
        ("no noise", bytes(1, 0, 0, 256), [0.080013, 0.260670, 0.162084, 0.192591, 0.495296]),
    ];
    for (name, test, expected) in cases {
        let of = |map: Vec<f32>| {
            let mean = map.iter().map(|error| f64::from(*error)).sum::<f64>() / map.len() as f64;
            (mean, map.into_iter().map(f64::from).fold(0.0, f64::max))
        };
        let near = of(flip(&display(&reference), &display(&test), PIXELS_PER_DEGREE).unwrap());
        let far = of(flip(&display(&reference), &display(&test), 30.0).unwrap());
        let radiance = of(flip(&scene(&reference), &scene(&test), PIXELS_PER_DEGREE).unwrap());
        let found = [near.0, near.1, far.0, radiance.0, radiance.1];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 5e-5, "{name}: {found} instead of {expected}");
        }
    }
}

#[test]
fn the_map_does_not_depend_on_the_number_of_threads() {
    let [reference, test] = [bytes(1, 0, 40, 256), bytes(2, 1, 40, 256)].map(|bytes| display(&bytes));
    let map = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| flip(&reference, &test, PIXELS_PER_DEGREE).unwrap())
    };
    assert_eq!(map(1), map(5));
}

#[test]
fn no_light_is_too_much() {
    let pixels = |light| Picture::new(5, 4, Light::Scene, vec![Vec3::splat(light); 20]).unwrap();
    for pair in [[0.0, 0.0], [0.0, f32::MAX], [f32::MAX, 0.0], [1e-38, 1e30], [f32::MAX, f32::MAX]] {
        let map = flip(&pixels(pair[0]), &pixels(pair[1]), PIXELS_PER_DEGREE).unwrap();
        assert!(map.iter().all(|error| (0.0..=1.0).contains(error)), "{pair:?}: {map:?}");
    }
}
