//! Question: what does light from implicit surfaces [Luft 2007] cost, and how wrong are its short cuts?
//!
//! 1. The density at all vertices over the radius ρ, against a plain scalar loop on one thread, with the largest
//!    relative error of each against f64. The loop does every n-th vertex only (`--every`), and its time is multiplied.
//! 2. Field, surface and realigned normals together, and what follows from the model.
//! 3. A share of the generators: angle between normals and difference of k_a to the full result, and time.
//! 4. k_a against traced visibility (leaves: the share of the whole sphere that a ray out of the vertex reaches; wood: of
//!    the half above it): rank correlation and RMSE of both ambient fields with their automatic values, plant by plant.
//! 5. The same over the radius of each field, for the leaves of the full plants, and the RMSE with the best k_a_min,
//!    d_min and n of a search.
//!
//! The tree is our own broadleaf with 60,000 triangles; where CANOPY_DATA names the data folder also its oak, pine
//! and aspen; in 4 and 5 also our conifer and fewer triangles of both, and a bush. The contestants of a table take turns
//! in one run; medians are printed, as Markdown.

#![allow(clippy::expect_used)]

use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use canopy::bake::lighting::implicit::ambient_term::ambient_term;
use canopy::bake::lighting::implicit::density::DensityField;
use canopy::bake::lighting::implicit::depth_field::DepthField;
use canopy::bake::lighting::implicit::generators::{Generator, generators};
use canopy::bake::lighting::implicit::{
    AmbientField, ImplicitBake, ImplicitParameters, ImplicitSettings, NormalSource, Weighting, bake_implicit,
};
use canopy::bake::lighting::transfer::direction_set;
use canopy::plant::gltf::{GltfOptions, load_plant};
use canopy::plant::grow::{GrowParameters, grow};
use canopy::plant::{PartKind, Plant};
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
    /// Vertices of a plant that look around, about.
    #[arg(long, default_value_t = 10_000)]
    vertices: usize,
    /// Which tables: density, bake, shares, visibility.
    #[arg(long, value_delimiter = ',', default_values_t = ["density", "bake", "shares", "visibility"].map(String::from))]
    only: Vec<String>,
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
    foliage.flat_map(generators).collect()
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
        "\n| field, surface, normals, k_a | all as published, ms | with k_a by depth, ms | smooth, by depth, ms | without \
         surface, ms | surface, triangles | ρ, m | τ |\n|---|---|---|---|---|---|---|---|"
    );
    for plant in plants {
        let nearest = with(NormalSource::NearestVertex, 1.0);
        let published = ImplicitSettings { ambient: AmbientField::Published, ..nearest };
        let smooth = with(NormalSource::Gradient, 1.0);
        let bare = ImplicitSettings { surface: false, ..smooth };
        let run = |settings: ImplicitSettings| move || drop(black_box(bake_implicit(plant, &settings)));
        let times = medians(
            arguments.turns,
            &mut [Box::new(run(published)), Box::new(run(nearest)), Box::new(run(smooth)), Box::new(run(bare))],
        );
        let baked = bake_implicit(plant, &nearest);
        let ImplicitParameters { radius, threshold, .. } = baked.report.parameters;
        println!(
            "| {} | {:.0} | {:.0} | {:.0} | {:.0} | {} | {radius:.3} | {threshold:.3} |",
            plant.name,
            times[0],
            times[1],
            times[2],
            times[3],
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

fn rmse(found: &[f32], wanted: &[f32]) -> f64 {
    let squares: f64 = found.iter().zip(wanted).map(|(found, wanted)| f64::from(found - wanted).powi(2)).sum();
    (squares / wanted.len() as f64).sqrt()
}

/// A plant, some of its vertices as part and index, and what they see: the share of the directions in which
/// nothing of the plant is met, of all of them for leaves and of those above the surface for wood.
struct Seen<'a> {
    plant: &'a Plant,
    vertices: Vec<(usize, usize)>,
    visibility: Vec<f32>,
}

impl<'a> Seen<'a> {
    fn trace(plant: &'a Plant, count: usize) -> Self {
        let tracer = PlantTracer::new(&Arc::new(plant.clone()));
        let directions = direction_set(256);
        let all = plant.parts.iter().enumerate();
        let all = all.flat_map(|(part, source)| (0..source.mesh.positions.len()).map(move |vertex| (part, vertex)));
        let all: Vec<(usize, usize)> = all.collect();
        // Not every n-th: vertices of one kind of corner may follow each other at that distance.
        let golden = |index: usize| (index as f64 * 0.618_033_988_75).fract();
        let some = (0..count.min(all.len())).map(|index| all[(golden(index) * all.len() as f64) as usize]);
        let vertices: Vec<(usize, usize)> = some.collect();
        let seen = |&(part, vertex): &(usize, usize)| {
            let source = &plant.parts[part];
            let (position, normal) = (source.mesh.positions[vertex], source.mesh.normals[vertex]);
            let (mut open, mut of) = (0.0, 0.0);
            for direction in &directions {
                let below = normal.dot(*direction) < 0.0;
                if below && source.kind == PartKind::Wood {
                    continue;
                }
                let origin = offset_origin(position, if below { -normal } else { normal }, *direction);
                of += 1.0;
                if !tracer.occluded(&Ray { origin, direction: *direction, t_max: f32::INFINITY }) {
                    open += 1.0;
                }
            }
            open / of
        };
        let visibility = vertices.par_iter().map(seen).collect();
        Self { plant, vertices, visibility }
    }

    fn triangles(&self) -> usize {
        self.plant.parts.iter().map(|part| part.mesh.triangles.len()).sum()
    }

    /// The values at the vertices that are of one kind, from lists as a bake gives them.
    fn of(&self, kind: PartKind, lists: &[Vec<f32>]) -> (Vec<f32>, Vec<f32>) {
        let pairs = self.vertices.iter().zip(&self.visibility);
        let pairs = pairs.filter(|((part, _), _)| self.plant.parts[*part].kind == kind);
        pairs.map(|(&(part, vertex), seen)| (lists[part][vertex], *seen)).unzip()
    }
}

fn rank(found: &[f32], wanted: &[f32]) -> f64 {
    correlation(&ranks(found), &ranks(wanted))
}

fn automatic(all: &[Seen]) {
    println!(
        "\n| k_a against traced visibility | leaves, by depth: rank correlation, RMSE, mean | leaves, as published | wood, by depth \
         | wood, as published |\n|---|---|---|---|---|"
    );
    for seen in all {
        let bakes = [AmbientField::Depth, AmbientField::Published].map(|ambient| {
            bake_implicit(
                seen.plant,
                &ImplicitSettings { ambient, surface: false, ..with(NormalSource::Gradient, 1.0) },
            )
        });
        let cells = [PartKind::Foliage, PartKind::Wood].map(|kind| {
            bakes.each_ref().map(|bake| {
                let (found, wanted) = seen.of(kind, &bake.ambient);
                let off = found.iter().zip(&wanted).map(|(a, b)| f64::from(a - b)).sum::<f64>() / found.len() as f64;
                format!("{:.3} {:.3} {off:+.3}", rank(&found, &wanted), rmse(&found, &wanted))
            })
        });
        println!("| {}, {} triangles | {} |", seen.plant.name, seen.triangles(), cells.as_flattened().join(" | "),);
    }
}

/// The least RMSE over k_a_min, d_min and n, with them.
fn fitted(densities: &[f32], wanted: &[f32], automatic: &ImplicitParameters) -> (f64, ImplicitParameters) {
    let mut tried = Vec::new();
    for least in [0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45] {
        for core in [0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0] {
            for exponent in [0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0] {
                tried.push(ImplicitParameters { least, core: core * automatic.core, exponent, ..*automatic });
            }
        }
    }
    let error = |tried: &ImplicitParameters| {
        let found: Vec<f32> = densities.iter().map(|density| ambient_term(*density, tried)).collect();
        rmse(&found, wanted)
    };
    let errors: Vec<f64> = tried.par_iter().map(error).collect();
    errors.into_iter().zip(tried).min_by(|a, b| a.0.total_cmp(&b.0)).expect("something was tried")
}

fn over_radius(all: &[Seen]) {
    println!(
        "\n| leaves | field | radius, share of the extent | rank correlation | RMSE, automatic | RMSE, fitted | k_a_min | d_min | n \
         |\n|---|---|---|---|---|---|---|---|---|"
    );
    for seen in all {
        let extent = seen.plant.bounds().expect("a plant").size().max_element();
        let leaves = seen.vertices.iter().filter(|(part, _)| seen.plant.parts[*part].kind == PartKind::Foliage);
        let points: Vec<Vec3> = leaves.map(|&(part, v)| seen.plant.parts[part].mesh.positions[v]).collect();
        let (generators, occluders) =
            (foliage_generators(seen.plant), seen.plant.parts.iter().flat_map(generators).collect::<Vec<_>>());
        let fields = [
            (AmbientField::Published, &[0.02, 0.04, 0.05, 0.06, 0.08, 0.1, 0.2][..]),
            (AmbientField::Depth, &[0.005, 0.01, 0.02, 0.04][..]),
        ];
        for (ambient, shares) in fields {
            for share in shares {
                let radius = Some(share * extent);
                let settings = ImplicitSettings { ambient, surface: false, ..with(NormalSource::Gradient, 1.0) };
                let settings = match ambient {
                    AmbientField::Published => ImplicitSettings { radius, ..settings },
                    AmbientField::Depth => ImplicitSettings { ambient_radius: radius, ..settings },
                };
                let baked = bake_implicit(seen.plant, &settings);
                let automatic = baked.report.parameters;
                let densities: Vec<f32> = match ambient {
                    AmbientField::Published => {
                        let field = DensityField::new(&generators, automatic.radius, Weighting::LeafArea);
                        field.values(&points).into_iter().map(|value| value - automatic.threshold).collect()
                    }
                    AmbientField::Depth => {
                        DepthField::new(&occluders, automatic.ambient_radius, extent).depths(&points)
                    }
                };
                let (found, wanted) = seen.of(PartKind::Foliage, &baked.ambient);
                let open: Vec<f32> = densities.iter().map(|density| -density).collect();
                let (error, best) = fitted(&densities, &wanted, &automatic);
                println!(
                    "| {}, {} triangles | {ambient:?} | {:.1} % | {:.3} | {:.3} | {error:.3} | {:.2} | {:.2} | {:.1} |",
                    seen.plant.name,
                    seen.triangles(),
                    100.0 * share,
                    rank(&open, &wanted),
                    rmse(&found, &wanted),
                    best.least,
                    best.core,
                    best.exponent,
                );
            }
        }
    }
}

fn plant_of(folder: &std::ffi::OsStr, name: &str) -> Option<Plant> {
    let path = Path::new(folder).join("trees").join(name).with_extension("glb");
    match load_plant(&path, &GltfOptions::default()) {
        Ok((plant, _)) => Some(plant),
        Err(error) => {
            eprintln!("{name} is left out: {error}");
            None
        }
    }
}

fn main() {
    let arguments = Arguments::parse();
    let grown = |form: &GrowParameters, triangles: usize| grow(form, 1, triangles).expect("a plant can be grown");
    let mut plants = vec![grown(&GrowParameters::broadleaf(), 60_000)];
    let folder = std::env::var_os("CANOPY_DATA");
    if let Some(folder) = &folder {
        plants.extend(["oak-medium", "pine-medium", "aspen-medium"].iter().filter_map(|name| plant_of(folder, name)));
    }
    let wants = |table: &str| arguments.only.iter().any(|only| only == table);
    if wants("density") {
        density(&arguments, &plants[0]);
    }
    if wants("bake") {
        total(&arguments, &plants);
    }
    if wants("shares") {
        shares(&arguments, &plants);
    }
    if !wants("visibility") {
        return;
    }
    plants.push(grown(&GrowParameters::conifer(), 60_000));
    plants.extend(folder.as_deref().and_then(|folder| plant_of(folder, "bush-1")));
    let full = plants.len();
    for form in [GrowParameters::broadleaf(), GrowParameters::conifer()] {
        plants.extend([8_000, 24_000].map(|triangles| grown(&form, triangles)));
    }
    let seen: Vec<Seen> = plants.iter().map(|plant| Seen::trace(plant, arguments.vertices)).collect();
    automatic(&seen);
    over_radius(&seen[..full]);
}
