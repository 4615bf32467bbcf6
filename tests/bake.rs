//! Bakes on whole plants: what they keep, that they are deterministic, and that the cache can be trusted.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use canopy::bake::cache::{Cache, CacheKey};
use canopy::bake::levels::cross::{Cross, CrossSettings, bake_cross};
use canopy::bake::levels::rasterize::{View, projected_area};
use canopy::bake::levels::shadow_proxy::{shadow_proxy, simplify_foliage};
use canopy::bake::lighting::implicit::{AmbientField, ImplicitSettings, NoSurface};
use canopy::bake::lighting::{BakedLighting, ExpressiveLighting, LightingSettings};
use canopy::bake::textures::{FilteredTexture, PartTextures, filter_together};
use canopy::bake::{BakeError, BakeSettings, BakeSource, BakedLevel, BakedPlant, bake_plant};
use canopy::lod::Representation;
use canopy::math::{MipChain, octahedral};
use canopy::plant::texture::{color_mips, leaf_mips, normal_mips};
use canopy::plant::{PartKind, Plant, PlantMaterial, PlantMesh, PlantPart};
use glam::{Mat3, Quat, Vec2, Vec3};
use image::{Rgba, RgbaImage};
use proptest::prelude::*;

use crate::support::data::data;

/// A small generator of its own (SplitMix64), so that the test plants never change.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u32 << 24) as f32
    }

    fn signed(&mut self) -> f32 {
        2.0 * self.unit() - 1.0
    }

    fn direction(&mut self) -> Vec3 {
        loop {
            let v = Vec3::new(self.signed(), self.signed(), self.signed());
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
}

/// A leaf: a disc on a texture whose hidden colour is a screaming magenta.
fn leaf_texture() -> RgbaImage {
    RgbaImage::from_fn(32, 32, |x, y| {
        let d = Vec2::new(x as f32 - 15.5, y as f32 - 15.5).length();
        if d < 13.0 { Rgba([60, 120, 30, 255]) } else { Rgba([255, 0, 255, 0]) }
    })
}

fn add_card(mesh: &mut PlantMesh, center: Vec3, turn: Quat, half: f32) {
    let base = mesh.positions.len() as u32;
    let (u, v) = (turn * Vec3::X * half, turn * Vec3::Y * half);
    mesh.positions.extend([center - u - v, center + u - v, center + u + v, center - u + v]);
    mesh.normals.extend([turn * Vec3::Z; 4]);
    mesh.uvs.extend([Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::new(1.0, 0.0), Vec2::new(0.0, 0.0)]);
    mesh.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
}

/// A tapering tube.
fn add_branch(mesh: &mut PlantMesh, from: Vec3, to: Vec3, radius: f32) {
    const SIDES: u32 = 6;
    let base = mesh.positions.len() as u32;
    let (right, up) = (to - from).normalize().any_orthonormal_pair();
    for (end, r) in [(from, radius), (to, 0.4 * radius)] {
        for side in 0..SIDES {
            let (sin, cos) = (std::f32::consts::TAU * side as f32 / SIDES as f32).sin_cos();
            let normal = cos * right + sin * up;
            mesh.positions.push(end + r * normal);
            mesh.normals.push(normal);
            mesh.uvs.push(Vec2::new(side as f32 / SIDES as f32, 0.0));
        }
    }
    for side in 0..SIDES {
        let next = (side + 1) % SIDES;
        let [a, b, c, d] = [side, next, SIDES + next, SIDES + side].map(|i| base + i);
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
}

/// A tree of `cards` leaves in clumps at the ends of branches around a trunk, about 8 m high.
fn tree(cards: usize, seed: u64) -> Plant {
    let mut random = Random(seed);
    let (mut wood, mut leaves) = (PlantMesh::default(), PlantMesh::default());
    add_branch(&mut wood, Vec3::ZERO, 6.0 * Vec3::Y, 0.25);
    let clumps: Vec<Vec3> = (0..40)
        .map(|_| {
            let end = Vec3::new(0.3, 5.0, -0.2) + random.direction() * Vec3::new(2.4, 2.8, 2.0) * random.unit().cbrt();
            add_branch(&mut wood, Vec3::new(0.0, 0.6 * end.y, 0.0), end, 0.06);
            end
        })
        .collect();
    for card in 0..cards {
        let center = clumps[card % clumps.len()] + 0.5 * random.unit() * random.direction();
        let turn = Quat::from_rotation_arc(Vec3::Z, random.direction());
        add_card(&mut leaves, center, turn, 0.10 + 0.05 * random.unit());
    }
    let bark = PlantMaterial { base_color: Vec3::new(0.2, 0.12, 0.07), ..Default::default() };
    let leaf = PlantMaterial {
        base_color_texture: Some(Arc::new(leaf_texture())),
        transmission: Vec3::new(0.3, 0.5, 0.1),
        ..Default::default()
    };
    Plant {
        name: "test tree".into(),
        parts: vec![
            PlantPart { kind: PartKind::Wood, mesh: wood, material: bark },
            PlantPart { kind: PartKind::Foliage, mesh: leaves, material: leaf },
        ],
    }
}

fn small_settings() -> BakeSettings {
    let cross = CrossSettings { resolution: 64, supersampling: 2, ..Default::default() };
    BakeSettings { cross, ..Default::default() }
}

fn same(a: &BakedPlant, b: &BakedPlant) -> bool {
    a.lighting == b.lighting && a.levels == b.levels
}

fn decode_octahedral(code: [u8; 2]) -> Vec3 {
    octahedral::decode_z(Vec2::new(f32::from(code[0]), f32::from(code[1])) / 255.0 * 2.0 - 1.0)
}

/// Area that a level of a plane's picture shows with an alpha test at one half, square metres, bilinear as on the GPU.
fn picture_area(cross: &Cross, index: usize, level: usize) -> f32 {
    const ZOOM: usize = 4;
    let chain = &cross.textures.color[index].texels;
    let (width, height) = chain.level_size(level);
    let (width, height) = (width as usize, height as usize);
    let texels = &chain.levels[level];
    let alpha = |x: usize, y: usize| f32::from(texels[4 * (y.min(height - 1) * width + x.min(width - 1)) + 3]);
    let at = |i: usize| ((i as f32 + 0.5) / ZOOM as f32 - 0.5).max(0.0);
    let mut inside = 0usize;
    for (i, j) in (0..height * ZOOM).flat_map(|j| (0..width * ZOOM).map(move |i| (i, j))) {
        let (x, y) = (at(i), at(j));
        let (x0, y0) = (x as usize, y as usize);
        let (u, v) = (x.fract(), y.fract());
        let top = (1.0 - u) * alpha(x0, y0) + u * alpha(x0 + 1, y0);
        let bottom = (1.0 - u) * alpha(x0, y0 + 1) + u * alpha(x0 + 1, y0 + 1);
        inside += usize::from((1.0 - v) * top + v * bottom >= 127.5);
    }
    let plane = &cross.planes[index];
    4.0 * plane.u.length() * plane.v.length() * inside as f32 / (width * height * ZOOM * ZOOM) as f32
}

#[test]
fn a_cross_covers_what_the_plant_covers_in_every_mip() {
    let plant = Arc::new(tree(1500, 4));
    let cross = bake_cross(&plant, &BakedLighting::Local, &CrossSettings { uprights: 2, ..Default::default() });
    let bounds = plant.bounds().unwrap();
    for (index, plane) in cross.planes.iter().enumerate() {
        assert!((plane.u.cross(plane.v).normalize() - plane.normal).length() < 1e-5);
        let reach = plane.u.abs() + plane.v.abs();
        let along = Vec3::ONE - plane.normal.abs();
        assert!(((plane.center + reach - bounds.max) * along).length() < 1e-4);
        assert!(((plane.center - reach - bounds.min) * along).length() < 1e-4);

        let view = View { center: plane.center, right: plane.u, up: plane.v, toward: plane.normal };
        let full = projected_area(&plant, &view, 2048);
        assert!(full > 1.0);
        assert_eq!(cross.textures.color[index].texels.levels.len(), 9);
        for (level, tolerance) in [0.03, 0.03, 0.03, 0.05, 0.05].into_iter().enumerate() {
            let shown = picture_area(&cross, index, level) / full;
            assert!((shown - 1.0).abs() < tolerance, "plane {index}, level {level} shows {shown} of the plant");
        }
    }
}

#[test]
fn upright_planes_are_evenly_turned_and_each_shows_the_whole_plant() {
    let plant = Arc::new(tree(1500, 4));
    for uprights in [1, 3, 5] {
        let settings = CrossSettings { uprights, resolution: 128, supersampling: 2, ..CrossSettings::default() };
        let cross = bake_cross(&plant, &BakedLighting::Local, &settings);
        assert!(cross.is_whole(false) && cross.planes.len() == uprights as usize + 1);
        assert_eq!(cross.planes[uprights as usize].normal, Vec3::Y);
        for (index, plane) in cross.uprights().iter().enumerate() {
            let azimuth = plane.normal.x.atan2(plane.normal.z);
            assert!((azimuth - index as f32 * std::f32::consts::PI / uprights as f32).abs() < 1e-5);
            let view = View { center: plane.center, right: plane.u, up: plane.v, toward: plane.normal };
            let shown = picture_area(&cross, index, 0) / projected_area(&plant, &view, 1024);
            assert!((shown - 1.0).abs() < 0.04, "plane {index} of {uprights} shows {shown} of the plant");
        }
    }
    let most = CrossSettings { uprights: 99, resolution: 64, supersampling: 1, ..CrossSettings::default() };
    assert_eq!(bake_cross(&plant, &BakedLighting::Local, &most).uprights().len(), 8);
}

#[test]
fn a_cross_has_no_foreign_colour_anywhere() {
    let plant = Arc::new(tree(1500, 5));
    let cross = bake_cross(&plant, &BakedLighting::Local, &CrossSettings { resolution: 128, ..Default::default() });
    for chain in cross.textures.color.iter().map(|texture| &texture.texels) {
        // Leaves are green (60, 120, 30), bark is brown: red never exceeds what lies between, blue stays low.
        for texel in chain.levels.iter().flat_map(|level| level.chunks_exact(4)) {
            assert!(texel[2] < 80 && texel[0] < 140 && texel[1] > 60, "{texel:?}");
        }
    }
    assert!((cross.transmission - Vec3::new(0.3, 0.5, 0.1)).length() < 1e-5);
}

/// One leaf turned by hand: its normal, ambient visibility and kind are known in every plane.
#[test]
fn a_cross_keeps_normal_ambient_and_kind() {
    let mut mesh = PlantMesh::default();
    let normal = Vec3::new(0.5, 0.6, 0.7).normalize();
    // The vertex normal looks away from all three viewers and has to be turned.
    add_card(&mut mesh, Vec3::new(0.0, 2.0, 0.0), Quat::from_rotation_arc(Vec3::Z, -normal), 1.0);
    let part = PlantPart { kind: PartKind::Foliage, mesh, material: PlantMaterial::default() };
    let plant = Arc::new(Plant { name: String::new(), parts: vec![part] });
    let lighting = BakedLighting::Expressive(ExpressiveLighting {
        normals: vec![plant.parts[0].mesh.normals.clone()],
        ambient: vec![vec![0.4; 4]],
        no_surface: Some(NoSurface::NoField),
        ambient_field: AmbientField::Depth,
        together: false,
    });
    let cross = bake_cross(&plant, &lighting, &CrossSettings { uprights: 2, resolution: 64, ..Default::default() });
    for (plane, texture) in cross.planes.iter().zip(&cross.textures.properties) {
        for level in &texture.texels.levels {
            for texel in level.chunks_exact(4) {
                let decoded = plane.frame() * decode_octahedral([texel[0], texel[1]]);
                assert!(decoded.angle_between(normal) < 0.02, "{decoded}");
                assert_eq!((texel[2], texel[3]), (102, 255));
            }
        }
    }
    let frame = cross.planes[1].frame();
    assert!((frame - Mat3::from_cols(Vec3::NEG_Z, Vec3::Y, Vec3::X)).abs_diff_eq(Mat3::ZERO, 1e-5));
}

#[test]
fn nothing_and_flat_plants_give_crosses_too() {
    let empty = bake_cross(&Arc::new(Plant::default()), &BakedLighting::Local, &CrossSettings::default());
    assert_eq!(empty.planes.len(), 5);
    assert!(empty.textures.color.iter().flat_map(|texture| &texture.texels.levels).flatten().all(|&byte| byte == 0));

    let mut mesh = PlantMesh::default();
    add_card(&mut mesh, Vec3::Y, Quat::IDENTITY, 1.0);
    let part = PlantPart { kind: PartKind::Foliage, mesh, material: PlantMaterial::default() };
    let flat = Arc::new(Plant { name: String::new(), parts: vec![part] });
    let cross =
        bake_cross(&flat, &BakedLighting::Local, &CrossSettings { uprights: 2, resolution: 64, ..Default::default() });
    assert_eq!(cross.planes[1].u, Vec3::ZERO);
    assert!(cross.planes.iter().all(|plane| plane.frame().is_finite()));
    assert_eq!(cross.textures.color[0].texels.coverage(0, 0.5), 1.0);
    assert_eq!(cross.textures.color[1].texels.coverage(0, 0.5), 0.0);
    let proxy = simplify_foliage(&flat, 1);
    assert_eq!(proxy.parts[0].mesh, flat.parts[0].mesh);
}

#[test]
fn a_fifth_of_the_triangles_casts_the_same_shadow() {
    let plant = tree(3000, 6);
    let total = plant.triangle_count(PartKind::Foliage) + plant.triangle_count(PartKind::Wood);
    let light = simplify_foliage(&plant, total / 5);
    let kept: usize = light.parts.iter().map(|part| part.mesh.triangles.len()).sum();
    assert!(kept <= total / 5 && kept > total / 6, "{kept} of {total}");
    let bounds = plant.bounds().unwrap();
    for toward in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::new(0.3, 0.8, -0.5), Vec3::new(-0.7, 0.2, 0.4)] {
        let mut view = View::framing(bounds, toward.normalize());
        (view.right, view.up) = (1.3 * view.right, 1.3 * view.up);
        let ratio = projected_area(&light, &view, 1024) / projected_area(&plant, &view, 1024);
        assert!((ratio - 1.0).abs() < 0.10, "towards {toward}: {ratio}");
    }
    assert_eq!(shadow_proxy(&plant, total / 5), light.parts.iter().map(|part| part.mesh.clone()).collect::<Vec<_>>());
    // The trunk, with the largest area a triangle, is never dropped.
    assert!(light.parts[0].mesh.positions.iter().any(|p| p.y == 0.0));
}

#[test]
fn a_bake_is_the_same_on_one_thread_and_on_four() {
    let plant = Arc::new(tree(2000, 7));
    let bake = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bake_plant(Arc::clone(&plant), &BakeSettings::default(), None).0)
    };
    assert!(same(&bake(1), &bake(4)));
}

