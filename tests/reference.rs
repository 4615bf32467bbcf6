//! The ground truth against what is known without it: furnaces, planes, spheres, slabs, and itself.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use canopy::light::moon::MoonSetting;
use canopy::light::{Atmosphere, AtmosphereParams, LightSettings, LightState, Observer, SkyView, SunPosition};
use canopy::plant::grow::{GrowParameters, grow};
use canopy::plant::{Gloss, PartKind, Plant, PlantMaterial, PlantMesh, PlantPart};
use canopy::reference::{
    Camera, Disc, DisplayTransform, Environment, Film, Fog, Ground, GroundColor, GroundShape, Instance, Light, Normals,
    PathTracer, ReferenceError, ReferenceScene, Shot, SurfaceSample, TraceSettings, WorldRay,
};
use canopy::scene::Viewpoint;
use canopy::terrain::{HeightField, Surroundings, Terrain};
use glam::{DVec2, DVec3, Vec2, Vec3};

pub(crate) fn part(
    kind: PartKind,
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    albedo: f32,
    transmission: f32,
) -> PlantPart {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for corners in triangles.iter().filter(|corners| corners.iter().all(|&c| (c as usize) < positions.len())) {
        let [a, b, c] = corners.map(|corner| positions[corner as usize]);
        for &corner in corners {
            normals[corner as usize] += (b - a).cross(c - a);
        }
    }
    let normals = normals.into_iter().map(|normal| normal.normalize_or(Vec3::Y)).collect();
    let uvs = vec![Vec2::ZERO; positions.len()];
    let material = PlantMaterial {
        base_color: Vec3::splat(albedo),
        transmission: Vec3::splat(transmission),
        ..PlantMaterial::default()
    };
    PlantPart { kind, mesh: PlantMesh { positions, normals, uvs, triangles }, material }
}

pub(crate) fn plant(parts: Vec<PlantPart>) -> Arc<Plant> {
    Arc::new(Plant { name: "test".to_owned(), parts })
}

