//! Question: how far is the light of `expressive` from the truth, and with which constants of the shader is it nearest?
//!
//! The shader (`with_indirect_ambient` and `leaf_visibility` in `shaders/forest/instance.wgsl`, `even_sky` and `shade`
//! in `shaders/common/lighting.wgsl`) turns k_a and a crown's normal into light; here is its twin. Points lie evenly
//! over the leaves, each with its two sides, and count by how much of them is seen from all around. The truth is their
//! exitant radiance by the path tracer under the sky alone and under the sun alone, all bounces included.
//!
//! What the shader knows of the sun: the visibility along a ray, and the share that a shadow map of the near
//! cascade finds, which looks from a place before the leaf and over three texels.
//!
//! A cell of the first table has three numbers before the fit and three after it: error of classes, light as a share of
//! the truth's, and relative RMSE of single sides. A crown's normal says nothing of a single leaf's, so the last hardly
//! depends on the constants. They are fitted to means: of classes of k_a, twelve a plant and hour, each relative to
//! that plant's mean.

#![allow(clippy::expect_used)]

use std::path::Path;
use std::sync::Arc;

use canopy::bake::lighting::implicit::{ImplicitBake, ImplicitSettings, NormalSource, bake_implicit};
use canopy::bake::lighting::transfer::direction_set;
use canopy::light::{Atmosphere, AtmosphereParams, LightSettings, LightState, SunPosition, sh};
use canopy::math::luminance;
use canopy::plant::gltf::{GltfOptions, load_plant};
use canopy::plant::grow::{GrowParameters, grow};
use canopy::plant::{PartKind, Plant};
use canopy::reference::{Environment, Instance, Light, PathTracer, ReferenceScene, SurfaceSample, TraceSettings};
use canopy::trace::{Hit, PlantTracer, Ray, SurfacePoint};
use clap::Parser;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Error of the light of `expressive`, and its constants.
#[derive(Parser)]
struct Arguments {
    /// Points of a plant before the alpha test.
    #[arg(long, default_value_t = 4000)]
    points: usize,
    /// Paths a side of a point and light.
    #[arg(long, default_value_t = 48)]
    paths: u32,
    /// Passed by `cargo bench`.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Azimuth and elevation of the sun, degrees: noon of midsummer at 50 degrees north, morning, a low sun.
const HOURS: [(f64, f64); 3] = [(178.0, 63.0), (95.0, 33.0), (64.0, 9.0)];
/// Texel of the near cascade, metres.
const TEXEL: f32 = 0.033;
/// Classes of k_a.
const CLASSES: usize = 12;

/// The constants of the shader.
#[derive(Clone, Copy, Debug)]
struct Constants {
    /// Light of other leaves where no sky is seen, as a share of the sky's.
    others: f64,
    /// Share of the key light at k_a = 0, its rise with k_a, and the most that it comes to.
    sun: [f64; 3],
}

/// Before the fit.
const GUESSED: Constants = Constants { others: 0.2, sun: [0.35, 2.0, 1.1] };

impl Constants {
    /// Those of the shader, from its source.
    fn of_shader() -> Option<Self> {
        let source = include_str!("../shaders/forest/instance.wgsl");
        let numbers = |function: &str| -> Option<Vec<f64>> {
            let (_, body) = source.split_once(function)?;
            let (_, line) = body.split_once("return")?;
            let (line, _) = line.split_once(';')?;
            Some(line.split(|c: char| c != '.' && !c.is_ascii_digit()).filter_map(|word| word.parse().ok()).collect())
        };
        let others = numbers("fn with_indirect_ambient(")?;
        let sun = numbers("fn leaf_visibility(")?;
        Some(Self { others: *others.last()?, sun: sun.try_into().ok()? })
    }

    /// Twin of `with_indirect_ambient`.
    fn with_indirect_ambient(&self, k: f64) -> f64 {
        k + (1.0 - k) * self.others
    }

