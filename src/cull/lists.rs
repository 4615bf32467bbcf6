//! The trees of one stand that a view or a cascade draws.

use std::ops::Range;

/// How the trees of a level are grouped for its draw calls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grouping {
    /// One range per variant: each variant has its own buffers.
    ByVariant,
    /// One range for all variants, sorted front to back.
    Together,
}

impl Grouping {
    /// Number of groups of a level, for plants of so many variants.
    pub fn groups(self, variants: usize) -> usize {
        match self {
            Self::ByVariant => variants,
            Self::Together => 1,
        }
    }
}

/// The trees of one page of a stand that one view draws: ranges into `visible`, which holds indices of trees.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DrawLists {
    /// Indices into the page's trees.
    pub visible: Vec<u32>,
    /// The ranges of each level: one per variant, or a single one ([`Grouping`]).
    pub levels: Vec<Vec<Range<u32>>>,
}

impl DrawLists {
    /// The lists of each level and group, one after another.
    fn assemble(levels: Vec<Vec<Vec<u32>>>) -> Self {
        let mut visible = Vec::with_capacity(levels.iter().flatten().map(Vec::len).sum());
        let mut range = |mut list: Vec<u32>| {
            let first = visible.len() as u32;
            visible.append(&mut list);
            first..visible.len() as u32
        };
        let levels = levels.into_iter().map(|groups| groups.into_iter().map(&mut range).collect()).collect();
        Self { visible, levels }
    }

    /// The ranges of `level`; none beyond the last level.
    pub fn ranges(&self, level: usize) -> &[Range<u32>] {
        self.levels.get(level).map_or(&[], Vec::as_slice)
    }

    /// Number of trees drawn in `level`.
    pub fn count(&self, level: usize) -> usize {
        self.ranges(level).iter().map(|range| range.len()).sum()
    }
}

/// One of several shares of a list. Together they have each tree once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Share {
    /// Which one, from 0 on.
    pub index: u32,
    /// How many there are.
    pub of: u32,
}

impl Share {
    /// The whole list.
    pub const ALL: Self = Self { index: 0, of: 1 };

    /// All of so many shares.
    pub fn each(of: u32) -> impl Iterator<Item = Self> {
        (0..of).map(move |index| Self { index, of })
    }

    /// The trees of `range` in this share, as `group_trees` of `shaders/cull/lists.wgsl` has them.
    pub fn cut(self, range: &Range<u32>) -> Range<u32> {
        let at = |index: u32| {
            let before = range.len() as u64 * u64::from(index.min(self.of)) / u64::from(self.of.max(1));
            range.start + before as u32
        };
        at(self.index)..at(self.index.saturating_add(1))
    }
}

/// Lists under construction: entries by level and group.
pub(super) struct ListBuilder<'a> {
    groupings: &'a [Grouping],
    lists: Vec<Vec<Vec<u32>>>,
}

impl<'a> ListBuilder<'a> {
    pub fn new(groupings: &'a [Grouping], variants: usize) -> Self {
        let lists = groupings.iter().map(|grouping| vec![Vec::new(); grouping.groups(variants)]).collect();
        Self { groupings, lists }
    }

    /// The list of a tree of `variant` in `level`; `None` for a level or a variant that does not exist.
    pub fn list(&mut self, level: usize, variant: usize) -> Option<&mut Vec<u32>> {
        let group = match self.groupings.get(level)? {
            Grouping::ByVariant => variant,
            Grouping::Together => 0,
        };
        self.lists.get_mut(level)?.get_mut(group)
    }

    pub fn finish(self) -> DrawLists {
        DrawLists::assemble(self.lists)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shares_of_lists_have_each_tree_once() {
        let levels = vec![vec![(0..10).collect(), vec![], vec![7]], vec![(0..3).collect()]];
        let whole = DrawLists::assemble(levels);
        for of in [1, 4, 20] {
            for range in whole.levels.iter().flatten() {
                let shares = Share::each(of).flat_map(|share| share.cut(range));
                assert!(shares.eq(range.clone()), "{of} shares of {range:?}");
                assert_eq!(Share::ALL.cut(range), *range);
            }
        }
        let none = [Share { index: 4, of: 4 }, Share { index: 0, of: 0 }, Share { index: u32::MAX, of: u32::MAX }];
        assert!(none.iter().all(|share| share.cut(&(3..13)).is_empty()));
    }
}
