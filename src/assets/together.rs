//! Trees that are lit together [Luft 2007, 5]: one density field over all crowns, so that a small tree is darkened by
//! its tall neighbour.
//!
//! Such a lighting belongs to one tree at one position. Each tree therefore becomes its own variant, with its own
//! vertices (20 bytes each) and billboard textures (11 bytes per texel and plane, mips included). The meshes in main
//! memory and the leaves' textures stay shared.

use std::{collections::HashSet, sync::Arc};

use rayon::prelude::*;

use super::{
    StageError,
    plants::{PlantPlan, affordable_planes, bake_settings},
};
use crate::{
    bake::{
        BakedLevel, BakedPlant,
        levels::cross::bake_cross,
        lighting::{
            BakedLighting, ExpressiveLighting, LightingSettings,
            implicit::{StandPlant, bake_implicit_stand},
        },
    },
    progress::Progress,
    scatter::{Stand, packed::MAX_VARIANTS},
    scene::{Scene, Species},
};

/// Gives every tree of a species that is lit together its own plant, and lights those trees in one field. Updates
/// `stand`, `plants` and the species' `variants` to the new plants, species by species. The settings of the first such
/// species apply to all of them.
///
/// # Errors
/// [`StageError::TooManyTogether`] if there are more such trees than a forest has variants for.
pub fn light_together(
    scene: &Scene,
    plan: &mut PlantPlan,
    plants: Vec<BakedPlant>,
    stand: &mut Stand,
    progress: &mut dyn Progress,
) -> Result<Vec<BakedPlant>, StageError> {
    let chosen: Vec<bool> = scene.species.iter().map(Species::is_lit_together).collect();
    let first = plan.variants.iter().zip(&chosen).find(|(variants, chosen)| **chosen && !variants.is_empty());
    let lighting = first.and_then(|(variants, _)| plan.individuals.get(usize::from(variants.start)));
    let Some(LightingSettings::Expressive(settings)) = lighting.map(|individual| individual.lighting) else {
        return Ok(plants);
    };
    // The trees of each chosen species.
    let trees: Vec<Vec<usize>> = plan
        .variants
        .iter()
        .zip(&chosen)
        .map(|(variants, &chosen)| {
            let own = |tree: &usize| chosen && variants.contains(&stand.trees[*tree].variant);
            (0..stand.trees.len()).filter(own).collect()
        })
        .collect();
    let count: usize = trees.iter().map(Vec::len).sum();
    let others: usize = plan.variants.iter().zip(&chosen).filter(|(_, chosen)| !**chosen).map(|(v, _)| v.len()).sum();
    let limit = MAX_VARIANTS.saturating_sub(others);
    if count > limit {
        return Err(StageError::TooManyTogether { count, limit });
    }
    progress.begin("Trees lit together", count as u64);
    let order: Vec<usize> = trees.concat();
    let group: Vec<StandPlant> = order
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
    let wanted = scene.quality.cross_planes;
    let alone = plan.variants.iter().zip(&chosen).filter(|(_, chosen)| !**chosen).flat_map(|(v, _)| v.clone());
    let planes = alone.filter_map(|variant| plants.get(usize::from(variant))?.cross()).map(|cross| cross.planes.len());
    let uprights = affordable_planes(wanted, count, planes.sum());
    if uprights < wanted {
        progress.note(&format!(
            "{count} trees lit together have crosses of {uprights} upright planes instead of {wanted}: textures have no more layers"
        ));
    }
    let cross = bake_settings(&scene.quality, LightingSettings::Local, uprights).sanitized().cross;
    let lit: Vec<BakedPlant> = order
        .par_iter()
        .zip(bake.plants)
        .map(|(&tree, shading)| {
            let instance = &plants[usize::from(stand.trees[tree].variant)];
            let (normals, ambient) = (shading.normals, shading.ambient);
            let lighting = ExpressiveLighting::new(normals, ambient, bake.report.no_surface, &settings);
            let lighting = BakedLighting::Expressive(ExpressiveLighting { together: true, ..lighting });
            let cross = BakedLevel::Cross(Arc::new(bake_cross(&instance.plant, &lighting, &cross)));
            BakedPlant { lighting: Arc::new(lighting), ..instance.clone() }.with_level(cross)
        })
        .collect();
    let vertices: usize = lit.iter().flat_map(|p| &p.plant.parts).map(|part| part.mesh.positions.len()).sum();
    progress.advance(count as u64);
    progress.end();
    progress.note(&format!("{count} trees lit together: {vertices} own vertices"));

    let mut all: Vec<BakedPlant> = Vec::with_capacity(others + lit.len());
    let mut lit = lit.into_iter();
    let mut renamed = vec![0u16; plants.len()];
    for ((variants, own), chosen) in plan.variants.iter_mut().zip(&trees).zip(&chosen) {
        let first = all.len() as u16;
        if *chosen {
            for (&tree, variant) in own.iter().zip(first..) {
                stand.trees[tree].variant = variant;
            }
            all.extend(lit.by_ref().take(own.len()));
        } else {
            for (variant, new) in variants.clone().zip(first..) {
                renamed[usize::from(variant)] = new;
            }
            all.extend_from_slice(&plants[usize::from(variants.start)..usize::from(variants.end)]);
        }
        *variants = first..all.len() as u16;
    }
    let own: HashSet<usize> = order.into_iter().collect();
    for (_, tree) in stand.trees.iter_mut().enumerate().filter(|(place, _)| !own.contains(place)) {
        tree.variant = renamed[usize::from(tree.variant)];
    }
    Ok(all)
}
