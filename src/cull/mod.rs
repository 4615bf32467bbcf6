//! Culling: which trees a view or a cascade draws, and with which representation. Pure functions over a packed stand.
//!
//! Trees are sorted into square cells. Cells are tested against the frustum and sorted front to back, so that near
//! crowns hide what lies behind before it is shaded; only cells that a fade band crosses are searched tree by
//! tree. The lists depend only on the camera: no atomics, no race for their order.
//!
//! Cost: one test per cell (8,800 cells for 36 km²) and one append per visible tree.

pub mod cascades;
mod casters;
mod frustum;
mod lists;
mod view;

pub use casters::{SeenShadows, cull_cascade, cull_light_view};
pub use frustum::Frustum;
pub use lists::{DrawLists, Grouping};
pub use view::cull_view;
