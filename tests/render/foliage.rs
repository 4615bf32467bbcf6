//! The light of leaves: their gloss, and the two ways of the sun.

use canopy::{assets::Stage, bake::lighting::SunLight};

use super::{SIZE, again, draw, renderer, showing};
use crate::support::{
    gpu::gpu,
    image::{SAME, difference, keep, luminance, mean_color},
    stage::{PLACE, build, instant, quality, view},
};

/// The sun 22 degrees high in the west.
const AFTERNOON: &str = "2026-06-21T18:00+01:00";

/// A row of five trees, of a species with these fields more.
fn row(fields: &str) -> Stage {
    let quality = quality(1);
    build(
        &format!(
            "(seed: 7, terrain: Flat(size: 200), species: [(name: \"broadleaf\", plant: Grown(form: Broadleaf, \
             individuals: 1, triangles: 5000, seed: 1), height: (9, 12), {fields})], trees: Inventory(path: \
             \"trees.csv\"), {PLACE}, {quality})"
        ),
        &[("trees.csv", b"x,y\n-8,0\n-4,0\n0,0\n4,0\n8,0\n")],
    )
    .stage
}

/// The light of the row's crowns, from the south (0) and towards the sun (1).
fn crowns(stage: &Stage, name: &str) -> [(canopy::app::RenderedImage, f64); 2] {
    let mut renderer = showing(stage);
    let views = [view(stage, (0.0, 6.0, 15.0), 0.0, 4.0), view(stage, (14.0, 5.0, 4.0), 285.0, 8.0)];
    [0, 1].map(|side| {
        let picture = draw(&mut renderer, stage, &views[side], AFTERNOON);
        keep(&picture, &format!("{name}-{side}"));
        let pixel = |column: u32, row: u32| {
            let first = 3 * (row * SIZE.0 + column) as usize;
            [0, 1, 2].map(|channel| u32::from(picture.pixels[first + channel]))
        };
        let light = luminance(mean_color(&picture, |column, row| {
            let [_, green, blue] = pixel(column, row);
            row < SIZE.1 / 2 && 4 * green > 5 * blue
        }));
        (picture, light)
    })
}

#[test]
fn sunlight_by_harmonics_changes_the_image_but_not_the_amount_of_light() {
    let gpu = gpu();
    let fields = |sun: &str| format!("lighting: Transfer(rays: 64, bounces: 1, sun: {sun})");
    let (leaf, harmonics) = (row(&fields("LeafShader")), row(&fields("Harmonics")));
    assert_eq!((&leaf.suns[..], &harmonics.suns[..]), (&[SunLight::LeafShader][..], &[SunLight::Harmonics][..]));
    // The bake is the same: it is the light that changes.
    assert_eq!(leaf.plants[0].lighting, harmonics.plants[0].lighting);
    let (sharp, soft) = (crowns(&leaf, "sun-leaf"), crowns(&harmonics, "sun-harmonics"));
    for ((sharp, light), (soft, other)) in sharp.iter().zip(&soft) {
        assert!(sharp != soft, "the option changes nothing");
        assert!((0.6..1.2).contains(&(other / light)), "{other} of {light}");
    }
    // At night its image is one too, and a resting one stays.
    let mut renderer = renderer(1);
    renderer.show(&harmonics);
    renderer.set_instant(&harmonics, instant(super::NIGHT));
    let night = again(&mut renderer);
    assert!(night == again(&mut renderer), "a resting image changes");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

#[test]
fn gloss_moves_light_and_makes_none() {
    let gpu = gpu();
    let fields = |gloss: &str| format!("lighting: Local, gloss: ({gloss})");
    let [matt, leaf, wax] = ["share: 0", "", "share: 0.09, roughness: 0.2"]
        .map(|gloss| crowns(&row(&fields(gloss)), &gloss[..gloss.len().min(8)]));
    for side in 0..2 {
        for other in [&leaf, &wax] {
            assert!(difference(&matt[side].0, &other[side].0) > 0.02 * SAME, "gloss changes nothing");
        }
    }
    // Matt leaves have the light from behind of their whole colour; what gloss takes from it is its own light.
    let ratios = |light: &[(canopy::app::RenderedImage, f64); 2]| [0, 1].map(|side| light[side].1 / matt[side].1);
    for ratio in ratios(&leaf).into_iter().chain(ratios(&wax)) {
        assert!((0.6..1.3).contains(&ratio), "{:?} {:?}", ratios(&leaf), ratios(&wax));
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}
