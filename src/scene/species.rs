//! The species of a scene: how its trees look, how tall they are and where they grow.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::check::Check;
use super::lighting::Lighting;
use crate::plant::{Gloss, LeafKind, LeafTissue, gltf::UpAxis, grow::HousePlant};

/// One species.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Species {
    /// Name, unique in the scene; inventories refer to it. Required.
    pub name: String,
    /// Weight relative to the other species that may grow at a position, 0.000001 to 1000000. Default 1.
    #[serde(default = "one")]
    pub weight: f64,
    /// Its plants. Required.
    pub plant: PlantSource,
    /// How its foliage is lit. Default: the lighting closest to the ground truth.
    #[serde(default)]
    pub lighting: Option<Lighting>,
    /// The gloss of its leaves. Default `(share: 0.045, roughness: 0.4)`, as measured on leaves.
    #[serde(default)]
    pub gloss: Gloss,
    /// The tissue of its leaves, all of its members optional: `tissue: (max_thickness: 0.0004)`. With one its leaves are drawn
    /// by layers [Franzke 2005, 3.2]: darker at flat angles, with their own back where a file has one. Default: what the file or
    /// the rules say, mostly none.
    #[serde(default)]
    pub tissue: Option<LeafTissue>,
    /// The kind of its leaves, which determines how much light passes through them: `Thin`, `Young`, `Leathery`,
    /// `Needle`, `Dead`, `AutumnYellow` or `AutumnRed`. A glTF material's own value takes precedence. Default: what the rules of a grown plant say,
    /// `Thin` for a plant from a file.
    #[serde(default)]
    pub leaf: Option<LeafKind>,
    /// Files of strokes drawn by hand on its leaves, relative to the scene file ([`LeafStrokes`](crate::plant::LeafStrokes)): styles show
    /// them. Of two files that name the same material the later one counts. Default: none.
    #[serde(default)]
    pub strokes: Vec<PathBuf>,
    /// Range of heights in metres, `(lowest, highest)`, each 0.1 to 150. Default (16, 26).
    #[serde(default = "default_height")]
    pub height: (f64, f64),
    /// Range of ground heights in metres above the terrain's datum where it grows. Default: everywhere.
    #[serde(default)]
    pub elevation: Option<(f64, f64)>,
    /// Steepest ground it grows on, in degrees, 0 to 90. Default 90: any.
    #[serde(default = "ninety")]
    pub slope_limit: f64,
    /// Radius of the trunk's foot, root flare included, in metres for a tree of mean height, 0.001 to 10; it determines
    /// how far a trunk must extend into a slope. Default: 1.5 % of the mean height.
    #[serde(default)]
    pub trunk_radius: Option<f64>,
}

/// Where a species' plants come from: `Grown(form: Broadleaf)` or `Gltf(files: ["oak.glb"])`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub enum PlantSource {
    /// Grown by rule, no file needed.
    Grown(GrownPlants),
    /// Read from glTF or GLB files.
    Gltf(GltfPlants),
}

/// Plants grown by rule.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GrownPlants {
    /// How they grow. Default `Broadleaf`.
    pub form: GrownForm,
    /// Number of different individuals, 1 to 16. More: more variety, memory and bake time. Default 3.
    pub individuals: u32,
    /// Triangles of one full model, 5000 to 100000. Default 20000.
    pub triangles: u32,
    /// Seed of the first individual; each further one adds 1. Default 1.
    pub seed: u64,
}

impl Default for GrownPlants {
    fn default() -> Self {
        Self { form: GrownForm::Broadleaf, individuals: 3, triangles: 20_000, seed: 1 }
    }
}

/// The rules by which a plant grows.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub enum GrownForm {
    /// The built-in broadleaf.
    Broadleaf,
    /// The built-in conifer.
    Conifer,
    /// Rules from a RON file, relative to the scene file: `form: File("../species/birch.ron")`.
    File(PathBuf),
    /// A house plant, one by one with curved leaves and all textures of the layered leaf model: `form: House(Leaf)`,
    /// `House(Stamped("CANOPY"))`, `House(RubberPlant)`, `House(SpiderPlant)`, `House(Begonia)`, `House(Bush)` or
    /// `House(Courtyard)`.
    House(HousePlant),
}

