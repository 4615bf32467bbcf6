//! Draws one forest, level by level, into a view or a shadow map.

use bevy::render::{render_phase::TrackedRenderPass, render_resource::PipelineCache};

use super::{gpu_forest::GpuForest, list_slot::PreparedPage, pipelines::LevelPipelines, representation::LevelTarget};
use crate::{cull::Share, render::frame_work::FrameWork};

/// Draws a share of the trees of `pages`. Group 0 is set; group 1 is set here, with the dynamic offset of a level. Levels whose
/// pipeline is not ready are skipped.
pub fn draw_levels<'a>(
    pass: &mut TrackedRenderPass<'a>,
    forest: &'a GpuForest,
    pages: &'a [PreparedPage],
    share: Share,
    target: LevelTarget,
    pipelines: &LevelPipelines,
    cache: &'a PipelineCache,
    work: &FrameWork,
    offset: impl Fn(usize) -> u32,
) {
    // The depth of those levels that have it first, then all that is left.
    for depth_alone in [true, false] {
        for (index, level) in forest.levels() {
            let pages = || pages.iter().filter(|page| page.trees.may_have(index));
            if pages().next().is_none() {
                continue;
            }
            for features in level.gpu.features(target) {
                let Some(stages) = pipelines.get(&*level.renderer, features, target, cache) else { continue };
                let Some(pipeline) = (if depth_alone { stages.depth } else { Some(stages.light) }) else { continue };
                pass.set_render_pipeline(pipeline);
                for page in pages() {
                    pass.set_bind_group(1, &page.bind_group, &[offset(index)]);
                    let trees = page.trees.level(index, share);
                    level.gpu.draw(pass, features, target, &trees);
                    FrameWork::add(&work.commands, trees.calls());
                }
            }
        }
    }
}
