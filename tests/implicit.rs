//! Implicit surfaces of foliage: what a bake gives for whole plants and stands, and what it withstands.

use std::collections::HashMap;

use canopy::bake::lighting::implicit::{
    AmbientField, COARSE_SHARE, FINE_SHARE, ImplicitBake, ImplicitSettings, NoSurface, NormalSource, StandPlant,
    SurfaceMesh, Weighting, bake_implicit, bake_implicit_stand,
};
use canopy::plant::grow::{GrowParameters, grow};
use canopy::plant::{PartKind, Plant, PlantMaterial, PlantMesh, PlantPart};
use glam::{DVec3, IVec3, Quat, Vec2, Vec3};

const BOTH: [NormalSource; 2] = [NormalSource::NearestVertex, NormalSource::Gradient];

fn part(kind: PartKind, positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> PlantPart {
    let count = positions.len();
    let mesh = PlantMesh { positions, normals: vec![Vec3::Z; count], uvs: vec![Vec2::ZERO; count], triangles };
    PlantPart { kind, mesh, material: PlantMaterial::default() }
}

fn plant(parts: Vec<PlantPart>) -> Plant {
    Plant { name: "test".into(), parts }
}

/// A ball of single leaves, and a trunk up to its middle.
fn ball_tree(leaves: u32) -> Plant {
    let mut positions = Vec::new();
    for i in 0..leaves {
        // Evenly in the ball: equal steps of the volume, and of the height, golden angle.
        let (r, y) = (((i as f32 + 0.5) / leaves as f32).cbrt(), 1.0 - 2.0 * (i as f32 * 0.754_877_7).fract());
        let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
        let flat = (1.0 - y * y).max(0.0).sqrt();
        let center = Vec3::new(0.0, 6.0, 0.0) + 3.0 * r * Vec3::new(flat * cos, y, flat * sin);
        positions.extend([Vec3::X, Vec3::Y, -Vec3::X].map(|corner| center + 0.1 * corner));
    }
    let triangles = (0..leaves).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let trunk = (0..61).map(|i| Vec3::new(0.1 * (i % 2) as f32, 0.1 * i as f32, 0.0)).collect();
    let trunk = part(PartKind::Wood, trunk, (0..59).map(|i| [i, i + 1, i + 2]).collect());
    plant(vec![trunk, part(PartKind::Foliage, positions, triangles)])
}

fn is_closed(surface: &SurfaceMesh) -> bool {
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    for &[a, b, c] in &surface.triangles {
        [(a, b), (b, c), (c, a)].into_iter().for_each(|edge| *edges.entry(edge).or_default() += 1);
    }
    edges.iter().all(|((a, b), count)| *count == 1 && edges.contains_key(&(*b, *a)))
}

/// What holds for every result.
fn check(plant: &Plant, bake: &ImplicitBake) {
    assert_eq!(bake.normals.len(), plant.parts.len());
    for ((part, normals), ambient) in plant.parts.iter().zip(&bake.normals).zip(&bake.ambient) {
        assert_eq!((normals.len(), ambient.len()), (part.mesh.positions.len(), part.mesh.positions.len()));
        assert!(normals.iter().all(|n| n.is_normalized()));
        assert!(ambient.iter().all(|k| (0.0..=1.0).contains(k)));
    }
    if let Some(surface) = &bake.surface {
        assert!(!surface.triangles.is_empty() && is_closed(surface));
        assert_eq!(surface.positions.len(), surface.normals.len());
        assert!(surface.positions.iter().all(|p| p.is_finite()));
        assert!(surface.normals.iter().all(|n| n.is_normalized()));
    }
}

fn bake(plant: &Plant, settings: &ImplicitSettings) -> ImplicitBake {
    let baked = bake_implicit(plant, settings);
    check(plant, &baked);
    baked
}

fn with(normals: NormalSource) -> ImplicitSettings {
    ImplicitSettings { normals, ..ImplicitSettings::default() }
}

fn published(normals: NormalSource) -> ImplicitSettings {
    ImplicitSettings { ambient: AmbientField::Published, ..with(normals) }
}

#[test]
fn a_round_crown_has_radial_normals_and_a_dark_middle() {
    let tree = ball_tree(6000);
    for (normals, ambient) in
        BOTH.into_iter().flat_map(|n| [AmbientField::Published, AmbientField::Depth].map(|ambient| (n, ambient)))
    {
        // Half a leaf a metre is little: both fields are to see it.
        let core = Some(if ambient == AmbientField::Published { 0.3 } else { 1.2 });
        let curve = ImplicitSettings { least: Some(0.1), core, exponent: Some(1.0), ..with(normals) };
        let settings = ImplicitSettings { radius: Some(0.5), ambient, ..curve };
        let baked = bake(&tree, &settings);
        assert_eq!(baked.report.no_surface, None);
        let middle = Vec3::new(0.0, 6.0, 0.0);
        let mut cosines = Vec::new();
        for (p, n) in tree.parts[1].mesh.positions.iter().zip(&baked.normals[1]) {
            if p.distance(middle) > 2.0 {
                cosines.push(n.dot((p - middle).normalize()));
            }
        }
        let mean = cosines.iter().sum::<f32>() / cosines.len() as f32;
        assert!(mean > 0.93, "{normals:?}: {mean}");
        assert!(baked.normals[0].iter().all(|n| *n == Vec3::Z), "wood keeps its own");
        // The trunk is free below the crown and dark in its middle.
        let trunk = &baked.ambient[0];
        match ambient {
            AmbientField::Published => assert_eq!(trunk[5], 1.0),
            AmbientField::Depth => assert!((0.9..1.0).contains(&trunk[5]), "{}", trunk[5]),
        }
        assert!(trunk[60] < 0.8, "{}", trunk[60]);
        let leaves = tree.parts[1].mesh.positions.iter().zip(&baked.ambient[1]);
        let mean = |low: f32, high: f32| {
            let inside: Vec<f32> =
                leaves.clone().filter(|(p, _)| (low..high).contains(&p.distance(middle))).map(|(_, k)| *k).collect();
            inside.iter().sum::<f32>() / inside.len() as f32
        };
        let (outer, middle, inner) = (mean(2.9, 3.2), mean(2.5, 2.9), mean(0.0, 2.0));
        assert!(outer > middle + 0.05 && middle > inner + 0.02, "{outer} {middle} {inner}");
    }
}

#[test]
fn finer_tessellation_of_the_same_leaves_changes_little() {
    let coarse = ball_tree(1500);
    let mut fine = coarse.clone();
    let mesh = &mut fine.parts[1].mesh;
    let middles: Vec<Vec3> =
        mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize]).into_iter().sum::<Vec3>() / 3.0).collect();
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(&middles);
    mesh.normals.resize(mesh.positions.len(), Vec3::Z);
    mesh.uvs.resize(mesh.positions.len(), Vec2::ZERO);
    let old = std::mem::take(&mut mesh.triangles);
    for (i, [a, b, c]) in old.into_iter().enumerate() {
        let m = first + i as u32;
        mesh.triangles.extend([[a, b, m], [b, c, m], [c, a, m]]);
    }
    let settings = ImplicitSettings { radius: Some(0.6), ..published(NormalSource::NearestVertex) };
    let difference = |weighting: Weighting, settings: ImplicitSettings| {
        let settings = ImplicitSettings { weighting, ..settings };
        let (a, b) = (bake(&coarse, &settings), bake(&fine, &settings));
        let pairs = a.ambient[1].iter().zip(&b.ambient[1]);
        pairs.map(|(a, b)| (a - b).abs()).sum::<f32>() / a.ambient[1].len() as f32
    };
    assert!(difference(Weighting::LeafArea, settings) < 0.02);
    assert!(difference(Weighting::LeafArea, ImplicitSettings { ambient: AmbientField::Depth, ..settings }) < 0.02);
    // By number, and with what suited the coarse one, the crown goes dark.
    let fixed = bake(&coarse, &ImplicitSettings { weighting: Weighting::Primitives, ..settings }).report.parameters;
    let fixed = ImplicitSettings { threshold: Some(fixed.threshold), core: Some(fixed.core), ..settings };
    let darker = difference(Weighting::Primitives, fixed);
    assert!(darker > 0.1, "{darker}");
}

