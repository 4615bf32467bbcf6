//! Which representations are baked for a plant.

use serde::{Serialize, Serializer};

use super::BAKED;
use crate::lod::Representation;

/// A set of representations that need a bake. The default is what is drawn by default: full models and crossed billboards.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct LevelSet(u8);

impl LevelSet {
    /// All of [`BAKED`].
    pub fn all() -> Self {
        BAKED.iter().copied().collect()
    }

    /// Whether it holds `representation`. False for one that needs no bake.
    pub fn contains(self, representation: Representation) -> bool {
        self.iter().any(|known| known == representation)
    }

    /// Its representations, in the order of [`BAKED`].
    pub fn iter(self) -> impl Iterator<Item = Representation> {
        BAKED.iter().enumerate().filter(move |(index, _)| self.0 & (1 << index) != 0).map(|(_, known)| *known)
    }
}

impl Default for LevelSet {
    fn default() -> Self {
        [Representation::MODEL, Representation::CROSS].into()
    }
}

impl FromIterator<Representation> for LevelSet {
    /// The set of those that need a bake; others are passed over.
    fn from_iter<I: IntoIterator<Item = Representation>>(representations: I) -> Self {
        let bit = |wanted| BAKED.iter().position(|known| *known == wanted).map_or(0, |index| 1 << index);
        Self(representations.into_iter().map(bit).fold(0, |set, bit| set | bit))
    }
}

impl<const N: usize> From<[Representation; N]> for LevelSet {
    fn from(representations: [Representation; N]) -> Self {
        representations.into_iter().collect()
    }
}

impl std::fmt::Debug for LevelSet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_set().entries(self.iter()).finish()
    }
}

impl Serialize for LevelSet {
    /// By name: keys of the cache do not depend on the order of [`BAKED`]'s bits.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.iter().collect::<Vec<_>>().serialize(serializer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_holds_what_it_was_made_of_and_nothing_that_needs_no_bake() {
        let set = LevelSet::from([Representation::CLOUD, Representation::named("box"), Representation::CLOUD]);
        assert_eq!(set.iter().collect::<Vec<_>>(), [Representation::CLOUD]);
        assert!(set.contains(Representation::CLOUD) && !set.contains(Representation::named("box")));
        assert_eq!(LevelSet::all().iter().collect::<Vec<_>>(), BAKED);
        assert_eq!(LevelSet::from([]).iter().count(), 0);
    }
}
