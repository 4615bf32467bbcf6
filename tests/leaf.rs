//! Leaves with layers in the ground truth [Franzke 2005, 3.2], and the textures that files give them.

use std::f32::consts::{FRAC_PI_2, PI};
use std::ops::ControlFlow;
use std::sync::Arc;

use canopy::app::{LeafImages, LeafOptions};
use canopy::plant::gltf::{GltfOptions, load_plant};
use canopy::plant::{
    Gloss, LeafKind, LeafTextures, LeafTissue, Measured, PartKind, Plant, PlantMaterial, PlantMesh, PlantPart,
    leaf_textures,
};
use canopy::progress::Silent;
use canopy::reference::{
    Camera, Disc, Film, Instance, LeafModel, Light, Normals, PathTracer, ReferenceScene, Shot, TraceSettings,
};
use canopy::scene::Viewpoint;
use glam::{DVec3, Vec2, Vec3};
use image::{GrayImage, Luma, Rgba, RgbaImage};

const SIDE: f32 = 0.1;
const LUX: f32 = 1000.0;

/// A level leaf of 0.1 m around the origin, front up; u runs along +X, v along +Z.
fn leaf(material: PlantMaterial) -> Arc<Plant> {
    part(vec![Vec3::ZERO], SIDE, material)
}

fn part(centers: Vec<Vec3>, side: f32, material: PlantMaterial) -> Arc<Plant> {
    let mut mesh = PlantMesh::default();
    for center in centers {
        let first = mesh.positions.len() as u32;
        for (u, v) in [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)] {
            mesh.positions.push(center + side * Vec3::new(u - 0.5, 0.0, v - 0.5));
            mesh.normals.push(Vec3::Y);
            mesh.uvs.push(Vec2::new(u, v));
        }
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    Arc::new(Plant { name: "leaf".into(), parts: vec![PlantPart { kind: PartKind::Foliage, mesh, material }] })
}

/// A material of even colours, matt.
fn even(front: Vec3, transmission: Vec3) -> PlantMaterial {
    PlantMaterial {
        base_color: front,
        leaf_textures: LeafTextures { transmission: Some(Arc::new(color(transmission))), ..LeafTextures::default() },
        gloss: Gloss::MATT,
        ..PlantMaterial::default()
    }
}

fn srgb(linear: f32) -> u8 {
    (255.0 * canopy::math::linear_to_srgb(linear)).round() as u8
}

fn linear(code: u8) -> f32 {
    canopy::math::srgb_to_linear(f32::from(code) / 255.0)
}

fn color(linear: Vec3) -> RgbaImage {
    let [r, g, b] = linear.to_array().map(srgb);
    RgbaImage::from_pixel(2, 2, Rgba([r, g, b, 255]))
}

fn grey(value: f32) -> Option<Arc<GrayImage>> {
    Some(Arc::new(GrayImage::from_pixel(2, 2, Luma([(255.0 * value).round() as u8]))))
}

/// A point sun whose light comes from `degrees` off the vertical, from below if `below`.
fn sun(degrees: f32, below: bool) -> Light {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let direction = Vec3::new(sine, if below { -cosine } else { cosine }, 0.0);
    Light {
        key: Some(Disc { direction, illuminance: Vec3::splat(LUX), angular_radius: 0.0 }),
        ..Light::even(Vec3::ZERO)
    }
}

const FLAT: TraceSettings = TraceSettings { bounces: 0, seed: 1, normals: Normals::Flat, limit: f32::INFINITY };

/// Radiance of each pixel of a view from straight above (or below) onto a square of `width` metres around `center`.
fn seen(
    scene: &ReferenceScene,
    light: &Light,
    center: Vec2,
    width: f64,
    pixels: u32,
    samples: u32,
    below: bool,
) -> Vec<Vec3> {
    let height = if below { -10.0 } else { 10.0 };
    let view = Viewpoint {
        position: DVec3::new(center.x.into(), height, center.y.into()),
        yaw: 0.0,
        pitch: if below { f64::from(FRAC_PI_2) } else { -f64::from(FRAC_PI_2) },
        field_of_view: 2.0 * (0.5 * width / 10.0).atan(),
    };
    let shot = Shot { camera: Camera { view, size: (pixels, pixels), near: 0.0 }, fog: None };
    let tracer = PathTracer::new(scene, light, FLAT).unwrap();
    let mut film = Film::new(&shot).unwrap();
    tracer.render(&shot, &mut film, samples, &mut |_| ControlFlow::Continue(())).unwrap();
    film.radiance().to_vec()
}

