//! The tables of the error under the sky.

use std::sync::Arc;
use std::time::Instant;

use canopy::bake::lighting::transfer::{
    Channels, Scattering, TransferBake, TransferFormat, TransferSettings, bake_transfer, share,
};
use canopy::math::luminance;
use canopy::plant::Plant;

use crate::DAY;
use crate::judge::{Judge, Verdict};
use crate::truth::BANDS;

/// Bands, storage and hours, from one bake for each number of bands.
pub fn bands(plant: &Arc<Plant>, judge: &Judge) {
    let bakes = BANDS.map(|bands| bake_transfer(plant, &settings_of(bands)));
    truncation(judge, &bakes);
    storage(judge, &bakes);
    hours(judge, &bakes);
    bounces(judge);
}

fn settings_of(bands: usize) -> TransferSettings {
    TransferSettings { bands: bands as u8, ..TransferSettings::default() }
}

fn truncation(judge: &Judge, bakes: &[TransferBake; 5]) {
    println!(
        "## Bands, {} rays: over the day (hours alike), %\n\n\
         | bands | projection, truncation | fit, truncation | fit, baked | of that, rays | clamped light |\n\
         |--:|--:|--:|--:|--:|--:|",
        TransferSettings::default().rays
    );
    let cell = |verdict: &Verdict| format!("{:.2} ({:.2})", verdict.day, verdict.hours);
    for (place, bake) in bakes.iter().enumerate() {
        let [projection, fit] = [0, 1].map(|projection| cell(&judge.judge_truncation(projection, place)));
        let baked = judge.judge_bake(bake);
        let noise = noise(judge, bake, place);
        println!("| {} | {projection} | {fit} | {} | {noise:.2} | {:.3} |", BANDS[place], cell(&baked), baked.clamped);
    }
}

/// The table over rays, for each of `bands`: error over the day, and what rays add to truncation.
pub fn rays(plant: &Arc<Plant>, judge: &Judge, bands: &[usize], most_rays: u32) {
    println!("\n## Rays, fit: over the day, and of that by rays, %\n");
    println!("| rays |{}", bands.iter().map(|n| format!(" {n} bands | by rays | s |")).collect::<String>());
    println!("|--:|{}", "--:|--:|--:|".repeat(bands.len()));
    for rays in [16, 32, 64, 128, 256, 512, 1024, 2048, 4096].into_iter().filter(|rays| *rays <= most_rays) {
        print!("| {rays} |");
        for &bands in bands {
            let start = Instant::now();
            let bake = bake_transfer(plant, &TransferSettings { rays, ..settings_of(bands) });
            let time = start.elapsed().as_secs_f64();
            let place = BANDS.iter().position(|n| *n == bands).unwrap_or(0);
            print!(" {:.2} | {:.2} | {time:.1} |", judge.judge_bake(&bake).day, noise(judge, &bake, place));
        }
        println!();
    }
}

/// RMS difference over the day between what a bake and what the transfer free of noise sends out, percent of the RMS of
/// the truth.
fn noise(judge: &Judge, bake: &TransferBake, place: usize) -> f64 {
    let bands = BANDS[place];
    let (mut differences, mut squares) = (0.0, 0.0);
    for (hour, light) in judge.lights.iter().enumerate() {
        let light = light.surroundings().project(bands);
        for (index, (v, truth)) in judge.vertices.iter().zip(judge.truths).enumerate() {
            let part = &bake.parts[v.part];
            let sides = [part.front_of(v.vertex, &bake.settings), part.back_of(v.vertex, &bake.settings)];
            let [front, back] = &truth.transfer[1][place];
            let (got, want) = (judge.exitant(index, &light, sides), judge.exitant(index, &light, [front, back]));
            let [front, back] = truth.sky[hour];
            let true_sides = [front + v.transmission * back, back + v.transmission * front];
            for side in 0..1 + usize::from(v.two_sided) {
                differences += f64::from(luminance(got[side] - want[side])).powi(2);
                squares += f64::from(luminance(true_sides[side])).powi(2);
            }
        }
    }
    100.0 * (differences / squares).sqrt()
}

