//! The terrain room: the surface, the readers, the tiles and the sun's horizon, on noise, on planes and on real data.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use canopy::terrain::sun_horizon::{HorizonGrid, sun_horizon};
use canopy::terrain::tiles::{TILE_QUADS, Tile, TileSettings, TileTree, TileVertex};
use canopy::terrain::{
    CoordinateSystem, Crop, HeightField, ImageScale, NoiseKind, NoiseTerrain, ReadOptions, Surroundings, Terrain,
    TerrainError, Warning, read_terrain,
};
use glam::{DVec2, DVec3};
use proptest::prelude::*;
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

use crate::support::data::data;

fn ridges(columns: usize, rows: usize, spacing: f64) -> HeightField {
    NoiseTerrain { columns, rows, spacing, kind: NoiseKind::Ridged, amplitude: 250.0, ..NoiseTerrain::default() }
        .height_field()
        .unwrap()
}

fn terrain_of(columns: usize, rows: usize, spacing: DVec2, height: impl Fn(f64, f64) -> f64) -> Terrain {
    let flat = HeightField::new(columns, rows, spacing, vec![0.0; columns * rows]).unwrap();
    let heights = (0..columns * rows)
        .map(|at| flat.position(at % columns, at / columns))
        .map(|place| height(place.x, place.y) as f32)
        .collect();
    Terrain::new(HeightField::new(columns, rows, spacing, heights).unwrap(), None, Surroundings::Mirror)
}

// ---------------------------------------------------------------- the surface

