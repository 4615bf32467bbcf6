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
mod parameters;
mod presets;
mod random;
mod skeleton;
pub mod textures;
mod wood;

use glam::Vec3;

pub use parameters::{
    BarkKind, BarkParameters, BranchParameters, CrownShape, GrowParameters, LeafParameters, LeafShape, Pruning,
    StemParameters,
};

use super::{Gloss, PartKind, Plant, PlantMaterial, PlantPart};
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
}

/// Grows the individual `seed` of a species: a part of wood and a part of foliage. Together they have at most
/// `triangles` triangles, and less than 2 % (usually one) fewer. The same arguments give the same plant.
///
/// # Errors
/// [`GrowError::Triangles`] if `triangles` is outside [`TRIANGLES`]; [`GrowError::Parameter`] as for
/// [`GrowParameters::validate`].
pub fn grow(species: &GrowParameters, seed: u64, triangles: usize) -> Result<Plant, GrowError> {
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
    Ok(Plant {
        name: format!("{} {seed}", species.name),
        parts: vec![
            PlantPart {
                kind: PartKind::Wood,
                mesh: wood,
                material: PlantMaterial {
                    base_color: Vec3::from(species.bark.tint),
                    base_color_texture: Some(bark.color),
                    normal_texture: Some(bark.normal),
                    ..PlantMaterial::default()
                },
            },
            PlantPart {
                kind: PartKind::Foliage,
                mesh: foliage,
                material: PlantMaterial {
                    base_color: individual_tint(species, &mut random.split(3)),
                    base_color_texture: Some(cluster),
                    alpha_cutoff: 0.5,
                    transmission: Vec3::from(species.leaves.transmission),
                    gloss: Gloss::LEAF,
                    ..PlantMaterial::default()
                },
            },
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