/// Plants read from files.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GltfPlants {
    /// One individual per file, 1 to 16, relative to the scene file. Required.
    pub files: Vec<PathBuf>,
    /// Names of materials that are foliage, whatever their alpha mode says. Default: none named.
    #[serde(default)]
    pub foliage: Vec<String>,
    /// Names of materials that are wood, whatever their alpha mode says. Default: none named.
    #[serde(default)]
    pub wood: Vec<String>,
    /// The axis of the files that points up, `Y` or `Z`. Default: y, as glTF demands, unless a tree clearly stands along z;
    /// that is told.
    #[serde(default)]
    pub up: Option<UpAxis>,
    /// Names of the nodes or meshes of the files that are the plant. Default: all but coarser levels of detail, collision hulls
    /// and ground planes.
    #[serde(default)]
    pub node: Vec<String>,
    /// Names of nodes, meshes or materials of the files that are left out. Default: none named.
    #[serde(default)]
    pub ignore: Vec<String>,
}

fn one() -> f64 {
    1.0
}

fn ninety() -> f64 {
    90.0
}

fn default_height() -> (f64, f64) {
    (16.0, 26.0)
}

/// Ground heights that a limit may name, in metres.
pub(super) const ELEVATIONS: std::ops::RangeInclusive<f64> = -12_000.0..=100_000.0;

impl From<GrownPlants> for PlantSource {
    fn from(grown: GrownPlants) -> Self {
        Self::Grown(grown)
    }
}

impl From<GltfPlants> for PlantSource {
    fn from(gltf: GltfPlants) -> Self {
        Self::Gltf(gltf)
    }
}

impl GltfPlants {
    /// One individual per glTF or GLB file; what is foliage follows from the materials' alpha modes.
    pub fn new(files: impl IntoIterator<Item = impl Into<PathBuf>>) -> Self {
        Self {
            files: files.into_iter().map(Into::into).collect(),
            foliage: Vec::new(),
            wood: Vec::new(),
            up: None,
            node: Vec::new(),
            ignore: Vec::new(),
        }
    }
}

impl Species {
    /// A species called `name`, with the defaults of a scene file.
    pub fn new(name: impl Into<String>, plant: impl Into<PlantSource>) -> Self {
        Self {
            name: name.into(),
            weight: one(),
            plant: plant.into(),
            lighting: None,
            gloss: Gloss::default(),
            tissue: None,
            leaf: None,
            strokes: Vec::new(),
            height: default_height(),
            elevation: None,
            slope_limit: ninety(),
            trunk_radius: None,
        }
    }

    /// Mean of the range of heights, in metres.
    pub fn mean_height(&self) -> f64 {
        0.5 * (self.height.0 + self.height.1)
    }

    /// Radius of the trunk's foot in metres for a tree of mean height, as stated or 1.5 % of that height.
    pub fn trunk_radius_m(&self) -> f64 {
        self.trunk_radius.unwrap_or(0.015 * self.mean_height())
    }

    /// Whether its trees are lit together with their neighbours.
    pub fn is_lit_together(&self) -> bool {
        matches!(&self.lighting, Some(Lighting::Expressive(expressive)) if expressive.together)
    }

