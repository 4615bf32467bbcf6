//! Trees that are lit together [Luft 2007, 5]: one density field over all crowns, so that a small tree is darkened by its
//! tall neighbour.
//!
//! Such a light belongs to one tree at one place. Each tree therefore becomes a variant of its own, with vertices (20 bytes
//! each) and billboard pictures (11 bytes a texel and plane, mips included) of its own; the meshes on the processor and the
//! leaves' textures stay shared.

use std::sync::Arc;

use rayon::prelude::*;

use super::{error::AppError, plants::PlantPlan, plants::bake_settings};
use crate::{
    bake::{
        BakedPlant,
        billboard::bake_cross,
        implicit::{StandPlant, bake_implicit_stand},
        lighting::{BakedLighting, ExpressiveLighting, LightingSettings},
    },
    scatter::{Stand, Tree, packed::MAX_VARIANTS},
    scene::{Lighting, Progress, Scene},
};

/// Which variants are lit together with their neighbours.
fn chosen_variants(scene: &Scene, plan: &PlantPlan) -> Vec<bool> {
    let mut chosen = vec![false; plan.individuals.len()];
    for (species, variants) in scene.species.iter().zip(&plan.variants) {
        if matches!(&species.lighting, Some(Lighting::Expressive(expressive)) if expressive.together) {
            chosen[usize::from(variants.start)..usize::from(variants.end)].fill(true);
        }
    }
    chosen
}

/// Makes a plant of its own of every tree whose species asks for it, and lights those trees in one field. Returns the plants
/// by their new variants, to which `stand` is brought. The first such species' settings hold for all of them.
///
/// # Errors
/// [`AppError::TooManyTogether`] where the trees are more than a forest can tell apart.
pub fn light_together(
    scene: &Scene,
    plan: &PlantPlan,
    plants: Vec<BakedPlant>,
    stand: &mut Stand,
    progress: &mut dyn Progress,
) -> Result<Vec<BakedPlant>, AppError> {
    let chosen = chosen_variants(scene, plan);
    let is_chosen = |tree: &Tree| chosen.get(usize::from(tree.variant)).copied().unwrap_or(false);
    let first = plan.individuals.iter().zip(&chosen).find(|(_, chosen)| **chosen);
    let Some(LightingSettings::Expressive(settings)) = first.map(|(individual, _)| individual.lighting) else {
        return Ok(plants);
    };
    let trees: Vec<usize> = (0..stand.trees.len()).filter(|&tree| is_chosen(&stand.trees[tree])).collect();
    let others = chosen.iter().filter(|chosen| !**chosen).count();
    let limit = MAX_VARIANTS - others.min(MAX_VARIANTS);
    if trees.len() > limit {
        return Err(AppError::TooManyTogether { count: trees.len(), limit });
    }
    progress.begin("Trees lit together", trees.len() as u64);
    let group: Vec<StandPlant> = trees
        .iter()
        .map(|&tree| {
            let tree = &stand.trees[tree];
            let plant = &plants[usize::from(tree.variant)].plant;
            StandPlant { plant, position: tree.position, yaw: tree.yaw, scale: tree.scale }
        })
        .collect();
    let bake = bake_implicit_stand(&group, &settings);
    if let Some(reason) = bake.report.no_surface {
        progress.warn(&format!("trees lit together: {reason}"));
    }
    let cross = bake_settings(&scene.quality, LightingSettings::Local).in_range().cross;
    let lit: Vec<BakedPlant> = trees
        .par_iter()
        .zip(bake.plants)
        .map(|(&tree, shading)| {
            let instance = &plants[usize::from(stand.trees[tree].variant)];
            let lighting = BakedLighting::Expressive(ExpressiveLighting {
                normals: shading.normals,
                ambient: shading.ambient,
                no_surface: bake.report.no_surface,
            });
            BakedPlant {
                plant: Arc::clone(&instance.plant),
                cross: bake_cross(&instance.plant, &lighting, &cross),
                shadow_proxy: instance.shadow_proxy.clone(),
                lighting,
            }
        })
        .collect();

    // The others first, in their order, then one a tree.
    let mut renamed = vec![0u16; chosen.len()];
    let mut all: Vec<BakedPlant> = Vec::with_capacity(others + lit.len());
    for (variant, plant) in plants.into_iter().enumerate() {
        renamed[variant] = all.len() as u16;
        if !chosen[variant] {
            all.push(plant);
        }
    }
    for tree in &mut stand.trees {
        tree.variant = renamed[usize::from(tree.variant)];
    }
    for (place, &tree) in trees.iter().enumerate() {
        stand.trees[tree].variant = (all.len() + place) as u16;
    }
    let vertices: usize = lit.iter().flat_map(|p| &p.plant.parts).map(|part| part.mesh.positions.len()).sum();
    progress.advance(trees.len() as u64);
    progress.end();
    progress.note(&format!("{} trees lit together: {vertices} vertices of their own", trees.len()));
    all.extend(lit);
    Ok(all)
}