#[test]
fn the_cache_gives_back_what_was_baked() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path().join("not/yet/there"));
    let plant = Arc::new(tree(500, 8));
    let (fresh, source) = bake_plant(Arc::clone(&plant), &small_settings(), Some(&cache));
    assert!(matches!(source, BakeSource::Fresh { warning: None }), "{source:?}");
    let (cached, source) = bake_plant(Arc::clone(&plant), &small_settings(), Some(&cache));
    assert!(matches!(source, BakeSource::Cache), "{source:?}");
    assert!(same(&fresh, &cached));

    // One vertex, one texel, one setting: each is another plant.
    let mut moved = Plant::clone(&plant);
    moved.parts[1].mesh.positions[0].x += 1e-6;
    let mut painted = Plant::clone(&plant);
    let mut texture = leaf_texture();
    texture.put_pixel(3, 4, Rgba([1, 2, 3, 4]));
    painted.parts[1].material.base_color_texture = Some(Arc::new(texture));
    for (other, settings) in [
        (moved, small_settings()),
        (painted, small_settings()),
        (Plant::clone(&plant), BakeSettings { shadow_share: 0.3, ..small_settings() }),
    ] {
        assert!(cache.load(&CacheKey::new(&other, &settings), &Arc::new(other)).is_none());
    }
    let left = files_of(&cache, "bake");
    assert_eq!(left, [cache.file(&CacheKey::new(&plant, &small_settings().sanitized()))]);
}

