//! The trees of a level in a view or a shadow map, wherever their list was made.

use std::{cell::Cell, sync::Arc};

use bevy::{
    log::error_once,
    render::{render_phase::TrackedRenderPass, render_resource::Buffer},
};

use crate::{
    cull::{DrawLists, Share},
    render::cull::{DrawTable, TreeDraw, TreeVertices},
};

/// Bytes of an indirect draw's arguments.
const ARGUMENT_BYTES: u64 = 20;

/// The trees of one page that a view or a shadow map draws.
pub enum PageTrees {
    /// Listed on the processor.
    Listed(DrawLists),
    /// Listed on the device, which has written the arguments of the draw calls.
    Indirect {
        /// Which draw call has which arguments.
        table: Arc<DrawTable>,
        /// Where they are.
        arguments: Buffer,
        /// The first byte of them.
        first: u64,
    },
}

impl PageTrees {
    /// Whether there may be trees in `level`.
    pub fn may_have(&self, level: usize) -> bool {
        match self {
            Self::Listed(lists) => lists.count(level) > 0,
            Self::Indirect { .. } => true,
        }
    }

    /// A share of the trees of `level`.
    pub fn level(&self, level: usize, share: Share) -> DrawnTrees<'_> {
        DrawnTrees { trees: self, level, share, calls: Cell::new(0) }
    }
}

/// The trees of one level of one page, or a share of them.
pub struct DrawnTrees<'a> {
    trees: &'a PageTrees,
    level: usize,
    share: Share,
    calls: Cell<u64>,
}

impl<'a> DrawnTrees<'a> {
    /// Whether a group is known to be empty.
    pub fn is_empty(&self, group: usize) -> bool {
        match self.trees {
            PageTrees::Listed(lists) => lists.ranges(self.level).get(group).is_none_or(|range| range.is_empty()),
            PageTrees::Indirect { .. } => false,
        }
    }

    /// Makes a draw call.
    pub fn draw(&self, pass: &mut TrackedRenderPass<'a>, draw: TreeDraw) {
        match self.trees {
            PageTrees::Listed(lists) => {
                let range = lists.ranges(self.level).get(draw.group).map(|range| self.share.cut(range));
                let Some(range) = range.filter(|range| !range.is_empty()) else { return };
                match draw.vertices {
                    TreeVertices::Pulled(vertices) => pass.draw(range.start * vertices..range.end * vertices, 0..1),
                    TreeVertices::Indexed(indices) => pass.draw_indexed(0..indices, 0, range),
                    TreeVertices::Instanced { first, count } => pass.draw(first..first + count, range),
                }
            }
            PageTrees::Indirect { table, arguments, first } => {
                let Some(slot) = table.slot(self.level, draw, self.share) else {
                    error_once!(
                        "level {} of a forest makes a draw call that `GpuLevel::draws` does not list: {draw:?}",
                        self.level
                    );
                    return;
                };
                let offset = first + ARGUMENT_BYTES * u64::from(slot);
                match draw.vertices {
                    TreeVertices::Pulled(_) | TreeVertices::Instanced { .. } => pass.draw_indirect(arguments, offset),
                    TreeVertices::Indexed(_) => pass.draw_indexed_indirect(arguments, offset),
                }
            }
        }
        self.calls.set(self.calls.get() + 1);
    }

    /// Number of draw calls so far.
    pub fn calls(&self) -> u64 {
        self.calls.get()
    }
}
