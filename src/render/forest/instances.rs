//! Group 1 of everything that draws trees: their positions, the visible ones, and their plants.

use bevy::render::render_resource::{BindGroup, BindGroupEntries, BindingResource, Buffer, BufferBinding};
use glam::{DVec3, IVec2, Vec4};

use super::{gpu_forest::GpuForest, instance_layout::instance_layout, uniforms::ForestViewUniform};
use crate::{lod::FadeBand, render::gpu::Gpu};

/// A distance in metres beyond any tree.
const NEVER: f32 = 1e30;

/// How a level looks in a view.
#[derive(Clone, Copy, Debug, Default)]
pub struct LevelLook {
    /// The distances over which it fades in.
    pub fade_in: Option<FadeBand>,
    /// The distances over which it fades out.
    pub fade_out: Option<FadeBand>,
    /// Linear colour of its tint, and its weight.
    pub tint: Vec4,
}

/// The uniform of a view or cascade whose positions are relative to `anchor` (scene metres).
///
/// `level`: its fades and tint. A cascade has none, because trees do not fade there.
pub fn forest_view(forest: &GpuForest, anchor: DVec3, level: Option<LevelLook>) -> ForestViewUniform {
    let look = level.unwrap_or_default();
    let local = anchor - forest.forest.origin;
    let grid = forest.forest.stand.grid;
    let size = grid.size;
    let cell = (local / size).floor();
    ForestViewUniform {
        anchor_cell: IVec2::new(cell.x as i32, cell.z as i32).saturating_sub(grid.base).to_array(),
        anchor_offset: [(local.x - cell.x * size) as f32, (local.z - cell.z * size) as f32],
        anchor_y: local.y as f32,
        cell_size: size as f32,
        fade_in: look.fade_in.map_or([0.0; 2], |fade| [fade.start, fade.end]),
        fade_out: look.fade_out.map_or([NEVER; 2], |fade| [fade.start, fade.end]),
        padding: [0.0; 2],
        tint: look.tint.to_array(),
    }
}

/// Group 1 over a uniform buffer with dynamic offsets and a list of visible trees of one page.
pub fn instance_bind_group(
    gpu: &Gpu,
    forest: &GpuForest,
    page: usize,
    uniform: &Buffer,
    visible: &Buffer,
) -> BindGroup {
    // A forest without trees has no page; its list is empty too.
    let trees = forest.tree_buffer(page).unwrap_or(visible);
    gpu.bind_group(
        "canopy_instances",
        &instance_layout(),
        &BindGroupEntries::sequential((
            BindingResource::Buffer(BufferBinding {
                buffer: uniform,
                offset: 0,
                size: std::num::NonZeroU64::new(size_of::<ForestViewUniform>() as u64),
            }),
            trees.as_entire_binding(),
            visible.as_entire_binding(),
            forest.variants.as_entire_binding(),
        )),
    )
}