fn scene(plant: &Arc<Plant>, model: LeafModel) -> ReferenceScene {
    let instance = Instance { plant: 0, position: DVec3::ZERO, yaw: 0.0, scale: 1.0, tint: 0.0 };
    ReferenceScene::new(std::slice::from_ref(plant), &[instance], None).unwrap().with_leaves(model)
}

/// Reflected fraction of perpendicular light at the middle of a leaf.
fn fraction(plant: &Arc<Plant>, model: LeafModel, light_below: bool, seen_below: bool) -> Vec3 {
    let pixels = seen(&scene(plant, model), &sun(0.0, light_below), Vec2::ZERO, 2e-3, 1, 16, seen_below);
    pixels[0] * PI / LUX
}

#[test]
fn perpendicular_light_returns_the_colours_of_the_textures() {
    let (front, back, through) = (Vec3::new(0.08, 0.16, 0.04), Vec3::new(0.15, 0.22, 0.1), Vec3::new(0.06, 0.14, 0.01));
    let textures = |thickness, absorption| {
        let mut material = even(front, through);
        material.leaf_textures.back = Some(Arc::new(color(back / front)));
        material.leaf_textures.thickness = thickness;
        material.leaf_textures.absorption = absorption;
        material
    };
    let stored = |value: Vec3| Vec3::from(value.to_array().map(|channel| linear(srgb(channel))));
    let back = front * stored(back / front);
    let through = stored(through);
    for (material, measured) in [
        (textures(None, None), Measured::Texel),
        (textures(grey(0.3), grey(0.9)), Measured::Texel),
        // Even textures are their own mean.
        (textures(grey(0.3), grey(0.9)), Measured::Leaf),
        (textures(grey(0.0), grey(1.0)), Measured::Leaf),
    ] {
        let plant = leaf(PlantMaterial { tissue: Some(LeafTissue { measured, ..LeafTissue::default() }), ..material });
        for (light_below, seen_below, expected) in
            [(false, false, front), (true, true, back), (true, false, through), (false, true, through)]
        {
            let got = fraction(&plant, LeafModel::Layers, light_below, seen_below);
            assert!((got - expected).abs().max_element() < 1e-3, "{got} {expected}, {measured:?}");
        }
        // The published model counts the tissue twice: darker.
        let published = fraction(&plant, LeafModel::Published, true, false);
        let thick =
            plant.parts[0].material.leaf_textures.thickness.as_ref().is_none_or(|image| image.get_pixel(0, 0)[0] > 0);
        assert!(!thick || published.y < 0.95 * through.y, "{published}");
    }
    // The standard model has the front on both sides.
    let plant = leaf(textures(None, None));
    assert!((fraction(&plant, LeafModel::Standard, true, true) - front).abs().max_element() < 1e-3);
    assert!((fraction(&plant, LeafModel::Standard, false, true) - through).abs().max_element() < 1e-3);
}

/// The light of the sun at `degrees` over its cosine, as a fraction of that of perpendicular light: what the front sends back,
/// or what comes `through` to the back.
fn over_the_angle(model: LeafModel, tissue: LeafTissue, degrees: f32, through: bool) -> f32 {
    let green = Vec3::new(0.08, 0.16, 0.04);
    let plant = leaf(PlantMaterial { tissue: Some(tissue), ..even(green, green) });
    let scene = scene(&plant, model);
    let at = |degrees: f32| {
        let radiance = seen(&scene, &sun(degrees, false), Vec2::ZERO, 2e-3, 1, 256, through)[0];
        radiance.y / degrees.to_radians().cos()
    };
    at(degrees) / at(0.0)
}

