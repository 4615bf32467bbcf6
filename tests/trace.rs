//! Rays against a plant: brute force, alpha holes, sides, sizes, and what is not a plant at all.

use std::ops::ControlFlow;
use std::sync::Arc;

use canopy::math::radical_inverse::{radical_inverse_2, radical_inverse_3};
use canopy::plant::grow::{GrowParameters, grow};
use canopy::plant::{PartKind, Plant, PlantMaterial, PlantMesh, PlantPart};
use canopy::trace::{LineCrossing, PlantTracer, Ray, offset_origin};
use glam::{DVec3, Vec2, Vec3};
use image::{Rgba, RgbaImage};

fn part(kind: PartKind, positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> PlantPart {
    let count = positions.len();
    let uvs = positions.iter().map(|p| Vec2::new(p.x, p.z)).collect();
    PlantPart {
        kind,
        mesh: PlantMesh { positions, normals: vec![Vec3::Y; count], uvs, triangles },
        material: PlantMaterial::default(),
    }
}

fn plant(parts: Vec<PlantPart>) -> Arc<Plant> {
    Arc::new(Plant { name: "test".into(), parts })
}

/// A level square from the origin to (1, 0, 1), its front side up.
fn leaf() -> PlantPart {
    part(PartKind::Foliage, vec![Vec3::ZERO, Vec3::Z, Vec3::new(1.0, 0.0, 1.0), Vec3::X], vec![[0, 1, 2], [0, 2, 3]])
}

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, direction, t_max: f32::INFINITY }
}

/// Direction and a second pair of numbers, all evenly spread.
fn spread(i: u64) -> (Vec3, Vec2) {
    let y = 1.0 - 2.0 * radical_inverse_2(i + 1);
    let (sin, cos) = (std::f64::consts::TAU * radical_inverse_3(i + 1)).sin_cos();
    let s = (1.0 - y * y).max(0.0).sqrt();
    let direction = DVec3::new(s * cos, y, s * sin).as_vec3().normalize();
    let mixed = i.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 20;
    (direction, Vec2::new(radical_inverse_2(mixed) as f32, radical_inverse_3(mixed) as f32))
}

/// The nearest triangle by the textbook's test in f64, and how near the ray comes to any edge or outline.
fn brute_force(plant: &Plant, ray: &Ray) -> Option<(f64, usize, usize)> {
    let mut nearest: Option<(f64, usize, usize)> = None;
    for (p, part) in plant.parts.iter().enumerate() {
        for (t, triangle) in part.mesh.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|i| part.mesh.positions[i as usize].as_dvec3());
            let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
            let cross = direction.cross(c - a);
            let determinant = (b - a).dot(cross);
            let u = (origin - a).dot(cross) / determinant;
            let other = (origin - a).cross(b - a);
            let v = direction.dot(other) / determinant;
            let distance = (c - a).dot(other) / determinant;
            if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0 && nearest.is_none_or(|n| distance < n.0) {
                nearest = Some((distance, p, t));
            }
        }
    }
    nearest
}

#[test]
fn meets_what_brute_force_meets() {
    let mut tree = grow(&GrowParameters::broadleaf(), 7, 5_000).unwrap();
    for part in &mut tree.parts {
        part.material.base_color_texture = None;
    }
    let tree = Arc::new(tree);
    let tracer = PlantTracer::new(&tree);
    let bounds = tracer.bounds().unwrap();
    let (mut met, mut differ) = (0, 0);
    for i in 0..600 {
        let (direction, _) = spread(i);
        let (other, _) = spread(i + 10_000);
        let distance = [0.0, 1.0, 40.0][i as usize % 3];
        let origin = bounds.center() + bounds.size() * 0.45 * other - direction * distance;
        let ray = ray(origin, direction);
        let (want, got) = (brute_force(&tree, &ray), tracer.closest(&ray));
        assert_eq!(got.is_some(), tracer.occluded(&ray));
        match (want, got) {
            (None, None) => {}
            (Some((distance, p, t)), Some(hit)) => {
                met += 1;
                assert!((distance - f64::from(hit.t)).abs() < 1e-3, "{distance} {}", hit.t);
                differ += usize::from((p, t) != (hit.part as usize, hit.triangle as usize));
                let reached = ray.origin + ray.direction * hit.t;
                assert!((tracer.point(&hit).position - reached).length() < 1e-4);
            }
            _ => differ += 1,
        }
    }
    assert!(met > 200, "{met} rays met the tree");
    assert!(differ <= 1, "{differ} rays met something else");
}