/// The files of `cache` with this ending.
fn files_of(cache: &Cache, ending: &str) -> Vec<PathBuf> {
    let files = std::fs::read_dir(cache.folder()).unwrap().map(|entry| entry.unwrap().path());
    files.filter(|path| path.extension().is_some_and(|known| known == ending)).collect()
}

/// A plant with a bark and a leaf texture of this size, in memory of its own.
fn textured(side: u32) -> Arc<Plant> {
    let image = |blue: u8| {
        let alpha = |x: u32, y: u32| if (x + y) % 7 < 4 { 255 } else { 20 };
        Some(Arc::new(RgbaImage::from_fn(side, side, |x, y| Rgba([(3 * x) as u8, (5 * y) as u8, blue, alpha(x, y)]))))
    };
    let mut plant = tree(20, 3);
    plant.parts[0].material.base_color_texture = image(1);
    plant.parts[0].material.normal_texture = image(128);
    plant.parts[1].material.base_color_texture = image(2);
    Arc::new(plant)
}

/// The textures of `plant`, in the order of its parts.
fn textures_of(plant: &BakedPlant) -> Vec<Arc<FilteredTexture>> {
    let of_part = |part: &PartTextures| [part.color.clone(), part.normals.clone()];
    plant.textures.0.iter().flat_map(of_part).flatten().collect()
}

