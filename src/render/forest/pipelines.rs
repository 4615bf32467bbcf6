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
    gpu_forest::{ForestLevel, GpuForests},
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

    /// Whether all pipelines that `levels` need for `target` are ready.
    pub fn ready<'a>(
        &self,
        mut levels: impl Iterator<Item = &'a ForestLevel>,
        target: LevelTarget,
        cache: &PipelineCache,
    ) -> bool {
        levels.all(|level| {
            let features = level.gpu.features(target);
            features.into_iter().all(|features| self.get(&*level.renderer, features, target, cache).is_some())
        })
    }

    /// Requests the pipelines that `level` needs for `target`, of those that were not requested before at most `limit`,
    /// which decreases with each.
    fn request(&mut self, level: &ForestLevel, target: LevelTarget, cache: &PipelineCache, limit: &mut usize) {
        for features in level.gpu.features(target) {
            if *limit == 0 {
                return;
            }
            self.0.entry((level.renderer.representation(), features, target)).or_insert_with(|| {
                *limit -= 1;
                cache.queue_render_pipeline(level.renderer.pipeline(features, target))
            });
        }
    }
}

/// What the view and its shadow maps draw trees into; nothing without a view.
pub fn targets(scene: &ExtractedScene, frame: &PreparedFrame) -> impl Iterator<Item = LevelTarget> {
    let view = frame.view.as_ref().map(|view| LevelTarget::View(view.attachment));
    let shadow = view.is_some() && (scene.shadow.cascades > 0 || scene.mesh_shadows);
    view.into_iter().chain(shadow.then_some(LevelTarget::ShadowMap))
}

/// Requests the pipelines that the view and its shadow maps need: those of forests that are drawn, and one a frame of
/// those that arrive.
pub fn prepare_pipelines(
    scene: Res<ExtractedScene>,
    frame: Res<PreparedFrame>,
    forests: Res<GpuForests>,
    cache: Res<PipelineCache>,
    mut pipelines: ResMut<LevelPipelines>,
) {
    let mut one = 1;
    for target in targets(&scene, &frame) {
        forests.levels().for_each(|level| pipelines.request(level, target, &cache, &mut { usize::MAX }));
        forests.arriving_levels().for_each(|level| pipelines.request(level, target, &cache, &mut one));
    }
}
