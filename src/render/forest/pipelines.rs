//! Pipelines of all levels, requested when a forest needs them.
//!
//! A level that is costly to shade and hides much of itself is drawn in two stages, if its renderer can and the view wants
//! it: depth alone, with the alpha test, then light where the depth is that of the fragment. Each pixel is shaded once.

use bevy::{
    ecs::resource::Resource,
    platform::collections::HashMap,
    render::render_resource::{
        CachedRenderPipelineId, CompareFunction, PipelineCache, RenderPipeline, RenderPipelineDescriptor,
    },
};

use super::representation::{DEPTH_FIRST, ForestLevel, LevelRenderer, LevelTarget};
use crate::{
    lod::Representation,
    render::{extract::ExtractedScene, view::PreparedFrame},
};

/// What a pipeline depends on; the last says whether depth is drawn first.
type PipelineKey = (Representation, u32, LevelTarget, bool);

/// The pipelines with which a level is drawn.
#[derive(Clone, Copy)]
pub struct Stages<T> {
    /// Depth alone, if it is drawn first.
    pub depth: Option<T>,
    /// Light, and depth if that is not drawn first.
    pub light: T,
}

/// Pipelines of all levels, by key.
#[derive(Resource, Default)]
pub struct LevelPipelines {
    requested: HashMap<PipelineKey, Stages<CachedRenderPipelineId>>,
    /// Whether the view wants depth first.
    depth_first: bool,
}

impl LevelPipelines {
    /// Whether the view wants depth first, from the next request on.
    pub fn want_depth_first(&mut self, wanted: bool) {
        self.depth_first = wanted;
    }

    fn key(&self, renderer: &dyn LevelRenderer, features: u32, target: LevelTarget) -> PipelineKey {
        let depth_first = self.depth_first && matches!(target, LevelTarget::View(_));
        (renderer.representation(), features, target, depth_first)
    }

    /// The pipelines that were requested, once they are ready.
    pub fn get<'a>(
        &self,
        renderer: &dyn LevelRenderer,
        features: u32,
        target: LevelTarget,
        cache: &'a PipelineCache,
    ) -> Option<Stages<&'a RenderPipeline>> {
        let stages = self.requested.get(&self.key(renderer, features, target))?;
        let depth = match stages.depth {
            Some(id) => Some(cache.get_render_pipeline(id)?),
            None => None,
        };
        Some(Stages { depth, light: cache.get_render_pipeline(stages.light)? })
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
    pub fn request(&mut self, level: &ForestLevel, target: LevelTarget, cache: &PipelineCache, limit: &mut usize) {
        for features in level.gpu.features(target) {
            if *limit == 0 {
                return;
            }
            let key = self.key(&*level.renderer, features, target);
            self.requested.entry(key).or_insert_with(|| {
                *limit -= 1;
                let mut light = level.renderer.pipeline(features, target);
                let depth = match target {
                    LevelTarget::View(format) if key.3 => level.renderer.depth_pipeline(features, format),
                    _ => None,
                };
                if depth.is_some() {
                    shade_what_is_seen(&mut light);
                }
                let depth = depth.map(|depth| cache.queue_render_pipeline(depth));
                Stages { depth, light: cache.queue_render_pipeline(light) }
            });
        }
    }
}

/// Changes a pipeline that draws depth and light to one that shades only what has its depth already.
fn shade_what_is_seen(pipeline: &mut RenderPipelineDescriptor) {
    if let Some(depth) = &mut pipeline.depth_stencil {
        depth.depth_write_enabled = Some(false);
        depth.depth_compare = Some(CompareFunction::Equal);
    }
    let fragment = pipeline.fragment.as_mut().map(|fragment| &mut fragment.shader_defs);
    for defs in fragment.into_iter().chain([&mut pipeline.vertex.shader_defs]) {
        defs.push(DEPTH_FIRST.into());
    }
}

/// What the view and its shadow maps draw trees into; nothing without a view.
pub fn targets(scene: &ExtractedScene, frame: &PreparedFrame) -> impl Iterator<Item = LevelTarget> {
    let photographed = frame.view.as_ref().filter(|view| !view.styled);
    let view = photographed.map(|view| LevelTarget::View(view.attachment));
    let shadow = frame.view.is_some() && (scene.shadow.cascades > 0 || scene.mesh_shadows);
    view.into_iter().chain(shadow.then_some(LevelTarget::ShadowMap))
}
