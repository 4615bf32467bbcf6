//! Question: how fast is the ground truth, and how many samples does it take?
//!
//! 1. Million rays a second through a grown broadleaf and through a small stand of them on hills: the first surface of
//!    rays from a camera, the first surface of rays between the leaves, and whether such rays meet anything.
//! 2. Relative error of an image of the stand over the samples per pixel, against one of many samples and another seed,
//!    with the seconds it takes. Independent samples would keep the last column level: error times root of samples.
//! 3. Share of the light in an image of the stand from above that is missing when light is scattered between surfaces
//!    a few times only.
//!
//! Run `cargo bench --bench reference -- --help` for the arguments.

#![allow(clippy::expect_used)]

use std::hint::black_box;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use canopy::light::moon::MoonSetting;
use canopy::light::{Atmosphere, AtmosphereParams, LightSettings, LightState, Observer, SunPosition};
use canopy::math::{halton, hash::unit_f64};
use canopy::plant::Plant;
use canopy::plant::grow::{GrowParameters, grow};
use canopy::reference::{
    Camera, Film, Ground, GroundColor, GroundShape, Instance, Light, PathTracer, ReferenceScene, Shot, TraceSettings,
    WorldRay,
};
use canopy::scatter::Stream;
use canopy::scene::Viewpoint;
use canopy::terrain::{HeightField, Surroundings, Terrain};
use clap::Parser;
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

/// Turns of each contestant of the first table.
const TURNS: usize = 5;

#[derive(Parser)]
struct Arguments {
    /// Triangles of the broadleaf, 5000 to 100000.
    #[arg(long, default_value_t = 60_000)]
    triangles: usize,
    /// Trees of the stand.
    #[arg(long, default_value_t = 200)]
    trees: u64,
    /// Rays of each contestant.
    #[arg(long, default_value_t = 400_000)]
    rays: u64,
    /// Width of the image in pixels; its height is three quarters of it.
    #[arg(long, default_value_t = 64)]
    width: u32,
    /// Samples a pixel of the image that errors are measured against.
    #[arg(long, default_value_t = 1024)]
    truth: u32,
    /// Most samples per pixel of the images that are measured.
    #[arg(long, default_value_t = 64)]
    most: u32,
    /// Cargo hands this on.
    #[arg(long, hide = true)]
    bench: bool,
}

fn hills() -> Arc<Terrain> {
    let height = |i: usize| {
        let (x, z) = ((i % 129) as f32, (i / 129) as f32);
        8.0 * (x * 0.11).sin() * (z * 0.13).cos() + 1.5 * (x * 0.5 + z * 0.3).sin()
    };
    let field = HeightField::new(129, 129, DVec2::splat(4.0), (0..129 * 129).map(height).collect())
        .expect("the heights are finite");
    Arc::new(Terrain::new(field, None, Surroundings::Mirror))
}

fn stand(plant: &Arc<Plant>, trees: u64) -> ReferenceScene {
    let terrain = hills();
    let side = 7.0 * (trees as f64).sqrt();
    let place = |index: u64| {
        let xz = (halton(index) - 0.5) * side;
        Instance {
            plant: 0,
            position: DVec3::new(xz.x, terrain.height(xz.x, xz.y), xz.y),
            yaw: (unit_f64(1, index, Stream::Yaw) * std::f64::consts::TAU) as f32,
            scale: (0.7 + 0.5 * unit_f64(1, index, Stream::Scale)) as f32,
            tint: (2.0 * unit_f64(1, index, Stream::Tint) - 1.0) as f32,
        }
    };
    let instances: Vec<Instance> = (0..trees).map(place).collect();
    let color = GroundColor::Even(Vec3::new(0.08, 0.10, 0.04));
    let ground = Ground { shape: GroundShape::Terrain(terrain), color, max_distance: 3000.0 };
    ReferenceScene::new(std::slice::from_ref(plant), &instances, Some(ground)).expect("the stand is possible")
}

fn alone(plant: &Arc<Plant>) -> ReferenceScene {
    let tree = Instance { plant: 0, position: DVec3::ZERO, yaw: 0.0, scale: 1.0, tint: 0.0 };
    ReferenceScene::new(std::slice::from_ref(plant), &[tree], None).expect("the tree is possible")
}

