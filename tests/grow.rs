//! Grown trees: what must hold for every species, seed and number of triangles.

use canopy::plant::grow::{
    BarkKind, CrownShape, GrowError, GrowParameters, LeafPainting, LeafShape, Pruning, ROOT_DEPTH, grow, grow_painted,
    textures,
};
use canopy::plant::{PartKind, Plant, PlantMesh, PlantPart};
use glam::{Vec2, Vec3};
use proptest::prelude::*;

fn species() -> [GrowParameters; 2] {
    [GrowParameters::broadleaf(), GrowParameters::conifer()]
}

fn part(plant: &Plant, kind: PartKind) -> &PlantMesh {
    &plant.parts.iter().find(|part| part.kind == kind).expect("both kinds are there").mesh
}

fn area(mesh: &PlantMesh) -> f32 {
    let corner = |i: u32| mesh.positions[i as usize];
    mesh.triangles.iter().map(|t| 0.5 * (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).length()).sum()
}

/// Diameter of the disc of the same area as the crown seen from above, metres (clusters count where they are hit by
/// a grid of 0.25 m).
fn crown_diameter(plant: &Plant) -> f32 {
    let cell = |p: &Vec3| ((p.x * 4.0).floor() as i32, (p.z * 4.0).floor() as i32);
    let mesh = part(plant, PartKind::Foliage);
    let middles = mesh.triangles.iter().map(|t| t.iter().map(|&i| mesh.positions[i as usize]).sum::<Vec3>() / 3.0);
    let cells: std::collections::HashSet<_> = middles.map(|p| cell(&p)).collect();
    2.0 * (cells.len() as f32 / 16.0 / std::f32::consts::PI).sqrt()
}

fn check_sound(plant: &Plant, triangles: usize) {
    let total = plant.triangle_count(PartKind::Wood) + plant.triangle_count(PartKind::Foliage);
    assert!(total <= triangles && total as f32 >= 0.98 * triangles as f32, "{total} of {triangles}");
    assert_eq!(plant.parts.len(), 2);
    for part in &plant.parts {
        let mesh = &part.mesh;
        assert!(mesh.positions.len() == mesh.normals.len() && mesh.positions.len() == mesh.uvs.len());
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        assert!(mesh.uvs.iter().all(|uv| uv.is_finite()));
        assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3));
        assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < mesh.positions.len()));
        if part.kind == PartKind::Foliage {
            assert!(mesh.uvs.iter().all(|uv| uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all()));
        }
    }
}

#[test]
fn the_same_seed_grows_the_same_tree_and_another_seed_another() {
    for species in species() {
        let (a, b) = (grow(&species, 42, 20_000).unwrap(), grow(&species, 42, 20_000).unwrap());
        let other = grow(&species, 43, 20_000).unwrap();
        for (a, (b, other)) in a.parts.iter().zip(b.parts.iter().zip(&other.parts)) {
            assert_eq!(a.mesh, b.mesh);
            assert_eq!(a.material.base_color, b.material.base_color);
            assert_ne!(a.mesh, other.mesh);
        }
    }
}

#[test]
fn triangles_are_used_up_and_never_exceeded() {
    for species in species() {
        for triangles in [5_000, 5_001, 7_777, 12_000, 33_333, 60_000, 100_000] {
            let plant = grow(&species, 5, triangles).unwrap();
            check_sound(&plant, triangles);
            let total = plant.triangle_count(PartKind::Wood) + plant.triangle_count(PartKind::Foliage);
            assert!(total + 1 >= triangles);
            assert!(plant.triangle_count(PartKind::Wood) as f32 <= species.wood_share * triangles as f32 + 1.0);
        }
    }
}

#[test]
fn the_crown_keeps_its_area_and_size_with_fewer_triangles() {
    for species in species() {
        for seed in 0..4 {
            let fine = grow(&species, seed, 60_000).unwrap();
            let (foliage, diameter) = (area(part(&fine, PartKind::Foliage)), crown_diameter(&fine));
            for triangles in [5_000, 12_000, 100_000] {
                let plant = grow(&species, seed, triangles).unwrap();
                let coarse = area(part(&plant, PartKind::Foliage));
                assert!((coarse / foliage - 1.0).abs() < 0.02, "{coarse} against {foliage} square metres");
                assert!((plant.height() / fine.height() - 1.0).abs() < 0.03);
                if triangles >= 12_000 {
                    // Fewer cards leave cells of the grid unhit, so coarser plants cannot be measured so.
                    assert!((crown_diameter(&plant) / diameter - 1.0).abs() < 0.15);
                }
            }
        }
    }
}

