//! House plants: single leaves large enough to be looked at, as curved meshes with all textures of the layered leaf
//! model, in pots and in a courtyard. They are the scenes of figures 3.9 to 3.15 of [Franzke 2005].
//!
//! ```text
//!  kinds ── chemistry, outline, veins ──> textures/blade ──┐
//!  blade ── curved grid ───────────────────────────────────┼─> assembly ── one part a material ──> Plant
//!  solid ── tubes, turned bodies, boxes ── textures/masonry ┘
//! ```
//!
//! Pots, walls and paths are parts of kind wood: opaque and matt. A plant takes 10 ms, its textures 0.1 to 1 s once per
//! process.

mod assembly;
mod blade;
mod courtyard;
mod kinds;
mod potted;
mod shrub;
mod solid;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::GrowError;
use super::random::Random;
use super::textures::blade::{LETTERS, can_stamp};
use crate::plant::Plant;
use assembly::{Assembly, Blade, Matter};
use blade::Pose;

/// A house plant, or what is made of some. In a scene file: `plant: Grown(form: House(RubberPlant))`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum HousePlant {
    /// One leaf on its petiole, upright, its upper side to the south (+z): 17 cm long, its tip at 0.5 m.
    Leaf,
    /// The same leaf with letters stamped into its absorption [Franzke 2005, p. 58], to be read against the light. Its
    /// colours know nothing of them, so the standard model shows none. 1 to [`HousePlant::MOST_LETTERS`] of A to Z, 0 to 9, hyphen and blank.
    Stamped(String),
    /// A rubber plant in a terracotta pot: three stems with large, thick, glossy leaves, 1.1 m high. This and the other
    /// pots stand on a paved square of 2.2 m.
    RubberPlant,
    /// A spider plant in a white pot on a stool: arching striped straps, and runners with plantlets, 0.85 m high.
    SpiderPlant,
    /// A begonia in a terracotta pot: a dome of thin pale leaves on red petioles, with pink blossoms, 0.45 m high.
    Begonia,
    /// A weeping fig grown as a bush: some 4,000 small leaves on seven stems, 1.6 m high.
    Bush,
    /// A courtyard: plastered walls with a door, paving, a bench, two planters with bushes, climbers on the walls, and all of the
    /// plants above in pots. 7 m by 7 m; the open side is the south.
    Courtyard,
}

impl HousePlant {
    /// Longest text of [`HousePlant::Stamped`].
    pub const MOST_LETTERS: usize = 12;

    /// Its name, for messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Leaf => "leaf",
            Self::Stamped(_) => "stamped leaf",
            Self::RubberPlant => "rubber plant",
            Self::SpiderPlant => "spider plant",
            Self::Begonia => "begonia",
            Self::Bush => "bush",
            Self::Courtyard => "courtyard",
        }
    }

    /// Checks the letters.
    ///
    /// # Errors
    /// [`GrowError::Letters`] for a text that is empty or too long, or has other letters.
    pub fn validate(&self) -> Result<(), GrowError> {
        let Self::Stamped(text) = self else { return Ok(()) };
        let count = text.chars().count();
        if !(1..=Self::MOST_LETTERS).contains(&count) || text.trim().is_empty() || !text.chars().all(can_stamp) {
            return Err(GrowError::Letters { text: text.clone(), most: Self::MOST_LETTERS, letters: LETTERS });
        }
        Ok(())
    }

    /// Grows the individual `seed` with about `triangles` triangles (the courtyard with some 250,000 whatever is asked
    /// for). The same arguments give the same plant.
    ///
    /// # Errors
    /// Those of [`HousePlant::validate`].
    pub fn grow(&self, seed: u64, triangles: usize) -> Result<Plant, GrowError> {
        self.validate()?;
        let mut random = Random::new(seed);
        // Cells of leaves along each side, relative to those of 20,000 triangles.
        let detail = (triangles as f32 / 20_000.0).sqrt().clamp(0.4, 2.2);
        let assembly = match self {
            Self::Leaf => single(&Blade::Single, detail),
            Self::Stamped(text) => single(&Blade::Stamped(text.to_ascii_uppercase()), detail),
            Self::RubberPlant => on_paving(&potted::rubber(&mut random, detail)),
            Self::SpiderPlant => on_paving(&potted::spider(&mut random, detail, true)),
            Self::Begonia => on_paving(&potted::begonia(&mut random, detail)),
            Self::Bush => shrub::bush(&mut random, detail, 1.0),
            Self::Courtyard => courtyard::courtyard(&mut random),
        };
        Ok(assembly.finish(&format!("{} {seed}", self.name())))
    }
}