fn even_direction(index: u64) -> DVec3 {
    let y = 2.0 * unit_f64(3, index, Stream::PointX) - 1.0;
    let (sine, cosine) = (unit_f64(3, index, Stream::PointZ) * std::f64::consts::TAU).sin_cos();
    let level = (1.0 - y * y).sqrt();
    DVec3::new(level * cosine, y, level * sine)
}

/// Rays from leaf to everywhere: where the rays of a camera end, and on from there.
fn between_leaves(scene: &ReferenceScene, rays: &[WorldRay]) -> Vec<WorldRay> {
    let on = |(index, ray): (usize, &WorldRay)| {
        let t = scene.distance(ray)?;
        let direction = even_direction(index as u64);
        // A centimetre away from the surface, so that all start in the open.
        Some(WorldRay::new(ray.at(t - 0.01), direction))
    };
    rays.par_iter().enumerate().filter_map(on).collect()
}

fn camera_rays(shot: &Shot, count: u64) -> Vec<WorldRay> {
    let (width, height) = shot.camera.size;
    let ray = |index: u64| {
        let at = halton(index) * DVec2::new(f64::from(width), f64::from(height));
        shot.camera.ray(at.x as u32, at.y as u32, (at - at.floor()).as_vec2())
    };
    (0..count).map(ray).collect()
}

fn rays_a_second(scenes: &[(&str, ReferenceScene, Shot)], count: u64) {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread pool");
    println!(
        "\n| million rays a second | one thread | {} threads | share that meets something |\n|---|---|---|---|",
        rayon::current_num_threads()
    );
    for (name, scene, shot) in scenes {
        let camera = camera_rays(shot, count);
        let leaves = between_leaves(scene, &camera);
        let meets = |ray: &WorldRay| scene.distance(ray).is_some();
        let occluded = |ray: &WorldRay| scene.occluded(ray);
        let contestants: [(&str, &[WorldRay], &(dyn Fn(&WorldRay) -> bool + Sync)); 3] = [
            ("camera, first surface", &camera, &meets),
            ("between leaves, first surface", &leaves, &meets),
            ("between leaves, anything", &leaves, &occluded),
        ];
        let mut times = [const { [Vec::new(), Vec::new()] }; 3];
        let mut met = [0; 3];
        for _ in 0..TURNS {
            for (contestant, (_, rays, question)) in contestants.iter().enumerate() {
                let mut run = || met[contestant] = black_box(rays.par_iter().filter(|ray| question(ray)).count());
                let start = Instant::now();
                one.install(&mut run);
                times[contestant][0].push(start.elapsed().as_secs_f64());
                let start = Instant::now();
                run();
                times[contestant][1].push(start.elapsed().as_secs_f64());
            }
        }
        for (((what, rays, _), times), met) in contestants.iter().zip(&mut times).zip(met) {
            let rate = |times: &mut Vec<f64>| {
                times.sort_by(f64::total_cmp);
                rays.len() as f64 / times[TURNS / 2] * 1e-6
            };
            let (one, all) = (rate(&mut times[0]), rate(&mut times[1]));
            println!("| {name}: {what} | {one:.2} | {all:.2} | {:.2} |", met as f64 / rays.len() as f64);
        }
    }
}

fn daylight() -> LightState {
    let observer = Observer::new(47.0, 9.0, 400.0).expect("a place");
    let instant = "2026-06-21T15:30:00Z".parse().expect("an instant");
    let sun = SunPosition::at(instant, &observer).expect("a sun");
    let moon = MoonSetting::None.moon(Some((instant, &observer)), &sun).expect("no moon");
    let atmosphere = Atmosphere::new(AtmosphereParams::with_visibility_km(40.0)).expect("an atmosphere");
    LightState::new(&atmosphere, sun, moon, &LightSettings::default()).expect("a light")
}

/// Root of the mean square of the difference, over the truth's mean.
fn relative_error(film: &Film, truth: &[Vec3]) -> f64 {
    let difference: f64 =
        film.radiance().iter().zip(truth).map(|(a, b)| f64::from((*a - *b).length_squared()) / 3.0).sum();
    let mean: f64 = truth.iter().map(|pixel| f64::from(pixel.element_sum()) / 3.0).sum::<f64>() / truth.len() as f64;
    (difference / truth.len() as f64).sqrt() / mean
}