#[test]
fn the_presets_are_trees_of_the_forest() {
    // Heights and crowns of stands of 250 to 400 stems per hectare.
    for (species, heights, crowns, leaf_area_index) in [
        (GrowParameters::broadleaf(), 19.0..25.0, 6.5..9.5, 4.0..11.0),
        (GrowParameters::conifer(), 24.0..31.0, 4.2..6.3, 6.0..22.0),
    ] {
        let (mut height, mut diameter, seeds) = (0.0, 0.0, 20);
        for seed in 0..seeds {
            let plant = grow(&species, seed, 40_000).unwrap();
            let bounds = plant.bounds().unwrap();
            let crown = crown_diameter(&plant);
            assert!(heights.contains(&plant.height()), "{}: height {}", plant.name, plant.height());
            assert!(crowns.contains(&crown), "{}: crown {crown}", plant.name);
            assert!((bounds.min.y + ROOT_DEPTH).abs() < 0.15, "the trunk ends at {}", bounds.min.y);
            let low = part(&plant, PartKind::Wood).positions.iter().filter(|p| p.y < 0.05);
            let foot = low.map(|p| p.x.hypot(p.z)).fold(0.0, f32::max);
            assert!((0.2..0.8).contains(&foot), "{}: foot radius {foot}", plant.name);
            let foliage = plant.bounds_of(|kind| kind == PartKind::Foliage).unwrap();
            assert!(foliage.min.y > 2.0, "foliage from {}", foliage.min.y);
            assert!(foliage.center().with_y(0.0).length() < 3.0, "the crown leans to {}", foliage.center());
            let leaves = area(part(&plant, PartKind::Foliage)) * textures::coverage(species.leaves.shape);
            let index = leaves / (std::f32::consts::FRAC_PI_4 * crown * crown);
            assert!(leaf_area_index.contains(&index), "{}: {index} leaf per ground", plant.name);
            height += plant.height() / seeds as f32;
            diameter += crown / seeds as f32;
        }
        println!("{}: mean height {height:.1} m, mean crown {diameter:.1} m", species.name);
    }
}

#[test]
fn foliage_stays_near_wood() {
    for species in species() {
        let plant = grow(&species, 8, 100_000).unwrap();
        let wood: std::collections::HashSet<_> =
            part(&plant, PartKind::Wood).positions.iter().map(|p| p.floor().as_ivec3()).collect();
        let near = |p: &Vec3| {
            let cell = p.floor().as_ivec3();
            (0..27).any(|i| wood.contains(&(cell + glam::IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1))))
        };
        let foliage = part(&plant, PartKind::Foliage);
        let lost = foliage.positions.iter().filter(|&p| !near(p)).count();
        assert!(lost * 100 < foliage.positions.len(), "{lost} of {} vertices far from wood", foliage.positions.len());
    }
}

#[test]
fn triangles_face_where_their_normals_point() {
    for species in species() {
        let plant = grow(&species, 4, 30_000).unwrap();
        for mesh in plant.parts.iter().map(|part| &part.mesh) {
            let wrong = mesh.triangles.iter().filter(|t| {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
                let normal: Vec3 = t.iter().map(|&i| mesh.normals[i as usize]).sum();
                (b - a).cross(c - a).normalize_or_zero().dot(normal) < -0.2
            });
            let wrong = wrong.count();
            assert!(wrong * 50 < mesh.triangles.len(), "{wrong} of {} face inwards", mesh.triangles.len());
        }
    }
}

#[test]
fn species_files_hold_the_presets() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/species");
    for preset in species() {
        let path = folder.join(format!("{}.ron", preset.name));
        let Ok(text) = std::fs::read_to_string(&path) else {
            panic!("no species file {}", path.display());
        };
        assert_eq!(GrowParameters::from_ron(&text).unwrap(), preset);
    }
}

#[test]
fn errors_of_species_files_name_line_and_field() {
    let unknown = GrowParameters::from_ron("(\n  height: 20.0,\n  colour: 3,\n)").unwrap_err();
    assert!(matches!(unknown, GrowError::Syntax { line: 3, .. }), "{unknown}");
    assert!(unknown.to_string().contains("colour"), "{unknown}");
    let range = GrowParameters::from_ron("(height: 900.0)").unwrap_err();
    assert!(range.to_string().contains("height is 900"), "{range}");
    let deep = GrowParameters::from_ron("(branches: [(stem: (taper: -1.0))])").unwrap_err();
    assert!(deep.to_string().contains("branches[0].stem.taper"), "{deep}");
}

