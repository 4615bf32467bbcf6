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
    // The depth of those levels that have it first, then all that is left.
    for depth_alone in [true, false] {
        for (index, level) in forest.levels().filter(|(index, _)| lists.count(*index) > 0) {
            for features in level.gpu.features(target) {
                let Some(stages) = pipelines.get(&*level.renderer, features, target, cache) else { continue };
                let Some(pipeline) = (if depth_alone { stages.depth } else { Some(stages.light) }) else { continue };
                bind_level(pass, index);
                pass.set_render_pipeline(pipeline);
                level.gpu.draw(pass, features, target, lists.ranges(index));
            }
        }
    }
}