#[test]
fn textures_of_full_models_are_those_of_the_filters_wherever_they_come_from() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path());
    let plant = textured(40);
    let [wood, leaf] = [0, 1].map(|part| &plant.parts[part].material);
    let (bark, normals) = (wood.base_color_texture.as_ref().unwrap(), wood.normal_texture.as_ref().unwrap());
    let wanted = [
        color_mips(bark),
        normal_mips(normals),
        leaf_mips(leaf.base_color_texture.as_ref().unwrap(), leaf.alpha_cutoff),
    ];
    for from_cache in [false, true] {
        let (baked, source) = bake_plant(Arc::clone(&plant), &small_settings(), Some(&cache));
        assert_eq!(matches!(source, BakeSource::Cache), from_cache);
        let textures = textures_of(&baked);
        assert_eq!(
            textures.iter().map(|texture| texture.mips()).collect::<Vec<_>>(),
            wanted.each_ref().map(MipChain::view)
        );
        // What filtering keeps is not held twice.
        assert!(Arc::ptr_eq(textures[0].base(), bark) && Arc::ptr_eq(textures[1].base(), normals));
    }
}

#[test]
fn plants_with_equal_textures_share_them_in_memory_and_on_disk() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path());
    let (one, other) = (textured(41), textured(41));
    let shared = filter_together([&*one, &*other], Some(&cache));
    assert_eq!((shared.len(), files_of(&cache, "texture").len()), (3, 3), "each image is filtered once");
    let bake = |plant: &Arc<Plant>| bake_plant(Arc::clone(plant), &small_settings(), Some(&cache)).0;
    let (first, second) = (textures_of(&bake(&one)), textures_of(&bake(&other)));
    for texture in &first {
        assert!(shared.iter().any(|known| Arc::ptr_eq(known, texture)));
    }
    assert!(first.iter().zip(&second).all(|(a, b)| Arc::ptr_eq(a, b)) && first.len() == 3);
    assert_eq!(files_of(&cache, "texture").len(), 3);
    // Another cache gets its files although the textures are in memory.
    let second_folder = tempfile::tempdir().unwrap();
    let elsewhere = Cache::new(second_folder.path());
    bake_plant(Arc::clone(&one), &small_settings(), Some(&elsewhere));
    assert_eq!(files_of(&elsewhere, "texture").len(), 3);
    // Nothing holds them when the last plant is gone.
    let weak = Arc::downgrade(&first[0]);
    drop((shared, first, second));
    assert!(weak.upgrade().is_none());
}