#[test]
fn degenerate_species_and_triangles_are_refused() {
    let broken: [fn(&mut GrowParameters); 10] = [
        |s| s.height = f32::NAN,
        |s| s.height = 0.0,
        |s| s.height_variation = 15.0,
        |s| s.branches.clear(),
        |s| s.branches[0].count = 0,
        |s| s.branches[1].stem.length = f32::INFINITY,
        |s| s.trunk.segments = 0,
        |s| s.leaves.count = 0,
        |s| s.leaves.transmission[1] = 2.5,
        |s| s.branches.iter_mut().for_each(|b| b.count = 400),
    ];
    for (index, break_it) in broken.iter().enumerate() {
        let mut species = GrowParameters::broadleaf();
        break_it(&mut species);
        assert!(matches!(grow(&species, 1, 10_000), Err(GrowError::Parameter { .. })), "case {index}");
    }
    for triangles in [0, 4_999, 100_001, usize::MAX] {
        assert_eq!(grow(&GrowParameters::conifer(), 1, triangles).unwrap_err(), GrowError::Triangles(triangles));
    }
}

#[test]
fn leaf_clusters_are_leaf_coloured_with_clear_edges_and_no_halo() {
    let linear = |byte: u8| (f32::from(byte) / 255.0).powf(2.2);
    for shape in [LeafShape::Ovate, LeafShape::Lobed, LeafShape::Needles] {
        let picture = textures::cluster(shape);
        assert_eq!(picture.dimensions(), (1024, 1024));
        let coverage = textures::coverage(shape);
        assert!((0.3..0.7).contains(&coverage), "{shape:?} covers {coverage}");
        let mut mean = [Vec3::ZERO; 2];
        let mut count = [0.0f32; 2];
        for pixel in picture.pixels() {
            let color = Vec3::new(linear(pixel[0]), linear(pixel[1]), linear(pixel[2]));
            let side = usize::from(pixel[3] >= 128);
            mean[side] += color;
            count[side] += 1.0;
        }
        let (outside, leaf) = (mean[0] / count[0], mean[1] / count[1]);
        assert!(leaf.y > leaf.x && leaf.x > leaf.z && (0.04..0.16).contains(&leaf.y), "{shape:?}: {leaf}");
        // What filtering finds beside a leaf is as bright as the leaf.
        assert!((outside.y / leaf.y - 1.0).abs() < 0.35, "{shape:?}: {outside} beside {leaf}");
        // Textures repeat: nothing may touch the sides and the top, or it shows on the other side.
        let touching = (0..1024).flat_map(|i| [(0, i), (1023, i), (i, 0)]);
        assert!(touching.into_iter().all(|(x, y)| picture.get_pixel(x, y)[3] == 0), "{shape:?} touches an edge");
        assert!(std::sync::Arc::ptr_eq(&picture, &textures::cluster(shape)));
    }
}

#[test]
fn bark_repeats_and_its_normals_are_normals() {
    for kind in [BarkKind::Fissured, BarkKind::Scaly] {
        let bark = textures::bark(kind);
        let (width, height) = bark.color.dimensions();
        assert_eq!((width, height), (512, 1024));
        // Across the edge neighbours differ as much as neighbours within.
        let step = |x0: u32, x1: u32, y0: u32, y1: u32| {
            let (a, b) = (bark.color.get_pixel(x0, y0), bark.color.get_pixel(x1, y1));
            (0..3).map(|i| u32::from(a[i].abs_diff(b[i]))).sum::<u32>() as f32
        };
        let mean = |steps: Vec<f32>| steps.iter().sum::<f32>() / steps.len() as f32;
        let seam_x = mean((0..height).map(|y| step(width - 1, 0, y, y)).collect());
        let seam_y = mean((0..width).map(|x| step(x, x, height - 1, 0)).collect());
        let within_x = mean(
            (0..height).flat_map(|y| (0..width - 1).map(move |x| (x, y))).map(|(x, y)| step(x, x + 1, y, y)).collect(),
        );
        let within_y = mean(
            (0..height - 1).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| step(x, x, y, y + 1)).collect(),
        );
        assert!(seam_x < 2.0 * within_x, "{kind:?}: {seam_x} against {within_x}");
        assert!(seam_y < 2.0 * within_y, "{kind:?}: {seam_y} against {within_y}");
        for pixel in bark.normal.pixels() {
            let normal = Vec3::new(f32::from(pixel[0]), f32::from(pixel[1]), f32::from(pixel[2])) / 127.5 - 1.0;
            assert!((normal.length() - 1.0).abs() < 0.02 && normal.z > 0.0);
        }
    }
}

