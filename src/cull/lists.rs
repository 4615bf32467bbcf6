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

/// The trees of one stand that one view draws: ranges into `visible`, which holds indices of trees.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DrawLists {
    /// Indices into the stand's trees.
    pub visible: Vec<u32>,
    /// The ranges of each level: one per variant, or a single one ([`Grouping`]).
    pub levels: Vec<Vec<Range<u32>>>,
}

impl DrawLists {
    /// The lists of each level and group, one after another.
    pub(super) fn assemble(levels: Vec<Vec<Vec<u32>>>) -> Self {
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

    /// The ranges of one of `parts` parts, which together have each tree once; `visible` is not copied.
    pub fn part(&self, part: usize, parts: usize) -> Self {
        let cut = |range: &Range<u32>, at: usize| range.start + (range.len() * at / parts.max(1)) as u32;
        let share = |range: &Range<u32>| cut(range, part.min(parts))..cut(range, (part + 1).min(parts));
        let levels = self.levels.iter().map(|ranges| ranges.iter().map(share).collect()).collect();
        Self { visible: Vec::new(), levels }
    }

    /// Number of trees drawn in `level`.
    pub fn count(&self, level: usize) -> usize {
        self.ranges(level).iter().map(|range| range.len()).sum()
    }
}

/// Lists under construction: entries by level and group.
pub(super) struct ListBuilder<'a, T> {
    groupings: &'a [Grouping],
    lists: Vec<Vec<Vec<T>>>,
}

impl<'a, T> ListBuilder<'a, T> {
    pub fn new(groupings: &'a [Grouping], variants: usize) -> Self {
        let groups = |grouping: &Grouping| match grouping {
            Grouping::ByVariant => variants,
            Grouping::Together => 1,
        };
        let lists = groupings.iter().map(|grouping| (0..groups(grouping)).map(|_| Vec::new()).collect()).collect();
        Self { groupings, lists }
    }

    /// The list of a tree of `variant` in `level`; `None` for a level or a variant that does not exist.
    pub fn list(&mut self, level: usize, variant: usize) -> Option<&mut Vec<T>> {
        let group = match self.groupings.get(level)? {
            Grouping::ByVariant => variant,
            Grouping::Together => 0,
        };
        self.lists.get_mut(level)?.get_mut(group)
    }

    pub fn into_lists(self) -> Vec<Vec<Vec<T>>> {
        self.lists
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_of_lists_have_each_tree_once() {
        let levels = vec![vec![(0..10).collect(), vec![], vec![7]], vec![(0..3).collect()]];
        let whole = DrawLists::assemble(levels);
        for parts in [1, 4, 20] {
            for (level, ranges) in whole.levels.iter().enumerate() {
                for (group, range) in ranges.iter().enumerate() {
                    let shares = (0..parts).flat_map(|part| whole.part(part, parts).levels[level][group].clone());
                    assert!(shares.eq(range.clone()), "{parts} parts of {range:?}");
                }
            }
        }
        assert_eq!(whole.part(4, 4).count(0) + whole.part(0, 0).count(0), 0);
    }
}