/// A pot on a paved square.
fn on_paving(pot: &Assembly) -> Assembly {
    let mut assembly = Assembly::default();
    courtyard::paving(&mut assembly, 1.1);
    assembly.add(pot, Vec3::Y * courtyard::PAVING, 0.0, 1.0);
    assembly
}

/// One leaf on its petiole.
fn single(blade: &Blade, detail: f32) -> Assembly {
    let mut assembly = Assembly::default();
    let joint = Vec3::new(0.0, 0.335, 0.0);
    let lean = Vec3::new(0.05, 1.0, -0.48).normalize_or(Vec3::Y);
    let petiole: Vec<(Vec3, f32)> = (0..=14)
        .map(|i| {
            let t = i as f32 / 14.0;
            // It ends in the midrib.
            let bow = Vec3::new(-0.012, 0.0, 0.05) * (1.0 - t).powi(2);
            (Vec3::Y * (joint.y * t - 0.02 * (1.0 - t)) + bow + lean * (0.004 * t), 0.0021 - 0.0006 * t)
        })
        .collect();
    solid::tube(assembly.mesh(&Matter::Stem(Vec3::new(0.20, 0.23, 0.07))), &petiole, 12);
    let pose = Pose {
        joint,
        along: lean,
        up: Vec3::new(0.08, 0.48, 1.0),
        height: 0.175,
        bend: 0.55,
        late: 0.7,
        fold: 0.16,
        curl: 0.10,
        waves: (0.012, 3.0),
        twist: 0.12,
        phase: 0.6,
    };
    let cells = |count: f32| (count * detail) as usize;
    assembly.leaf(blade, &blade.grid(cells(40.0), cells(90.0)), &pose);
    assembly
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::PartKind;

    fn all() -> Vec<HousePlant> {
        use HousePlant::*;
        vec![Leaf, Stamped("CANOPY".into()), RubberPlant, SpiderPlant, Begonia, Bush, Courtyard]
    }

    #[test]
    fn every_plant_is_whole_and_stands_on_the_ground() {
        for kind in all() {
            let plant = kind.grow(3, 20_000).unwrap();
            let bounds = plant.bounds().unwrap();
            assert!(plant.parts.iter().all(|part| part.mesh.is_whole()), "{kind:?}");
            assert!((-0.4..=0.05).contains(&bounds.min.y), "{kind:?}: {bounds:?}");
            assert!((0.35..3.5).contains(&bounds.max.y), "{kind:?}: {bounds:?}");
            let foliage = plant.triangle_count(PartKind::Foliage);
            assert!((3_000..220_000).contains(&foliage), "{kind:?}: {foliage}");
            for part in plant.parts.iter().filter(|part| part.material.base_color_texture.is_some()) {
                assert_eq!(part.kind == PartKind::Foliage, !part.material.leaf_textures.is_empty(), "{kind:?}");
            }
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_plant_and_more_triangles_a_finer_one() {
        for kind in [HousePlant::Begonia, HousePlant::Bush] {
            let of = |seed, triangles| kind.grow(seed, triangles).unwrap();
            let meshes = |plant: &Plant| plant.parts.iter().map(|part| part.mesh.clone()).collect::<Vec<_>>();
            assert_eq!(meshes(&of(5, 20_000)), meshes(&of(5, 20_000)));
            assert_ne!(meshes(&of(5, 20_000)), meshes(&of(6, 20_000)));
            let count = |plant: Plant| plant.triangle_count(PartKind::Foliage);
            assert!(count(of(5, 60_000)) > count(of(5, 20_000)));
        }
    }

    #[test]
    fn letters_that_cannot_be_stamped_are_refused() {
        for text in ["", "   ", "é", "THIRTEEN LETT"] {
            let error = HousePlant::Stamped(text.into()).grow(1, 20_000).unwrap_err().to_string();
            assert!(error.contains("A"), "{error}");
        }
        assert_eq!(HousePlant::Stamped("leaf 1".into()).validate(), Ok(()));
    }
}