/// As a walk of photons through the same slabs (`benches/leaves.rs`) sends back and lets through.
#[test]
fn flat_light_is_sent_back_more_and_let_through_less() {
    let tissue = LeafTissue { scattering: 4.0, max_thickness: 0.0005, ..LeafTissue::default() };
    // An untextured leaf has the middle of both ranges.
    assert!((tissue.optical_depth(0.5, 0.5) - 0.45).abs() < 1e-6);
    for (degrees, before, behind) in [(30.0, 1.03, 0.89), (45.0, 1.057, 0.79), (60.0, 1.09, 0.69), (75.0, 1.117, 0.62)]
    {
        let of = |through: bool| over_the_angle(LeafModel::Layers, tissue, degrees, through);
        let (back, through) = (of(false), of(true));
        assert!(
            (back / before - 1.0).abs() < 0.02 && (through / behind - 1.0).abs() < 0.03,
            "{degrees}: {back} {through}"
        );
    }
}

#[test]
fn the_published_leaf_falls_with_the_angle_and_a_thin_one_is_lambert() {
    for through in [false, true] {
        let mut last = 1.0 + 1e-3;
        for degrees in [0.0, 30.0, 60.0, 80.0, 89.0] {
            let factor = over_the_angle(LeafModel::Published, LeafTissue::default(), degrees, through);
            assert!(factor > 0.0 && factor < last, "{degrees}: {factor} after {last}");
            last = factor;
            let thin = LeafTissue { max_thickness: 1e-6, ..LeafTissue::default() };
            assert!((over_the_angle(LeafModel::Published, thin, degrees, through) - 1.0).abs() < 0.02);
        }
    }
}

#[test]
fn a_half_covered_leaf_has_a_soft_edge_that_widens_with_its_thickness() {
    // A black lid above the half of the leaf with x < 0, outside the thickest leaf, which lies between its plane and the
    // virtual one.
    const LID: f32 = 2e-3;
    let width_of = |thickness: f32, model: LeafModel| {
        let green = even(Vec3::splat(0.3), Vec3::splat(0.3));
        let tissue = LeafTissue { max_thickness: thickness, absorption_range: [0.0; 2], ..LeafTissue::default() };
        let mut plant = (*leaf(PlantMaterial { tissue: Some(tissue), ..green })).clone();
        plant.parts[0].material.leaf_textures.thickness = grey(1.0);
        // Lit obliquely, seen from straight above: points inside lie deeper, so their shadow is displaced.
        let lid = part(vec![Vec3::new(-0.1, LID, 0.0)], 0.2, even(Vec3::ZERO, Vec3::ZERO));
        let mut parts = lid.parts.clone();
        parts[0].kind = PartKind::Wood;
        plant.parts.extend(parts);
        let scene = scene(&Arc::new(plant), model);
        // From below, so that the lid hides nothing; light through the leaf.
        let pixels = seen(&scene, &sun(45.0, false), Vec2::new(-LID, 0.0), 6e-3, 64, 64, true);
        let columns: Vec<f32> = (0..64).map(|x| (0..64).map(|y| pixels[64 * y + x].y).sum::<f32>() / 64.0).collect();
        let most = columns.iter().copied().fold(0.0, f32::max);
        assert!(most > 0.0);
        columns.iter().filter(|value| (0.1..0.9).contains(&(**value / most))).count()
    };
    let [standard, thin, thick] =
        [width_of(1e-3, LeafModel::Standard), width_of(0.3e-3, LeafModel::Layers), width_of(1e-3, LeafModel::Layers)];
    assert!(standard <= 1 && thin >= 2 && thick >= 2 * thin, "{standard} {thin} {thick} pixels");
}

