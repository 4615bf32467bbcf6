//! Reduced plants, drawn as full models: what simplified models, crown surfaces and the wood of billboard clouds have in common.

use std::sync::Arc;

use bevy::render::render_phase::TrackedRenderPass;

use super::model::ModelRenderer;
use crate::{
    bake::{BakedLevel, BakedPlant, lighting::BakedLighting},
    plant::Plant,
    render::{
        components::Forest,
        forest::representation::{DrawnTrees, ForestUpload, GpuLevel, LevelRenderer, LevelTarget, Relight, TreeDraw},
    },
};

/// The plant that is drawn for a baked one, if there is one.
pub type Reduced = fn(&BakedPlant) -> Option<BakedPlant>;

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
