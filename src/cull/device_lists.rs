//! Numbers that the compute pass and those who read its results share.

use crate::lod::MAX_LEVELS;

/// Threads of the workgroup that sorts.
pub const SORT_THREADS: u32 = 128;
/// Threads of a workgroup that looks at clusters.
pub const TEST_THREADS: u32 = 64;
/// Word of the results at which the starts of the levels lie.
pub const STARTS: usize = 4;
/// The same of their numbers of trees.
pub const TOTALS: usize = STARTS + MAX_LEVELS;
/// Words before the ranges of the groups.
pub const HEADER: usize = TOTALS + MAX_LEVELS;
