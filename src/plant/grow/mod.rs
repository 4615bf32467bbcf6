//! Grows species by rules, after Weber & Penn 1995, "Creation and Rendering of Realistic Trees"
//! (SIGGRAPH 95).
//!
//! ```text
//! GrowParameters ─ validate ─┐
//! seed ──────────────────────┴─> skeleton ──┬─> wood    tubes, as fine as their share of the triangles allows
//!                                (stems)    └─> foliage cards with leaf clusters, for all triangles that remain
//! ```
//!
//! The skeleton depends only on the species and the seed, so an individual keeps its shape whatever the number of
//! triangles. With fewer triangles, thin wood is omitted, and fewer but larger clusters preserve the area of the
//! foliage. A tree of 60,000 triangles takes tens of milliseconds. The textures of bark and leaves are painted once per
//! process and shared.
//!
//! The parameters say where they differ from the paper. Degradation at range (5) is not modelled, since levels of
//! detail are made elsewhere, and neither is wind (4.7).

mod foliage;
mod house;
mod parameters;
mod presets;
mod random;
mod skeleton;
pub mod textures;
mod wood;

use glam::Vec3;

pub use house::HousePlant;
pub use parameters::{
    BarkKind, BarkParameters, BranchParameters, CrownShape, GrowParameters, LeafParameters, LeafShape, Pruning,
    StemParameters,
};

use super::{Gloss, LeafTissue, PartKind, Plant, PlantMaterial, PlantPart};
use random::Random;

/// Possible numbers of triangles of a plant.
pub const TRIANGLES: std::ops::RangeInclusive<usize> = 5_000..=100_000;

/// Depth of the trunk below the ground in metres, so that there is no gap on slopes.
pub const ROOT_DEPTH: f32 = 0.5;

/// Why a plant cannot be grown.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GrowError {
    /// A value of a species is out of range, or is NaN.
    #[error("species: {field} is {value}, but must be between {low} and {high}: correct it in the species' file")]
    Parameter {
        /// Path of the field, such as `branches[1].stem.length`.
        field: String,
        /// The value found.
        value: f32,
        /// Smallest allowed value.
        low: f32,
        /// Largest allowed value.
        high: f32,
    },
    /// The requested number of triangles is outside [`TRIANGLES`].
    #[error(
        "a grown plant has between {low} and {high} triangles, but {0} were asked for: ask for a number between them",
        low = TRIANGLES.start(),
        high = TRIANGLES.end()
    )]
    Triangles(usize),
    /// The text of a species cannot be parsed.
    #[error("species, line {line}, column {column}: {message}")]
    Syntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What the parser expected or found.
        message: String,
    },
    /// Letters cannot be stamped into a leaf.
    #[error("`{text}` cannot be stamped into a leaf: write 1 to {most} of the letters {letters}")]
    Letters {
        /// The text.
        text: String,
        /// Most letters.
        most: usize,
        /// The letters that can.
        letters: &'static str,
    },
}

/// What an individual grows by.
#[derive(Clone, Debug, PartialEq)]
pub enum Rules {
    /// A tree by the rules of its species.
    Tree(Box<GrowParameters>),
    /// A house plant.
    House(HousePlant),
}

impl Rules {
    /// Grows the individual `seed` with at most (house plants: about) `triangles` triangles.
    ///
    /// # Errors
    /// Those of [`grow`] and [`HousePlant::grow`].
    pub fn grow(&self, seed: u64, triangles: usize, painting: LeafPainting) -> Result<Plant, GrowError> {
        match self {
            Self::Tree(parameters) => grow_painted(parameters, seed, triangles, painting),
            Self::House(plant) => plant.grow(seed, triangles),
        }
    }
}

/// Grows the individual `seed` of a species: a part of wood and a part of foliage. Together they have at most
/// `triangles` triangles, and less than 2 % (usually one) fewer. The same arguments give the same plant.
///
/// # Errors
/// [`GrowError::Triangles`] if `triangles` is outside [`TRIANGLES`]; [`GrowError::Parameter`] as for
/// [`GrowParameters::validate`].
pub fn grow(species: &GrowParameters, seed: u64, triangles: usize) -> Result<Plant, GrowError> {
    grow_painted(species, seed, triangles, LeafPainting::Front)
}

/// Which textures of its leaves a grown tree gets. House plants have all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LeafPainting {
    /// The front. Light that comes through has the colour that the leaves' transmission gives it.
    #[default]
    Front,
    /// All of the layered leaf model: back, transmission, thickness, absorption, and bump for broad leaves. Takes a
    /// second for the first tree of a shape of leaves, 0.1 s and 8 MB for each further one.
    Layers,
}

impl LeafPainting {
    /// What leaves with this tissue, or with none, need.
    pub fn of(tissue: Option<LeafTissue>) -> Self {
        if tissue.is_some() { Self::Layers } else { Self::Front }
    }
}

/// Grows an individual as [`grow`] does, with the textures of its leaves that `painting` names. All have the same meshes
/// and the same front.
///
/// # Errors
/// Those of [`grow`].
pub fn grow_painted(
    species: &GrowParameters,
    seed: u64,
    triangles: usize,
    painting: LeafPainting,
) -> Result<Plant, GrowError> {
    if !TRIANGLES.contains(&triangles) {
        return Err(GrowError::Triangles(triangles));
    }
    species.validate()?;
    let random = Random::new(seed);
    let skeleton = skeleton::grow(species, &random.split(1));
    let wood = wood::mesh(&skeleton, species, (triangles as f32 * species.wood_share) as usize);
    let foliage = foliage::mesh(&skeleton, species, &random.split(2), triangles - wood.triangles.len());

    let bark = textures::bark(species.bark.kind);
    let cluster = textures::cluster(species.leaves.shape);
    let mut leaf = PlantMaterial {
        name: "leaf".into(),
        base_color: individual_tint(species, &mut random.split(3)),
        base_color_texture: Some(cluster),
        alpha_cutoff: 0.5,
        transmission: Vec3::from(species.leaves.transmission),
        gloss: Gloss::LEAF,
        ..PlantMaterial::default()
    };
    if painting == LeafPainting::Layers {
        textures::paint_layers(&mut leaf, species.leaves.shape);
    }
    Ok(Plant {
        name: format!("{} {seed}", species.name),
        parts: vec![
            PlantPart {
                kind: PartKind::Wood,
                mesh: wood,
                material: PlantMaterial {
                    name: "bark".into(),
                    base_color: Vec3::from(species.bark.tint),
                    base_color_texture: Some(bark.color),
                    normal_texture: Some(bark.normal),
                    ..PlantMaterial::default()
                },
            },
            PlantPart { kind: PartKind::Foliage, mesh: foliage, material: leaf },
        ],
    })
}

/// The tint of an individual's foliage: darkened, and shifted towards yellowish or bluish green.
fn individual_tint(species: &GrowParameters, random: &mut Random) -> Vec3 {
    let variation = species.leaves.tint_variation;
    let darker = 1.0 - variation * random.unit();
    let hue = variation * random.signed();
    let factor = Vec3::new(1.0 - variation + hue, 1.0, 1.0 - variation - hue) * darker;
    (Vec3::from(species.leaves.tint) * factor).clamp(Vec3::ZERO, Vec3::ONE)
}
