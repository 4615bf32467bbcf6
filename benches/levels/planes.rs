//! Crosses of few and many upright planes, from sides between their planes.

use std::sync::Arc;

use canopy::app::{Side, Studio};
use canopy::bake::cache::Cache;
use canopy::bake::levels::cross::CrossSettings;
use canopy::bake::{BakeSettings, BakedPlant, bake_plant};
use canopy::lod::Representation;
use canopy::measure::{Cutout, LevelError};
use canopy::plant::Plant;

use super::errors::{SUNS, sun};
use super::trees;

/// Upright planes; the first is the default.
const UPRIGHTS: [u32; 6] = [4, 1, 2, 3, 6, 8];
/// Directions to the camera, evenly over a quarter of a turn.
const TURNS: u32 = 8;
/// Largest size of a cross in pixels.
const LARGEST: usize = 128;
/// Pixels of the full model for each of the largest cross's, along a side.
const TRUTH: usize = 8;
/// Sizes from the largest to 16 pixels.
const HALVINGS: usize = 3;

fn baked(plant: &Plant, uprights: u32) -> BakedPlant {
    let cross = CrossSettings { uprights, ..CrossSettings::default() };
    let settings = BakeSettings { cross, ..BakeSettings::default() };
    bake_plant(Arc::new(plant.clone()), &settings, Cache::of_user().as_ref()).0
}

/// Images of all turns, under all suns, in the largest size.
fn images(plant: &BakedPlant, level: Representation, pixels: usize) -> Vec<Vec<Cutout>> {
    let mut studio = Studio::new(plant.clone(), (LARGEST * pixels) as u32, None, 4).expect("a renderer");
    let turn = |turn: u32| (f64::from(turn) + 0.5) / f64::from(TURNS) * std::f64::consts::FRAC_PI_2;
    let of_turn = |index: u32| {
        studio.turn(turn(index) as f32);
        studio.show(Some(level)).expect("a tree");
        let sizes = |instant: &str| -> Vec<Cutout> {
            let zooms = if pixels > 1 { 1 } else { HALVINGS + 1 };
            let zoomed =
                |halving| studio.cutout(Side::South, &sun(instant), f64::from(1u32 << halving)).expect("an image");
            (0..zooms as u32).map(zoomed).collect()
        };
        SUNS.iter().map(|(_, instant)| *instant).map(sizes).collect::<Vec<_>>()
    };
    (0..TURNS).flat_map(of_turn).collect()
}

/// The full model, supersampled, in the largest size.
pub fn truths(plant: &BakedPlant) -> Vec<Cutout> {
    let images = images(plant, Representation::MODEL, TRUTH).into_iter();
    images.filter_map(|sizes| sizes.first().map(|truth| truth.averaged(TRUTH))).collect()
}

/// The mean error of crosses in each size, in pixels.
pub fn errors(plant: &BakedPlant, truths: &[Cutout]) -> Vec<(usize, LevelError)> {
    let shown = images(plant, Representation::CROSS, 1);
    let of_size = |halving: usize| {
        let (zoom, size) = (1 << halving, LARGEST >> halving);
        let error =
            |(sizes, truth): (&Vec<Cutout>, &Cutout)| sizes[halving].middle(size, size).error(&truth.averaged(zoom));
        (size, LevelError::mean(&shown.iter().zip(truths).map(error).collect::<Vec<_>>()))
    };
    (0..=HALVINGS).map(of_size).collect()
}

pub fn planes() {
    println!();
    println!("| tree | upright planes | MB | size, px | RMSE | cover | light | contrast |");
    println!("|---|--:|--:|--:|--:|--:|--:|--:|");
    for (name, plant) in trees() {
        let truths = truths(&baked(&plant, UPRIGHTS[0]));
        for uprights in UPRIGHTS {
            let plant = baked(&plant, uprights);
            let megabytes = plant.cross().map_or(0.0, |cross| cross.texture_bytes(false) as f64 / 1e6);
            for (size, error) in errors(&plant, &truths) {
                println!(
                    "| {name} | {uprights} | {megabytes:.1} | {size} | {:.3} | {:.3} | {:.3} | {:.3} |",
                    error.rmse, error.coverage, error.luminance, error.contrast
                );
            }
        }
    }
}
