//! Question: what does a transfer bake cost, and how wrong is the light that comes out of it?
//!
//! 1. `contest`: the bake's rays against the crate `obvhs` alone: the same rays, the same tree settings, the same alpha
//!    test, and nothing done with the answers.
//! 2. `cold`: cold bakes, setting by setting. `cache`: from the cache's file to arrays.
//! 3. `bands`, `rays`, `interior`: exitant radiance of vertices (both sides, white base colour, the material's transmission) under sky light
//!    over a day, against 16,384 paths a vertex with the same number of bounces; skies, azimuths and hours that the fit
//!    has not seen. "Over the day": root of the sum of squared errors of the luminance over vertices, sides and hours,
//!    over the root of the sum of squared truths. "Hours alike": each hour's RMS error over its mean, then the root mean
//!    square of these: dusk counts as much as noon. Truncation is the error of coefficients that the truth's own paths
//!    were projected to; what rays add is the RMS difference to them.
//! 4. `sun`: exitant radiance under the sun's disc, leaf shader and spherical harmonics.
//!
//! The contestants of a table take turns in one run; medians are printed, as Markdown.

#![allow(clippy::expect_used, clippy::unreachable)]

#[path = "transfer/cache.rs"]
mod cache;
#[path = "transfer/error.rs"]
mod error;
#[path = "transfer/judge.rs"]
mod judge;
#[path = "transfer/rays.rs"]
mod rays;
#[path = "transfer/sun.rs"]
mod sun;
#[path = "transfer/truth.rs"]
mod truth;
#[path = "transfer/vertices.rs"]
mod vertices;

use std::sync::Arc;
use std::time::Instant;

use canopy::bake::lighting::transfer::{Scattering, TransferSettings};
use canopy::light::{Atmosphere, AtmosphereParams, LightSettings, LightState, SunPosition};
use canopy::plant::grow::{GrowParameters, grow};
use canopy::trace::PlantTracer;
use clap::Parser;
use rayon::prelude::*;

use judge::Judge;
use truth::{Truth, truth};
use vertices::{Vertex, start_of, vertices_of};

/// What a transfer bake costs, and how wrong its light is.
#[derive(Parser)]
pub struct Arguments {
    /// Triangles of the tree (our broadleaf, seed 1).
    #[arg(long, default_value_t = 60_000)]
    triangles: usize,
    /// Vertices whose light is compared.
    #[arg(long, default_value_t = 150)]
    vertices: usize,
    /// Most rays of the table over rays, which goes from 16 to 4,096.
    #[arg(long, default_value_t = 1024)]
    most_rays: u32,
    /// Numbers of bands of the table over rays.
    #[arg(long, value_delimiter = ',', default_value = "3,4")]
    bands: Vec<usize>,
    /// Turns of each contestant of the first table.
    #[arg(long, default_value_t = 3)]
    turns: usize,
    /// Which tables: contest, cold, cache, bands, rays, scattering, sun.
    #[arg(long, value_delimiter = ',', default_value = "contest,cold,cache,bands,rays,sun")]
    only: Vec<String>,
    /// Given by cargo.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Azimuth and elevation of the sun over a summer's day at 50 degrees north, degrees.
pub const DAY: [(f64, f64); 8] =
    [(53.0, 1.3), (64.0, 9.0), (78.0, 18.0), (95.0, 33.0), (122.0, 49.0), (178.0, 63.0), (251.0, 47.0), (301.0, 4.0)];

fn main() {
    let arguments = Arguments::parse();
    let wants = |table: &str| arguments.only.iter().any(|only| only == table);
    let plant = Arc::new(grow(&GrowParameters::broadleaf(), 1, arguments.triangles).expect("a tree"));
    let all = vertices_of(&plant);
    println!("{} triangles, {} vertices, {} threads\n", arguments.triangles, all.len(), rayon::current_num_threads());
    if wants("contest") {
        rays::contest(&plant, arguments.turns);
    }
    if wants("cold") {
        rays::cold(&plant);
    }
    if wants("cache") {
        cache::cache(&plant, arguments.turns);
    }
    if !["bands", "rays", "interior", "sun"].into_iter().any(wants) {
        return;
    }
    let atmosphere = Atmosphere::new(AtmosphereParams::default()).expect("an atmosphere");
    let light = |&(azimuth, elevation): &(f64, f64)| {
        let sun = SunPosition::from_degrees(azimuth, elevation).expect("a sun");
        LightState::new(&atmosphere, sun, None, &LightSettings::default()).expect("light")
    };
    let lights: Vec<LightState> = DAY.iter().map(light).collect();
    let step = (all.len() / arguments.vertices.max(1)).max(1);
    let vertices: Vec<Vertex> = all.into_iter().step_by(step).collect();
    let Scattering::Diffuse(bounces) = TransferSettings::default().scattering else {
        unreachable!("the default bounces")
    };
    let tracer = PlantTracer::new(&plant);
    let start = Instant::now();
    let truths: Vec<Truth> = vertices
        .par_iter()
        .enumerate()
        .map(|(seed, v)| truth(&tracer, v, start_of(&plant), usize::from(bounces), &lights, seed as u64))
        .collect();
    println!("{} vertices, truth in {:.1} s\n", vertices.len(), start.elapsed().as_secs_f64());
    let judge = Judge { vertices: &vertices, truths: &truths, lights: &lights };
    if wants("bands") {
        error::bands(&plant, &judge);
    }
    if wants("rays") {
        let bands: Vec<usize> = arguments.bands.iter().map(|bands| *bands.clamp(&2, &6)).collect();
        error::rays(&plant, &judge, &bands, arguments.most_rays);
    }
    if wants("interior") {
        error::interior(&plant, &judge);
    }
    if wants("sun") {
        sun::sun(&judge);
    }
}
