//! Question: what does a transfer bake cost, and how wrong is the light that comes out of it?
//!
//! 1. The bake's rays against the crate `obvhs` alone: the same rays, the same tree settings, the same alpha test,
//!    and nothing done with the answers. Then the whole bake, so that one sees what is not rays.
//! 2. Cold bakes, setting by setting.
//! 3. Exitant radiance of vertices under sky light over a day against a path tracer with 16,384 rays a vertex (the
//!    same number of bounces; skies, azimuths and hours that the fit has not seen): relative RMSE, that is, the root
//!    of the mean square of the luminance's error over its mean, then the root mean square over the day. Bands apart
//!    from rays; what is clamped; what fewer bounces lose; what storage costs.
//!
//! The contestants of a table take turns in one run; medians are printed, as Markdown.

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use canopy::bake::transfer::{
    Channels, Interior, Projection, TransferBake, TransferFormat, TransferSettings, bake_transfer, direction_set,
    exitant_radiance, share,
};
use canopy::light::atmosphere::luminance;
use canopy::light::{Atmosphere, AtmosphereParams, LightSettings, LightState, SunPosition};
use canopy::plant::grow::{GrowParameters, grow};
use canopy::plant::{PartKind, Plant};
use canopy::trace::{PlantTracer, Ray};
use clap::Parser;
use glam::{Vec2, Vec3};
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray as TreeRay, RayHit};
use obvhs::triangle::Triangle;
use rayon::prelude::*;