#[test]
fn letters_in_the_absorption_can_be_read_against_the_light() {
    let mut material = even(Vec3::splat(0.2), Vec3::splat(0.2));
    // An L on a ground of middle absorption [p. 58].
    let letter =
        |x: u32, y: u32| (4..7).contains(&x) && (3..13).contains(&y) || (4..11).contains(&x) && (10..13).contains(&y);
    let image = GrayImage::from_fn(16, 16, |x, y| Luma([if letter(x, y) { 255 } else { 60 }]));
    material.leaf_textures.absorption = Some(Arc::new(image));
    material.leaf_textures.thickness = grey(1.0);
    material.tissue = Some(LeafTissue { measured: material.leaf_textures.measured(), ..LeafTissue::default() });
    let plant = leaf(material);
    let contrast = |model: LeafModel| {
        let pixels = seen(&scene(&plant, model), &sun(0.0, true), Vec2::ZERO, f64::from(SIDE), 16, 16, false);
        let mean = |inside: bool| {
            let of = (0..256).filter(|i| letter(i % 16, i / 16) == inside);
            // Not the texels that are blended with others.
            let values: Vec<f32> = of.map(|i| pixels[i as usize].y).collect();
            values.iter().sum::<f32>() / values.len() as f32
        };
        mean(true) / mean(false)
    };
    let (layers, standard) = (contrast(LeafModel::Layers), contrast(LeafModel::Standard));
    assert!(layers < 0.75 && (standard - 1.0).abs() < 0.01, "{layers} {standard}");
}

#[test]
fn a_plane_and_a_thin_box_of_the_same_tissue_agree() {
    let (thickness, green) = (0.5e-3f32, Vec3::splat(0.25));
    let tissue = LeafTissue { max_thickness: thickness, ..LeafTissue::default() };
    let material = PlantMaterial {
        tissue: Some(LeafTissue { measured: Measured::Texel, ..tissue }),
        leaf_textures: LeafTextures { thickness: grey(1.0), absorption: grey(0.5), ..even(green, green).leaf_textures },
        ..even(green, green)
    };
    let plane = leaf(material.clone());
    let mut solid = (*plane).clone();
    let mesh = &mut solid.parts[0].mesh;
    mesh.positions.extend(mesh.positions.clone().into_iter().map(|p| p - thickness * Vec3::Y));
    mesh.normals.extend([Vec3::NEG_Y; 4]);
    mesh.uvs.extend(mesh.uvs.clone());
    mesh.triangles.extend([[4, 6, 5], [4, 7, 6]]);
    for i in 0..4u32 {
        let j = (i + 1) % 4;
        mesh.triangles.extend([[i, i + 4, j + 4], [i, j + 4, j]]);
    }
    assert!(mesh.is_closed() && !plane.parts[0].mesh.is_closed());
    solid.parts[0].material.tissue = Some(LeafTissue { volume: true, ..tissue });
    let solid = Arc::new(solid);
    for (degrees, below) in [(0.0, false), (50.0, false), (0.0, true), (50.0, true), (75.0, true)] {
        let at = |plant: &Arc<Plant>| {
            seen(&scene(plant, LeafModel::Layers), &sun(degrees, below), Vec2::ZERO, 2e-3, 1, 256, false)[0].y
        };
        let (flat, full) = (at(&plane), at(&solid));
        assert!((full / flat - 1.0).abs() < 0.01, "{degrees}, below {below}: {flat} {full}");
    }
}