fn trace(scene: &ReferenceScene, light: &Light, settings: TraceSettings, shot: &Shot, film: &mut Film, samples: u32) {
    let tracer = PathTracer::new(scene, light, settings).expect("the light is possible");
    let mut on = |_: &Film| ControlFlow::Continue(());
    tracer.render(shot, film, samples, &mut on).expect("the camera is possible");
}

/// What is missing without the later bounces, over the image's mean.
fn bounces(scene: &ReferenceScene, shot: &Shot, samples: u32) {
    let light = Light::of(&daylight(), None);
    let mean = |bounces: u32| {
        let mut film = Film::new(shot).expect("the camera is possible");
        trace(scene, &light, TraceSettings { bounces, ..TraceSettings::default() }, shot, &mut film, samples);
        film.radiance().iter().map(|pixel| f64::from(pixel.element_sum())).sum::<f64>()
    };
    let whole = mean(u32::MAX);
    println!("\n| bounces | share of the light that is missing |\n|---|---|");
    for count in [0, 1, 2, 3, 4, 5, 8] {
        println!("| {count} | {:.4} |", 1.0 - mean(count) / whole);
    }
}

fn convergence(scene: &ReferenceScene, shot: &Shot, arguments: &Arguments) {
    let light = Light::of(&daylight(), None);
    let render = |film: &mut Film, seed: u64, samples: u32| {
        trace(scene, &light, TraceSettings { seed, ..TraceSettings::default() }, shot, film, samples);
    };
    let mut truth = Film::new(shot).expect("the camera is possible");
    render(&mut truth, 2, arguments.truth);
    let own = truth.relative_error().unwrap_or_default();
    let truth = truth.radiance();
    let (width, height) = shot.camera.size;
    println!(
        "\n| samples a pixel ({width} x {height}, against {} of another seed, whose own error is at most {own:.4}) | \
         seconds | relative RMSE | error · √samples |\n|---|---|---|---|",
        arguments.truth
    );
    let mut film = Film::new(shot).expect("the camera is possible");
    let mut seconds = 0.0;
    let mut samples = 1;
    while samples <= arguments.most {
        let start = Instant::now();
        render(&mut film, 1, samples);
        seconds += start.elapsed().as_secs_f64();
        let error = relative_error(&film, &truth);
        println!("| {samples} | {seconds:.2} | {error:.4} | {:.3} |", error * f64::from(samples).sqrt());
        samples *= 2;
    }
}

fn shot(position: DVec3, pitch: f64, width: u32) -> Shot {
    let view = Viewpoint { position, yaw: 0.0, pitch, field_of_view: 0.7 };
    Shot { camera: Camera { view, size: (width.max(4), (width.max(4) * 3) / 4), near: 0.1 }, fog: None }
}

fn main() {
    let arguments = Arguments::parse();
    let plant =
        Arc::new(grow(&GrowParameters::broadleaf(), 1, arguments.triangles).expect("the broadleaf can be grown"));
    let height = f64::from(plant.height());
    let tree = shot(DVec3::new(0.0, 0.5 * height, 1.5 * height), 0.0, arguments.width);
    let start = Instant::now();
    let grove = stand(&plant, arguments.trees);
    println!(
        "{} trees of {} triangles: built in {:.2} s",
        arguments.trees,
        arguments.triangles,
        start.elapsed().as_secs_f64()
    );
    let edge = 3.5 * (arguments.trees as f64).sqrt();
    let view = shot(DVec3::new(0.0, 1.2 * height + 8.0, edge + 15.0), -0.25, arguments.width);
    let scenes = [("broadleaf", alone(&plant), tree), ("stand", grove, view)];
    rays_a_second(&scenes, arguments.rays);
    let (_, grove, view) = &scenes[1];
    convergence(grove, view, &arguments);
    // From above, without the sky.
    let down = shot(view.camera.view.position, -0.9, arguments.width);
    bounces(grove, &down, arguments.most.min(32));
}