#[test]
fn a_texture_that_is_missing_or_damaged_in_the_cache_is_filtered_again() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path());
    let plant = textured(42);
    let bake = || bake_plant(Arc::clone(&plant), &small_settings(), Some(&cache));
    let wanted: Vec<_> = textures_of(&bake().0).iter().map(|texture| FilteredTexture::clone(texture)).collect();
    let files = files_of(&cache, "texture");
    let contents: Vec<Vec<u8>> = files.iter().map(|file| std::fs::read(file).unwrap()).collect();
    for (number, (file, content)) in files.iter().zip(&contents).enumerate() {
        match number {
            0 => std::fs::remove_file(file).unwrap(),
            1 => std::fs::write(file, &content[..100]).unwrap(),
            _ => std::fs::write(file, b"").unwrap(),
        }
    }
    let (again, source) = bake();
    assert!(matches!(source, BakeSource::Cache), "{source:?}");
    assert!(textures_of(&again).iter().map(|texture| &**texture).eq(&wanted));
    assert!(files.iter().map(|file| std::fs::read(file).unwrap()).eq(contents));
}

#[test]
fn what_is_not_listed_is_not_baked() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path());
    let plant = Arc::new(tree(500, 8));
    let bake = |representations| {
        bake_plant(Arc::clone(&plant), &BakeSettings { representations, ..small_settings() }, Some(&cache))
    };
    let (all, _) = bake(BakeSettings::default().representations);
    assert!(all.cross().is_some() && all.shadow_proxy().is_some() && all.levels.len() == 2);
    for from_cache in [false, true] {
        let (models, source) = bake([Representation::MODEL, Representation::named("box")].into());
        assert_eq!(matches!(source, BakeSource::Cache), from_cache, "{source:?}");
        assert!(models.cross().is_none() && models.shadow_proxy() == all.shadow_proxy());
        assert_eq!(models.textures.0.len(), plant.parts.len());
    }
    for _from_cache in [false, true] {
        assert!(bake([].into()).0.levels.is_empty());
        assert!(bake([].into()).0.textures.0.is_empty());
    }
    // A level goes into the place of its kind.
    let (mut none, _) = bake([].into());
    let cross = BakedLevel::Cross(all.cross().unwrap().clone());
    none.set_level(cross.clone());
    assert_eq!(none.clone().with_level(cross).levels, none.levels);
}

