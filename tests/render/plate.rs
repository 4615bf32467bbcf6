//! A plate of one material under the sun and the sky: what its surface alone makes of their light.

use std::sync::Arc;

use bevy::{core_pipeline::tonemapping::Tonemapping, prelude::*};
use canopy::{
    bake::{
        BakeSettings, BakedLevel, BakedPlant, bake_plant,
        levels::cross::{CrossSettings, bake_cross},
        lighting::{BakedLighting, ExpressiveLighting, LightingSettings, implicit::AmbientField},
    },
    components::Sun,
    light::{Atmosphere, AtmosphereParams},
    lod::{FadeBand, Levels},
    plant::{Gloss, LeafTextures, LeafTissue, PartKind, Plant, PlantMaterial, PlantMesh, PlantPart},
    reference::{Camera, Film, Instance, LeafModel, Light, PathTracer, ReferenceScene, Shot, TraceSettings},
    render::components::{CanopyCamera, Forest, Ground, SunShadowSettings},
    scatter::{CoverMap, PackedStand, PlantSize, Stand, Tree, packed::DEFAULT_CELL_SIZE},
    scene::Pose,
    terrain::{HeightField, Surroundings, Terrain},
};
use glam::{DVec2, DVec3, Vec2, Vec3};
use image::{Rgba, RgbaImage};

use super::{SIZE, again, renderer};
use crate::support::{
    gpu::gpu,
    image::{luminance, mean_color},
    stage::instant,
};

/// The sun high in the south, and 35 degrees high in the east.
const HOURS: [&str; 2] = ["2026-06-21T11:15+00:00", "2026-06-21T07:00+00:00"];

/// Grey, matt, and half as bright from behind.
fn material() -> PlantMaterial {
    PlantMaterial {
        base_color: Vec3::splat(0.12),
        transmission: Vec3::splat(0.5),
        gloss: Gloss::MATT,
        ..PlantMaterial::default()
    }
}