    /// Twin of `leaf_visibility`.
    fn leaf_visibility(&self, k: f64) -> f64 {
        let [least, slope, most] = self.sun;
        (least + slope * k).min(most)
    }
}

/// One side of a leaf at one hour; light is luminance in nits.
struct Side {
    /// How much of it is seen, over all views.
    weight: f64,
    k: f64,
    /// What the shader would have under an open sky (`even_sky` with ambient 1) and in full sun.
    open_sky: f64,
    full_sun: f64,
    /// Visibility of the sun along a ray, and by the shadow map.
    ray: f64,
    map: f64,
    /// The truth.
    sky: f64,
    sun: f64,
}

/// A point of a leaf with its bake.
struct Point {
    surface: SurfacePoint,
    transmission: Vec3,
    normal: Vec3,
    k: f32,
    weights: [f64; 2],
}

/// Points evenly over the leaves' area.
fn points(plant: &Plant, tracer: &PlantTracer, baked: &ImplicitBake, count: usize) -> Vec<Point> {
    let mut ends = Vec::new();
    let mut total = 0.0f64;
    for (part, source) in plant.parts.iter().enumerate().filter(|(_, part)| part.kind == PartKind::Foliage) {
        for (triangle, corners) in source.mesh.triangles.iter().enumerate() {
            let [a, b, c] = corners.map(|corner| source.mesh.positions[corner as usize]);
            total += f64::from((b - a).cross(c - a).length());
            ends.push((total, part, triangle));
        }
    }
    let directions = direction_set(128);
    let at = |index: usize| {
        let wanted = (index as f64 + 0.5) / count as f64 * total;
        let &(_, part, triangle) = ends.get(ends.partition_point(|end| end.0 <= wanted))?;
        let step = |by: f64| (index as f64 * by).fract() as f32;
        let (u, v) = (step(0.754_877_666_2), step(0.569_840_290_9));
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let surface = tracer.point(&Hit { t: 0.0, part: part as u32, triangle: triangle as u32, u, v, front: true });
        if !tracer.covers(part as u32, surface.uv) {
            return None;
        }
        let corners = plant.parts[part].mesh.triangles[triangle].map(|corner| corner as usize);
        let shares = [1.0 - u - v, u, v];
        let normal: Vec3 = corners.iter().zip(shares).map(|(&corner, share)| share * baked.normals[part][corner]).sum();
        let k = corners.iter().zip(shares).map(|(&corner, share)| share * baked.ambient[part][corner]).sum();
        let mut weights = [0.0; 2];
        for direction in directions.iter().filter(|direction| direction.y > -0.3) {
            if is_free(tracer, surface.leave(*direction), *direction) {
                let cosine = surface.geometric_normal.dot(*direction);
                weights[usize::from(cosine < 0.0)] += f64::from(cosine.abs());
            }
        }
        let transmission = plant.parts[part].material.transmission;
        Some(Point { surface, transmission, normal: normal.normalize_or(Vec3::Y), k, weights })
    };
    (0..count).into_par_iter().filter_map(at).collect()
}

fn is_free(tracer: &PlantTracer, origin: Vec3, direction: Vec3) -> bool {
    !tracer.occluded(&Ray { origin, direction, t_max: f32::INFINITY })
}

/// Twin of `cascade_visibility`, on the leaves themselves instead of their image.
fn mapped(tracer: &PlantTracer, point: &Point, light: Vec3) -> f64 {
    const TAPS: usize = 16;
    let slope = 1.0 - point.normal.dot(light).abs();
    let from = point.surface.position + (point.normal * (0.6 + 1.6 * slope) + light * 1.2) * TEXEL;
    let (right, up) = light.any_orthonormal_pair();
    let open = (0..TAPS).filter(|tap| {
        let place = |at: usize| 3.0 * TEXEL * ((at as f32 + 0.5) / TAPS as f32 - 0.5);
        is_free(tracer, from + right * place(tap * 7 % TAPS) + up * place(*tap), light)
    });
    open.count() as f64 / TAPS as f64
}

fn sides(
    arguments: &Arguments,
    plant: &Arc<Plant>,
    points: &[Point],
    tracer: &PlantTracer,
    state: &LightState,
) -> Vec<Side> {
    let alone = Instance { plant: 0, position: DVec3::ZERO, yaw: 0.0, scale: 1.0, tint: 0.0 };
    let scene = ReferenceScene::new(std::slice::from_ref(plant), &[alone], None).expect("a scene");
    let samples: Vec<SurfaceSample> = points
        .iter()
        .map(|point| SurfaceSample {
            position: point.surface.position,
            normal: point.surface.geometric_normal,
            reflected: point.surface.base_color,
            transmitted: point.surface.transmission,
        })
        .collect();
    let light = Light::of(state, Some(state.ground_radiance));
    let traced = |light: Light| {
        let tracer = PathTracer::new(&scene, &light, TraceSettings::default()).expect("a light");
        tracer.exitant_radiance(0, &samples, arguments.paths).expect("an instance")
    };
    let sky = traced(Light { key: None, ..light.clone() });
    let sun = traced(Light { environment: Environment::Even(Vec3::ZERO), ..light });
    let of_point = |(index, point): (usize, &Point)| {
        let (albedo, n, l) = (point.surface.base_color, point.normal, state.key_direction);
        let through = albedo * point.transmission;
        let even = |n: Vec3| sh::irradiance(&state.sky_sh, n) / std::f32::consts::PI;
        let open_sky = f64::from(luminance(albedo * even(n) + through * even(-n)));
        let shares = albedo * n.dot(l).max(0.0) + through * (-n.dot(l)).max(0.0);
        let full_sun = f64::from(luminance(shares * state.key_illuminance)) / std::f64::consts::PI;
        let ray = f64::from(u8::from(is_free(tracer, point.surface.leave(l), l)));
        let map = mapped(tracer, point, l);
        let nits = |light: Vec3| f64::from(luminance(light));
        [0, 1].map(|side| Side {
            weight: point.weights[side],
            k: f64::from(point.k),
            open_sky,
            full_sun,
            ray,
            map,
            sky: nits(sky[index][side]),
            sun: nits(sun[index][side]),
        })
    };
    let mut sides: Vec<Side> =
        points.par_iter().enumerate().flat_map_iter(of_point).filter(|side| side.weight > 0.0).collect();
    sides.sort_by(|a, b| a.k.total_cmp(&b.k));
    sides
}

/// Means of the shader's light and of the truth over classes of `sides`, which ascend by k_a, relative to the mean of
/// the truth, with weights that sum to 1.
fn classes(sides: &[Side], light: impl Fn(&Side) -> (f64, f64)) -> Vec<(f64, f64, f64)> {
    let total: f64 = sides.iter().map(|side| side.weight).sum();
    let mean: f64 = sides.iter().map(|side| side.weight * light(side).1).sum::<f64>() / total;
    sides
        .chunks(sides.len().div_ceil(CLASSES).max(1))
        .map(|class| {
            let weight: f64 = class.iter().map(|side| side.weight).sum();
            let sum = |value: &dyn Fn(&Side) -> f64| class.iter().map(|side| side.weight * value(side)).sum::<f64>();
            let (shader, truth) = (sum(&|side| light(side).0), sum(&|side| light(side).1));
            (weight / total, shader / weight / mean, truth / weight / mean)
        })
        .collect()
}

/// RMS of the classes' errors, the shader's light over the truth's, and relative RMSE of single sides.
fn error(sides: &[Side], light: impl Fn(&Side) -> (f64, f64)) -> [f64; 3] {
    let of_classes = classes(sides, &light);
    let squares: f64 = of_classes.iter().map(|(weight, shader, truth)| weight * (shader - truth).powi(2)).sum();
    let share: f64 = of_classes.iter().map(|(weight, shader, _)| weight * shader).sum();
    let (mut single, mut total, mut mean) = (0.0, 0.0, 0.0);
    for side in sides {
        let (shader, truth) = light(side);
        single += side.weight * (shader - truth).powi(2);
        mean += side.weight * truth;
        total += side.weight;
    }
    [squares.sqrt(), share, (single / total).sqrt() / (mean / total)]
}

/// The constants of `constants` (and a mean over plants and hours) with the least error of the classes.
fn best(
    all: &[Vec<Side>],
    constants: &[Constants],
    light: impl Fn(&Constants, &Side) -> (f64, f64),
) -> (f64, Constants) {
    let tried = constants.iter().map(|constants| {
        let squares: f64 = all.iter().map(|sides| error(sides, |side| light(constants, side))[0].powi(2)).sum();
        ((squares / all.len() as f64).sqrt(), *constants)
    });
    tried.min_by(|a, b| a.0.total_cmp(&b.0)).expect("constants to try")
}

fn sky(constants: &Constants, side: &Side) -> (f64, f64) {
    (side.open_sky * constants.with_indirect_ambient(side.k), side.sky)
}

fn sun(constants: &Constants, side: &Side, visibility: f64) -> (f64, f64) {
    (side.full_sun * visibility * constants.leaf_visibility(side.k), side.sun)
}

fn both(constants: &Constants, side: &Side, visibility: f64) -> (f64, f64) {
    let (sky, sun) = (sky(constants, side), sun(constants, side, visibility));
    (sky.0 + sun.0, sky.1 + sun.1)
}

fn main() {
    let arguments = Arguments::parse();
    let shader = Constants::of_shader().expect("the shader's constants");
    let grown = |form: &GrowParameters| grow(form, 1, 60_000).expect("a tree");
    let mut plants = vec![grown(&GrowParameters::broadleaf()), grown(&GrowParameters::conifer())];
    if let Some(folder) = std::env::var_os("CANOPY_DATA") {
        for name in ["oak-medium", "pine-medium", "aspen-medium"] {
            let path = Path::new(&folder).join("trees").join(name).with_extension("glb");
            match load_plant(&path, &GltfOptions::default()) {
                Ok((plant, _)) => plants.push(plant),
                Err(error) => eprintln!("{name} is left out: {error}"),
            }
        }
    }
    let atmosphere = Atmosphere::new(AtmosphereParams::default()).expect("an atmosphere");
    let hours = HOURS.map(|(azimuth, elevation)| {
        let position = SunPosition::from_degrees(azimuth, elevation).expect("a sun");
        LightState::new(&atmosphere, position, None, &LightSettings::default()).expect("light")
    });
    println!(
        "\n| expressive against the path tracer | normals | sun | sky | sun by a ray | \
         sun by a map | all, sun by a map |\n|---|---|--:|---|---|---|---|"
    );
    let mut all = Vec::new();
    for plant in plants.into_iter().map(Arc::new) {
        let tracer = PlantTracer::new(&plant);
        for (name, normals) in [("published", NormalSource::NearestVertex), ("smooth", NormalSource::Gradient)] {
            let settings = ImplicitSettings { normals, surface: false, ..ImplicitSettings::default() };
            let points = points(&plant, &tracer, &bake_implicit(&plant, &settings), arguments.points);
            for (state, (_, elevation)) in hours.iter().zip(HOURS) {
                let sides = sides(&arguments, &plant, &points, &tracer, state);
                let cell = |light: &dyn Fn(&Constants, &Side) -> (f64, f64)| {
                    let of = |constants: Constants| {
                        let [classes, share, single] = error(&sides, |side| light(&constants, side));
                        format!("{classes:.2} {share:.2} {single:.2}")
                    };
                    format!("{} → {}", of(GUESSED), of(shader))
                };
                println!(
                    "| {} | {name} | {elevation}° | {} | {} | {} | {} |",
                    plant.name,
                    cell(&sky),
                    cell(&|constants, side| sun(constants, side, side.ray)),
                    cell(&|constants, side| sun(constants, side, side.map)),
                    cell(&|constants, side| both(constants, side, side.map)),
                );
                all.push(sides);
            }
        }
    }
    println!("\n| fitted to all of them | error of classes: guessed | shader | best | with |\n|---|---|---|---|---|");
    let row = |name: &str, tried: &[Constants], light: &dyn Fn(&Constants, &Side) -> (f64, f64)| {
        let [guessed, shader] = [GUESSED, shader].map(|constants| best(&all, &[constants], light).0);
        let (error, constants) = best(&all, tried, light);
        println!("| {name} | {guessed:.3} | {shader:.3} | {error:.3} | {constants:?} |");
    };
    let others: Vec<Constants> = (0..=30).map(|i| Constants { others: 0.01 * f64::from(i), ..GUESSED }).collect();
    row("sky: others", &others, &sky);
    let mut shapes = Vec::new();
    for least in 0..=12 {
        for slope in 0..=8 {
            for most in 8..=13 {
                let sun = [0.1 * f64::from(least), 0.25 * f64::from(slope), 0.1 * f64::from(most)];
                shapes.push(Constants { sun, ..GUESSED });
            }
        }
    }
    row("sun by a ray: sun", &shapes, &|constants, side| sun(constants, side, side.ray));
    row("sun by a map: sun", &shapes, &|constants, side| sun(constants, side, side.map));
}