    fn check(&self, at: &str, check: &mut Check) {
        check.text(&format!("{at}.name"), &self.name, "give the species a name of its own");
        check.number(&format!("{at}.weight"), self.weight, 1e-6..=1e6, "");
        check.ordered(&format!("{at}.height"), self.height, 0.1..=150.0, "m");
        if let Some(elevation) = self.elevation {
            check.interval(&format!("{at}.elevation"), elevation, ELEVATIONS, "m");
        }
        if let Some(lighting) = &self.lighting {
            lighting.check(at, check);
        }
        check.number(&format!("{at}.gloss.share"), self.gloss.reflectance, 0.0..=0.09, "");
        check.number(&format!("{at}.gloss.roughness"), self.gloss.roughness, 0.1..=1.0, "");
        if let Some(tissue) = &self.tissue {
            check_tissue(tissue, &format!("{at}.tissue"), check);
        }
        for (number, file) in self.strokes.iter().enumerate() {
            check.path(&format!("{at}.strokes[{number}]"), file);
        }
        check.number(&format!("{at}.slope_limit"), self.slope_limit, 0.0..=90.0, "degrees");
        if let Some(radius) = self.trunk_radius {
            check.number(&format!("{at}.trunk_radius"), radius, 0.001..=10.0, "m");
        }
        match &self.plant {
            PlantSource::Grown(grown) => {
                check.count(&format!("{at}.plant.individuals"), grown.individuals, 1..=16);
                check.count(&format!("{at}.plant.triangles"), grown.triangles, 5_000..=100_000);
                match &grown.form {
                    GrownForm::File(path) => check.path(&format!("{at}.plant.form"), path),
                    GrownForm::House(plant) => {
                        if let Err(error) = plant.validate() {
                            check.problem(&format!("{at}.plant.form"), error.to_string(), "choose other letters");
                        }
                    }
                    GrownForm::Broadleaf | GrownForm::Conifer => {}
                }
            }
            PlantSource::Gltf(gltf) => gltf.check(at, check),
        }
    }

    pub(super) fn resolve(&mut self, folder: &Path) {
        self.strokes.iter_mut().for_each(|file| *file = folder.join(&file));
        match &mut self.plant {
            PlantSource::Grown(GrownPlants { form: GrownForm::File(path), .. }) => *path = folder.join(&path),
            PlantSource::Grown(_) => {}
            PlantSource::Gltf(gltf) => gltf.files.iter_mut().for_each(|file| *file = folder.join(&file)),
        }
    }
}

impl GltfPlants {
    fn check(&self, at: &str, check: &mut Check) {
        if self.files.is_empty() || self.files.len() > 16 {
            check.problem(
                &format!("{at}.plant.files"),
                format!("names {} files", self.files.len()),
                "name 1 to 16 glTF or GLB files, one per individual",
            );
        }
        for (number, file) in self.files.iter().enumerate() {
            check.path(&format!("{at}.plant.files[{number}]"), file);
        }
        for (number, material) in self.wood.iter().enumerate() {
            if self.foliage.contains(material) {
                check.problem(
                    &format!("{at}.plant.wood[{number}]"),
                    format!("names the material `{material}`, which `foliage` names too"),
                    "a material is one of the two: remove it from one list",
                );
            }
        }
    }
}

fn check_tissue(tissue: &LeafTissue, at: &str, check: &mut Check) {
    check.number(&format!("{at}.max_thickness"), tissue.max_thickness, LeafTissue::THICKNESS, "m");
    for (number, absorption) in tissue.absorption_range.into_iter().enumerate() {
        check.number(&format!("{at}.absorption_range[{number}]"), absorption, LeafTissue::ABSORPTION, "1/m");
    }
    check.number(&format!("{at}.scattering"), tissue.scattering, LeafTissue::SCATTERING, "");
    for number in 0..3 {
        check.number(&format!("{at}.layers[{number}]"), tissue.layers[number], 0.0..=1.0, "");
        check.number(&format!("{at}.refraction[{number}]"), tissue.refraction[number], LeafTissue::REFRACTION, "");
        let points = u32::from(tissue.test_points[number]);
        check.count(&format!("{at}.test_points[{number}]"), points, 0..=u32::from(LeafTissue::MOST_POINTS));
    }
}

/// Checks all species of a scene, and that no two share a name.
pub(super) fn check_all(species: &[Species], check: &mut Check) {
    let mut first_of: BTreeMap<&str, usize> = BTreeMap::new();
    for (number, one) in species.iter().enumerate() {
        one.check(&format!("species[{number}]"), check);
        if let Some(first) = first_of.get(one.name.as_str()) {
            check.problem(
                &format!("species[{number}].name"),
                format!("is `{}`, the name of species[{first}] too", one.name),
                "give every species a name of its own",
            );
        } else {
            first_of.insert(&one.name, number);
        }
    }
}
