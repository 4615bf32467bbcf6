//! The room `scatter`: stands against their rules, packing against its bounds.

use std::collections::HashSet;
use std::f64::consts::PI;
use std::path::PathBuf;

use canopy::scatter::packed::{CellGrid, DEFAULT_CELL_SIZE, MAX_CELLS, MAX_VARIANTS};
use canopy::scatter::*;
use glam::{DVec2, DVec3, IVec2};
use proptest::prelude::*;

use crate::support::data::data;

// ---------------------------------------------------------------- stands

/// A plane: `height + east * x + south * z`, unknown beyond `reach` metres from the origin.
struct Plane {
    height: f64,
    east: f64,
    south: f64,
    reach: f64,
}

impl Ground for Plane {
    fn height(&self, x: f64, z: f64) -> f64 {
        self.height + self.east * x + self.south * z
    }

    fn slope(&self, _x: f64, _z: f64) -> f32 {
        self.east.hypot(self.south).atan() as f32
    }

    fn contains(&self, x: f64, z: f64) -> bool {
        x.abs() <= self.reach && z.abs() <= self.reach
    }
}

const FLAT: Plane = Plane { height: 100.0, east: 0.0, south: 0.0, reach: f64::INFINITY };

fn rules() -> PlacementRules {
    PlacementRules {
        stems_per_hectare: 200.0,
        sequence: Sequence::Halton,
        seed: 42,
        min_distance_m: 0.0,
        slope_limit: 1.0,
        height_range_m: None,
        area: Area::centered(DVec2::new(50.0, -80.0), DVec2::new(800.0, 500.0)),
        clearings: None,
        species: vec![SpeciesRule::default()],
    }
}

const SEQUENCES: [Sequence; 3] = [Sequence::Halton, Sequence::Hammersley, Sequence::Random];

/// Least distance between two trees on the map, by brute force over a sorted list.
fn least_distance(stand: &Stand) -> f64 {
    let mut feet: Vec<DVec2> = stand.trees.iter().map(|t| DVec2::new(t.position.x, t.position.z)).collect();
    feet.sort_by(|a, b| a.x.total_cmp(&b.x));
    let mut least = f64::INFINITY;
    for (i, a) in feet.iter().enumerate() {
        for b in &feet[i + 1..] {
            if b.x - a.x >= least {
                break;
            }
            least = least.min(a.distance(*b));
        }
    }
    least
}

#[test]
fn a_stand_has_its_density_inside_its_area() {
    for sequence in SEQUENCES {
        let rules = PlacementRules { sequence, ..rules() };
        let Placement { stand, report } = place_trees(&rules, &FLAT).unwrap();
        assert_eq!(stand.trees.len(), 8000, "40 ha of 200 stems");
        assert_eq!((report.wanted, report.placed), (8000, 8000));
        assert!((report.stems_per_hectare - 200.0).abs() < 1e-9 && (report.allowed_hectares - 40.0).abs() < 1e-9);
        for tree in &stand.trees {
            assert!(rules.area.contains(DVec2::new(tree.position.x, tree.position.z)));
            assert_eq!(tree.position.y, 100.0, "level ground sinks nothing");
            assert!((0.0..std::f32::consts::TAU).contains(&tree.yaw) && (-1.0..1.0).contains(&tree.tint));
        }
        assert!(stand.trees.windows(2).all(|pair| pair[0].index < pair[1].index));
    }
}

#[test]
fn the_least_distance_holds_and_the_density_is_met_again() {
    for sequence in SEQUENCES {
        let rules = PlacementRules { sequence, min_distance_m: 4.5, ..rules() };
        let Placement { stand, report } = place_trees(&rules, &FLAT).unwrap();
        assert!(least_distance(&stand) >= 4.5, "{sequence:?}: {}", least_distance(&stand));
        assert_eq!(stand.trees.len(), 8000, "{sequence:?} tried {} candidates", report.candidates);
    }
}

#[test]
fn the_lower_index_wins() {
    let free = place_trees(&rules(), &FLAT).unwrap().stand;
    let spaced = place_trees(&PlacementRules { min_distance_m: 5.0, ..rules() }, &FLAT).unwrap().stand;
    let mut kept: Vec<DVec3> = Vec::new();
    for tree in &free.trees[..2000] {
        if kept.iter().all(|other| other.distance(tree.position) >= 5.0) {
            kept.push(tree.position);
        }
    }
    assert!(spaced.trees.iter().zip(&kept).all(|(tree, expected)| tree.position == *expected));
}

#[test]
fn a_denser_halton_stand_contains_the_thinner_one() {
    let thin = place_trees(&rules(), &FLAT).unwrap().stand;
    let dense = place_trees(&PlacementRules { stems_per_hectare: 450.0, ..rules() }, &FLAT).unwrap().stand;
    assert_eq!(thin.trees, dense.trees[..thin.trees.len()]);
}

#[test]
fn stands_do_not_depend_on_the_number_of_threads() {
    let hilly = Plane { height: 10.0, east: 0.2, south: -0.1, reach: 300.0 };
    let clearings = Some(ClearingNoise { wavelength_m: 90.0, cover: 0.3, edge: 0.2 });
    for sequence in SEQUENCES {
        let rules = PlacementRules { sequence, clearings, min_distance_m: 3.0, ..rules() };
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let stand = place_trees(&rules, &hilly).unwrap().stand;
                let bounds = [PlantSize { radius: 3.0, height: 20.0 }];
                let packed = PackedStand::new(&stand, DEFAULT_CELL_SIZE, &bounds).unwrap();
                let cover = cover_map(&stand, &bounds, 5.0, None).unwrap();
                (stand, packed, cover)
            })
        };
        assert_eq!(on(1), on(5));
    }
}

#[test]
fn seeds_change_the_stand() {
    for sequence in SEQUENCES {
        let stand = |seed| place_trees(&PlacementRules { sequence, seed, ..rules() }, &FLAT).unwrap().stand;
        let (a, b) = (stand(1), stand(2));
        let same = a.trees.iter().zip(&b.trees).filter(|(a, b)| a.position == b.position || a.yaw == b.yaw).count();
        assert!(same < 5, "{same} trees have the same place or yaw");
    }
}