/// A sphere of radius 1 around (0, 1, 0) as a subdivided octahedron.
fn sphere(kind: PartKind, albedo: f32) -> Arc<Plant> {
    let mut positions = vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
    let mut triangles: Vec<[u32; 3]> =
        vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
    let mut middles = std::collections::HashMap::new();
    for _ in 0..4 {
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    positions.push((positions[a as usize] + positions[b as usize]).normalize());
                    positions.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    plant(vec![part(kind, positions.iter().map(|p| *p + Vec3::Y).collect(), triangles, albedo, 0.0)])
}

/// Level squares of `side` metres at these heights, fronts up.
pub(crate) fn leaves(heights: &[f32], side: f32, albedo: f32, transmission: f32) -> Arc<Plant> {
    let corners = [(-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5)];
    let positions =
        heights.iter().flat_map(|&y| corners.map(|(x, z)| Vec3::new(x * side, y, z * side))).collect::<Vec<_>>();
    let triangles =
        (0..heights.len() as u32).flat_map(|i| [[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]]);
    plant(vec![part(PartKind::Foliage, positions, triangles.collect(), albedo, transmission)])
}

pub(crate) fn alone() -> Instance {
    Instance { plant: 0, position: DVec3::ZERO, yaw: 0.0, scale: 1.0, tint: 0.0 }
}

pub(crate) fn scene(plant: &Arc<Plant>) -> ReferenceScene {
    ReferenceScene::new(std::slice::from_ref(plant), &[alone()], None).unwrap()
}

pub(crate) fn plane(albedo: f32) -> Ground {
    Ground { shape: GroundShape::Plane(0.0), color: GroundColor::Even(Vec3::splat(albedo)), max_distance: 1e6 }
}

pub(crate) fn shot(position: DVec3, yaw: f64, pitch: f64, size: (u32, u32)) -> Shot {
    let view = Viewpoint { position, yaw, pitch, field_of_view: 0.6 };
    Shot { camera: Camera { view, size, near: 0.0 }, fog: None }
}

/// A single pixel's view of next to nothing.
pub(crate) fn narrow(position: DVec3, pitch: f64) -> Shot {
    let shot = shot(position, 0.0, pitch, (1, 1));
    let view = Viewpoint { field_of_view: 1e-4, ..shot.camera.view };
    Shot { camera: Camera { view, ..shot.camera }, fog: None }
}

pub(crate) fn film(tracer: &PathTracer, shot: &Shot, samples: u32) -> Film {
    let mut film = Film::new(shot).unwrap();
    tracer.render(shot, &mut film, samples, &mut |_| ControlFlow::Continue(())).unwrap();
    film
}

pub(crate) fn mean(film: &Film) -> Vec3 {
    let pixels = film.radiance();
    pixels.iter().copied().sum::<Vec3>() / pixels.len() as f32
}

pub(crate) fn close(value: Vec3, expected: f32, bound: f32) -> bool {
    (value / expected - 1.0).abs().max_element() <= bound
}

/// One radiance above the horizon, none below.
fn upper_half(radiance: f32) -> Light {
    let view = SkyView { axis: Vec2::X, texels: vec![[radiance; 3]; SkyView::WIDTH * SkyView::HEIGHT] };
    Light { environment: Environment::Sky { view, below: Some(Vec3::ZERO) }, ..Light::even(Vec3::ZERO) }
}

pub(crate) const FLAT: TraceSettings =
    TraceSettings { bounces: u32::MAX, seed: 1, normals: Normals::Flat, limit: f32::INFINITY };

#[test]
fn white_furnace_a_white_body_vanishes() {
    let ball = scene(&sphere(PartKind::Wood, 1.0));
    let light = Light::even(Vec3::splat(500.0));
    let shot = shot(DVec3::new(0.0, 1.0, 5.0), 0.0, 0.0, (16, 16));
    for bounces in [1, 5, u32::MAX] {
        let tracer = PathTracer::new(&ball, &light, TraceSettings { bounces, ..FLAT }).unwrap();
        for pixel in film(&tracer, &shot, 8).radiance() {
            assert!(close(pixel, 500.0, 1e-5), "{pixel}");
        }
    }
    // Round normals lose light where facets hide it, which is made up for in the mean.
    let round = TraceSettings { normals: Normals::RoundWood, ..FLAT };
    let pixels = film(&PathTracer::new(&ball, &light, round).unwrap(), &shot, 64).radiance();
    assert!(pixels.iter().all(|pixel| pixel.max_element() <= 502.0));
    assert!((pixels.iter().map(|pixel| pixel.y).sum::<f32>() / pixels.len() as f32 / 500.0 - 1.0).abs() < 1e-3);
}

#[test]
fn white_furnace_leaves_that_absorb_nothing_vanish() {
    // Albedo 0.6 and 0.4 of the light transmitted: one leaf, then a stack that light has to find its way out of.
    let light = Light::even(Vec3::ONE);
    let shot = shot(DVec3::new(0.0, 4.0, 4.0), 0.0, -0.78, (12, 12));
    for (heights, samples, bound) in [(vec![0.0], 8, 1e-5), (vec![0.0, 0.2, 0.4, 0.6], 1024, 0.01)] {
        let scene = scene(&leaves(&heights, 1.5, 0.6, 0.4 / 0.6));
        let film = film(&PathTracer::new(&scene, &light, FLAT).unwrap(), &shot, samples);
        assert!(close(mean(&film), 1.0, bound), "{}", mean(&film));
    }
}

/// The plant with leaves of this gloss.
pub(crate) fn glossy(plant: &Arc<Plant>, reflectance: f32, roughness: f32) -> Arc<Plant> {
    let mut plant = Plant::clone(plant);
    plant.set_leaf_gloss(Gloss { reflectance, roughness });
    Arc::new(plant)
}

#[test]
fn white_furnace_gloss_loses_nothing() {
    // One leaf of base colour 0.6 that transmits as much as the rest: it absorbs nothing, so there is no room for a lobe, and
    // all of its colour is diffuse.
    let light = Light::even(Vec3::ONE);
    let shot = shot(DVec3::new(0.0, 4.0, 4.0), 0.0, -0.78, (12, 12));
    for roughness in [0.0, 0.1, 0.4, 1.0] {
        let scene = self::scene(&glossy(&leaves(&[0.0], 1.5, 0.6, 100.0), 0.045, roughness));
        let film = film(&PathTracer::new(&scene, &light, FLAT).unwrap(), &shot, 256);
        let mut pixels = film.radiance();
        pixels.sort_by(|a, b| a.y.total_cmp(&b.y));
        let darkest = pixels[0].y;
        assert!(pixels.iter().all(|pixel| pixel.max_element() < 1.0001) && darkest > 0.9999, "{roughness}: {darkest}");
        // A leaf that absorbs half has room for its whole gloss, and sends back its base colour in the mean of all views.
        let half = self::scene(&glossy(&leaves(&[0.0], 1.5, 0.3, 0.0), 0.045, roughness));
        let tracer = PathTracer::new(&half, &light, FLAT).unwrap();
        let (mut sum, mut weights) = (0.0, 0.0);
        for step in 0..24 {
            let height = (f64::from(step) + 0.5) / 24.0;
            let from = DVec3::new(0.0, height, (1.0 - height * height).sqrt());
            let narrow = narrow(from * 50.0, -height.asin());
            sum += height * f64::from(mean(&self::film(&tracer, &narrow, 512)).y);
            weights += height;
        }
        assert!((sum / weights / 0.3 - 1.0).abs() < 0.01, "{roughness}: {}", sum / weights);
    }
}

#[test]
fn a_smooth_leaf_mirrors_the_sun_and_a_rough_one_spreads_it() {
    let direction = Vec3::new(0.0, 0.8, -0.6);
    let key = Disc { direction, illuminance: Vec3::splat(1000.0), angular_radius: 0.0047 };
    let light = Light { key: Some(key), ..Light::even(Vec3::ZERO) };
    let views = |roughness: f32, turn: f32| {
        let scene = scene(&glossy(&leaves(&[0.0], 1.5, 0.3, 0.0), 0.045, roughness));
        let tracer = PathTracer::new(&scene, &light, FLAT).unwrap();
        // 0: the mirror direction, on the other side of the vertical.
        let view = |height: f64| {
            let from = DVec3::new(0.0, height.sin(), height.cos()) * 50.0;
            f64::from(mean(&film(&tracer, &narrow(from, -height), 64)).y)
        };
        view(0.8f64.asin() + f64::from(turn))
    };
    let matt = 0.3 / std::f64::consts::PI * 1000.0 * 0.8;
    let found = [-0.6, -0.3, 0.0, 0.3, 0.6].map(|turn| views(0.1, turn));
    // Over the diffuse light, which is the same from everywhere.
    let diffuse = ((0.3f64.powi(2) + 0.045f64.powi(2)).sqrt() - 0.045) / std::f64::consts::PI * 800.0;
    let over = found.map(|value| value - diffuse);
    assert!(over[2] > 6.0 * over[1].max(over[3]) && found[2] > 3.0 * matt, "{found:?}");
    assert!(found.iter().all(|value| *value > 0.8 * matt), "{found:?}");
    // The peak of the formula: strength · F · D · V at the facet that looks up, with the disc's own width smoothed out.
    let (width, inside) = (0.1f64, (0.3f64.powi(2) + 0.045f64.powi(2)).sqrt() - 0.045);
    let fresnel = 0.5 + 10.5 * 0.2f64.powi(5);
    let masking = 0.5 / (2.0 * 0.64 * (1.0 - width) + 1.6 * width);
    let peak = (0.3 - inside) * fresnel / (std::f64::consts::PI * width * width) * masking * 0.8 * 1000.0;
    let shown = found[2] - inside / std::f64::consts::PI * 800.0;
    // 0.757: what the formula carries of its strength at that width.
    assert!((shown / (peak / 0.757) - 1.0).abs() < 0.02, "{shown} {peak}");
    let rough = [-0.3, 0.0, 0.3].map(|turn| views(1.0, turn));
    assert!(rough[1] < 1.4 * rough[0].min(rough[2]), "{rough:?}");
}

#[test]
fn light_of_the_sky_is_the_same_however_it_is_found() {
    // Directions by the sky's brightness and by the leaf's lobe, weighted against each other, and by the leaf alone.
    let axis = Vec2::new(0.6, -0.8);
    let mut view = SkyView { axis, texels: vec![[0.5; 3]; SkyView::WIDTH * SkyView::HEIGHT] };
    let sun = view.direction(70.0, 30.0);
    view.add(|d| Vec3::splat(60.0 * (30.0 * (d.dot(sun) - 1.0)).exp()));
    let scene = scene(&glossy(&leaves(&[0.0], 1.5, 0.3, 0.8), 0.08, 0.15));
    let light = Light { environment: Environment::Sky { view: view.clone(), below: None }, ..Light::even(Vec3::ZERO) };
    let tracer = PathTracer::new(&scene, &light, FLAT).unwrap();
    for (azimuth, height) in [(0.0, 0.4f64), (2.5, 0.9), (4.0, 0.2)] {
        let from = DVec3::new(f64::sin(azimuth) * height.cos(), height.sin(), f64::cos(azimuth) * height.cos());
        let shot = Shot {
            camera: Camera {
                view: Viewpoint { position: from * 50.0, yaw: azimuth, pitch: -height, field_of_view: 1e-4 },
                ..narrow(from, 0.0).camera
            },
            fog: None,
        };
        let found = f64::from(mean(&film(&tracer, &shot, 4096)).y);
        // The formula in f64 over an even net of the sphere.
        let (width, c, s) = (0.15f64, 0.3f64, 0.08f64);
        let inside = (c * c + s * s).sqrt() - s;
        let (mut sum, net) = (0.0, 1000);
        for (i, j) in (0..net).flat_map(|i| (0..net).map(move |j| (i, j))) {
            let y = 2.0 * (f64::from(i) + 0.5) / f64::from(net) - 1.0;
            let around = std::f64::consts::TAU * (f64::from(j) + 0.5) / f64::from(net);
            let light = DVec3::new((1.0 - y * y).sqrt() * around.cos(), y, (1.0 - y * y).sqrt() * around.sin());
            let radiance = f64::from(view.sample(light.as_vec3()).y);
            let value = if y < 0.0 {
                -y * 0.8 * inside / std::f64::consts::PI
            } else {
                let middle = (from + light).normalize();
                let distribution = (width / (middle.y.powi(2) * (width * width - 1.0) + 1.0)).powi(2);
                let masking = 0.5 / (2.0 * y * from.y * (1.0 - width) + (y + from.y) * width);
                let fresnel = 0.5 + 10.5 * (1.0 - middle.dot(light)).powi(5);
                y / std::f64::consts::PI * (inside + (c - inside) / 0.680 * fresnel * distribution * masking)
            };
            sum += radiance * value * 4.0 * std::f64::consts::PI / f64::from(net * net);
        }
        assert!((found / sum - 1.0).abs() < 0.02, "{height}: {found} {sum}");
    }
}

#[test]
fn what_absorbs_is_never_brighter_than_its_surroundings() {
    let scene = scene(&leaves(&[0.0, 0.1, 0.2], 1.5, 0.5, 0.8));
    let shot = shot(DVec3::new(0.0, 3.0, 3.0), 0.0, -0.78, (16, 16));
    let pixels = film(&PathTracer::new(&scene, &Light::even(Vec3::ONE), FLAT).unwrap(), &shot, 256).radiance();
    assert!(pixels.iter().all(|pixel| pixel.max_element() < 1.01));
    assert!(pixels.iter().any(|pixel| pixel.max_element() < 0.9));
}

#[test]
fn a_plane_returns_its_albedo_of_sky_and_sun() {
    let direction = Vec3::new(0.5, 0.6, -0.3).normalize();
    let key = Disc { direction, illuminance: Vec3::splat(8e4), angular_radius: 0.0047 };
    let light = Light { key: Some(key), ..Light::even(Vec3::splat(3000.0)) };
    let expected = 0.3 * (3000.0 + 8e4 * direction.y / std::f32::consts::PI);
    let flat = HeightField::new(4, 4, DVec2::splat(50.0), vec![0.0; 16]).unwrap();
    let terrain = GroundShape::Terrain(Arc::new(Terrain::new(flat, None, Surroundings::Mirror)));
    for ground in [plane(0.3), Ground { shape: terrain, ..plane(0.3) }] {
        let scene = ReferenceScene::new(&[], &[], Some(ground)).unwrap();
        let tracer = PathTracer::new(&scene, &light, TraceSettings::default()).unwrap();
        for pixel in film(&tracer, &shot(DVec3::new(3.0, 10.0, 5.0), 0.3, -1.0, (8, 8)), 16).radiance() {
            assert!(close(pixel, expected, 1e-3), "{pixel} {expected}");
        }
    }
}

fn daylight(instant: &str) -> LightState {
    let observer = Observer::new(47.0, 9.0, 400.0).unwrap();
    let instant = instant.parse().unwrap();
    let sun = SunPosition::at(instant, &observer).unwrap();
    let moon = MoonSetting::Full.moon(Some((instant, &observer)), &sun).unwrap();
    let atmosphere = Atmosphere::new(AtmosphereParams::with_visibility_km(40.0)).unwrap();
    LightState::new(&atmosphere, sun, moon, &LightSettings::default()).unwrap()
}

#[test]
fn a_plane_under_the_renderers_sky_has_its_illuminance() {
    let scene = ReferenceScene::new(&[], &[], Some(plane(0.5))).unwrap();
    let shot = shot(DVec3::new(3.0, 10.0, 5.0), 0.3, -1.0, (4, 4));
    // Noon, a sun just above the horizon, night.
    for instant in ["2026-06-21T11:30:00Z", "2026-06-21T18:40:00Z", "2026-06-21T23:30:00Z"] {
        let state = daylight(instant);
        let light = Light::of(&state, None);
        let tracer = PathTracer::new(&scene, &light, TraceSettings::default()).unwrap();
        let expected = 0.5 / std::f32::consts::PI * state.horizontal_illuminance();
        let found = mean(&film(&tracer, &shot, 256));
        assert!((found / expected - 1.0).abs().max_element() < 0.01, "{instant}: {found} {expected}");
        // The surroundings of a plant alone: as the light's own ground has it.
        let below = Light::of(&state, Some(Vec3::splat(7.0)));
        assert!(PathTracer::new(&scene, &below, FLAT).is_ok());
    }
}

#[test]
fn a_sphere_under_half_a_sky_has_its_form_factor() {
    let ball = scene(&sphere(PartKind::Wood, 0.7));
    let tracer = PathTracer::new(&ball, &upper_half(100.0), TraceSettings::default()).unwrap();
    let vertices: Vec<u32> = (0..1000).step_by(37).collect();
    let samples = tracer.vertices(0, 0).unwrap();
    for (vertex, [front, _]) in vertices.iter().zip(tracer.vertex_radiance(0, 0, &vertices, 2048).unwrap()) {
        let normal = samples[*vertex as usize].unwrap().normal;
        let expected = 0.7 * 100.0 * 0.5 * (1.0 + normal.y);
        // Facets hide a little of what a vertex' own normal sees.
        assert!((front.y - expected).abs() < 0.03 * 70.0, "{normal}: {front} {expected}");
    }
    // The same with a sun and flat normals, seen by the camera: albedo / pi E cos of each facet.
    let direction = Vec3::new(0.3, 0.5, 0.8).normalize();
    let key = Disc { direction, illuminance: Vec3::splat(1000.0), angular_radius: 0.0 };
    let light = Light { key: Some(key), ..Light::even(Vec3::ZERO) };
    let tracer = PathTracer::new(&ball, &light, FLAT).unwrap();
    let narrow = narrow(DVec3::new(0.0, 1.0, 500.0), 0.0);
    let expected = 0.7 / std::f32::consts::PI * 1000.0 * direction.z;
    assert!(close(mean(&film(&tracer, &narrow, 64)), expected, 0.05));
}

#[test]
fn slabs_transmit_reflect_and_pass_light_to_each_other() {
    // Infinite layers of reflectance R and transmittance T under a sky of radiance 1, by adding and doubling.
    let (r, t) = (0.4f32, 0.35f32);
    let light = upper_half(1.0);
    let down = shot(DVec3::new(0.0, 5.0, 0.0), 0.0, -1.57, (4, 4));
    let up = shot(DVec3::new(0.0, -5.0, 0.0), 0.0, 1.57, (4, 4));
    let both = t * t / (1.0 - r * r);
    for (heights, reflected, transmitted) in [(vec![0.0], r, t), (vec![0.0, 0.001], r + both * r, both)] {
        let scene = scene(&leaves(&heights, 40.0, r, t / r));
        let tracer = PathTracer::new(&scene, &light, FLAT).unwrap();
        let (above, below) = (mean(&film(&tracer, &down, 1024)), mean(&film(&tracer, &up, 1024)));
        assert!(close(above, reflected, 0.01), "{above} {reflected}");
        assert!(close(below, transmitted, 0.01), "{below} {transmitted}");
    }
    // The same of single points, front and back; and of a white receiver, the light alone.
    let scene = scene(&leaves(&[0.0], 40.0, r, t / r));
    let tracer = PathTracer::new(&scene, &light, FLAT).unwrap();
    for [front, back] in tracer.vertex_radiance(0, 0, &[0, 1, 2, 3], 256).unwrap() {
        assert!(close(front, r, 0.01) && close(back, t, 0.01), "{front} {back}");
    }
    let white =
        SurfaceSample { position: Vec3::ZERO, normal: Vec3::Y, reflected: Vec3::ONE, transmitted: Vec3::splat(0.5) };
    let [front, back] = tracer.exitant_radiance(0, &[white], 256).unwrap()[0];
    assert!(close(front, 1.0, 0.01) && close(back, 0.5, 0.01), "{front} {back}");
}

#[test]
fn a_leaf_is_dark_under_a_lid_that_nearly_touches_it() {
    let light = Light {
        key: Some(Disc { direction: Vec3::Y, illuminance: Vec3::splat(1000.0), angular_radius: 0.0 }),
        ..Light::even(Vec3::ZERO)
    };
    for height in [10.0f32, 25.0, 50.0] {
        let shot = shot(DVec3::new(0.0, f64::from(height) - 5.0, 0.0), 0.0, 1.57, (2, 2));
        let below = |parts: &[Arc<Plant>]| {
            let parts = parts.iter().flat_map(|plant| plant.parts.clone()).collect();
            let scene = scene(&plant(parts));
            mean(&film(&PathTracer::new(&scene, &light, FLAT).unwrap(), &shot, 16))
        };
        let leaf = leaves(&[height], 40.0, 0.5, 1.0);
        assert!(close(below(std::slice::from_ref(&leaf)), 0.5 * 1000.0 / std::f32::consts::PI, 0.01));
        for gap in [1e-3, 1e-4] {
            let lid = leaves(&[height + gap], 40.0, 0.0, 0.0);
            let lit = below(&[leaf.clone(), lid]);
            assert_eq!(lit, Vec3::ZERO, "under a lid {gap} m above a leaf {height} m up");
        }
    }
}

#[test]
fn sun_and_sky_add_up_to_the_whole() {
    let ball = scene(&sphere(PartKind::Wood, 0.6));
    let shot = shot(DVec3::new(0.0, 1.0, 5.0), 0.0, 0.0, (16, 16));
    let sum = |light: Light| {
        let tracer = PathTracer::new(&ball, &light, FLAT).unwrap();
        film(&tracer, &shot, 32).radiance().iter().map(|pixel| f64::from(pixel.y)).sum::<f64>()
    };
    // A camera sees the surroundings too: they are counted with the sky, and the disc's light with the sun.
    let (all, sun, sky) = (sum(sunny()), sum(sunny().without_environment()), sum(sunny().without_key()));
    assert!(sun > 0.0 && sky > 0.0);
    assert!(((sun + sky) / all - 1.0).abs() < 0.01, "{sun} {sky} {all}");
}

#[test]
fn bounces_add_up_to_the_whole() {
    let (r, t) = (0.4f32, 0.35f32);
    let scene = scene(&leaves(&[0.0, 0.001], 40.0, r, t / r));
    let up = shot(DVec3::new(0.0, -5.0, 0.0), 0.0, 1.57, (4, 4));
    for (bounces, expected) in [(0, 0.0), (1, t * t), (2, t * t), (3, t * t * (1.0 + r * r))] {
        let tracer = PathTracer::new(&scene, &upper_half(1.0), TraceSettings { bounces, ..FLAT }).unwrap();
        let found = mean(&film(&tracer, &up, 1024)).y;
        assert!((found - expected).abs() < 0.002, "{bounces}: {found} {expected}");
    }
}

fn tree() -> Arc<Plant> {
    Arc::new(grow(&GrowParameters::broadleaf(), 3, 5000).unwrap())
}

#[test]
fn rays_find_a_leaf_in_the_side_of_its_own_box() {
    // A level leaf is a box without height: the ray enters, meets and leaves it at one place.
    let scene = scene(&leaves(&[0.0], 40.0, 0.5, 0.0));
    for x in 0..100 {
        let place = DVec3::new(f64::from(x) * 0.37 - 18.0, 0.0, f64::from(x) * -0.25 + 9.0);
        let direction = DVec3::new(0.3, -1.0, f64::from(x) * 0.02).normalize();
        for far in [1.0, 1e3, 1e6] {
            let ray = WorldRay::new(place - far * direction, direction);
            let found = scene.distance(&ray).unwrap();
            assert!((found - far).abs() < 1e-4, "{found} {far}");
            assert!(scene.occluded(&ray));
            assert!(!scene.occluded(&WorldRay { t_max: far * 0.999, ..ray }));
        }
    }
}

/// Three trees on a plane, moved by `offset`.
fn grove(plant: &Arc<Plant>, offset: DVec3) -> ReferenceScene {
    let place = |x: f64, z: f64, yaw: f32, scale: f32| Instance {
        plant: 0,
        position: offset + DVec3::new(x, 0.0, z),
        yaw,
        scale,
        tint: 0.3,
    };
    let trees = [place(0.0, 0.0, 0.3, 1.0), place(4.0, -6.0, 2.0, 0.8), place(-5.0, -3.0, 5.0, 1.2)];
    let ground = Ground { shape: GroundShape::Plane(offset.y), ..plane(0.2) };
    ReferenceScene::new(std::slice::from_ref(plant), &trees, Some(ground)).unwrap()
}

fn sunny() -> Light {
    let key = Disc {
        direction: Vec3::new(0.6, 0.5, 0.3).normalize(),
        illuminance: Vec3::new(8e4, 7.5e4, 6.5e4),
        angular_radius: 0.0047,
    };
    Light { key: Some(key), ..Light::even(Vec3::new(3000.0, 4000.0, 6000.0)) }
}

fn grove_shot(offset: DVec3, size: (u32, u32)) -> Shot {
    let shot = shot(offset + DVec3::new(0.0, 6.0, 30.0), 0.0, 0.0, size);
    Shot { camera: Camera { near: 0.1, ..shot.camera }, fog: None }
}

#[test]
fn the_same_bytes_with_any_threads_and_however_interrupted() {
    let scene = grove(&tree(), DVec3::ZERO);
    let tracer = PathTracer::new(&scene, &sunny(), TraceSettings::default()).unwrap();
    let shot = grove_shot(DVec3::ZERO, (37, 23));
    let once = film(&tracer, &shot, 6);
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert!(pool.install(|| film(&tracer, &shot, 6)) == once, "{threads} threads");
    }
    let folder = tempfile::tempdir().unwrap();
    let (file, key) = (folder.path().join("deep/a.checkpoint"), tracer.fingerprint(&shot));
    assert!(Film::load_checkpoint(&file, &key).unwrap().is_none());
    let mut part = Film::new(&shot).unwrap();
    let stop = &mut |film: &Film| if film.samples() == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    tracer.render(&shot, &mut part, 6, stop).unwrap();
    assert_eq!(part.samples(), 2);
    part.save_checkpoint(&file, &key).unwrap();
    let mut resumed = Film::load_checkpoint(&file, &key).unwrap().unwrap();
    tracer.render(&shot, &mut resumed, 6, &mut |_| ControlFlow::Continue(())).unwrap();
    assert!(resumed == once);
}