#[test]
fn the_surface_passes_through_its_samples() {
    for surroundings in [Surroundings::Mirror, Surroundings::Border] {
        let field = ridges(37, 29, 12.5);
        let terrain = Terrain::new(field.clone(), None, surroundings);
        for row in 0..field.rows() {
            for column in 0..field.columns() {
                let place = field.position(column, row);
                let sample = f64::from(field.heights()[row * field.columns() + column]);
                assert!((terrain.height(place.x, place.y) - sample).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn height_is_the_mirror_image_far_from_the_border() {
    let terrain = Terrain::new(ridges(60, 50, 10.0), None, Surroundings::Mirror);
    let half = terrain.extent() * 0.5;
    for step in 0..40 {
        let inside = DVec2::new(half.x - 100.0 - 10.0 * f64::from(step), 3.7 * f64::from(step) - 70.0);
        let image = DVec2::new(2.0 * half.x - inside.x, inside.y);
        assert!((terrain.height(inside.x, inside.y) - terrain.height(image.x, image.y)).abs() < 1e-4);
        let far = DVec2::new(inside.x + 40.0 * half.x, inside.y);
        assert!((terrain.height(inside.x, inside.y) - terrain.height(far.x, far.y)).abs() < 1e-4);
    }
    let level = Terrain::new(ridges(60, 50, 10.0), None, Surroundings::Border);
    let edge = level.height(half.x, 20.0);
    assert!((level.height(half.x + 5000.0, 20.0) - edge).abs() < 1e-4);
}

#[test]
fn the_far_images_repeat_to_the_last_sample() {
    // Across where stored samples give way to folded ones, on both axes at once.
    let terrain = Terrain::new(ridges(40, 36, 10.0), None, Surroundings::Mirror);
    let half = terrain.extent() * 0.5;
    for i in 0..4000 {
        let place = (DVec2::new(spread(i, 0), spread(i, 1)) - 0.5) * 6.0 * half;
        for step in [DVec2::new(1e-6, 0.0), DVec2::new(0.0, 1e-6)] {
            let snapped = (place / 10.0).round() * 10.0 + 5.0 * DVec2::new(1.0, 1.0);
            let (a, b) = (snapped - step, snapped + step);
            assert!((terrain.height(a.x, a.y) - terrain.height(b.x, b.y)).abs() < 1e-3, "{snapped}");
        }
    }
}

#[test]
fn contains_is_the_field_alone() {
    let terrain = terrain_of(11, 6, DVec2::new(10.0, 20.0), |_, _| 0.0);
    assert_eq!(terrain.extent(), DVec2::splat(100.0));
    assert!(terrain.contains(50.0, -50.0) && terrain.contains(0.0, 0.0));
    assert!(!terrain.contains(50.1, 0.0) && !terrain.contains(0.0, -50.1) && !terrain.contains(f64::NAN, 0.0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn planes_are_reproduced_exactly(
        columns in 2usize..40, rows in 2usize..40, dx in 0.5f64..90.0, dz in 0.5f64..90.0,
        a in -1.5f64..1.5, b in -1.5f64..1.5, u in -0.5f64..0.5, v in -0.5f64..0.5,
    ) {
        let terrain = terrain_of(columns, rows, DVec2::new(dx, dz), |x, z| 500.0 + a * x + b * z);
        let place = terrain.extent() * DVec2::new(u, v);
        let (height, gradient) = terrain.height_and_gradient(place.x, place.y);
        // The samples themselves are rounded to f32.
        prop_assert!((height - (500.0 + a * place.x + b * place.y)).abs() < 2e-3, "{height}");
        prop_assert!((gradient - DVec2::new(a, b)).length() < 4e-3 / dx.min(dz), "{gradient}");
    }

    #[test]
    fn the_surface_is_smooth_and_its_gradient_is_its_own(
        seed in 0u32..1000, x in -3000.0f64..3000.0, z in -3000.0f64..3000.0, border in any::<bool>(),
    ) {
        let land = NoiseTerrain { columns: 40, rows: 33, seed, spacing: 25.0, wavelength: 300.0, ..NoiseTerrain::default() };
        let surroundings = if border { Surroundings::Border } else { Surroundings::Mirror };
        let terrain = Terrain::new(land.height_field().unwrap(), None, surroundings);
        // Lines of samples are where a piecewise surface would break: step onto the nearest one as well.
        let snapped = ((x / 25.0 - 0.5).round() + 0.5) * 25.0;
        for x in [x, snapped] {
            let e = 1e-4;
            let (_, gradient) = terrain.height_and_gradient(x, z);
            let across = (terrain.height(x + e, z) - terrain.height(x - e, z)) / (2.0 * e);
            let down = (terrain.height(x, z + e) - terrain.height(x, z - e)) / (2.0 * e);
            prop_assert!((gradient - DVec2::new(across, down)).length() < 1e-4, "{gradient} {across} {down}");
            let (_, before) = terrain.height_and_gradient(x - 1e-7, z);
            let (_, behind) = terrain.height_and_gradient(x + 1e-7, z);
            prop_assert!((before - behind).length() < 1e-6);
        }
        let normal = terrain.normal(x, z);
        prop_assert!((normal.length() - 1.0).abs() < 1e-6 && normal.y > 0.0);
        prop_assert!((terrain.slope(x, z) - normal.y.acos()).abs() < 2e-3);
    }

    #[test]
    fn everything_is_finite_everywhere(
        columns in 2usize..6, rows in 2usize..6, x in -1.0e6f64..1.0e6, z in -1.0e6f64..1.0e6, seed in 0u32..100,
        odd in prop::sample::select(vec![0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, 1e300, -1e17]),
    ) {
        let land = NoiseTerrain { columns, rows, seed, ..NoiseTerrain::default() };
        for surroundings in [Surroundings::Mirror, Surroundings::Border] {
            let terrain = Terrain::new(land.height_field().unwrap(), None, surroundings);
            let (low, high) = terrain.min_max_height();
            for (x, z) in [(x, z), (odd, z), (x, odd), (odd, odd)] {
                let height = terrain.height(x, z) as f32;
                prop_assert!(height.is_finite() && (low..=high).contains(&height), "{height}");
                prop_assert!(terrain.normal(x, z).is_finite() && terrain.slope(x, z).is_finite());
            }
        }
    }

    #[test]
    fn bounds_hold_over_any_rectangle(
        seed in 0u32..1000, x in -4000.0f64..4000.0, z in -4000.0f64..4000.0, w in 0.0f64..900.0, h in 0.0f64..900.0,
        u in 0.0f64..1.0, v in 0.0f64..1.0, border in any::<bool>(),
    ) {
        let land = NoiseTerrain { columns: 40, rows: 23, seed, spacing: 25.0, wavelength: 200.0, ..NoiseTerrain::default() };
        let surroundings = if border { Surroundings::Border } else { Surroundings::Mirror };
        let terrain = Terrain::new(land.height_field().unwrap(), None, surroundings);
        let (low, high) = terrain.height_bounds(DVec2::new(x, z), DVec2::new(x + w, z + h));
        let height = terrain.height(x + u * w, z + v * h) as f32;
        prop_assert!((low..=high).contains(&height), "{height} not in {low}..{high}");
        let (lowest, highest) = terrain.min_max_height();
        prop_assert!(lowest <= low && high <= highest);
    }
}

// ---------------------------------------------------------------- the tiles

/// The drawn ground: the mesh of a tile with its morph, at any place of the tile.
struct Drawn<'a> {
    terrain: &'a Terrain,
    tree: &'a TileTree,
    camera: DVec3,
    clearance: f64,
    meshes: HashMap<(u32, i32, i32), Vec<TileVertex>>,
}

impl Drawn<'_> {
    fn height(&mut self, tile: &Tile, place: DVec2) -> f64 {
        let (origin, spacing) = (self.tree.tile_origin(tile.level, tile.ix, tile.iz), self.tree.spacing(tile.level));
        let mesh = self
            .meshes
            .entry((tile.level, tile.ix, tile.iz))
            .or_insert_with(|| self.tree.tile_vertices(self.terrain, tile.level, tile.ix, tile.iz));
        let inside = ((place - origin) / spacing).clamp(DVec2::ZERO, DVec2::splat(TILE_QUADS as f64));
        let quad = inside.floor().min(DVec2::splat((TILE_QUADS - 1) as f64));
        let (u, v) = ((inside - quad).x, (inside - quad).y);
        let corner = |dx: f64, dz: f64| {
            let index = quad + DVec2::new(dx, dz);
            let vertex = mesh[index.y as usize * (TILE_QUADS + 1) + index.x as usize];
            let morph = tile.morph(origin + index * spacing, self.camera, self.clearance);
            f64::from(vertex.height) * (1.0 - morph) + f64::from(vertex.parent_height) * morph
        };
        let (nw, se) = (corner(0.0, 0.0), corner(1.0, 1.0));
        if u >= v {
            let ne = corner(1.0, 0.0);
            nw + u * (ne - nw) + v * (se - ne)
        } else {
            let sw = corner(0.0, 1.0);
            nw + v * (sw - nw) + u * (se - sw)
        }
    }

    fn covers(&self, tile: &Tile, place: DVec2) -> bool {
        let origin = self.tree.tile_origin(tile.level, tile.ix, tile.iz);
        place.cmpge(origin).all() && place.cmple(origin + self.tree.tile_width(tile.level)).all()
    }
}

const FOCAL: f64 = 900.0;

fn tile_scene(seed: u32) -> (Terrain, TileTree) {
    let land =
        NoiseTerrain { columns: 97, rows: 81, spacing: 40.0, seed, kind: NoiseKind::Ridged, ..NoiseTerrain::default() };
    let terrain = Terrain::new(land.height_field().unwrap(), None, Surroundings::Mirror);
    let settings = TileSettings { finest_spacing: 2.0, max_distance: 9000.0, pixel_error: 0.5, coverage: 1.0 };
    let tree = TileTree::new(&terrain, &settings).unwrap();
    (terrain, tree)
}

/// Numbers in 0..1 without a generator: the golden ratio's low-discrepancy sequence.
fn spread(index: usize, axis: usize) -> f64 {
    let step = [0.618_033_988_749_894_9, 0.754_877_666_246_692_7, 0.569_840_290_998_053_3][axis];
    (0.5 + step * (index + 1) as f64).fract()
}

fn cameras(terrain: &Terrain) -> Vec<DVec3> {
    (0..8)
        .map(|i| {
            let place = (DVec2::new(spread(i, 0), spread(i, 1)) - 0.5) * terrain.extent() * 1.6;
            let above = [1.7, 12.0, 80.0, 400.0][i % 4];
            DVec3::new(place.x, terrain.height(place.x, place.y) + above, place.y)
        })
        .collect()
}

#[test]
fn tiles_cover_the_square_once_and_meet_without_cracks() {
    let (terrain, tree) = tile_scene(3);
    let mut levels_that_meet = 0;
    for camera in cameras(&terrain) {
        let mut tiles = Vec::new();
        let clearance = tree.select(camera, FOCAL, |_, _| true, &mut tiles);
        let mut drawn = Drawn { terrain: &terrain, tree: &tree, camera, clearance, meshes: HashMap::new() };
        for i in 0..200 {
            let place = DVec2::new(camera.x, camera.z) + (DVec2::new(spread(i, 0), spread(i, 2)) - 0.5) * 18_000.0;
            let over = tiles.iter().filter(|tile| drawn.covers(tile, place)).count();
            assert_eq!(over, 1, "{place} is drawn by {over} tiles");
        }
        for (index, tile) in tiles.iter().enumerate().step_by(5) {
            let origin = tree.tile_origin(tile.level, tile.ix, tile.iz);
            let width = tree.tile_width(tile.level);
            for k in 0..6 {
                let along = spread(7 * index + k, k % 3) * width;
                // Places on the eastern and the southern edge; the neighbour has its own idea of them.
                for place in [origin + DVec2::new(width, along), origin + DVec2::new(along, width)] {
                    for other in &tiles {
                        if other != tile && drawn.covers(other, place) {
                            let (a, b) = (drawn.height(tile, place), drawn.height(other, place));
                            assert!((a - b).abs() < 1e-3, "{tile:?} and {other:?} differ by {} m at {place}", a - b);
                            assert!(tile.level.abs_diff(other.level) <= 1);
                            levels_that_meet += usize::from(tile.level != other.level);
                        }
                    }
                }
            }
        }
    }
    assert!(levels_that_meet > 100, "the test met only {levels_that_meet} edges between levels");
}

/// Far ground once was dropped where there was no room for all tiles.
#[test]
fn too_many_tiles_become_coarser_ones_that_cover_the_square_too() {
    let (_, tree) = tile_scene(3);
    let (terrain, _) = tile_scene(3);
    for camera in cameras(&terrain) {
        let mut all = Vec::new();
        let unbounded = tree.select(camera, FOCAL, |_, _| true, &mut all);
        let mut tiles = Vec::new();
        let (clearance, factor) = tree.select_at_most(all.len(), camera, FOCAL, |_, _| true, &mut tiles);
        assert_eq!((clearance, factor, &tiles), (unbounded, 1.0, &all));
        let most = all.len() / 2;
        let (clearance, factor) = tree.select_at_most(most, camera, FOCAL, |_, _| true, &mut tiles);
        assert!(factor > 1.0 && tiles.len() <= most, "{} tiles of {}", tiles.len(), all.len());
        let drawn = Drawn { terrain: &terrain, tree: &tree, camera, clearance, meshes: HashMap::new() };
        for i in 0..300 {
            let place = DVec2::new(camera.x, camera.z) + (DVec2::new(spread(i, 0), spread(i, 2)) - 0.5) * 18_000.0;
            let over = tiles.iter().filter(|tile| drawn.covers(tile, place)).count();
            assert_eq!(over, 1, "{place} is drawn by {over} tiles");
        }
        // No error is large enough for three.
        tree.select_at_most(3, camera, FOCAL, |_, _| true, &mut tiles);
        assert_eq!(tiles.len(), 3);
    }
}

#[test]
fn the_drawn_ground_errs_by_half_a_pixel_at_most() {
    let (terrain, tree) = tile_scene(5);
    let mut largest = 0.0_f64;
    for camera in cameras(&terrain) {
        let mut tiles = Vec::new();
        let clearance = tree.select(camera, FOCAL, |_, _| true, &mut tiles);
        let mut drawn = Drawn { terrain: &terrain, tree: &tree, camera, clearance, meshes: HashMap::new() };
        for i in 0..1500 {
            let reach = 10.0 * 900.0_f64.powf(spread(i, 0));
            let (sin, cos) = (std::f64::consts::TAU * spread(i, 1)).sin_cos();
            let place = DVec2::new(camera.x, camera.z) + reach * DVec2::new(cos, sin);
            let Some(tile) = tiles.iter().find(|tile| drawn.covers(tile, place)) else { continue };
            let height = terrain.height(place.x, place.y);
            let distance = DVec3::new(place.x, height, place.y).distance(camera);
            // Nearer than this the finest level is all there is.
            if distance * 0.5 < tree.deviations()[0] * FOCAL {
                continue;
            }
            let error = (drawn.height(tile, place) - height).abs() * FOCAL / distance;
            largest = largest.max(error);
            assert!(error <= 0.5, "{error} pixels at {distance} m, level {}", tile.level);
        }
    }
    assert!(largest > 0.05, "the levels are far finer than they need be: {largest} pixels");
}

#[test]
fn selection_is_ordered_repeatable_and_culls_by_boxes_that_hold_the_mesh() {
    let (terrain, tree) = tile_scene(3);
    let camera = DVec3::new(200.0, 700.0, -300.0);
    let (mut tiles, mut again) = (Vec::new(), Vec::new());
    let boxes = std::cell::RefCell::new(Vec::new());
    let clearance = tree.select(
        camera,
        FOCAL,
        |min, max| {
            boxes.borrow_mut().push((min, max));
            true
        },
        &mut tiles,
    );
    assert_eq!(tree.select(camera, FOCAL, |_, _| true, &mut again), clearance);
    assert_eq!(tiles, again);
    let distance = |tile: &Tile| {
        let min = tree.tile_origin(tile.level, tile.ix, tile.iz);
        let ground = DVec2::new(camera.x, camera.z);
        ground.clamp(min, min + tree.tile_width(tile.level)).distance(ground)
    };
    assert!(tiles.windows(2).all(|pair| distance(&pair[0]) <= distance(&pair[1])));
    for tile in tiles.iter().step_by(7) {
        let min = tree.tile_origin(tile.level, tile.ix, tile.iz);
        let (low, high) = tree.tile_heights(tile.level, tile.ix, tile.iz);
        assert!(
            boxes
                .borrow()
                .iter()
                .any(|(a, b)| a.x == min.x && a.z == min.y && a.y == f64::from(low) && b.y == f64::from(high))
        );
        for vertex in tree.tile_vertices(&terrain, tile.level, tile.ix, tile.iz) {
            assert!((low..=high).contains(&vertex.height) && (low..=high).contains(&vertex.parent_height));
        }
    }
    // The true distance to the ground is never below the clearance.
    for i in 0..5000 {
        let place = DVec2::new(camera.x, camera.z) + (DVec2::new(spread(i, 0), spread(i, 1)) - 0.5) * 3000.0;
        assert!(DVec3::new(place.x, terrain.height(place.x, place.y), place.y).distance(camera) >= clearance);
    }
    tree.select(camera, FOCAL, |_, _| false, &mut tiles);
    assert!(tiles.is_empty());
}

#[test]
fn odd_cameras_and_flat_ground_still_give_tiles() {
    let flat = terrain_of(2, 2, DVec2::splat(1000.0), |_, _| 10.0);
    let tree = TileTree::new(&flat, &TileSettings::default()).unwrap();
    assert!(tree.deviations().iter().all(|e| *e < 1e-3));
    let mut tiles = Vec::new();
    for camera in [DVec3::NAN, DVec3::splat(1e30), DVec3::new(0.0, -500.0, 0.0), DVec3::new(0.0, 1e6, 0.0)] {
        for focal in [f64::NAN, 0.0, 1e30, 900.0] {
            let clearance = tree.select(camera, focal, |_, _| true, &mut tiles);
            assert!(clearance.is_finite() && !tiles.is_empty());
            assert!(tiles.iter().all(|tile| tile.morph_start.is_finite() && tile.morph_start < tile.morph_end));
        }
    }
    let broken = TileSettings { finest_spacing: f64::NAN, ..TileSettings::default() };
    assert!(matches!(TileTree::new(&flat, &broken), Err(TerrainError::BadParameter { .. })));
}

// ---------------------------------------------------------------- the sun's horizon

#[test]
fn the_horizon_of_a_plane_is_one_step_of_the_sun_below_it() {
    let slope = 0.3;
    let terrain = terrain_of(65, 65, DVec2::splat(20.0), |x, _| 1000.0 + slope * x);
    let grid = HorizonGrid { columns: 64, rows: 64, max_distance: 400 };
    // Sun in the east at 45 degrees; the plane rises towards it with 0.3.
    let horizon = sun_horizon(&terrain, &grid, DVec3::new(1.0, 1.0, 0.0)).unwrap();
    for row in 0..64 {
        for column in 0..60 {
            let x = ((column as f64 + 0.5) / 64.0 - 0.5) * terrain.extent().x;
            let expected = 1000.0 + slope * (x + 20.0) - 20.0;
            assert!((f64::from(horizon[row * 64 + column]) - expected).abs() < 0.05);
        }
    }
}

#[test]
fn horizons_match_a_march_towards_the_sun() {
    let terrain = Terrain::new(ridges(81, 65, 30.0), None, Surroundings::Mirror);
    let (columns, rows, reach) = (96, 80, 3000_u32);
    let cell = terrain.extent() / DVec2::new(columns as f64, rows as f64);
    for (azimuth, elevation) in [(0.3_f64, 0.1_f64), (1.2, 0.25), (2.5, 0.5), (4.0, 0.05), (5.5, 0.2)] {
        let sun = DVec3::new(azimuth.cos() * elevation.cos(), elevation.sin(), azimuth.sin() * elevation.cos());
        let horizon = sun_horizon(&terrain, &HorizonGrid { columns, rows, max_distance: reach }, sun).unwrap();
        let (mut sum, mut largest) = (0.0, 0.0_f64);
        for row in (1..rows - 1).step_by(3) {
            for column in (1..columns - 1).step_by(3) {
                let place = (DVec2::new(column as f64, row as f64) + 0.5) * cell - 0.5 * terrain.extent();
                let marched = (1..=600)
                    .map(|i| 25.0 + 5.0 * f64::from(i))
                    .map(|s| {
                        terrain.height(place.x + s * azimuth.cos(), place.y + s * azimuth.sin()) - s * elevation.tan()
                    })
                    .fold(f64::MIN, f64::max);
                let error = (f64::from(horizon[row * columns + column]) - marched).abs();
                sum += error;
                largest = largest.max(error);
            }
        }
        let mean = sum / ((columns / 3) * (rows / 3)) as f64;
        // The relief is 350 m; between steps of a cell (30 m) crests are missed by a few metres.
        assert!(
            mean < 4.0 && largest < 40.0,
            "azimuth {azimuth}, elevation {elevation}: mean {mean}, largest {largest}"
        );
    }
}

#[test]
fn horizons_are_finite_for_every_sun_and_rise_as_it_sets() {
    let terrain = Terrain::new(ridges(33, 33, 50.0), None, Surroundings::Mirror);
    let grid = HorizonGrid { columns: 24, rows: 20, max_distance: 2000 };
    let mut before = f64::MIN;
    for elevation in [1.57, 1.2, 0.4, 0.05, 0.0, -0.05, -0.5, -1.57] {
        let sun = DVec3::new(0.6 * f64::cos(elevation), f64::sin(elevation), 0.8 * f64::cos(elevation));
        let horizon = sun_horizon(&terrain, &grid, sun).unwrap();
        assert!(horizon.len() == 480 && horizon.iter().all(|h| h.is_finite()));
        let mean = horizon.iter().map(|h| f64::from(*h)).sum::<f64>() / 480.0;
        assert!(mean >= before);
        before = mean;
    }
    for sun in [DVec3::ZERO, DVec3::NAN, DVec3::Y, DVec3::NEG_Y, DVec3::X, DVec3::new(1e-300, 0.0, 0.0)] {
        assert!(sun_horizon(&terrain, &grid, sun).unwrap().iter().all(|h| h.is_finite()));
    }
    for (columns, rows) in [(1, 1), (1, 9), (9, 1)] {
        let grid = HorizonGrid { columns, rows, max_distance: 0 };
        assert_eq!(sun_horizon(&terrain, &grid, DVec3::new(0.4, 0.2, 0.9)).unwrap().len(), columns * rows);
    }
    let none = HorizonGrid { columns: 0, rows: 4, max_distance: 10 };
    assert!(matches!(sun_horizon(&terrain, &none, DVec3::Y), Err(TerrainError::TooSmall { .. })));
}

// ---------------------------------------------------------------- the readers

fn write(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    path
}

fn read(path: &Path) -> Result<(Terrain, Vec<Warning>), TerrainError> {
    read_terrain(path, &ReadOptions::default())
}

/// What a GeoTIFF of the tests says about its place.
struct Place {
    scale: [f64; 3],
    tie: [f64; 6],
    keys: Vec<u16>,
    missing: Option<&'static str>,
}

impl Place {
    fn new(scale: f64, west: f64, north: f64, keys: &[[u16; 4]]) -> Self {
        let mut directory = vec![1, 1, 0, keys.len() as u16];
        directory.extend(keys.iter().flatten());
        Self { scale: [scale, scale, 0.0], tie: [0.0, 0.0, 0.0, west, north, 0.0], keys: directory, missing: None }
    }
}

const GEOGRAPHIC: [[u16; 4]; 3] = [[1024, 0, 1, 2], [1025, 0, 1, 1], [2048, 0, 1, 4326]];

fn geotiff<C: colortype::ColorType>(columns: u32, rows: u32, samples: &[C::Inner], place: &Place) -> Vec<u8>
where
    [C::Inner]: tiff::encoder::TiffValue,
{
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    let mut image = encoder.new_image::<C>(columns, rows).unwrap();
    image.encoder().write_tag(Tag::ModelPixelScaleTag, &place.scale[..]).unwrap();
    image.encoder().write_tag(Tag::ModelTiepointTag, &place.tie[..]).unwrap();
    if place.keys.len() > 4 {
        image.encoder().write_tag(Tag::GeoKeyDirectoryTag, &place.keys[..]).unwrap();
    }
    if let Some(missing) = place.missing {
        image.encoder().write_tag(Tag::GdalNodata, missing).unwrap();
    }
    image.write_data(samples).unwrap();
    bytes.into_inner()
}

#[test]
fn geotiffs_of_many_kinds_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let numbers: Vec<i16> = (0..12 * 9).map(|i| 100 + 3 * (i % 12) - 2 * (i / 12)).collect();
    let heights: Vec<f32> = numbers.iter().map(|n| f32::from(*n)).collect();

    let place = Place::new(0.01, 10.0, 50.0, &GEOGRAPHIC);
    let path = write(folder.path(), "degrees.tif", &geotiff::<colortype::GrayI16>(12, 9, &numbers, &place));
    let (terrain, warnings) = read(&path).unwrap();
    assert!(warnings.is_empty());
    assert_eq!(terrain.field().heights(), heights);
    let reference = terrain.reference().unwrap();
    // PixelIsArea: the outermost samples lie half a cell inside.
    let (latitude, longitude) = reference.latitude_longitude().unwrap();
    assert!((latitude - 49.955).abs() < 1e-9 && (longitude - 10.06).abs() < 1e-9);
    let spacing = terrain.field().spacing();
    assert!((spacing.x - 717.4).abs() < 1.0 && (spacing.y - 1112.2).abs() < 1.0, "{spacing}");
    let corner = reference.to_local(10.005, 49.995);
    assert!((corner - terrain.field().position(0, 0)).length() < 1e-6);
    assert!((terrain.height(corner.x, corner.y) - 100.0).abs() < 1e-6);

    // UTM metres, points instead of cells, floats.
    let utm = [[1024, 0, 1, 1], [1025, 0, 1, 2], [3072, 0, 1, 32617], [3076, 0, 1, 9001]];
    let place = Place::new(30.0, 630_084.0, 4_833_438.0, &utm);
    let floats: Vec<f64> = heights.iter().map(|h| f64::from(*h)).collect();
    let path = write(folder.path(), "utm.tif", &geotiff::<colortype::Gray64Float>(12, 9, &floats, &place));
    let (terrain, warnings) = read(&path).unwrap();
    assert!(warnings.is_empty());
    assert_eq!(terrain.field().spacing(), DVec2::splat(30.0));
    assert_eq!(terrain.reference().unwrap().system(), CoordinateSystem::Utm { zone: 17, south: false });
    let (latitude, longitude) = terrain.reference().unwrap().latitude_longitude().unwrap();
    assert!((latitude - 43.6425).abs() < 0.01 && (longitude + 79.387).abs() < 0.01);
    assert!(
        (terrain.reference().unwrap().to_local(630_084.0, 4_833_438.0) - terrain.field().position(0, 0)).length()
            < 1e-6
    );

    // A state plane in US survey feet, heights in feet.
    let feet = [[1024, 0, 1, 1], [3072, 0, 1, 2274], [3076, 0, 1, 9003], [4099, 0, 1, 9002]];
    let place = Place::new(100.0, 0.0, 0.0, &feet);
    let path = write(folder.path(), "feet.tif", &geotiff::<colortype::Gray32Float>(12, 9, &heights, &place));
    let (terrain, warnings) = read(&path).unwrap();
    assert_eq!(warnings, []);
    assert!((terrain.field().spacing().x - 30.480_06).abs() < 1e-4);
    assert!((terrain.field().heights()[0] - 30.48).abs() < 1e-4);
    // The false origin of Tennessee lies south-west of the state.
    let (latitude, longitude) = terrain.reference().unwrap().latitude_longitude().unwrap();
    assert!((34.0..34.6).contains(&latitude) && (-92.9..-92.0).contains(&longitude), "{latitude}, {longitude}");
}

#[test]
fn a_crop_keeps_what_it_names() {
    let folder = tempfile::tempdir().unwrap();
    let numbers: Vec<u16> = (0..20 * 10).map(|i| (1000 + i) as u16).collect();
    let local = [[1024, 0, 1, 1], [1025, 0, 1, 2], [3072, 0, 1, 32631]];
    let path = write(
        folder.path(),
        "grid.tif",
        &geotiff::<colortype::Gray16>(20, 10, &numbers, &Place::new(10.0, 500_000.0, 5_000_000.0, &local)),
    );
    let crop = Crop { west: 500_030.0, south: 4_999_938.0, east: 500_071.0, north: 4_999_970.0 };
    let options = ReadOptions { crop: Some(crop), ..ReadOptions::default() };
    let (terrain, _) = read_terrain(&path, &options).unwrap();
    assert_eq!((terrain.field().columns(), terrain.field().rows()), (5, 4));
    assert_eq!(terrain.field().heights()[0], 1063.0);
    assert_eq!(terrain.field().heights()[19], 1127.0);
    assert_eq!(terrain.reference().unwrap().centre(), DVec2::new(500_050.0, 4_999_955.0));
    for (west, east) in [(500_030.0, 500_031.0), (600_000.0, 700_000.0), (f64::NAN, 500_100.0), (500_100.0, 500_000.0)]
    {
        let options = ReadOptions { crop: Some(Crop { west, east, ..crop }), ..ReadOptions::default() };
        let message = read_terrain(&path, &options).unwrap_err().to_string();
        assert!(message.contains("the file covers west 500000"), "{message}");
    }
}

#[test]
fn holes_are_filled_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let mut heights: Vec<f32> = (0..30 * 30).map(|i| 200.0 + (i % 30) as f32).collect();
    heights[10 * 30 + 10] = -9999.0;
    heights[10 * 30 + 11] = f32::NAN;
    heights[20 * 30 + 5] = 3.0e38;
    let mut place = Place::new(0.001, 10.0, 50.0, &GEOGRAPHIC);
    place.missing = Some("-9999 ");
    let path = write(folder.path(), "holes.tif", &geotiff::<colortype::Gray32Float>(30, 30, &heights, &place));
    let (terrain, warnings) = read(&path).unwrap();
    assert_eq!(warnings, [Warning::ImplausibleHeights { count: 1 }, Warning::HolesFilled { filled: 3, total: 900 }]);
    for (row, column) in [(10, 10), (10, 11), (20, 5)] {
        assert!((terrain.field().heights()[row * 30 + column] - (200.0 + column as f32)).abs() < 0.1);
    }
    let empty = vec![-9999.0_f32; 900];
    let path = write(folder.path(), "empty.tif", &geotiff::<colortype::Gray32Float>(30, 30, &empty, &place));
    assert!(matches!(read(&path), Err(TerrainError::OnlyNoData { samples: 900, .. })));
}

#[test]
fn geotiffs_that_cannot_be_placed_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let numbers = vec![5_i16; 9];
    let check = |name: &str, place: &Place, says: &str| {
        let path = write(folder.path(), name, &geotiff::<colortype::GrayI16>(3, 3, &numbers, place));
        let message = read(&path).unwrap_err().to_string();
        assert!(message.contains(says), "{name}: {message}");
    };
    check("none.tif", &Place::new(1.0, 0.0, 0.0, &[]), "unknown coordinate system");
    check("geocentric.tif", &Place::new(1.0, 0.0, 0.0, &[[1024, 0, 1, 3]]), "unknown coordinate system");
    check(
        "unit.tif",
        &Place::new(1.0, 0.0, 0.0, &[[1024, 0, 1, 1], [3072, 0, 1, 2000], [3076, 0, 1, 9999]]),
        "gdalwarp",
    );
    check("grads.tif", &Place::new(0.1, 0.0, 0.0, &[[1024, 0, 1, 2], [2054, 0, 1, 9105]]), "not degrees");
    check("pole.tif", &Place::new(0.1, 0.0, 90.0, &GEOGRAPHIC), "latitude");
    check("scale.tif", &Place::new(f64::NAN, 0.0, 0.0, &GEOGRAPHIC), "gdal_edit");
    let stated = ReadOptions { coordinate_system: Some(CoordinateSystem::Local), ..ReadOptions::default() };
    assert!(read_terrain(&folder.path().join("none.tif"), &stated).is_ok());
    for (columns, rows) in [(1, 9), (9, 1)] {
        let bytes = geotiff::<colortype::GrayI16>(columns, rows, &numbers, &Place::new(0.1, 0.0, 0.0, &GEOGRAPHIC));
        let path = write(folder.path(), "thin.tif", &bytes);
        assert!(matches!(read(&path), Err(TerrainError::TooSmall { .. })));
    }
    let colours = vec![0_u8; 27];
    let bytes = geotiff::<colortype::RGB8>(3, 3, &colours, &Place::new(0.1, 0.0, 0.0, &GEOGRAPHIC));
    assert!(read(&write(folder.path(), "colour.tif", &bytes)).unwrap_err().to_string().contains("one band"));
}

/// Sets the value of a tag in the first directory of a little-endian TIFF.
fn patch_tag(bytes: &mut [u8], tag: u16, value: u32) {
    let directory = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
    let count = u16::from_le_bytes(bytes[directory..directory + 2].try_into().unwrap()) as usize;
    for entry in 0..count {
        let at = directory + 2 + 12 * entry;
        if u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap()) == tag {
            bytes[at + 2..at + 4].copy_from_slice(&4_u16.to_le_bytes());
            bytes[at + 8..at + 12].copy_from_slice(&value.to_le_bytes());
        }
    }
}

/// A TIFF of whose first directory these are the entries: tag, type, count, value.
fn tiff_of(entries: &[(u16, u16, u32, u32)], length: usize) -> Vec<u8> {
    let mut bytes = b"II*\0\x08\0\0\0".to_vec();
    bytes.extend((entries.len() as u16).to_le_bytes());
    for (tag, kind, count, value) in entries {
        bytes.extend(tag.to_le_bytes());
        bytes.extend(kind.to_le_bytes());
        bytes.extend(count.to_le_bytes());
        bytes.extend(value.to_le_bytes());
    }
    bytes.resize(length, 0);
    bytes
}

#[test]
fn counts_and_strips_beyond_the_file_are_refused_before_memory_is_reserved() {
    let folder = tempfile::tempdir().unwrap();
    // Width, height, bits, compression, greyscale, offset, samples, rows of a strip, bytes of it, sample format.
    let image = |side: u32| {
        [
            (256, 4, 1, side),
            (257, 4, 1, side),
            (258, 3, 1, 32),
            (259, 3, 1, 1),
            (262, 3, 1, 1),
            (273, 4, 1, 4096),
            (277, 3, 1, 1),
            (278, 4, 1, side),
            (279, 4, 1, 3000),
            (339, 3, 1, 3),
        ]
    };
    let refused = |bytes: &[u8], words: &str| {
        let crop = Crop { west: 0.0, south: -10.0, east: 10.0, north: 0.0 };
        let system = Some(CoordinateSystem::Local);
        let options = ReadOptions { coordinate_system: system, crop: Some(crop), ..ReadOptions::default() };
        let path = write(folder.path(), "small.tif", bytes);
        let error = read_terrain(&path, &options).unwrap_err();
        assert!(matches!(error, TerrainError::Malformed { .. }) && error.to_string().contains(words), "{error}");
    };
    // A text of a billion letters, as no-data value and where a number belongs, and a billion tile sizes.
    for (tag, kind) in [(42113, 2), (33550, 12), (279, 4), (324, 16), (256, 2)] {
        let mut entries: Vec<_> = image(20).into_iter().filter(|entry| entry.0 != tag).collect();
        entries.push((tag, kind, 1 << 30, 200));
        entries.sort_by_key(|entry| entry.0);
        refused(&tiff_of(&entries, 7000), &format!("tag {tag} counts 1073741824 values in a file of 7000 bytes"));
    }
    // One strip of a gigabyte, of which the crop keeps four samples.
    let mut entries = image(16_000).to_vec();
    // Scale and position lie behind the directory.
    entries.extend([(33550, 12, 3, 400), (33922, 12, 6, 424)]);
    let mut bytes = tiff_of(&entries, 7100);
    for (at, value) in [(400, 10.0), (408, 10.0), (448, -5.0), (456, 5.0)] {
        bytes[at..at + 8].copy_from_slice(&f64::to_le_bytes(value));
    }
    refused(&bytes, "16000 x 16000 samples cannot be in 3000 bytes");
    assert!(read(&write(folder.path(), "entries.tif", &tiff_of(&[(256, 4, 1, 1); 5000], 70_000))).is_err());
}

#[test]
fn headers_that_promise_too_much_allocate_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let whole = geotiff::<colortype::GrayI16>(40, 40, &vec![7; 1600], &Place::new(0.001, 0.0, 0.0, &GEOGRAPHIC));
    for (width, length) in
        [(16_000, 16_000), (60_000, 60_000), (4_000_000_000, 2), (40, 4_000_000_000), (0, 40), (40, 0)]
    {
        let mut bytes = whole.clone();
        patch_tag(&mut bytes, 256, width);
        patch_tag(&mut bytes, 257, length);
        assert!(read(&write(folder.path(), "huge.tif", &bytes)).is_err(), "{width} x {length}");
    }
    for tag in [278, 322, 323] {
        for value in [0, u32::MAX] {
            let mut bytes = whole.clone();
            patch_tag(&mut bytes, tag, value);
            // Whatever comes of it, it comes as a value.
            let _ = read(&write(folder.path(), "strips.tif", &bytes));
        }
    }
    for length in [0, 3, 8, 50, whole.len() / 2] {
        assert!(read(&write(folder.path(), "cut.tif", &whole[..length])).is_err(), "{length} bytes");
    }
    let path =
        write(folder.path(), "huge.asc", b"ncols 16000\nnrows 16000\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3");
    assert!(read(&path).unwrap_err().to_string().contains("do not fit"));
    assert!(matches!(read(&folder.path().join("absent.tif")), Err(TerrainError::Io { .. })));
    assert!(matches!(read(&write(folder.path(), "text.txt", b"hello")), Err(TerrainError::UnknownFormat { .. })));
    assert!(matches!(read(folder.path()), Err(TerrainError::Io { .. })));
}

