//! How near are the layers of a leaf to a walk of photons through its tissue, and what do they cost?
//!
//! Two tables:
//! - The light that a leaf sends back and lets through over the angle of incidence, relative to perpendicular light: photons
//!   that walk through three slabs of the same indices of refraction and the same absorption, scattered isotropically, refracted
//!   and reflected at every interface; the layered model; the standard model, which has 1 everywhere. What the outer
//!   surface mirrors is left out, as it is the gloss of all models.
//! - The time of the path tracer with layers over that without, same scene and samples, in turns.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use canopy::plant::LeafTissue;
use canopy::plant::grow::{GrowParameters, grow};
use canopy::plant::tissue_light::TissueLight;
use canopy::reference::{
    Camera, Disc, Film, Instance, LeafModel, Light, Normals, PathTracer, ReferenceScene, Shot, TraceSettings,
};
use canopy::scene::Viewpoint;
use clap::Parser;
use glam::{DVec3, Vec3};

/// Layers of leaves: error against a walk of photons, and cost.
#[derive(Parser, Debug)]
struct Arguments {
    /// Photons for each angle.
    #[arg(long, default_value_t = 200_000)]
    photons: u32,
    /// Optical depth of absorption through the leaf.
    #[arg(long, default_value_t = 0.5)]
    absorption: f32,
    /// Optical depths of scattering through the leaf.
    #[arg(long, value_delimiter = ',', default_value = "1,2,4,10")]
    scattering: Vec<f32>,
    /// Rounds of the timing.
    #[arg(long, default_value_t = 5)]
    rounds: u32,
    /// Given by `cargo bench`.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    walks(&arguments);
    times(arguments.rounds)
}

const ANGLES: [f32; 9] = [0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0];

fn walks(arguments: &Arguments) {
    println!("light over that at 0 degrees, absorption {}:", arguments.absorption);
    println!("  scattering  angle  sent back: walk layers  off   let through: walk layers  off");
    for &scattering in &arguments.scattering {
        let tissue = LeafTissue { scattering, ..LeafTissue::default() }.sanitized();
        let light = TissueLight::of(&tissue, arguments.absorption);
        let walk = |degrees: f32| {
            let slabs = Slabs { tissue, absorption: arguments.absorption, scattering };
            slabs.walk(degrees.to_radians().cos(), arguments.photons)
        };
        let layers = |degrees: f32| over_views(&light, degrees.to_radians().cos());
        let (walk_0, layers_0) = (walk(0.0), layers(0.0));
        for degrees in ANGLES {
            let (walk, layers) = (walk(degrees), layers(degrees));
            let ratio = |side: usize| (walk[side] / walk_0[side], layers[side] / layers_0[side]);
            let ((back, ours_back), (through, ours_through)) = (ratio(0), ratio(1));
            println!(
                "  {scattering:10}  {degrees:5}  {back:15.3} {ours_back:6.3} {:+5.0} %  {through:17.3} {ours_through:6.3} {:+5.0} %",
                100.0 * (ours_back / back - 1.0),
                100.0 * (ours_through / through - 1.0),
            );
        }
        println!("  at 0 degrees the walk sends back {:.3} and lets through {:.3}", walk_0[0], walk_0[1]);
    }
}

/// The factors of the layers on light that comes to the front, in the mean over all views.
fn over_views(light: &TissueLight, to_light: f32) -> [f32; 2] {
    const VIEWS: u32 = 64;
    let mut sum = [0.0; 2];
    for step in 0..VIEWS {
        let view = (step as f32 + 0.5) / VIEWS as f32;
        let factors = [light.factors(true, view, to_light)[0], light.factors(false, view, to_light)[1]];
        (0..2).for_each(|side| sum[side] += factors[side] * 2.0 * view / VIEWS as f32);
    }
    sum
}

/// Three slabs of tissue in air.
struct Slabs {
    tissue: LeafTissue,
    absorption: f32,
    scattering: f32,
}

/// A small generator (SplitMix64).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// Fresnel's reflectance of unpolarised light, and the cosine beyond the interface; total reflection has 1.
fn fresnel(cosine: f32, from: f32, to: f32) -> (f32, f32) {
    let sine = (from / to).powi(2) * (1.0 - cosine * cosine);
    if sine >= 1.0 {
        return (1.0, 0.0);
    }
    let beyond = (1.0 - sine).sqrt();
    let across = (from * cosine - to * beyond) / (from * cosine + to * beyond);
    let along = (to * cosine - from * beyond) / (to * cosine + from * beyond);
    (0.5 * (across * across + along * along), beyond)
}

