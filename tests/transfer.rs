//! Radiance transfer: cases with known answers, what is no plant at all, and the same bytes on any number of threads.

use std::sync::Arc;

use canopy::bake::lighting::transfer::{
    Channels, Projection, Scattering, TransferBake, TransferFormat, TransferSettings, bake_transfer, exitant_radiance,
    indirect_sun_share, share,
};
use canopy::light::{Atmosphere, AtmosphereParams, LightSettings, LightState, SunPosition, sh};
use canopy::plant::grow::{GrowParameters, grow};
use canopy::plant::{PartKind, Plant, PlantMaterial, PlantMesh, PlantPart};
use glam::{Quat, Vec2, Vec3};

const PROJECTION: TransferSettings = TransferSettings {
    bands: 3,
    channels: Channels::Luminance,
    rays: 1024,
    projection: Projection::Quadrature,
    scattering: Scattering::Diffuse(1),
};

/// A level square grid of `cells`² cells around `center`, its front up.
fn sheet(center: Vec3, half: f32, cells: u32) -> PlantMesh {
    let mut mesh = PlantMesh::default();
    for z in 0..=cells {
        for x in 0..=cells {
            let at = Vec2::new(x as f32, z as f32) / cells as f32;
            mesh.positions.push(center + Vec3::new(2.0 * at.x - 1.0, 0.0, 2.0 * at.y - 1.0) * half);
            mesh.normals.push(Vec3::Y);
            mesh.uvs.push(at);
        }
    }
    for z in 0..cells {
        for x in 0..cells {
            let a = z * (cells + 1) + x;
            let [b, c, d] = [a + cells + 1, a + cells + 2, a + 1];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn foliage(mesh: PlantMesh, base_color: Vec3, transmission: Vec3) -> PlantPart {
    PlantPart {
        kind: PartKind::Foliage,
        mesh,
        material: PlantMaterial { base_color, transmission, ..PlantMaterial::default() },
    }
}

fn plant(parts: Vec<PlantPart>) -> Arc<Plant> {
    Arc::new(Plant { name: "test".into(), parts })
}

/// Coefficients of radiance 1 from everywhere.
fn even(bands: usize) -> Vec<Vec3> {
    let mut light = vec![Vec3::ZERO; bands * bands];
    light[0] = Vec3::splat((4.0 * std::f32::consts::PI).sqrt());
    light
}

/// Cards every which way in a ball of radius 1.
fn cards(count: u64) -> PlantMesh {
    let mut mesh = PlantMesh::default();
    let mut state = 1u64;
    let mut unit = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    for _ in 0..count {
        let mut signed = || 2.0 * unit() - 1.0;
        let center = Vec3::new(signed(), signed(), signed());
        let normal = Vec3::new(signed(), signed(), signed()).normalize_or(Vec3::Y);
        let (right, up) = normal.any_orthonormal_pair();
        let base = mesh.positions.len() as u32;
        for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            mesh.positions.push(center + 0.12 * (right * x + up * y));
            mesh.normals.push(normal);
            mesh.uvs.push(Vec2::new(x, y));
        }
        mesh.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
    }
    mesh
}

fn all_finite(bake: &TransferBake) -> bool {
    bake.parts.iter().all(|part| part.front.iter().chain(&part.back).all(|c| c.is_finite()))
}

#[test]
fn a_single_leaf_has_the_coefficients_of_the_clamped_cosine() {
    let leaf = plant(vec![foliage(sheet(Vec3::ZERO, 0.1, 1), Vec3::ONE, Vec3::ZERO)]);
    for bands in 2..=6u8 {
        let settings = TransferSettings { bands, rays: 4096, ..PROJECTION };
        let bake = bake_transfer(&leaf, &settings);
        for (side, normal) in
            [(bake.parts[0].front_of(2, &settings), Vec3::Y), (bake.parts[0].back_of(2, &settings), Vec3::NEG_Y)]
        {
            let mut want = vec![0.0; usize::from(bands).pow(2)];
            sh::basis_into(normal, &mut want);
            sh::convolve_cosine(&mut want);
            for (want, got) in want.iter().zip(side) {
                assert!((want / std::f32::consts::PI - got).abs() < 2e-3, "{want} {got}");
            }
        }
    }
}

#[test]
fn an_even_sky_lights_a_free_leaf_exactly_by_the_projection() {
    // However few the rays, and whatever the normal: the sum of their cosines is known.
    for normal in [Vec3::Y, Vec3::new(0.6, 0.64, -0.48), Vec3::new(-0.28, 0.0, 0.96)] {
        let turn = Quat::from_rotation_arc(Vec3::Y, normal);
        let mut mesh = sheet(Vec3::ZERO, 0.1, 1);
        mesh.positions.iter_mut().chain(&mut mesh.normals).for_each(|v| *v = turn * *v);
        let leaf = plant(vec![foliage(mesh, Vec3::ONE, Vec3::ONE)]);
        for (rays, scattering) in
            [(16, Scattering::Diffuse(3)), (254, Scattering::Diffuse(3)), (64, Scattering::TransmitOnly(2))]
        {
            let settings = TransferSettings { rays, scattering, ..PROJECTION };
            let bake = bake_transfer(&leaf, &settings);
            for side in [bake.parts[0].front_of(1, &settings), bake.parts[0].back_of(1, &settings)] {
                let got = share(&even(3), side).x;
                assert!((got - 1.0).abs() < 1e-5, "{normal}, {rays} rays: {got}");
            }
        }
    }
}

#[test]
fn an_even_sky_lights_a_free_leaf_fully_by_either_projection() {
    let leaf = plant(vec![foliage(sheet(Vec3::ZERO, 0.1, 1), Vec3::ONE, Vec3::ZERO)]);
    for projection in [Projection::Quadrature, Projection::Fit] {
        for (bands, channels) in
            [(2, Channels::Rgb), (3, Channels::Rgb), (3, Channels::Luminance), (6, Channels::Luminance)]
        {
            let settings = TransferSettings { bands, channels, projection, ..PROJECTION };
            assert!(settings.within_published_limits());
            let bake = bake_transfer(&leaf, &settings);
            let light = even(usize::from(bands));
            // Four fitted coefficients cannot serve the day's skies and an even one as well.
            let bound = if projection == Projection::Fit && bands == 2 { 0.15 } else { 0.03 };
            let (front, back) = (bake.parts[0].front_of(0, &settings), bake.parts[0].back_of(0, &settings));
            for side in [front, back] {
                let got = share(&light, side);
                assert!((got - Vec3::ONE).abs().max_element() < bound, "{projection:?}, {bands}: {got}");
            }
            let (color, transmission) = (Vec3::new(0.1, 0.3, 0.05), Vec3::new(0.5, 0.4, 0.1));
            let got = exitant_radiance(&light, front, back, color, transmission);
            assert!((got - color * (1.0 + transmission)).abs().max_element() < bound * 0.45);
        }
    }
}

#[test]
fn light_comes_through_a_slab_as_its_transmission_says() {
    // The middle of a lower sheet sees nothing but the upper one, which has the sky above it.
    let color = Vec3::new(0.4, 0.8, 0.2);
    let transmission = Vec3::new(0.5, 0.25, 1.0);
    let slab = |y: f32, half: f32| foliage(sheet(Vec3::new(0.0, y, 0.0), half, 4), color, transmission);
    let plant = plant(vec![slab(0.0, 400.0), slab(1.0, 400.0)]);
    let middle = 12;
    for scattering in [Scattering::TransmitOnly(1), Scattering::Diffuse(1)] {
        let settings = TransferSettings { channels: Channels::Rgb, scattering, ..PROJECTION };
        let bake = bake_transfer(&plant, &settings);
        let got = share(&even(3), bake.parts[0].front_of(middle, &settings));
        assert!((got - color * transmission).abs().max_element() < 0.02, "{scattering:?}: {got}");
    }
    let none = TransferSettings { channels: Channels::Rgb, scattering: Scattering::TransmitOnly(0), ..PROJECTION };
    let dark = share(&even(3), bake_transfer(&plant, &none).parts[0].front_of(middle, &none));
    assert!(dark.max_element() < 0.02, "{dark}");
}

#[test]
fn in_a_white_furnace_everything_is_white() {
    // Half reflected, half transmitted, nothing lost: every surface sends out what it receives.
    let furnace = plant(vec![foliage(cards(120), Vec3::splat(0.5), Vec3::ONE)]);
    for projection in [Projection::Quadrature, Projection::Fit] {
        let settings = TransferSettings { scattering: Scattering::Diffuse(8), projection, ..PROJECTION };
        let bake = bake_transfer(&furnace, &settings);
        let (mut sum, mut count) = (0.0, 0.0f32);
        for side in bake.parts[0].front.chunks_exact(9).chain(bake.parts[0].back.chunks_exact(9)) {
            let got = share(&even(3), side).x;
            assert!((0.85..1.1).contains(&got), "{projection:?}: {got}");
            sum += got;
            count += 1.0;
        }
        assert!((sum / count - 1.0).abs() < 0.02, "{projection:?}: {}", sum / count);
    }
    // And with one bounce less light than with eight, never more than was sent.
    let less = bake_transfer(&furnace, &TransferSettings { scattering: Scattering::Diffuse(1), ..PROJECTION });
    assert!(less.parts[0].front.chunks_exact(9).all(|side| share(&even(3), side).x < 1.05));
}

#[test]
fn wood_has_one_side_and_its_inside_is_dark() {
    // A white board, its front up, and a small leaf under its middle, whose front looks at the back of the board.
    let mut board = foliage(sheet(Vec3::ZERO, 50.0, 20), Vec3::ONE, Vec3::ZERO);
    board.kind = PartKind::Wood;
    let leaf = foliage(sheet(Vec3::NEG_Y, 0.01, 1), Vec3::ONE, Vec3::ZERO);
    let middle = 10 * 21 + 10;
    for scattering in [Scattering::Diffuse(1), Scattering::Diffuse(8), Scattering::TransmitOnly(4)] {
        let settings = TransferSettings { scattering, ..PROJECTION };
        let bake = bake_transfer(&plant(vec![board.clone(), leaf.clone()]), &settings);
        let [wood, leaf] = &bake.parts[..] else { panic!("two parts") };
        assert!(wood.back.is_empty() && wood.back_of(middle, &settings).is_empty());
        assert_eq!(wood.front.len(), 21 * 21 * 9);
        let seen = |side: &[f32]| share(&even(3), side).x;
        assert!((seen(wood.front_of(middle, &settings)) - 1.0).abs() < 0.02, "the front has the whole sky");
        // The board's back reflects nothing, though the light from below falls on it, and lets nothing through.
        for vertex in 0..4 {
            let (up, down) = (seen(leaf.front_of(vertex, &settings)), seen(leaf.back_of(vertex, &settings)));
            assert!(up.abs() < 0.02, "{scattering:?}: {up} from the inside of wood");
            assert!((down - 1.0).abs() < 0.02, "{scattering:?}: {down} from below");
        }
    }
}

#[test]
fn the_light_is_turned_not_the_plant() {
    let yaw = 0.8f32;
    let turn = Quat::from_rotation_y(yaw);
    let upright = plant(vec![foliage(cards(40), Vec3::splat(0.5), Vec3::splat(0.5))]);
    let mut turned = (*upright).clone();
    let mesh = &mut turned.parts[0].mesh;
    mesh.positions.iter_mut().chain(&mut mesh.normals).for_each(|v| *v = turn * *v);
    let settings = TransferSettings { bands: 4, rays: 4096, ..PROJECTION };
    let (a, b) = (bake_transfer(&upright, &settings), bake_transfer(&Arc::new(turned), &settings));
    let light: Vec<Vec3> = (0..16).map(|i| Vec3::splat(2.0 / (1.0 + i as f32))).collect();
    let mut in_frame = light.clone();
    sh::rotate_y(&mut in_frame, -yaw);
    for vertex in 0..160 {
        let still = share(&in_frame, a.parts[0].front_of(vertex, &settings)).x;
        let moved = share(&light, b.parts[0].front_of(vertex, &settings)).x;
        assert!((still - moved).abs() < 0.03, "{still} {moved}");
    }
}

#[test]
fn what_leaves_send_each_other_of_a_sun_is_told_apart() {
    // A small leaf half a metre over a wide grey one: the sun reaches the underside of the upper over the lower alone.
    let lower = foliage(sheet(Vec3::ZERO, 8.0, 32), Vec3::splat(0.5), Vec3::ZERO);
    let upper = foliage(sheet(Vec3::Y * 0.5, 0.01, 1), Vec3::splat(0.5), Vec3::ZERO);
    let tree = plant(vec![lower, upper]);
    let bake = bake_transfer(&tree, &PROJECTION);
    let part = &bake.parts[1];
    assert_eq!(part.indirect_sun.len(), 4 * 4);
    for vertex in part.indirect_sun.chunks_exact(4) {
        // Two bands hold the clamped cosine c as 1/4 + c/2, and the upper side gets nothing: the mean is half of it.
        for (sun, cosine) in [(Vec3::Y, 1.0), (Vec3::new(0.8, 0.6, 0.0), 0.6)] {
            let expected = 0.5 * 0.5 / std::f32::consts::PI * (0.25 + 0.5 * cosine);
            let found = indirect_sun_share(vertex, sun);
            assert!((found / expected - 1.0).abs() < 0.05, "{found} {expected}");
        }
        assert_eq!(indirect_sun_share(vertex, Vec3::NEG_Y), 0.0);
    }
    assert_eq!(indirect_sun_share(&[f32::NAN; 4], Vec3::Y), 0.0);
    let straight = bake_transfer(&tree, &TransferSettings { scattering: Scattering::TransmitOnly(2), ..PROJECTION });
    assert!(straight.parts[1].indirect_sun.iter().all(|value| *value == 0.0));
    for format in [TransferFormat::Float32, TransferFormat::Float16, TransferFormat::Snorm8] {
        let packed = bake.pack(format).unpack();
        let most = part.indirect_sun.iter().fold(0.0f32, |most, value| most.max(value.abs()));
        let off = part.indirect_sun.iter().zip(&packed.parts[1].indirect_sun).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0f32, f32::max) <= most / 253.0);
    }
}