/// What a transfer bake costs, and how wrong its light is.
#[derive(Parser)]
struct Arguments {
    /// Triangles of the tree (our broadleaf, seed 1).
    #[arg(long, default_value_t = 60_000)]
    triangles: usize,
    /// Vertices whose light is compared.
    #[arg(long, default_value_t = 400)]
    vertices: usize,
    /// Rays of the table over bands.
    #[arg(long, default_value_t = 1024)]
    rays: u32,
    /// Most rays of the table over rays.
    #[arg(long, default_value_t = 4096)]
    most_rays: u32,
    /// Turns of each contestant of the first table.
    #[arg(long, default_value_t = 3)]
    turns: usize,
    /// Which tables: rays, cold, error.
    #[arg(long, value_delimiter = ',', default_values_t = ["rays".to_string(), "cold".into(), "error".into()])]
    only: Vec<String>,
    /// Given by cargo.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Rays a vertex of the truth.
const TRUTH_RAYS: u32 = 16_384;

/// Azimuth and elevation of the sun over a summer's day at 50 degrees north, degrees.
const DAY: [(f64, f64); 8] =
    [(53.0, 1.3), (64.0, 9.0), (78.0, 18.0), (95.0, 33.0), (122.0, 49.0), (178.0, 63.0), (251.0, 47.0), (301.0, 4.0)];

fn main() {
    let arguments = Arguments::parse();
    let wants = |table: &str| arguments.only.iter().any(|only| only == table);
    let plant = Arc::new(grow(&GrowParameters::broadleaf(), 1, arguments.triangles).expect("a tree"));
    let vertices: usize = plant.parts.iter().map(|part| part.mesh.positions.len()).sum();
    println!("{} triangles, {vertices} vertices, {} threads\n", arguments.triangles, rayon::current_num_threads());
    if wants("rays") {
        rays(&plant, arguments.turns);
    }
    if wants("cold") {
        cold(&plant);
    }
    if wants("error") {
        error(&plant, &arguments);
    }
}

// ---------------------------------------------------------------------------------------------------------- 1. rays

/// Every vertex with the sides that a bake looks to.
struct Vertex {
    part: usize,
    vertex: usize,
    position: Vec3,
    normal: Vec3,
    two_sided: bool,
}

fn vertices_of(plant: &Plant) -> Vec<Vertex> {
    let of_part = |(part, source): (usize, &canopy::plant::PlantPart)| {
        let two_sided = source.kind == PartKind::Foliage;
        let mesh = &source.mesh;
        (0..mesh.positions.len())
            .map(|vertex| Vertex {
                part,
                vertex,
                position: mesh.positions[vertex],
                normal: mesh.normals[vertex],
                two_sided,
            })
            .collect::<Vec<_>>()
    };
    plant.parts.iter().enumerate().flat_map(of_part).collect()
}

/// Asks `meets` for every ray of a bake (origin, direction, whether it is followed to what it meets), in parallel and
/// in the order of a bake; gives how many rays there are and how many meet something.
fn bake_rays(plant: &Plant, rays: u32, meets: impl Fn(Vec3, Vec3, bool) -> bool + Sync) -> (usize, usize) {
    let bounds = plant.bounds().expect("a tree");
    let start = bounds.size().max_element() / 65_536.0;
    let mut set: Vec<(usize, Vec3)> = direction_set(rays).into_iter().enumerate().collect();
    set.sort_by_key(|(i, d)| (u8::from(d.x < 0.0) | u8::from(d.y < 0.0) << 1 | u8::from(d.z < 0.0) << 2, *i));
    // Vertices of one card or ring lie beside each other in the mesh, as along the bake's curve.
    let batch = |batch: &[Vertex]| {
        let (mut count, mut met) = (0, 0);
        for (index, direction) in &set {
            for v in batch {
                let cosine = v.normal.dot(*direction);
                if cosine > 0.0 || (cosine < 0.0 && v.two_sided) {
                    count += 1;
                    met += usize::from(meets(v.position + *direction * start, *direction, index % 3 == 1));
                }
            }
        }
        (count, met)
    };
    vertices_of(plant).par_chunks(64).map(batch).reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
}

fn rays(plant: &Arc<Plant>, turns: usize) {
    let settings = TransferSettings::default();
    let tracer = PlantTracer::new(plant);
    let mut triangles = Vec::new();
    let mut uvs: Vec<(u32, bool, [Vec2; 3])> = Vec::new();
    for (part, source) in plant.parts.iter().enumerate() {
        for corners in &source.mesh.triangles {
            let [a, b, c] = corners.map(|c| source.mesh.positions[c as usize].to_array().into());
            triangles.push(Triangle { v0: a, v1: b, v2: c });
            uvs.push((part as u32, source.kind == PartKind::Foliage, corners.map(|c| source.mesh.uvs[c as usize])));
        }
    }
    let cover = |triangle: &Triangle, (part, tested, [a, b, c]): &(u32, bool, [Vec2; 3]), ray: &TreeRay| {
        let t = triangle.intersect(ray);
        if t < ray.tmax && *tested {
            // Not `Triangle::compute_barycentric`, which is off by the length of the normal.
            let (e1, e2) = (triangle.v0 - triangle.v1, triangle.v2 - triangle.v0);
            let (r, n) = (ray.direction.cross(triangle.v0 - ray.origin), e1.cross(e2));
            let scale = 1.0 / n.dot(ray.direction);
            let uv = *a + (*b - *a) * (r.dot(e2) * scale) + (*c - *a) * (r.dot(e1) * scale);
            if !tracer.covers(*part, uv) {
                return f32::INFINITY;
            }
        }
        t
    };
    let ordered = |order: &[u32]| -> (Vec<Triangle>, Vec<(u32, bool, [Vec2; 3])>) {
        order.iter().map(|i| (triangles[*i as usize], uvs[*i as usize])).unzip()
    };
    let tree_ray = |o: Vec3, d: Vec3| TreeRay::new_inf(o.to_array().into(), d.to_array().into());
    let wide = build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
    let (wide_triangles, wide_uvs) = ordered(&wide.primitive_indices);
    let narrow = build_bvh2_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
    let (narrow_triangles, narrow_uvs) = ordered(&narrow.primitive_indices);

    let alone = |o: Vec3, d: Vec3, followed: bool| {
        let test = |ray: &TreeRay, i: usize| cover(&wide_triangles[i], &wide_uvs[i], ray);
        if followed {
            wide.ray_traverse(tree_ray(o, d), &mut RayHit::none(), test)
        } else {
            !wide.ray_traverse_miss(tree_ray(o, d), test)
        }
    };
    let binary = |o: Vec3, d: Vec3, followed: bool| {
        let test = |ray: &TreeRay, i: usize| cover(&narrow_triangles[i], &narrow_uvs[i], ray);
        if followed {
            let mut hit = RayHit::none();
            narrow.ray_traverse(tree_ray(o, d), &mut hit, test);
            hit.t < f32::INFINITY
        } else {
            !narrow.ray_traverse_miss(tree_ray(o, d), test)
        }
    };
    let ours = |origin: Vec3, direction: Vec3, followed: bool| {
        let ray = Ray { origin, direction, t_max: f32::INFINITY };
        if followed { tracer.closest(&ray).is_some() } else { tracer.occluded(&ray) }
    };
    // The skies of the fit are found once a process, and are not rays.
    black_box(bake_transfer(plant, &TransferSettings { rays: 16, ..settings }));
    let names = ["obvhs alone, `CwBvh`", "obvhs alone, `Bvh2`", "`PlantTracer`", "whole bake, bounces included"];
    let mut times = [const { Vec::new() }; 4];
    let mut found = [(0, 0); 3];
    for _ in 0..turns.max(1) {
        for (contestant, times) in times.iter_mut().enumerate() {
            let start = Instant::now();
            match contestant {
                0 => found[0] = bake_rays(plant, settings.rays, alone),
                1 => found[1] = bake_rays(plant, settings.rays, binary),
                2 => found[2] = bake_rays(plant, settings.rays, ours),
                _ => drop(black_box(bake_transfer(plant, &settings))),
            }
            times.push(start.elapsed().as_secs_f64());
        }
    }
    let median = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    let times = times.each_mut().map(median);
    let [(count, alone), (_, binary), (_, ours)] = found;
    println!("## Rays\n\n{count} rays; {ours} meet the tree, {alone} and {binary} by obvhs alone\n");
    println!("| | s | million rays a second | times obvhs alone |\n|---|---|---|---|");
    for (name, time) in names.iter().zip(times) {
        println!("| {name} | {time:.2} | {:.2} | {:.2} |", count as f64 / time / 1e6, time / times[0]);
    }
    println!();
}

// ---------------------------------------------------------------------------------------------------------- 2. cold

fn cold(plant: &Arc<Plant>) {
    println!("## Cold bakes\n\n| | s |\n|---|---|");
    let default = TransferSettings::default();
    let settings = [
        ("default", default),
        ("6 bands", TransferSettings { bands: 6, ..default }),
        ("3 bands in colour", TransferSettings { channels: Channels::Rgb, ..default }),
        ("straight through up to 3 leaves", TransferSettings { interior: Interior::Straight(3), ..default }),
    ];
    for (name, settings) in settings {
        let start = Instant::now();
        black_box(bake_transfer(plant, &settings));
        println!("| {name} | {:.2} |", start.elapsed().as_secs_f64());
    }
    println!();
}

// --------------------------------------------------------------------------------------------------------- 3. error

/// A generator of its own (SplitMix64).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u32 << 24) as f32
    }

    /// Around the unit vector `normal`, in proportion to the cosine.
    fn cosine(&mut self, normal: Vec3) -> Vec3 {
        let (y, turn) = (1.0 - 2.0 * self.unit(), std::f32::consts::TAU * self.unit());
        let (s, (sin, cos)) = ((1.0 - y * y).max(0.0).sqrt(), turn.sin_cos());
        (normal + Vec3::new(s * cos, y, s * sin)).normalize_or(normal)
    }
}