#[test]
fn strange_leaves_give_finite_light() {
    let wild =
        |max_thickness, absorption_range| LeafTissue { max_thickness, absorption_range, ..LeafTissue::default() };
    for tissue in
        [wild(0.0, [0.0; 2]), wild(f32::INFINITY, [1e30; 2]), wild(f32::NAN, [f32::NAN; 2]), wild(0.1, [1e6; 2])]
    {
        for (side, height) in [(1e-3f32, 0.0f32), (10.0, 1e3)] {
            let mut material = PlantMaterial { tissue: Some(tissue), gloss: Gloss::LEAF, ..even(Vec3::ONE, Vec3::ONE) };
            material.leaf_textures.thickness = Some(Arc::new(GrayImage::new(3, 0)));
            material.leaf_textures.back = Some(Arc::new(RgbaImage::new(0, 0)));
            material.leaf_textures.absorption = Some(Arc::new(GrayImage::from_pixel(1, 7, Luma([255]))));
            material.normal_texture = Some(Arc::new(RgbaImage::from_pixel(2, 1, Rgba([255, 0, 0, 0]))));
            let plant = part(vec![Vec3::new(0.0, height, 0.0)], side, material);
            for model in [LeafModel::Layers, LeafModel::Published] {
                // Light in the plane of the leaf, along it, and through it.
                for (degrees, below) in [(90.0, false), (89.99, true), (0.0, true)] {
                    let light = Light { environment: Light::even(Vec3::ONE).environment, ..sun(degrees, below) };
                    let scene = scene(&plant, model);
                    let shot = Shot {
                        camera: Camera {
                            // The leaf edge-on.
                            view: Viewpoint {
                                position: DVec3::new(0.0, f64::from(height), 2.0 * f64::from(side)),
                                yaw: 0.0,
                                pitch: 0.0,
                                field_of_view: 1.0,
                            },
                            size: (8, 8),
                            near: 0.0,
                        },
                        fog: None,
                    };
                    let tracer = PathTracer::new(&scene, &light, TraceSettings { bounces: 4, ..FLAT }).unwrap();
                    let mut film = Film::new(&shot).unwrap();
                    tracer.render(&shot, &mut film, 4, &mut |_| ControlFlow::Continue(())).unwrap();
                    assert!(film.radiance().iter().all(|pixel| pixel.is_finite() && pixel.min_element() >= 0.0));
                }
            }
        }
    }
}

#[test]
fn leaves_make_no_light() {
    // A furnace of leaves that absorb nothing: darker where the tissue absorbs, never brighter.
    let material = PlantMaterial { gloss: Gloss::LEAF, ..even(Vec3::splat(0.5), Vec3::splat(0.5)) };
    let plant = part((0..20).map(|i| Vec3::new(0.0, 0.01 * i as f32, 0.0)).collect(), SIDE, material);
    let settings = TraceSettings { bounces: u32::MAX, ..FLAT };
    for model in [LeafModel::Standard, LeafModel::Layers, LeafModel::Published] {
        let scene = scene(&plant, model);
        let tracer = PathTracer::new(&scene, &Light::even(Vec3::splat(100.0)), settings).unwrap();
        let view = Viewpoint {
            position: DVec3::new(0.3, 0.4, 0.0),
            yaw: f64::from(-FRAC_PI_2),
            pitch: -0.9,
            field_of_view: 0.3,
        };
        let shot = Shot { camera: Camera { view, size: (16, 16), near: 0.0 }, fog: None };
        let mut film = Film::new(&shot).unwrap();
        tracer.render(&shot, &mut film, 256, &mut |_| ControlFlow::Continue(())).unwrap();
        let mean = film.radiance().iter().map(|pixel| pixel.y).sum::<f32>() / 256.0;
        assert!(mean < 101.0 && mean > 20.0, "{model:?}: {mean}");
    }
}

#[test]
fn missing_textures_are_derived_from_the_front() {
    let veined = RgbaImage::from_fn(32, 32, |x, y| {
        if y < 4 {
            Rgba([255, 0, 255, 0])
        } else if x == 16 {
            Rgba([60, 80, 40, 255])
        } else {
            Rgba([80, 120, 50, 255])
        }
    });
    let material = PlantMaterial {
        base_color_texture: Some(Arc::new(veined)),
        transmission: Vec3::splat(1.3),
        gloss: Gloss::LEAF,
        ..PlantMaterial::default()
    };
    let how = leaf_textures::Derivation::default();
    let [thickness, absorption] = leaf_textures::thickness_and_absorption(&material, how).unwrap();
    assert_eq!(thickness.dimensions(), (32, 32));
    // The dark vein is thick and absorbs, the blade does not.
    assert_eq!((thickness.get_pixel(16, 20)[0], thickness.get_pixel(5, 20)[0]), (255, 0));
    assert_eq!((absorption.get_pixel(16, 20)[0], absorption.get_pixel(5, 20)[0]), (255, 0));
    let published = leaf_textures::Derivation { sign: leaf_textures::Sign::Published, ..how };
    let [_, absorption] = leaf_textures::thickness_and_absorption(&material, published).unwrap();
    assert_eq!((absorption.get_pixel(16, 20)[0], absorption.get_pixel(5, 20)[0]), (0, 255));
    let through = leaf_textures::transmission_of(&material).unwrap();
    let expected = material.transmitted(Vec3::new(linear(80), linear(120), linear(50)));
    assert!((linear(through.get_pixel(5, 20)[1]) - expected.y).abs() < 2e-3);
    let back = leaf_textures::back_of(&material).unwrap();
    assert!(back.get_pixel(5, 20)[2] > 55 && back.get_pixel(5, 20)[3] == 255);
    // The factor on the base colour once was in the texture, and counted twice.
    let tinted = PlantMaterial { base_color: Vec3::splat(0.5), ..material.clone() };
    assert_eq!(leaf_textures::back_of(&tinted), Some(back));
    let bump = leaf_textures::bump_of(&material, 0.01).unwrap();
    assert_ne!(bump.get_pixel(15, 20)[0], bump.get_pixel(17, 20)[0]);
    assert_eq!(bump.get_pixel(5, 20).0, [128, 128, 255, 255]);
    // Without any texture one place is as another.
    assert!(leaf_textures::thickness_and_absorption(&PlantMaterial::default(), how).is_none());
}