#[test]
fn alpha_lets_through_what_the_texture_does_not_hold() {
    let mut leaf = leaf();
    let image = RgbaImage::from_fn(2, 1, |x, _| Rgba([200, 100, 50, if x == 0 { 255 } else { 0 }]));
    leaf.material.base_color_texture = Some(Arc::new(image));
    leaf.material.transmission = Vec3::new(0.5, 0.25, 0.0);
    let below =
        part(PartKind::Wood, leaf.mesh.positions.iter().map(|p| *p - Vec3::Y).collect(), vec![[0, 1, 2], [0, 2, 3]]);
    let tracer = PlantTracer::new(&plant(vec![leaf, below]));
    let down = |x: f32| ray(Vec3::new(x, 1.0, 0.4), Vec3::NEG_Y);
    let (leaf, wood) = (tracer.closest(&down(0.25)).unwrap(), tracer.closest(&down(0.75)).unwrap());
    assert_eq!((leaf.part, wood.part), (0, 1));
    assert!((leaf.t - 1.0).abs() < 1e-6 && (wood.t - 2.0).abs() < 1e-6);
    assert!(!tracer.occluded(&Ray { t_max: 1.5, ..down(0.75) }));
    assert!(tracer.occluded(&Ray { t_max: 1.5, ..down(0.25) }));
    let (a, b) = (tracer.point(&leaf), tracer.point(&wood));
    assert_eq!((a.kind, b.kind), (PartKind::Foliage, PartKind::Wood));
    assert!((a.transmission - a.base_color * Vec3::new(0.5, 0.25, 0.0)).length() < 1e-6);
    assert_eq!(b.transmission, Vec3::ZERO);
    assert!(a.base_color.x > a.base_color.y && a.base_color.y > a.base_color.z);
}

#[test]
fn both_sides_are_met_and_told_apart() {
    let tracer = PlantTracer::new(&plant(vec![leaf()]));
    for (from, front) in [(1.0, true), (-1.0, false)] {
        let hit = tracer.closest(&ray(Vec3::new(0.3, from, 0.6), Vec3::new(0.0, -from, 0.0))).unwrap();
        assert_eq!(hit.front, front);
        let point = tracer.point(&hit);
        assert!((point.position - Vec3::new(0.3, 0.0, 0.6)).length() < 1e-6);
        assert!((point.geometric_normal - Vec3::Y).length() < 1e-6 && (point.shading_normal - Vec3::Y).length() < 1e-6);
        assert!((point.uv - Vec2::new(0.3, 0.6)).length() < 1e-6);
    }
}