#[test]
fn a_trace_that_is_stopped_in_a_pass_drops_that_pass_alone() {
    let scene = grove(&tree(), DVec3::ZERO);
    let tracer = PathTracer::new(&scene, &sunny(), TraceSettings::default()).unwrap();
    // Six tiles of 16 x 16 pixels, so that 15 questions are two passes and half of the third.
    let shot = grove_shot(DVec3::ZERO, (37, 23));
    let go_on = &mut |_: &Film| ControlFlow::Continue(());
    for (questions, samples) in [(0, 0), (1, 0), (6, 1), (15, 2)] {
        let asked = AtomicUsize::new(0);
        let stop = || asked.fetch_add(1, Ordering::Relaxed) >= questions;
        let mut part = Film::new(&shot).unwrap();
        tracer.render_unless(&shot, &mut part, 4, &stop, go_on).unwrap();
        assert_eq!(part.samples(), samples, "after {questions} questions");
        tracer.render(&shot, &mut part, 4, go_on).unwrap();
        assert!(part == film(&tracer, &shot, 4), "after {questions} questions");
    }
}

#[test]
fn checkpoints_that_are_stale_or_damaged_are_refused() {
    let (oak, other) = (tree(), leaves(&[1.0], 1.0, 0.5, 0.5));
    let scene = grove(&oak, DVec3::ZERO);
    let settings = TraceSettings::default();
    let shot = grove_shot(DVec3::ZERO, (5, 4));
    let tracer = PathTracer::new(&scene, &sunny(), settings).unwrap();
    let key = tracer.fingerprint(&shot);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.checkpoint");
    film(&tracer, &shot, 1).save_checkpoint(&file, &key).unwrap();

    let state = daylight("2026-06-21T11:30:00Z");
    let moved = grove(&oak, DVec3::new(0.0, 0.5, 0.0));
    let replanted = grove(&other, DVec3::ZERO);
    let shiny = grove(&glossy(&oak, Gloss::LEAF.reflectance, 0.2), DVec3::ZERO);
    let mut sun = sunny();
    sun.environment = Environment::Even(Vec3::splat(3000.0));
    let keys = [
        PathTracer::new(&moved, &sunny(), settings).unwrap().fingerprint(&shot),
        PathTracer::new(&replanted, &sunny(), settings).unwrap().fingerprint(&shot),
        PathTracer::new(&shiny, &sunny(), settings).unwrap().fingerprint(&shot),
        PathTracer::new(&scene, &sun, settings).unwrap().fingerprint(&shot),
        PathTracer::new(&scene, &sunny(), TraceSettings { bounces: 3, ..settings }).unwrap().fingerprint(&shot),
        PathTracer::new(&scene, &sunny(), TraceSettings { seed: 2, ..settings }).unwrap().fingerprint(&shot),
        tracer.fingerprint(&Shot { fog: Some(Fog::new(&state, 5.0)), ..shot.clone() }),
        tracer.fingerprint(&grove_shot(DVec3::ZERO, (4, 5))),
    ];
    for (number, other) in keys.iter().enumerate() {
        let stale = Film::load_checkpoint(&file, other);
        assert!(matches!(stale, Err(ReferenceError::Stale { .. })), "{number}");
    }
    let bytes = std::fs::read(&file).unwrap();
    for length in 0..bytes.len() {
        std::fs::write(&file, &bytes[..length]).unwrap();
        let truncated = Film::load_checkpoint(&file, &key);
        assert!(matches!(truncated, Err(ReferenceError::Checkpoint { .. })), "{length}");
    }
    for at in [0, 8, 40, 44, 48, 60, bytes.len() - 1] {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1;
        std::fs::write(&file, &damaged).unwrap();
        assert!(Film::load_checkpoint(&file, &key).is_err(), "{at}");
    }
    assert!(film(&tracer, &shot, 1).save_checkpoint(&file.join("under/a/file"), &key).is_err());
}

