//! Culling: which trees a view or a cascade draws, and with which representation. Pure functions over a packed stand.
//!
//! Trees are sorted into cells, and the trees of a cell into [clusters](Cluster) of at most 64. A [`Volume`] is what a view
//! or a cascade can see. Clusters are tested against it and sorted front to back, so that near crowns hide what lies behind
//! before it is shaded, those at the borders of the image last; only clusters that a fade band crosses are searched tree by tree. The lists depend only on the
//! volume: no atomics, no race for their order.
//!
//! The same lists are made by a compute pass ([`render::cull`](crate::render::cull)). Both decide in whole numbers, so that
//! they agree about every tree on every device.
//!
//! Cost: one test per cluster (some 16,000 for a million trees) and one append per visible tree.

pub mod cascades;
pub mod clusters;
pub mod device_lists;
mod frustum;
mod lists;
mod select;
pub mod volume;

pub use clusters::{Cluster, Page, TreeSize, pages};
pub use frustum::Frustum;
pub use lists::{DrawLists, Grouping, Share};
pub use select::select;
pub use volume::{Drawn, SeenShadows, Volume};
