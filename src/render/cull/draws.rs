//! The draw calls whose arguments the device fills in.

use bevy::{
    platform::collections::HashMap,
    render::render_resource::{Buffer, BufferUsages},
};
use bytemuck::{Pod, Zeroable};

use crate::{cull::Grouping, render::gpu::Gpu};

/// What is drawn for each tree of a draw call.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TreeVertices {
    /// So many vertices, which the shader pulls: vertex `i` belongs to the tree `visible[i / vertices]`. One instance.
    Pulled(u32),
    /// So many indices of the index buffer that is set. The instances are the trees: `visible[instance_index]`.
    Indexed(u32),
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
    /// 1 for indices.
    pub indexed: u32,
}

/// All draw calls of a forest into one kind of target, each once.
pub struct DrawTable {
    /// [`TreeDrawWords`].
    pub buffer: Buffer,
    slots: HashMap<(usize, TreeDraw), u32>,
}

impl DrawTable {
    /// The table of `draws`, each with its level. `groupings` has one entry for each level.
    pub fn new(
        gpu: &Gpu,
        groupings: &[Grouping],
        variants: usize,
        draws: impl Iterator<Item = (usize, TreeDraw)>,
    ) -> Self {
        let mut first_groups = vec![0];
        for grouping in groupings {
            first_groups.push(first_groups.last().copied().unwrap_or(0) + grouping.groups(variants));
        }
        let (mut slots, mut words) = (HashMap::default(), Vec::new());
        for (level, draw) in draws {
            let Some([first, end]) = first_groups.get(level..level + 2) else { continue };
            if first + draw.group >= *end || slots.contains_key(&(level, draw)) {
                continue;
            }
            slots.insert((level, draw), words.len() as u32);
            let (vertices, indexed) = match draw.vertices {
                TreeVertices::Pulled(vertices) => (vertices, 0),
                TreeVertices::Indexed(indices) => (indices, 1),
            };
            words.push(TreeDrawWords { group: (first + draw.group) as u32, vertices, indexed });
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

    /// Index of a draw call of `level`.
    pub fn slot(&self, level: usize, draw: TreeDraw) -> Option<u32> {
        self.slots.get(&(level, draw)).copied()
    }
}