#[test]
fn a_scene_a_million_metres_away_looks_the_same() {
    let plant = tree();
    let picture = |offset: DVec3| {
        let scene = grove(&plant, offset);
        let tracer = PathTracer::new(&scene, &sunny(), TraceSettings::default()).unwrap();
        film(&tracer, &grove_shot(offset, (32, 32)), 4).radiance()
    };
    let near = picture(DVec3::ZERO);
    for offset in [DVec3::new(1e6, 0.0, -2e6), DVec3::new(-3e6, 1500.0, 1e6)] {
        let far = picture(offset);
        let same = near.iter().zip(&far).filter(|(a, b)| (**a - **b).abs().max_element() <= 1e-3 * a.max_element());
        // A ray in a thousand may round to the other side of a leaf's edge.
        assert!(same.count() * 100 >= 97 * near.len(), "{offset}");
        let sum = |pixels: &[Vec3]| pixels.iter().map(|pixel| pixel.y).sum::<f32>();
        assert!((sum(&far) / sum(&near) - 1.0).abs() < 0.01);
    }
}

#[test]
fn small_and_large_plants_scale() {
    let plant = tree();
    let picture = |scale: f32| {
        let trees = [Instance { scale, ..alone() }];
        let scene = ReferenceScene::new(std::slice::from_ref(&plant), &trees, None).unwrap();
        let tracer = PathTracer::new(&scene, &sunny(), TraceSettings::default()).unwrap();
        let place = DVec3::new(0.0, 6.0, 30.0) * f64::from(scale);
        film(&tracer, &shot(place, 0.0, 0.0, (24, 24)), 8)
    };
    let expected = mean(&picture(1.0));
    for scale in [1.0 / 8192.0, 512.0] {
        let found = mean(&picture(scale));
        assert!((found / expected - 1.0).abs().max_element() < 0.02, "{scale}: {found} {expected}");
    }
}