#[test]
fn a_damaged_cache_file_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path());
    let plant = Arc::new(Plant::default());
    let (fresh, _) = bake_plant(Arc::clone(&plant), &small_settings(), Some(&cache));
    let key = CacheKey::new(&plant, &small_settings());
    let whole = std::fs::read(cache.file(&key)).unwrap();
    for length in (0..200).chain((200..whole.len()).step_by(9973)) {
        std::fs::write(cache.file(&key), &whole[..length]).unwrap();
        assert!(cache.load(&key, &plant).is_none(), "cut at {length}");
    }
    let (again, source) = bake_plant(Arc::clone(&plant), &small_settings(), Some(&cache));
    assert!(matches!(source, BakeSource::Fresh { warning: None }));
    assert!(same(&fresh, &again));
    assert_eq!(std::fs::read(cache.file(&key)).unwrap(), whole);
}

#[cfg(unix)]
#[test]
fn a_pipe_in_the_place_of_a_cache_file_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path());
    let plant = Arc::new(Plant::default());
    let key = CacheKey::new(&plant, &small_settings());
    // Whoever opens a pipe waits for its other end, here for ever.
    let made = std::process::Command::new("mkfifo").arg(cache.file(&key)).status().unwrap();
    assert!(made.success());
    assert!(cache.load(&key, &plant).is_none());
    for from_cache in [false, true] {
        let (_, source) = bake_plant(Arc::clone(&plant), &small_settings(), Some(&cache));
        match source {
            BakeSource::Fresh { warning: None } => assert!(!from_cache),
            BakeSource::Cache => assert!(from_cache),
            source => panic!("{source:?}"),
        }
    }
}