fn any_species() -> impl Strategy<Value = GrowParameters> {
    let tree = (1.0f32..60.0, 0.0f32..0.5, 0.002f32..0.05, 0.5f32..3.0, 0.0f32..3.0, 0u32..=12, 0.0f32..0.8);
    let stem = (0.05f32..1.5, 1u32..12, 0.0f32..2.0, -360.0f32..360.0, 0.0f32..720.0, -3.0f32..3.0, 0.0f32..4.0);
    let branch = (1u32..20, 0u32..6, 0.0f32..180.0, -90.0f32..90.0, -180.0f32..180.0);
    let leaf = (100u32..20_000, 0.02f32..2.0, 0.0f32..1.0, 0.0f32..1.0, 0.0f32..60.0);
    (tree, stem, branch, leaf, 1usize..=3, 0usize..10, proptest::option::of((0.02f32..2.0, 0.05f32..0.95))).prop_map(
        |(tree, stem, branch, leaf, levels, shape, pruning)| {
            let mut species = if shape % 2 == 0 { GrowParameters::broadleaf() } else { GrowParameters::conifer() };
            let shapes = [
                CrownShape::Conical,
                CrownShape::Spire,
                CrownShape::Spherical,
                CrownShape::Hemispherical,
                CrownShape::Cylindrical,
                CrownShape::TaperedCylindrical,
                CrownShape::Flame,
                CrownShape::InverseConical,
                CrownShape::TendFlame,
            ];
            species.shape = shapes[shape.min(8)];
            (species.height, species.height_variation) = (tree.0, tree.0 * tree.1);
            (species.ratio, species.ratio_power, species.flare, species.lobes) = (tree.2, tree.3, tree.4, tree.5);
            species.irregularity = tree.6;
            species.pruning =
                pruning.map(|(width, width_peak)| Pruning { width, width_peak, power_low: 0.5, power_high: 2.0 });
            species.branches.truncate(levels);
            for parameters in [&mut species.trunk].into_iter().chain(species.branches.iter_mut().map(|b| &mut b.stem)) {
                parameters.length = stem.0;
                parameters.length_variation = 0.5 * stem.0;
                (parameters.segments, parameters.taper) = (stem.1, stem.2);
                (parameters.curve_deg, parameters.curve_variation_deg) = (stem.3, stem.4);
                (parameters.attraction_up, parameters.splits) = (stem.5, stem.6);
            }
            for parameters in &mut species.branches {
                (parameters.count, parameters.whorl) = (branch.0, branch.1);
                (parameters.down_angle_deg, parameters.down_angle_variation_deg) = (branch.2, branch.3);
                parameters.rotate_deg = branch.4;
            }
            let leaves = &mut species.leaves;
            (leaves.count, leaves.scale, leaves.droop, leaves.bend, leaves.fold_deg) =
                (leaf.0, leaf.1, leaf.2, leaf.3, leaf.4);
            species
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_species_in_range_grows_a_sound_tree(species in any_species(), seed: u64, triangles in 5_000usize..30_000) {
        species.validate().unwrap();
        check_sound(&grow(&species, seed, triangles).unwrap(), triangles);
    }

    #[test]
    fn any_seed_grows_a_sound_tree(seed: u64, triangles in 5_000usize..=100_000, conifer: bool) {
        let species = if conifer { GrowParameters::conifer() } else { GrowParameters::broadleaf() };
        check_sound(&grow(&species, seed, triangles).unwrap(), triangles);
    }
}

#[test]
fn further_textures_of_leaves_are_painted_on_request_alone() {
    for species in [GrowParameters::broadleaf(), GrowParameters::conifer()] {
        let plain = grow(&species, 3, 5_000).unwrap();
        let layered = grow_painted(&species, 3, 5_000, LeafPainting::Layers).unwrap();
        for (a, b) in plain.parts.iter().zip(&layered.parts) {
            assert_eq!(a.mesh, b.mesh);
            let texture = |part: &PlantPart| part.material.base_color_texture.clone().expect("a texture");
            assert!(std::sync::Arc::ptr_eq(&texture(a), &texture(b)));
            assert!(a.material.leaf_textures.is_empty());
            if b.kind == PartKind::Wood {
                assert!(b.material.leaf_textures.is_empty());
                continue;
            }
            let textures = &b.material.leaf_textures;
            assert!(textures.back.is_some() && textures.transmission.is_some());
            assert!(textures.thickness.is_some() && textures.absorption.is_some());
            assert!(a.material.normal_texture.is_none());
        }
        let (before, after) = (plain.leaf_colors(), layered.leaf_colors());
        assert_eq!(before.reflected, after.reflected);
        assert!((before.transmitted - after.transmitted).abs().max_element() < 0.004, "{before:?} {after:?}");
    }
}