/// What one vertex truly gets: irradiance over pi of front and back, sky by sky; and the part of it that came over
/// not more than each number of bounces.
struct Truth {
    sides: Vec<[Vec3; 2]>,
    /// Of the first sky, front and back together: by number of bounces, 0 to 8.
    by_bounces: [f32; 9],
}

fn truth(tracer: &PlantTracer, v: &Vertex, bounces: usize, skies: &[LightState], seed: u64) -> Truth {
    let mut random = Random(seed);
    let start = tracer.bounds().expect("a tree").size().max_element() / 65_536.0;
    let mut sides = vec![[Vec3::ZERO; 2]; skies.len()];
    let mut by_bounces = [0.0; 9];
    for direction in direction_set(TRUTH_RAYS) {
        let cosine = v.normal.dot(direction);
        if cosine == 0.0 || (cosine < 0.0 && !v.two_sided) {
            continue;
        }
        let side = usize::from(cosine < 0.0);
        let mut through = Vec3::splat(cosine.abs() * 4.0 / TRUTH_RAYS as f32);
        let mut ray = Ray { origin: v.position + direction * start, direction, t_max: f32::INFINITY };
        for (bounce, arrived) in by_bounces.iter_mut().enumerate() {
            let Some(hit) = tracer.closest(&ray) else {
                if bounce <= bounces {
                    for (sky, sides) in skies.iter().zip(&mut sides) {
                        sides[side] += through * sky.surroundings().radiance(ray.direction);
                    }
                }
                *arrived += luminance(through * skies[0].surroundings().radiance(ray.direction));
                break;
            };
            let surface = tracer.point(&hit);
            if surface.kind == PartKind::Wood && !hit.front {
                break;
            }
            let (near, far) = (luminance(surface.base_color), luminance(surface.transmission));
            if near + far <= 0.0 {
                break;
            }
            let reflected = random.unit() * (near + far) < near;
            through *= if reflected {
                surface.base_color * ((near + far) / near)
            } else {
                surface.transmission * ((near + far) / far)
            };
            let outward = if hit.front == reflected { surface.shading_normal } else { -surface.shading_normal };
            ray.direction = random.cosine(outward);
            ray.origin = surface.leave(ray.direction);
        }
    }
    Truth { sides, by_bounces }
}