#[test]
fn a_folder_that_cannot_be_written_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a file");
    std::fs::write(&file, b"in the way").unwrap();
    let cache = Cache::new(file.join("below"));
    let (baked, source) = bake_plant(Arc::new(tree(50, 9)), &small_settings(), Some(&cache));
    let BakeSource::Fresh { warning: Some(warning @ BakeError::CacheFolder { .. }) } = source else {
        panic!("{source:?}")
    };
    assert!(warning.to_string().contains("CANOPY_CACHE"), "{warning}");
    assert!(baked.lighting.fits(&baked.plant));

    // A folder in the place of the file: it can be neither read nor replaced.
    let cache = Cache::new(folder.path());
    let plant = Arc::new(tree(50, 9));
    let path = cache.file(&CacheKey::new(&plant, &small_settings()));
    std::fs::create_dir_all(path.join("full")).unwrap();
    let (_, source) = bake_plant(plant, &small_settings(), Some(&cache));
    assert!(matches!(source, BakeSource::Fresh { warning: Some(BakeError::CacheWrite { .. }) }), "{source:?}");
}

#[test]
fn several_writers_leave_one_whole_file() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path());
    let plant = Arc::new(tree(50, 10));
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| bake_plant(Arc::clone(&plant), &small_settings(), Some(&cache)));
        }
    });
    // The plant, and the texture of its leaves.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    assert_eq!((files_of(&cache, "bake").len(), files_of(&cache, "texture").len()), (1, 1));
    let (_, source) = bake_plant(plant, &small_settings(), Some(&cache));
    assert!(matches!(source, BakeSource::Cache));
}

/// `benches/` measures what a bake of this size costs.
#[test]
fn sixty_thousand_triangles_are_baked_once() {
    let plant = Arc::new(tree(30_000, 11));
    let settings =
        BakeSettings { lighting: LightingSettings::Expressive(ImplicitSettings::default()), ..BakeSettings::default() };
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path());
    let bake = || bake_plant(Arc::clone(&plant), &settings, Some(&cache));
    let (fresh, source) = bake();
    assert!(matches!(source, BakeSource::Fresh { warning: None }));
    let whole: usize = plant.parts.iter().map(|part| part.mesh.triangles.len()).sum();
    let proxy: usize = fresh.shadow_proxy().unwrap().iter().map(|mesh| mesh.triangles.len()).sum();
    assert!(whole >= 60_000 && proxy as f32 <= (0.2 * whole as f32).round(), "{proxy} of {whole}");
    // What comes from the cache was not baked: a bake that is taken anew would say so.
    let (kept, source) = bake();
    assert!(matches!(source, BakeSource::Cache));
    assert!(kept.lighting == fresh.lighting && kept.levels == fresh.levels);
}

#[test]
#[ignore = "needs the data folder CANOPY_DATA"]
fn real_trees_keep_their_area() {
    for name in ["oak-medium", "aspen-medium", "pine-medium", "bush-1"] {
        real_tree(&data(&format!("trees/{name}.glb")));
    }
}

fn real_tree(path: &Path) {
    let (plant, _) = canopy::plant::gltf::load_plant(path, &Default::default()).unwrap();
    let (baked, _) = bake_plant(Arc::new(plant), &BakeSettings::default(), None);
    let cross = baked.cross().unwrap();
    for (index, plane) in cross.planes.iter().enumerate() {
        let view = View { center: plane.center, right: plane.u, up: plane.v, toward: plane.normal };
        let shown = picture_area(cross, index, 0) / projected_area(&baked.plant, &view, 2048);
        assert!((shown - 1.0).abs() < 0.03, "{}: plane {index} shows {shown}", baked.plant.name);
    }
    let bounds = baked.plant.bounds().unwrap();
    let mut proxy = Plant::clone(&baked.plant);
    proxy.parts.iter_mut().zip(baked.shadow_proxy().unwrap().iter()).for_each(|(part, mesh)| part.mesh = mesh.clone());
    for toward in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::new(0.5, 0.7, -0.5).normalize()] {
        let mut view = View::framing(bounds, toward);
        (view.right, view.up) = (1.3 * view.right, 1.3 * view.up);
        let ratio = projected_area(&proxy, &view, 1024) / projected_area(&baked.plant, &view, 1024);
        assert!((ratio - 1.0).abs() < 0.10, "{} towards {toward}: {ratio}", baked.plant.name);
    }
}

