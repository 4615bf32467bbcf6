//! Simplified models [Cook et al. 2007]: drawn as full models, with their shaders and in the light of their bake. They
//! cast their own shadow.

use bevy::{log::error_once, render::render_resource::RenderPipelineDescriptor};
use glam::Vec3;

use super::{
    model::ModelRenderer,
    reduced::{GpuReduced, Reduced},
};
use crate::{
    bake::BakedPlant,
    cull::Grouping,
    lod::Representation,
    render::{
        components::Forest,
        forest::representation::{ForestUpload, GpuLevel, LevelRenderer, LevelTarget},
        shaders::CanopyShaders,
    },
};

/// Draws simplified models.
pub struct ThinnedRenderer(ModelRenderer);

impl ThinnedRenderer {
    /// With the shaders of full models.
    pub fn new(shaders: &CanopyShaders) -> Self {
        Self(ModelRenderer::new(shaders))
    }
}

const OF: Reduced = |plant| plant.thinned().map(|reduced| reduced.baked(plant));

impl LevelRenderer for ThinnedRenderer {
    fn representation(&self) -> Representation {
        Representation::THINNED
    }

    fn label(&self) -> &'static str {
        "simplified models"
    }

    fn tint(&self) -> Vec3 {
        Vec3::new(0.9, 0.8, 0.1)
    }

    fn styled(&self) -> bool {
        true
    }

    fn grouping(&self) -> Grouping {
        self.0.grouping()
    }

    fn coarsest_shadow_texel(&self) -> Option<f64> {
        self.0.coarsest_shadow_texel()
    }

    fn upload(&self, forest: &Forest, upload: &mut ForestUpload) -> Box<dyn GpuLevel> {
        for plant in forest.plants.iter().filter(|plant| plant.thinned().is_none()) {
            error_once!(
                "the plant `{}` is not drawn as a simplified model, as none was baked for it: list \
                 `Representation::THINNED` in `BakeSettings::representations`",
                plant.plant.name
            );
        }
        Box::new(GpuReduced::new(&self.0, forest, OF, upload))
    }

    fn same_shape(&self, old: &BakedPlant, new: &BakedPlant) -> bool {
        old.thinned() == new.thinned() && self.0.same_shape(old, new)
    }

    fn pipeline(&self, features: u32, target: LevelTarget) -> RenderPipelineDescriptor {
        self.0.pipeline(features, target)
    }
}