#[test]
fn trees_stand_only_where_the_rules_allow_them_and_as_densely_there() {
    // The plane rises by 0.1 to the east: 60 m to 140 m, of which the rule takes 90 m to 110 m.
    let ramp = Plane { height: 95.0, east: 0.1, south: 0.0, reach: f64::INFINITY };
    let limited = PlacementRules { height_range_m: Some((90.0, 110.0)), min_distance_m: 3.0, ..rules() };
    let Placement { stand, report } = place_trees(&limited, &ramp).unwrap();
    assert!(stand.trees.iter().all(|t| (-50.0..=150.0).contains(&t.position.x)));
    assert!((stand.trees.len() as f64 / 2000.0 - 1.0).abs() < 0.02, "{} instead of 2000", stand.trees.len());
    assert!((report.allowed_hectares - 10.0).abs() < 0.2 && (report.stems_per_hectare - 200.0).abs() < 1e-6);

    let steep = PlacementRules { slope_limit: 0.05, ..rules() };
    assert!(place_trees(&steep, &ramp).unwrap().stand.trees.is_empty());
    let island = Plane { reach: 100.0, ..FLAT };
    let stand = place_trees(&rules(), &island).unwrap().stand;
    assert!((stand.trees.len() as f64 / 800.0 - 1.0).abs() < 0.02, "{} on 4 ha", stand.trees.len());
    let abyss = Plane { height: f64::NAN, ..FLAT };
    assert!(place_trees(&rules(), &abyss).unwrap().stand.trees.is_empty());
}

#[test]
fn clearings_are_open_and_the_forest_keeps_its_density() {
    let clearings = Some(ClearingNoise { wavelength_m: 120.0, cover: 0.4, edge: 0.0 });
    let rules = PlacementRules { stems_per_hectare: 1000.0, clearings, ..rules() };
    let Placement { stand, report } = place_trees(&rules, &FLAT).unwrap();
    assert!((stand.trees.len() as f64 / 24_000.0 - 1.0).abs() < 0.03, "{} trees", stand.trees.len());
    assert!((report.allowed_hectares - 24.0).abs() < 0.7);
    // On squares of 10 m: forest squares have ten trees in the mean, open ones none, few squares are between.
    let mut counts = vec![0u32; 80 * 50];
    for tree in &stand.trees {
        let place = (DVec2::new(tree.position.x, tree.position.z) - rules.area.min) / 10.0;
        counts[(place.y as usize).min(49) * 80 + (place.x as usize).min(79)] += 1;
    }
    let empty = counts.iter().filter(|&&n| n == 0).count() as f64 / 4000.0;
    let full: Vec<u32> = counts.into_iter().filter(|n| (7..=13).contains(n)).collect();
    let mean = f64::from(full.iter().sum::<u32>()) / full.len() as f64;
    assert!(empty > 0.25, "{empty} of the squares are empty");
    assert!(full.len() > 1600 && (mean - 10.0).abs() < 0.3, "{} squares of {mean} trees", full.len());
}

#[test]
fn species_have_their_shares_and_their_limits() {
    let species =
        |weight, variants, height_range_m| SpeciesRule { weight, variants, height_range_m, ..Default::default() };
    let ramp = Plane { height: 95.0, east: 0.1, south: 0.0, reach: f64::INFINITY };
    let mixed = PlacementRules {
        species: vec![species(3.0, 0..2, None), species(1.0, 2..3, None), species(4.0, 3..4, Some((120.0, 1000.0)))],
        ..rules()
    };
    let stand = place_trees(&mixed, &ramp).unwrap().stand;
    let (low, high): (Vec<&Tree>, Vec<&Tree>) = stand.trees.iter().partition(|tree| tree.position.x < 250.0);
    assert_eq!(stand.trees.len(), 8000, "other species take the ground that one cannot");
    let share = |trees: &[&Tree], variants: std::ops::Range<u16>| {
        trees.iter().filter(|t| variants.contains(&t.variant)).count() as f64 / trees.len() as f64
    };
    assert!((share(&low, 0..2) - 0.75).abs() < 0.02 && share(&low, 3..4) == 0.0);
    assert!((share(&low, 0..1) - 0.375).abs() < 0.02, "the variants of a species are equally frequent");
    assert!((share(&high, 0..2) - 0.375).abs() < 0.03 && (share(&high, 3..4) - 0.5).abs() < 0.03);
}

#[test]
fn heights_follow_their_distribution() {
    let size = SizeRule::Height { mean_m: 18.0, deviation_m: 3.0, plant_heights_m: vec![20.0, 12.0] };
    let rules = PlacementRules { species: vec![SpeciesRule { size, variants: 4..6, ..Default::default() }], ..rules() };
    let stand = place_trees(&rules, &FLAT).unwrap().stand;
    let heights: Vec<f64> =
        stand.trees.iter().map(|t| f64::from(t.scale) * if t.variant == 4 { 20.0 } else { 12.0 }).collect();
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    let deviation = (heights.iter().map(|h| (h - mean).powi(2)).sum::<f64>() / heights.len() as f64).sqrt();
    assert!((mean - 18.0).abs() < 0.15 && (deviation - 3.0).abs() < 0.15, "{mean} ± {deviation}");
}

#[test]
fn the_rim_of_a_trunk_reaches_into_the_slope() {
    let slope = Plane { height: 50.0, east: 0.3, south: -0.4, reach: f64::INFINITY };
    let species =
        SpeciesRule { trunk_radius_m: 0.5, size: SizeRule::Scale { min: 0.5, max: 2.0 }, ..Default::default() };
    let stand = place_trees(&PlacementRules { species: vec![species], ..rules() }, &slope).unwrap().stand;
    for tree in &stand.trees {
        let radius = 0.5 * f64::from(tree.scale);
        let rim = (0..16).map(|k| {
            let (sin, cos) = (f64::from(k) / 16.0 * 2.0 * PI).sin_cos();
            slope.height(tree.position.x + radius * cos, tree.position.z + radius * sin)
        });
        let lowest = rim.fold(f64::INFINITY, f64::min);
        assert!(tree.position.y <= lowest + 1e-4 && tree.position.y > lowest - 0.02 * radius);
    }
}