const ASC: &str =
    "NCOLS 3\nnRows 2\nXLLCORNER 100\nyllcenter 205\ndx 10\ndy 20\nnodata_value -9999\n1 2 3\n4 -9999\n6\n";

#[test]
fn ascii_grids_are_read_in_their_dialects() {
    let folder = tempfile::tempdir().unwrap();
    let (terrain, warnings) = read(&write(folder.path(), "metres.asc", ASC.as_bytes())).unwrap();
    assert_eq!(
        warnings,
        [Warning::AssumedCoordinates { degrees: false }, Warning::HolesFilled { filled: 1, total: 6 }]
    );
    assert_eq!(terrain.field().spacing(), DVec2::new(10.0, 20.0));
    assert_eq!(terrain.field().heights()[3], 4.0);
    // Samples at x = 105, 115, 125 and y = 225, 205.
    assert_eq!(terrain.reference().unwrap().to_local(105.0, 225.0), DVec2::new(-10.0, -10.0));
    assert_eq!(terrain.reference().unwrap().latitude_longitude(), None);
    // A byte order mark, Windows lines, and any name.
    let windows = format!("\u{feff}{}", ASC.replace('\n', "\r\n"));
    assert_eq!(read(&write(folder.path(), "grid.dat", windows.as_bytes())).unwrap().0.field(), terrain.field());

    let degrees = "ncols 2\nnrows 2\nxllcorner 10\nyllcorner 50\ncellsize 0.001\n1 2 3 4";
    let (terrain, warnings) = read(&write(folder.path(), "degrees.asc", degrees.as_bytes())).unwrap();
    assert_eq!(warnings, [Warning::AssumedCoordinates { degrees: true }]);
    assert!((terrain.field().spacing().y - 111.2).abs() < 0.1);
    let stated = ReadOptions { coordinate_system: Some(CoordinateSystem::Local), ..ReadOptions::default() };
    let (terrain, warnings) = read_terrain(&folder.path().join("degrees.asc"), &stated).unwrap();
    assert!(warnings.is_empty() && terrain.field().spacing() == DVec2::splat(0.001));
}

