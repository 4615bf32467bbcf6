//! Small scenes, and views into them.

use canopy::{
    assets::{Stage, StageError},
    progress::Progress,
    scene::{LocalTime, Pose, Scene, SceneSource, Viewpoint},
};
use chrono::{DateTime, Utc};
use glam::{DVec2, DVec3};

/// A scene.
pub struct Built {
    /// The scene.
    pub stage: Stage,
    /// What was warned of.
    pub warnings: Vec<String>,
}

/// Keeps warnings and notes.
#[derive(Default)]
pub struct Heard {
    pub warnings: Vec<String>,
    pub notes: Vec<String>,
}

impl Progress for Heard {
    fn begin(&mut self, _: &str, _: u64) {}

    fn advance(&mut self, _: u64) {}

    fn end(&mut self) {}

    fn warn(&mut self, message: &str) {
        self.warnings.push(message.to_owned());
    }

    fn note(&mut self, message: &str) {
        self.notes.push(message.to_owned());
    }
}

/// Builds the scene `text`; `files` are written where its relative paths lead to.
#[track_caller]
pub fn build(text: &str, files: &[(&str, &[u8])]) -> Built {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).expect("a temporary file");
    }
    let mut heard = Heard::default();
    let stage = match Scene::parse(text, &folder.path().join("scene.ron")) {
        Ok(scene) => built(scene, &mut heard),
        Err(error) => panic!("{error}"),
    };
    Built { stage, warnings: heard.warnings }
}

/// Builds the scene.
#[track_caller]
pub fn built(scene: impl Into<SceneSource>, heard: &mut Heard) -> Stage {
    let built = scene.into().read().map_err(StageError::from).and_then(|scene| Stage::build(&scene, heard));
    match built {
        Ok(stage) => stage,
        Err(error) => panic!("{error}"),
    }
}

/// The broadleaf of all small scenes; one individual, so that it is baked once.
pub const BROADLEAF: &str =
    r#"(name: "broadleaf", plant: Grown(form: Broadleaf, individuals: 1, triangles: 5000, seed: 1), height: (9, 12))"#;

/// The place of all small scenes.
pub const PLACE: &str = r#"place: (latitude: 48, longitude: 9, time: "2026-06-21T12:30+01:00")"#;

/// The quality of all small scenes, with so many samples per pixel. Their trees, 9 to 12 m high, change from 35 m on.
pub fn quality(msaa: u32) -> String {
    format!(
        "quality: (shadow_map_size: 512, cascades: 2, shadow_distance: 120, near_distance: 67, fade_band: 19, \
         msaa: {msaa}, cross_resolution: 64, view_distance: 2000)"
    )
}

/// A grove on a hill of 200 m.
pub fn grove(msaa: u32) -> Built {
    let quality = quality(msaa);
    build(
        &format!(
            "(name: \"grove\", seed: 7, terrain: Noise(size: 200, amplitude: 6, wavelength: 120, base: 300, seed: 3), \
             species: [{BROADLEAF}], trees: Scattered(stems_per_hectare: 110, min_distance: 3, surroundings: 0, \
             clearings: (wavelength: 90, share: 0.25)), {PLACE}, {quality})"
        ),
        &[],
    )
}

/// Trees at these places (metres east and south of the middle) on a plane of 200 m.
pub fn trees_at(places: &[DVec2], msaa: u32) -> Built {
    trees_of_quality(places, &quality(msaa))
}

/// The same with a `quality: (...)` of their own.
pub fn trees_of_quality(places: &[DVec2], quality: &str) -> Built {
    let mut table = "x_m,y_m,height_m\n".to_owned();
    for place in places {
        table.push_str(&format!("{},{},11\n", place.x, -place.y));
    }
    build(
        &format!(
            "(name: \"single\", seed: 7, terrain: Flat(size: 200), species: [{BROADLEAF}], trees: Inventory(path: \
             \"trees.csv\", anchor: TerrainCentre), {PLACE}, {quality})"
        ),
        &[("trees.csv", table.as_bytes())],
    )
}

/// A view over the ground of a stage: metres east, above the ground and south; bearing and pitch in degrees.
pub fn view(stage: &Stage, position: (f64, f64, f64), yaw: f64, pitch: f64) -> Viewpoint {
    Pose { position, yaw, pitch }.viewpoint(stage.terrain.height(position.0, position.2), 50.0)
}

/// An instant, as in `2026-06-21T12:30+01:00`.
#[track_caller]
pub fn instant(text: &str) -> DateTime<Utc> {
    LocalTime::parse(text).expect("an instant with its zone").utc()
}

/// Column and row at which `point` (scene metres) is drawn; `None` behind the camera.
pub fn project(view: &Viewpoint, size: (u32, u32), point: DVec3) -> Option<DVec2> {
    let local = view.rotation().inverse() * (point - view.position);
    let focal = 0.5 * f64::from(size.1) / (0.5 * view.field_of_view).tan();
    (local.z < 0.0).then(|| {
        DVec2::new(f64::from(size.0), f64::from(size.1)) * 0.5 + DVec2::new(local.x, -local.y) * (focal / -local.z)
    })
}
