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
