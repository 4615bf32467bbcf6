//! Limits of a scene: what is possible works, and what is not is refused before the long work.

use canopy::{
    assets::{Stage, StageError},
    progress::{Progress, Silent},
    scene::Scene,
};
use glam::DVec2;

use crate::support::stage::{BROADLEAF, Heard, PLACE, build, quality};

#[test]
fn a_forest_is_as_wide_as_its_terrain() {
    for kilometres in [66, 100] {
        let built = build(
            &format!(
                "(terrain: Flat(size: {kilometres}000), species: [{BROADLEAF}], trees: Scattered(stems_per_hectare: \
                 0.01, surroundings: 0), {PLACE}, {})",
                quality(1)
            ),
            &[],
        );
        assert!(built.warnings.is_empty(), "{:?}", built.warnings);
        let stand = &built.stage.stand;
        let hectares = f64::from(kilometres * kilometres) * 100.0;
        assert!((stand.trees.len() as f64 / (0.01 * hectares) - 1.0).abs() < 0.01, "{}", stand.trees.len());
        let places: Vec<DVec2> =
            stand.trees.iter().map(|tree| tree.position(&stand.grid)).map(|p| DVec2::new(p.x, p.z)).collect();
        let low = places.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = places.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        assert!((high - low).min_element() > 0.99e3 * f64::from(kilometres), "{low} to {high}");
        let cover = built.stage.cover.as_ref().expect("the cover of the trees");
        assert!(cover.cover.len() <= 1 << 24, "{} texels", cover.cover.len());
        let end = cover.origin + cover.texel * DVec2::new(f64::from(cover.columns), f64::from(cover.rows));
        assert!(cover.origin.cmple(low).all() && end.cmpge(high).all(), "{} to {end}", cover.origin);
        // A single crown in a large texel may be less than a step of its eight bits.
        let covered = places.iter().filter(|place| cover.at(**place) > 0.0).count();
        assert!(2 * covered > places.len(), "{covered} of {}", places.len());
        assert!(built.stage.forest().is_some());
    }
}

/// A scene whose plants do not exist, so that any error but theirs comes before the bake.
fn without_plants(terrain: &str, trees: &str) -> Scene {
    let text = format!(
        "(terrain: {terrain}, species: [(name: \"x\", plant: Gltf(files: [\"absent.glb\"]), height: (2, 40))], trees: \
         {trees}, {PLACE})"
    );
    let scene = Scene::parse(&text, "scene.ron".as_ref());
    scene.unwrap_or_else(|error| panic!("{error}"))
}

fn failure(scene: &Scene, most_trees: Option<usize>) -> StageError {
    match Stage::build_within(scene, most_trees, &mut Silent) {
        Ok(stage) => panic!("{} trees", stage.stand.trees.len()),
        Err(error) => error,
    }
}

#[test]
fn more_trees_than_a_device_holds_are_refused_before_the_bake() {
    let hilly = "Noise(size: 2000, amplitude: 400, wavelength: 300, seed: 3)";
    let rules =
        "Scattered(stems_per_hectare: 200, slope_limit: 30, surroundings: 0, clearings: (wavelength: 300, share: 0.3))";
    let error = failure(&without_plants(hilly, rules), Some(1000));
    let StageError::TooManyTrees { count, limit: 1000 } = error else { panic!("{error}") };
    assert!(error_text(count).contains("--adapter"));
    let text = format!("(terrain: {hilly}, species: [{BROADLEAF}], trees: {rules}, {PLACE}, {})", quality(1));
    let real = build(&text, &[]).stage.stand.trees.len();
    // The estimate is a sample of what is built.
    assert!((count as f64 / real as f64 - 1.0).abs() < 0.03, "{count} for {real}");
    // A limit that is not reached is none.
    let within = failure(&without_plants(hilly, rules), Some(2 * real));
    assert!(matches!(within, StageError::Plant(_)), "{within}");
    let none = failure(&without_plants(hilly, rules), None);
    assert!(matches!(none, StageError::Plant(_)), "{none}");
}

fn error_text(count: usize) -> String {
    StageError::TooManyTrees { count, limit: 1000 }.to_string()
}

#[test]
fn an_inventory_counts_with_those_of_its_trees_that_stand_on_the_terrain() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let table: String = (0..30).map(|tree| format!("{},0\n", 10 * tree - 100)).collect();
    let path = folder.path().join("trees.csv");
    std::fs::write(&path, format!("x,y\n{table}")).expect("a temporary file");
    let scene = without_plants("Flat(size: 200)", &format!("Inventory(path: {path:?})"));
    // 21 of them are within 100 m of the centre.
    assert!(matches!(failure(&scene, Some(20)), StageError::TooManyTrees { count: 21, limit: 20 }));
    assert!(matches!(failure(&scene, Some(21)), StageError::Plant(_)));
}

#[test]
fn an_inventory_outside_its_terrain_is_an_error_with_both_extents() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("far.csv");
    std::fs::write(&path, "x,y\n500000,1\n500020,-3\n").expect("a temporary file");
    let scene = without_plants("Flat(size: 200)", &format!("Inventory(path: {path:?})"));
    let text = failure(&scene, None).to_string();
    for words in
        ["far.csv", "none of its 2 trees", "500000 to 500020 m east", "-3 to 1 m north", "200 m x 200 m", "anchor"]
    {
        assert!(text.contains(words), "no `{words}` in: {text}");
    }
}

#[test]
fn an_empty_inventory_is_blamed_and_not_the_rules() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("empty.csv");
    std::fs::write(&path, "x,y\n").expect("a temporary file");
    let text = format!(
        "(terrain: Flat(size: 100), species: [{BROADLEAF}], trees: Inventory(path: {path:?}), {PLACE}, {})",
        quality(1)
    );
    let warnings = build(&text, &[]).warnings;
    assert!(warnings.iter().any(|warning| warning.contains("empty.csv: there are no trees")), "{warnings:?}");
    assert!(!warnings.iter().any(|warning| warning.contains("rules")), "{warnings:?}");
}

#[test]
fn a_build_that_is_cancelled_at_once_makes_nothing() {
    struct Cancelled(Heard);
    impl Progress for Cancelled {
        fn begin(&mut self, what: &str, steps: u64) {
            self.0.begin(what, steps);
        }
        fn advance(&mut self, steps: u64) {
            self.0.advance(steps);
        }
        fn end(&mut self) {
            self.0.end();
        }
        fn warn(&mut self, message: &str) {
            self.0.warn(message);
        }
        fn note(&mut self, message: &str) {
            self.0.note(message);
        }
        fn is_cancelled(&self) -> bool {
            true
        }
    }
    let scene = without_plants("Flat(size: 200)", "Scattered()");
    let built = Stage::build(&scene, &mut Cancelled(Heard::default()));
    assert!(matches!(built, Err(StageError::Cancelled)));
}
