//! Draws one forest, level by level, into a view or a shadow map.

use bevy::render::{render_phase::TrackedRenderPass, render_resource::PipelineCache};

use super::{gpu_forest::GpuForest, list_slot::PreparedPage, pipelines::LevelPipelines, representation::LevelTarget};
use crate::render::frame_work::FrameWork;

/// Draws the trees of `pages`. Group 0 is set; group 1 is set here, with the dynamic offset of a level. Levels whose
/// pipeline is not ready are skipped.
pub fn draw_levels<'a>(
    pass: &mut TrackedRenderPass<'a>,
    forest: &'a GpuForest,
    pages: &'a [PreparedPage],
    target: LevelTarget,
    pipelines: &LevelPipelines,
    cache: &'a PipelineCache,
    work: &FrameWork,
    offset: impl Fn(usize) -> u32,
) {
    for (index, level) in forest.levels() {
        if !pages.iter().any(|page| page.trees.may_have(index)) {
            continue;
        }
        for features in level.gpu.features(target) {
            let Some(pipeline) = pipelines.get(&*level.renderer, features, target, cache) else { continue };
            pass.set_render_pipeline(pipeline);
            for page in pages.iter().filter(|page| page.trees.may_have(index)) {
                pass.set_bind_group(1, &page.bind_group, &[offset(index)]);
                let trees = page.trees.level(index);
                level.gpu.draw(pass, features, target, &trees);
                FrameWork::add(&work.commands, trees.calls());
            }
        }
    }
}
