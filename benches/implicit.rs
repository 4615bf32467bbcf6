//! Question: what does light from implicit surfaces [Luft 2007] cost, and how wrong are its short cuts?
//!
//! 1. The density at all vertices over the radius ρ, against a plain scalar loop on one thread, with the largest
//!    relative error of each against f64. The loop does every n-th vertex only (`--every`), and its time is multiplied.
//! 2. Field, surface and realigned normals together, and what follows from the model.
//! 3. A share of the generators: angle between normals and difference of k_a to the full result, and time.
//! 4. k_a against traced visibility (the share of the whole sphere that a ray out of the vertex reaches): rank correlation,
//!    and RMSE with the automatic values and with the best k_a_min, d_min and n of a search.
//!
//! The tree is our own broadleaf with 60,000 triangles; where CANOPY_DATA names the data folder also its oak, pine
//! and aspen. The contestants of a table take turns in one run; medians are printed, as Markdown.

use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use canopy::bake::implicit::ambient_term::ambient_term;
use canopy::bake::implicit::density::DensityField;
use canopy::bake::implicit::generators::{Generator, generators};
use canopy::bake::implicit::{
    ImplicitBake, ImplicitParameters, ImplicitSettings, NormalSource, Weighting, bake_implicit,
};
use canopy::bake::transfer::direction_set;
use canopy::plant::gltf::{GltfOptions, load_plant};
use canopy::plant::grow::{GrowParameters, grow};
use canopy::plant::{PartKind, Plant, PlantMesh};
use canopy::trace::{PlantTracer, Ray, offset_origin};
use clap::Parser;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Cost and error of light from implicit surfaces.
#[derive(Parser)]
struct Arguments {
    /// Turns of each contestant.
    #[arg(long, default_value_t = 5)]
    turns: usize,
    /// The scalar loop does every n-th vertex, and its time is multiplied by n.
    #[arg(long, default_value_t = 16)]
    every: usize,
    /// Passed by `cargo bench`.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Median milliseconds of each contestant, taking turns.
fn medians(turns: usize, contestants: &mut [Box<dyn FnMut() + '_>]) -> Vec<f64> {
    let mut times = vec![Vec::new(); contestants.len()];
    for _ in 0..turns.max(1) {
        for (contestant, times) in contestants.iter_mut().zip(&mut times) {
            let start = Instant::now();
            contestant();
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    times.into_iter().map(median).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// A plain double loop, one number at a time.
fn scalar_loop(points: &[Vec3], generators: &[Generator], weights: &[f32], radius: f32) -> Vec<f32> {
    let (reach, scale) = (radius * radius, 1.0 / (radius * radius));
    let at = |q: &Vec3| {
        let mut sum = 0.0;
        for (generator, weight) in generators.iter().zip(weights) {
            let square = q.distance_squared(generator.position);
            if square < reach {
                let t = 1.0 - square * scale;
                sum += weight * t * t;
            }
        }
        sum
    };
    points.iter().map(at).collect()
}

fn exact(q: Vec3, generators: &[Generator], weights: &[f32], radius: f64) -> f64 {
    let at = |(generator, weight): (&Generator, &f32)| -> f64 {
        let away: DVec3 = (q.as_dvec3() - generator.position.as_dvec3()) / radius;
        f64::from(*weight) * (1.0 - away.length_squared()).max(0.0).powi(2)
    };
    generators.iter().zip(weights).map(at).sum()
}

/// Largest relative error of sums that are not 0.
fn worst(values: &[f32], exact: &[f64]) -> f64 {
    let pairs = values.iter().zip(exact).filter(|(_, exact)| **exact > 0.0);
    pairs.map(|(value, exact)| (f64::from(*value) / exact - 1.0).abs()).fold(0.0, f64::max)
}

fn foliage_generators(plant: &Plant) -> Vec<Generator> {
    let foliage = plant.parts.iter().filter(|part| part.kind == PartKind::Foliage);
    foliage.flat_map(|part| generators(&part.mesh)).collect()
}

fn density(arguments: &Arguments, plant: &Plant) {
    let generators = foliage_generators(plant);
    let points: Vec<Vec3> = plant.parts.iter().flat_map(|part| &part.mesh.positions).copied().collect();
    let some: Vec<Vec3> = points.iter().copied().step_by(arguments.every.max(1)).collect();
    let factor = points.len() as f64 / some.len() as f64;
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread pool");
    println!(
        "\n| {}: {} vertices, {} generators; ρ | field, {} threads, ms | one thread, ms | scalar loop, ms | times \
         faster | one thread, times faster | error | error of the loop |\n|---|---|---|---|---|---|---|---|",
        plant.name,
        points.len(),
        generators.len(),
        rayon::current_num_threads(),
    );
    for share in [0.01, 0.02, 0.05, 0.1, 0.2, 0.5] {
        let radius = share * plant.height();
        let weights: Vec<f32> = generators.iter().map(|g| Weighting::LeafArea.weight(g, radius)).collect();
        let ours = || DensityField::new(&generators, radius, Weighting::LeafArea).values(black_box(&points));
        let times = medians(
            arguments.turns,
            &mut [
                Box::new(|| drop(black_box(ours()))),
                Box::new(|| drop(black_box(one_thread.install(ours)))),
                Box::new(|| drop(black_box(scalar_loop(black_box(&some), &generators, &weights, radius)))),
            ],
        );
        let brute = times[2] * factor;
        let checked: Vec<Vec3> = points.iter().copied().step_by(37).collect();
        let sums: Vec<f64> = checked.iter().map(|q| exact(*q, &generators, &weights, f64::from(radius))).collect();
        let field = DensityField::new(&generators, radius, Weighting::LeafArea).values(&checked);
        println!(
            "| {:.0} % of {:.1} m | {:.1} | {:.1} | {brute:.0} | {:.0} | {:.0} | {:.1e} | {:.1e} |",
            share * 100.0,
            plant.height(),
            times[0],
            times[1],
            brute / times[0],
            brute / times[1],
            worst(&field, &sums),
            worst(&scalar_loop(&checked, &generators, &weights, radius), &sums),
        );
    }
}

fn with(normals: NormalSource, generator_share: f32) -> ImplicitSettings {
    ImplicitSettings { normals, generator_share, ..ImplicitSettings::default() }
}

fn total(arguments: &Arguments, plants: &[Plant]) {
    println!(
        "\n| field, surface, normals | as published, ms | smooth, ms | smooth without surface, ms | surface, triangles \
         | ρ, m | τ | d_min |\n|---|---|---|---|---|---|---|---|"
    );
    for plant in plants {
        let published = with(NormalSource::NearestVertex, 1.0);
        let smooth = with(NormalSource::Gradient, 1.0);
        let bare = ImplicitSettings { surface: false, ..smooth };
        let run = |settings: ImplicitSettings| move || drop(black_box(bake_implicit(plant, &settings)));
        let times =
            medians(arguments.turns, &mut [Box::new(run(published)), Box::new(run(smooth)), Box::new(run(bare))]);
        let baked = bake_implicit(plant, &published);
        let ImplicitParameters { radius, threshold, core, .. } = baked.report.parameters;
        println!(
            "| {} | {:.0} | {:.0} | {:.0} | {} | {radius:.3} | {threshold:.3} | {core:.3} |",
            plant.name,
            times[0],
            times[1],
            times[2],
            baked.surface.map_or(0, |surface| surface.triangles.len()),
        );
    }
}

/// Median angle in degrees between the foliage's normals, and mean difference of k_a.
fn difference(plant: &Plant, a: &ImplicitBake, b: &ImplicitBake) -> (f64, f64) {
    let (mut angles, mut sum, mut count) = (Vec::new(), 0.0, 0.0);
    for (index, _) in plant.parts.iter().enumerate().filter(|(_, part)| part.kind == PartKind::Foliage) {
        let pairs = a.normals[index].iter().zip(&b.normals[index]);
        angles.extend(pairs.map(|(a, b)| f64::from(a.angle_between(*b).to_degrees())));
        let pairs = a.ambient[index].iter().zip(&b.ambient[index]);
        sum += pairs.map(|(a, b)| f64::from((a - b).abs())).sum::<f64>();
        count += a.ambient[index].len() as f64;
    }
    (median(angles), sum / count)
}

fn shares(arguments: &Arguments, plants: &[Plant]) {
    println!(
        "\n| a share of the generators | share | median angle | mean difference of k_a | ms | of the full bake's ms \
         |\n|---|---|---|---|---|---|"
    );
    for plant in plants {
        for (name, normals) in [("as published", NormalSource::NearestVertex), ("smooth", NormalSource::Gradient)] {
            let full = bake_implicit(plant, &with(normals, 1.0));
            for share in [0.5, 0.2, 0.1, 0.05] {
                let run = |share: f32| move || drop(black_box(bake_implicit(plant, &with(normals, share))));
                let times = medians(arguments.turns, &mut [Box::new(run(1.0)), Box::new(run(share))]);
                let (angle, ambient) = difference(plant, &full, &bake_implicit(plant, &with(normals, share)));
                println!(
                    "| {}, {name} | {:.0} % | {angle:.1}° | {ambient:.4} | {:.0} | {:.0} |",
                    plant.name,
                    share * 100.0,
                    times[1],
                    times[0]
                );
            }
        }
    }
}

/// Ranks, 0..1; equal values share the mean of their ranks.
fn ranks(values: &[f32]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut start = 0;
    while start < order.len() {
        let same = order[start..].iter().take_while(|i| values[**i] == values[order[start]]).count();
        for i in &order[start..start + same] {
            ranks[*i] = start as f64 + 0.5 * same as f64;
        }
        start += same;
    }
    ranks
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |list: &[f64]| list.iter().sum::<f64>() / list.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(a, b)| f(a - ma, b - mb)).sum::<f64>();
    sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt()
}

fn rmse(densities: &[f32], wanted: &[f32], parameters: &ImplicitParameters) -> f64 {
    let pairs = densities.iter().zip(wanted);
    let sum: f64 = pairs.map(|(d, wanted)| f64::from(ambient_term(*d, parameters) - wanted).powi(2)).sum();
    (sum / wanted.len() as f64).sqrt()
}

/// The share of the sphere's directions in which nothing of the plant is met, vertex by vertex.
fn traced_visibility(plant: &Plant) -> Vec<Vec<f32>> {
    const DIRECTIONS: usize = 256;
    let tracer = PlantTracer::new(&Arc::new(plant.clone()));
    let directions = direction_set(DIRECTIONS as u32);
    let seen = |mesh: &PlantMesh, vertex: usize| {
        let (position, normal) = (mesh.positions[vertex], mesh.normals[vertex]);
        let open = directions.iter().filter(|direction| {
            let side = if normal.dot(**direction) < 0.0 { -normal } else { normal };
            let origin = offset_origin(position, side, **direction);
            !tracer.occluded(&Ray { origin, direction: **direction, t_max: f32::INFINITY })
        });
        open.count() as f32 / DIRECTIONS as f32
    };
    let of_part = |mesh: &PlantMesh| (0..mesh.positions.len()).into_par_iter().map(|v| seen(mesh, v)).collect();
    plant.parts.iter().map(|part| of_part(&part.mesh)).collect()
}

fn against_visibility(plants: &[Plant]) {
    println!(
        "\n| k_a against traced visibility | ρ | rank correlation | RMSE, automatic | RMSE, fitted | k_a_min | d_min / automatic \
         | n |\n|---|---|---|---|---|---|---|---|"
    );
    for plant in plants {
        let visibility = traced_visibility(plant);
        let automatic = bake_implicit(plant, &with(NormalSource::Gradient, 1.0)).report.parameters;
        let leaves = || plant.parts.iter().zip(&visibility).filter(|(part, _)| part.kind == PartKind::Foliage);
        let wanted: Vec<f32> = leaves().flat_map(|(_, values)| values).copied().collect();
        let points: Vec<Vec3> = leaves().flat_map(|(part, _)| &part.mesh.positions).copied().collect();
        for factor in [0.5f32, 1.0, 2.0, 4.0] {
            let radius = factor * automatic.radius;
            let settings =
                ImplicitSettings { radius: Some(radius), surface: false, ..with(NormalSource::Gradient, 1.0) };
            let automatic = bake_implicit(plant, &settings).report.parameters;
            let field = DensityField::new(&foliage_generators(plant), radius, Weighting::LeafArea);
            let densities: Vec<f32> =
                field.values(&points).into_iter().map(|value| value - automatic.threshold).collect();
            let negative: Vec<f32> = densities.iter().map(|d| -d).collect();
            let rank = correlation(&ranks(&negative), &ranks(&wanted));
            let mut best = (f64::INFINITY, automatic);
            for least in [0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4] {
                for core in [0.5, 0.7, 1.0, 1.4, 2.0, 3.0] {
                    for exponent in [0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0] {
                        let tried = ImplicitParameters { least, core: core * automatic.core, exponent, ..automatic };
                        let error = rmse(&densities, &wanted, &tried);
                        if error < best.0 {
                            best = (error, tried);
                        }
                    }
                }
            }
            println!(
                "| {} | {:.1} % | {rank:.3} | {:.3} | {:.3} | {:.2} | {:.1} | {:.1} |",
                plant.name,
                100.0 * radius / plant.height(),
                rmse(&densities, &wanted, &automatic),
                best.0,
                best.1.least,
                best.1.core / automatic.core,
                best.1.exponent,
            );
        }
    }
}

fn main() {
    let arguments = Arguments::parse();
    let mut plants = vec![grow(&GrowParameters::broadleaf(), 1, 60_000).expect("a broadleaf can be grown")];
    if let Some(folder) = std::env::var_os("CANOPY_DATA") {
        for name in ["oak-medium", "pine-medium", "aspen-medium"] {
            let path = Path::new(&folder).join("trees").join(name).with_extension("glb");
            match load_plant(&path, &GltfOptions::default()) {
                Ok((plant, _)) => plants.push(plant),
                Err(error) => eprintln!("{name} is left out: {error}"),
            }
        }
    }
    density(&arguments, &plants[0]);
    total(&arguments, &plants);
    shares(&arguments, &plants);
    against_visibility(&plants);
}