#[test]
fn any_size_and_place_gives_the_same_picture() {
    let base = ball_tree(1200);
    for normals in BOTH {
        let expected = bake(&base, &with(normals));
        for (scale, offset) in [(1.0e-3 / 9.0, 0.0), (1.0e4 / 9.0, 0.0), (1.0, 1.0e6)] {
            let mut moved = base.clone();
            moved.scale(scale);
            let positions = moved.parts.iter_mut().flat_map(|part| part.mesh.positions.iter_mut());
            positions.for_each(|p| *p += Vec3::splat(offset));
            let baked = bake(&moved, &with(normals));
            assert!(baked.report.no_surface.is_none() && baked.surface.is_some());
            let mean =
                |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>() / a.len().max(1) as f32;
            // A million metres away a coordinate is a multiple of 6 cm: leaves of 10 cm are hardly leaves any more.
            let allowed = if offset > 0.0 { 0.1 } else { 0.01 };
            assert!(mean(&baked.ambient[1], &expected.ambient[1]) < allowed, "{scale} {offset}");
        }
    }
}

#[test]
fn nothing_few_and_flat() {
    let triangle = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    let one = part(PartKind::Foliage, triangle.clone(), vec![[0, 1, 2]]);
    let wood = part(PartKind::Wood, triangle.clone(), vec![[0, 1, 2]]);
    let flat: Vec<Vec3> = (0..300).map(|i| Vec3::new((i % 20) as f32, 5.0, (i / 20) as f32)).collect();
    let flat = part(PartKind::Foliage, flat, (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
    let flat = {
        let mut flat = flat;
        for (i, p) in flat.mesh.positions.iter_mut().enumerate() {
            p.z += (i % 3 % 2) as f32;
        }
        flat
    };
    for normals in BOTH {
        let settings = with(normals);
        for empty in [plant(vec![]), plant(vec![wood.clone()]), plant(vec![part(PartKind::Foliage, vec![], vec![])])] {
            let baked = bake(&empty, &published(normals));
            assert_eq!(baked.report.no_surface, Some(NoSurface::NoField));
            assert!(baked.surface.is_none() && baked.ambient.iter().flatten().all(|k| *k == 1.0));
            // Wood shades itself all the same.
            assert_eq!(bake(&empty, &settings).report.no_surface, Some(NoSurface::NoField));
        }
        let baked = bake(&plant(vec![one.clone()]), &settings);
        assert!(baked.report.no_surface.is_none() && baked.surface.is_some(), "{:?}", baked.report);
        let baked = bake(&plant(vec![flat.clone()]), &settings);
        assert!(baked.report.no_surface.is_none() && baked.surface.is_some(), "{:?}", baked.report);
        // Duplicates and triangles without area beside good ones; all without area.
        let mut broken = one.clone();
        broken.mesh.triangles.extend([[0, 1, 2], [0, 0, 1], [1, 1, 1], [0, 1, 7]]);
        broken.mesh.positions.push(Vec3::NAN);
        broken.mesh.normals.push(Vec3::NAN);
        broken.mesh.uvs.push(Vec2::NAN);
        broken.mesh.triangles.push([0, 1, 3]);
        let baked = bake(&plant(vec![broken]), &settings);
        assert!(baked.surface.is_some() && baked.report.generators == 4);
        let none = part(PartKind::Foliage, vec![Vec3::ONE; 3], vec![[0, 1, 2]; 5]);
        assert_eq!(bake(&plant(vec![none]), &settings).report.no_surface, Some(NoSurface::NoField));
        let nowhere = part(PartKind::Foliage, vec![Vec3::NAN; 3], vec![[0, 1, 2]]);
        assert_eq!(bake(&plant(vec![nowhere]), &settings).report.no_surface, Some(NoSurface::NoField));
        // Lists of unequal length: a mesh that breaks its own rules.
        let mut short = one.clone();
        short.mesh.normals.clear();
        bake(&plant(vec![short]), &settings);
        for far in [1.0e15f32, 1.0e30, f32::MAX] {
            let far = part(PartKind::Foliage, triangle.iter().map(|p| *p * far).collect(), vec![[0, 1, 2]]);
            bake(&plant(vec![far, one.clone()]), &settings);
        }
    }
}

#[test]
fn copies_in_place_and_strays_without_area_change_nothing() {
    let tree = ball_tree(900);
    let mut doubled = tree.clone();
    let mesh = &mut doubled.parts[1].mesh;
    let back: Vec<[u32; 3]> = mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    mesh.triangles.extend(back);
    let mut stray = tree.clone();
    let mesh = &mut stray.parts[1].mesh;
    mesh.positions.push(Vec3::splat(1.0e8));
    mesh.normals.push(Vec3::Z);
    mesh.uvs.push(Vec2::ZERO);
    mesh.triangles.push([mesh.positions.len() as u32 - 1; 3]);
    for settings in BOTH.into_iter().flat_map(|normals| [with(normals), published(normals)]) {
        let expected = bake(&tree, &settings);
        for (name, changed) in [("doubled", &doubled), ("stray", &stray)] {
            let baked = bake(changed, &settings);
            let (a, b) = (baked.report.parameters, expected.report.parameters);
            assert!((a.radius / b.radius - 1.0).abs() < 1e-4, "{name}: {a:?} {b:?}");
            assert!((a.threshold / b.threshold - 1.0).abs() < 0.02, "{name}: {a:?} {b:?}");
            assert_eq!(baked.report.no_surface, None);
            let pairs = baked.ambient[1].iter().zip(&expected.ambient[1]);
            assert!(pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) < 0.01, "{name}");
        }
    }
}

#[test]
fn any_parameters_give_a_result_that_says_what_it_is() {
    let tree = ball_tree(800);
    let wild = [0.0, 1.0e-30, 1.0e-4, 0.05, 1.0e6, f32::INFINITY, f32::NAN, -1.0];
    for normals in BOTH {
        for radius in wild {
            let settings = ImplicitSettings { radius: Some(radius), resolution: 2.0, ..with(normals) };
            bake(&tree, &settings);
        }
        for threshold in wild {
            let settings = ImplicitSettings { threshold: Some(threshold), core: Some(threshold), ..published(normals) };
            let baked = bake(&tree, &settings);
            if threshold == 1.0e6 {
                assert!(matches!(baked.report.no_surface, Some(NoSurface::Threshold { .. })));
                assert!(baked.report.no_surface.is_some_and(|reason| reason.to_string().contains("1000000")));
                assert!(baked.surface.is_none());
                assert!(baked.normals[1].iter().all(|n| *n == Vec3::Z), "its own normals");
                assert!(baked.ambient.iter().flatten().all(|k| *k == 1.0));
            }
        }
        let zero = bake(&tree, &ImplicitSettings { radius: Some(0.0), ..with(normals) });
        assert_eq!(zero.report.no_surface, Some(NoSurface::NoField));
        let own = bake(&tree, &ImplicitSettings { own_normal: 1.0, ..with(normals) });
        assert!(own.normals[1].iter().all(|n| *n == Vec3::Z), "its own normals");
    }
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let tree = grow(&GrowParameters::broadleaf(), 3, 12_000).expect("a tree");
    let on = |threads: usize, settings: &ImplicitSettings| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| bake(&tree, settings))
    };
    for normals in BOTH {
        let settings = ImplicitSettings { generator_share: 0.4, surface_share: Some(0.169), ..with(normals) };
        assert_eq!(on(1, &settings), on(3, &settings));
    }
}