/// What `canopy leaf` writes is a whole set of textures, and a plant that has them.
#[test]
fn a_front_becomes_a_leaf_with_all_textures() {
    let folder = tempfile::tempdir().unwrap();
    let front = folder.path().join("front.png");
    RgbaImage::from_fn(24, 32, |x, y| {
        let inside = (2..22).contains(&x) && (2..30).contains(&y);
        let vein = x == 12;
        Rgba([if vein { 110 } else { 70 }, if vein { 120 } else { 105 }, 45, if inside { 255 } else { 0 }])
    })
    .save(&front)
    .unwrap();
    let options = LeafOptions {
        file: front.clone(),
        out: folder.path().join("leaf"),
        material: None,
        given: LeafImages { back: Some(front.clone()), ..LeafImages::default() },
        kind: LeafKind::Thin,
        max_thickness: Some(0.0004),
        width: 0.08,
        published: false,
        high_pass: Some(0.2),
        samples: 1,
        quiet: true,
    };
    let report = canopy::app::leaf(&options, &mut Silent).unwrap();
    assert!(report.lines.iter().any(|line| line == "back: given"), "{:?}", report.lines);
    assert!(report.lines.iter().any(|line| line.starts_with("transmission: derived")), "{:?}", report.lines);
    assert!(report.files.iter().all(|file| file.exists()));
    let sheet = image::open(options.out.join("sheet.png")).unwrap().into_rgb8();
    assert!(sheet.width() > 800 && sheet.pixels().any(|pixel| pixel[1] > pixel[0].saturating_add(20)));

    let (plant, warnings) = load_plant(&options.out.join("leaf.gltf"), &GltfOptions::default()).unwrap();
    // There is no wood, and a single leaf is small.
    assert!(warnings.iter().all(|warning| warning.message.contains("no wood")), "{warnings:?}");
    let [part] = plant.parts.as_slice() else { panic!("one leaf") };
    let (textures, tissue) = (&part.material.leaf_textures, part.material.tissue.unwrap());
    assert_eq!((tissue.max_thickness, tissue.measured), (0.0004, Measured::Texel));
    assert!(textures.back.is_some() && textures.transmission.is_some() && part.material.normal_texture.is_some());
    assert_eq!(textures.thickness.as_ref().map(|image| image.dimensions()), Some((24, 32)));
    assert!((plant.height() - 0.08 * 32.0 / 24.0).abs() < 1e-6);

    // What cannot be read names its file.
    for (file, word) in [("absent.png", "absent.png"), ("leaf/leaf.bin", "leaf.bin")] {
        let wrong = LeafOptions { file: folder.path().join(file), ..options.clone() };
        let error = canopy::app::leaf(&wrong, &mut Silent).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
    let other = LeafOptions { file: options.out.join("leaf.gltf"), material: Some("bark".into()), ..options.clone() };
    let error = canopy::app::leaf(&other, &mut Silent).unwrap_err().to_string();
    assert!(error.contains("no such leaf") && error.contains("leaf"), "{error}");
}