#[test]
fn broken_ascii_grids_are_refused_with_line_and_column() {
    let folder = tempfile::tempdir().unwrap();
    for (from, to, says) in [
        ("4 -9999\n6\n", "4 -9999\n", "row 2 of 2, column 3 of 3"),
        ("4 -9999\n6\n", "4 -9999\n6 7\n", "line 10, column 3: there are more than"),
        ("4 -9999\n6\n", "4 x9 6\n", "line 9, column 3: \"x9\" is not a number"),
        ("1 2 3", "1,5 2 3", "decimal point"),
        ("NCOLS 3", "NCOLS 0", "0 columns"),
        ("NCOLS 3", "NCOLS -3", "line 1, column 7: ncols is -3"),
        ("NCOLS 3", "NCOLS 2.5", "ncols is 2.5"),
        ("NCOLS 3", "NCOLS 1e300", "ncols is 1"),
        ("dx 10", "dx NaN", "dx is NaN"),
        ("dx 10", "dx 0", "above 0"),
        ("dx 10\n", "", "cellsize (or dx) is missing"),
        ("dx 10", "depth 10", "\"depth\" is not a key"),
    ] {
        let text = ASC.replace(from, to);
        assert_ne!(text, ASC);
        let message = read(&write(folder.path(), "broken.asc", text.as_bytes())).unwrap_err().to_string();
        assert!(message.contains(says), "{to:?}: {message}");
    }
    let row = "ncols 4\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3 4\n";
    assert!(matches!(read(&write(folder.path(), "row.asc", row.as_bytes())), Err(TerrainError::TooSmall { .. })));
}