#[test]
fn impossible_rules_are_refused_by_name() {
    let base = rules();
    let one = |species: SpeciesRule| PlacementRules { species: vec![species], ..rules() };
    let noise = |wavelength_m, cover, edge| PlacementRules {
        clearings: Some(ClearingNoise { wavelength_m, cover, edge }),
        ..rules()
    };
    let nan = f64::NAN;
    let heights = |plant_heights_m, mean_m, deviation_m| SpeciesRule {
        size: SizeRule::Height { mean_m, deviation_m, plant_heights_m },
        ..Default::default()
    };
    let scales = |min, max| SpeciesRule { size: SizeRule::Scale { min, max }, ..Default::default() };
    let wrong = [
        ("stems_per_hectare", PlacementRules { stems_per_hectare: 0.0, ..base.clone() }),
        ("stems_per_hectare", PlacementRules { stems_per_hectare: nan, ..base.clone() }),
        ("min_distance_m", PlacementRules { min_distance_m: -1.0, ..base.clone() }),
        ("min_distance_m", PlacementRules { min_distance_m: 7.0, ..base.clone() }),
        ("slope_limit", PlacementRules { slope_limit: 45.0, ..base.clone() }),
        ("height_range_m", PlacementRules { height_range_m: Some((5.0, 5.0)), ..base.clone() }),
        ("area", PlacementRules { area: Area { min: DVec2::ONE, max: DVec2::ONE }, ..base.clone() }),
        ("area", PlacementRules { area: Area { min: DVec2::ZERO, max: DVec2::splat(3e6) }, ..base.clone() }),
        ("area", PlacementRules { area: Area { min: DVec2::NAN, max: DVec2::ONE }, ..base.clone() }),
        ("species", PlacementRules { species: vec![], ..base.clone() }),
        ("clearings.wavelength_m", noise(0.0, 0.5, 0.1)),
        ("clearings.cover", noise(10.0, 1.5, 0.1)),
        ("clearings.edge", noise(10.0, 0.5, nan)),
        ("species[0].weight", one(SpeciesRule { weight: -1.0, ..Default::default() })),
        ("species[0].variants", one(SpeciesRule { variants: 3..3, ..Default::default() })),
        ("species[0].slope_limit", one(SpeciesRule { slope_limit: Some(f32::NAN), ..Default::default() })),
        ("species[0].height_range_m", one(SpeciesRule { height_range_m: Some((9.0, nan)), ..Default::default() })),
        ("species[0].trunk_radius_m", one(SpeciesRule { trunk_radius_m: -0.1, ..Default::default() })),
        ("species[0].size", one(scales(0.01, 1.0))),
        ("species[0].size", one(scales(2.0, 1.0))),
        ("species[0].size", one(heights(vec![20.0], 10.0, 5.0))),
        ("species[0].plant_heights_m", one(heights(vec![], 10.0, 1.0))),
        ("species[0].plant_heights_m", one(heights(vec![0.2], 10.0, 1.0))),
    ];
    for (name, rules) in wrong {
        match place_trees(&rules, &FLAT) {
            Err(ScatterError::Rule { field, remedy, .. }) => {
                assert_eq!(field, name);
                assert!(!remedy.is_empty());
            }
            other => panic!("{name}: {other:?}"),
        }
    }
    let crowded = PlacementRules { stems_per_hectare: 1e9, ..base };
    assert!(matches!(place_trees(&crowded, &FLAT), Err(ScatterError::TooManyTrees { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_valid_rules_give_finite_trees_that_keep_their_distance(
        stems in 0.1f64..800.0, distance in 0.0f64..8.0, seed: u64, kind in 0usize..3,
        width in 0.5f64..400.0, depth in 0.5f64..400.0, x in -1e6f64..1e6, cover in 0.0f64..=1.0,
    ) {
        let rules = PlacementRules {
            stems_per_hectare: stems,
            sequence: SEQUENCES[kind],
            seed,
            min_distance_m: distance,
            area: Area::centered(DVec2::new(x, -x), DVec2::new(width, depth)),
            clearings: Some(ClearingNoise { wavelength_m: 50.0, cover, edge: 0.1 }),
            ..rules()
        };
        match place_trees(&rules, &FLAT) {
            Err(ScatterError::Rule { field, .. }) => prop_assert_eq!(field, "min_distance_m"),
            Err(other) => prop_assert!(false, "{}", other),
            Ok(Placement { stand, report }) => {
                prop_assert!(least_distance(&stand) >= distance);
                prop_assert!(report.placed <= report.wanted && report.stems_per_hectare.is_finite());
                for tree in &stand.trees {
                    prop_assert!(tree.position.is_finite());
                    prop_assert!(rules.area.contains(DVec2::new(tree.position.x, tree.position.z)));
                }
            }
        }
    }
}

/// The wood does not end at the border of the data, and what is inside stays as it was.
#[test]
fn surroundings_go_on_with_the_same_density_and_thin_out() {
    let clearings = Some(ClearingNoise { wavelength_m: 150.0, cover: 0.3, edge: 0.1 });
    let rules = PlacementRules { min_distance_m: 2.0, clearings, ..rules() };
    let inside = place_trees(&rules, &FLAT).unwrap().stand;
    let width = 400.0;
    let around = place_surroundings(&rules, &inside, width, &FLAT).unwrap();
    assert_eq!(around, place_surroundings(&rules, &inside, width, &FLAT).unwrap());
    let point = |tree: &Tree| DVec2::new(tree.position.x, tree.position.z);
    assert!(around.trees.iter().all(|tree| !rules.area.contains(point(tree)) && tree.index >= FIRST_SURROUNDING_INDEX));
    assert!(inside.trees.iter().all(|tree| tree.index < FIRST_SURROUNDING_INDEX));
    // The rings up to half of the width are as dense as the wood, then it thins out.
    let density = |from: f64, to: f64| {
        let ring = |by: f64| Area { min: rules.area.min - by, max: rules.area.max + by };
        let count = around.trees.iter().filter(|tree| {
            let beyond = distance_beyond(&rules.area, point(tree));
            from < beyond && beyond <= to
        });
        count.count() as f64 / (ring(to).hectares() - ring(from).hectares())
    };
    let wood = inside.trees.len() as f64 / rules.area.hectares();
    let (near, middle, end) = (density(0.0, 200.0), density(250.0, 320.0), density(370.0, 400.0));
    assert!((0.75..1.25).contains(&(near / wood)), "{near} around {wood}");
    assert!((0.4..0.95).contains(&(middle / near)) && end < 0.2 * near, "{near}, {middle}, {end}");
    let whole = Stand { trees: inside.trees.iter().chain(&around.trees).copied().collect() };
    assert!(least_distance(&whole) >= 2.0, "{}", least_distance(&whole));
    assert_eq!(place_surroundings(&rules, &inside, 0.0, &FLAT).unwrap(), Stand::default());
    assert_eq!(place_surroundings(&rules, &inside, f64::NAN, &FLAT).unwrap(), Stand::default());
}

// ---------------------------------------------------------------- inventories

fn parse(text: &str) -> Result<Inventory, ScatterError> {
    parse_inventory(text.as_bytes(), "test.csv", InventoryOptions::default())
}

fn row(x: f64, y: f64, dbh_m: Option<f64>, height_m: Option<f64>, species: Option<&str>, line: u64) -> InventoryTree {
    InventoryTree { x, y, dbh_m, height_m, species: species.map(str::to_owned), place: None, line }
}

#[test]
fn inventories_are_read_in_many_spellings() {
    let expected = vec![row(1.5, 2.0, Some(0.25), Some(12.5), Some("Oak"), 2), row(3.0, 4.5, None, None, None, 3)];
    for text in [
        "x,y,dbh,height,species\n1.5,2,25,12.5,Oak\n3,4.5,NA,,\n",
        "X;Y;DBH (mm);Height [cm];Species\r\n1,5;2;250;1250;Oak\r\n3;4,5;;0;NA\r\n",
        "\u{feff}\"species\"\t\"y_m\"\t\"x_m\"\t\"h_m\"\t\"dbh_m\"\nOak\t2\t1,5\t12.5\t.25\n-\t4.5\t3\t\t\n\n",
        "id,Easting,Northing,BHD,Tree height,sp\n7,1.5,2.0,2.5e1,12.5, Oak \n8,3,4.5,0,n/a,\n,,,,,\n",
    ] {
        let inventory = parse(text).unwrap();
        assert_eq!((&inventory.rows, inventory.coordinates), (&expected, Coordinates::Planar), "{text}");
    }
    let spread = parse("\n# plot\nx,y\n\n# first\n1,2\r\n\r\n\"3\",4\r5,6").unwrap();
    assert_eq!(spread.rows.iter().map(|tree| (tree.x, tree.line)).collect::<Vec<_>>(), [(1.0, 6), (3.0, 8), (5.0, 9)]);
    let inventory = parse("# plot 7\nlat,lon,dbh\n47.1,8.5,30\n").unwrap();
    assert_eq!(inventory.coordinates, Coordinates::Geographic);
    assert_eq!(inventory.rows, [row(8.5, 47.1, Some(0.3), None, None, 3)]);
}

#[test]
fn units_come_from_the_name_or_the_option() {
    let options = InventoryOptions {
        dbh_unit: Some(LengthUnit::Millimetres),
        height_unit: Some(LengthUnit::Centimetres),
        ..InventoryOptions::default()
    };
    let read = |text: &str| parse_inventory(text.as_bytes(), "t", options).unwrap().rows.remove(0);
    let tree = read("x,y,dbh,h\n1,2,250,1250\n");
    assert!((tree.dbh_m.unwrap() - 0.25).abs() < 1e-12 && (tree.height_m.unwrap() - 12.5).abs() < 1e-12);
    let tree = read("x,y,dbh_cm,h_m\n1,2,25,12.5\n");
    assert!((tree.dbh_m.unwrap() - 0.25).abs() < 1e-12 && (tree.height_m.unwrap() - 12.5).abs() < 1e-12);
}

#[test]
fn latin_1_and_utf_16_are_read() {
    let inventory =
        parse_inventory(b"x;y;species\n1;2;Gew\xf6hnliche Esche\n", "t", InventoryOptions::default()).unwrap();
    assert_eq!(inventory.rows[0].species.as_deref(), Some("Gewöhnliche Esche"));
    let wide: Vec<u8> =
        "\u{feff}x;y;species\n1;2;Gew\u{f6}hnliche Esche\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let inventory = parse_inventory(&wide, "t", InventoryOptions::default()).unwrap();
    assert_eq!(inventory.rows[0].species.as_deref(), Some("Gewöhnliche Esche"));
}

#[test]
fn text_in_number_columns_is_listed_by_line_column_and_value() {
    let text = "x,y,dbh\n1,2,3\none,2,3\n1,two,3\n1,2,three\n1,,3\n1,2,-4\n1,2,inf\n1,2,90000\n1,2,5\n";
    let error = parse(text).unwrap_err();
    let ScatterError::BadValues { total, first, .. } = &error else { panic!("{error}") };
    assert_eq!((*total, first.len()), (7, 5));
    let found: Vec<(u64, &str, &str)> = first.iter().map(|b| (b.line, b.column.as_str(), b.value.as_str())).collect();
    assert_eq!(found, [(3, "x", "one"), (4, "y", "two"), (5, "dbh", "three"), (6, "y", ""), (7, "dbh", "-4")]);
    let message = error.to_string();
    assert!(
        message.contains("test.csv") && message.contains("line 4, column `y`: \"two\" is not a number"),
        "{message}"
    );
    assert!(parse("x;y\n1.000,5;2\n").unwrap_err().to_string().contains("1.000,5"), "thousands are not guessed");
    assert!(parse("lon,lat\n8,95\n").unwrap_err().to_string().contains("not a latitude"));
}

#[test]
fn headers_that_say_too_little_or_too_much_are_refused() {
    let message = parse("tree,x,dbh\n1,2,3\n").unwrap_err().to_string();
    assert!(message.contains("tree, x, dbh") && message.contains("easting"), "{message}");
    let message = parse("x,y,dbh_cm,dbh_mm\n1,2,3,30\n").unwrap_err().to_string();
    assert!(message.contains("dbh_cm") && message.contains("dbh_mm"), "{message}");
    let message = parse("x,y\n1,2\n1,2,3\n").unwrap_err().to_string();
    assert!(message.contains("line 3") && message.contains("3 cells"), "{message}");
    assert!(matches!(parse(""), Err(ScatterError::NoPosition { .. })));
    let missing = read_inventory(&PathBuf::from("no/such/file.csv"), InventoryOptions::default());
    assert!(missing.unwrap_err().to_string().contains("file.csv"));
}

proptest! {
    #[test]
    fn no_bytes_make_the_reader_panic(bytes: Vec<u8>, tail in "[-x,;y\t\"\n0-9.,a#]{0,80}") {
        let _ = parse_inventory(&bytes, "t", InventoryOptions::default());
        let text = format!("x,y,dbh,h,species\n{tail}");
        if let Ok(inventory) = parse(&text) {
            for tree in inventory.rows {
                prop_assert!(tree.x.is_finite() && tree.y.is_finite());
                prop_assert!(tree.dbh_m.is_none_or(|d| d > 0.0 && d.is_finite()));
            }
        }
    }
}

fn pine() -> InventorySpecies {
    InventorySpecies {
        name: "Pine".to_owned(),
        variants: 0..2,
        plant_heights_m: vec![20.0, 16.0],
        default_height_m: 15.0,
        allometry: Allometry::default(),
        trunk_radius_m: 0.3,
    }
}

#[test]
fn an_inventory_becomes_a_stand_with_warnings() {
    let oak = InventorySpecies { name: "oak ".to_owned(), variants: 2..3, plant_heights_m: vec![10.0], ..pine() };
    let rows = [
        row(10.0, 20.0, Some(0.3), Some(18.0), Some("pine"), 2),
        row(30.0, 20.0, Some(0.3), None, Some("OAK"), 3),
        row(50.0, 20.0, None, None, None, 4),
        row(10.001, 20.0, Some(0.2), None, None, 5),
        row(5000.0, 20.0, None, None, None, 6),
        row(70.0, 20.0, None, Some(12.0), Some("Elm"), 7),
        row(80.0, 20.0, None, Some(0.2), Some("Elm"), 8),
        row(f64::MAX, 20.0, None, None, None, 9),
    ];
    let ground = Plane { reach: 1000.0, east: 0.1, ..FLAT };
    let InventoryStand { stand, warnings } =
        stand_from_inventory(&rows, |x, y| DVec3::new(x, 0.0, -y), &ground, &[pine(), oak], 3).unwrap();
    assert_eq!(stand.trees.iter().map(|t| t.index).collect::<Vec<_>>(), [0, 1, 2, 5, 6]);
    let plant = |t: &Tree| [20.0, 16.0, 10.0][usize::from(t.variant)];
    let heights: Vec<f32> = stand.trees.iter().map(|t| t.scale * plant(t)).collect();
    for (height, expected) in heights.iter().zip([18.0, 21.87, 15.0, 12.0]) {
        assert!((height - expected).abs() < 0.05, "{heights:?}");
    }
    assert_eq!(stand.trees[1].variant, 2);
    assert_eq!((stand.trees[0].position.x, stand.trees[0].position.z), (10.0, -20.0));
    assert!((stand.trees[0].position.y - (101.0 - 0.03 * f64::from(stand.trees[0].scale))).abs() < 1e-6);
    assert_eq!(warnings.outside, [6, 9]);
    assert_eq!(warnings.duplicates, [(5, 2)]);
    assert_eq!(warnings.unknown_species.into_iter().collect::<Vec<_>>(), [("Elm".to_owned(), 2)]);
    assert_eq!(warnings.rescaled, [8]);
}

#[test]
fn warnings_read_as_sentences_and_bad_tables_are_refused() {
    let rows = [row(0.0, 0.0, None, None, Some("Elm"), 2), row(0.0, 0.0, None, None, None, 3)];
    let build =
        |species: &[InventorySpecies]| stand_from_inventory(&rows, |x, y| DVec3::new(x, 0.0, -y), &FLAT, species, 0);
    let text = build(&[pine()]).unwrap().warnings.to_string();
    assert!(text.contains("Elm (1)") && text.contains("line(s) 3") && text.lines().count() == 2, "{text}");
    assert!(InventoryWarnings::default().is_empty() && InventoryWarnings::default().to_string().is_empty());
    assert!(matches!(build(&[]), Err(ScatterError::NoSpecies)));
    for broken in [
        InventorySpecies { plant_heights_m: vec![], ..pine() },
        InventorySpecies { plant_heights_m: vec![20.0, f32::NAN], ..pine() },
        InventorySpecies { default_height_m: 0.0, ..pine() },
        InventorySpecies { trunk_radius_m: f32::INFINITY, ..pine() },
    ] {
        assert!(build(&[broken]).unwrap_err().to_string().contains("Pine"));
    }
}

#[test]
#[ignore = "needs the data folder CANOPY_DATA"]
fn barro_colorado_island_is_read_whole() {
    let inventory = read_inventory(&data("stands/bci_50ha_trees.csv"), InventoryOptions::default()).unwrap();
    assert_eq!((inventory.rows.len(), inventory.coordinates), (3604, Coordinates::Planar));
    assert!(inventory.rows.iter().all(|t| (0.0..=1000.0).contains(&t.x) && (0.0..=500.0).contains(&t.y)));
    let local = |x: f64, y: f64| DVec3::new(x - 500.0, 0.0, 250.0 - y);
    let InventoryStand { stand, warnings } = stand_from_inventory(&inventory.rows, local, &FLAT, &[pine()], 1).unwrap();
    assert_eq!(stand.trees.len() + warnings.duplicates.len(), 3604);
    assert!(warnings.outside.is_empty() && warnings.unknown_species.is_empty());
    let area = stand.area().unwrap();
    assert!(area.min.cmpge(DVec2::new(-500.0, -250.0)).all() && area.max.cmple(DVec2::new(500.0, 250.0)).all());
}

#[test]
#[ignore = "needs the data folder CANOPY_DATA"]
fn longleaf_pines_get_heights_from_their_diameters() {
    let rows = read_inventory(&data("stands/longleaf_pine.csv"), InventoryOptions::default()).unwrap().rows;
    assert_eq!(rows.len(), 584);
    assert_eq!(rows[0], row(200.0, 8.8, Some(0.329), None, None, 2));
    assert!(rows.iter().all(|t| t.dbh_m.is_some_and(|dbh| (0.02..0.8).contains(&dbh))));
    let one = InventorySpecies { variants: 0..1, plant_heights_m: vec![20.0], ..pine() };
    let stand = stand_from_inventory(&rows, |x, y| DVec3::new(x, 0.0, -y), &FLAT, &[one], 1).unwrap().stand;
    let tallest = stand.trees.iter().map(|t| t.scale * 20.0).fold(0.0, f32::max);
    assert!((25.0..40.0).contains(&tallest), "the tallest has {tallest} m");
}

// ---------------------------------------------------------------- packing

fn tree(x: f64, y: f64, z: f64) -> Tree {
    Tree { position: DVec3::new(x, y, z), yaw: 1.0, scale: 1.0, variant: 0, tint: 0.0, index: 0 }
}

proptest! {
    #[test]
    fn packed_trees_are_within_their_error_bounds(
        x in -2_097_000.0f64..2_097_000.0, z in -2_097_000.0f64..2_097_000.0, y in -500.0f64..8848.0,
        yaw in -20.0f32..20.0, scale in -4.0f32..=4.0, variant in 0u16..1024, tint in -1.0f32..=1.0,
        aside in (-8191i32..=8191, -8191i32..=8191),
    ) {
        let original = Tree { position: DVec3::new(x, y, z), yaw, scale: scale.exp2(), variant, tint, index: 0 };
        let cells = IVec2::new((x / 64.0).floor() as i32, (z / 64.0).floor() as i32);
        let grid = CellGrid { size: 64.0, base: cells + IVec2::from(aside) };
        let packed = PackedTree::pack(&original, 0, &grid).unwrap();
        let place = packed.position(&grid);
        let step = 64.0 / 131_070.0 + 1e-9;
        prop_assert!((place.x - x).abs() <= step && (place.z - z).abs() <= step, "{} for {}, {}", place, x, z);
        prop_assert!((place.y - y).abs() <= y.abs() / 16_777_216.0 + 1e-12);
        let turn = (f64::from(packed.yaw()) - f64::from(yaw)).rem_euclid(2.0 * PI);
        prop_assert!(turn.min(2.0 * PI - turn) <= PI / 256.0 + 1e-5);
        prop_assert!((packed.scale() / original.scale - 1.0).abs() < 6.9e-4);
        prop_assert!((MIN_SCALE..=MAX_SCALE).contains(&packed.scale()));
        prop_assert_eq!(packed.variant(), variant);
        prop_assert!((packed.tint() - tint).abs() <= 0.5 / 31.0 + 1e-6);
        let (ix, iz) = packed.cell_index(&grid);
        prop_assert_eq!((f64::from(ix), f64::from(iz)), ((x / 64.0).floor(), (z / 64.0).floor()));
    }
}

#[test]
fn a_packed_tree_is_sixteen_bytes_with_the_documented_bits() {
    assert_eq!(size_of::<PackedTree>(), 16);
    let original = Tree {
        position: DVec3::new(-64.0, 7.5, 96.0),
        yaw: std::f32::consts::FRAC_PI_2,
        scale: 16.0,
        variant: 1023,
        tint: -1.0,
        index: 9,
    };
    let grid = CellGrid::new(64.0);
    let packed = PackedTree::pack(&original, 0, &grid).unwrap();
    // 96 m is the middle of cell 1: 32767.5 rounds away from zero.
    assert_eq!(packed.xz, 0x8000_0000);
    assert_eq!(packed.cell, 15 << 28 | 1 << 14 | 0x3FFF);
    assert_eq!((packed.variant(), packed.cell_index(&grid)), (1023, (-1, 1)));
    assert_eq!(packed.look, 64 | 4095 << 8 | 63 << 20 | (0x40 - 31) << 26);
    assert_eq!(packed.tint(), -1.0);
    assert_eq!(packed.position(&grid).x, -64.0);
    // The same tree from a base far away, and from one that is too far.
    let aside = CellGrid { base: IVec2::new(8000, -8000), ..grid };
    let moved = PackedTree::pack(&original, 0, &aside).unwrap();
    assert_eq!((moved.position(&aside), moved.variant()), (packed.position(&grid), 1023));
    let far = CellGrid { base: IVec2::new(8192, 0), ..grid };
    assert!(matches!(PackedTree::pack(&original, 0, &far), Err(ScatterError::Unpackable { what: "x", .. })));
}

#[test]
fn what_does_not_fit_is_refused_with_its_tree() {
    let bounds = [PlantSize { radius: 2.0, height: 10.0 }];
    let pack =
        |bad: Tree| PackedStand::new(&Stand { trees: vec![tree(0.0, 0.0, 0.0), bad] }, 64.0, &bounds).unwrap_err();
    for (what, bad) in [
        ("x", tree(2_097_152.0, 0.0, 0.0)),
        ("z", tree(0.0, 0.0, -2_097_153.0)),
        ("x", tree(f64::NAN, 0.0, 0.0)),
        ("z", tree(0.0, 0.0, f64::INFINITY)),
        ("y", tree(0.0, f64::NAN, 0.0)),
        ("scale", Tree { scale: 17.0, ..tree(0.0, 0.0, 0.0) }),
        ("scale", Tree { scale: f32::NAN, ..tree(0.0, 0.0, 0.0) }),
        ("yaw", Tree { yaw: f32::INFINITY, ..tree(0.0, 0.0, 0.0) }),
        ("tint", Tree { tint: 1.5, ..tree(0.0, 0.0, 0.0) }),
    ] {
        let error = pack(bad);
        assert!(matches!(error, ScatterError::Unpackable { tree: 1, what: w, .. } if w == what), "{error}");
    }
    let unknown = pack(Tree { variant: 1, ..tree(0.0, 0.0, 0.0) });
    assert!(matches!(unknown, ScatterError::UnknownVariant { tree: 1, variant: 1, count: 1 }));
    let many = PackedStand::new(&Stand::default(), 64.0, &vec![PlantSize::default(); MAX_VARIANTS + 1]);
    assert!(many.unwrap_err().to_string().contains("fewer"));
    let bad_bounds = PackedStand::new(&Stand::default(), 64.0, &[PlantSize { radius: f32::NAN, height: 1.0 }]);
    assert!(matches!(bad_bounds, Err(ScatterError::PlantSize { variant: 0, .. })));
    assert!(matches!(PackedStand::new(&Stand::default(), 0.0, &[]), Err(ScatterError::Size { .. })));
    assert!(PackedStand::new(&Stand::default(), 64.0, &[]).unwrap().cells.is_empty());
}

#[test]
fn a_stand_may_lie_anywhere_and_is_at_most_16384_cells_wide() {
    let bounds = [PlantSize { radius: 2.0, height: 10.0 }];
    let pack = |places: &[f64], size: f64| {
        let trees = places.iter().map(|&place| tree(place, 0.0, -place)).collect();
        PackedStand::new(&Stand { trees }, size, &bounds)
    };
    // The widest stands at both ends of what coordinates can be.
    let width = f64::from(MAX_CELLS) * 64.0;
    for first in [-2_097_151.0, -0.5 * width, 2_097_151.0 - width + 64.0] {
        let last = first + width - 64.0;
        let packed = pack(&[first, last, first + 0.3 * width], 64.0).unwrap();
        let mut found: Vec<f64> = packed.trees.iter().map(|tree| tree.position(&packed.grid).x).collect();
        found.sort_by(f64::total_cmp);
        for (found, wanted) in found.iter().zip([first, first + 0.3 * width, last]) {
            assert!((found - wanted).abs() < 5e-4, "{found} for {wanted}");
        }
    }
    let error = pack(&[0.0, width + 1.0], 64.0).unwrap_err();
    let ScatterError::TooWide { axis: "X", least, .. } = error else { panic!("{error}") };
    assert!(error.to_string().contains("4096 m") && error.to_string().contains(&format!("cells of {least} m")));
    assert!(pack(&[0.0, width + 1.0], least).is_ok(), "the remedy works");
}

#[test]
fn cells_partition_the_trees_and_hold_their_crowns() {
    let sizes = SizeRule::Scale { min: 0.3, max: 3.0 };
    let species = vec![SpeciesRule { variants: 0..2, size: sizes, ..Default::default() }];
    let slope = Plane { height: 0.0, east: 0.3, south: 0.2, reach: f64::INFINITY };
    let stand = place_trees(&PlacementRules { species, ..rules() }, &slope).unwrap().stand;
    let bounds = [PlantSize { radius: 4.0, height: 25.0 }, PlantSize { radius: 1.0, height: 5.0 }];
    let packed = PackedStand::new(&stand, 50.0, &bounds).unwrap();
    assert_eq!(packed.trees.len(), stand.trees.len());
    let mut seen = HashSet::new();
    let mut next = 0;
    for cell in &packed.cells {
        assert_eq!(cell.first, next);
        assert!(cell.count > 0 && seen.insert((cell.ix, cell.iz)), "a cell appears once");
        next += cell.count;
        let range = cell.first as usize..next as usize;
        assert!(packed.indices[range.clone()].windows(2).all(|pair| pair[0] < pair[1]));
        for packed_tree in &packed.trees[range] {
            assert_eq!(packed_tree.cell_index(&packed.grid), (cell.ix, cell.iz));
            let bound = bounds[usize::from(packed_tree.variant())];
            let foot = packed_tree.position(&packed.grid);
            let reach = f64::from(bound.radius * packed_tree.scale()) - 1e-4;
            let top = f64::from(bound.height * packed_tree.scale()) - 1e-4;
            assert!((foot - DVec3::new(reach, 0.0, reach)).cmpge(cell.min).all());
            assert!((foot + DVec3::new(reach, top, reach)).cmple(cell.max).all());
            assert!(packed_tree.scale() <= cell.max_scale);
        }
    }
    assert_eq!(next as usize, packed.trees.len());
    // Each packed tree is the stand's tree of its index.
    let by_index: std::collections::HashMap<u32, &Tree> = stand.trees.iter().map(|t| (t.index, t)).collect();
    for (packed_tree, index) in packed.trees.iter().zip(&packed.indices) {
        assert!(packed_tree.position(&packed.grid).distance(by_index[index].position) < 2e-3);
    }
    // Morton order: a step in the list is a short way on the ground far more often than not.
    let near = packed
        .cells
        .windows(2)
        .filter(|pair| pair[0].ix.abs_diff(pair[1].ix) <= 1 && pair[0].iz.abs_diff(pair[1].iz) <= 1);
    assert!(near.count() * 4 > packed.cells.len() * 3 - 8);
}

// ---------------------------------------------------------------- cover

/// Area under crowns that the map holds, m².
fn covered(map: &CoverMap) -> f64 {
    map.cover.iter().map(|&cover| f64::from(cover) / 255.0).sum::<f64>() * map.texel * map.texel
}

#[test]
fn one_crown_covers_its_own_area_wherever_it_stands() {
    for (k, radius) in [0.4f32, 1.0, 2.7, 6.0, 33.0].into_iter().enumerate() {
        for i in 0..40 {
            let foot = (random(i, k as u64) - 0.5) * 1000.0;
            let stand = Stand { trees: vec![Tree { scale: 1.5, ..tree(foot.x, 3.0, foot.y) }] };
            let map = cover_map(&stand, &[PlantSize { radius, height: 1.0 }], 2.0, None).unwrap();
            let area = PI * f64::from(radius * 1.5).powi(2);
            // One step of 8 bits for each texel of the map, rounded to nearest, is the least that can be promised.
            let rounding = map.cover.len() as f64 * 0.5 / 255.0 * 4.0;
            assert!((covered(&map) - area).abs() < rounding.min(0.05 * area + 0.02), "{} for {area}", covered(&map));
            assert!((map.at(foot) > 0.9) == (radius > 3.0) || radius <= 3.0);
            assert_eq!(map.at(foot + 200.0), 0.0);
        }
    }
}

#[test]
fn cover_agrees_with_a_fine_raster() {
    let species = vec![SpeciesRule { size: SizeRule::Scale { min: 0.5, max: 1.5 }, ..Default::default() }];
    let area = Area { min: DVec2::ZERO, max: DVec2::splat(80.0) };
    let rules = PlacementRules { area, species, sequence: Sequence::Random, ..rules() };
    let stand = place_trees(&rules, &FLAT).unwrap().stand;
    let bounds = [PlantSize { radius: 3.0, height: 10.0 }];
    let map = cover_map(&stand, &bounds, 4.0, Some(area)).unwrap();
    assert_eq!((map.columns, map.rows, map.origin), (20, 20, DVec2::ZERO));
    let mut total_error = 0.0;
    for row in 0..20 {
        for column in 0..20 {
            // The product of the open shares of the discs, each from 32 x 32 samples of the texel.
            let mut open = 1.0;
            for tree in &stand.trees {
                let center = DVec2::new(tree.position.x, tree.position.z);
                let inside = (0..1024).filter(|s| {
                    let sample = DVec2::new(f64::from(s % 32) + 0.5, f64::from(s / 32) + 0.5) / 8.0;
                    let point = DVec2::new(f64::from(column), f64::from(row)) * 4.0 + sample;
                    point.distance(center) < 3.0 * f64::from(tree.scale)
                });
                open *= 1.0 - inside.count() as f64 / 1024.0;
            }
            let found = f64::from(map.cover[(row * 20 + column) as usize]) / 255.0;
            assert!((found - (1.0 - open)).abs() < 0.12, "({column}, {row}): {found} for {}", 1.0 - open);
            total_error += (found - (1.0 - open)).abs() / 400.0;
        }
    }
    assert!(total_error < 0.015, "mean error {total_error}");
    let packed = PackedStand::new(&stand, 64.0, &bounds).unwrap();
    let of_packed = cover_map(&packed, &bounds, 4.0, Some(area)).unwrap();
    assert!(map.cover.iter().zip(&of_packed.cover).all(|(a, b)| a.abs_diff(*b) <= 8));
}

#[test]
fn cover_maps_refuse_what_they_cannot_hold() {
    let stand = Stand { trees: vec![tree(0.0, 0.0, 0.0), tree(1e6, 0.0, 1e6)] };
    let bounds = [PlantSize { radius: 3.0, height: 10.0 }];
    for texel in [0.0, -1.0, f64::NAN, f64::INFINITY, 1.0] {
        assert!(matches!(cover_map(&stand, &bounds, texel, None), Err(ScatterError::Size { .. })), "{texel}");
    }
    assert!(matches!(cover_map(&stand, &[], 500.0, None), Err(ScatterError::UnknownVariant { .. })));
    let empty = cover_map(&Stand::default(), &bounds, 4.0, None).unwrap();
    assert_eq!((empty.columns, empty.rows, empty.at(DVec2::ZERO)), (0, 0, 0.0));
    // Trees far outside of the extent are left out, without a panic.
    let far = Stand { trees: vec![tree(1e300, 0.0, 1e300), tree(-1e300, 0.0, 0.0), tree(5.0, 0.0, 5.0)] };
    let extent = Area { min: DVec2::ZERO, max: DVec2::splat(10.0) };
    let map = cover_map(&far, &bounds, 2.0, Some(extent)).unwrap();
    assert!((covered(&map) - 9.0 * PI).abs() < 0.5);
}

#[test]
fn a_bounded_cover_has_texels_as_large_as_its_stand_is_wide() {
    let bounds = [PlantSize { radius: 60.0, height: 10.0 }];
    let pair = |distance: f64| Stand { trees: vec![tree(0.0, 0.0, 0.0), tree(distance, 0.0, distance)] };
    for (distance, texel) in [(100.0, 8.0), (4_000.0, 8.0), (20_000.0, 32.0), (500_000.0, 512.0)] {
        let map = bounded_cover_map(&pair(distance), &bounds, 8.0, 1 << 20).unwrap();
        assert_eq!(map.texel, texel, "{distance} m");
        assert!(map.cover.len() <= 1 << 20, "{distance} m: {} texels", map.cover.len());
        for map in [&map, &map.smoothed()] {
            assert!(map.at(DVec2::ZERO) > 0.0 && map.at(DVec2::splat(distance)) > 0.0, "{distance} m");
        }
        if texel == 8.0 {
            assert_eq!(map, cover_map(&pair(distance), &bounds, 8.0, None).unwrap());
        }
    }
    assert!(bounded_cover_map(&pair(10.0), &bounds, f64::NAN, 1 << 20).is_err());
    assert_eq!(bounded_cover_map(&Stand::default(), &bounds, 8.0, 0).unwrap().cover, [0u8; 0]);
    let least = bounded_cover_map(&pair(10.0), &bounds, 8.0, 0).unwrap();
    assert!(least.cover.len() <= 4, "{} texels", least.cover.len());
}

#[test]
fn a_coarsened_cover_keeps_its_sum_and_its_place() {
    let map = CoverMap { origin: DVec2::new(-8.0, 8.0), texel: 8.0, columns: 3, rows: 1, cover: vec![64, 16, 32] };
    let coarse = map.coarsened(2);
    assert_eq!((coarse.origin, coarse.texel), (DVec2::new(-16.0, 0.0), 16.0));
    assert_eq!((coarse.columns, coarse.rows, coarse.cover), (2, 1, vec![16, 12]));
    assert_eq!((map.coarsened(1), map.coarsened(0)), (map.clone(), map));
}

#[test]
fn a_widened_cover_is_the_mean_of_the_surroundings() {
    let mut cover = vec![0; 9 * 9];
    cover[4 * 9 + 4] = 250;
    let spot = CoverMap { origin: DVec2::new(-36.0, -36.0), texel: 8.0, columns: 9, rows: 9, cover };
    let wide = spot.widened(32.0);
    // A pyramid of nine by nine texels whose top is (5 / 25)².
    assert_eq!((wide.columns, wide.rows, wide.origin), (17, 17, DVec2::new(-68.0, -68.0)));
    assert_eq!(wide.at(DVec2::ZERO), 10.0 / 255.0);
    assert_eq!(wide.at(DVec2::new(40.0, 0.0)), 0.0);
    for (x, z) in [(8.0, 0.0), (0.0, 16.0), (24.0, 16.0)] {
        let place = DVec2::new(x, z);
        let [a, b, c] = [-place, DVec2::new(z, x), DVec2::new(-x, z)].map(|other| wide.at(other));
        assert!(a == b && b == c && a == wide.at(place), "{place}");
    }
    // A closed stand stays closed but at its edge, where half of the surroundings are open.
    let closed = CoverMap { columns: 40, rows: 40, cover: vec![255; 1600], ..spot.clone() };
    let wide = closed.widened(32.0);
    assert_eq!(wide.at(closed.origin + 160.0), 1.0);
    assert!((0.55..0.65).contains(&wide.at(closed.origin + DVec2::new(4.0, 160.0))));
    for reach in [0.0, f64::NAN, -3.0, 1e9] {
        assert_eq!(spot.widened(reach), spot);
    }
    let empty = CoverMap { columns: 0, rows: 0, cover: Vec::new(), ..spot };
    assert_eq!(empty.widened(32.0), empty);
}

#[test]
fn a_smoothed_cover_spreads_evenly_and_keeps_its_sum() {
    let map =
        CoverMap { origin: DVec2::new(16.0, -8.0), texel: 8.0, columns: 3, rows: 2, cover: vec![0, 160, 0, 0, 0, 80] };
    let smooth = map.smoothed();
    assert_eq!((smooth.columns, smooth.rows, smooth.origin), (5, 4, DVec2::new(8.0, -16.0)));
    let sum = |map: &CoverMap| map.cover.iter().map(|&value| u32::from(value)).sum::<u32>();
    assert_eq!(sum(&smooth), sum(&map));
    assert_eq!(smooth.cover[5 + 2], 45);
    assert_eq!(smooth.at(DVec2::new(28.0, -4.0)), 45.0 / 255.0);
    let empty = CoverMap { origin: DVec2::ZERO, texel: 8.0, columns: 0, rows: 0, cover: Vec::new() };
    assert_eq!(empty.smoothed(), empty);
}