/// A grown tree with about as much foliage as the trees of [Luft 2006, table 1] (56,952 and 56,250 triangles).
fn tree_of_table_1(species: GrowParameters) -> Plant {
    let species = GrowParameters { wood_share: 0.3, ..species };
    let tree = grow(&species, 1, 81_400).expect("a tree");
    let leaves = tree.triangle_count(PartKind::Foliage);
    assert!((56_000..58_000).contains(&leaves), "{leaves}");
    tree
}

/// The farthest that a vertex or the middle of a triangle of `from` lies from the mesh `to`, at most `limit`.
fn farthest(from: &SurfaceMesh, to: &SurfaceMesh, limit: f32) -> f32 {
    // Triangles by the cells of a lattice that their boxes touch, one `limit` larger.
    let cell = |p: Vec3| (p / limit).floor().as_ivec3();
    let mut lattice: HashMap<IVec3, Vec<[Vec3; 3]>> = HashMap::new();
    for triangle in &to.triangles {
        let corners = triangle.map(|corner| to.positions[corner as usize]);
        let low = cell(corners.into_iter().reduce(Vec3::min).expect("three corners") - limit);
        let high = cell(corners.into_iter().reduce(Vec3::max).expect("three corners") + limit);
        for (x, y, z) in
            (low.x..=high.x).flat_map(|x| (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| (x, y, z))))
        {
            lattice.entry(IVec3::new(x, y, z)).or_default().push(corners);
        }
    }
    let middles =
        from.triangles.iter().map(|t| t.iter().map(|&corner| from.positions[corner as usize]).sum::<Vec3>() / 3.0);
    let places: Vec<Vec3> = from.positions.iter().copied().chain(middles).collect();
    let distance = |place: Vec3| {
        let near = lattice.get(&cell(place)).map_or(&[][..], Vec::as_slice);
        near.iter().map(|corners| nearest_on(place, *corners).distance(place)).fold(limit, f32::min)
    };
    places.into_iter().map(distance).fold(0.0, f32::max)
}