#[test]
fn srtm_tiles_are_placed_by_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = Vec::with_capacity(1201 * 1201 * 2);
    for row in 0..1201_i32 {
        for column in 0..1201_i32 {
            let height = if (row, column) == (600, 600) { i16::MIN } else { (row / 4 + column / 8) as i16 };
            bytes.extend(height.to_be_bytes());
        }
    }
    let (terrain, warnings) = read(&write(folder.path(), "N36W085.hgt", &bytes)).unwrap();
    assert_eq!(warnings, [Warning::HolesFilled { filled: 1, total: 1201 * 1201 }]);
    let reference = terrain.reference().unwrap();
    assert_eq!(reference.latitude_longitude(), Some((36.5, -84.5)));
    let south_west = reference.to_local(-85.0, 36.0);
    assert!((south_west - terrain.field().position(0, 1200)).length() < 1e-6);
    assert!((terrain.height(south_west.x, south_west.y) - 300.0).abs() < 1e-6);
    let message = read(&write(folder.path(), "tile.hgt", &bytes)).unwrap_err().to_string();
    assert!(message.contains("N36W085"), "{message}");
}

#[test]
fn greyscale_images_need_their_scale() {
    let folder = tempfile::tempdir().unwrap();
    let image = image::ImageBuffer::<image::Luma<u16>, _>::from_fn(5, 4, |x, y| image::Luma([(x * 10_000 + y) as u16]));
    let path = folder.path().join("land.png");
    image.save(&path).unwrap();
    assert!(matches!(read(&path), Err(TerrainError::MissingImageScale { .. })));
    let scale = ImageScale { spacing: 4.0, lowest: 100.0, highest: 755.35 };
    let options = ReadOptions { image_scale: Some(scale), ..ReadOptions::default() };
    let (terrain, warnings) = read_terrain(&path, &options).unwrap();
    assert!(warnings.is_empty());
    assert_eq!((terrain.field().columns(), terrain.field().rows()), (5, 4));
    assert!((terrain.field().heights()[2] - 300.0).abs() < 1e-3);
    assert_eq!(terrain.reference().unwrap().to_local(0.0, 12.0), terrain.field().position(0, 0));
    for broken in [ImageScale { spacing: 0.0, ..scale }, ImageScale { lowest: f64::NAN, ..scale }] {
        let options = ReadOptions { image_scale: Some(broken), ..options };
        assert!(matches!(read_terrain(&path, &options), Err(TerrainError::BadParameter { .. })));
    }
    image::RgbImage::new(3, 3).save(folder.path().join("colour.png")).unwrap();
    let message = read_terrain(&folder.path().join("colour.png"), &options).unwrap_err().to_string();
    assert!(message.contains("16-bit greyscale"), "{message}");
    let bytes = fs::read(&path).unwrap();
    let cut = write(folder.path(), "cut.png", &bytes[..bytes.len() / 2]);
    assert!(read_terrain(&cut, &options).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(192))]

    #[test]
    fn damaged_files_are_answered_not_suffered(kind in 0usize..3, damage in prop::collection::vec((any::<u32>(), any::<u8>()), 1..12)) {
        let folder = tempfile::tempdir().unwrap();
        let mut bytes = match kind {
            0 => geotiff::<colortype::GrayI16>(20, 20, &[9; 400], &Place::new(0.001, 8.0, 47.0, &GEOGRAPHIC)),
            1 => ASC.as_bytes().to_vec(),
            _ => {
                let mut png = std::io::Cursor::new(Vec::new());
                let image = image::ImageBuffer::<image::Luma<u16>, _>::new(9, 9);
                image.write_to(&mut png, image::ImageFormat::Png).unwrap();
                png.into_inner()
            }
        };
        for (at, value) in damage {
            // Half of the damage goes to the tags of a TIFF, which stand at its end.
            let length = bytes.len();
            let at = if at % 2 == 0 { at as usize % length } else { length - 1 - at as usize % length.min(200) };
            bytes[at] = value;
        }
        let options = ReadOptions {
            image_scale: Some(ImageScale { spacing: 1.0, lowest: 0.0, highest: 10.0 }),
            ..ReadOptions::default()
        };
        if let Ok((terrain, _)) = read_terrain(&write(folder.path(), "damaged", &bytes), &options) {
            prop_assert!(terrain.height(1.0, 2.0).is_finite() && terrain.extent().is_finite());
        }
    }
}

