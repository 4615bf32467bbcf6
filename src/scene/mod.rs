//! Scene files, times and poses that a user writes, validated.
//!
//! A scene file is [RON](https://docs.rs/ron): structures are `(field: value, ...)`, choices `Name(field: value, ...)`,
//! lists `[a, b]`, comments `//`. Optional values need no `Some`. Only `terrain` is required; every other field has
//! the default that its documentation names. Relative paths are relative to the scene file.
//!
//! ```
//! let text = r#"(
//!     terrain: Noise(size: 400, amplitude: 20),
//!     species: [(name: "oak", plant: Grown(form: Broadleaf), height: (14, 22))],
//!     trees: Scattered(stems_per_hectare: 280, min_distance: 1.5),
//!     place: (latitude: 47.5, longitude: 9.2, time: "2026-06-21T15:30+02:00"),
//! )"#;
//! let scene = canopy::scene::Scene::parse(text, "oaks.ron".as_ref())?;
//! assert_eq!(scene.place.time.utc().to_rfc3339(), "2026-06-21T13:30:00+00:00");
//!
//! let wrong = canopy::scene::Scene::parse(&text.replace("47.5", "100"), "oaks.ron".as_ref());
//! assert!(wrong.is_err_and(|error| error.to_string().starts_with("oaks.ron:5:23: `place.latitude` is 100 degrees")));
//! # Ok::<(), canopy::scene::SceneError>(())
//! ```
//!
//! A scene can also be built in code:
//!
//! ```
//! use canopy::scene::{GroundNoise, GrownPlants, Scene, ScatteredTrees, Species};
//!
//! let scene = Scene {
//!     species: vec![Species { height: (14.0, 22.0), ..Species::new("oak", GrownPlants::default()) }],
//!     trees: ScatteredTrees { stems_per_hectare: 280.0, ..ScatteredTrees::default() }.into(),
//!     ..Scene::new(GroundNoise { size: 400.0, ..GroundNoise::default() })
//! };
//! scene.validate()?;
//! # Ok::<(), canopy::scene::SceneError>(())
//! ```
//!
//! Positions are metres from the terrain's centre: +X east, −Z north. Angles in scene files and on the command line
//! are degrees, yaw is a compass bearing; [`Viewpoint`] converts both into the renderer's frame.
//!
//! Settings of other modules are those modules' own types (`Crop` of `terrain`, `Gloss` of `plant`, ...), which
//! document how a scene file writes them.

mod camera;
mod check;
mod drape;
mod error;
mod ground;
pub(crate) mod lighting;
mod locate;
mod overrides;
mod path;
mod place;
mod quality;
mod source;
mod species;
mod species_file;
mod style;
mod time;
mod trees;

pub use camera::{Camera, PathKey, Pose, Viewpoint};
pub use drape::Drape;
#[cfg(feature = "program")]
pub(crate) use error::nearest;
pub use error::{Problem, SceneError};
pub use ground::{Ground, GroundFile, GroundFlat, GroundImage, GroundNoise};
pub use lighting::{Lighting, Transfer};
pub use locate::Position;
pub use overrides::Overrides;
pub use path::Path;
pub use place::Place;
pub use quality::{Quality, QualityLevel};
pub use source::SceneSource;
pub use species::{GltfPlants, GrownForm, GrownPlants, PlantSource, Species};
pub use time::{LocalTime, TimeError, YEARS};
pub use trees::{Anchor, InventoryTrees, ScatteredTrees, Trees};

use std::fs::File;
use std::io::Read;
use std::path::{Path as FilePath, PathBuf};

use ron::extensions::Extensions;
use serde::Deserialize;

use crate::style::Style;
use check::Check;

/// A scene: terrain, trees, location, camera and quality.
#[derive(Clone, Debug, PartialEq, Deserialize, bevy::reflect::TypePath)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Name for titles and messages. Default: the file's name without its ending.
    #[serde(default)]
    pub name: String,
    /// Seed of everything random: positions, species, yaw, scale and tint of trees; any integer from 0 to
    /// 18446744073709551615. Default 1.
    #[serde(default = "one")]
    pub seed: u64,
    /// The ground. Required.
    pub terrain: Ground,
    /// A photograph over the ground, such as an orthophoto. Default: none; the ground has a colour of its own.
    #[serde(default)]
    pub drape: Option<Drape>,
    /// The species. Default: none; required if there are trees.
    #[serde(default)]
    pub species: Vec<Species>,
    /// Where trees stand. Default `None`.
    #[serde(default)]
    pub trees: Trees,
    /// Location on earth, date and air. Default: the terrain file's location, summer solstice 2026, noon UTC.
    #[serde(default)]
    pub place: Place,
    /// Camera. Default: 20 m above the terrain's centre, looking north.
    #[serde(default)]
    pub camera: Camera,
    /// Drawing quality.
    #[serde(default)]
    pub quality: Quality,
    /// The style of its pictures: `Photograph`, `Watercolour(...)`, `Lines(...)` or `Toon(...)`. Default `Photograph`.
    #[serde(default)]
    pub style: Style,
    /// The file that the scene was read from; `None` for a scene that was built in code. Not a field of a scene file.
    #[serde(skip)]
    pub file: Option<PathBuf>,
}

/// Maximum size of a scene file. A larger file is something else (a terrain, a plant), and would only waste memory.
const LARGEST_FILE: u64 = 4 << 20;

fn one() -> u64 {
    1
}