/// What leaves a vertex whose base colour is white.
fn exitant(plant: &Plant, v: &Vertex, [front, back]: [Vec3; 2], from_back: bool) -> Vec3 {
    let t = plant.parts[v.part].material.transmission;
    match (v.two_sided, from_back) {
        (false, _) => front,
        (true, false) => front + t * back,
        (true, true) => back + t * front,
    }
}

struct Judge<'a> {
    plant: &'a Plant,
    vertices: &'a [Vertex],
    truths: &'a [Truth],
    skies: &'a [LightState],
}

/// What a judge finds.
struct Verdict {
    luminance: f64,
    rgb: f64,
    /// How much light clamping added, as a share of all.
    clamped: f64,
    /// Luminance's error, sky by sky.
    hours: Vec<f64>,
}

impl Judge<'_> {
    fn judge(&self, bake: &TransferBake) -> Verdict {
        let (mut of_day, mut of_day_rgb, mut added, mut total) = (0.0, 0.0, 0.0, 0.0);
        let mut hours = Vec::new();
        for (s, sky) in self.skies.iter().enumerate() {
            let light = sky.surroundings().project(usize::from(bake.settings.bands));
            let (mut squares, mut squares_rgb, mut sum, mut sum_rgb, mut count) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for (v, truth) in self.vertices.iter().zip(self.truths) {
                let part = &bake.parts[v.part];
                let sides = [part.front_of(v.vertex, &bake.settings), part.back_of(v.vertex, &bake.settings)];
                for from_back in [false, true].into_iter().take(1 + usize::from(v.two_sided)) {
                    let want = exitant(self.plant, v, truth.sides[s], from_back);
                    let (near, far) = (sides[usize::from(from_back)], sides[usize::from(!from_back)]);
                    let t = self.plant.parts[v.part].material.transmission;
                    let far = if v.two_sided { far } else { &[] };
                    let got = exitant_radiance(&light, near, far, Vec3::ONE, t);
                    squares += f64::from(luminance(got - want)).powi(2);
                    squares_rgb += f64::from((got - want).length_squared()) / 3.0;
                    sum += f64::from(luminance(want));
                    sum_rgb += f64::from(want.element_sum()) / 3.0;
                    count += 1.0;
                    let side = share(&light, near);
                    total += f64::from(luminance(side));
                    if side == Vec3::ZERO {
                        let negative: Vec<f32> = near.iter().map(|c| -c).collect();
                        added += f64::from(luminance(share(&light, &negative)));
                    }
                }
            }
            hours.push(100.0 * (squares / count).sqrt() * count / sum);
            of_day += squares / count / (sum / count).powi(2);
            of_day_rgb += squares_rgb / count / (sum_rgb / count).powi(2);
        }
        let root = |sum: f64| 100.0 * (sum / self.skies.len() as f64).sqrt();
        Verdict { luminance: root(of_day), rgb: root(of_day_rgb), clamped: 100.0 * added / total, hours }
    }
}