fn hours(judge: &Judge, bakes: &[TransferBake; 5]) {
    println!(
        "\n## Hours, fit: RMS error over the hour's mean, truncation / baked, %\n\n\
         | sun, degrees high |{}\n|--:|{}",
        BANDS.map(|n| format!(" {n} bands |")).concat(),
        "--:|".repeat(BANDS.len())
    );
    let cells: Vec<_> = (0..BANDS.len())
        .map(|place| (judge.judge_truncation(1, place).by_hour, judge.judge_bake(&bakes[place]).by_hour))
        .collect();
    for (hour, (_, elevation)) in DAY.iter().enumerate() {
        print!("| {elevation} |");
        cells.iter().for_each(|(free, baked)| print!(" {:.1} / {:.1} |", free[hour], baked[hour]));
        println!();
    }
}

/// The table of channels and of what leaves do to light.
pub fn interior(plant: &Arc<Plant>, judge: &Judge) {
    println!("\n## Colour and scattering: over the day, %\n\n| | luminance | RGB |\n|---|--:|--:|");
    let default = TransferSettings::default();
    let rows = [
        ("default", default),
        ("three channels", TransferSettings { channels: Channels::Rgb, ..default }),
        ("1 bounce", TransferSettings { scattering: Scattering::Diffuse(1), ..default }),
        ("8 bounces", TransferSettings { scattering: Scattering::Diffuse(8), ..default }),
        ("no interior light", TransferSettings { scattering: Scattering::TransmitOnly(0), ..default }),
        ("straight through 3 leaves", TransferSettings { scattering: Scattering::TransmitOnly(3), ..default }),
    ];
    for (name, settings) in rows {
        let verdict = judge.judge_bake(&bake_transfer(plant, &settings));
        println!("| {name} | {:.2} | {:.2} |", verdict.day, verdict.rgb);
    }
}

fn bounces(judge: &Judge) {
    let total: f32 = judge.truths.iter().flat_map(|t| t.by_bounces).sum();
    let mut passed = 0.0;
    print!("\nShare of the light that comes over at most n bounces, low sun:");
    for n in 0..9 {
        passed += judge.truths.iter().map(|t| t.by_bounces[n]).sum::<f32>();
        print!(" {:.1} %", 100.0 * passed / total);
    }
    println!();
}

fn storage(judge: &Judge, bakes: &[TransferBake; 5]) {
    println!(
        "\n## Storage\n\n| bands | bytes a leaf's vertex, 4 / 2 / 1 a coefficient | RMS change by 2, % | by 1, % | error with 1, % |\n\
         |--:|--:|--:|--:|--:|"
    );
    let formats = [TransferFormat::Float32, TransferFormat::Float16, TransferFormat::Snorm8];
    for (bands, bake) in BANDS.into_iter().zip(bakes) {
        let settings = settings_of(bands);
        let [four, two, one] = formats.map(|format| format.vertex_bytes(&settings, 2));
        let [_, half, byte] = formats.map(|format| bake.pack(format).unpack());
        println!(
            "| {bands} | {four} / {two} / {one} | {:.3} | {:.3} | {:.2} |",
            change(judge, bake, &half),
            change(judge, bake, &byte),
            judge.judge_bake(&byte).day
        );
    }
}

/// RMS of what storage changes in the front's irradiance, percent of the RMS of that, over the day.
fn change(judge: &Judge, bake: &TransferBake, stored: &TransferBake) -> f64 {
    let (mut changes, mut squares) = (0.0, 0.0);
    for light in judge.lights {
        let light = light.surroundings().project(usize::from(bake.settings.bands));
        for v in judge.vertices {
            let value =
                |bake: &TransferBake| luminance(share(&light, bake.parts[v.part].front_of(v.vertex, &bake.settings)));
            let (want, got) = (value(bake), value(stored));
            changes += f64::from(got - want).powi(2);
            squares += f64::from(want).powi(2);
        }
    }
    100.0 * (changes / squares).sqrt()
}
