//! Question: how far is each level of detail from the full model, over its size in the image, and what does it cost?
//!
//! | part | asks |
//! |---|---|
//! | `clusters` | which clustering is nearer to the plant at equal numbers of planes |
//! | `reductions` | the publication's reductions [Franzke 2005, figs. 4.9, 4.19 to 4.23] on plants of their size |
//! | `errors` | each level against the supersampled full model in the same light: four sides and above, three suns, 16 to 512 pixels |
//! | `planes` | crosses of one to eight upright planes, from sides between them |
//! | `compression` | textures of levels in blocks: bytes, time, error of texels and images |
//! | `cost` | a frame of many trees as each level |
//! | `pop` | what a frame changes while a tree shrinks by one percent a frame |
//! | `turn` | what a frame changes while a tree turns |
//! | `shimmer` | what a frame changes while the demo's camera turns by a tenth of a pixel a frame |
//!
//! `cargo bench --bench levels -- errors cost` runs those parts; without arguments all run. `CANOPY_DATA` is the folder
//! with `trees/`; without it grown trees stand in. Results: `docs/measurements/levels-of-detail.md`
//! and `texture-compression.md`.

#![allow(clippy::expect_used)]

#[path = "levels/compression.rs"]
mod compression;
#[path = "levels/cost.rs"]
mod cost;
#[path = "levels/errors.rs"]
mod errors;
#[path = "levels/motion.rs"]
mod motion;
#[path = "levels/planes.rs"]
mod planes;
#[path = "levels/shapes.rs"]
mod shapes;

use std::path::PathBuf;

use canopy::plant::Plant;
use canopy::plant::gltf::{GltfOptions, load_plant};
use canopy::plant::grow::{GrowParameters, grow};

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    let runs = |part: &str| wanted.is_empty() || wanted.iter().any(|wanted| wanted == part);
    if runs("clusters") {
        shapes::clusters();
    }
    if runs("reductions") {
        shapes::reductions();
    }
    if runs("errors") {
        errors::errors();
    }
    if runs("planes") {
        planes::planes();
    }
    if runs("compression") {
        compression::compression();
    }
    if runs("cost") {
        cost::cost();
    }
    if runs("pop") {
        motion::pop();
    }
    if runs("turn") {
        motion::turn();
    }
    if runs("shimmer") {
        motion::shimmer();
    }
}

/// The trees that are measured, with their names.
fn trees() -> Vec<(String, Plant)> {
    let folder = std::env::var_os("CANOPY_DATA").map(|data| PathBuf::from(data).join("trees"));
    let load = |name: &str| {
        let file = folder.as_ref()?.join(format!("{name}.glb"));
        let (plant, _) = load_plant(&file, &GltfOptions::default()).ok()?;
        Some((name.to_owned(), plant))
    };
    let found: Vec<_> = ["oak-medium", "aspen-medium", "pine-medium"].into_iter().filter_map(load).collect();
    if found.is_empty() { vec![grown(20_000, false), grown(20_000, true)] } else { found }
}

/// A tree that is grown by rule.
fn grown(triangles: usize, conifer: bool) -> (String, Plant) {
    let plant = stem(triangles, conifer, 1);
    (plant.name.clone(), plant)
}

fn stem(triangles: usize, conifer: bool, seed: u64) -> Plant {
    let species = if conifer { GrowParameters::conifer() } else { GrowParameters::broadleaf() };
    grow(&species, seed, triangles).expect("a shipped species grows")
}

fn triangles(plant: &Plant) -> usize {
    plant.parts.iter().map(|part| part.mesh.triangles.len()).sum()
}
