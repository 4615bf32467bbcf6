//! The bake's rays against the crate `obvhs` alone, and cold bakes.

use std::hint::black_box;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use canopy::bake::lighting::transfer::{Channels, Scattering, TransferSettings, bake_transfer, direction_set};
use canopy::plant::{PartKind, Plant};
use canopy::trace::{PlantTracer, Ray};
use glam::{Vec2, Vec3};
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::Ray as TreeRay;
use obvhs::triangle::Triangle;
use rayon::prelude::*;

use crate::vertices::{Vertex, start_of, vertices_of};

/// Rays a vertex of the contest: none of the contestants becomes faster or slower by more.
const RAYS: u32 = 64;

/// The directions of a bake's rays: each of the upper half of the set, and its opposite (without the negative zeros
/// that `obvhs` does not bear).
fn bake_directions(rays: u32) -> Vec<Vec3> {
    direction_set(rays).into_iter().take(rays as usize / 2).flat_map(|line| [line, Vec3::ZERO - line]).collect()
}

/// Asks `meets` for every ray of a bake (origin, direction), in parallel; gives how many rays there are and how many
/// meet something.
fn one_by_one(plant: &Plant, rays: u32, meets: impl Fn(Vec3, Vec3) -> bool + Sync) -> (usize, usize) {
    let start = start_of(plant);
    let mut set: Vec<(usize, Vec3)> = bake_directions(rays).into_iter().enumerate().collect();
    // Rays of one octant visit the tree's nodes in one order, and those of vertices beside each other meet the same.
    set.sort_by_key(|(i, d)| (u8::from(d.x < 0.0) | u8::from(d.y < 0.0) << 1 | u8::from(d.z < 0.0) << 2, *i));
    let batch = |batch: &[Vertex]| {
        let (mut count, mut met) = (0, 0);
        for (_, direction) in &set {
            for v in batch {
                let cosine = v.normal.dot(*direction);
                if cosine > 0.0 || (cosine < 0.0 && v.two_sided) {
                    count += 1;
                    met += usize::from(meets(v.position + *direction * start, *direction));
                }
            }
        }
        (count, met)
    };
    vertices_of(plant).par_chunks(64).map(batch).reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
}

/// The same rays, all of one direction and its opposite at once.
fn in_parallel(plant: &Plant, tracer: &PlantTracer, rays: u32) -> (usize, usize) {
    let vertices = vertices_of(plant);
    let start = start_of(plant);
    let lines = tracer.parallel(vertices.iter().map(|v| v.position));
    let of_line = |line: &Vec3| {
        let mut met: Vec<[bool; 2]> = vertices
            .iter()
            .map(|v| [line.dot(v.normal) < 0.0, line.dot(v.normal) > 0.0].map(|b| b && !v.two_sided))
            .collect();
        lines.crossings(*line, |crossing| {
            let met = &mut met[crossing.point as usize];
            let ray = usize::from(crossing.t < 0.0);
            met[ray] = met[ray] || (crossing.t.abs() > start && lines.covers(&crossing));
            if *met == [true; 2] { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let (mut count, mut total) = (0, 0);
        for (v, met) in vertices.iter().zip(met) {
            for (direction, met) in [*line, -*line].into_iter().zip(met) {
                let cosine = v.normal.dot(direction);
                let counts = cosine > 0.0 || (cosine < 0.0 && v.two_sided);
                count += usize::from(counts);
                total += usize::from(counts && met);
            }
        }
        (count, total)
    };
    let lines: Vec<Vec3> = bake_directions(rays).into_iter().step_by(2).collect();
    lines.par_iter().map(of_line).reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
}

/// The table of the contest.
pub fn contest(plant: &Arc<Plant>, turns: usize) {
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

    let alone = |o: Vec3, d: Vec3| {
        !wide.ray_traverse_miss(tree_ray(o, d), |ray, i| cover(&wide_triangles[i], &wide_uvs[i], ray))
    };
    let binary = |o: Vec3, d: Vec3| {
        !narrow.ray_traverse_miss(tree_ray(o, d), |ray, i| cover(&narrow_triangles[i], &narrow_uvs[i], ray))
    };
    let ours = |origin: Vec3, direction: Vec3| tracer.occluded(&Ray { origin, direction, t_max: f32::INFINITY });
    let names = [
        "obvhs alone, `CwBvh`",
        "obvhs alone, `Bvh2`",
        "`PlantTracer`, ray by ray",
        "`ParallelTracer`, as the bake has it",
    ];
    let mut times = [const { Vec::new() }; 4];
    let mut found = [(0, 0); 4];
    for _ in 0..turns.max(1) {
        for (contestant, times) in times.iter_mut().enumerate() {
            let start = Instant::now();
            match contestant {
                0 => found[0] = one_by_one(plant, RAYS, alone),
                1 => found[1] = one_by_one(plant, RAYS, binary),
                2 => found[2] = one_by_one(plant, RAYS, ours),
                _ => found[3] = in_parallel(plant, &tracer, RAYS),
            }
            times.push(start.elapsed().as_secs_f64());
        }
    }
    let median = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    let times = times.each_mut().map(median);
    let [(count, alone), (_, binary), (_, ours), (_, parallel)] = found;
    println!(
        "## Rays\n\n{count} rays; {parallel} meet the tree in parallel, {ours} ray by ray, {alone} and {binary} by obvhs\n"
    );
    println!("| | s | million rays a second | times obvhs alone |\n|---|---|---|---|");
    for (name, time) in names.iter().zip(times) {
        println!("| {name} | {time:.2} | {:.2} | {:.2} |", count as f64 / time / 1e6, time / times[0]);
    }
    println!();
}

/// The table of cold bakes.
pub fn cold(plant: &Arc<Plant>) {
    println!("## Cold bakes\n\n| | s |\n|---|--:|");
    let default = TransferSettings::default();
    let settings = [
        ("default", default),
        ("256 rays", TransferSettings { rays: 256, ..default }),
        ("3 bands, 256 rays", TransferSettings { bands: 3, rays: 256, ..default }),
        ("6 bands", TransferSettings { bands: 6, ..default }),
        ("3 bands in colour", TransferSettings { channels: Channels::Rgb, ..default }),
        ("straight through up to 3 leaves", TransferSettings { scattering: Scattering::TransmitOnly(3), ..default }),
    ];
    for (name, settings) in settings {
        let start = Instant::now();
        black_box(bake_transfer(plant, &settings));
        println!("| {name} | {:.2} |", start.elapsed().as_secs_f64());
    }
    println!();
}
