//! Clouds as shapes, without light: rays against the cloud and against the plant.

use std::sync::Arc;
use std::time::Instant;

use canopy::bake::levels::cloud::{Cloud, CloudSettings, Clustering, bake_cloud};
use canopy::bake::lighting::BakedLighting;
use canopy::math::quadrature::SphereQuadrature;
use canopy::plant::{Plant, grow::TRIANGLES};
use canopy::trace::{PlantTracer, Ray};
use glam::Vec3;
use rayon::prelude::*;

use super::{grown, stem, trees, triangles};

/// Pixels along a side of the images.
const SIDE: usize = 96;
/// Samples a pixel along each axis.
const SAMPLES: usize = 4;

/// Which clustering is nearer to the plant.
pub fn clusters() {
    println!(
        "| tree | planes | clustering | turn | deviation, m | leaves | cover | RMSE of colour | texels per m | bake, s |"
    );
    println!("|---|--:|---|--:|--:|--:|--:|--:|--:|--:|");
    for (name, plant) in trees() {
        for planes in [50, 100, 200] {
            for (clustering, turn) in [
                (Clustering::KMeans, 0.0),
                (Clustering::KMeans, 0.5),
                (Clustering::KPlanes, 0.0),
                (Clustering::KPlanes, 0.5),
                (Clustering::KPlanes, 1.0),
            ] {
                let settings = CloudSettings { planes, clustering, turn, ..CloudSettings::default() };
                let started = Instant::now();
                let cloud = bake_cloud(&plant, &BakedLighting::Local, &settings);
                let seconds = started.elapsed().as_secs_f64();
                let (cover, rmse) = difference(&plant, &cloud);
                println!(
                    "| {name} | {} | {clustering:?} | {turn} | {:.3} | {:.2} | {cover:.3} | {rmse:.4} | {:.0} | {seconds:.1} |",
                    cloud.planes.len(),
                    cloud.deviation,
                    cloud.leaf_scale,
                    density(&cloud),
                );
            }
        }
    }
}

/// The publication's reductions.
pub fn reductions() {
    println!();
    println!(
        "| published | ours | planes | triangles of wood | deviation / height | cover | RMSE of colour | bake, s |"
    );
    println!("|---|---|--:|--:|--:|--:|--:|--:|");
    for (figure, full, reduced, conifer) in [
        ("4.9", 61_000, 200, false),
        ("4.19", 271_455, 652, false),
        ("4.20", 88_828, 160, false),
        ("4.21, sunflower", 9_336, 248, false),
        ("4.22", 407_240, 120, false),
        ("4.23", 166_603, 388, true),
    ] {
        let (name, plant) = coppice(full, conifer);
        // Two triangles a plane, and one of wood for each plane.
        let settings = CloudSettings { planes: reduced / 3, ..CloudSettings::default() };
        let started = Instant::now();
        let cloud = bake_cloud(&plant, &BakedLighting::Local, &settings);
        let seconds = started.elapsed().as_secs_f64();
        let (cover, rmse) = difference(&plant, &cloud);
        println!(
            "| fig. {figure}: {full} to {reduced} | {name}, {} to {} | {} | {} | {:.4} | {cover:.3} | {rmse:.4} | {seconds:.1} |",
            triangles(&plant),
            cloud.triangles(),
            cloud.planes.len(),
            cloud.wood.triangles(),
            cloud.deviation / plant.height(),
        );
    }
}

/// A plant of `triangles` in as few stems as grow so many.
fn coppice(triangles: usize, conifer: bool) -> (String, Plant) {
    let stems = triangles.div_ceil(*TRIANGLES.end());
    let (name, mut plant) = grown(triangles / stems, conifer);
    for seed in 2..=stems as u64 {
        plant.parts.extend(stem(triangles / stems, conifer, seed).parts);
    }
    (if stems > 1 { format!("{name} of {stems} stems") } else { name }, plant)
}

/// Texels per metre of the first plane.
fn density(cloud: &Cloud) -> f32 {
    let atlas = cloud.textures.color.texels.width as f32;
    let plane = cloud.planes.iter().max_by(|a, b| a.u.length().total_cmp(&b.u.length()));
    plane.map_or(0.0, |plane| (plane.texture_max.x - plane.texture_min.x) * atlas / (2.0 * plane.u.length()))
}

/// Covered area as a fraction of the plant's, and the root mean square error of base colour before black, in the mean
/// over ten directions that the calibration does not know.
fn difference(plant: &Plant, cloud: &Cloud) -> (f64, f64) {
    let drawn = cloud.plant(plant);
    let tracers = [plant, &drawn].map(|plant| PlantTracer::new(&Arc::new(plant.clone())));
    let bounds = plant.bounds().expect("a plant with triangles");
    let (center, radius) = (bounds.center(), 0.55 * bounds.size().length());
    let quadrature = SphereQuadrature::new(2, 5);
    let (mut own, mut other, mut square, mut count) = (0.0, 0.0, 0.0, 0.0);
    for &(toward, _) in quadrature.sphere() {
        let (right, up) = toward.any_orthonormal_pair();
        let images = tracers.each_ref().map(|tracer| image(tracer, center, radius, toward, right, up));
        for (full, cloud) in images[0].iter().zip(&images[1]) {
            own += f64::from(cloud.1);
            other += f64::from(full.1);
            square += f64::from((cloud.0 - full.0).length_squared()) / 3.0;
            count += f64::from(full.1.max(cloud.1));
        }
    }
    (own / other, (square / count).sqrt())
}

fn image(tracer: &PlantTracer, center: Vec3, radius: f32, toward: Vec3, right: Vec3, up: Vec3) -> Vec<(Vec3, f32)> {
    let pixel = |index: usize| {
        let (mut color, mut covered) = (Vec3::ZERO, 0.0);
        for sample in 0..SAMPLES * SAMPLES {
            let part = |at: usize, sample: usize| (at as f32 + (sample as f32 + 0.5) / SAMPLES as f32) / SIDE as f32;
            let (x, y) = (part(index % SIDE, sample % SAMPLES), part(index / SIDE, sample / SAMPLES));
            let origin = center + radius * ((2.0 * x - 1.0) * right + (1.0 - 2.0 * y) * up) + 3.0 * radius * toward;
            let ray = Ray { origin, direction: -toward, t_max: f32::INFINITY };
            if let Some(hit) = tracer.closest(&ray) {
                color += tracer.point(&hit).base_color;
                covered += 1.0;
            }
        }
        let count = (SAMPLES * SAMPLES) as f32;
        (color / count, covered / count)
    };
    (0..SIDE * SIDE).into_par_iter().map(pixel).collect()
}
