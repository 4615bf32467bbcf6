//! Pipelines of all levels, requested when a forest needs them.

use bevy::{
    ecs::{
        resource::Resource,
        system::{Res, ResMut},
    },
    platform::collections::HashMap,
    render::render_resource::{CachedRenderPipelineId, PipelineCache, RenderPipeline},
};

use super::{
    gpu_forest::GpuForests,
    representation::{LevelRenderer, LevelTarget},
};
use crate::{
    lod::Representation,
    render::{extract::ExtractedScene, view::PreparedFrame},
};

/// What a pipeline depends on.
type PipelineKey = (Representation, u32, LevelTarget);

/// Pipelines of all levels, by key.
#[derive(Resource, Default)]
pub struct LevelPipelines(HashMap<PipelineKey, CachedRenderPipelineId>);

impl LevelPipelines {
    /// A pipeline that was requested, once it is ready.
    pub fn get<'a>(
        &self,
        renderer: &dyn LevelRenderer,
        features: u32,
        target: LevelTarget,
        cache: &'a PipelineCache,
    ) -> Option<&'a RenderPipeline> {
        self.0.get(&(renderer.representation(), features, target)).and_then(|id| cache.get_render_pipeline(*id))
    }

    /// Whether all pipelines that `forests` need for `target` are ready.
    pub fn ready(&self, forests: &GpuForests, target: LevelTarget, cache: &PipelineCache) -> bool {
        forests.levels().all(|level| {
            let features = level.gpu.features(target);
            features.into_iter().all(|features| self.get(&*level.renderer, features, target, cache).is_some())
        })
    }
}

/// Requests the pipelines that the view and its shadow maps need.
pub fn prepare_pipelines(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    cache: Res<PipelineCache>,
    mut pipelines: ResMut<LevelPipelines>,
) {
    let Some(view) = &frame.view else { return };
    let shadow = (scene.shadow.cascades > 0 || scene.mesh_shadows).then_some(LevelTarget::ShadowMap);
    for target in [LevelTarget::View(view.attachment)].into_iter().chain(shadow) {
        for level in forests.levels() {
            for features in level.gpu.features(target) {
                pipelines
                    .0
                    .entry((level.renderer.representation(), features, target))
                    .or_insert_with(|| cache.queue_render_pipeline(level.renderer.pipeline(features, target)));
            }
        }
    }
}