/// The point of a triangle that is nearest to `p` [Ericson 2005, "Real-Time Collision Detection", 5.1.5].
fn nearest_on(p: Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    let on_edge = |from: Vec3, to: Vec3| {
        let edge = to - from;
        from + edge * ((p - from).dot(edge) / edge.length_squared().max(1e-30)).clamp(0.0, 1.0)
    };
    let normal = (b - a).cross(c - a);
    let foot = p - normal * ((p - a).dot(normal) / normal.length_squared().max(1e-30));
    let inside = [(a, b), (b, c), (c, a)].iter().all(|&(from, to)| (to - from).cross(foot - from).dot(normal) >= 0.0);
    if inside {
        return foot;
    }
    let edges = [on_edge(a, b), on_edge(b, c), on_edge(c, a)];
    edges.into_iter().min_by(|a, b| a.distance(p).total_cmp(&b.distance(p))).expect("three edges")
}

#[test]
fn the_shares_of_table_1_are_reached_and_stay_close_to_the_surface() {
    for species in [GrowParameters::broadleaf(), GrowParameters::conifer()] {
        let tree = tree_of_table_1(species);
        let leaves = tree.triangle_count(PartKind::Foliage) as f32;
        for (share, room) in [(COARSE_SHARE, 0.003), (FINE_SHARE, 0.005)] {
            let settings = ImplicitSettings { surface_share: Some(share), ..ImplicitSettings::default() };
            let baked = bake(&tree, &settings);
            let surface = baked.surface.expect("a surface");
            let reached = surface.triangles.len() as f32 / leaves;
            assert!((reached - share).abs() <= room, "{}: {reached} for {share}", tree.name);

            // The surface that was simplified, or one with cells of the same size.
            let radius = baked.report.parameters.radius;
            let settings = ImplicitSettings { resolution: radius / baked.report.cell, ..ImplicitSettings::default() };
            let extracted = bake(&tree, &settings);
            assert!((extracted.report.cell / baked.report.cell - 1.0).abs() < 1e-3);
            let extracted = extracted.surface.expect("a surface");
            assert!(extracted.triangles.len() >= surface.triangles.len());
            let limit = 0.5 * radius;
            let apart = farthest(&surface, &extracted, limit).max(farthest(&extracted, &surface, limit));
            println!(
                "{}: {share}: {} -> {} triangles, {:.3} radii apart",
                tree.name,
                extracted.triangles.len(),
                surface.triangles.len(),
                apart / radius
            );
            assert!(apart <= 0.2 * radius, "{}: {share}: {} radii", tree.name, apart / radius);
        }
    }
}