#[test]
fn strange_scenes_give_finite_pictures_or_errors() {
    let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(f32::NAN, 0.0, 0.0), Vec3::ONE];
    let broken =
        part(PartKind::Foliage, corners, vec![[0, 1, 2], [0, 0, 1], [0, 1, 3], [0, 1, 99], [0, 1, 2]], 3.0, 9.0);
    let strange = [plant(Vec::new()), plant(vec![broken]), plant(vec![part(PartKind::Wood, vec![], vec![], 1.0, 0.0)])];
    let place = |plant: usize, x: f64| Instance { plant, position: DVec3::new(x, 0.0, 0.0), ..alone() };
    let places = [place(0, 0.0), place(1, 0.0), place(1, 0.0), place(2, 1.0)];
    let scene = ReferenceScene::new(&strange, &places, Some(plane(1.0))).unwrap();
    let black = SkyView { axis: Vec2::X, texels: vec![[0.0; 3]; SkyView::WIDTH * SkyView::HEIGHT] };
    let dark = Light { environment: Environment::Sky { view: black, below: None }, ..Light::even(Vec3::ZERO) };
    let below = Disc { direction: Vec3::NEG_Y, illuminance: Vec3::splat(1e5), angular_radius: 0.005 };
    for light in [dark, Light { key: Some(below), ..Light::even(Vec3::ONE) }, sunny()] {
        let tracer = PathTracer::new(&scene, &light, TraceSettings::default()).unwrap();
        for position in [DVec3::new(0.2, 0.3, 3.0), DVec3::ZERO, DVec3::new(0.0, -5.0, 0.0), DVec3::splat(1e9)] {
            let film = film(&tracer, &shot(position, 0.0, 0.0, (8, 8)), 4);
            assert!(film.radiance().iter().all(|pixel| pixel.is_finite() && pixel.min_element() >= 0.0));
            assert_eq!(film.display(&DisplayTransform::of(&daylight_once(), None)).len(), 3 * 64);
        }
        assert!(tracer.vertex_radiance(1, 0, &[0, 3, 4], 4).unwrap().iter().flatten().all(|value| value.is_finite()));
        assert!(tracer.vertex_radiance(1, 0, &[5], 4).is_err());
        assert!(tracer.vertex_radiance(9, 0, &[0], 4).is_err());
        assert!(tracer.vertex_radiance(1, 7, &[0], 4).is_err());
    }
    let refused = |instance: Instance| ReferenceScene::new(&strange, &[instance], None).is_err();
    assert!(refused(place(3, 0.0)) && refused(place(0, f64::NAN)) && refused(place(0, 1e30)));
    assert!(refused(Instance { scale: 0.0, ..alone() }) && refused(Instance { scale: f32::NAN, ..alone() }));
    assert!(refused(Instance { yaw: f32::INFINITY, ..alone() }) && refused(Instance { tint: 2.0, ..alone() }));
    let settings = TraceSettings { limit: f32::NAN, ..FLAT };
    assert!(PathTracer::new(&scene, &sunny(), settings).is_err());
    let far = Ground { max_distance: f64::NAN, ..plane(0.5) };
    assert!(ReferenceScene::new(&[], &[], Some(far)).is_err());
}

fn daylight_once() -> LightState {
    static STATE: std::sync::LazyLock<LightState> = std::sync::LazyLock::new(|| daylight("2026-06-21T11:30:00Z"));
    STATE.clone()
}

#[test]
fn exr_files_hold_the_radiance() {
    let scene = ReferenceScene::new(&[], &[], Some(plane(0.5))).unwrap();
    let tracer = PathTracer::new(&scene, &Light::even(Vec3::new(1000.0, 2000.0, 1e6)), FLAT).unwrap();
    let film = film(&tracer, &shot(DVec3::new(0.0, 3.0, 0.0), 0.0, 0.0, (7, 5)), 2);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("new/picture.exr");
    film.save_exr(&file).unwrap();
    let read = image::open(&file).unwrap().into_rgb32f();
    assert_eq!(read.dimensions(), (7, 5));
    for (pixel, expected) in read.pixels().zip(film.radiance()) {
        assert_eq!(Vec3::from(pixel.0), expected);
    }
    assert!(film.relative_error().is_some_and(|error| error < 0.5));
}
