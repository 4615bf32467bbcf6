//! The draw calls whose arguments the device fills in.

use bevy::{
    platform::collections::HashMap,
    render::render_resource::{Buffer, BufferUsages},
};
use bytemuck::{Pod, Zeroable};

use crate::{
    cull::{Grouping, Share},
    render::gpu::Gpu,
};

/// What is drawn for each tree of a draw call.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TreeVertices {
    /// So many vertices, which the shader pulls: vertex `i` belongs to the tree `visible[i / vertices]`. One instance.
    Pulled(u32),
    /// So many indices of the index buffer that is set. The instances are the trees: `visible[instance_index]`.
    Indexed(u32),
    /// Vertices that the shader pulls. The instances are the trees, as for indices.
    Instanced {
        /// Index of the first one.
        first: u32,
        /// Number of them.
        count: u32,
    },
}

/// A draw call of a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TreeDraw {
    /// Which trees: a variant, or 0 for a level that draws all variants together.
    pub group: usize,
    /// What each of them has.
    pub vertices: TreeVertices,
}

/// `TreeDraw` of `shaders/cull/lists.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct TreeDrawWords {
    /// Index of the group among those of all levels.
    pub group: u32,
    /// Vertices or indices of a tree.
    pub vertices: u32,
    /// 1: indices, and trees are instances; 2: vertices, and trees are instances; 0: neither.
    pub kind: u32,
    /// The first vertex of kind 2.
    pub first_vertex: u32,
    /// Which share of the group.
    pub share: u32,
    /// How many shares there are.
    pub shares: u32,
}

impl TreeDrawWords {
    fn new(group: usize, vertices: TreeVertices, share: Share) -> Self {
        let (kind, first_vertex, vertices) = match vertices {
            TreeVertices::Pulled(vertices) => (0, 0, vertices),
            TreeVertices::Indexed(indices) => (1, 0, indices),
            TreeVertices::Instanced { first, count } => (2, first, count),
        };
        Self { group: group as u32, vertices, kind, first_vertex, share: share.index, shares: share.of }
    }
}

/// All draw calls of a forest into one kind of target, each once.
pub struct DrawTable {
    /// [`TreeDrawWords`].
    pub buffer: Buffer,
    slots: HashMap<(usize, TreeDraw, Share), u32>,
}

impl DrawTable {
    /// The table of `draws`, each with its level, for each of `shares`. `groupings` has one entry for each level.
    pub fn new(
        gpu: &Gpu,
        groupings: &[Grouping],
        variants: usize,
        draws: impl Iterator<Item = (usize, TreeDraw)>,
        shares: &[Share],
    ) -> Self {
        let mut first_groups = vec![0];
        for grouping in groupings {
            first_groups.push(first_groups.last().copied().unwrap_or(0) + grouping.groups(variants));
        }
        let (mut slots, mut words) = (HashMap::default(), Vec::new());
        for (level, draw) in draws {
            let Some([first, end]) = first_groups.get(level..level + 2) else { continue };
            for share in shares.iter().filter(|_| first + draw.group < *end) {
                slots.entry((level, draw, *share)).or_insert_with(|| {
                    words.push(TreeDrawWords::new(first + draw.group, draw.vertices, *share));
                    words.len() as u32 - 1
                });
            }
        }
        let buffer = gpu.filled_buffer("canopy_tree_draws", BufferUsages::STORAGE, &words);
        Self { buffer, slots }
    }

    /// Number of draw calls.
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// Index of a draw call of `level` for a share of its trees.
    pub fn slot(&self, level: usize, draw: TreeDraw, share: Share) -> Option<u32> {
        self.slots.get(&(level, draw, share)).copied()
    }
}