/// A level square of 4 m, 3 m over the origin, with these vertex normals. Its texture's right is the east, its up the north.
fn plate(kind: PartKind, normal: Vec3, material: PlantMaterial) -> Plant {
    let corners = [(-2.0, -2.0), (-2.0, 2.0), (2.0, 2.0), (2.0, -2.0)];
    let mesh = PlantMesh {
        positions: corners.map(|(x, z)| Vec3::new(x, 3.0, z)).to_vec(),
        normals: vec![normal; 4],
        uvs: corners.map(|(x, z)| Vec2::new(x, z) / 4.0 + 0.5).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let material = match kind {
        PartKind::Wood => PlantMaterial { transmission: Vec3::ZERO, ..material },
        PartKind::Foliage => material,
    };
    Plant { name: "plate".to_owned(), parts: vec![PlantPart { kind, mesh, material }] }
}

/// `plant` without a bake of its light.
fn local(plant: &Plant) -> BakedPlant {
    let settings = BakeSettings { lighting: LightingSettings::Local, ..BakeSettings::default() };
    bake_plant(Arc::new(plant.clone()), &settings, None).0
}

/// `plant` with another light.
fn lit(plant: &Plant, lighting: ExpressiveLighting) -> BakedPlant {
    let lighting = BakedLighting::Expressive(lighting);
    let cross = BakedLevel::Cross(Arc::new(bake_cross(&Arc::new(plant.clone()), &lighting, &CrossSettings::default())));
    BakedPlant { lighting: Arc::new(lighting), ..local(plant) }.with_level(cross)
}

/// Luminance of the middle of `plant`, a model up to `fade` metres, seen from above or below at `hour`.
#[track_caller]
fn seen(plant: &Plant, fade: f32, above: bool, hour: &str) -> f64 {
    let light = drawn(local(plant), None, fade, above, hour);
    assert!((0.005..0.9).contains(&light), "{light} is no light that can be compared");
    light
}

/// As [`seen`], however dark it is, over `ground`.
#[track_caller]
fn drawn(plant: BakedPlant, ground: Option<Ground>, fade: f32, above: bool, hour: &str) -> f64 {
    let tree = Tree { position: DVec3::ZERO, yaw: 0.0, scale: 1.0, variant: 0, tint: 0.0, index: 0 };
    let bounds = [PlantSize { radius: 3.0, height: 4.0 }];
    let stand = PackedStand::new(&Stand { trees: vec![tree] }, DEFAULT_CELL_SIZE, &bounds).expect("one tree");
    let mut renderer = renderer(1);
    let (height, pitch) = if above { (13.0, -89.0) } else { (-7.0, 89.0) };
    renderer.set_view(&Pose { position: (0.0, height, 0.0), yaw: 0.0, pitch }.viewpoint(0.0, 50.0));
    let world = renderer.app().world_mut();
    // Numbers as they are, without a curve.
    let cameras: Vec<Entity> = world.query_filtered::<Entity, With<CanopyCamera>>().iter(world).collect();
    for camera in cameras {
        world.entity_mut(camera).insert(Tonemapping::None);
    }
    world.spawn(Forest {
        stand: Arc::new(stand),
        plants: Arc::new(vec![plant]),
        suns: Arc::from([]),
        origin: DVec3::ZERO,
        levels: Levels::model_and_cross(FadeBand::new(fade, 0.1)),
        view_distance: 1e4,
    });
    if let Some(ground) = ground {
        world.spawn(ground);
    }
    renderer.set_sun(Sun { instant: instant(hour), fixed_ev100: Some(14.0), ..Sun::default() });
    renderer.set_shadow(SunShadowSettings { cascades: 0, ..SunShadowSettings::default() });
    again(&mut renderer);
    let picture = again(&mut renderer);
    let near = |value: u32, size: u32| value.abs_diff(size / 2) < 8;
    luminance(mean_color(&picture, |column, row| near(column, SIZE.0) && near(row, SIZE.1)))
}

/// Leaves once had 1.1 times the sun where nothing is known of the leaves around them.
#[test]
fn a_leaf_without_an_ambient_term_has_the_light_of_a_board() {
    let _gpu = gpu();
    for hour in HOURS {
        let leaf = plate(PartKind::Foliage, Vec3::Y, PlantMaterial { transmission: Vec3::ZERO, ..material() });
        let board = seen(&plate(PartKind::Wood, Vec3::Y, material()), 1e4, true, hour);
        for (what, fade) in [("model", 1e4), ("cross", 0.0)] {
            let ratio = seen(&leaf, fade, true, hour) / board;
            assert!((ratio - 1.0).abs() < 0.02, "{hour}, {what}: {ratio} of the board's light");
        }
    }
}

/// The texel of a normal map that leans to the east and the north, away from the noon sun, and the same normal in the world.
fn leaning() -> (RgbaImage, Vec3) {
    let normal = Vec3::new(0.35, 0.45, 0.82).normalize();
    let texel = (normal * 127.5 + 127.5).to_array().map(|value| value.round() as u8);
    let image = RgbaImage::from_pixel(8, 8, Rgba([texel[0], texel[1], texel[2], 255]));
    (image, Vec3::new(normal.x, normal.z, -normal.y))
}

/// Maps of leaves were uploaded and never sampled, those of bark were taken for their negative.
#[test]
fn a_normal_map_leans_the_surface_as_its_normals_would() {
    let _gpu = gpu();
    let (map, normal) = leaning();
    let mapped = PlantMaterial { normal_texture: Some(Arc::new(map)), ..material() };
    for (kind, above) in [(PartKind::Wood, true), (PartKind::Foliage, true), (PartKind::Foliage, false)] {
        for hour in HOURS {
            let of =
                |normal: Vec3, material: &PlantMaterial| seen(&plate(kind, normal, material.clone()), 1e4, above, hour);
            let (flat, leaning, by_map) = (of(Vec3::Y, &material()), of(normal, &material()), of(Vec3::Y, &mapped));
            // A control: it matters.
            assert!((leaning / flat - 1.0).abs() > 0.03, "{kind:?} {hour}: {leaning} leaning, {flat} flat");
            let ratio = by_map / leaning;
            assert!((ratio - 1.0).abs() < 0.02, "{kind:?}, above {above}, {hour}: {ratio}; {by_map} of {flat} flat");
        }
    }
}

/// A crown's light with one normal and one k_a.
fn crown(ambient_field: AmbientField, normal: Vec3, ambient: f32) -> ExpressiveLighting {
    let (normals, ambient) = (vec![vec![normal; 4]], vec![vec![ambient; 4]]);
    ExpressiveLighting { normals, ambient, no_surface: None, ambient_field, together: false }
}

/// [Luft 2007, eq. 1]: k_a once dimmed the direct light too, and never got below 0.13.
#[test]
fn as_published_k_a_dims_the_ambient_light_and_nothing_else() {
    let _gpu = gpu();
    for hour in HOURS {
        for (what, fade) in [("model", 1e4), ("cross", 0.0)] {
            let of = |kind: PartKind, field: AmbientField, normal: Vec3, ambient: f32| {
                drawn(lit(&plate(kind, Vec3::Y, material()), crown(field, normal, ambient)), None, fade, true, hour)
            };
            let published = |ambient: f32| of(PartKind::Foliage, AmbientField::Published, Vec3::Y, ambient);
            let (sun, half, all) = (published(0.0), published(0.5), published(1.0));
            assert!(all > 1.05 * sun && sun > 0.005, "{what}, {hour}: {sun} of the sun, {all} of the sky too");
            let even = 2.0 * half / (sun + all);
            assert!((even - 1.0).abs() < 0.02, "{what}, {hour}: k_a of 0.5 leaves {even} of the mean");
            // On wood k_a is for the ambient light alone in any mode.
            let board = sun / of(PartKind::Wood, AmbientField::Published, Vec3::Y, 0.0);
            assert!((board - 1.0).abs() < 0.02, "{what}, {hour}: {board} of a board's sun");
            let fitted = of(PartKind::Foliage, AmbientField::Depth, Vec3::Y, 0.0);
            // Crosses have the crown's own shade in their sun textures.
            let dimmed = what == "cross" || fitted < 0.7 * sun;
            assert!(dimmed, "{what}, {hour}: {fitted} with the fitted constants, {sun} of the sun");
            // What faces away from the sun has no light: neither a floor nor through the leaf.
            let away = of(PartKind::Foliage, AmbientField::Published, Vec3::NEG_Y, 0.0);
            assert!(away < 0.02 * all, "{what}, {hour}: {away} in the dark, {all} in the open");
            let fitted = of(PartKind::Foliage, AmbientField::Depth, Vec3::NEG_Y, 0.0);
            assert!(fitted > 0.04 * all, "{what}, {hour}: {fitted} with the fitted constants, {all} in the open");
        }
    }
}

/// [Luft 2007, 3.3] realigns normals for the diffuse and the specular light.
#[test]
fn as_published_a_crown_has_the_gloss_of_its_normals() {
    let _gpu = gpu();
    // Half of the way from the viewer above to the sun.
    let normal = Vec3::new(0.46, 0.89, 0.0).normalize();
    let glossy = PlantMaterial { gloss: Gloss::LEAF, transmission: Vec3::ZERO, ..material() };
    for (what, fade) in [("model", 1e4), ("cross", 0.0)] {
        let own = seen(&plate(PartKind::Foliage, normal, glossy.clone()), fade, true, HOURS[1]);
        let flat = plate(PartKind::Foliage, Vec3::Y, glossy.clone());
        let ratio = |field| drawn(lit(&flat, crown(field, normal, 1.0)), None, fade, true, HOURS[1]) / own;
        let (published, fitted) = (ratio(AmbientField::Published), ratio(AmbientField::Depth));
        assert!((published - 1.0).abs() < 0.02, "{what}: {published} of the light with these normals");
        assert!(fitted < 0.95, "{what}: {fitted} with a gloss alike in all directions");
    }
}

/// A plain of which crowns cover all or nothing.
fn plain(covered: bool) -> Ground {
    let field = HeightField::new(9, 9, DVec2::splat(32.0), vec![0.0; 81]).expect("a plain");
    let terrain = Arc::new(Terrain::new(field, None, Surroundings::Border));
    let cover = vec![if covered { 255 } else { 0 }; 64 * 64];
    let cover = CoverMap { origin: DVec2::splat(-128.0), texel: 4.0, columns: 64, rows: 64, cover };
    Ground {
        terrain,
        drape: None,
        cover: Some(Arc::new(cover)),
        surroundings: 0.0,
        forest_surface: None,
        error_pixels: 1.0,
        view_distance: 1e3,
    }
}

/// What is in the common field of trees that are lit together was once counted again, by the cover around each of them.
#[test]
fn neighbours_darken_trees_that_are_lit_together_once() {
    let _gpu = gpu();
    // A mast makes the plate a low branch, around which are the neighbours' crowns.
    let mut plant = plate(PartKind::Foliage, Vec3::Y, material());
    let mast = PlantMesh {
        positions: vec![Vec3::new(2.5, 0.0, 0.0), Vec3::new(2.6, 0.0, 0.0), Vec3::new(2.55, 12.0, 0.0)],
        normals: vec![Vec3::Z; 3],
        uvs: vec![Vec2::ZERO; 3],
        triangles: vec![[0, 1, 2]],
    };
    plant.parts.push(PlantPart { kind: PartKind::Wood, mesh: mast, material: PlantMaterial::default() });
    for (what, fade) in [("model", 1e4), ("cross", 0.0)] {
        let of = |together: bool, covered: bool| {
            let (normals, ambient) = (vec![vec![Vec3::Y; 4], vec![Vec3::Z; 3]], vec![vec![0.5; 4], vec![0.5; 3]]);
            let field = AmbientField::Depth;
            let light = ExpressiveLighting { normals, ambient, no_surface: None, ambient_field: field, together };
            drawn(lit(&plant, light), Some(plain(covered)), fade, true, HOURS[0])
        };
        let (open, alone, lit_together) = (of(true, false), of(false, true), of(true, true));
        assert_eq!(open, of(false, false), "{what}: without neighbours the light is the same");
        // A control: the cover around matters.
        assert!(alone < 0.95 * open, "{what}: {alone} of {open} among neighbours");
        assert!((lit_together / open - 1.0).abs() < 1e-3, "{what}: {lit_together} of {open}, which is what k_a says");
    }
}

/// Mean radiance (nits) of the middle of `plant`, traced, seen from above or below at `hour`.
fn traced(plant: &Plant, above: bool, hour: &str) -> f64 {
    let plant = Arc::new(plant.clone());
    let instance = Instance { plant: 0, position: DVec3::ZERO, yaw: 0.0, scale: 1.0, tint: 0.0 };
    let scene = ReferenceScene::new(&[plant], &[instance], None).expect("a scene").with_leaves(LeafModel::Species);
    let sun = Sun { instant: instant(hour), fixed_ev100: Some(14.0), ..Sun::default() };
    let atmosphere = Atmosphere::new(AtmosphereParams::with_visibility_km(sun.visibility_km)).expect("air");
    let light = Light::of(&sun.light(&atmosphere).expect("a light"), None);
    let (height, pitch) = if above { (13.0, -89.0) } else { (-7.0, 89.0) };
    let view = Pose { position: (0.0, height, 0.0), yaw: 0.0, pitch }.viewpoint(0.0, 2.0);
    let shot = Shot { camera: Camera { view, size: (4, 4), near: 0.0 }, fog: None };
    let tracer = PathTracer::new(&scene, &light, TraceSettings::default()).expect("a tracer");
    let mut film = Film::new(&shot).expect("a film");
    tracer.render(&shot, &mut film, 1024, &mut |_| std::ops::ControlFlow::Continue(())).expect("an image");
    film.radiance().iter().map(|pixel| f64::from(pixel.y)).sum::<f64>() / 16.0
}

/// The layered leaf in real time [Franzke 2005, 4.2.2] against that of the path tracer: both over the same leaf without layers, whose
/// light the other tests compare.
#[test]
fn leaves_with_layers_have_the_light_of_the_path_tracer() {
    let _gpu = gpu();
    // The code of an sRGB texture whose colour is the transmission that `material` has by its factor.
    let through = RgbaImage::from_pixel(4, 4, Rgba([69, 69, 69, 255]));
    let textures = LeafTextures { transmission: Some(Arc::new(through)), ..LeafTextures::default() };
    let of = |tissue: Option<LeafTissue>| PlantMaterial { tissue, leaf_textures: textures.clone(), ..material() };
    // As thick as a rubber plant's, so that the layers matter.
    let tissue = LeafTissue { max_thickness: 0.0007, ..LeafTissue::default() };
    let mut largest = 1.0f64;
    // The sun at 65, 35 and 10 degrees.
    for hour in [HOURS[0], HOURS[1], "2026-06-21T04:40+00:00"] {
        for above in [true, false] {
            let [plain, layered] = [None, Some(tissue)].map(|tissue| plate(PartKind::Foliage, Vec3::Y, of(tissue)));
            let drawn = drawn(local(&layered), None, 1e4, above, hour) / drawn(local(&plain), None, 1e4, above, hour);
            let truth = traced(&layered, above, hour) / traced(&plain, above, hour);
            let ratio = drawn / truth;
            assert!((ratio - 1.0).abs() < 0.03, "{hour}, above {above}: {drawn} drawn, {truth} traced");
            largest = largest.min(truth);
        }
    }
    // A control: the layers matter.
    assert!(largest < 0.85, "{largest}");
}

/// A back of its own is seen from below only, and what a texture lets through from both sides.
#[test]
fn a_leaf_has_its_own_back() {
    let _gpu = gpu();
    let bright = RgbaImage::from_pixel(4, 4, Rgba([255, 255, 255, 255]));
    let front = PlantMaterial { base_color: Vec3::splat(0.12), transmission: Vec3::ZERO, ..material() };
    let half = RgbaImage::from_pixel(4, 4, Rgba([188, 188, 188, 255]));
    let with_back = PlantMaterial {
        base_color_texture: Some(Arc::new(half)),
        base_color: Vec3::splat(0.24),
        leaf_textures: LeafTextures { back: Some(Arc::new(bright)), ..LeafTextures::default() },
        ..front.clone()
    };
    for (above, expected) in [(true, 1.0), (false, 2.0)] {
        let seen = |material: &PlantMaterial| {
            drawn(local(&plate(PartKind::Foliage, Vec3::Y, material.clone())), None, 1e4, above, HOURS[0])
        };
        let ratio = seen(&with_back) / seen(&front);
        assert!((ratio / expected - 1.0).abs() < 0.03, "above {above}: {ratio}");
    }
}