#[test]
fn the_shipped_terrain_is_what_its_readme_says() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/terrain/jacksboro_6km.tif");
    let (terrain, warnings) = read(&path).unwrap();
    assert!(warnings.is_empty());
    assert_eq!((terrain.field().columns(), terrain.field().rows()), (82, 66));
    assert_eq!(terrain.field().min_max(), (320.0, 956.0));
    let (latitude, longitude) = terrain.reference().unwrap().latitude_longitude().unwrap();
    assert!((latitude - 36.617_917).abs() < 1e-5 && (longitude + 84.261_25).abs() < 1e-5);
    assert!((terrain.extent() - 6025.0).abs().max_element() < 20.0);
}

#[test]
#[ignore = "needs the data folder CANOPY_DATA"]
fn real_files_are_read_with_their_places() {
    let (tif, asc) = (data("dem/jacksboro.tif"), data("dem/bci_50ha_elevation.asc"));
    let (terrain, warnings) = read(&tif).unwrap();
    assert!(warnings.is_empty());
    assert_eq!((terrain.field().columns(), terrain.field().rows()), (403, 344));
    assert_eq!(terrain.field().min_max(), (236.0, 1076.0));
    let spacing = terrain.field().spacing();
    assert!((spacing.x - 74.5).abs() < 0.1 && (spacing.y - 92.5).abs() < 0.1, "{spacing}");

    let (terrain, warnings) = read(&asc).unwrap();
    assert_eq!(warnings, [Warning::AssumedCoordinates { degrees: false }]);
    assert_eq!((terrain.field().columns(), terrain.field().rows()), (201, 101));
    let (low, high) = terrain.field().min_max();
    assert!(low > 115.0 && high < 165.0);
    let corner = terrain.reference().unwrap().to_local(0.0, 0.0);
    assert!((corner - DVec2::new(-500.0, 250.0)).length() < 1e-9);
}
