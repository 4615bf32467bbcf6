//! Reduced plants, drawn as full models, with their shaders and in the light of their bake: simplified models [Cook et al. 2007],
//! crown surfaces [Luft 2006, 4.1] and the wood of billboard clouds. They cast their own shadow.

use std::sync::Arc;

use bevy::render::{render_phase::TrackedRenderPass, render_resource::RenderPipelineDescriptor};
use glam::Vec3;

use super::{model::ModelRenderer, not_baked::tell_not_baked};
use crate::{
    bake::{BakedLevel, BakedPlant, lighting::BakedLighting},
    cull::Grouping,
    lod::Representation,
    plant::Plant,
    render::{
        components::Forest,
        forest::representation::{DrawnTrees, ForestUpload, GpuLevel, LevelRenderer, LevelTarget, Relight, TreeDraw},
        shaders::CanopyShaders,
    },
};

/// The plant that is drawn for a baked one, if there is one.
pub type Reduced = fn(&BakedPlant) -> Option<BakedPlant>;

/// Draws one kind of reduced plant.
pub struct ReducedRenderer {
    models: ModelRenderer,
    representation: Representation,
    label: &'static str,
    tint: Vec3,
    of: Reduced,
}

impl ReducedRenderer {
    /// Draws simplified models.
    pub fn thinned(shaders: &CanopyShaders) -> Self {
        Self {
            models: ModelRenderer::new(shaders),
            representation: Representation::THINNED,
            label: "simplified models",
            tint: Vec3::new(0.9, 0.8, 0.1),
            of: |plant| plant.thinned().map(|reduced| reduced.baked(plant)),
        }
    }

    /// Draws crown surfaces.
    pub fn crown_surface(shaders: &CanopyShaders) -> Self {
        Self {
            models: ModelRenderer::new(shaders),
            representation: Representation::SURFACE,
            label: "crown surfaces",
            tint: Vec3::new(0.8, 0.3, 0.9),
            of: |plant| plant.crown_surface().map(|surface| surface.baked(plant)),
        }
    }
}

impl LevelRenderer for ReducedRenderer {
    fn representation(&self) -> Representation {
        self.representation
    }

    fn label(&self) -> &'static str {
        self.label
    }

    fn tint(&self) -> Vec3 {
        self.tint
    }

    fn styled(&self) -> bool {
        self.models.styled()
    }

    fn grouping(&self) -> Grouping {
        self.models.grouping()
    }

    fn coarsest_shadow_texel(&self) -> Option<f64> {
        self.models.coarsest_shadow_texel()
    }

    fn upload(&self, forest: &Forest, upload: &mut ForestUpload) -> Box<dyn GpuLevel> {
        tell_not_baked(&forest.plants, self);
        Box::new(GpuReduced::new(&self.models, forest, self.of, upload))
    }

    fn same_shape(&self, old: &BakedPlant, new: &BakedPlant) -> bool {
        old.level(self.representation) == new.level(self.representation) && self.models.same_shape(old, new)
    }

    fn pipeline(&self, features: u32, target: LevelTarget) -> RenderPipelineDescriptor {
        self.models.pipeline(features, target)
    }
}

/// Reduced plants of a forest on the device.
pub struct GpuReduced {
    models: Box<dyn GpuLevel>,
    of: Reduced,
}

impl GpuReduced {
    /// Uploads what `of` takes of the plants of `forest`. A plant without it is not drawn.
    pub fn new(renderer: &ModelRenderer, forest: &Forest, of: Reduced, upload: &mut ForestUpload) -> Self {
        let reduced = Forest { plants: Arc::new(reduced(&forest.plants, of)), ..forest.clone() };
        Self { models: renderer.upload(&reduced, upload), of }
    }
}

/// The reduced plants as plants of their own; an empty one for a plant that has none.
fn reduced(plants: &[BakedPlant], of: Reduced) -> Vec<BakedPlant> {
    let empty = || BakedPlant {
        plant: Arc::new(Plant::default()),
        lighting: Arc::new(BakedLighting::Local),
        levels: vec![BakedLevel::ShadowProxy(Arc::default())],
        textures: Arc::default(),
    };
    plants.iter().map(|plant| of(plant).unwrap_or_else(empty)).collect()
}

impl GpuLevel for GpuReduced {
    fn features(&self, target: LevelTarget) -> Vec<u32> {
        self.models.features(target)
    }

    fn triangles(&self, variant: usize) -> usize {
        self.models.triangles(variant)
    }

    fn draws(&self, target: LevelTarget) -> Vec<TreeDraw> {
        self.models.draws(target)
    }

    fn draw<'a>(
        &'a self,
        pass: &mut TrackedRenderPass<'a>,
        features: u32,
        target: LevelTarget,
        trees: &DrawnTrees<'a>,
    ) {
        self.models.draw(pass, features, target, trees);
    }

    fn relight(&mut self, relight: &Relight, upload: &mut ForestUpload) {
        let (old, new) = (reduced(relight.old, self.of), reduced(relight.new, self.of));
        self.models.relight(&Relight { old: &old, new: &new, suns: relight.suns }, upload);
    }
}
