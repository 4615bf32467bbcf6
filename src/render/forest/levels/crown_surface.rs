//! Crown surfaces [Luft 2006, 4.1]: drawn as full models, with their shaders. They cast their own shadow.

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

/// Draws crown surfaces.
pub struct CrownSurfaceRenderer(ModelRenderer);

impl CrownSurfaceRenderer {
    /// With the shaders of full models.
    pub fn new(shaders: &CanopyShaders) -> Self {
        Self(ModelRenderer::new(shaders))
    }
}

const OF: Reduced = |plant| plant.crown_surface().map(|surface| surface.baked(plant));

impl LevelRenderer for CrownSurfaceRenderer {
    fn representation(&self) -> Representation {
        Representation::SURFACE
    }

    fn label(&self) -> &'static str {
        "crown surfaces"
    }

    fn tint(&self) -> Vec3 {
        Vec3::new(0.8, 0.3, 0.9)
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
        for plant in forest.plants.iter().filter(|plant| plant.crown_surface().is_none()) {
            error_once!(
                "the plant `{}` is not drawn as a crown surface, as none was baked for it: list \
                 `Representation::SURFACE` in `BakeSettings::representations`",
                plant.plant.name
            );
        }
        Box::new(GpuReduced::new(&self.0, forest, OF, upload))
    }

    fn same_shape(&self, old: &BakedPlant, new: &BakedPlant) -> bool {
        old.crown_surface() == new.crown_surface() && self.0.same_shape(old, new)
    }

    fn pipeline(&self, features: u32, target: LevelTarget) -> RenderPipelineDescriptor {
        self.0.pipeline(features, target)
    }
}