impl Default for Scene {
    /// A plane of one square kilometre without trees, placed as [`Scene::new`] says.
    fn default() -> Self {
        Self::new(GroundFlat::default())
    }
}

impl Scene {
    /// A scene of this ground without trees; everything else has the defaults of a scene file. A ground without a
    /// location on earth is placed at 47.5° N, 9.2° E; a terrain file keeps its own location.
    pub fn new(terrain: impl Into<Ground>) -> Self {
        let terrain = terrain.into();
        let place = if terrain.may_know_its_place() { Place::default() } else { Place::at(47.5, 9.2) };
        Self {
            name: "scene".to_owned(),
            seed: one(),
            terrain,
            drape: None,
            species: Vec::new(),
            trees: Trees::default(),
            place,
            camera: Camera::default(),
            quality: Quality::default(),
            style: Style::default(),
            file: None,
        }
    }

    /// The scene's name in messages: its file, or "the scene `name`" if it was built in code.
    pub fn label(&self) -> String {
        match &self.file {
            Some(file) => file.display().to_string(),
            None => format!("the scene `{}`", self.name),
        }
    }

    /// Checks that all values are in the ranges that their documentation names. [`read`](Self::read) and
    /// [`parse`](Self::parse) have done so, with the position of each value. The build does it for a scene that was
    /// built in code or changed after it was read.
    ///
    /// # Errors
    /// [`SceneError::Invalid`], which lists every value that is out of range.
    pub fn validate(&self) -> Result<(), SceneError> {
        self.check(Check::of_values(), self.label())
    }

    fn check(&self, mut check: Check, label: String) -> Result<(), SceneError> {
        self.terrain.check(&mut check);
        if let Some(drape) = &self.drape {
            drape.check(&mut check);
        }
        species::check_all(&self.species, &mut check);
        self.trees.check(&self.species, &mut check);
        self.place.check(&self.terrain, &mut check);
        self.camera.check(&mut check);
        self.quality.check(&mut check);
        style::check(&self.style, &mut check);
        check.finish(label)
    }

    /// Prepends `folder` to every relative path in the scene. A scene from a file already has this done; the paths of a
    /// scene that was built in code are relative to the working directory.
    pub fn resolve_paths(&mut self, folder: &FilePath) {
        self.terrain.resolve(folder);
        if let Some(drape) = &mut self.drape {
            drape.resolve(folder);
        }
        self.trees.resolve(folder);
        self.species.iter_mut().for_each(|species| species.resolve(folder));
        style::resolve(&mut self.style, folder);
    }

    /// Reads and validates a scene file, once and from its beginning to its end, so that it may be a pipe. Relative paths
    /// in it become relative to the working directory, that is, ready to open; those of a pipe are so already.
    ///
    /// # Errors
    /// [`SceneError`]: the file cannot be read, is larger than 4 MiB, is not RON, has an unknown field, or values that
    /// are impossible (all of them are listed).
    pub fn read(path: &FilePath) -> Result<Self, SceneError> {
        let failed = |source| SceneError::Read { path: path.to_owned(), source };
        let mut bytes = Vec::new();
        let file = File::open(path).map_err(failed)?;
        let found = file.metadata().map_err(failed)?;
        let length = found.len();
        file.take(LARGEST_FILE + 1).read_to_end(&mut bytes).map_err(failed)?;
        if bytes.len() as u64 > LARGEST_FILE {
            let bytes = length.max(bytes.len() as u64);
            return Err(SceneError::TooLarge { path: path.to_owned(), bytes, limit: LARGEST_FILE });
        }
        match std::str::from_utf8(&bytes) {
            // What comes through a pipe has no folder: its paths count from the working directory.
            Ok(text) if !found.is_file() => Self::parse_in(text, path, FilePath::new("")),
            Ok(text) => Self::parse(text, path),
            Err(error) => {
                let valid = bytes.get(..error.valid_up_to()).unwrap_or_default();
                let before = String::from_utf8_lossy(valid);
                Err(SceneError::Syntax {
                    path: path.to_owned(),
                    position: Position::of_offset(&before, before.len()),
                    message: "the text is not UTF-8 from here on".to_owned(),
                    remedy: "save the file as UTF-8; a scene file is a RON text".to_owned(),
                })
            }
        }
    }

    /// Validates the text of a scene file; `path` is its source, for messages, for relative paths, and for the
    /// default name.
    ///
    /// # Errors
    /// [`SceneError::Syntax`] or [`SceneError::Invalid`].
    pub fn parse(text: &str, path: &FilePath) -> Result<Self, SceneError> {
        Self::parse_in(text, path, path.parent().unwrap_or_else(|| FilePath::new("")))
    }

    /// As [`parse`](Self::parse), with relative paths in `folder`.
    fn parse_in(text: &str, path: &FilePath, folder: &FilePath) -> Result<Self, SceneError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let options = ron::Options::default()
            .with_default_extension(Extensions::IMPLICIT_SOME)
            .with_default_extension(Extensions::UNWRAP_VARIANT_NEWTYPES);
        let mut scene: Self = options.from_str(text).map_err(|error| error::from_ron(error, text, path.to_owned()))?;
        scene.check(Check::of_text(text), path.display().to_string())?;
        scene.resolve_paths(folder);
        scene.file = Some(path.to_owned());
        if scene.name.trim().is_empty() {
            scene.name = path.file_stem().map_or("scene".to_owned(), |stem| stem.to_string_lossy().into_owned());
        }
        Ok(scene)
    }
}
