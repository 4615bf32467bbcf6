//! Species grown by rule, in the tradition of Weber & Penn 1995, "Creation and Rendering of Realistic Trees"
//! (SIGGRAPH 95).
//!
//! ```text
//! GrowParameters ─ validate ─┐
//! seed ──────────────────────┴─> skeleton ──┬─> wood    tubes, as fine as their share of the triangles allows
//!                                (stems)    └─> foliage cards with leaf clusters, for all triangles that remain
//! ```
//!
//! The skeleton depends on the species and the seed only, so an individual keeps its shape whatever the number of
//! triangles; with fewer triangles thin wood is left out, and fewer, larger clusters keep the area of the foliage.
//! A tree of 60,000 triangles takes some tens of milliseconds; the textures of bark and leaves are painted once per
//! process and shared.
//!
//! Departures from the paper are named at the parameters concerned. Not modelled: degradation at range (5), since
//! levels of detail are made elsewhere, and wind (4.7).

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

/// The numbers of triangles that a plant can be grown with.
pub const TRIANGLES: std::ops::RangeInclusive<usize> = 5_000..=100_000;

/// How far below the ground the trunk reaches, in metres, so that it stands on slopes without a gap.
pub const ROOT_DEPTH: f32 = 0.5;

/// Why a plant could not be grown.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GrowError {
    /// A number of a species is out of its range, or not a number.
    #[error("species: {field} is {value}, but must be between {low} and {high}: correct it in the species' file")]
    Parameter {
        /// Path of the field, as `branches[1].stem.length`.
        field: String,
        /// The value found.
        value: f32,
        /// Smallest value allowed.
        low: f32,
        /// Largest value allowed.
        high: f32,
    },
    /// The number of triangles asked for is out of [`TRIANGLES`].
    #[error(
        "a grown plant has between {low} and {high} triangles, but {0} were asked for: ask for a number between them",
        low = TRIANGLES.start(),
        high = TRIANGLES.end()
    )]
    Triangles(usize),
    /// The text of a species is not what it should be.
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

/// Grows the individual `seed` of a species: a part of wood and a part of foliage, at most `triangles` triangles
/// together and less than 2 % (in fact one) fewer. The same arguments give the same plant.
///
/// # Errors
/// [`GrowError::Triangles`] where `triangles` is outside [`TRIANGLES`]; [`GrowError::Parameter`] as
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

/// The tint of one individual's foliage: darker, and shifted between yellowish and bluish green.
fn individual_tint(species: &GrowParameters, random: &mut Random) -> Vec3 {
    let variation = species.leaves.tint_variation;
    let darker = 1.0 - variation * random.unit();
    let hue = variation * random.signed();
    let factor = Vec3::new(1.0 - variation + hue, 1.0, 1.0 - variation - hue) * darker;
    (Vec3::from(species.leaves.tint) * factor).clamp(Vec3::ZERO, Vec3::ONE)
}
