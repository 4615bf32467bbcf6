//! Each level against the supersampled full model.

use std::sync::Arc;

use canopy::app::{Side, Studio};
use canopy::bake::cache::Cache;
use canopy::bake::levels::LevelSet;
use canopy::bake::{BakeSettings, BakedPlant, bake_plant};
use canopy::components::Sun;
use canopy::lod::Representation;
use canopy::measure::LevelError;

use super::trees;

/// Largest size of a level in pixels.
const LARGEST: usize = 512;
/// Pixels of the full model for each of the largest level's, along a side.
const TRUTH: usize = 4;
/// Sizes from the largest to 16 pixels.
const HALVINGS: usize = 5;
/// In UTC: the sun high in the south, half high in the east, low in the west.
pub const SUNS: [(&str, &str); 3] =
    [("high", "2026-06-21T11:15:00Z"), ("east", "2026-06-21T06:45:00Z"), ("low", "2026-06-21T17:45:00Z")];

/// The plant with all of its levels.
pub fn baked(plant: canopy::plant::Plant) -> BakedPlant {
    let settings = BakeSettings { representations: LevelSet::all(), ..BakeSettings::default() };
    bake_plant(Arc::new(plant), &settings, Cache::of_user().as_ref()).0
}

pub fn sun(instant: &str) -> Sun {
    Sun { instant: instant.parse().expect("an instant"), ..Sun::default() }
}

pub fn errors() {
    println!();
    println!("| tree | level | sun | size, px | RMSE | cover | light | contrast |");
    println!("|---|---|---|--:|--:|--:|--:|--:|");
    for (name, plant) in trees() {
        let plant = baked(plant);
        let mut large = Studio::new(plant.clone(), (LARGEST * TRUTH) as u32, None, 4).expect("a renderer");
        large.show(Some(Representation::MODEL)).expect("a tree");
        let truths: Vec<Vec<_>> = SUNS
            .iter()
            .map(|(_, instant)| {
                let of = |side| large.cutout(side, &sun(instant), 1.0).expect("an image").averaged(TRUTH);
                Side::ALL.map(of).to_vec()
            })
            .collect();
        drop(large);
        let mut studio = Studio::new(plant, LARGEST as u32, None, 4).expect("a renderer");
        for level in [Representation::MODEL, Representation::THINNED, Representation::CLOUD, Representation::CROSS] {
            studio.show(Some(level)).expect("a tree");
            for halving in 0..=HALVINGS {
                let (zoom, size) = (1 << halving, LARGEST >> halving);
                let mut all = Vec::new();
                for ((sun_name, instant), truths) in SUNS.iter().zip(&truths) {
                    let mut errors = Vec::new();
                    for (side, truth) in Side::ALL.into_iter().zip(truths) {
                        let image = studio.cutout(side, &sun(instant), zoom as f64).expect("an image");
                        errors.push(image.middle(size, size).error(&truth.averaged(zoom)));
                    }
                    row(&name, level, sun_name, size, &LevelError::mean(&errors));
                    all.extend(errors);
                }
                row(&name, level, "all", size, &LevelError::mean(&all));
            }
        }
    }
}

fn row(name: &str, level: Representation, sun: &str, size: usize, error: &LevelError) {
    println!(
        "| {name} | {} | {sun} | {size} | {:.3} | {:.3} | {:.3} | {:.3} |",
        level.name(),
        error.rmse,
        error.coverage,
        error.luminance,
        error.contrast
    );
}