#[test]
fn the_same_bytes_on_any_number_of_threads_and_at_any_size() {
    let tree = Arc::new(grow(&GrowParameters::broadleaf(), 3, 5_000).unwrap());
    let settings = TransferSettings { rays: 32, ..TransferSettings::default() };
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let one = pool(1).install(|| bake_transfer(&tree, &settings));
    assert_eq!(one, pool(3).install(|| bake_transfer(&tree, &settings)));
    assert!(all_finite(&one));
    for factor in [2f32.powi(-14), 512.0] {
        let mut scaled = (*tree).clone();
        scaled.scale(factor);
        let other = bake_transfer(&Arc::new(scaled), &settings);
        assert_eq!(other.parts, one.parts, "{factor}");
    }
    let packed = one.pack(TransferFormat::Snorm8);
    assert_eq!((packed.parts[0].vertex_bytes, packed.parts[1].vertex_bytes), (20, 36));
    assert!(all_finite(&packed.unpack()));
}

#[test]
fn what_is_no_plant_does_no_harm() {
    let broken = PlantMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::NAN, Vec3::ONE],
        normals: vec![Vec3::ZERO, Vec3::Y, Vec3::Y],
        uvs: vec![Vec2::NAN; 3],
        triangles: vec![[0, 1, 2], [0, 1, 9], [0, 0, 0]],
    };
    let flat = sheet(Vec3::ZERO, 1.0, 1);
    let mut twice = flat.clone();
    twice.triangles.extend(flat.triangles.clone());
    let far = sheet(Vec3::new(1e6, 0.0, -1e6), 3.0, 2);
    let odd = [
        plant(vec![]),
        plant(vec![foliage(PlantMesh::default(), Vec3::ONE, Vec3::ONE)]),
        plant(vec![foliage(broken, Vec3::ONE, Vec3::ONE)]),
        plant(vec![foliage(twice, Vec3::ONE, Vec3::ONE), foliage(flat, Vec3::ONE, Vec3::ONE)]),
        plant(vec![foliage(far, Vec3::ONE, Vec3::ONE)]),
        plant(vec![foliage(sheet(Vec3::ZERO, 1e37, 2), Vec3::ONE, Vec3::ONE)]),
    ];
    for (index, plant) in odd.iter().enumerate() {
        for scattering in [Scattering::TransmitOnly(200), Scattering::Diffuse(0)] {
            let settings = TransferSettings { bands: 0, rays: 0, scattering, ..TransferSettings::default() };
            let bake = bake_transfer(plant, &settings);
            assert_eq!((bake.settings.bands, bake.settings.rays), (2, 16));
            assert!(all_finite(&bake), "plant {index}");
            for (part, source) in bake.parts.iter().zip(&plant.parts) {
                assert_eq!(part.front.len(), 4 * source.mesh.positions.len());
                assert_eq!(part.back.len(), part.front.len());
            }
            assert!(all_finite(&bake.pack(TransferFormat::Snorm8).unpack()));
        }
    }
    let bake = bake_transfer(&odd[4], &PROJECTION);
    let level = share(&even(3), bake.parts[0].front_of(4, &PROJECTION)).x;
    assert!((level - 1.0).abs() < 0.02, "a million metres away: {level}");
}

#[test]
fn surroundings_are_projected_at_any_band() {
    let atmosphere = Atmosphere::new(AtmosphereParams::default()).unwrap();
    let sun = SunPosition::from_degrees(130.0, 35.0).unwrap();
    let state = LightState::new(&atmosphere, sun, None, &LightSettings::default()).unwrap();
    let surroundings = state.surroundings();
    let three = surroundings.project(3);
    for (full, windowed) in three.iter().zip(&state.sky_sh) {
        assert!((*full - *windowed).length() < 0.2 * three[0].length());
    }
    assert!(
        surroundings.project(6)[..9].iter().zip(&three).all(|(a, b)| (*a - *b).length() < 1e-3 * three[0].length())
    );
    assert_eq!((surroundings.project(0).len(), surroundings.project(99).len()), (1, 36));
    let night =
        LightState::new(&atmosphere, SunPosition::from_degrees(0.0, -40.0).unwrap(), None, &LightSettings::default());
    assert!(night.unwrap().surroundings().project(6).iter().all(|c| c.is_finite()));
}
