//! The tables of the error under the sky.

use std::sync::Arc;
use std::time::Instant;

use canopy::bake::transfer::{
    Channels, Interior, Projection, TransferBake, TransferFormat, TransferSettings, bake_transfer, share,
};
use canopy::light::atmosphere::luminance;
use canopy::plant::Plant;

use crate::DAY;
use crate::judge::{Judge, Verdict};
use crate::truth::BANDS;

/// All tables.
pub fn error(plant: &Arc<Plant>, judge: &Judge, most_rays: u32) {
    println!("## Error");
    bands(plant, judge);
    rays(plant, judge, most_rays);
    hours(plant, judge);
    interior(plant, judge);
    bounces(judge);
    storage(plant, judge);
}

fn settings_of(bands: usize) -> TransferSettings {
    TransferSettings { bands: bands as u8, ..TransferSettings::default() }
}

fn bands(plant: &Arc<Plant>, judge: &Judge) {
    println!(
        "\n### Bands, {} rays: over the day (hours alike), %\n\n\
         | bands | projection, truncation | fit, truncation | projection, baked | fit, baked | clamped light of the fit |\n\
         |--:|--:|--:|--:|--:|--:|",
        TransferSettings::default().rays
    );
    let cell = |verdict: &Verdict| format!("{:.2} ({:.2})", verdict.day, verdict.hours);
    for (place, &bands) in BANDS.iter().enumerate() {
        let [projection, fit] = [0, 1].map(|projection| cell(&judge.judge_truncation(projection, place)));
        let baked = |projection| {
            judge.judge_bake(&bake_transfer(plant, &TransferSettings { projection, ..settings_of(bands) }))
        };
        let (published, fitted) = (baked(Projection::Quadrature), baked(Projection::Fit));
        let [published_cell, fitted_cell] = [cell(&published), cell(&fitted)];
        println!("| {bands} | {projection} | {fit} | {published_cell} | {fitted_cell} | {:.3} |", fitted.clamped);
    }
}

fn rays(plant: &Arc<Plant>, judge: &Judge, most_rays: u32) {
    println!("\n### Rays, fit: over the day, %, and what rays add to truncation\n");
    println!("| rays |{} s with 3 bands |", BANDS.map(|n| format!(" {n} bands | rays |")).concat());
    println!("|--:|{}--:|", "--:|--:|".repeat(BANDS.len()));
    for rays in [16, 32, 64, 128, 256, 512, 1024, 2048, 4096].into_iter().filter(|rays| *rays <= most_rays) {
        let mut time = 0.0;
        print!("| {rays} |");
        for (place, &bands) in BANDS.iter().enumerate() {
            let start = Instant::now();
            let bake = bake_transfer(plant, &TransferSettings { rays, ..settings_of(bands) });
            if bands == 3 {
                time = start.elapsed().as_secs_f64();
            }
            let noise = noise(judge, &bake, place);
            print!(" {:.2} | {noise:.2} |", judge.judge_bake(&bake).day);
        }
        println!(" {time:.2} |");
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

fn hours(plant: &Arc<Plant>, judge: &Judge) {
    println!(
        "\n### Hours, fit: RMS error over the hour's mean, %\n\n\
         | sun, degrees high | 2 bands | 3 bands | 6 bands | default, baked |\n|--:|--:|--:|--:|--:|"
    );
    let [two, three, six] = [0, 1, 4].map(|place| judge.judge_truncation(1, place).by_hour);
    let baked = judge.judge_bake(&bake_transfer(plant, &TransferSettings::default())).by_hour;
    for (hour, (_, elevation)) in DAY.iter().enumerate() {
        println!("| {elevation} | {:.1} | {:.1} | {:.1} | {:.1} |", two[hour], three[hour], six[hour], baked[hour]);
    }
}

fn interior(plant: &Arc<Plant>, judge: &Judge) {
    println!("\n### Colour and interior: over the day, %\n\n| | luminance | RGB |\n|---|--:|--:|");
    let default = TransferSettings::default();
    let rows = [
        ("default", default),
        ("three channels", TransferSettings { channels: Channels::Rgb, ..default }),
        ("1 bounce", TransferSettings { interior: Interior::Diffuse(1), ..default }),
        ("8 bounces", TransferSettings { interior: Interior::Diffuse(8), ..default }),
        ("no interior light", TransferSettings { interior: Interior::Straight(0), ..default }),
        ("straight through 3 leaves", TransferSettings { interior: Interior::Straight(3), ..default }),
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

fn storage(plant: &Arc<Plant>, judge: &Judge) {
    println!(
        "\n### Storage\n\n| bands | bytes a leaf's vertex, 4 / 2 / 1 a coefficient | RMS change by 2, % | by 1, % | error with 1, % |\n\
         |--:|--:|--:|--:|--:|"
    );
    let formats = [TransferFormat::Float32, TransferFormat::Float16, TransferFormat::Snorm8];
    for bands in BANDS {
        let settings = settings_of(bands);
        let bake = bake_transfer(plant, &settings);
        let [four, two, one] = formats.map(|format| format.vertex_bytes(&settings, 2));
        let [_, half, byte] = formats.map(|format| bake.pack(format).unpack());
        println!(
            "| {bands} | {four} / {two} / {one} | {:.3} | {:.3} | {:.2} |",
            change(judge, &bake, &half),
            change(judge, &bake, &byte),
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