#[test]
fn a_small_tree_is_darkened_by_its_tall_neighbour() {
    let tree = ball_tree(2000);
    let small = StandPlant { plant: &tree, position: DVec3::new(4.0e6, 10.0, -3.0e6), yaw: 0.0, scale: 0.5 };
    // The small crown's middle is 3 m up, its radius 1.5 m; the tall one's crown covers one side of it.
    let tall = StandPlant { position: small.position + DVec3::new(3.0, -2.0, 0.0), yaw: 2.0, scale: 1.0, ..small };
    for normals in BOTH {
        let settings = with(normals);
        let (alone, both) = (bake_implicit_stand(&[small], &settings), bake_implicit_stand(&[small, tall], &settings));
        assert!(alone.surface.is_some() && both.surface.as_ref().is_some_and(is_closed));
        let fixed = ImplicitSettings {
            radius: Some(both.report.parameters.radius),
            threshold: Some(both.report.parameters.threshold),
            core: Some(both.report.parameters.core),
            ambient_radius: Some(both.report.parameters.ambient_radius),
            ..settings
        };
        let alone = bake_implicit_stand(&[small], &fixed);
        let pairs = alone.plants[0].ambient.iter().flatten().zip(both.plants[0].ambient.iter().flatten());
        let darkened = pairs.clone().filter(|(alone, both)| *both < &(*alone - 0.05)).count();
        assert!(darkened > 50, "{darkened}");
        // Large radii have fewer generators, others for two trees than for one: 1 %.
        assert!(pairs.clone().all(|(alone, both)| *both <= alone + 0.01));

        // A single plant in a stand is the plant itself, in its own frame.
        let turned = StandPlant { yaw: 1.0, scale: 1.0, ..small };
        let (stand, single) = (bake_implicit_stand(&[turned], &settings), bake_implicit(&tree, &settings));
        let median = |mut list: Vec<f32>| {
            list.sort_by(f32::total_cmp);
            list[list.len() / 2]
        };
        let turned_back = stand.plants[0].normals[1].iter().zip(&single.normals[1]);
        assert!(median(turned_back.map(|(a, b)| a.dot(*b)).collect()) > 0.97);
        let wood = stand.plants[0].normals[0].iter();
        assert!(wood.clone().all(|n| n.dot(Vec3::Z) > 0.9999), "{:?}", Quat::from_rotation_y(1.0) * Vec3::Z);
    }
    let broken = StandPlant { position: DVec3::NAN, ..small };
    let stand = bake_implicit_stand(&[broken, small], &ImplicitSettings::default());
    assert!(stand.plants.iter().flat_map(|p| p.normals.iter().flatten()).all(|n| n.is_normalized()));
    assert_eq!(stand.plants.len(), 2);
    let empty = bake_implicit_stand(&[], &ImplicitSettings::default());
    assert!(empty.plants.is_empty() && empty.report.no_surface == Some(NoSurface::NoField));
}