impl Slabs {
    /// Fractions of the light that comes at the cosine `outside` and has entered the leaf, which leave it before and behind.
    fn walk(&self, outside: f32, photons: u32) -> [f32; 2] {
        let [a, b, _] = self.tissue.layers;
        let planes = [0.0, a, a + b, 1.0];
        let index = |layer: i32| if (0..3).contains(&layer) { self.tissue.refraction[layer as usize] } else { 1.0 };
        let extinction = self.absorption + self.scattering;
        let albedo = self.scattering / extinction;
        let mut random = Random(u64::from((1e6 * outside) as u32) + 1);
        let mut left = [0.0f64; 2];
        for _ in 0..photons {
            let (_, inside) = fresnel(outside, 1.0, index(0));
            // The cosine is positive downwards.
            let (mut depth, mut cosine, mut layer, mut weight) = (0.0f32, inside, 0i32, 1.0f32);
            loop {
                let flight = -(1.0 - random.unit()).ln() / extinction;
                let end = depth + cosine * flight;
                let (low, high) = (planes[layer as usize], planes[layer as usize + 1]);
                if end > low && end < high {
                    depth = end;
                    weight *= albedo;
                    if weight < 1e-3 {
                        if random.unit() > 0.1 {
                            break;
                        }
                        weight *= 10.0;
                    }
                    cosine = 2.0 * random.unit() - 1.0;
                    continue;
                }
                // To the interface; the flight begins again there, as it has no memory.
                let down = cosine > 0.0;
                depth = if down { high } else { low };
                let next = if down { layer + 1 } else { layer - 1 };
                let (reflected, beyond) = fresnel(cosine.abs(), index(layer), index(next));
                if random.unit() < reflected {
                    cosine = -cosine;
                } else if (0..3).contains(&next) {
                    cosine = if down { beyond } else { -beyond };
                    layer = next;
                } else {
                    left[usize::from(down)] += f64::from(weight);
                    break;
                }
            }
        }
        left.map(|sum| (sum / f64::from(photons)) as f32)
    }
}

fn film(
    scene: &ReferenceScene,
    light: &Light,
    view: Viewpoint,
    size: (u32, u32),
    samples: u32,
    bounces: u32,
) -> anyhow::Result<Film> {
    let settings = TraceSettings { bounces, normals: Normals::Flat, ..TraceSettings::default() };
    let tracer = PathTracer::new(scene, light, settings)?;
    let shot = Shot { camera: Camera { view, size, near: 0.0 }, fog: None };
    let mut film = Film::new(&shot)?;
    tracer.render(&shot, &mut film, samples, &mut |_| ControlFlow::Continue(()))?;
    Ok(film)
}

fn times(rounds: u32) -> anyhow::Result<()> {
    let mut plant = grow(&GrowParameters::broadleaf(), 1, 20_000)?;
    plant.set_leaf_tissue(LeafTissue::default());
    let plant = Arc::new(plant);
    let instance = Instance { plant: 0, position: DVec3::ZERO, yaw: 0.0, scale: 1.0, tint: 0.0 };
    let scene = || ReferenceScene::new(std::slice::from_ref(&plant), &[instance], None);
    let models = [scene()?.with_leaves(LeafModel::Standard), scene()?.with_leaves(LeafModel::Layers)];
    let sun = Light {
        key: Some(Disc {
            direction: Vec3::new(0.5, 0.7, 0.4).normalize(),
            illuminance: Vec3::splat(1e5),
            angular_radius: 0.005,
        }),
        ..Light::even(Vec3::splat(3000.0))
    };
    let view = Viewpoint { position: DVec3::new(0.0, 14.0, 14.0), yaw: 0.0, pitch: 0.0, field_of_view: 0.6 };
    let mut total = [Duration::ZERO; 2];
    for _ in 0..rounds.max(1) {
        for (model, total) in models.iter().zip(&mut total) {
            let started = Instant::now();
            std::hint::black_box(film(model, &sun, view, (320, 240), 8, u32::MAX)?);
            *total += started.elapsed();
        }
    }
    let [standard, layers] = total.map(|total| total.as_secs_f64() / f64::from(rounds.max(1)));
    println!(
        "\na broadleaf's crown, 320 x 240, 8 samples: standard {standard:.3} s, layers {layers:.3} s, {:.3} times",
        layers / standard
    );
    Ok(())
}