fn error(plant: &Arc<Plant>, arguments: &Arguments) {
    let atmosphere = Atmosphere::new(AtmosphereParams::default()).expect("an atmosphere");
    let skies: Vec<LightState> = DAY
        .iter()
        .map(|&(azimuth, elevation)| {
            let sun = SunPosition::from_degrees(azimuth, elevation).expect("a sun");
            LightState::new(&atmosphere, sun, None, &LightSettings::default()).expect("light")
        })
        .collect();
    let tracer = PlantTracer::new(plant);
    let all = vertices_of(plant);
    let step = (all.len() / arguments.vertices.max(1)).max(1);
    let vertices: Vec<Vertex> = all.into_iter().step_by(step).collect();
    let default = TransferSettings::default();
    let Interior::Diffuse(bounces) = default.interior else { unreachable!("the default bounces") };
    let start = Instant::now();
    let truths: Vec<Truth> = vertices
        .par_iter()
        .enumerate()
        .map(|(seed, v)| truth(&tracer, v, usize::from(bounces), &skies, seed as u64))
        .collect();
    println!("## Error\n\n{} vertices, truth in {:.1} s\n", vertices.len(), start.elapsed().as_secs_f64());
    let judge = Judge { plant, vertices: &vertices, truths: &truths, skies: &skies };
    let percent = |settings: TransferSettings| judge.judge(&bake_transfer(plant, &settings));

    println!(
        "### Bands, {} rays\n\n| bands | projection, % | fit, % | clamped light of the fit, % |\n|---|---|---|---|",
        arguments.rays
    );
    for bands in 2..=6 {
        let settings = TransferSettings { bands, rays: arguments.rays, ..default };
        let projection = percent(TransferSettings { projection: Projection::Quadrature, ..settings });
        let fit = percent(TransferSettings { projection: Projection::Fit, ..settings });
        println!("| {bands} | {:.2} | {:.2} | {:.3} |", projection.luminance, fit.luminance, fit.clamped);
    }

    println!(
        "\n### Rays, {} bands\n\n| rays | projection, % | fit, % | bake of the fit, s |\n|---|---|---|---|",
        default.bands
    );
    for rays in [16, 32, 64, 128, 256, 512, 1024, 2048, 4096].into_iter().filter(|r| *r <= arguments.most_rays) {
        let projection = percent(TransferSettings { rays, projection: Projection::Quadrature, ..default });
        let start = Instant::now();
        let bake = bake_transfer(plant, &TransferSettings { rays, ..default });
        let time = start.elapsed().as_secs_f64();
        println!("| {rays} | {:.2} | {:.2} | {time:.2} |", projection.luminance, judge.judge(&bake).luminance);
    }

    println!(
        "\n### Hours, {} rays, fit\n\n| sun, degrees high | 3 bands, % | 6 bands, % |\n|---|---|---|",
        arguments.rays
    );
    let three = percent(TransferSettings { bands: 3, rays: arguments.rays, ..default });
    let six = percent(TransferSettings { bands: 6, rays: arguments.rays, ..default });
    for ((_, elevation), (three, six)) in DAY.iter().zip(three.hours.iter().zip(&six.hours)) {
        println!("| {elevation} | {three:.1} | {six:.1} |");
    }

    println!(
        "\n### Colour and interior, {} bands, {} rays\n\n| | luminance, % | RGB, % |\n|---|---|---|",
        default.bands, default.rays
    );
    let rows = [
        ("one channel", default),
        ("three channels", TransferSettings { channels: Channels::Rgb, ..default }),
        ("1 bounce", TransferSettings { interior: Interior::Diffuse(1), ..default }),
        ("8 bounces", TransferSettings { interior: Interior::Diffuse(8), ..default }),
        ("no interior light", TransferSettings { interior: Interior::Straight(0), ..default }),
        ("straight through 3 leaves", TransferSettings { interior: Interior::Straight(3), ..default }),
    ];
    for (name, settings) in rows {
        let verdict = percent(settings);
        println!("| {name} | {:.2} | {:.2} |", verdict.luminance, verdict.rgb);
    }
    let total: f32 = truths.iter().flat_map(|t| t.by_bounces).sum();
    let mut passed = 0.0;
    print!("\nShare of the light that comes over at most n bounces, low sun:");
    for n in 0..9 {
        passed += truths.iter().map(|t| t.by_bounces[n]).sum::<f32>();
        print!(" {:.1} %", 100.0 * passed / total);
    }
    println!();

    println!(
        "\n### Storage, default settings\n\n| | bytes a leaf's vertex | error against the truth, % | RMS change, % |\n|---|---|---|---|"
    );
    let bake = bake_transfer(plant, &default);
    for format in [TransferFormat::Float32, TransferFormat::Float16, TransferFormat::Snorm8] {
        let back = bake.pack(format).unpack();
        let change = change(&judge, &bake, &back);
        let bytes = format.vertex_bytes(&default, 2);
        println!("| {format:?} | {bytes} | {:.2} | {change:.3} |", judge.judge(&back).luminance);
    }
}

/// Root mean square of what storage changes in E / pi, relative to its mean, over the day.
fn change(judge: &Judge, bake: &TransferBake, stored: &TransferBake) -> f64 {
    let mut of_day = 0.0;
    for sky in judge.skies {
        let light = sky.surroundings().project(usize::from(bake.settings.bands));
        let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
        for v in judge.vertices {
            let value =
                |bake: &TransferBake| luminance(share(&light, bake.parts[v.part].front_of(v.vertex, &bake.settings)));
            let (want, got) = (value(bake), value(stored));
            squares += f64::from(got - want).powi(2);
            sum += f64::from(want);
            count += 1.0;
        }
        of_day += squares / count / (sum / count).powi(2);
    }
    100.0 * (of_day / judge.skies.len() as f64).sqrt()
}
