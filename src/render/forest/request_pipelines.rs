//! Requests the pipelines of the levels that are drawn or about to be.

use bevy::{
    ecs::system::{Res, ResMut},
    render::render_resource::PipelineCache,
};

use super::{
    gpu_forest::GpuForests,
    pipelines::{LevelPipelines, targets},
};
use crate::render::{extract::ExtractedScene, view::PreparedFrame};

/// Requests the pipelines that the view and its shadow maps need: those of forests that are drawn, and one a frame of
/// those that arrive.
pub fn prepare_pipelines(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    cache: Res<PipelineCache>,
    mut pipelines: ResMut<LevelPipelines>,
) {
    if let Some(view) = &frame.view {
        pipelines.want_depth_first(view.options.depth_first);
    }
    let mut one = 1;
    for target in targets(&scene, &frame) {
        forests.levels().for_each(|level| pipelines.request(level, target, &cache, &mut { usize::MAX }));
        forests.arriving_levels().for_each(|level| pipelines.request(level, target, &cache, &mut one));
    }
}