#[test]
fn nothing_slips_between_triangles_and_nothing_meets_itself() {
    // A closed fan around the vertical axis, at many sizes and places; rays through its shared edges and vertices.
    for size in [5e-4f32, 1.0, 30.0, 1e4] {
        for center in [Vec3::ZERO, Vec3::new(40.0, -3.0, 1e3) * size] {
            let ring = 64u32;
            let mut positions = vec![center];
            positions.extend((0..ring).map(|k| {
                let (sin, cos) = (std::f32::consts::TAU * k as f32 / ring as f32).sin_cos();
                center + size * Vec3::new(cos, 0.02 * (k % 5) as f32, sin)
            }));
            let triangles = (0..ring).map(|k| [0, 1 + (k + 1) % ring, 1 + k]).collect();
            let tracer = PlantTracer::new(&plant(vec![part(PartKind::Wood, positions.clone(), triangles)]));
            for (k, corner) in positions.iter().enumerate().skip(1) {
                for share in [0.0, 0.3, 0.7, 0.9] {
                    let target = center.lerp(*corner, share);
                    let (direction, _) = spread(k as u64);
                    let direction = Vec3::new(0.3 * direction.x, -1.0, 0.3 * direction.z).normalize();
                    let hit = tracer.closest(&ray(target - direction * size, direction));
                    let hit = hit.unwrap_or_else(|| panic!("slipped through at {k}, {share}, size {size}"));
                    let point = tracer.point(&hit);
                    for away in [point.geometric_normal, -point.geometric_normal] {
                        let back = tracer.closest(&ray(point.leave(away), away));
                        assert!(back.is_none_or(|b| b.t > 1e-3 * size), "{back:?} at size {size}, {center}");
                        if size >= 1.0 {
                            let moved = offset_origin(point.position, point.geometric_normal, away);
                            let back = tracer.closest(&ray(moved, away));
                            assert!(back.is_none_or(|b| b.triangle != hit.triangle), "{back:?} at size {size}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn axis_parallel_rays_meet_axis_parallel_leaves() {
    let tracer = PlantTracer::new(&plant(vec![leaf()]));
    for x in 0..=16 {
        for z in 0..=16 {
            let target = Vec3::new(x as f32, 0.0, z as f32) / 16.0;
            assert!(tracer.occluded(&ray(target + Vec3::Y, Vec3::NEG_Y)), "{target}");
            assert!(tracer.occluded(&ray(target - Vec3::Y * 1e6, Vec3::Y)), "{target}");
        }
    }
}

#[test]
fn what_is_no_plant_or_no_ray_meets_nothing() {
    let nothing = [
        plant(vec![]),
        plant(vec![part(PartKind::Foliage, vec![], vec![])]),
        plant(vec![part(PartKind::Wood, vec![Vec3::ONE; 3], vec![[0, 1, 2]])]),
        plant(vec![part(PartKind::Wood, vec![Vec3::NAN, Vec3::X, Vec3::Y], vec![[0, 1, 2], [1, 2, 7]])]),
    ];
    for plant in nothing {
        let tracer = PlantTracer::new(&plant);
        assert!(tracer.bounds().is_none());
        assert!(tracer.closest(&ray(Vec3::Y, Vec3::NEG_Y)).is_none() && !tracer.occluded(&ray(Vec3::Y, Vec3::NEG_Y)));
    }
    let tracer = PlantTracer::new(&plant(vec![leaf()]));
    let strange = [
        ray(Vec3::NAN, Vec3::Y),
        ray(Vec3::ONE, Vec3::ZERO),
        ray(Vec3::ONE, Vec3::NAN),
        ray(Vec3::splat(f32::MAX), Vec3::NEG_ONE.normalize()),
        Ray { t_max: f32::NAN, ..ray(Vec3::new(0.5, 1.0, 0.5), Vec3::NEG_Y) },
        Ray { t_max: 0.0, ..ray(Vec3::new(0.5, 1.0, 0.5), Vec3::NEG_Y) },
    ];
    for ray in strange {
        assert!(tracer.closest(&ray).is_none_or(|hit| hit.t.is_finite()));
    }
    assert!(strange[..3].iter().all(|ray| tracer.closest(ray).is_none()));
    assert!(strange[4..].iter().all(|ray| !tracer.occluded(ray)));
}

#[test]
fn duplicates_by_the_thousand_and_extreme_coordinates_do_no_harm() {
    let one = leaf();
    let crowd = part(PartKind::Foliage, one.mesh.positions.clone(), one.mesh.triangles.repeat(8_000));
    let tracer = PlantTracer::new(&plant(vec![crowd]));
    assert!(tracer.occluded(&ray(Vec3::new(0.4, 1.0, 0.5), Vec3::NEG_Y)));
    for size in [1e-30f32, 1e-12, 1e12, 1e37] {
        let huge = one.mesh.positions.iter().map(|p| *p * size).collect();
        let tracer = PlantTracer::new(&plant(vec![part(PartKind::Foliage, huge, one.mesh.triangles.clone())]));
        let hit = tracer.closest(&ray(Vec3::new(0.4, 1.0, 0.5) * size, Vec3::NEG_Y)).unwrap();
        assert!((hit.t / size - 1.0).abs() < 1e-5);
    }
    let far = Vec3::new(1e6, 0.0, -1e6);
    let moved = one.mesh.positions.iter().map(|p| *p * 4.0 + far).collect();
    let tracer = PlantTracer::new(&plant(vec![part(PartKind::Foliage, moved, one.mesh.triangles.clone())]));
    assert!(tracer.occluded(&ray(far + Vec3::new(1.6, 1.0, 2.0), Vec3::NEG_Y)));
    assert!(!tracer.occluded(&ray(far + Vec3::new(-1.6, 1.0, 2.0), Vec3::NEG_Y)));
}

#[test]
fn lines_meet_what_rays_meet() {
    let tree = Arc::new(grow(&GrowParameters::broadleaf(), 7, 5_000).unwrap());
    let tracer = PlantTracer::new(&tree);
    let points: Vec<Vec3> = tree.parts.iter().flat_map(|part| part.mesh.positions.iter().copied()).collect();
    let start = tracer.bounds().unwrap().size().max_element() / 65_536.0;
    let lines = tracer.parallel(points.iter().copied());
    let (mut met, mut differ, mut elsewhere, mut asked) = (0, 0, 0, 0);
    for i in 0..12 {
        let (direction, _) = spread(i);
        let mut nearest: Vec<[Option<LineCrossing>; 2]> = vec![[None; 2]; points.len()];
        lines.crossings(direction, |crossing| {
            let nearest = &mut nearest[crossing.point as usize][usize::from(crossing.t < 0.0)];
            let nearer = nearest.is_none_or(|other| crossing.t.abs() < other.t.abs());
            if crossing.t.abs() > start && nearer && lines.covers(&crossing) {
                *nearest = Some(crossing);
            }
            ControlFlow::Continue(())
        });
        for (point, nearest) in points.iter().zip(&nearest) {
            for (against, (toward, crossing)) in [direction, -direction].into_iter().zip(nearest).enumerate() {
                let hit = tracer.closest(&ray(*point + toward * start, toward));
                let line = crossing.map(|crossing| lines.hit(&crossing, against == 1));
                asked += 1;
                met += usize::from(hit.is_some());
                let (found, other) = (hit.map(|hit| hit.t + start), line.map(|hit| hit.t));
                let same = match (found, other) {
                    (Some(t), Some(other)) => (t - other).abs() < 10.0 * start,
                    (None, None) => true,
                    _ => false,
                };
                // Where two triangles meet, either may be named.
                elsewhere += usize::from(same && hit.map(|h| (h.part, h.front)) != line.map(|h| (h.part, h.front)));
                differ += usize::from(!same);
            }
        }
    }
    // Rays through edges and outlines of leaves may differ.
    assert!(met > asked / 4, "{met} met");
    assert!(differ * 500 < asked && elsewhere * 100 < asked, "{differ} and {elsewhere} of {asked} differ");
}

#[test]
fn lines_know_distance_side_and_place_at_any_size() {
    for (size, moved) in [(1e-3f32, 0.0f32), (1.0, 0.0), (1e4, 0.0), (64.0, 1e6)] {
        let mut part = leaf();
        part.mesh.positions.iter_mut().for_each(|p| *p = *p * size + Vec3::splat(moved));
        let tracer = PlantTracer::new(&plant(vec![part]));
        let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z) * size + Vec3::splat(moved);
        let points = [at(0.25, 0.5, 0.5), at(0.5, -0.25, 0.25), at(2.0, 1.0, 0.5), Vec3::NAN];
        let lines = tracer.parallel(points.into_iter());
        for direction in [Vec3::Y, Vec3::NEG_Y] {
            let mut found = Vec::new();
            lines.crossings(direction, |crossing| {
                let hit = lines.hit(&crossing, crossing.t < 0.0);
                found.push((crossing.point, crossing.t * direction.y / size, hit.front));
                ControlFlow::Continue(())
            });
            found.sort_by_key(|(point, ..)| *point);
            assert_eq!(found.iter().map(|(point, ..)| *point).collect::<Vec<_>>(), [0, 1], "{size}, {direction}");
            for ((_, t, front), (want, above)) in found.iter().zip([(-0.5, true), (0.25, false)]) {
                assert!((t - want).abs() < 1e-2 && *front == above, "{size}: {t} instead of {want}, {front}");
            }
        }
        let mut visits = 0;
        for direction in [Vec3::ZERO, Vec3::NAN] {
            lines.crossings(direction, |_| {
                visits += 1;
                ControlFlow::Continue(())
            });
        }
        assert_eq!(visits, 0);
    }
    let nothing = PlantTracer::new(&Arc::new(Plant::default()));
    nothing.parallel([Vec3::ZERO].into_iter()).crossings(Vec3::Y, |_| panic!("nothing is there"));
    let tracer = PlantTracer::new(&plant(vec![leaf()]));
    tracer.parallel(std::iter::empty()).crossings(Vec3::Y, |_| panic!("no line is there"));
}

#[test]
fn a_line_that_needs_no_more_gets_no_more() {
    let stack = plant((0..5).map(|_| leaf()).collect());
    let tracer = PlantTracer::new(&stack);
    let lines = tracer.parallel([Vec3::new(0.5, -1.0, 0.25)].into_iter());
    let count = |flow: ControlFlow<()>| {
        let mut count = 0;
        lines.crossings(Vec3::Y, |_| {
            count += 1;
            flow
        });
        count
    };
    assert_eq!((count(ControlFlow::Continue(())), count(ControlFlow::Break(()))), (5, 1));
}

#[test]
fn rays_that_leave_long_thin_triangles_do_not_meet_them() {
    // The sides of a pole of 8 m: each triangle is 4 cm wide.
    let sides = 48;
    let corner = |i: u32, y: f32| {
        let angle = std::f32::consts::TAU * i as f32 / sides as f32;
        Vec3::new(0.3 * angle.cos(), y, 0.3 * angle.sin())
    };
    let positions = (0..2 * sides).map(|i| corner(i % sides, if i < sides { 0.0 } else { 8.0 })).collect();
    let triangles = (0..sides).flat_map(|i| {
        let j = (i + 1) % sides;
        [[i, i + sides, j], [j, i + sides, j + sides]]
    });
    let tracer = PlantTracer::new(&plant(vec![part(PartKind::Wood, positions, triangles.collect())]));
    let mut left = 0;
    for i in 0..20_000 {
        let (direction, place) = spread(i);
        let angle = std::f32::consts::TAU * place.x;
        let from = Vec3::new(2.0 * angle.cos(), 1.0 + 6.0 * place.y, 2.0 * angle.sin());
        let Some(hit) = tracer.closest(&ray(from, -from.with_y(0.0).normalize())) else { continue };
        let point = tracer.point(&hit);
        // Away from the pole, which is convex.
        let outwards =
            if point.geometric_normal.dot(from) < 0.0 { -point.geometric_normal } else { point.geometric_normal };
        if outwards.dot(direction) > 1e-3 {
            let found = tracer.closest(&ray(point.leave(direction), direction));
            assert!(found.is_none(), "{i}: {found:?}");
            left += 1;
        }
    }
    assert!(left > 9000, "{left}");
}