fn any_number() -> impl Strategy<Value = f32> {
    prop_oneof![8 => -10.0f32..10.0, 1 => Just(0.0f32), 1 => -1e30f32..1e30, 1 => Just(f32::NAN), 1 => Just(f32::INFINITY)]
}

fn any_vector() -> impl Strategy<Value = Vec3> {
    [any_number(), any_number(), any_number()].prop_map(Vec3::from)
}

fn any_part() -> impl Strategy<Value = PlantPart> {
    let vertex = (any_vector(), any_vector(), any_vector());
    let vertices = proptest::collection::vec(vertex, 0..24);
    let triangles = proptest::collection::vec([0u32..26, 0u32..26, 0u32..26], 0..16);
    (vertices, triangles, any::<bool>(), any::<bool>(), any_vector(), any_number()).prop_map(
        |(vertices, triangles, leaf, textured, color, alpha_cutoff)| PlantPart {
            kind: if leaf { PartKind::Foliage } else { PartKind::Wood },
            mesh: PlantMesh {
                positions: vertices.iter().map(|v| v.0).collect(),
                normals: vertices.iter().map(|v| v.1).collect(),
                uvs: vertices.iter().map(|v| v.2.truncate()).collect(),
                triangles,
            },
            material: PlantMaterial {
                base_color: color,
                base_color_texture: textured.then(|| Arc::new(leaf_texture())),
                alpha_cutoff,
                transmission: color,
                ..Default::default()
            },
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..Default::default() })]

    /// Whatever a plant holds, even what the type forbids: no panic, nothing that is not finite, everything in range.
    #[test]
    fn any_plant_bakes_to_finite_values(
        parts in proptest::collection::vec(any_part(), 0..3),
        target in 0usize..40,
        radius in any_number(),
        threshold in any_number(),
        smoothing in any_number(),
    ) {
        let plant = Plant { name: String::new(), parts };
        let implicit =
            ImplicitSettings { radius: Some(radius), threshold: Some(threshold), ..ImplicitSettings::default() };
        let plant = Arc::new(plant);
        let lighting = BakedLighting::bake(&plant, &LightingSettings::Expressive(implicit).sanitized());
        prop_assert!(lighting.fits(&plant));
        for part in 0..plant.parts.len() {
            prop_assert!(lighting.ambient(part).iter().all(|k| (0.0..=1.0).contains(k)));
            prop_assert!(lighting.normals(part).unwrap_or_default().iter().all(|normal| normal.is_normalized()));
        }
        let settings = CrossSettings { resolution: 3, supersampling: 0, normal_smoothing: smoothing, ..CrossSettings::default() };
        let cross = bake_cross(&plant, &lighting, &settings);
        prop_assert_eq!(cross.textures.color[0].texels.width, 64);
        prop_assert!(cross.transmission.is_finite());
        for plane in &cross.planes {
            prop_assert!(plane.center.is_finite() && plane.u.is_finite() && plane.v.is_finite());
            prop_assert!(plane.frame().is_finite());
        }
        let lighter = simplify_foliage(&plant, target);
        prop_assert_eq!(lighter.parts.len(), plant.parts.len());
    }

    /// Targets are met to within the size of one element, and what comes out is a sound mesh.
    #[test]
    fn simplification_keeps_targets(target in 20usize..2400, seed in 0u64..4) {
        let plant = tree(1000, seed);
        let lighter = simplify_foliage(&plant, target);
        let count: usize = lighter.parts.iter().map(|part| part.mesh.triangles.len()).sum();
        let whole: usize = plant.parts.iter().map(|part| part.mesh.triangles.len()).sum();
        prop_assert!(count <= target.max(14).min(whole) && count + 16 >= target.min(whole), "{} for {}", count, target);
        for mesh in lighter.parts.iter().map(|part| &part.mesh) {
            prop_assert!(mesh.positions.iter().all(|p| p.is_finite()));
            prop_assert!(mesh.triangles.iter().flatten().all(|&corner| (corner as usize) < mesh.positions.len()));
        }
    }
}
