//! Draws one forest, level by level, into a view or a shadow map.

use bevy::render::{render_phase::TrackedRenderPass, render_resource::PipelineCache};

use super::{gpu_forest::GpuForest, pipelines::LevelPipelines, representation::LevelTarget};
use crate::cull::DrawLists;

/// Draws the trees of `lists`. Group 0 is set; `bind_level` sets group 1 for the level of that index. Levels whose
/// pipeline is not ready are skipped.
pub fn draw_levels<'a>(
    pass: &mut TrackedRenderPass<'a>,
    forest: &'a GpuForest,
    lists: &DrawLists,
    target: LevelTarget,
    pipelines: &LevelPipelines,
    cache: &'a PipelineCache,
    mut bind_level: impl FnMut(&mut TrackedRenderPass<'a>, usize),
) {
    for (index, level) in forest.levels().filter(|(index, _)| lists.count(*index) > 0) {
        bind_level(pass, index);
        for features in level.gpu.features(target) {
            let Some(pipeline) = pipelines.get(&*level.renderer, features, target, cache) else { continue };
            pass.set_render_pipeline(pipeline);
            level.gpu.draw(pass, features, target, lists.ranges(index));
        }
    }
}
